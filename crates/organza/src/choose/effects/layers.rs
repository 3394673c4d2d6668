//! `layers`: images beside beauty and alpha, which the scene asks for.

use super::candidates::Candidate;
use super::{Row, take_nothing};
use crate::scene::EffectKind;

pub(super) static ROW: Row = Row {
    kind: EffectKind::Layers,
    what: "images beside beauty and alpha",
    without: "beauty and alpha alone are kept",
    candidates: |statistics, _| {
        vec![match statistics.layers.as_slice() {
            [] => Candidate::absent("no layer beside beauty and alpha was asked for"),
            layers => Candidate::on("", format!("asked for: {}", layers.join(", "))),
        }]
    },
    take: take_nothing,
    work: None,
};
