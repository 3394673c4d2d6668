//! The knob of the technique `particles` (Tanaka 2012): the repeat level, how many sets are averaged.

use super::{Facts, Knob, Options, Request, Step, Sweep, Theory};
use crate::scene::{LayerChoice, Scene, Technique};

/// Knobs of `particles` in this scene, or why there are none.
///
/// A picture of L sets costs L sets, so with [`Options::quick`] the scene's own level is cut down to the finest step.
///
/// # Errors
/// Why the technique has nothing to show.
pub fn particles(scene: &Scene, facts: &Facts, options: &Options) -> Result<Sweep, String> {
    facts.slice_thickness.ok_or("no splat is translucent: the picture is that of `points`")?;
    let levels: &[u32] = if options.quick { &[2, 4, 8, 16] } else { &[2, 4, 8, 16, 32, 64, 128] };
    let finest = levels[levels.len() - 1];
    let mut scene = scene.clone();
    scene.render.technique = Technique::Particles;
    // The report looks at beauty alone.
    scene.render.layers = LayerChoice::default();
    let own = scene.render.particles.repeat_level;
    let cut = options.quick && own > finest;
    if cut {
        scene.render.particles.repeat_level = finest;
        scene.render.particles.target_error = None;
    }
    let step = |level: &u32| Step {
        label: format!("{level} sets"),
        size: Some(f64::from(*level).recip()),
        value: f64::from(*level),
    };
    let knob = Knob {
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
        joint: false,
    };
    Ok(Sweep {
        technique: "particles",
        base: Request { scene, oversample: 1 },
        base_label: if cut { format!("the scene's own, but {finest} of {own} sets") } else { "the scene's own".into() },
        knobs: vec![knob],
        skipped: Vec::new(),
        joint_levels: 0,
    })
}
