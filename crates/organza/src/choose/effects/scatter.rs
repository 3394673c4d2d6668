//! `scatter`: light that media scatter again and again. Without it light is scattered once.
//!
//! Light that was scattered n times is scattered once more with the albedo ω, and arrives from anywhere in the media. A phase function has the mean
//! of radiance over directions, so nothing sends more of it than ω·(1 − e^−τ) times the most radiance that was sent of the n-th order, where τ is
//! the greatest optical depth along a line. With x = ω·(1 − e^−τ) and L the most radiance of light that was scattered once ([`LightStatistics::radiance`](crate::statistics::LightStatistics::radiance)),
//! all orders from the second on send x/(1 − x)·L together at most.

use super::candidates::{Candidate, Choice};
use super::gain::{bound, shining};
use super::{Row, take_nothing};
use crate::plan::Bound;
use crate::scene::{EffectKind, SwitchedEffect};
use crate::statistics::{MediumStatistics, Statistics};
use crate::technique::{TABLE, row};

const WITHOUT: &str = "light is scattered once";

pub(super) static ROW: Row = Row {
    kind: EffectKind::Scatter,
    what: "light that media scatter again and again",
    without: WITHOUT,
    candidates: |statistics, _| vec![candidate(statistics)],
    take: take_nothing,
    work: None,
};

fn candidate(statistics: &Statistics) -> Candidate {
    let media = &statistics.media;
    if media.is_empty() {
        return Candidate::absent("no medium scatters light");
    }
    let bound = bound_of(media, statistics);
    let names: Vec<String> = media.iter().map(|medium| format!("'{}'", crate::shown(&medium.object))).collect();
    let names = listed(&names);
    let kind = EffectKind::Scatter;
    if SwitchedEffect::find(&statistics.switched, kind, "") == Some(false) {
        return Candidate::switched("", false, WITHOUT, bound);
    }
    if statistics.scatters_again {
        let reason = format!("{names} may scatter light again and again");
        return Candidate::new("", Choice::Settled { is_on: true, reason, bound });
    }
    let drawing = statistics.techniques.iter().map(|technique| format!("`{}`", technique.name())).collect::<Vec<_>>();
    let leave = if drawing.len() == 1 { "leaves" } else { "leave" };
    // A technique that could is named by what the scene has it do instead.
    let could = statistics.techniques.iter().any(|technique| row(*technique).scatters_by.is_some());
    let as_set = if could { ", as the scene sets it," } else { "" };
    let way =
        TABLE.iter().find_map(|row| row.scatters_by).map(|way| format!(": {way} asks for it")).unwrap_or_default();
    let drawing = listed(&drawing);
    let on = format!("{names} may scatter light again and again, which {drawing}{as_set} {leave} out{way}");
    let choice = Choice::Open { bound, on, off: format!("{names} would scatter too little light again") };
    Candidate { is_missing: true, ..Candidate::new("", choice) }
}

/// Names with commas, and "and" before the last one.
fn listed(names: &[String]) -> String {
    match names {
        [before @ .., last] if !before.is_empty() => format!("{} and {last}", before.join(", ")),
        _ => names.concat(),
    }
}

/// The most that all orders from the second on add to a displayed pixel.
fn bound_of(media: &[MediumStatistics], statistics: &Statistics) -> Bound {
    let albedo = media.iter().map(|medium| medium.albedo).fold(0.0, f64::max);
    let optical_depth: f64 = media.iter().map(|medium| medium.optical_depth).sum();
    let again = albedo * -libm::expm1(-optical_depth);
    let once: f64 = shining(statistics).map(|light| light.radiance).sum();
    let more = if again < 1.0 { again / (1.0 - again) * once } else { f64::INFINITY };
    if once == 0.0 { Bound::Nothing } else { bound(more, statistics) }
}
