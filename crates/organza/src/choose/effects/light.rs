//! `light.NAME`: a light. Without it nothing shows its light, and no displayed pixel changes by more than g·L (`gain.rs`), at most 1, where L is the
//! most radiance that anything in the scene can send of this light, in any channel ([`LightStatistics::radiance`]).

use super::Row;
use super::candidates::{Candidate, Choice};
use super::gain::bound;
use crate::plan::Plan;
use crate::scene::EffectKind;
use crate::statistics::{LightStatistics, Statistics};

const WITHOUT: &str = "nothing shows its light";

pub(super) static ROW: Row = Row {
    kind: EffectKind::Light,
    what: "the light of a lamp, a sun or a lit shape",
    without: WITHOUT,
    candidates,
    take: |plan, _, is_on| plan.lights = is_on.to_vec(),
    work: Some(|work, label| work.light(label)),
};

fn candidates(statistics: &Statistics, _: &Plan) -> Vec<Candidate> {
    statistics.lights.iter().map(|light| candidate(light, statistics)).collect()
}

fn candidate(light: &LightStatistics, statistics: &Statistics) -> Candidate {
    if light.is_dark {
        return Candidate::off(&light.label, "it has no intensity");
    }
    let bound = bound(light.radiance, statistics);
    match light.is_on {
        Some(is_on) => Candidate::switched(&light.label, is_on, WITHOUT, bound),
        None => Candidate::new(
            &light.label,
            Choice::Open {
                bound,
                on: "it is bright enough to be seen".to_owned(),
                off: format!("nothing sends more than a radiance of {:.1e} of it", light.radiance),
            },
        ),
    }
}
