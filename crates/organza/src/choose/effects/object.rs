//! `object.NAME`: an object as a whole. Without it, it is as if it were not visible: it shows and hides nothing, and casts no shadow.
//!
//! Along a ray of the view it takes at most the share a = 1 − e^−τ of the weights, τ the greatest optical depth that it has along such a ray: the pixel
//! changes by a·L at most (`gain.rs`), L the most radiance that anything shows. Of a light it takes the share b at most from anything that is seen, which
//! then sends b times the light's radiance less. A pixel changes by g·(a·L + Σ b·L of the light), and its opacity by a: the bound is the larger of the
//! two. Both shares are 0 of an object that lies out of view and whose shadow falls on nothing that is seen.

use super::gain::{displayed, gain, share_of};
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
    let lights = statistics.lights.iter().zip(&object.light_depths);
    let shadowed = lights.map(|(light, depth)| share_of(light.radiance, -libm::expm1(-depth)));
    let change = share_of(statistics.brightest, opacity) + shadowed.sum::<f64>();
    if change.is_finite() { Bound::at_most(displayed(change, gain(statistics)).max(opacity)) } else { Bound::Unknown }
}
