//! Checks of the render settings.

use crate::at::At;
use crate::limits::{LARGEST, MOST_SHADOW_CELLS, SMALLEST};
use crate::render::raw::{
    Auto, Choice, RawAccumulation, RawAligned, RawClassify, RawDirection, RawGoal, RawGradients, RawKernel, RawMapping,
    RawParticles, RawPoints, RawReconstruction, RawRender, RawScattering, RawShadow, RawSheets, RawSlicing,
    RawSoftShadows, RawSurfaceSampler, RawVolumeSampler, Whole,
};
use crate::render::surfels_check::check_surfels;
use crate::text::de::suggest;
use crate::text::tree::Value;
use crate::{
    Aligned, Classify, Error, Goal, LAYER_NAMES, LayerChoice, ParticlesSettings, PointsSettings, Reconstruction,
    RenderSettings, Scattering, ShadowMapping, ShadowSettings, SheetGradients, SheetKernel, SheetsSettings, Slicing,
    SoftShadows, Stated, SurfaceSampler, Technique, TechniqueKey, VolumeSampler, shown,
};
use splat_core::{Accumulation, Direction};

/// Checks `[render]`.
pub(crate) fn check_render(at: &At<'_>, raw: &RawRender) -> Result<RenderSettings, Error> {
    let tolerance = raw.tolerance.unwrap_or(1.0 / 255.0);
    if !(tolerance > 0.0 && tolerance <= 1.0) {
        let message = format!("`tolerance`: expected a number above 0, at most 1, found {}", crate::short(tolerance));
        return Err(at.key("tolerance").error(message, "the default is 1/255"));
    }
    let splat_share = raw.splat_share.unwrap_or(1.0);
    if !(splat_share > 0.0 && splat_share <= 1.0) {
        let message =
            format!("`splat_share`: expected a number above 0, at most 1, found {}", crate::short(splat_share));
        return Err(at.key("splat_share").error(message, "the default is 1, all of them"));
    }
    if raw.max_points == Some(0) {
        return Err(at.key("max_points").error("`max_points`: expected a whole number above 0, found 0", ""));
    }
    let technique = check_technique(at, raw.technique.as_deref().unwrap_or("auto"))?;
    Ok(RenderSettings {
        technique,
        choice: None,
        antialias: at.whole("antialias", Whole::stated(raw.antialias).unwrap_or(2), 1..=8)?,
        stated: Stated {
            antialias: Whole::stated(raw.antialias).is_some(),
            exact: Choice::stated(raw.points.exact).is_some(),
            accumulation_of_points: raw.points.accumulation != RawAccumulation::Auto,
            accumulation_of_sheets: raw.sheets.accumulation != RawAccumulation::Auto,
        },
        tolerance,
        exposure: at.number("exposure", raw.exposure.unwrap_or(0.0), -60.0..=60.0)?,
        depth_ranges: at.whole("depth_ranges", raw.depth_ranges.unwrap_or(16), 1..=1024)?,
        layers: check_layers(&at.key("layers"), &raw.layers, technique)?,
        // They name lights, which are checked later.
        effects: Vec::new(),
        seed: raw.seed.unwrap_or(0),
        splat_share,
        max_points: raw.max_points,
        goal: check_goal(at, raw)?,
        shadow: check_shadow(&at.key("shadow"), &raw.shadow)?,
        points: check_points(&at.key("points"), &raw.points)?,
        particles: check_particles(&at.key("particles"), &raw.particles)?,
        sheets: check_sheets(&at.key("sheets"), &raw.sheets)?,
        surfels: check_surfels(&at.key("surfels"), &raw.surfels)?,
    })
}

/// The keys that are written in tables of techniques, which are called as these are.
pub(crate) fn technique_keys(at: &At<'_>) -> Vec<TechniqueKey> {
    let Value::Table(tables) = &at.node().value else { return Vec::new() };
    let mut keys = Vec::new();
    for table in tables {
        let named = Technique::ALL.into_iter().find(|technique| technique.name() == table.key);
        let (Some(technique), Value::Table(entries)) = (named, &table.node.value) else { continue };
        let key = |entry: &str| format!("render.{}.{}", table.key, entry);
        keys.extend(entries.iter().map(|entry| TechniqueKey { technique, key: key(&entry.key) }));
    }
    keys
}

/// What the picture is to keep to.
fn check_goal(at: &At<'_>, raw: &RawRender) -> Result<Goal, Error> {
    let budget_ms = match raw.budget_ms {
        None | Some(RawGoal::None) => None,
        Some(RawGoal::Number(ms)) if ms.fract() == 0.0 && (1.0..=Goal::MOST_MS as f64).contains(&ms) => Some(ms as u64),
        Some(RawGoal::Number(ms)) => {
            let message = format!(
                "`budget_ms`: expected a whole number of milliseconds from 1 to {} or \"none\", found {}",
                Goal::MOST_MS,
                crate::short(ms)
            );
            return Err(at.key("budget_ms").error(message, ""));
        }
    };
    let error = |key: &'static str, value: Option<RawGoal>| match value {
        None | Some(RawGoal::None) => Ok(None),
        Some(RawGoal::Number(error)) if error > 0.0 && error <= 1.0 => Ok(Some(error)),
        Some(RawGoal::Number(error)) => {
            let found = crate::short(error);
            let message = format!("`{key}`: expected a number above 0, at most 1, or \"none\", found {found}");
            Err(at.key(key).error(message, "1/255 is one step of a displayed picture"))
        }
    };
    Ok(Goal { budget_ms, max_rmse: error("max_rmse", raw.max_rmse)?, max_flip: error("max_flip", raw.max_flip)? })
}

/// A technique by its name.
pub(crate) fn check_technique(at: &At<'_>, name: &str) -> Result<Technique, Error> {
    if let Some(known) = Technique::ALL.into_iter().find(|t| t.name() == name) {
        return Ok(known);
    }
    const NAMES: &str = r#""auto", "points", "particles", "sheets", "surfels" or "reference""#;
    let message = format!("`technique`: expected {NAMES}, found \"{}\"", shown(name));
    Err(at.key("technique").error(message, format!("use {NAMES}")))
}

fn check_layers(at: &At<'_>, names: &[String], technique: Technique) -> Result<LayerChoice, Error> {
    let mut choice = LayerChoice::default();
    for (i, name) in names.iter().enumerate() {
        if !choice.add(name) {
            return Err(at.index(i).error(format!("there is no layer `{}`", shown(name)), suggest(name, &LAYER_NAMES)));
        }
    }
    let lacking = own_layers(&choice).find(|(owner, _)| *owner != technique);
    match lacking {
        None => Ok(choice),
        Some((owner, layer)) => {
            let message = format!("the technique `{}` has no layer `{layer}`", technique.name());
            Err(at.error(message, format!("use technique = \"{}\"", owner.name())))
        }
    }
}

/// The layers of a choice that one technique alone fills, each after that technique.
pub(crate) fn own_layers(choice: &LayerChoice) -> impl Iterator<Item = (Technique, &'static str)> + '_ {
    let owner = |layer: &&str| Technique::ALL.into_iter().find(|t| t.own_layers().contains(layer));
    choice.names().filter_map(move |layer| Some((owner(&layer)?, layer)))
}

fn check_particles(at: &At<'_>, raw: &RawParticles) -> Result<ParticlesSettings, Error> {
    Ok(ParticlesSettings {
        repeat_level: at.whole("repeat_level", raw.repeat_level.unwrap_or(100), 2..=1_000_000)?,
        target_error: raw.target_error.map(|e| at.number("target_error", e, SMALLEST..=LARGEST)).transpose()?,
        surface_sampler: check_surface_sampler(at, raw)?,
        volume_sampler: check_volume_sampler(at, raw)?,
    })
}

fn check_surface_sampler(at: &At<'_>, raw: &RawParticles) -> Result<SurfaceSampler, Error> {
    let step = raw.brownian_step.map(|s| at.number("brownian_step", s, 1e-4..=0.1)).transpose()?;
    if step.is_some() && raw.surface_sampler != RawSurfaceSampler::Brownian {
        let message = "`brownian_step`: the surface sampler is not \"brownian\"";
        return Err(at.key("brownian_step").error(message, "set surface_sampler = \"brownian\""));
    }
    Ok(match raw.surface_sampler {
        RawSurfaceSampler::Auto => SurfaceSampler::Auto,
        RawSurfaceSampler::Lines => SurfaceSampler::Lines,
        RawSurfaceSampler::Triangles => SurfaceSampler::Triangles,
        // The paper's for a surface of width 1.
        RawSurfaceSampler::Brownian => SurfaceSampler::Brownian { step: step.unwrap_or(0.01) },
    })
}

fn check_volume_sampler(at: &At<'_>, raw: &RawParticles) -> Result<VolumeSampler, Error> {
    let stride = raw.metropolis_stride.map(|n| at.whole("metropolis_stride", n, 1..=4096)).transpose()?;
    if stride.is_some() && raw.volume_sampler != RawVolumeSampler::Metropolis {
        let message = "`metropolis_stride`: the volume sampler is not \"metropolis\"";
        return Err(at.key("metropolis_stride").error(message, "set volume_sampler = \"metropolis\""));
    }
    Ok(match raw.volume_sampler {
        RawVolumeSampler::Auto => VolumeSampler::Auto,
        RawVolumeSampler::Cells => VolumeSampler::Cells,
        RawVolumeSampler::Metropolis => VolumeSampler::Metropolis { stride: stride.unwrap_or(16) },
    })
}

fn check_points(at: &At<'_>, raw: &RawPoints) -> Result<PointsSettings, Error> {
    let slice_thickness = match raw.slice_thickness {
        None | Some(Auto::Auto) => None,
        Some(Auto::Number(x)) => Some(at.length("slice_thickness", x)?),
    };
    if raw.first_slices == Some(0) {
        return Err(at.key("first_slices").error("`first_slices`: expected a whole number above 0, found 0", ""));
    }
    Ok(PointsSettings {
        slice_thickness,
        exact: Choice::stated(raw.exact).unwrap_or(true),
        direction: match raw.direction {
            RawDirection::FrontToBack => Direction::FrontToBack,
            RawDirection::BackToFront => Direction::BackToFront,
        },
        first_slices: raw.first_slices,
        transmittance_cutoff: check_cutoff(at, raw.transmittance_cutoff)?,
        resampling_filter: raw.resampling_filter.unwrap_or(true),
        accumulation: check_accumulation(raw.accumulation),
    })
}

fn check_accumulation(raw: RawAccumulation) -> Accumulation {
    match raw {
        RawAccumulation::Auto | RawAccumulation::F32 => Accumulation::F32,
        RawAccumulation::F16 => Accumulation::F16,
    }
}

/// The transmittance at which a pixel is finished.
pub(crate) fn check_cutoff(at: &At<'_>, raw: Option<f64>) -> Result<f64, Error> {
    let cutoff = raw.unwrap_or(1.0 / 1024.0);
    if (0.0..1.0).contains(&cutoff) {
        return Ok(cutoff);
    }
    let message = format!("`transmittance_cutoff`: expected a number from 0 to below 1, found {cutoff}");
    Err(at.key("transmittance_cutoff").error(message, "0 composites everything"))
}

fn check_sheets(at: &At<'_>, raw: &RawSheets) -> Result<SheetsSettings, Error> {
    let slab_width = match raw.slab_width {
        None | Some(Auto::Auto) => None,
        Some(Auto::Number(x)) => Some(at.length("slab_width", x)?),
    };
    let extent = at.number("kernel_extent", raw.kernel_extent.unwrap_or(2.0), 0.5..=8.0)?;
    // A scene that states the extent alone keeps the default's ratio of deviation to extent.
    let sigma = at.number("kernel_sigma", raw.kernel_sigma.unwrap_or(0.35 * extent), 0.125 * extent..=extent)?;
    let reconstruction = check_reconstruction(at, raw)?;
    Ok(SheetsSettings {
        slicing: check_slicing(at, raw)?,
        may_slice: raw.slicing == RawSlicing::Auto,
        may_scatter: raw.scattering == RawScattering::Auto,
        classify: match raw.classify {
            None | Some(RawClassify::Auto) => Classify::Auto,
            Some(RawClassify::After) => Classify::After,
            Some(RawClassify::Preintegrated) => Classify::Preintegrated,
            Some(RawClassify::Before) => Classify::Before,
        },
        aligned: check_aligned(at, raw, slab_width)?,
        slab_width,
        reconstruction,
        kernel: if raw.kernel == Some(RawKernel::Linear) { SheetKernel::Linear } else { SheetKernel::Gaussian },
        kernel_extent: extent,
        kernel_sigma: sigma,
        kernel_sections: check_sections(at, raw.kernel_sections.unwrap_or(256))?,
        accumulation: check_accumulation(raw.accumulation),
        gradients: match raw.gradients {
            RawGradients::Auto => SheetGradients::Auto,
            RawGradients::Sheets => SheetGradients::Sheets,
            RawGradients::Volume => SheetGradients::Volume,
            RawGradients::Kernel => SheetGradients::Kernel,
        },
        transmittance_cutoff: check_cutoff(at, raw.transmittance_cutoff)?,
    })
}

/// Returns how slabs get their values. Keys that gathering ignores are refused beside it.
fn check_reconstruction(at: &At<'_>, raw: &RawSheets) -> Result<Reconstruction, Error> {
    let splatted = [
        ("kernel_extent", raw.kernel_extent.is_some(), "their kernel has an extent of 2"),
        ("kernel_sigma", raw.kernel_sigma.is_some(), "their kernel has a deviation of 0.7"),
        ("kernel_sections", raw.kernel_sections.is_some(), "their kernels have no sections"),
        ("classify", raw.classify == Some(RawClassify::Before), "they classify what they have reconstructed"),
        ("aligned", raw.aligned == Some(RawAligned::Axis), "they lie along the view"),
        ("accumulation", raw.accumulation == RawAccumulation::F16, "they sum nothing over voxels"),
    ];
    // The key that asks for gathered slabs: these two values are known to gathered slabs alone.
    let asked = if raw.kernel == Some(RawKernel::Linear) {
        Some("kernel = \"linear\"")
    } else if raw.gradients == RawGradients::Kernel {
        Some("gradients = \"kernel\"")
    } else {
        (raw.reconstruction == RawReconstruction::Gather).then_some("reconstruction = \"gather\"")
    };
    if raw.reconstruction == RawReconstruction::Splat {
        let refused =
            |key, message| Err(at.key(key).error(message, "set reconstruction = \"gather\", or leave it out"));
        if raw.kernel.is_some() {
            return refused(
                "kernel",
                "`kernel`: slabs are splatted, whose kernel `kernel_extent` and `kernel_sigma` state",
            );
        }
        if raw.gradients == RawGradients::Kernel {
            return refused("gradients", "`gradients`: slabs are splatted, and read no field that has a derivative");
        }
        return Ok(Reconstruction::Splat);
    }
    let Some(asked) = asked else {
        return Ok(Reconstruction::Auto);
    };
    match splatted.into_iter().find(|(_, is_given, _)| *is_given) {
        None => Ok(Reconstruction::Gather),
        Some((key, _, reason)) => {
            let message = format!("`{key}`: {asked} has slabs gathered, and {reason}");
            Err(at.key(key).error(message, "set reconstruction = \"splat\", or leave it out"))
        }
    }
}

fn check_sections(at: &At<'_>, sections: u32) -> Result<u32, Error> {
    if sections.is_power_of_two() && sections <= 256 {
        return Ok(sections);
    }
    let message = format!("`kernel_sections`: expected 1, 2, 4 and so on up to 256, found {sections}");
    Err(at.key("kernel_sections").error(message, "the paper has 64, and 256 is the default"))
}

fn check_aligned(at: &At<'_>, raw: &RawSheets, slab_width: Option<f64>) -> Result<Aligned, Error> {
    if raw.aligned != Some(RawAligned::Axis) {
        return Ok(Aligned::View);
    }
    if slab_width.is_some() {
        let message = "`slab_width`: slabs along a lattice are as wide as its planes are apart";
        return Err(at.key("slab_width").error(message, "leave it out, or set aligned = \"view\""));
    }
    Ok(Aligned::Axis)
}

fn check_slicing(at: &At<'_>, raw: &RawSheets) -> Result<Slicing, Error> {
    if raw.slicing == RawSlicing::HalfVector {
        let given = [("classify", raw.classify.is_some()), ("aligned", raw.aligned.is_some())];
        if let Some((key, _)) = given.into_iter().find(|(_, is_given)| *is_given) {
            let message = format!("`{key}`: slabs across half vectors have no such choice");
            return Err(at.key(key).error(message, "set slicing = \"view\", or leave it out"));
        }
        return Ok(Slicing::HalfVector {
            light_pixels: at.number("light_pixels", raw.light_pixels.unwrap_or(1.5), 0.1..=16.0)?,
            most_light_pixels: at.whole("most_light_pixels", raw.most_light_pixels.unwrap_or(2048), 16..=8192)?,
            scattering: check_scattering(at, raw)?,
            soft_shadows: match raw.soft_shadows {
                RawSoftShadows::Points => SoftShadows::Points,
                RawSoftShadows::OneSweep => SoftShadows::OneSweep,
            },
        });
    }
    let given = [
        ("light_pixels", raw.light_pixels.is_some()),
        ("most_light_pixels", raw.most_light_pixels.is_some()),
        ("scattering", !raw.scattering.is_at_most_once()),
        ("soft_shadows", raw.soft_shadows != RawSoftShadows::Points),
    ];
    if let Some((key, _)) = given.into_iter().find(|(_, is_given)| *is_given) {
        let message = format!("`{key}`: slabs across the view do not carry light");
        return Err(at.key(key).error(message, "set slicing = \"half_vector\", or leave it out"));
    }
    check_scattering(at, raw).map(|_| Slicing::View)
}

fn check_scattering(at: &At<'_>, raw: &RawSheets) -> Result<Option<Scattering>, Error> {
    let given =
        [("scattering_cone", raw.scattering_cone.is_some()), ("voxels_per_cell", raw.voxels_per_cell.is_some())];
    if raw.scattering.is_at_most_once() {
        return match given.into_iter().find(|(_, is_given)| *is_given) {
            None => Ok(None),
            Some((key, _)) => {
                let message = format!("`{key}`: light is scattered once");
                Err(at.key(key).error(message, "set scattering = \"forward_and_back\", or leave it out"))
            }
        };
    }
    let cone = match raw.scattering_cone {
        None | Some(Auto::Auto) => None,
        Some(Auto::Number(degrees)) if (0.0..90.0).contains(&degrees) => Some(degrees.to_radians()),
        Some(Auto::Number(degrees)) => {
            let message = format!(
                "`scattering_cone`: expected degrees from 0 to below 90 or \"auto\", found {}",
                crate::short(degrees)
            );
            return Err(at.key("scattering_cone").error(message, ""));
        }
    };
    Ok(Some(Scattering {
        back: raw.scattering == RawScattering::ForwardAndBack,
        cone,
        voxels_per_cell: at.whole("voxels_per_cell", raw.voxels_per_cell.unwrap_or(32), 1..=1 << 20)?,
    }))
}

fn check_shadow(at: &At<'_>, raw: &RawShadow) -> Result<ShadowSettings, Error> {
    let cells = match raw.cells {
        None | Some(Auto::Auto) => None,
        Some(Auto::Number(n)) if n.fract() == 0.0 && (1.0..=f64::from(MOST_SHADOW_CELLS)).contains(&n) => {
            Some(n as u32)
        }
        Some(Auto::Number(n)) => {
            let message =
                format!("`cells`: expected a whole number from 1 to {MOST_SHADOW_CELLS} or \"auto\", found {n}");
            return Err(at.key("cells").error(message, ""));
        }
    };
    Ok(ShadowSettings {
        mapping: match raw.mapping {
            RawMapping::Auto => ShadowMapping::Auto,
            RawMapping::Octahedral => ShadowMapping::Octahedral,
            RawMapping::Polar => ShadowMapping::Polar,
        },
        cells,
        absorbance_cut: raw.absorbance_cut.map(|a| at.number("absorbance_cut", a, SMALLEST..=LARGEST)).transpose()?,
    })
}
