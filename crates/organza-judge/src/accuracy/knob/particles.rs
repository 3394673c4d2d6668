//! Knobs of the technique `particles` (Tanaka 2012): the repeat level, which is the number of averaged sets; the samplers of
//! implicit surfaces and of media; the step of the paper's Brownian motion.

use crate::accuracy::{Facts, Knob, Options, Request, Skipped, Step, Sweep, Theory};
use organza::scene::{LayerChoice, Scene, Source, SurfaceSampler, Technique, VolumeSampler};

/// Steps of the Brownian motion, over the width of the surface; the paper's is 0.01.
const BROWNIAN_STEPS: [f64; 4] = [0.08, 0.04, 0.02, 0.01];

/// Knobs of `particles` in this scene, or the reason why it has no sweep.
///
/// A picture of L sets costs L sets, so [`Options::quick`] caps the scene's level at the finest step.
///
/// # Errors
/// Why the technique has nothing to show.
pub fn particles(scene: &Scene, facts: &Facts, options: &Options) -> Result<Sweep, String> {
    facts.slice_thickness.ok_or("no splat is translucent: the picture is that of `points`")?;
    let levels: &[u32] = if options.quick { &[2, 4, 8, 16] } else { &[2, 4, 8, 16, 32, 64, 128] };
    let finest = levels[levels.len() - 1];
    let mut scene = scene.drawn_by(Technique::Particles);
    // The report looks at beauty alone.
    scene.render.layers = LayerChoice::default();
    let sets = scene.render.particles.repeat_level;
    let cut = options.quick && sets > finest;
    if cut {
        scene.render.particles.repeat_level = finest;
        scene.render.particles.target_error = None;
    }
    let mut knobs = vec![repeat_level(sets, levels)];
    let mut skipped = Vec::new();
    for (name, knob) in [
        ("surface sampler", surface_sampler(&scene)),
        ("Brownian step", brownian_step(&scene, options.quick)),
        ("volume sampler", volume_sampler(&scene)),
    ] {
        match knob {
            Ok(knob) => knobs.push(knob),
            Err(reason) => skipped.push(Skipped { knob: name, reason }),
        }
    }
    Ok(Sweep {
        technique: "particles",
        base: Request { scene, oversample: 1, packed: false },
        base_label: if cut {
            format!("the scene's own, but {finest} of {sets} sets")
        } else {
            "the scene's own".into()
        },
        knobs,
        skipped,
        joint_levels: 0,
    })
}

fn repeat_level(sets: u32, levels: &[u32]) -> Knob {
    let step = |level: &u32| Step {
        label: format!("{level} sets"),
        size: Some(f64::from(*level).recip()),
        value: f64::from(*level),
    };
    Knob {
        name: "repeat level",
        size_meaning: "1 / repeat level",
        set: |request, value| {
            let particles = &mut request.scene.render.particles;
            (particles.repeat_level, particles.target_error) = (value as u32, None);
        },
        steps: levels.iter().map(step).collect(),
        ends: Vec::new(),
        end_is_exact: true,
        theory: Some(Theory { low: 0.47, high: 0.53, why: "the mean of L independent sets spreads as L^-1/2" }),
        scene_size: Some(f64::from(sets).recip()),
        joint: false,
    }
}

/// Whether particles of some surface come from a field.
fn has_surface(scene: &Scene) -> bool {
    scene
        .objects
        .iter()
        .any(|o| o.source.is_of_field() && o.visible && o.opacity.unwrap_or(scene.materials[o.material].opacity) < 1.0)
}

const NO_SURFACE: &str = "no translucent surface is implicit";

/// The samplers against each other: their pictures have one expectation, that of the surface.
fn surface_sampler(scene: &Scene) -> Result<Knob, String> {
    if !has_surface(scene) {
        return Err(NO_SURFACE.into());
    }
    let step = |(value, label): (f64, &str)| Step { label: label.into(), size: None, value };
    Ok(Knob {
        name: "surface sampler",
        size_meaning: "",
        set: |request, value| {
            request.scene.render.particles.surface_sampler = match value {
                0.0 => SurfaceSampler::Lines,
                1.0 => SurfaceSampler::Triangles,
                _ => SurfaceSampler::Brownian { step: BROWNIAN_STEPS[3] },
            };
        },
        steps: [(0.0, "lines"), (1.0, "triangles"), (2.0, "Brownian motion")].map(step).into(),
        ends: Vec::new(),
        end_is_exact: true,
        theory: None,
        scene_size: None,
        joint: false,
    })
}

fn brownian_step(scene: &Scene, quick: bool) -> Result<Knob, String> {
    if quick {
        return Err("left out by --quick".into());
    }
    if !has_surface(scene) {
        return Err(NO_SURFACE.into());
    }
    let step = |share: &f64| Step { label: format!("{share} of the width"), size: None, value: *share };
    Ok(Knob {
        name: "Brownian step",
        size_meaning: "",
        set: |request, value| {
            request.scene.render.particles.surface_sampler = SurfaceSampler::Brownian { step: value };
        },
        steps: BROWNIAN_STEPS.iter().map(step).collect(),
        ends: Vec::new(),
        end_is_exact: true,
        theory: None,
        scene_size: None,
        joint: false,
    })
}

/// Strides of Metropolis chains.
const STRIDES: [u32; 3] = [1, 4, 16];

/// Cell by cell against chains that take more and more steps from one particle to the next, which have its expectation in the end.
fn volume_sampler(scene: &Scene) -> Result<Knob, String> {
    let is_sampled = |source: &Source| source.is_medium() && !matches!(source, Source::Matter(_));
    if !scene.objects.iter().any(|o| o.visible && is_sampled(&o.source)) {
        return Err("nothing translucent is a medium".into());
    }
    let chains = |stride: u32| (f64::from(stride), format!("chains of {stride} steps a particle"));
    let step = |(value, label)| Step { label, size: None, value };
    Ok(Knob {
        name: "volume sampler",
        size_meaning: "",
        set: |request, value| {
            request.scene.render.particles.volume_sampler = match value as u32 {
                0 => VolumeSampler::Cells,
                stride => VolumeSampler::Metropolis { stride },
            };
        },
        steps: STRIDES.map(chains).into_iter().chain([(0.0, "cells".into())]).map(step).collect(),
        ends: Vec::new(),
        end_is_exact: true,
        theory: None,
        scene_size: None,
        joint: false,
    })
}
