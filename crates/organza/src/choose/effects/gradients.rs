//! `gradients.NAME`: the gradients of a volume shade it as a surface. Without it light is scattered by its phase function, as if it had no gradients.
//!
//! Both ways send between nothing and L, the most that the object sends of lights and of ambient radiance, by a normal or without one
//! ([`ObjectFacts::radiance`](crate::statistics::ObjectFacts::radiance)). Along a ray of the view it takes at most the share a = 1 − e^−τ of the weights, τ the
//! greatest optical depth that it has along such a ray: the pixel changes by g·a·L at most (`gain.rs`).

use super::gain::{bound, share_of};
use super::{Open, Row, leave_out, object_candidates};
use crate::plan::Plan;
use crate::scene::EffectKind;
use crate::statistics::Statistics;

pub(super) static ROW: Row = Row {
    kind: EffectKind::Gradients,
    what: "the shading of a volume by its gradients",
    without: "it scatters light by its phase function, as if it had no gradients",
    candidates,
    take: |plan, candidates, is_on| leave_out(EffectKind::Gradients, plan, candidates, is_on),
    work: None,
};

fn candidates(statistics: &Statistics, _: &Plan) -> Vec<super::Candidate> {
    object_candidates(&ROW, statistics, "no volume is shaded by its gradient", |object| {
        let shaded = share_of(object.radiance, -libm::expm1(-object.view_depth));
        Open {
            bound: bound(shaded, statistics),
            on: "a light shades the volume by its gradient".to_owned(),
            off: format!("a pixel has no more than a radiance of {shaded:.1e} of the volume's light"),
        }
    })
}
