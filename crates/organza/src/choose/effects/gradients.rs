//! `gradients.NAME`: the gradients of a volume shade it as a surface. Without it light is scattered by its phase function, as if it had no gradients.
//!
//! Both ways send between nothing and L, the most that the object sends of lights and of ambient radiance, by a normal or without one
//! ([`ObjectFacts::radiance`](crate::statistics::ObjectFacts::radiance)): the pixel changes by g·L at most.

use super::gain::bound;
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
    object_candidates(&ROW, statistics, "no volume is shaded by its gradient", |object| Open {
        bound: bound(object.radiance, statistics),
        on: "a light shades the volume by its gradient".to_owned(),
        off: format!("the volume sends no more than a radiance of {:.1e} of all lights", object.radiance),
    })
}
