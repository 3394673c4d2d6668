//! `translucency`: what is translucent, put in order. No bound is known, and a scene cannot switch it.

use super::candidates::Candidate;
use super::{Row, row_of_technique, take_nothing};
use crate::scene::{EffectKind, Technique};
use crate::statistics::Statistics;

pub(super) static ROW: Row = Row {
    kind: EffectKind::Translucency,
    what: "what lies behind translucent things shows through, in order",
    without: "nothing shows through",
    candidates: |statistics, _| vec![candidate(statistics)],
    take: take_nothing,
    work: None,
};

fn candidate(statistics: &Statistics) -> Candidate {
    let some = |t: &Technique| Some(format!("{} {}", statistics.translucent_of(*t)?, row_of_technique(*t).how));
    let everything: Vec<String> = statistics.techniques.iter().filter_map(some).collect();
    if everything.is_empty() {
        return Candidate::absent("nothing is translucent: nothing to sort");
    }
    Candidate::on("", everything.join("; "))
}
