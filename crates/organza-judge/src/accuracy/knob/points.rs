//! The knobs of the technique `points` (Gunjee 2007).

use super::tables::{self, footprint_tables};
use crate::accuracy::{Knob, Options, Request, Skipped, Step, Sweep, Theory};
use organza::scene::{Scene, SceneObject, ShadowMapping, Source, Technique};
use splat_core::{LightShape, raster::Accumulation};

/// The facts of a loaded scene that the steps depend on.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Facts {
    /// Thickness of the slices of the scene's stated setting, world units; `None` without translucent splats.
    pub slice_thickness: Option<f64>,
    /// Whether any light gets a shadow map.
    pub has_maps: bool,
    /// Cells along the longest side of a shadow map, of lights that state no cells of their own; `None` without such.
    pub cells: Option<u32>,
    /// Bytes of a splat as they are and packed; `None` without splats, or where they cannot be packed.
    pub bytes_per_splat: Option<[f64; 2]>,
}

/// Most cells along a side of a shadow table.
const MOST_CELLS: f64 = 16384.0;

/// Largest `render.antialias`; beyond it the picture itself is drawn larger.
const MOST_ANTIALIAS: f64 = 8.0;

/// Knobs of `points` in this scene.
pub fn points(scene: &Scene, facts: &Facts, options: &Options) -> Sweep {
    let base = Request { scene: in_points(scene), oversample: 1, packed: false };
    let joint_levels = if options.quick { 2 } else { 5 };
    let mut sweep = Sweep {
        technique: "points",
        base,
        base_label: "the scene's own".into(),
        knobs: Vec::new(),
        skipped: Vec::new(),
        joint_levels,
    };
    // One line a knob; a technique with others has a list of its own.
    let knobs = [
        ("slice thickness", slices(scene, facts, options)),
        ("order", order(facts, options)),
        ("shadow table cells", cells(facts, options)),
        ("shadow table mapping", mapping(scene, facts)),
        ("absorbance cut", absorbance_cut(facts, options)),
        ("transmittance cut", transmittance_cut(scene, facts, options)),
        ("samples", samples(scene, options)),
        ("resampling filter", Ok(resampling_filter())),
        ("splat spacing", spacing(scene, options)),
        ("share of splats", splat_share(scene, options)),
        ("packed splats", packed(facts)),
        ("accumulation", accumulation(facts)),
        (tables::NAME, footprint_tables(scene, options)),
    ];
    for (name, knob) in knobs {
        match knob {
            Ok(knob) => sweep.knobs.push(knob),
            Err(reason) => sweep.skipped.push(Skipped { knob: name, reason }),
        }
    }
    sweep
}

pub(super) fn step(label: impl Into<String>, size: f64, value: f64) -> Step {
    Step { label: label.into(), size: Some(size), value }
}

pub(super) fn choice(label: &str, value: f64) -> Step {
    Step { label: label.into(), size: None, value }
}

/// How much finer ends are than by default.
pub(super) fn finer(options: &Options) -> f64 {
    f64::from(options.finer).exp2()
}

const NO_TRANSLUCENT: &str = "no splat is translucent";
const NO_MAP: &str = "no light gets a shadow map";

/// The scene by this technique.
pub fn in_points(scene: &Scene) -> Scene {
    scene.drawn_by(Technique::Points)
}

fn slices(scene: &Scene, facts: &Facts, options: &Options) -> Result<Knob, String> {
    let thickness = facts.slice_thickness.ok_or(NO_TRANSLUCENT)?;
    let factors: &[f64] =
        if options.quick { &[16.0, 4.0, 2.0, 1.0] } else { &[64.0, 32.0, 16.0, 8.0, 4.0, 2.0, 1.0, 0.5] };
    let mut steps: Vec<Step> =
        factors.iter().map(|f| step(format!("{:.3} ({f} x)", f * thickness), f * thickness, f * thickness)).collect();
    steps.push(Step { label: "exact".into(), size: None, value: 0.0 });
    Ok(Knob {
        name: "slice thickness",
        size_meaning: "ε, world units",
        set: |request, value| {
            let points = &mut request.scene.render.points;
            points.exact = value == 0.0;
            points.slice_thickness = (value > 0.0).then_some(value);
        },
        ends: steps.last().cloned().into_iter().collect(),
        steps,
        end_is_exact: true,
        theory: Some(Theory {
            low: 0.5,
            high: 2.0,
            why: "pairs in wrong order grow with ε and so does their difference in colour: 2 where colour is smooth; \
                  1 where it is not; 1/2 where few pixels, whose number grows with ε, are wrong altogether",
        }),
        scene_size: Some(if scene.render.points.exact { 0.0 } else { thickness }),
        joint: true,
    })
}

/// Splats by their centres, or every fragment of a pixel by its own depth.
fn order(facts: &Facts, options: &Options) -> Result<Knob, String> {
    facts.slice_thickness.ok_or(NO_TRANSLUCENT)?;
    if options.quick {
        return Err("left out by --quick".into());
    }
    Ok(Knob {
        name: "order",
        size_meaning: "",
        set: |request, value| {
            request.scene.render.technique = if value > 0.0 { Technique::Reference } else { Technique::Points };
        },
        steps: vec![choice("by splats (points)", 0.0), choice("by fragments (reference)", 1.0)],
        ends: Vec::new(),
        end_is_exact: false,
        theory: None,
        scene_size: None,
        joint: false,
    })
}

pub(super) fn cells(facts: &Facts, options: &Options) -> Result<Knob, String> {
    let stated = if facts.has_maps { "lights state the cells of their shadow maps" } else { NO_MAP };
    let side = f64::from(facts.cells.ok_or(stated)?);
    let parts: &[f64] = if options.quick { &[16.0, 8.0, 4.0] } else { &[32.0, 16.0, 8.0, 4.0, 2.0] };
    let count = move |part: f64| (side / part).round().clamp(1.0, MOST_CELLS);
    let label = |n: f64| format!("{n} a side");
    let at = |part: &f64| step(label(count(*part)), count(*part).recip(), count(*part));
    let end = 0.5 / finer(options);
    Ok(Knob {
        name: "shadow table cells",
        size_meaning: "1 / cells along a side",
        set: |request, value| request.scene.render.shadow.cells = Some(value as u32),
        steps: parts.iter().map(at).collect(),
        ends: [end, 2.0 * end].iter().map(at).collect(),
        end_is_exact: false,
        theory: Some(Theory {
            low: 0.5,
            high: 2.0,
            why: "2 where shadows are smooth (linear interpolation); 1/2 where they have hard borders, whose share of \
                  the picture shrinks like the cells",
        }),
        scene_size: Some(side.recip()),
        joint: true,
    })
}

/// Fewer splats, each for several.
fn splat_share(scene: &Scene, options: &Options) -> Result<Knob, String> {
    let parts: &[f64] = if options.quick { &[16.0, 4.0, 2.0] } else { &[64.0, 16.0, 8.0, 4.0, 2.0] };
    let at = |part: &f64| step(format!("1/{part}"), part.sqrt(), part.recip());
    Ok(Knob {
        name: "share of splats",
        size_meaning: "distance of splats over that of all",
        set: |request, value| request.scene.render.splat_share = value,
        steps: parts.iter().map(at).collect(),
        ends: vec![at(&1.0)],
        end_is_exact: false,
        theory: Some(Theory {
            low: 0.5,
            high: 2.0,
            why: "edges are as unsharp as splats are apart, and their share of the picture grows alike: 1; 2 where all is smooth",
        }),
        scene_size: Some(scene.render.splat_share.sqrt().recip()),
        joint: false,
    })
}

fn mapping(scene: &Scene, facts: &Facts) -> Result<Knob, String> {
    facts.has_maps.then_some(()).ok_or(NO_MAP)?;
    let directional = |shape| matches!(shape, LightShape::Directional { .. });
    if scene.lights.iter().any(|l| l.shadow && directional(l.light.shape)) {
        return Err("a directional light takes the planar table alone".into());
    }
    Ok(Knob {
        name: "shadow table mapping",
        size_meaning: "",
        set: |request, value| {
            request.scene.render.shadow.mapping =
                if value == 0.0 { ShadowMapping::Octahedral } else { ShadowMapping::Polar };
        },
        steps: vec![choice("octahedral", 0.0), choice("polar", 1.0)],
        ends: Vec::new(),
        end_is_exact: false,
        theory: None,
        scene_size: None,
        joint: false,
    })
}

pub(super) fn absorbance_cut(facts: &Facts, options: &Options) -> Result<Knob, String> {
    facts.has_maps.then_some(()).ok_or(NO_MAP)?;
    let cuts: &[f64] = if options.quick { &[1.0, 2.0, 4.0] } else { &[0.5, 1.0, 2.0, 3.0, 4.0, 6.0] };
    Ok(Knob {
        name: "absorbance cut",
        size_meaning: "e^-A_cut",
        set: |request, value| request.scene.render.shadow.absorbance_cut = Some(value),
        steps: cuts.iter().map(|a| step(format!("A_cut {a}"), (-a).exp(), *a)).collect(),
        ends: vec![step("A_cut 40", 0.0, 40.0)],
        end_is_exact: true,
        theory: Some(Theory {
            low: 1.0,
            high: 2.0,
            why: "light behind the cut is at most e^-A_cut: 1 where every shadow is that deep, more where deep ones are rare",
        }),
        scene_size: None,
        joint: true,
    })
}

fn transmittance_cut(scene: &Scene, facts: &Facts, options: &Options) -> Result<Knob, String> {
    facts.slice_thickness.ok_or(NO_TRANSLUCENT)?;
    Ok(Knob { scene_size: Some(scene.render.points.transmittance_cutoff), ..cutoffs(options) })
}

/// Transmittances at which pixels are finished.
pub(super) fn cutoffs(options: &Options) -> Knob {
    let cuts: &[f64] = if options.quick { &[0.1, 0.03, 0.01] } else { &[0.3, 0.1, 0.03, 0.01, 0.003, 0.001] };
    let mut steps: Vec<Step> = cuts.iter().map(|t| step(format!("T {t}"), *t, *t)).collect();
    steps.push(Step { label: "T 0".into(), size: None, value: 0.0 });
    Knob {
        name: "transmittance cut",
        size_meaning: "T_cut",
        set: |request, value| request.scene.render.points.transmittance_cutoff = value,
        ends: steps.last().cloned().into_iter().collect(),
        steps,
        end_is_exact: true,
        theory: Some(Theory {
            low: 1.0,
            high: 2.0,
            why: "what lies behind the cut is seen through at most T_cut: 1 where every pixel reaches it, more where few do",
        }),
        scene_size: None,
        joint: true,
    }
}

pub(super) fn samples(scene: &Scene, options: &Options) -> Result<Knob, String> {
    let sides: &[f64] = if options.quick { &[1.0, 2.0, 4.0] } else { &[1.0, 2.0, 4.0, 8.0] };
    let label = |n: f64| format!("{n} x {n} a pixel");
    let end = 32.0 * finer(options);
    Ok(Knob {
        name: "samples",
        size_meaning: "1 / samples along a side of a pixel",
        set: |request, value| {
            request.scene.render.antialias = value.min(MOST_ANTIALIAS) as u32;
            request.oversample = (value / MOST_ANTIALIAS).max(1.0) as u32;
        },
        steps: sides.iter().map(|n| step(label(*n), 1.0 / n, *n)).collect(),
        ends: vec![step(label(end), 1.0 / end, end)],
        end_is_exact: false,
        theory: Some(Theory {
            low: 1.0,
            high: 2.0,
            why: "2 where the picture is smooth inside a pixel; 1 to 3/2 at edges, by their direction",
        }),
        scene_size: Some(f64::from(scene.render.antialias).recip()),
        joint: true,
    })
}

/// On or off; it vanishes by itself as samples become finer.
fn resampling_filter() -> Knob {
    Knob {
        name: "resampling filter",
        size_meaning: "",
        set: |request, value| request.scene.render.points.resampling_filter = value > 0.0,
        steps: vec![choice("off", 0.0), choice("on", 1.0)],
        ends: Vec::new(),
        end_is_exact: false,
        theory: None,
        scene_size: None,
        joint: false,
    }
}

fn accumulation(facts: &Facts) -> Result<Knob, String> {
    facts.slice_thickness.ok_or(NO_TRANSLUCENT)?;
    Ok(Knob {
        name: "accumulation",
        size_meaning: "",
        set: |request, value| {
            request.scene.render.points.accumulation = if value > 0.0 { Accumulation::F32 } else { Accumulation::F16 };
        },
        steps: vec![choice("f16", 0.0), choice("f32", 1.0)],
        ends: Vec::new(),
        end_is_exact: false,
        theory: None,
        scene_size: None,
        joint: false,
    })
}

pub(super) fn spacing(scene: &Scene, options: &Options) -> Result<Knob, String> {
    let mut probe = scene.clone();
    scale_spacings(&mut probe, 2.0);
    if probe.objects == scene.objects {
        return Err("no visible object has a spacing of its own: data keeps its resolution".into());
    }
    let label = |f: f64| format!("{f:.3} x the scene's");
    let end = if options.quick { 0.75 } else { 0.5 } / finer(options);
    let factors: &[f64] = if options.quick { &[2.0, 1.5, 1.0] } else { &[2.0, 1.5, 1.25, 1.0] };
    Ok(Knob {
        name: "splat spacing",
        size_meaning: "spacing over the scene's",
        set: |request, value| scale_spacings(&mut request.scene, value),
        steps: factors.iter().map(|f| step(label(*f), *f, *f)).collect(),
        ends: vec![step(label(end), end, end)],
        end_is_exact: false,
        theory: Some(Theory {
            low: 1.0,
            high: 2.0,
            why: "2 for smooth fields; less where a field has detail below the spacing, or surfaces end",
        }),
        scene_size: Some(1.0),
        joint: false,
    })
}

/// Splats as `organza convert --packed` writes them.
fn packed(facts: &Facts) -> Result<Knob, String> {
    let [plain, packed] = facts.bytes_per_splat.ok_or("there are no splats, or 3D Gaussians, which are not packed")?;
    Ok(Knob {
        name: "packed splats",
        size_meaning: "",
        set: |request, value| request.packed = value > 0.0,
        steps: vec![
            choice(&format!("no ({plain:.1} bytes each)"), 0.0),
            choice(&format!("yes ({packed:.1} bytes each)"), 1.0),
        ],
        ends: Vec::new(),
        end_is_exact: false,
        theory: None,
        scene_size: None,
        joint: false,
    })
}

/// Scales the spacing of every object that states one; raw points, volumes and meshes that are taken as they are stay.
fn scale_spacings(scene: &mut Scene, factor: f64) {
    spacings(scene).for_each(|spacing| *spacing *= factor);
}

/// By which factor the spacings of one scene are those of another; `None` where they are the same.
pub(crate) fn spacing_factor(from: &Scene, to: &Scene) -> Option<f64> {
    let [mut from, mut to] = [from, to].map(Scene::clone);
    spacings(&mut from).zip(spacings(&mut to)).find(|(a, b)| a != b).map(|(a, b)| *b / *a)
}

fn spacings(scene: &mut Scene) -> impl Iterator<Item = &mut f64> {
    scene.objects.iter_mut().filter(|o| o.visible).filter_map(spacing_of)
}

fn spacing_of(object: &mut SceneObject) -> Option<&mut f64> {
    match &mut object.source {
        Source::Mesh(_)
        | Source::Volume(_)
        | Source::Isosurface(_)
        | Source::LevelSet(_)
        | Source::Combined(_)
        | Source::Slice(_) => object.spacing.as_mut(),
        // The spacing of its samples decides what an implicit surface is, that of the object how it is splatted.
        Source::Implicit(implicit) => Some(object.spacing.as_mut().unwrap_or(&mut implicit.spacing)),
        Source::Density(density) => Some(&mut density.spacing),
        Source::Cloud(cloud) => Some(&mut cloud.spacing),
        Source::Rectangle(rectangle) => Some(&mut rectangle.spacing),
        Source::Medium(medium) => Some(&mut medium.spacing),
        // What lies between points is no field that finer ones would approach.
        Source::Points(_) | Source::Matter(_) | Source::Extract(_) => None,
    }
}
