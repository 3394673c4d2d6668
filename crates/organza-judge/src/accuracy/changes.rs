//! The lines that make a scene file draw as a setting of a report did.

use super::Request;
use super::knob::points::spacing_factor;
use super::knob::tables;
use organza::scene::{
    Classify, Collisions, Coverage, Grouping, Reconstruction, RenderSettings, Scene, ShadowMapping, SheetGradients,
    SheetKernel, Slicing, SoftShadows, SurfaceSampler, SurfelLayers, VolumeSampler,
};
use splat_core::Packing;
use splat_core::raster::Accumulation;

/// A key of a scene and its value.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Change {
    /// Tables with dots between them, such as `render.shadow`.
    pub table: String,
    /// The key.
    pub key: &'static str,
    /// The value in TOML; `None` of a key that has to be left out.
    pub value: Option<String>,
}

impl Change {
    /// The argument of `--set` on the command line; `None` for a key that has to be left out, because `--set` cannot
    /// remove keys.
    pub fn set(&self) -> Option<String> {
        Some(format!("{}.{}={}", self.table, self.key, self.value.as_ref()?))
    }
}

/// The changes that turn a scene `as_written` into what a request draws, tables together. Spacings are not among them, since a
/// source may state a resolution instead: [`lines()`] adds the factor by which they change.
pub fn changes(as_written: &Scene, request: &Request) -> Vec<Change> {
    let [before, after] = [&as_written.render, &request.scene.render].map(stated);
    let value_in = |list: &[Stated], table, key| list.iter().find(|s| (s.0, s.1) == (table, key)).map(|s| s.2.clone());
    let mut found = Vec::new();
    for (table, key, value) in &after {
        // By itself the deviation of a kernel follows its extent.
        let tied = *key == "kernel_sigma"
            && value_in(&before, table, "kernel_extent") != value_in(&after, table, "kernel_extent");
        if tied || value_in(&before, table, key).as_ref() != Some(value) {
            found.push(Change { table: (*table).into(), key, value: Some(value.clone()) });
        }
    }
    add_slicing(&request.scene.render, &mut found);
    let gone = before.iter().filter(|(table, key, _)| value_in(&after, table, key).is_none());
    found.extend(gone.map(|(table, key, _)| Change { table: (*table).into(), key, value: None }));
    // The layout of a file: a table is opened once.
    found.sort_by_key(|change| stated_tables().position(|table| table == change.table));
    for (before, object) in as_written.objects.iter().zip(&request.scene.objects) {
        let mut add = |key, value| found.push(Change { table: format!("object.{}", object.name), key, value });
        if before.technique != object.technique {
            add("technique", object.technique.map(|technique| quoted(technique.name())));
        }
        if before.packing != object.packing {
            add("lattice", Some(quoted(if object.packing == Packing::BodyCentred { "bcc" } else { "cartesian" })));
        }
    }
    found
}

/// Slabs that carry light, where what they alone have is changed: a scene that leaves their slicing to the plan would be refused with that.
fn add_slicing(render: &RenderSettings, found: &mut Vec<Change>) {
    const OF_CARRIED: [&str; 4] = ["light_pixels", "soft_shadows", "scattering_cone", "voxels_per_cell"];
    let Slicing::HalfVector { scattering, .. } = render.sheets.slicing else { return };
    let Some(first) = found.iter().position(|change| OF_CARRIED.contains(&change.key)) else { return };
    let mut add = |key, value: &str| {
        found.insert(first, Change { table: "render.sheets".into(), key, value: Some(quoted(value)) });
    };
    if let Some(scattering) = scattering {
        add("scattering", if scattering.back { "forward_and_back" } else { "forward" });
    }
    add("slicing", "half_vector");
}

/// The same as TOML to copy. Settings that no line of a table can state become comments.
pub fn lines(as_written: &Scene, request: &Request) -> String {
    let mut text = String::new();
    let mut open = String::new();
    for Change { table, key, value } in changes(as_written, request) {
        if table != open && table.starts_with("render") {
            text += &format!("[{table}]\n");
        }
        match value {
            Some(value) if table.starts_with("render") => text += &format!("{key} = {value}\n"),
            Some(value) => text += &format!("# {table}: {key} = {value}\n"),
            None => text += &format!("# without {key}\n"),
        }
        open = table;
    }
    if let Some(texels) = tables::texels(as_written, &request.scene) {
        text += &format!(
            "# the Gaussians of translucent surfaces as images of {texels} texels a side; lights without shadows\n"
        );
    }
    if let Some(factor) = spacing_factor(as_written, &request.scene) {
        text += &format!("# the spacing of every object times {factor:?}, or its resolution divided by that\n");
    }
    if request.packed {
        text += "# organza convert --packed keeps the splats, and `points` reads them\n";
    }
    text
}

/// Table, key and value of a setting.
type Stated = (&'static str, &'static str, String);

fn stated_tables() -> impl Iterator<Item = &'static str> {
    ["render", "render.shadow", "render.points", "render.particles", "render.sheets", "render.surfels"].into_iter()
}

/// All that knobs turn, as a scene would state it.
fn stated(render: &RenderSettings) -> Vec<Stated> {
    let mut settings = vec![
        ("render", "technique", quoted(render.technique.name())),
        ("render", "antialias", render.antialias.to_string()),
        ("render", "splat_share", number(render.splat_share)),
    ];
    shadow(render, &mut settings);
    points(render, &mut settings);
    particles(render, &mut settings);
    sheets(render, &mut settings);
    surfels(render, &mut settings);
    settings
}

fn shadow(render: &RenderSettings, settings: &mut Vec<Stated>) {
    let mapping = match render.shadow.mapping {
        ShadowMapping::Auto => "auto",
        ShadowMapping::Octahedral => "octahedral",
        ShadowMapping::Polar => "polar",
    };
    let mut add = |key, value| settings.push(("render.shadow", key, value));
    add("mapping", quoted(mapping));
    add("cells", render.shadow.cells.map_or_else(|| quoted("auto"), |n| n.to_string()));
    if let Some(cut) = render.shadow.absorbance_cut {
        add("absorbance_cut", number(cut));
    }
}

fn points(render: &RenderSettings, settings: &mut Vec<Stated>) {
    let points = &render.points;
    let mut add = |key, value| settings.push(("render.points", key, value));
    add("slice_thickness", points.slice_thickness.map_or_else(|| quoted("auto"), number));
    add("exact", points.exact.to_string());
    add("transmittance_cutoff", number(points.transmittance_cutoff));
    add("resampling_filter", points.resampling_filter.to_string());
    add("accumulation", precision(points.accumulation));
}

fn particles(render: &RenderSettings, settings: &mut Vec<Stated>) {
    let mut add = |key, value| settings.push(("render.particles", key, value));
    add("repeat_level", render.particles.repeat_level.to_string());
    if let Some(error) = render.particles.target_error {
        add("target_error", number(error));
    }
    let (sampler, step) = match render.particles.surface_sampler {
        SurfaceSampler::Auto => ("auto", None),
        SurfaceSampler::Lines => ("lines", None),
        SurfaceSampler::Triangles => ("triangles", None),
        SurfaceSampler::Brownian { step } => ("brownian", Some(step)),
    };
    add("surface_sampler", quoted(sampler));
    if let Some(step) = step {
        add("brownian_step", number(step));
    }
    let (sampler, stride) = match render.particles.volume_sampler {
        VolumeSampler::Auto => ("auto", None),
        VolumeSampler::Cells => ("cells", None),
        VolumeSampler::Metropolis { stride } => ("metropolis", Some(stride)),
    };
    add("volume_sampler", quoted(sampler));
    if let Some(stride) = stride {
        add("metropolis_stride", stride.to_string());
    }
}

fn sheets(render: &RenderSettings, settings: &mut Vec<Stated>) {
    let sheets = &render.sheets;
    let mut add = |key, value| settings.push(("render.sheets", key, value));
    add("slab_width", sheets.slab_width.map_or_else(|| quoted("auto"), number));
    let reconstruction = match sheets.reconstruction {
        Reconstruction::Auto => "auto",
        Reconstruction::Gather => "gather",
        Reconstruction::Splat => "splat",
    };
    add("reconstruction", quoted(reconstruction));
    if sheets.kernel == SheetKernel::Linear {
        add("kernel", quoted("linear"));
    }
    add("kernel_extent", number(sheets.kernel_extent));
    add("kernel_sigma", number(sheets.kernel_sigma));
    add("kernel_sections", sheets.kernel_sections.to_string());
    add("accumulation", precision(sheets.accumulation));
    let gradients = match sheets.gradients {
        SheetGradients::Auto => "auto",
        SheetGradients::Sheets => "sheets",
        SheetGradients::Volume => "volume",
        SheetGradients::Kernel => "kernel",
    };
    add("gradients", quoted(gradients));
    add("transmittance_cutoff", number(sheets.transmittance_cutoff));
    let Slicing::HalfVector { light_pixels, scattering, soft_shadows, .. } = sheets.slicing else {
        let classify = match sheets.classify {
            Classify::Auto => "auto",
            Classify::After => "after",
            Classify::Preintegrated => "preintegrated",
            Classify::Before => "before",
        };
        add("classify", quoted(classify));
        return;
    };
    add("light_pixels", number(light_pixels));
    add("soft_shadows", quoted(if soft_shadows == SoftShadows::OneSweep { "one_sweep" } else { "points" }));
    if let Some(scattering) = scattering {
        add("scattering_cone", scattering.cone.map_or_else(|| quoted("auto"), |cone| number(cone.to_degrees())));
        add("voxels_per_cell", scattering.voxels_per_cell.to_string());
    }
}

fn surfels(render: &RenderSettings, settings: &mut Vec<Stated>) {
    let surfels = &render.surfels;
    let mut add = |key, value| settings.push(("render.surfels", key, value));
    add("disc_scale", number(surfels.disc_scale));
    add("gap", number(surfels.gap));
    add("transmittance_cutoff", number(surfels.transmittance_cutoff));
    let layers = match surfels.layers {
        SurfelLayers::Gaps => "gaps",
        SurfelLayers::Peeled(_) => "peeled",
        SurfelLayers::Algorithm1(_) => "algorithm1",
        SurfelLayers::Algorithm2(_) => "algorithm2",
    };
    add("layers", quoted(layers));
    if let SurfelLayers::Peeled(most) = surfels.layers {
        add("peeled_layers", most.to_string());
    }
    // What is "auto" is not written: it would be refused beside what needs no groups.
    let Some(groups) = surfels.layers.groups() else { return };
    add("groups", groups.count.to_string());
    match groups.grouping {
        Grouping::Auto => {}
        Grouping::Weighted => add("grouping", quoted("wgc")),
        Grouping::Minimum { factor } => {
            add("grouping", quoted("mgc"));
            add("overlap_factor", number(factor));
        }
        Grouping::Hash(collisions) => {
            add("grouping", quoted("hash"));
            let (word, near) = match collisions {
                Collisions::Resolve => ("resolve", None),
                Collisions::Keep => ("keep", None),
                Collisions::Near(distance) => ("near", Some(distance)),
            };
            add("collisions", quoted(word));
            if let Some(distance) = near {
                add("near_distance", number(distance));
            }
        }
    }
    let coverage = match groups.coverage {
        Coverage::Auto => return,
        Coverage::Partial => "partial",
        Coverage::Duplicates => "duplicates",
        Coverage::Enlarged => "enlarged",
        Coverage::Bound => "bound",
    };
    add("coverage", quoted(coverage));
}

fn precision(accumulation: Accumulation) -> String {
    quoted(if accumulation == Accumulation::F16 { "f16" } else { "f32" })
}

fn quoted(word: &str) -> String {
    format!("\"{word}\"")
}

/// The shortest text that is read as the same number, with a point or an exponent, so that it is no whole number to TOML.
fn number(value: f64) -> String {
    format!("{value:?}")
}
