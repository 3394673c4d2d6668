//! `opaque`: opaque surfaces, which hide what lies behind. No bound is known, and a scene cannot switch it.

use super::super::passes::what_is_opaque;
use super::candidates::Candidate;
use super::{Row, take_nothing};
use crate::scene::EffectKind;

pub(super) static ROW: Row = Row {
    kind: EffectKind::Opaque,
    what: "opaque surfaces hide what lies behind",
    without: "they are not there",
    candidates: |statistics, _| {
        vec![match what_is_opaque(statistics) {
            None => Candidate::absent("nothing is opaque"),
            Some(what) => Candidate::on("", format!("{what} hide what lies behind")),
        }]
    },
    take: take_nothing,
    work: None,
};
