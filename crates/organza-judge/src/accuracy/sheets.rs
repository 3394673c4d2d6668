//! The knobs of the technique `sheets` (Neophytou and Mueller 2005).

use super::points::{absorbance_cut, cells, choice, cutoffs, finer, samples, step};
use super::{Facts, Knob, Options, Request, Skipped, Sweep, Theory};
use organza::scene::{LayerChoice, Scene, Slicing, Technique};

/// Knobs of `sheets` in this scene, whose slabs are `slab_width` wide by its own setting; or why there are none.
///
/// What sheets show has a limit of its own: other kernels than those of splats, classified after reconstruction.
///
/// # Errors
/// Why the technique has nothing to show.
pub fn sheets(scene: &Scene, slab_width: Option<f64>, facts: &Facts, options: &Options) -> Result<Sweep, String> {
    let own = slab_width.ok_or("nothing is translucent: the picture is that of `points`")?;
    let mut base = Request { scene: in_sheets(scene), oversample: 1 };
    base.scene.render.layers = LayerChoice::default();
    let mut sweep = Sweep {
        technique: "sheets",
        base,
        base_label: "the scene's own".into(),
        knobs: Vec::new(),
        skipped: Vec::new(),
        joint_levels: if options.quick { 2 } else { 5 },
    };
    let knobs = [
        ("slab width", Ok(slabs(own, options))),
        ("kernel radius", Ok(radius())),
        ("kernel deviation", Ok(deviation())),
        ("shadow table cells", cells(facts, options)),
        ("absorbance cut", absorbance_cut(facts, options)),
        ("transmittance cut", Ok(transmittance_cut(options))),
        ("light buffer", light_buffer(scene)),
        ("samples", samples(options)),
    ];
    for (name, knob) in knobs {
        match knob {
            Ok(knob) => sweep.knobs.push(knob),
            Err(reason) => sweep.skipped.push(Skipped { knob: name, reason }),
        }
    }
    Ok(sweep)
}

/// The scene by this technique.
pub fn in_sheets(scene: &Scene) -> Scene {
    let mut scene = scene.clone();
    scene.render.technique = Technique::Sheets;
    scene
}

fn slabs(own: f64, options: &Options) -> Knob {
    let factors: &[f64] = if options.quick { &[8.0, 4.0, 2.0, 1.0] } else { &[16.0, 8.0, 4.0, 2.0, 1.0] };
    let at = |factor: f64| step(format!("{:.3} ({factor} x)", factor * own), factor * own, factor * own);
    let end = 0.25 / finer(options);
    Knob {
        name: "slab width",
        size_meaning: "Δs, world units",
        set: |request, value| request.scene.render.sheets.slab_width = Some(value),
        steps: factors.iter().map(|f| at(*f)).collect(),
        ends: [end, 2.0 * end].map(at).to_vec(),
        end_is_exact: false,
        theory: Some(Theory {
            low: 1.0,
            high: 2.0,
            why: "2 where values are smooth along the view, which a slab averages; 1 at surfaces, which it smears by its width",
        }),
        joint: true,
    }
}

fn transmittance_cut(options: &Options) -> Knob {
    Knob { set: |request, value| request.scene.render.sheets.transmittance_cutoff = value, ..cutoffs(options) }
}

/// Pixels of light buffers, where slabs have some.
fn light_buffer(scene: &Scene) -> Result<Knob, String> {
    if scene.render.sheets.slicing == Slicing::View {
        return Err("slabs across the view have no light buffers".into());
    }
    Ok(Knob {
        name: "light buffer",
        size_meaning: "",
        set: |request, value| {
            if let Slicing::HalfVector { light_pixels, .. } = &mut request.scene.render.sheets.slicing {
                *light_pixels = value;
            }
        },
        steps: [0.5, 1.0, 1.5, 3.0].map(|n| choice(&format!("{n} pixels a step of the lattice"), n)).to_vec(),
        ends: Vec::new(),
        end_is_exact: false,
        theory: None,
        joint: false,
    })
}

/// How far a kernel reaches with the deviation that it has.
fn radius() -> Knob {
    Knob {
        name: "kernel radius",
        size_meaning: "",
        set: |request, value| request.scene.render.sheets.kernel_extent = value,
        steps: [1.5, 2.0, 3.0].map(|steps| choice(&format!("{steps} steps of the lattice"), steps)).to_vec(),
        ends: Vec::new(),
        end_is_exact: false,
        theory: None,
        joint: false,
    }
}

fn deviation() -> Knob {
    Knob {
        name: "kernel deviation",
        size_meaning: "",
        set: |request, value| request.scene.render.sheets.kernel_sigma = value,
        steps: [0.5, 0.7, 1.0].map(|steps| choice(&format!("{steps} steps of the lattice"), steps)).to_vec(),
        ends: Vec::new(),
        end_is_exact: false,
        theory: None,
        joint: false,
    }
}
