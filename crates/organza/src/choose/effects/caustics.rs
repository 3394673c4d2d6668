//! `caustics`: light that surfaces bend and gather on others. No technique here simulates it: light goes straight through what it shines on, and is as
//! much weaker behind it as its shadow says. No bound is known, for a surface may gather light in a point.

use super::candidates::{Candidate, Choice};
use super::gain::shining;
use super::{Row, take_nothing};
use crate::plan::Bound;
use crate::scene::EffectKind;
use crate::statistics::Statistics;

pub(super) static ROW: Row = Row {
    kind: EffectKind::Caustics,
    what: "light that surfaces bend and gather on others",
    without: "light goes straight through what it shines on",
    candidates: |statistics, _| vec![candidate(statistics)],
    take: take_nothing,
    work: None,
};

fn candidate(statistics: &Statistics) -> Candidate {
    let bends = statistics.objects.iter().any(|object| object.causes.contains(&EffectKind::Bending));
    if !bends || shining(statistics).next().is_none() {
        return Candidate::absent("no surface bends the light of a light");
    }
    let on = "surfaces that bend light would gather it on others, which no technique simulates".to_owned();
    let choice = Choice::Open { bound: Bound::Unknown, on, off: String::new() };
    Candidate { is_missing: true, ..Candidate::new("", choice) }
}
