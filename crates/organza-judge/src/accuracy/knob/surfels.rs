//! The knobs of the technique `surfels` (Zhang and Pajarola 2007).

use super::points::{absorbance_cut, cells, choice, cutoffs, samples, spacing};
use crate::accuracy::{Facts, Knob, Options, Request, Skipped, Step, Sweep};
use organza::scene::{Collisions, Coverage, Grouping, LayerChoice, Scene, SurfelGroups, SurfelLayers, Technique};

/// Knobs of `surfels` in this scene.
///
/// Surfels have another limit than points: they average the discs of a layer, where points composite each disc.
pub fn surfels(scene: &Scene, facts: &Facts, options: &Options) -> Sweep {
    let mut base = Request { scene: in_surfels(scene), oversample: 1, packed: false };
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
        ("layers", Ok(layers())),
        ("groups", grouped(scene, groups())),
        ("grouping", grouped(scene, grouping())),
        ("overlap factor", overlap_factor(scene)),
        ("hash collisions", grouped(scene, collisions(scene))),
        ("coverage", grouped(scene, coverage())),
        ("shadow table cells", cells(facts, options)),
        ("absorbance cut", absorbance_cut(facts, options)),
        ("transmittance cut", Ok(transmittance_cut(scene, options))),
        ("samples", samples(scene, options)),
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
    let mut scene = scene.drawn_by(Technique::Surfels);
    for object in scene.objects.iter_mut().filter(|o| o.source.is_medium()) {
        object.technique.get_or_insert(Technique::Points);
    }
    scene
}

fn transmittance_cut(scene: &Scene, options: &Options) -> Knob {
    let scene_size = Some(scene.render.surfels.transmittance_cutoff);
    Knob {
        set: |request, value| request.scene.render.surfels.transmittance_cutoff = value,
        scene_size,
        ..cutoffs(options)
    }
}

fn disc_scale() -> Knob {
    let steps = [0.45, 0.6, 0.8, 1.0].map(|s| choice(&format!("{s} of the cut-off radius"), s)).to_vec();
    choices("disc scale", |request, value| request.scene.render.surfels.disc_scale = value, steps)
}

fn gap() -> Knob {
    let steps = [0.125, 0.25, 0.5, 1.0, 2.0].map(|e| choice(&format!("{e} radii"), e)).to_vec();
    choices("gap", |request, value| request.scene.render.surfels.gap = value, steps)
}

/// A knob whose positions are choices.
fn choices(name: &'static str, set: fn(&mut Request, f64), steps: Vec<Step>) -> Knob {
    let ends = Vec::new();
    let end_is_exact = false;
    let theory = None;
    let joint = false;
    Knob { name, size_meaning: "", set, steps, ends, end_is_exact, theory, scene_size: None, joint }
}

fn layers() -> Knob {
    let set = |request: &mut Request, value: f64| {
        let layers = &mut request.scene.render.surfels.layers;
        let groups = layers.groups().copied().unwrap_or_default();
        *layers = match value {
            0.0 => SurfelLayers::Gaps,
            1.0 => SurfelLayers::Algorithm1(groups),
            2.0 => SurfelLayers::Algorithm2(groups),
            most => SurfelLayers::Peeled(most as u32),
        };
    };
    let names =
        [("all, by gaps", 0.0), ("Algorithm 1", 1.0), ("Algorithm 2", 2.0), ("3 nearest", 3.0), ("8 nearest", 8.0)];
    choices("layers", set, names.map(|(name, value)| choice(name, value)).to_vec())
}

/// What is turned of a scene's groups.
fn stated_groups(request: &mut Request) -> &mut SurfelGroups {
    request.scene.render.surfels.layers.groups_mut().expect("invariant: knobs of groups are for scenes that have some")
}

/// A knob of groups, where the scene asks for some.
fn grouped(scene: &Scene, knob: Knob) -> Result<Knob, String> {
    let asks = scene.render.surfels.layers.groups().is_some();
    asks.then_some(knob).ok_or_else(|| "nothing is grouped: render.surfels.layers names no algorithm".into())
}

fn groups() -> Knob {
    let steps = [2.0, 4.0, 8.0, 16.0].map(|k| choice(&format!("{k} groups"), k)).to_vec();
    choices("groups", |request, value| stated_groups(request).count = value as u32, steps)
}

fn grouping() -> Knob {
    let set = |request: &mut Request, value: f64| {
        stated_groups(request).grouping = match value {
            0.0 => Grouping::Weighted,
            1.0 => Grouping::Minimum { factor: 1.0 },
            _ => Grouping::Hash(Collisions::Resolve),
        };
    };
    choices("grouping", set, vec![choice("WGC", 0.0), choice("MGC", 1.0), choice("hash", 2.0)])
}

fn overlap_factor(scene: &Scene) -> Result<Knob, String> {
    let set = |request: &mut Request, value: f64| stated_groups(request).grouping = Grouping::Minimum { factor: value };
    let steps = [0.4, 0.6, 0.8, 1.0].map(|c| choice(&format!("c = {c}, MGC"), c)).to_vec();
    grouped(scene, choices("overlap factor", set, steps))
}

fn collisions(scene: &Scene) -> Knob {
    let set = |request: &mut Request, value: f64| {
        stated_groups(request).grouping = Grouping::Hash(match value {
            -1.0 => Collisions::Keep,
            0.0 => Collisions::Resolve,
            distance => Collisions::Near(distance),
        });
    };
    let near = match scene.render.surfels.layers.groups().map(|groups| groups.grouping) {
        Some(Grouping::Hash(Collisions::Near(distance))) => Some(choice("resolved near the eye", distance)),
        _ => None,
    };
    choices("hash collisions", set, [choice("kept", -1.0), choice("resolved", 0.0)].into_iter().chain(near).collect())
}

fn coverage() -> Knob {
    let set = |request: &mut Request, value: f64| {
        stated_groups(request).coverage = match value {
            0.0 => Coverage::Partial,
            1.0 => Coverage::Duplicates,
            2.0 => Coverage::Enlarged,
            _ => Coverage::Bound,
        };
    };
    let names = [("partial", 0.0), ("duplicates", 1.0), ("enlarged", 2.0), ("bound", 3.0)];
    choices("coverage", set, names.map(|(name, value)| choice(name, value)).to_vec())
}
