//! The knobs of the technique `sheets` (Neophytou and Mueller 2005).

use super::points::{absorbance_cut, cells, choice, cutoffs, finer, samples, step};
use crate::accuracy::{Facts, Knob, Options, Request, Skipped, Sweep, Theory};
use organza::scene::{
    Aligned, Classify, LayerChoice, Reconstruction, Scattering, Scene, SceneObject, SheetGradients, SheetKernel,
    SheetsSettings, Slicing, SoftShadows, Source, Technique,
};
use splat_core::raster::Accumulation;
use splat_core::{Packing, Shading};

/// Knobs of `sheets` in this scene.
///
/// `slab_width` is that of the scene's stated setting, world units; `None` if no slab holds a volume or a splat, as of
/// translucent triangles, which are drawn as they are. Sheets have another limit than splats, because their kernels differ
/// and they classify after reconstruction.
pub fn sheets(scene: &Scene, slab_width: Option<f64>, facts: &Facts, options: &Options) -> Sweep {
    let in_slabs = |knob: &dyn Fn(f64) -> Knob| slab_width.map(knob).ok_or_else(|| NO_SLABS.to_owned());
    let is_gathered = scene.render.sheets.reconstruction == Reconstruction::Gather;
    let in_splatted = |knob: &dyn Fn(f64) -> Knob| if is_gathered { Err(GATHERED.to_owned()) } else { in_slabs(knob) };
    let mut base = Request { scene: in_sheets(scene), oversample: 1, packed: false };
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
        ("slab width", in_slabs(&|width| slabs(width, options))),
        ("reconstruction", reconstruction(scene, slab_width.is_some())),
        ("kernel radius", in_splatted(&|_| radius())),
        ("kernel deviation", in_splatted(&|_| deviation())),
        ("kernel sections", in_splatted(&|_| sections(scene, options))),
        ("buffer format", if is_gathered { Err(GATHERED.to_owned()) } else { Ok(buffers()) }),
        ("gradients", gradients(scene)),
        ("shadow table cells", cells(facts, options)),
        ("absorbance cut", absorbance_cut(facts, options)),
        ("transmittance cut", Ok(transmittance_cut(scene, options))),
        ("light buffer", light_buffer(scene)),
        ("soft shadows", soft_shadows(scene)),
        ("cells of scattered light", scattered_cells(scene, options)),
        ("cone of scattered light", scattered_cone(scene)),
        ("classification", classification(scene)),
        ("lattice", lattice(scene)),
        ("samples", samples(scene, options)),
    ];
    for (name, knob) in knobs {
        match knob {
            Ok(knob) => sweep.knobs.push(knob),
            Err(reason) => sweep.skipped.push(Skipped { knob: name, reason }),
        }
    }
    sweep
}

/// Why a scene has no knobs of slabs and kernels.
const NO_SLABS: &str = "no volume and no splat lies in slabs: translucent triangles are drawn as they are";

/// Why a scene has no knobs of splatted kernels.
const GATHERED: &str = "the scene has slabs gathered, which splat nothing";

/// The scene by this technique.
pub fn in_sheets(scene: &Scene) -> Scene {
    scene.drawn_by(Technique::Sheets)
}

fn slabs(width: f64, options: &Options) -> Knob {
    let factors: &[f64] = if options.quick { &[8.0, 4.0, 2.0, 1.0] } else { &[16.0, 8.0, 4.0, 2.0, 1.0] };
    let at = |factor: f64| step(format!("{:.3} ({factor} x)", factor * width), factor * width, factor * width);
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
        scene_size: Some(width),
        joint: true,
    }
}

fn transmittance_cut(scene: &Scene, options: &Options) -> Knob {
    let scene_size = Some(scene.render.sheets.transmittance_cutoff);
    Knob {
        set: |request, value| request.scene.render.sheets.transmittance_cutoff = value,
        scene_size,
        ..cutoffs(options)
    }
}

/// Pixels of light buffers, where slabs have some.
fn light_buffer(scene: &Scene) -> Result<Knob, String> {
    if scene.render.sheets.slicing == Slicing::View {
        return Err("slabs across the view have no light buffers".into());
    }
    Ok(choices(
        "light buffer",
        |request, value| {
            if let Slicing::HalfVector { light_pixels, .. } = &mut request.scene.render.sheets.slicing {
                *light_pixels = value;
            }
        },
        &[0.5, 1.0, 1.5, 3.0].map(|n| (format!("{n} pixels a step of the lattice"), n)),
    ))
}

/// A sweep for each point of a light with an extent, or one for all.
fn soft_shadows(scene: &Scene) -> Result<Knob, String> {
    if !scene.lights.iter().any(|l| l.light.shape.is_extended()) || scene.render.sheets.slicing == Slicing::View {
        return Err("no light with an extent is carried by slabs".into());
    }
    Ok(choices(
        "soft shadows",
        |request, value| {
            if let Slicing::HalfVector { soft_shadows, .. } = &mut request.scene.render.sheets.slicing {
                *soft_shadows = if value > 0.0 { SoftShadows::OneSweep } else { SoftShadows::Points };
            }
        },
        &[("a sweep for each point", 0.0), ("one sweep", 1.0)],
    ))
}

const SCATTERED_ONCE: &str = "no light is scattered more than once";

/// Where light is scattered more than once, what is set for that.
fn scattering(request: &mut Request) -> Option<&mut Scattering> {
    match &mut request.scene.render.sheets.slicing {
        Slicing::HalfVector { scattering, .. } => scattering.as_mut(),
        Slicing::View => None,
    }
}

/// How coarse the cells of reflectances are.
fn scattered_cells(scene: &Scene, options: &Options) -> Result<Knob, String> {
    let voxels_per_cell = scene.render.sheets.scattering().ok_or(SCATTERED_ONCE)?.voxels_per_cell;
    let voxels: &[f64] = if options.quick { &[256.0, 64.0, 16.0] } else { &[1024.0, 256.0, 64.0, 32.0, 16.0] };
    let at = |n: f64| step(format!("{n} voxels a cell"), n.cbrt(), n);
    Ok(Knob {
        name: "cells of scattered light",
        size_meaning: "width of a cell over that of a voxel",
        set: |request, value| {
            if let Some(scattering) = scattering(request) {
                scattering.voxels_per_cell = value as u32;
            }
        },
        steps: voxels.iter().map(|n| at(*n)).collect(),
        ends: [1.0, 4.0].map(at).to_vec(),
        end_is_exact: false,
        theory: Some(Theory {
            low: 1.0,
            high: 2.0,
            why: "2 inside of media, 1 where light leaves them or ends, for that is at a face of a cell",
        }),
        scene_size: Some(f64::from(voxels_per_cell).cbrt()),
        joint: true,
    })
}

/// How light spreads that is scattered ahead; a negative angle stands for the media's own.
fn scattered_cone(scene: &Scene) -> Result<Knob, String> {
    scene.render.sheets.scattering().ok_or(SCATTERED_ONCE)?;
    Ok(choices(
        "cone of scattered light",
        |request, value| {
            if let Some(scattering) = scattering(request) {
                scattering.cone = (value >= 0.0).then_some(value.to_radians());
            }
        },
        &[("that of the media", -1.0), ("0°", 0.0), ("15°", 15.0), ("30°", 30.0), ("60°", 60.0)],
    ))
}

/// How slabs get their values.
fn reconstruction(scene: &Scene, has_slabs: bool) -> Result<Knob, String> {
    let sheets = &scene.render.sheets;
    let is_volume =
        |o: &SceneObject| is_drawn(o) && matches!(o.source, Source::Volume(_) | Source::Density(_) | Source::Cloud(_));
    if !has_slabs || !scene.objects.iter().any(is_volume) {
        return Err("no volume lies in slabs".into());
    }
    if sheets.classify == Classify::Before || sheets.aligned == Aligned::Axis {
        return Err("slabs along a lattice or of classified voxels are splatted alone".into());
    }
    let has_other_kernel = sheets.kernel_extent != 2.0 || sheets.kernel_sigma != 0.7 || sheets.kernel_sections != 256;
    if has_other_kernel || sheets.accumulation == Accumulation::F16 {
        return Err("the scene states a kernel or sums that are splatted alone".into());
    }
    if scene.objects.iter().any(|o| is_drawn(o) && o.packing == Packing::BodyCentred) {
        return Err("a body-centred lattice is splatted alone".into());
    }
    Ok(choices(
        "reconstruction",
        |request, value| {
            let sheets = &mut request.scene.render.sheets;
            sheets.reconstruction = if value > 0.0 { Reconstruction::Gather } else { Reconstruction::Splat };
            sheets.kernel = if value > 1.0 { SheetKernel::Linear } else { SheetKernel::Gaussian };
        },
        &[("splatted", 0.0), ("gathered", 1.0), ("gathered linearly", 2.0)],
    ))
}

/// When values become colours.
fn classification(scene: &Scene) -> Result<Knob, String> {
    if scene.render.sheets.slicing != Slicing::View {
        return Err("slabs across half vectors classify what they have reconstructed".into());
    }
    const AFTER: (&str, f64) = ("the middle of a slab after reconstruction", 0.0);
    const PREINTEGRATED: (&str, f64) = ("all of a slab after reconstruction", 1.0);
    const BEFORE: (&str, f64) = ("voxels before reconstruction", 2.0);
    let is_gathered = scene.render.sheets.reconstruction == Reconstruction::Gather;
    let steps: &[(&str, f64)] = if is_gathered { &[AFTER, PREINTEGRATED] } else { &[AFTER, PREINTEGRATED, BEFORE] };
    Ok(choices(
        "classification",
        |request, value| {
            request.scene.render.sheets.classify = if value == AFTER.1 {
                Classify::After
            } else if value == PREINTEGRATED.1 {
                Classify::Preintegrated
            } else {
                Classify::Before
            };
        },
        steps,
    ))
}

/// What volumes are drawn on.
fn lattice(scene: &Scene) -> Result<Knob, String> {
    if scene.render.sheets.reconstruction == Reconstruction::Gather {
        return Err(GATHERED.into());
    }
    if !scene.objects.iter().any(may_be_packed) {
        return Err("no volume of a file is drawn".into());
    }
    Ok(choices(
        "lattice",
        |request, value| {
            for object in request.scene.objects.iter_mut().filter(|o| may_be_packed(o)) {
                object.packing = if value > 0.0 { Packing::BodyCentred } else { Packing::Cartesian };
            }
        },
        &[("Cartesian", 0.0), ("body-centred cubic, 71 % of the points", 1.0)],
    ))
}

fn may_be_packed(object: &SceneObject) -> bool {
    is_drawn(object) && object.clip.is_empty() && matches!(object.source, Source::Volume(_))
}

fn is_drawn(object: &SceneObject) -> bool {
    object.visible && object.technique.is_none_or(|t| t == Technique::Sheets)
}

/// A knob whose steps are no sizes.
fn choices(name: &'static str, set: fn(&mut Request, f64), steps: &[(impl AsRef<str>, f64)]) -> Knob {
    Knob {
        name,
        size_meaning: "",
        set,
        steps: steps.iter().map(|(label, value)| choice(label.as_ref(), *value)).collect(),
        ends: Vec::new(),
        end_is_exact: false,
        theory: None,
        scene_size: None,
        joint: false,
    }
}

/// Settings of sheets that are splatted whatever the plan would choose, so that what a knob of their kernel changes is the kernel alone.
fn splatted(request: &mut Request) -> &mut SheetsSettings {
    let sheets = &mut request.scene.render.sheets;
    sheets.reconstruction = Reconstruction::Splat;
    sheets
}

/// How far a kernel reaches with the deviation that it has.
fn radius() -> Knob {
    let set = |request: &mut Request, value| splatted(request).kernel_extent = value;
    choices("kernel radius", set, &[1.5, 2.0, 3.0].map(steps_of_the_lattice))
}

fn deviation() -> Knob {
    let set = |request: &mut Request, value| splatted(request).kernel_sigma = value;
    choices("kernel deviation", set, &[0.5, 0.7, 1.0].map(steps_of_the_lattice))
}

/// Places within a slab at which kernels begin; the paper has 64.
fn sections(scene: &Scene, options: &Options) -> Knob {
    let counts: &[f64] = if options.quick { &[1.0, 4.0, 16.0] } else { &[1.0, 2.0, 4.0, 8.0, 16.0, 64.0] };
    let at = |n: f64| step(format!("{n} a slab"), n.recip(), n);
    Knob {
        name: "kernel sections",
        size_meaning: "1 / sections in a slab's width",
        set: |request, value| splatted(request).kernel_sections = value as u32,
        steps: counts.iter().map(|n| at(*n)).collect(),
        ends: vec![at(256.0)],
        end_is_exact: false,
        theory: Some(Theory {
            low: 0.5,
            high: 2.0,
            why: "kernels are moved along the view by up to half of what places are apart: 1, more where neighbours make up for it; 1/2 \
                  where few pixels, at the borders of what is seen, change altogether",
        }),
        scene_size: Some(f64::from(scene.render.sheets.kernel_sections).recip()),
        joint: true,
    }
}

/// What is summed over voxels in a slab and over slabs in a pixel, in single precision or in buffers of 16 bits.
fn buffers() -> Knob {
    let set = |request: &mut Request, value| {
        splatted(request).accumulation = if value > 0.0 { Accumulation::F32 } else { Accumulation::F16 };
    };
    choices("buffer format", set, &[("f16", 0.0), ("f32", 1.0)])
}

/// Where the normals of volumes come from.
fn gradients(scene: &Scene) -> Result<Knob, String> {
    let reflects = |o: &SceneObject| {
        let is_volume = matches!(o.source, Source::Volume(_) | Source::Density(_) | Source::Cloud(_));
        is_volume && is_drawn(o) && scene.materials[o.material].material.shading == Shading::Phong
    };
    if scene.lights.is_empty() || !scene.objects.iter().any(reflects) {
        return Err("no volume reflects about its gradient".into());
    }
    let set = |request: &mut Request, value| {
        request.scene.render.sheets.gradients =
            if value > 0.0 { SheetGradients::Volume } else { SheetGradients::Sheets };
    };
    Ok(choices("gradients", set, &[("of neighbouring sheets", 0.0), ("a gradient volume", 1.0)]))
}

fn steps_of_the_lattice(steps: f64) -> (String, f64) {
    (format!("{steps} steps of the lattice"), steps)
}
