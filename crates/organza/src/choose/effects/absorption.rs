//! `absorption.NAME`: what an object bounds absorbs. Without it that is clear.
//!
//! Along a way s in it the share b = 1 − e^−σs of light is absorbed, σ the absorption of the channel that has most: a pixel loses no more than b of what
//! it has, and falls by 1 − s(1 − b) at most (`gain.rs`). The greatest σs stands in
//! [`ObjectFacts::absorption`](crate::statistics::ObjectFacts::absorption). Light of lamps is not absorbed: shadows are those of surfaces.

use super::gain::darkened;
use super::{Open, Row, leave_out, object_candidates};
use crate::plan::{Bound, Plan};
use crate::scene::EffectKind;
use crate::statistics::Statistics;

pub(super) static ROW: Row = Row {
    kind: EffectKind::Absorption,
    what: "absorption in what surfaces bound",
    without: "what it bounds is clear",
    candidates,
    take: |plan, candidates, is_on| leave_out(EffectKind::Absorption, plan, candidates, is_on),
    work: None,
};

fn candidates(statistics: &Statistics, _: &Plan) -> Vec<super::Candidate> {
    object_candidates(&ROW, statistics, "no surface bounds matter that absorbs", |object| {
        let share = -libm::expm1(-object.absorption);
        Open {
            bound: Bound::at_most(darkened(share)),
            on: "its surfaces bound matter that absorbs".to_owned(),
            off: format!("no ray that is followed loses more than {:.2} % in it", 100.0 * share),
        }
    })
}
