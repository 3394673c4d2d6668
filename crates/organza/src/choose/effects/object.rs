//! `object.NAME`: an object as a whole. Without it, it is as if it were not visible: it shows and hides nothing, and casts no shadow.
//!
//! Along a ray of the view it takes at most the share a = 1 − e^−τ of the weights, τ the greatest optical depth that it has along such a ray. Of each light
//! it takes at most the share b from anything that is seen. So it leaves (1 − a)·(1 − b) of what the pixel has without it, and adds a·L at most, L the
//! most radiance that the object itself shows: the pixel rises by g·a·L at most, or falls by 1 − s((1 − a)·(1 − b)) at most (`gain.rs`), and its opacity
//! changes by a. The bound is the largest of the three. Both shares are 0 of an object that lies out of view and whose shadow falls on nothing that is seen.

use super::gain::{darkened, displayed, gain, share_of};
use super::{Open, Row, leave_out, object_candidates};
use crate::plan::{Bound, Plan};
use crate::scene::EffectKind;
use crate::statistics::{ObjectFacts, Statistics};

pub(super) static ROW: Row = Row {
    kind: EffectKind::Object,
    what: "an object: what it shows, hides and shadows",
    without: "the picture is that of the scene without it",
    candidates,
    take: |plan, candidates, is_on| leave_out(EffectKind::Object, plan, candidates, is_on),
    work: Some(|work, label| work.object(label)),
};

fn candidates(statistics: &Statistics, _: &Plan) -> Vec<super::Candidate> {
    object_candidates(&ROW, statistics, "no object is visible", |object| {
        let opacity = -libm::expm1(-object.view_depth);
        Open {
            bound: bound(object, opacity, statistics),
            on: "it may be seen, or cast a shadow that is".to_owned(),
            off: if opacity == 0.0 {
                "it lies out of view, and nothing that is seen loses light by it that would be missed".to_owned()
            } else {
                format!("it hides at most {:.2} % of what lies behind it", 100.0 * opacity)
            },
        }
    })
}

fn bound(object: &ObjectFacts, opacity: f64, statistics: &Statistics) -> Bound {
    let shining = statistics.lights.iter().zip(&object.light_depths).filter(|(light, _)| light.radiance > 0.0);
    let shadowed = shining.map(|(_, depth)| -libm::expm1(-depth)).fold(0.0, f64::max);
    change(opacity, shadowed, object.shown, statistics).map_or(Bound::Unknown, Bound::at_most)
}

/// The most that a displayed pixel changes without an object that shows no more than a radiance, of which the view and lights take these shares; `None`
/// where it is not known.
pub(super) fn change(opacity: f64, shadowed: f64, shown: f64, statistics: &Statistics) -> Option<f64> {
    let added = share_of(shown, opacity);
    let lost = opacity + shadowed - opacity * shadowed;
    added.is_finite().then(|| displayed(added, gain(statistics)).max(darkened(lost)).max(opacity))
}
