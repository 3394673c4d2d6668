//! The knobs of the technique `surfels` (Zhang and Pajarola 2007).

use super::points::{absorbance_cut, cells, choice, cutoffs, samples, spacing};
use super::{Facts, Knob, Options, Request, Skipped, Sweep};
use organza::scene::{LayerChoice, Scene, Technique};

/// Knobs of `surfels` in this scene.
///
/// What surfels show has a limit of its own: discs of a layer are averaged, where points composite each.
pub fn surfels(scene: &Scene, facts: &Facts, options: &Options) -> Sweep {
    let mut base = Request { scene: in_surfels(scene), oversample: 1 };
    base.scene.render.layers = LayerChoice::default();
    let mut sweep = Sweep {
        technique: "surfels",
        base,
        base_label: "the scene's own".into(),
        knobs: Vec::new(),
        skipped: Vec::new(),
        joint_levels: if options.quick { 2 } else { 5 },
    };
    let knobs = [
        ("disc scale", Ok(disc_scale())),
        ("gap", Ok(gap())),
        ("shadow table cells", cells(facts, options)),
        ("absorbance cut", absorbance_cut(facts, options)),
        ("transmittance cut", Ok(transmittance_cut(options))),
        ("samples", samples(options)),
        ("splat spacing", spacing(scene, options)),
    ];
    for (name, knob) in knobs {
        match knob {
            Ok(knob) => sweep.knobs.push(knob),
            Err(reason) => sweep.skipped.push(Skipped { knob: name, reason }),
        }
    }
    sweep
}

/// The scene's surfaces by this technique, and its media by points.
pub fn in_surfels(scene: &Scene) -> Scene {
    let mut scene = scene.clone();
    scene.render.technique = Technique::Surfels;
    for object in scene.objects.iter_mut().filter(|o| o.source.is_medium()) {
        object.technique.get_or_insert(Technique::Points);
    }
    scene
}

fn transmittance_cut(options: &Options) -> Knob {
    Knob { set: |request, value| request.scene.render.surfels.transmittance_cutoff = value, ..cutoffs(options) }
}

fn disc_scale() -> Knob {
    Knob {
        name: "disc scale",
        size_meaning: "",
        set: |request, value| request.scene.render.surfels.disc_scale = value,
        steps: [0.45, 0.6, 0.8, 1.0].map(|s| choice(&format!("{s} of the cut-off radius"), s)).to_vec(),
        ends: Vec::new(),
        end_is_exact: false,
        theory: None,
        joint: false,
    }
}

fn gap() -> Knob {
    Knob {
        name: "gap",
        size_meaning: "",
        set: |request, value| request.scene.render.surfels.gap = value,
        steps: [0.125, 0.25, 0.5, 1.0, 2.0].map(|e| choice(&format!("{e} radii"), e)).to_vec(),
        ends: Vec::new(),
        end_is_exact: false,
        theory: None,
        joint: false,
    }
}
