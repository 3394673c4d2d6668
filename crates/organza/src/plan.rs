//! Only what a scene calls for: statistics of the scene → the effects to simulate and the passes to run.
//!
//! [`plan`] is a pure function. Each effect that is left out carries a bound on how much any displayed pixel (0 to 1)
//! could differ with it; their sum stays below the tolerance. A pass that is not in the plan does not run, and its buffers
//! are not allocated: the cost record shows it.

mod samplers;

pub use samplers::{ParticleSource, PlannedSampler, samplers};

use crate::shadows::{CUT_SHARE, ShadowTable};
use crate::statistics::{LightStatistics, Statistics};

/// One effect of the scene: simulated or not, and why.
#[derive(Debug, Clone, PartialEq)]
pub struct Effect {
    /// What it is, such as `shadow of light 1`.
    pub name: String,
    /// Whether it is simulated.
    pub called_for: bool,
    /// Why or why not.
    pub reason: String,
    /// Largest change of a displayed pixel (0 to 1) if it is left out.
    pub bound: f64,
}

/// One pass that will run.
#[derive(Debug, Clone, PartialEq)]
pub struct PlannedPass {
    /// Name, the same as in the cost record.
    pub name: String,
    /// What it is for.
    pub reason: String,
}

/// What will be done for a scene.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Plan {
    /// Name of the technique.
    pub technique: &'static str,
    /// All effects that were considered.
    pub effects: Vec<Effect>,
    /// Passes in the order of running.
    pub passes: Vec<PlannedPass>,
    /// Planes of optical depth, or depth buffers of particles: 1 when all materials absorb red, green and blue alike, else 3.
    pub optical_depth_planes: usize,
    /// For each light: whether it gets a shadow map.
    pub shadow_maps: Vec<bool>,
    /// For each light: the table of its shadow map. Chosen by a look at the splats, when all else is planned.
    pub shadow_tables: Vec<Option<ShadowTable>>,
    /// Bytes that all shadow maps together may take.
    pub shadow_bytes: u64,
    /// Where the particles of each visible object come from; empty for the technique `points`.
    pub samplers: Vec<PlannedSampler>,
}

/// Names of the passes, shared by the plan and the cost record.
pub mod pass {
    /// Files are read, and what they will become is counted.
    pub const READ: &str = "read";
    /// Files and fields become splats.
    pub const CONVERT: &str = "convert";
    /// A shadow map is built.
    pub const SHADOW_MAP: &str = "tsm build";
    /// Translucent splats are culled and sliced.
    pub const SORT: &str = "hbsort";
    /// Splats get their footprints.
    pub const PROJECT: &str = "project";
    /// Splats get their radiance.
    pub const SHADE: &str = "shade";
    /// Opaque splats are resolved.
    pub const OPAQUE: &str = "opaque";
    /// Translucent splats are composited.
    pub const SPLAT: &str = "splat";
    /// Sets of particles are made that serve many frames.
    pub const SAMPLE: &str = "sample";
    /// Translucent objects become particles, which are projected and averaged.
    pub const PARTICLES: &str = "particles";
    /// Samples become pixels and layers.
    pub const FINISH: &str = "finish";
}

/// Chooses effects and passes.
pub fn plan(statistics: &Statistics) -> Plan {
    let technique = if statistics.particles { "particles" } else { "points" };
    let mut plan = Plan { technique, ..Plan::default() };
    // What ends lists of shadow maps takes the rest.
    let tolerance = statistics.tolerance * (1.0 - CUT_SHARE);
    let mut skipped = 0.0;
    for (i, light) in statistics.lights.iter().enumerate() {
        let effect = shadow_effect(i, light, statistics, tolerance - skipped);
        if !effect.called_for {
            skipped += effect.bound;
        }
        plan.shadow_maps.push(effect.called_for);
        plan.effects.push(effect);
    }
    plan.effects.push(colored_extinction(statistics));
    plan.effects.push(normals(statistics));
    plan.effects.push(translucency(statistics));
    plan.effects.push(opaque_surfaces(statistics));
    plan.effects.push(kept_layers(statistics));
    if statistics.particles {
        plan.samplers = samplers(&statistics.objects, &statistics.lights);
    }
    plan.optical_depth_planes = if statistics.colored_extinction { 3 } else { 1 };
    plan.passes = passes(statistics, &plan.shadow_maps);
    plan
}

impl Plan {
    /// Takes the tables in that were chosen, one for each light, and the bytes that their maps may take together.
    pub(crate) fn set_shadow_tables(&mut self, tables: Vec<Option<ShadowTable>>, bytes: u64) {
        let made = tables.iter().enumerate().filter_map(|(i, table)| Some(table.as_ref()?.describe(i)));
        let passes = self.passes.iter_mut().filter(|p| p.name == pass::SHADOW_MAP);
        passes.zip(made).for_each(|(pass, reason)| pass.reason = reason);
        (self.shadow_tables, self.shadow_bytes) = (tables, bytes);
    }
}

fn effect(name: impl Into<String>, called_for: bool, reason: impl Into<String>) -> Effect {
    Effect { name: name.into(), called_for, reason: reason.into(), bound: 0.0 }
}

fn shadow_effect(i: usize, light: &LightStatistics, statistics: &Statistics, allowance: f64) -> Effect {
    let name = format!("shadow of light {i}");
    if !light.wants_shadow {
        return effect(name, false, "the light has shadow = false");
    }
    if light.is_dark {
        return effect(name, false, "the light has no intensity");
    }
    if statistics.receivers == 0 {
        return effect(name, false, "nothing can receive it: no lit splat with a shadow coefficient");
    }
    if statistics.casters == 0 {
        return effect(name, false, "nothing can cast it");
    }
    // A displayed pixel is at most 1, so what a shadow can take away is at most its opacity.
    let bound = if statistics.opaque_casters > 0 { 1.0 } else { -libm::expm1(-statistics.caster_optical_depth) };
    let called_for = bound > allowance;
    let reason = if called_for {
        format!("{} splats cast and {} receive it", statistics.casters, statistics.receivers)
    } else {
        format!("no ray could lose more than {bound:.1e} of its light")
    };
    Effect { name, called_for, reason, bound }
}

fn colored_extinction(statistics: &Statistics) -> Effect {
    const UNEQUAL: &str = "some material absorbs red, green and blue unequally";
    if statistics.colored_extinction {
        let how = if statistics.particles { ": a particle hides each channel by chance" } else { "" };
        effect("transmittance per channel", true, format!("{UNEQUAL}{how}"))
    } else {
        effect("transmittance per channel", false, "all materials absorb red, green and blue alike")
    }
}

fn normals(statistics: &Statistics) -> Effect {
    if statistics.normals_needed {
        effect("normals of volumes", true, "a light shades a volume by its gradient, or the layer was asked for")
    } else {
        effect("normals of volumes", false, "no volume is shaded by its gradient, and none is asked for")
    }
}

fn translucency(statistics: &Statistics) -> Effect {
    let how = if statistics.particles { "become particles" } else { "are composited in order" };
    match translucent(statistics) {
        Some(what) => effect("translucency", true, format!("{what} {how}")),
        None => effect("translucency", false, "nothing is translucent: nothing to sort"),
    }
}

/// What is translucent, in words.
fn translucent(statistics: &Statistics) -> Option<String> {
    let own = statistics.own();
    match (statistics.translucent, own) {
        (0, 0) => None,
        (n, 0) => Some(format!("{n} translucent splats")),
        (0, own) => Some(format!("{own} translucent objects by their own data")),
        (n, own) => Some(format!("{n} translucent splats and {own} translucent objects by their own data")),
    }
}

fn opaque_surfaces(statistics: &Statistics) -> Effect {
    let n = statistics.opaque;
    if n > 0 {
        effect("opaque surfaces", true, format!("{n} opaque splats hide what lies behind"))
    } else {
        effect("opaque surfaces", false, "no splat is opaque")
    }
}

fn kept_layers(statistics: &Statistics) -> Effect {
    if statistics.layers.is_empty() {
        effect("extra layers", false, "no layer beside beauty and alpha was asked for")
    } else {
        effect("extra layers", true, format!("asked for: {}", statistics.layers.join(", ")))
    }
}

fn passes(statistics: &Statistics, shadow_maps: &[bool]) -> Vec<PlannedPass> {
    let (opaque, particles) = (statistics.opaque, statistics.particles);
    let translucent = translucent(statistics);
    let mut passes = Vec::new();
    let mut pass = |name: &str, reason: String| passes.push(PlannedPass { name: name.into(), reason });
    pass(pass::READ, "the objects' data".into());
    if statistics.splats > 0 || statistics.own() == 0 {
        pass(pass::CONVERT, format!("{} splats", statistics.splats));
    }
    for (i, _) in shadow_maps.iter().enumerate().filter(|(_, on)| **on) {
        pass(pass::SHADOW_MAP, format!("light {i}"));
    }
    if let (Some(what), false) = (&translucent, particles) {
        pass(pass::SORT, what.clone());
    }
    // Particles are projected and shaded one by one in their own pass.
    let which = if particles { "opaque" } else { "all" };
    if !particles || opaque > 0 {
        pass(pass::PROJECT, format!("{which} splats"));
        pass(pass::SHADE, format!("{which} splats in view"));
    }
    if opaque > 0 {
        pass(pass::OPAQUE, format!("{opaque} opaque splats"));
    }
    if let Some(what) = translucent {
        pass(if particles { pass::PARTICLES } else { pass::SPLAT }, what);
    }
    pass(pass::FINISH, "samples become pixels".into());
    passes
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scene() -> Statistics {
        let light = LightStatistics { wants_shadow: true, is_dark: false };
        Statistics {
            translucent: 10,
            opaque: 5,
            receivers: 15,
            casters: 15,
            opaque_casters: 5,
            lights: vec![light],
            tolerance: 1.0 / 255.0,
            normals_needed: true,
            ..Statistics::default()
        }
    }

    fn has(plan: &Plan, name: &str) -> bool {
        plan.passes.iter().any(|p| p.name == name)
    }

    #[test]
    fn x7_no_shadow_map_without_caster_receiver_or_light() {
        assert!(has(&plan(&scene()), pass::SHADOW_MAP));
        for change in [
            |s: &mut Statistics| s.casters = 0,
            |s: &mut Statistics| s.receivers = 0,
            |s: &mut Statistics| s.lights[0].is_dark = true,
            |s: &mut Statistics| s.lights[0].wants_shadow = false,
            |s: &mut Statistics| s.lights.clear(),
        ] {
            let mut statistics = scene();
            change(&mut statistics);
            assert!(!has(&plan(&statistics), pass::SHADOW_MAP));
        }
    }

    #[test]
    fn x7_faint_casters_are_skipped_while_their_bounds_fit_the_tolerance() {
        let mut s = scene();
        s.opaque_casters = 0;
        s.caster_optical_depth = 0.003;
        s.lights = vec![s.lights[0]; 2];
        let plan = plan(&s);
        // Two of 0.003 are above 1/255 together, so the second one is simulated.
        assert_eq!(plan.shadow_maps, [false, true]);
        let skipped: f64 = plan.effects.iter().filter(|e| !e.called_for).map(|e| e.bound).sum();
        assert!(skipped <= s.tolerance);
    }

    #[test]
    fn x7_only_the_passes_for_what_is_there() {
        let mut s = scene();
        s.translucent = 0;
        assert!(!has(&plan(&s), pass::SORT) && !has(&plan(&s), pass::SPLAT) && has(&plan(&s), pass::OPAQUE));
        s = scene();
        s.opaque = 0;
        assert!(has(&plan(&s), pass::SORT) && !has(&plan(&s), pass::OPAQUE));
        assert_eq!(plan(&s).optical_depth_planes, 1);
        s.colored_extinction = true;
        assert_eq!(plan(&s).optical_depth_planes, 3);
        s.particles = true;
        let only = plan(&s);
        assert!(has(&only, pass::PARTICLES) && ![pass::SORT, pass::PROJECT, pass::SPLAT].iter().any(|p| has(&only, p)));
    }
}
