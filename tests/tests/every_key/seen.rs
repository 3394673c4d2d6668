//! The keys of what lights see of a scene's parts: what is extracted, and where things stop.

use super::table::{Entry, one};

/// What the light sees of a ball of fog, and another light beside it.
const SEEN: &[&str] = &[
    "light=[{kind='point', position=[1, 1.5, 3], intensity=[20, 18, 16]}, {kind='point', position=[-3, 0, 1], intensity=[9, 9, 9]}]",
    "object.0={name='fog', visible=false, medium_ball={center=[0, 0, 0], radius=0.8, extinction=4, spacing=0.12}}",
    "object.2={name='it', material='m', extract={objects=['fog']}}",
];
/// Through the wall, which another light does not see.
const THROUGH: &[&str] = &[
    "light=[{kind='point', position=[1, 1.5, 3], intensity=[20, 18, 16]}, \
     {kind='spot', position=[0, 0, 2], direction=[0, 1, 0], outer=20, intensity=[9, 9, 9]}]",
    "animation={frames=3, track=[{set='object.it.transform.translate', \
     keys=[{frame=0, value=[0, 0, 0]}, {frame=2, value=[0.1, 0, -2.4]}]}]}",
];
const STOPPING: &[&str] = &[THROUGH[0], THROUGH[1], "animation.track.0.stop={}"];

pub(super) fn entries() -> Vec<Entry> {
    vec![
        one("object.extract", "object.2={name='it', material='m', extract={}}"),
        one("object.extract.light", "object.it.extract.light=1").with(SEEN),
        one("object.extract.absorbance", "object.it.extract.absorbance=0.4").with(SEEN),
        one("object.extract.objects", "object.it.extract.objects=['blocker']").with(SEEN),
        one("animation.track.stop", "animation.track.0.stop={}").at(2).with(THROUGH),
        one("animation.track.stop.light", "animation.track.0.stop.light=1").at(2).with(STOPPING),
        one("animation.track.stop.objects", "animation.track.0.stop.objects=['blocker']").at(2).with(STOPPING),
    ]
}
