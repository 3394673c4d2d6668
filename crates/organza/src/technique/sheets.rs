//! The `sheets` technique (Neophytou and Mueller 2005): slabs across the view, front to back. Volumes are splatted value by value, and classified and
//! shaded when a slab is complete, so zooms show no blur. Other objects come as splats, each in the slab of its centre, where extinctions add.
//!
//! Light comes from the same shadow maps as for all techniques; or, in slabs across the half vector of light and view, through these
//! slabs themselves ([`half`]).

mod half;
mod polygons;
mod reconstruction;

use crate::cost::extent::{Extent, SlantedBox, shown_length};
use crate::cost::{Count, Item, Translucent};
use crate::form::Form;
use crate::frame::matter::Matter;
use crate::frame::{Frame, Shaded};
use crate::load::Loaded;
use crate::load::own::{Body, Own};
use crate::pass;
use crate::plan::{Effect, Plan, PlannedSetting};
use crate::scene::{self, LightPoint, Scene, SheetGradients, Technique};
use crate::statistics::{MediumFacts, ObjectData, ObjectStatistics, SourceFacts};
use crate::technique::{Asked, Fold, OwnWork, Session, points};
use crate::{CostRecord, Error, RenderOptions, memory, stage};
use sheet_light::half::{HalfParams, has_slabs, pane_bytes, polygon_bytes};
use sheet_light::{
    Aligned, Classify, GatherKernel, Gradients, KernelShape, Lighting, Params, Reconstruction, SheetInput, Sheeted,
    Splats, Volume, prepare,
};
use splat_core::glam::{DMat3, DVec3};
use splat_core::raster::OpaqueImage;
use splat_core::{Accumulator, Camera, DAabb, Direction, Grid, Limits, Packing, Shading, TransferFunction};
use std::ops::Range;

/// Bytes of a sample that slabs across half vectors see or light, of a volume more there, of a cell of scattered light in both streams, and of a voxel.
const BYTES_OF_A_SAMPLE: u64 = 300;
const BYTES_OF_A_SHEET: u64 = 130;
const CELL_BYTES: u64 = 960;
const BYTES_OF_A_VOXEL: f64 = 120.0;
/// Voxels of a cell as a scene has them by default, and the cells that thin layers may be cut into.
const VOXELS_OF_A_CELL: u64 = 32;
const LEAST_CELLS: u64 = 1 << 16;

/// Times of one sample in one slab, over that of reading it between 8 voxels and classifying it, fitted to `scenes/head.toml` and `scenes/levels.toml`: reading it by the
/// 64 voxels of the Gaussian kernel, lighting it by a light, and by one that has a shadow map.
const GAUSSIAN_SAMPLE: f64 = 2.0;
const LIT_SAMPLE: f64 = 0.3;
const SHADOWED_SAMPLE: f64 = 1.3;
/// The same of a voxel that a shadow map is asked at, and of one of a lattice: filtered before its pixels are read, or found to show something or nothing.
const SHADOWED_VOXEL: f64 = 16.0;
const FILTERED_VOXEL: f64 = 0.35;
const SOUGHT_VOXEL: f64 = 0.1;

/// Voxels that a sample is interpolated between.
const CORNERS: f64 = 8.0;

/// The form in which an object is taken.
pub(crate) fn form(object: &ObjectStatistics) -> (Form, &'static str) {
    match object.data {
        ObjectData::Volume => (Form::Cells, "sheets classify what they reconstruct"),
        ObjectData::Density { .. } => (Form::Cells, "sheets reconstruct it from a lattice"),
        ObjectData::Triangles if !object.is_plain => (Form::Splats, "footprints are seen on discs alone"),
        ObjectData::Points | ObjectData::Gaussians | ObjectData::Triangles | ObjectData::Surface { .. } => {
            (Form::Splats, "what is no lattice is splatted into the slabs that it lies in")
        }
    }
}

/// Fragments in slabs, and the samples that slabs cover.
pub(crate) fn counts(_: &Scene, translucent: &Translucent) -> Vec<Count> {
    vec![
        Count::new(Item::SheetFragment, translucent.fragments + translucent.own_work.items),
        Count::new(Item::SweptRow, translucent.own_work.swept_rows),
        Count::new(Item::SoftSample, translucent.own_work.soft_samples),
        Count::new(Item::SlabSample, translucent.own_work.slab_samples),
        Count::new(Item::MediumSample, translucent.own_work.medium_samples),
        Count::new(Item::PolygonLook, translucent.own_work.polygon_looks),
    ]
}

/// Render settings with slabs across half vectors, which carry the light of all translucent objects: one that scatters light again and again, and one that
/// scatters it once. The second saves a shadow map for each point of a light; it is left out where no light has several, unless the scene states half
/// vectors. Empty where slabs as thin as the finest volume asks for would be too many.
pub(crate) fn alone(scene: &Scene, facts: &SourceFacts) -> Vec<scene::RenderSettings> {
    let sheets = &scene.render.sheets;
    let lattices = || facts.media.iter().filter(|medium| medium.is_lattice);
    let depth = lattices().map(|medium| medium.bounds).reduce(DAabb::union).map_or(0.0, |bounds| bounds.diagonal());
    let coarsest = lattices().map(|medium| medium.spacing).fold(0.0, f64::max);
    if !has_slabs(half::foreseen_width(&scene.render, facts), depth, sheets.kernel_extent * coarsest) {
        return Vec::new();
    }
    let casts_from_points = scene.lights.iter().any(|light| light.shadow && light.count() > 1);
    let saves_maps = casts_from_points || !sheets.may_slice;
    let once = sheets.carrying_light().filter(|sheets| saves_maps && sheets.scattering().is_none());
    let settings = sheets.scattering_again().into_iter().chain(once);
    settings.map(|sheets| scene::RenderSettings { sheets, ..scene.render.clone() }).collect()
}

/// The same of an object that is not converted yet: the splats of a medium stand for its voxels.
pub(crate) fn foresees(asked: &Asked<'_>, camera: &Camera) -> OwnWork {
    if half::carries(asked.settings).is_some() {
        return half::foresees(asked, camera);
    }
    let Some(medium) = asked.medium().filter(|medium| medium.is_lattice) else { return OwnWork::default() };
    let shining = asked.scene.lights.iter().filter(|light| light.light.intensity != [0.0; 3]);
    let mut lamps = Lamps::default();
    shining.for_each(|light| lamps.add(light.count() as f64, light.shadow));
    let samples = camera.pixels() as f64 * medium.shown_length / medium.spacing;
    let wide = medium.spacing * Extent::new(&medium.bounds, camera).samples_per_unit;
    let voxels = (medium.bounds.max - medium.bounds.min).element_product() / medium.spacing.powi(3);
    // A volume of which little shows is splatted, which takes about as long as it would gathered.
    let slab_samples = samples * (GAUSSIAN_SAMPLE + lamps.of_a_sample(wide)) + FILTERED_VOXEL * voxels;
    OwnWork { slab_samples, ..OwnWork::default() }
}

/// Lights that shine, and those of them that have a shadow map.
#[derive(Debug, Clone, Copy, Default)]
struct Lamps {
    bare: f64,
    shadowed: f64,
}

impl Lamps {
    fn add(&mut self, count: f64, has_shadow: bool) {
        if has_shadow {
            self.shadowed += count;
        } else {
            self.bare += count;
        }
    }

    /// Time that they take for one sample: lighting it, and its share of the look-ups at voxels. A voxel is `wide` samples wide.
    fn of_a_sample(&self, wide: f64) -> f64 {
        // A look-up serves all samples about a voxel, and the voxels beside those that show are looked up too: twice as many.
        let voxels = CORNERS.min(2.0 / (wide * wide));
        self.bare * LIT_SAMPLE + self.shadowed * (SHADOWED_SAMPLE + voxels * SHADOWED_VOXEL)
    }
}

/// Bytes of slabs of media that are not converted yet: as those of [`bytes`], where lights' images are as large as a diagonal is long.
pub(crate) fn foresees_bytes(scene: &Scene, settings: &scene::RenderSettings, media: &[MediumFacts]) -> u64 {
    let scene::Slicing::HalfVector { light_pixels, most_light_pixels, .. } = settings.sheets.slicing else { return 0 };
    let camera = scene.camera.with_samples(settings.antialias);
    let lattices = || media.iter().filter(|medium| medium.is_lattice);
    let count = lattices().count() as u64;
    let voxels: f64 = lattices().map(|medium| medium.splats).sum();
    let sides = lattices().map(|medium| light_pixels * medium.bounds.diagonal() / medium.spacing);
    let side = sides.fold(16.0, f64::max).min(f64::from(most_light_pixels));
    let of_a_sample = BYTES_OF_A_SAMPLE + BYTES_OF_A_SHEET * count;
    let eyes = 2 * of_a_sample * camera.pixels();
    let light = (of_a_sample as f64 * side * side) as u64;
    let cells = CELL_BYTES * (voxels as u64 / VOXELS_OF_A_CELL).max(LEAST_CELLS);
    let has_surfaces = scene.objects.iter().any(|object| object.visible && !object.source.is_medium());
    let params = HalfParams { most_light_pixels, ..HalfParams::default() };
    let polygons = if has_surfaces { polygon_bytes(&camera, 1, &params) } else { 0 };
    eyes + light + cells + polygons + (BYTES_OF_A_VOXEL * voxels) as u64
}

/// Samples that slabs show, and fragments of voxels; half-vector slicing sweeps voxels once for each light, for the eye and for the light.
fn own_work(frame: &Frame<'_>) -> OwnWork {
    if half::is_asked(frame.scene) { swept_work(frame) } else { work_across_the_view(frame) }
}

/// Of slabs across the view.
fn work_across_the_view(frame: &Frame<'_>) -> OwnWork {
    let settings = &frame.settings.sheets;
    let form = reconstruction::chosen(frame.scene, &frame.loaded.own, &frame.camera);
    let mut lamps = Lamps::default();
    for (rank, point) in frame.light_points().iter().enumerate() {
        if point.light.intensity != [0.0; 3] {
            lamps.add(1.0, !frame.casting(rank).is_empty());
        }
    }
    let volume_work = |native: &Own| {
        let Body::Cells { grid, transfer, .. } = &native.body else { return OwnWork::default() };
        let material = &frame.scene.materials[native.material].material;
        let dims = DVec3::from_array(grid.dims.map(|count| count as f64));
        let corner = grid.origin - grid.axes * DVec3::splat(0.5);
        let hull = SlantedBox::of(corner, grid.axes * DMat3::from_diagonal(dims), &native.transform);
        let per_world = native.extinction_scale / native.transform.scale;
        let extinction = |place: DVec3| {
            let [i, j, k] = (place * dims - 0.5).round().to_array().map(|index| index as isize);
            f64::from(transfer.at(grid.at_clamped(i, j, k)).extinction) * per_world
        };
        let length = shown_length(&hull, &frame.camera, settings.transmittance_cutoff, extinction);
        let step = grid.shortest_step() * native.transform.scale;
        let samples = frame.camera.pixels() as f64 * length / step;
        let wide = step * Extent::new(&native.world_box(), &frame.camera).samples_per_unit;
        let lit = if material.shading == Shading::Unlit { 0.0 } else { lamps.of_a_sample(wide) };
        let voxels = grid.values.len() as f64;
        match form.reconstruction {
            Reconstruction::Splat => {
                // Each voxel covers so many samples, at least one.
                let kernels = (std::f64::consts::PI * settings.kernel_extent.powi(2)).max(1.0 / (wide * wide));
                let slab_samples = samples * (1.0 + lit) + SOUGHT_VOXEL * voxels;
                OwnWork { items: samples * kernels, slab_samples, ..OwnWork::default() }
            }
            Reconstruction::Gather(kernel) => {
                let (read, prepared) = match kernel {
                    GatherKernel::Gaussian => (GAUSSIAN_SAMPLE, FILTERED_VOXEL),
                    GatherKernel::Linear => (1.0, SOUGHT_VOXEL),
                };
                OwnWork { slab_samples: samples * (read + lit) + prepared * voxels, ..OwnWork::default() }
            }
        }
    };
    let natives = frame.loaded.own.iter().filter(|native| native.technique == Technique::Sheets);
    let mut sum = OwnWork::default();
    for work in natives.map(volume_work) {
        sum.items += work.items;
        sum.slab_samples += work.slab_samples;
    }
    sum
}

/// Of slabs across half vectors.
fn swept_work(frame: &Frame<'_>) -> OwnWork {
    let shining = frame.light_points().iter().filter(|point| point.light.intensity != [0.0; 3]);
    let sweeps = (shining.filter(|point| half::is_swept(frame.scene, point)).count() as f64).max(1.0);
    let extent = frame.settings.sheets.kernel_extent;
    let form = reconstruction::chosen(frame.scene, &frame.loaded.own, &frame.camera);
    let volumes = || frame.loaded.own.iter().filter(|native| native.technique == Technique::Sheets);
    let step_of = |native: &Own| native.grid().map(|grid| grid.shortest_step() * native.transform.scale);
    let least_step = volumes().filter_map(step_of).fold(f64::INFINITY, f64::min);
    let volume_work = |native: &Own| {
        let Body::Cells { grid, transfer, .. } = &native.body else { return OwnWork::default() };
        let seen = Extent::new(&native.world_box(), &frame.camera);
        let step = grid.shortest_step() * native.transform.scale;
        if form.reconstruction == Reconstruction::Splat {
            // A kernel reaches into so many slabs, which are as wide as the least step, and has rows in the images of the eye and of the light.
            let sections = 2.0 * extent * step / least_step + 1.0;
            let rows_of_eye = seen.share * rows(extent * step * seen.samples_per_unit);
            let rows_of_light = rows(extent * half::light_pixels(frame.scene) * step / least_step);
            let swept_rows = sweeps * shaping_voxels(grid, transfer) * sections * (rows_of_eye + rows_of_light);
            return OwnWork { swept_rows, ..OwnWork::default() };
        }
        // Samples of a voxel in the images of the eye and of the light.
        let unit = libm::exp2(f64::from(-frame.loaded.exponent));
        let slabs_of_voxel = step / frame.settings.sheets.slab_width.map_or(least_step, |width| width * unit);
        let eye = seen.share * (step * seen.samples_per_unit).powi(2);
        let light = (half::light_pixels(frame.scene) * step / least_step).powi(2);
        let medium_samples = sweeps * gathered_voxels(grid, transfer) * slabs_of_voxel * (eye + light);
        OwnWork { medium_samples, ..OwnWork::default() }
    };
    let mut sum = OwnWork::default();
    for work in volumes().map(volume_work) {
        sum.swept_rows += work.swept_rows;
        sum.medium_samples += work.medium_samples;
    }
    let bounds = volumes().map(Own::world_box).reduce(DAabb::union);
    let slabs = bounds.map_or(0.0, |bounds| bounds.diagonal() / least_step);
    let polygon_looks = half::polygon_looks(frame, sum.medium_samples);
    OwnWork { soft_samples: half::soft_samples(frame, slabs), polygon_looks, ..sum }
}

/// Voxels with extinction near them, about, from a look at some: they shape what is seen, and are splatted too.
fn shaping_voxels(grid: &Grid, transfer: &TransferFunction) -> f64 {
    const LOOKS: usize = 1 << 11;
    // A voxel and one with extinction have a share in one place where their kernels, each of two spacings, meet.
    const OFFSETS: [isize; 5] = [-3, -1, 0, 1, 3];
    const FARTHEST: isize = 11;
    let number = grid.values.len();
    let stride = number.div_ceil(LOOKS).max(1);
    let [columns, rows, _] = grid.dims;
    let shapes = |at: usize| {
        let i = (at % columns) as isize;
        let j = (at / columns % rows) as isize;
        let k = (at / columns / rows) as isize;
        let has_extinction = |a: isize, b: isize, c: isize| {
            a * a + b * b + c * c <= FARTHEST && transfer.at(grid.at_clamped(i + a, j + b, k + c)).extinction > 0.0
        };
        OFFSETS.iter().any(|c| OFFSETS.iter().any(|b| OFFSETS.iter().any(|a| has_extinction(*a, *b, *c))))
    };
    // An odd stride meets every column of a lattice whose rows are a power of two long.
    (0..number).step_by(stride | 1).filter(|at| shapes(*at)).count() as f64 * (stride | 1) as f64
}

/// Voxels in bricks that hold some extinction, about, from a look at some: all of these are read where slabs are gathered.
fn gathered_voxels(grid: &Grid, transfer: &TransferFunction) -> f64 {
    const LOOKS: usize = 1 << 11;
    const BRICK: usize = 8;
    // Kernels reach into a brick from beside it.
    const PLACES: [isize; 4] = [-1, 2, 5, 8];
    let number = grid.values.len();
    let stride = number.div_ceil(LOOKS).max(1) | 1;
    let [columns, rows, _] = grid.dims;
    let is_read = |at: usize| {
        let corner = [at % columns, at / columns % rows, at / columns / rows].map(|place| place / BRICK * BRICK);
        let [i, j, k] = corner.map(|place| place as isize);
        let has_extinction =
            |a: isize, b: isize, c: isize| transfer.at(grid.at_clamped(i + a, j + b, k + c)).extinction > 0.0;
        PLACES.iter().any(|c| PLACES.iter().any(|b| PLACES.iter().any(|a| has_extinction(*a, *b, *c))))
    };
    (0..number).step_by(stride).filter(|at| is_read(*at)).count() as f64 * stride as f64
}

/// Rows of a footprint of this radius, samples, each once for 16 of its samples.
fn rows(radius: f64) -> f64 {
    const SAMPLES_OF_A_ROW: f64 = 16.0;
    let width = (2.0 * radius).max(1.0);
    width * (width / SAMPLES_OF_A_ROW).ceil()
}

/// Adds to a plan how slabs get the values of its volumes, and why.
pub(crate) fn plans(scene: &Scene, loaded: &Loaded, plan: &mut Plan) {
    let is_volume = |native: &Own| native.technique == Technique::Sheets && native.grid().is_some();
    if !loaded.own.iter().any(is_volume) {
        return;
    }
    let camera = loaded.camera.with_samples(scene.render.antialias);
    let form = reconstruction::chosen(scene, &loaded.own, &camera);
    let name = match form.reconstruction {
        Reconstruction::Splat => "splatted slabs",
        Reconstruction::Gather(GatherKernel::Gaussian) => "gathered slabs",
        Reconstruction::Gather(GatherKernel::Linear) => "linearly gathered slabs",
    };
    plan.effects.push(Effect::of_technique(
        name.into(),
        "how slabs get the values of volumes",
        true,
        form.reason.into(),
    ));
}

/// Where normals of volumes come from, when their values become colours, the precision of the sums of slabs, what slabs lie across, and how often they scatter light: every planned picture of this technique has these.
pub(crate) fn settings(scene: &Scene, loaded: &Loaded, _: &Plan) -> Vec<PlannedSetting> {
    let sheets = &scene.render.sheets;
    let precision = points::precision(sheets.accumulation);
    let is_stated = scene.render.stated.accumulation_of_sheets;
    let normals = normals(scene, loaded);
    let accumulation = PlannedSetting::new("render.sheets.accumulation", precision, is_stated, points::IN_F32);
    let slicing = |value: &str, reason: &str| {
        PlannedSetting::new("render.sheets.slicing", format!("\"{value}\""), !sheets.may_slice, reason)
    };
    let scattering = |value: &str, reason: &str| {
        PlannedSetting::new("render.sheets.scattering", format!("\"{value}\""), !sheets.may_scatter, reason)
    };
    let scene::Slicing::HalfVector { scattering: again, .. } = sheets.slicing else {
        let reason =
            "slabs lie across the view unless a scene, or a technique that is `auto`, asks for light that they carry";
        let classified = classified(scene, loaded);
        return normals.into_iter().chain(classified).chain([accumulation, slicing("view", reason)]).collect();
    };
    let often = match again {
        None if scene.render.choice.is_some() => scattering(
            "once",
            "of the ways that `auto` weighs, this one is the fastest within the tolerance, or errs least",
        ),
        None => scattering("once", "a technique that is named scatters light once unless the scene states more"),
        Some(scene::Scattering { back: false, .. }) => {
            scattering("forward", "light that is scattered back is left out")
        }
        Some(_) => scattering("forward_and_back", "by its estimate, light that media scatter again is seen"),
    };
    let slicing = slicing("half_vector", "slabs across half vectors carry light through media themselves");
    normals.into_iter().chain([accumulation, slicing, often]).collect()
}

/// When the values of volumes become colours.
fn classification(scene: &Scene) -> Classify {
    let sheets = &scene.render.sheets;
    match sheets.classify {
        scene::Classify::After => Classify::After,
        scene::Classify::Preintegrated => Classify::Preintegrated,
        scene::Classify::Before => Classify::Before,
        scene::Classify::Auto => Classify::After,
    }
}

/// When values become colours in slabs across the view, where a volume lies in these.
fn classified(scene: &Scene, loaded: &Loaded) -> Option<PlannedSetting> {
    let is_volume = |native: &Own| native.technique == Technique::Sheets && native.grid().is_some();
    if !loaded.own.iter().any(is_volume) {
        return None;
    }
    let (name, reason) = match classification(scene) {
        Classify::After => ("after", "the value in the middle of a slab has the class of the slab"),
        Classify::Preintegrated => {
            ("preintegrated", "all values that a ray meets in a slab are classified, so that nothing thinner is missed")
        }
        Classify::Before => ("before", "colours and extinctions of voxels are splatted"),
    };
    let is_stated = scene.render.sheets.classify != scene::Classify::Auto;
    Some(PlannedSetting::new("render.sheets.classify", format!("\"{name}\""), is_stated, reason))
}

/// Where normals come from, where a volume reflects about its gradient.
fn normals(scene: &Scene, loaded: &Loaded) -> Option<PlannedSetting> {
    let reflects = |native: &Own| matches!(native.body, Body::Cells { normals: true, .. });
    if !loaded.own.iter().any(|native| native.technique == Technique::Sheets && reflects(native)) {
        return None;
    }
    let camera = loaded.camera.with_samples(scene.render.antialias);
    let form = reconstruction::chosen(scene, &loaded.own, &camera);
    let (name, reason) = match gradients(scene, form.reconstruction) {
        Gradients::Sheets => ("sheets", "splatted slabs have no field with a derivative"),
        Gradients::Volume => ("volume", "differences at voxels are those of the data"),
        Gradients::Kernel => {
            ("kernel", "the field that gathered slabs read has a derivative, which slabs do not change")
        }
    };
    let is_stated = scene.render.sheets.gradients != SheetGradients::Auto;
    Some(PlannedSetting::new("render.sheets.gradients", format!("\"{name}\""), is_stated, reason))
}

/// Where normals come from, where slabs get their values so.
fn gradients(scene: &Scene, reconstruction: Reconstruction) -> Gradients {
    match scene.render.sheets.gradients {
        SheetGradients::Volume => Gradients::Volume,
        SheetGradients::Kernel => Gradients::Kernel,
        SheetGradients::Sheets => Gradients::Sheets,
        SheetGradients::Auto if reconstruction == Reconstruction::Splat => Gradients::Sheets,
        SheetGradients::Auto => Gradients::Kernel,
    }
}

pub(crate) use half::carries;

/// Bytes of sheets of all slabs at once, of lists of voxels, and of polygons; slabs across the view count theirs when they make them.
pub(crate) fn bytes(matter: &Matter<'_>, points: &[LightPoint], _: bool, options: &RenderOptions) -> u64 {
    let panes: Vec<_> = matter.own.iter().filter(|native| native.form == Form::Panes).filter_map(Own::placed).collect();
    let others = match half::is_asked(matter.scene) {
        true => half::bytes(matter, &panes, points, options),
        false if matter.own.iter().any(|native| native.form.is_polygons()) => {
            // One z-buffer lives at a time.
            let z_buffers = points.iter().any(|point| point.light.intensity != [0.0; 3]);
            polygon_bytes(matter.camera, u32::from(z_buffers), &HalfParams::default())
        }
        false => 0,
    };
    others + pane_bytes(&panes, matter.camera, &memory::layout(matter.scene))
}

/// Begins a frame.
pub(crate) fn begin<'a>(frame: &'a Frame<'a>) -> Box<dyn Fold + 'a> {
    Box::new(Sheets { frame, sheeted: None })
}

/// What is drawn in slabs.
struct Sheets<'a> {
    frame: &'a Frame<'a>,
    /// Once they were made.
    sheeted: Option<Sheeted<'a>>,
}

impl Fold for Sheets<'_> {
    fn own_work(&self, _: &[Range<f32>]) -> OwnWork {
        own_work(self.frame)
    }

    fn fold(
        &mut self,
        range: Range<f32>,
        into: &mut Accumulator,
        session: &mut Session<'_>,
        cost: &mut CostRecord,
    ) -> Result<(), Error> {
        let frame = self.frame;
        if half::is_asked(frame.scene) {
            return half::draw(frame, into, session, cost);
        }
        let opaque = frame.opaque(cost)?;
        if self.sheeted.is_none() {
            let sheeted = sheeted(frame, session.options, cost)?;
            let volumes: Vec<Volume<'_>> = volumes(&frame.matter()).collect();
            warn(frame, &volumes, session.warnings);
            self.sheeted = Some(sheeted);
        }
        let sheeted = self.sheeted.as_ref().expect("invariant: sheets were made above");
        frame.progress.begin(stage::SHEETS);
        frame.tick()?;
        cost.measure(pass::SHEETS, |stage| {
            let counts = sheeted.fold(range, &opaque.depth, &frame.layout(), into, Some(frame.progress));
            let counts = counts.map_err(|e| refuse(frame, e))?;
            stage.items_out = counts.shaded;
            stage.fragments = counts.fragments + counts.splat_fragments;
            stage.passes = counts.slabs;
            stage.bytes = counts.bytes;
            Ok(())
        })
    }
}

/// The opaque polygons of a frame, seen in the light that comes through shadow maps; without any pixel where there are none.
pub(crate) fn opaque_polygons(frame: &Frame<'_>, cost: &mut CostRecord) -> Result<OpaqueImage, Error> {
    frame.solid_polygons(cost)
}

/// The volumes and splats of a frame that are the technique's own.
fn sheeted<'a>(frame: &'a Frame<'a>, options: &RenderOptions, cost: &mut CostRecord) -> Result<Sheeted<'a>, Error> {
    let maps = frame.maps(cost)?;
    let splats = splats(frame, cost)?;
    let opaque = frame.opaque(cost)?;
    frame.progress.begin(stage::SHEETS);
    let volumes = volumes(&frame.matter()).collect();
    let input = SheetInput { splats, ..frame.sheet_input(volumes, frame.lit_by(maps)) };
    let form = reconstruction::chosen(frame.scene, &frame.loaded.own, &frame.camera);
    let params = params(frame.scene, form.reconstruction, frame.loaded.exponent, options);
    cost.measure(pass::SHEETS, |stage| {
        stage.items_in = input.volumes.iter().map(|v| v.grid.values.len() as u64).sum();
        let sheeted = prepare(input, &params, Some(frame.progress)).map_err(|e| refuse(frame, e))?;
        let polygons = frame.polygons();
        let layout = frame.layout();
        let sheeted = sheeted.with_polygons(&polygons, &opaque.depth, &layout, Some(frame.progress));
        let sheeted = sheeted.map_err(|e| refuse(frame, e))?;
        stage.bytes = sheeted.bytes();
        Ok(sheeted)
    })
}

/// Names volumes that nothing is seen of.
fn warn(frame: &Frame<'_>, volumes: &[Volume<'_>], warnings: &mut Vec<String>) {
    for volume in volumes.iter().filter(|volume| !volume.is_seen()) {
        let name = crate::shown(&frame.loaded.objects[volume.object as usize].name);
        warnings.push(format!("object '{name}' shows nothing: its transfer function gives no value extinction"));
    }
}

impl<'a> Frame<'a> {
    /// Width of the slabs in which the technique `sheets` draws its planned objects, world units of the scene; `None` for
    /// nothing. In half-vector slicing that of the first sweep.
    ///
    /// # Errors
    /// Those of [`Frame::maps`]; [`Error::Limit`] where there would be too many slabs, or too much memory.
    pub fn slab_width(&'a self, options: &RenderOptions, cost: &mut CostRecord) -> Result<Option<f64>, Error> {
        let none = volumes(&self.matter()).next().is_none() && self.translucent(Technique::Sheets).is_empty();
        let unit = libm::exp2(f64::from(self.loaded.exponent));
        Ok(match none {
            true => None,
            false if half::is_asked(self.scene) => {
                let form = reconstruction::chosen(self.scene, &self.loaded.own, &self.camera);
                let params = params(self.scene, form.reconstruction, self.loaded.exponent, options);
                Some(half::width(self, &params)? * unit)
            }
            false => Some(sheeted(self, options, cost)?.slabs().1 * unit),
        })
    }
}

/// Parameters of sheets that get their values so, for lengths that are a 2^`exponent`th of the scene's.
fn params(scene: &Scene, reconstruction: Reconstruction, exponent: i32, options: &RenderOptions) -> Params {
    let settings = &scene.render.sheets;
    let unit = libm::exp2(f64::from(-exponent));
    Params {
        slab_width: settings.slab_width.map(|width| width * unit),
        classify: classification(scene),
        aligned: if settings.aligned == scene::Aligned::Axis { Aligned::Axis } else { Aligned::View },
        reconstruction,
        kernel: KernelShape { extent: settings.kernel_extent, sigma: settings.kernel_sigma },
        sections: settings.kernel_sections,
        accumulation: settings.accumulation,
        gradients: gradients(scene, reconstruction),
        lighting: Lighting::Joint,
        transmittance_cutoff: settings.transmittance_cutoff as f32,
        limits: Limits::bytes(options.max_memory),
    }
}

/// The volumes that are the technique's own.
fn volumes<'a>(matter: &Matter<'a>) -> impl Iterator<Item = Volume<'a>> + use<'a> {
    let Matter { scene, own: natives, .. } = *matter;
    natives.iter().filter_map(move |native| {
        let object = &scene.objects[native.object];
        let material = &scene.materials[native.material].material;
        let factor = f64::from(material.greatest_extinction());
        let Body::Cells { grid, transfer, normals, body_centred, .. } = &native.body else { return None };
        let (grid, packing) = match body_centred {
            Some(bcc) => (&bcc.planes, Packing::BodyCentred),
            None => (&**grid, Packing::Cartesian),
        };
        (native.technique == Technique::Sheets && factor > 0.0).then(|| Volume {
            grid,
            packing,
            transform: native.transform,
            transfer,
            // The scale holds the material's factor, and leads to units of the object.
            extinction_scale: native.extinction_scale / (factor * native.transform.scale),
            material,
            normals: *normals,
            clip: &object.clip,
            object: native.object as u32,
            shadow_coefficient: object.shadow_coefficient,
            casts_shadow: object.casts_shadow,
        })
    })
}

/// The splats of a frame that are the technique's own, sorted; `None` without any.
fn splats<'a>(frame: &'a Frame<'a>, cost: &mut CostRecord) -> Result<Option<Splats<'a>>, Error> {
    let cloud = frame.drawn();
    let camera = &frame.camera;
    let translucent = frame.translucent(Technique::Sheets);
    if translucent.is_empty() {
        return Ok(None);
    }
    let Shaded { projected, values, .. } = frame.shaded(cost)?;
    let params = hbsort::Params {
        direction: Direction::FrontToBack,
        exact: true,
        margin_px: frame.filter_reach_px(),
        ..hbsort::Params::default()
    };
    let order = hbsort::slice_cloud(cloud, Some(translucent), camera, &params, &mut hbsort::Scratch::default());
    let order = order.map_err(|e| Error::Internal(e.to_string()))?;
    let place = camera.view_from_offset(cloud.origin);
    Ok(Some(Splats {
        projected,
        depths: cloud.position.iter().map(|p| place.depth(*p)).collect(),
        slab_width: Splats::slab_width(&order),
        order: order.input_from_sorted,
        values,
        materials: &frame.loaded.materials,
    }))
}

/// What went wrong with sheets: a limit, or a volume that they do not take.
fn refuse<'a>(frame: &'a Frame<'a>, error: sheet_light::Error) -> Error {
    match error {
        sheet_light::Error::Cancelled => Error::Cancelled,
        sheet_light::Error::Limit(exceeded) => {
            let hint = "use a larger render.sheets.slab_width, a coarser volume, fewer translucent meshes or a larger --max-memory";
            Error::Limit(exceeded.owned_by("the scene", hint))
        }
        sheet_light::Error::Volume { volume, source } => {
            let volume = volumes(&frame.matter()).nth(volume);
            let name = volume.map(|v| crate::shown(&frame.loaded.objects[v.object as usize].name)).unwrap_or_default();
            Error::input(format!("object '{name}'"), source.to_string(), "give it to another technique")
        }
        sheet_light::Error::Parameter { name: "aligned", expected, .. } => {
            let hint = "use render.sheets.aligned = \"view\", or another technique for all but one volume";
            Error::input("render.sheets.aligned = \"axis\"", format!("expected {expected}"), hint)
        }
        other => Error::Internal(other.to_string()),
    }
}
