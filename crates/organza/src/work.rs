//! Work that is predicted from counts, for the bar: stages by name with rough seconds of one core.
//!
//! The constants are those of the benchmarks to a factor of two or so. A wrong one makes the bar uneven, no more.

use crate::form::PlannedObject;
use crate::scene::{Scene, SceneObject};
use crate::{SplatCount, escape_controls, printable, stage};
use std::path::Path;

/// Seconds a byte of a file.
const BYTE: f64 = 2e-8;
/// Seconds to look at a generated source on a coarse lattice.
const LOOK: f64 = 2e-3;
/// Seconds a splat that is converted.
const CONVERT: f64 = 1e-6;

/// Seconds of passes that draw.
pub(crate) mod cost {
    /// A splat of each pass.
    pub(crate) const CAST: f64 = 5e-7;
    /// An entry of a shadow map.
    pub(crate) const ENTRY: f64 = 1.2e-7;
    pub(crate) const SORT: f64 = 1e-7;
    pub(crate) const PROJECT: f64 = 1e-7;
    pub(crate) const SHADE: f64 = 1e-7;
    pub(crate) const LOOK_UP: f64 = 2e-7;
    /// A fragment, and one that is sorted in its pixel.
    pub(crate) const FRAGMENT: f64 = 5e-9;
    pub(crate) const EXACT_FRAGMENT: f64 = 1e-6;
    /// A sample of the picture.
    pub(crate) const SAMPLE: f64 = 5e-8;
}
use cost::{CAST, FRAGMENT, LOOK_UP, PROJECT, SAMPLE, SHADE, SORT};

/// Stages with their weights.
pub(crate) type Stages = Vec<(String, f64)>;

/// The stage of reading an object; `None` for one that reads no file.
pub(crate) fn reading(object: &SceneObject) -> Option<String> {
    object.source.path().map(reading_file)
}

/// The stage of reading a file.
pub(crate) fn reading_file(path: &Path) -> String {
    format!("reading {}", printable(path))
}

/// The stage of converting an object.
pub(crate) fn converting(name: &str) -> String {
    format!("converting {}", escape_controls(name))
}

/// Entries of a shadow map from which on its stage has their number: tens of seconds.
const MANY_ENTRIES: f64 = 5e7;

/// The stage of one of the shadow maps, counted from 1, of so many predicted entries.
pub(crate) fn shadow_map(k: usize, of: usize, entries: f64) -> String {
    let many = (entries >= MANY_ENTRIES).then(|| format!(", {:.0} million entries", 1e-6 * entries));
    format!("shadow map {k} of {of}{}", many.unwrap_or_default())
}

/// Before anything is read. What comes after is unknown but at least as much.
pub(crate) fn of_scene(scene: &Scene) -> Stages {
    let objects = || scene.objects.iter().filter(|o| o.visible);
    let generated = objects().filter(|o| o.source.path().is_none()).count() as f64 * LOOK;
    let length = |path: &Path| std::fs::metadata(path).map_or(0.0, |m| m.len() as f64);
    let bytes = |o: &SceneObject| Some(length(o.source.path()?));
    let mut stages = vec![(stage::READ.to_owned(), generated)];
    stages.extend(objects().filter_map(|o| Some((reading(o)?, BYTE * bytes(o)?))));
    stages.extend(scene.images().map(|path| (reading_file(path), BYTE * length(path))));
    let reading: f64 = stages.iter().map(|s| s.1).sum();
    stages.push((stage::DRAW.to_owned(), 2.0 * reading + samples(scene) * SAMPLE));
    stages
}

/// After everything was read and counted; `light_points` is how many points of lights there are, `sets` the seconds of what techniques make beside splats.
pub(crate) fn of_counts(
    scene: &Scene,
    splats: &[SplatCount],
    planned: &[PlannedObject],
    light_points: usize,
    sets: f64,
) -> Stages {
    let converted = splats.iter().zip(planned).filter(|(_, plan)| plan.splats.is_some());
    let mut stages: Stages = converted.map(|(s, _)| (converting(&s.object), CONVERT * s.predicted as f64)).collect();
    let all: f64 = splats.iter().map(|s| s.predicted as f64).sum();
    let drawn = all * (SORT + PROJECT + SHADE + 20.0 * FRAGMENT + light_points as f64 * (CAST + LOOK_UP));
    stages.push((stage::DRAW.to_owned(), drawn + sets + samples(scene) * SAMPLE));
    stages
}

/// Samples of the picture.
pub(crate) fn samples(scene: &Scene) -> f64 {
    scene.camera.with_samples(scene.render.antialias).pixels() as f64
}

/// What is translucent of a technique.
pub(crate) struct Translucent {
    /// Splats in view, about.
    pub(crate) splats: f64,
    /// Fragments of their footprints, about.
    pub(crate) fragments: f64,
    /// Whether there is anything, splats or objects by their own data.
    pub(crate) any: bool,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_shadow_map_of_many_entries_tells_them_before_it_is_built() {
        assert_eq!(shadow_map(1, 2, 3e6), "shadow map 1 of 2");
        assert_eq!(shadow_map(1, 2, 1.16e8), "shadow map 1 of 2, 116 million entries");
    }
}
