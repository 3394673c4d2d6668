//! `interreflection`: light that surfaces send to one another. No technique here simulates it: a picture has what lights send to a surface, and the
//! scene's ambient radiance, which stands for the rest.
//!
//! A surface that sends no more than the radiance f of an irradiance of 1 sends at most the share x = πf of what comes to it, and what comes from
//! surfaces is no brighter than L, the most that anything shows of lights. So all further orders together add no more than L·x/(1 − x).

use super::candidates::{Candidate, Choice};
use super::gain::{bound, share_of, shining};
use super::{Row, take_nothing};
use crate::plan::Bound;
use crate::scene::EffectKind;
use crate::statistics::Statistics;

pub(super) static ROW: Row = Row {
    kind: EffectKind::Interreflection,
    what: "light that surfaces send to one another",
    without: "a surface gets the light of lights and ambient radiance alone",
    candidates: |statistics, _| vec![candidate(statistics)],
    take: take_nothing,
    work: None,
};

fn candidate(statistics: &Statistics) -> Candidate {
    let is_lit = shining(statistics).next().is_some();
    if !is_lit || statistics.reflectance == 0.0 {
        return Candidate::absent("no surface reflects light");
    }
    let on =
        "surfaces in the light send some of it to one another, which no technique simulates; `[ambient]` stands for it"
            .to_owned();
    let off = "surfaces would send one another too little light to be seen".to_owned();
    let choice = Choice::Open { bound: bound_of(statistics), on, off };
    Candidate { is_missing: true, ..Candidate::new("", choice) }
}

/// The most that all orders from the second on add to a displayed pixel.
fn bound_of(statistics: &Statistics) -> Bound {
    let again = statistics.reflectance;
    if again < 1.0 { bound(share_of(statistics.brightest, again / (1.0 - again)), statistics) } else { Bound::Unknown }
}
