//! `dispersion.NAME`: the index of what an object bounds differs by channel. Without it all channels have the index of green.
//!
//! Rays of two channels go elsewhere, as those of [bending](super::bending): the bound is the same.

use super::bending::of_rays;
use super::{Open, Row, leave_out, object_candidates};
use crate::plan::Plan;
use crate::scene::EffectKind;
use crate::statistics::Statistics;

pub(super) static ROW: Row = Row {
    kind: EffectKind::Dispersion,
    what: "an index that differs by channel, so that white light parts into colours",
    without: "all channels are bent as green is",
    candidates,
    take: |plan, candidates, is_on| leave_out(EffectKind::Dispersion, plan, candidates, is_on),
    work: None,
};

fn candidates(statistics: &Statistics, _: &Plan) -> Vec<super::Candidate> {
    object_candidates(&ROW, statistics, "no index differs by channel", |_| Open {
        bound: of_rays(EffectKind::Dispersion, statistics),
        on: "its index differs by channel: each has a ray of its own".to_owned(),
        off: "no view ray meets what bends light".to_owned(),
    })
}
