//! `shadow.NAME`: the shadow of a light. Without it its light goes through everything. With it everything that is seen loses at most the share
//! b = 1 − e^−τ of the light, where τ is the greatest optical depth that a ray of the light can meet on its way to anything that receives shadows and that
//! the view may show ([`LightStatistics::opacity`]). A pixel then loses no more than b of what it has, and falls by 1 − s(1 − b) at most (`gain.rs`). Nor
//! does it fall by more than b times what the light adds to it, displayed, as a displayed value grows less and less steeply.

use super::Row;
use super::candidates::{Candidate, Choice};
use super::gain::{darkened, displayed, gain};
use crate::plan::{Bound, Plan};
use crate::scene::EffectKind;
use crate::statistics::{LightStatistics, Statistics};

const WITHOUT: &str = "its light goes through everything";

pub(super) static ROW: Row = Row {
    kind: EffectKind::Shadow,
    what: "the shadow of a light, with the colours that it has",
    without: WITHOUT,
    candidates,
    take: |plan, _, is_on| plan.shadow_maps = is_on.to_vec(),
    work: Some(|work, label| work.shadow(label)),
};

fn candidates(statistics: &Statistics, plan: &Plan) -> Vec<Candidate> {
    let gain = gain(statistics);
    let lights = statistics.lights.iter().zip(&plan.lights);
    lights.map(|(light, shines)| candidate(light, *shines, gain, statistics)).collect()
}

/// The greatest share of its light that a shadow takes from anything that is seen.
fn greatest_opacity(light: &LightStatistics, statistics: &Statistics) -> f64 {
    let counts = &statistics.counts;
    let everything = if counts.opaque_casters > 0 { 1.0 } else { -libm::expm1(-counts.caster_optical_depth) };
    everything.min(light.opacity)
}

fn candidate(light: &LightStatistics, shines: bool, gain: f64, statistics: &Statistics) -> Candidate {
    let counts = &statistics.counts;
    let label = &light.label;
    if light.is_dark || !shines {
        return Candidate::off(label, "its light is left out");
    }
    let opacity = greatest_opacity(light, statistics);
    let change = (displayed(light.radiance, gain) * opacity).min(darkened(opacity));
    let is_known = light.radiance.is_finite() || opacity < 1.0;
    let bound = if is_known { Bound::at_most(change) } else { Bound::Unknown };
    if light.has_shadow == Some(false) {
        return Candidate::switched(label, false, WITHOUT, bound);
    }
    if !light.casts_shadows {
        return Candidate::off(label, "the light has shadow = false");
    }
    if counts.receivers == 0 {
        return Candidate::off(label, "nothing can receive it: no lit splat with a shadow coefficient");
    }
    if counts.casters == 0 {
        return Candidate::off(label, "nothing can cast it");
    }
    if opacity == 0.0 && light.has_shadow.is_none() {
        return Candidate::off(label, "nothing that is seen and could receive it lies behind what casts it");
    }
    let from = if light.points > 1 { format!(", from {} points", light.points) } else { String::new() };
    let casters = if counts.casters == 1 {
        "1 splat or whole object casts".to_owned()
    } else {
        format!("{} splats or whole objects cast", counts.casters)
    };
    let receivers =
        if counts.receivers == 1 { "1 receives".to_owned() } else { format!("{} receive", counts.receivers) };
    let casters = format!("{casters} and {receivers} it{from}");
    let taken = 100.0 * opacity;
    let on = if opacity < 1.0 {
        format!("it takes at most {taken:.2} % of its light from anything that is seen; {casters}")
    } else {
        casters
    };
    let settled =
        |why: &str| Candidate::new(label, Choice::Settled { is_on: true, reason: format!("{why}; {on}"), bound });
    if light.has_shadow == Some(true) {
        return settled("it is switched on");
    }
    if statistics.layers.iter().any(|layer| layer == "shadow") {
        return settled("the layer `shadow` shows it");
    }
    let off = format!("nothing that is seen could lose more than {taken:.2} % of its light");
    Candidate::new(label, Choice::Open { bound, on, off })
}
