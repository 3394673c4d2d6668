//! The effects of each light: the light itself, and its shadow.
//!
//! | effect | without it | bound of the change of a displayed pixel |
//! |---|---|---|
//! | `light.NAME` | nothing shows its light | g·L, at most 1 |
//! | `shadow.NAME` | its light goes through everything | that of the light, times 1 − e^−τ |
//!
//! L is the most radiance that anything in the scene can send of this light, in any channel ([`LightStatistics::radiance`]). A pixel is a mean of
//! radiances with weights that sum to 1 at most, and a displayed value grows with radiance by the gain g = 12.92·2^E at most: 12.92 is the greatest
//! slope of sRGB, E the exposure in stops. A picture that is dark at that exposure is meant for another: g is no less than what makes the
//! brightest light white. τ is the greatest optical depth that a ray of the light can meet on its way to anything that receives shadows and that the
//! view may show ([`LightStatistics::opacity`]).

use super::effect;
use crate::plan::Effect;
use crate::scene::LightEffect;
use crate::shadows::DISPLAY_SLOPE;
use crate::statistics::{LightStatistics, Statistics};

/// The decisions about all lights.
#[derive(Debug, Default)]
pub(super) struct Lights {
    /// Two of each light, in their order.
    pub(super) effects: Vec<Effect>,
    /// Whether each light shines.
    pub(super) shine: Vec<bool>,
    /// Whether each light gets shadow maps.
    pub(super) shadow_maps: Vec<bool>,
    /// Sum of the bounds of what is left out.
    pub(super) spent: f64,
}

/// Decides about all lights; together, what is left out changes no displayed pixel by more than `allowance`.
pub(super) fn plan(statistics: &Statistics, allowance: f64) -> Lights {
    let lights = &statistics.lights;
    let gain = gain(lights, statistics.exposure);
    let brightness: Vec<f64> = lights.iter().map(|light| displayed(light.radiance, gain)).collect();
    let dim: Vec<Choice> = lights.iter().zip(&brightness).map(|(light, bound)| of_light(light, *bound)).collect();
    let (shine, spent_on_lights) = decide(&dim, allowance);
    let shadows: Vec<Choice> = lights
        .iter()
        .zip(&brightness)
        .zip(&shine)
        .map(|((light, bound), shines)| {
            of_shadow(light, *shines, bound * greatest_opacity(light, statistics), statistics)
        })
        .collect();
    let (shadow_maps, spent_on_shadows) = decide(&shadows, allowance - spent_on_lights);
    let effects = lights
        .iter()
        .enumerate()
        .flat_map(|(i, light)| {
            [
                dim[i].told(&LightEffect::Light.name(&light.label), shine[i]),
                shadows[i].told(&LightEffect::Shadow.name(&light.label), shadow_maps[i]),
            ]
        })
        .collect();
    Lights { effects, shine, shadow_maps, spent: spent_on_lights + spent_on_shadows }
}

/// An effect before the allowance is spent.
#[derive(Debug)]
enum Choice {
    /// The scene, or what it has, decides.
    Settled { is_on: bool, reason: String, bound: f64 },
    /// The bound decides.
    Open { bound: f64, on: String, off: String },
}

impl Choice {
    fn told(&self, name: &str, is_on: bool) -> Effect {
        let (reason, bound) = match self {
            Self::Settled { reason, bound, .. } => (reason, *bound),
            Self::Open { bound, on, off } => (if is_on { on } else { off }, *bound),
        };
        Effect { bound, ..effect(name, is_on, reason) }
    }
}

/// Which effects are on, and the sum of the bounds of those that were left out. The least bounds go first; equal ones go together or not at all, so
/// that the order of lights in a file decides nothing.
fn decide(choices: &[Choice], allowance: f64) -> (Vec<bool>, f64) {
    let mut open: Vec<(f64, usize)> = Vec::new();
    let mut is_on = vec![true; choices.len()];
    for (i, choice) in choices.iter().enumerate() {
        match choice {
            Choice::Settled { is_on: settled, .. } => is_on[i] = *settled,
            Choice::Open { bound, .. } => open.push((*bound, i)),
        }
    }
    open.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut spent = 0.0;
    for equal in open.chunk_by(|a, b| a.0 == b.0) {
        let bound: f64 = equal.iter().map(|(bound, _)| bound).sum();
        if spent + bound > allowance {
            break;
        }
        spent += bound;
        equal.iter().for_each(|(_, i)| is_on[*i] = false);
    }
    (is_on, spent)
}

/// How much a displayed value grows with radiance, at most.
pub(super) fn gain(lights: &[LightStatistics], exposure: f64) -> f64 {
    let may_shine = |light: &&LightStatistics| !light.is_dark && light.is_on != Some(false);
    // Of a light whose radiance has no bound, white is not known.
    let radiances = lights.iter().filter(may_shine).map(|light| light.radiance).filter(|radiance| radiance.is_finite());
    let brightest = radiances.fold(0.0, f64::max);
    let white = if brightest > 0.0 { brightest.recip() } else { 0.0 };
    DISPLAY_SLOPE * libm::exp2(exposure).max(white)
}

/// The most that this radiance can add to a displayed pixel.
pub(super) fn displayed(radiance: f64, gain: f64) -> f64 {
    // Nothing is shown of no radiance, however large the gain.
    if radiance == 0.0 { 0.0 } else { (gain * radiance).min(1.0) }
}

/// The greatest share of its light that a shadow takes from anything that is seen.
fn greatest_opacity(light: &LightStatistics, statistics: &Statistics) -> f64 {
    let counts = &statistics.counts;
    let everything = if counts.opaque_casters > 0 { 1.0 } else { -libm::expm1(-counts.caster_optical_depth) };
    everything.min(light.opacity)
}

fn settled(is_on: bool, reason: &str) -> Choice {
    Choice::Settled { is_on, reason: reason.to_owned(), bound: 0.0 }
}

fn of_light(light: &LightStatistics, bound: f64) -> Choice {
    if light.is_dark {
        return settled(false, "it has no intensity");
    }
    match light.is_on {
        Some(true) => Choice::Settled { is_on: true, reason: "the scene switches it on".into(), bound },
        Some(false) => Choice::Settled { is_on: false, reason: "the scene switches it off".into(), bound },
        None => Choice::Open {
            bound,
            on: "it is bright enough to be seen".to_owned(),
            off: format!("nothing sends more than a radiance of {:.1e} of it", light.radiance),
        },
    }
}

fn of_shadow(light: &LightStatistics, shines: bool, bound: f64, statistics: &Statistics) -> Choice {
    let counts = &statistics.counts;
    if light.is_dark || !shines {
        return settled(false, "its light is left out");
    }
    if light.has_shadow == Some(false) {
        return Choice::Settled { is_on: false, reason: "the scene switches it off".into(), bound };
    }
    if !light.casts_shadows {
        return settled(false, "the light has shadow = false");
    }
    if counts.receivers == 0 {
        return settled(false, "nothing can receive it: no lit splat with a shadow coefficient");
    }
    if counts.casters == 0 {
        return settled(false, "nothing can cast it");
    }
    let opacity = greatest_opacity(light, statistics);
    if opacity == 0.0 && light.has_shadow.is_none() {
        return settled(false, "nothing that is seen and could receive it lies behind what casts it");
    }
    let from = if light.points > 1 { format!(", from {} points", light.points) } else { String::new() };
    let casters = format!("{} splats or whole objects cast and {} receive it{from}", counts.casters, counts.receivers);
    let taken = 100.0 * opacity;
    let on = if opacity < 1.0 {
        format!("it takes at most {taken:.2} % of its light from anything that is seen; {casters}")
    } else {
        casters
    };
    if light.has_shadow == Some(true) {
        return Choice::Settled { is_on: true, reason: format!("the scene switches it on; {on}"), bound };
    }
    if statistics.layers.iter().any(|layer| layer == "shadow") {
        return Choice::Settled { is_on: true, reason: format!("the layer `shadow` shows it; {on}"), bound };
    }
    Choice::Open { bound, on, off: format!("nothing that is seen could lose more than {taken:.2} % of its light") }
}
