//! Light that media scatter again and again: `scatter`.
//!
//! Light that was scattered n times is scattered once more with the albedo ω, and arrives from anywhere in the media. A phase function has the mean
//! of radiance over directions, so nothing sends more of it than ω·(1 − e^−τ) times the most radiance that was sent of the n-th order, where τ is
//! the greatest optical depth along a line. With x = ω·(1 − e^−τ) and L the most radiance of light that was scattered once ([`LightStatistics::radiance`]),
//! all orders from the second on send x/(1 − x)·L together at most.

use super::effect;
use super::lights::{displayed, gain};
use crate::plan::Effect;
use crate::statistics::{LightStatistics, MediumStatistics, Statistics};
use crate::technique::TABLE;

/// The name of the effect.
pub(crate) const SCATTER: &str = "scatter";

/// Decides about light of higher orders; left out it changes no displayed pixel by more than `allowance`.
pub(super) fn plan(statistics: &Statistics, allowance: f64) -> Effect {
    let media = &statistics.media;
    if media.is_empty() {
        return effect(SCATTER, false, "no medium scatters light");
    }
    let bound = bound(media, statistics);
    let names = super::named(&media.iter().map(|medium| medium.object.clone()).collect::<Vec<_>>());
    if statistics.scatters_again {
        let reason = format!("the scene asks for it: {names} may scatter light again and again");
        return Effect { bound, ..effect(SCATTER, true, reason) };
    }
    if bound <= allowance {
        return Effect { bound, ..effect(SCATTER, false, format!("{names} would scatter too little light again")) };
    }
    let drawing = statistics.techniques.iter().map(|technique| format!("`{}`", technique.name())).collect::<Vec<_>>();
    let way =
        TABLE.iter().find_map(|row| row.scatters_by).map(|way| format!(": {way} asks for it")).unwrap_or_default();
    let reason = format!("{names} may scatter light again and again, which {} leaves out{way}", drawing.join(" and "));
    Effect { is_lacking: true, bound, ..effect(SCATTER, true, reason) }
}

/// The most that all orders from the second on add to a displayed pixel.
fn bound(media: &[MediumStatistics], statistics: &Statistics) -> f64 {
    let albedo = media.iter().map(|medium| medium.albedo).fold(0.0, f64::max);
    let optical_depth: f64 = media.iter().map(|medium| medium.optical_depth).sum();
    let again = albedo * -libm::expm1(-optical_depth);
    let may_shine = |light: &&LightStatistics| !light.is_dark && light.is_on != Some(false);
    let once: f64 = statistics.lights.iter().filter(may_shine).map(|light| light.radiance).sum();
    let more = if again < 1.0 { again / (1.0 - again) * once } else { f64::INFINITY };
    if once == 0.0 { 0.0 } else { displayed(more, gain(&statistics.lights, statistics.exposure)) }
}
