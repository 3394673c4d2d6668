//! `soft.NAME`: the size of a light. Without it all of its light comes from a point in its middle, so that its shadows have sharp borders and one shadow
//! map serves where each of its points had one.
//!
//! What a splat sends of the light lies between nothing and the light's radiance L with the size and without it, so a displayed pixel changes by g·L at
//! most (`gain.rs`). A light of which so little is seen is left out as a whole; else its size is kept.

use super::candidates::{Candidate, Choice};
use super::gain::bound;
use super::{Row, take_nothing};
use crate::plan::{Bound, Plan};
use crate::scene::{EffectKind, SwitchedEffect};
use crate::statistics::{LightStatistics, Statistics};

const WITHOUT: &str = "it shines from a point in its middle";

pub(super) static ROW: Row = Row {
    kind: EffectKind::Soft,
    what: "the size of a light, which softens its shadows",
    without: WITHOUT,
    candidates,
    take: take_nothing,
    work: Some(|work, label| work.soft(label)),
};

fn candidates(statistics: &Statistics, plan: &Plan) -> Vec<Candidate> {
    let with_size = statistics.lights.iter().zip(&plan.lights).filter(|(light, _)| light.is_extended);
    let kept = with_size.map(|(light, shines)| candidate(light, *shines, statistics));
    // Their size is gone by now.
    let switched_off = statistics.switched.iter().filter(|effect| effect.kind == EffectKind::Soft && !effect.is_on);
    let off = switched_off.map(|effect| Candidate::switched(&effect.label, false, WITHOUT, Bound::Unknown));
    let candidates: Vec<Candidate> = kept.chain(off).collect();
    if candidates.is_empty() { vec![Candidate::absent("no light has a size")] } else { candidates }
}

fn candidate(light: &LightStatistics, shines: bool, statistics: &Statistics) -> Candidate {
    let label = &light.label;
    if light.is_dark || !shines {
        return Candidate::off(label, "its light is left out");
    }
    let bound = bound(light.radiance, statistics);
    let points = light.points;
    let stands = if points == 1 { "1 point stands".to_owned() } else { format!("{points} points stand") };
    // Off, its size would be gone.
    let is_switched = SwitchedEffect::find(&statistics.switched, EffectKind::Soft, label).is_some();
    let reason = if is_switched { "it is switched on".to_owned() } else { format!("{stands} for its size") };
    Candidate::new(label, Choice::Settled { is_on: true, reason, bound })
}
