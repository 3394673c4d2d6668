//! Half-vector sheets of a procedural cloud at 400², the sun before and behind it: without light, with shadows, scattered ahead,
//! back and forth, and under a disk in one sweep; beside image-aligned sheets without light. Each by splatted sheets and by
//! gathered ones, with the Gaussian kernel and with the linear one.
//!
//! A plain table of minima, as that of `sheets`: by the clock and in processor time of all threads. `-- head` draws the translucent head
//! of `sheets` instead, `-- dense` or `-- FILE` other volumes as the head, which `benches/peers/vtk_scattering.py` draws too.
#![allow(missing_docs, clippy::expect_used, reason = "a benchmark")]

use convert::{CloudShape, SplatParams, procedural_cloud};
use organza_benches::{HeadLike, processor_ms, record};
use sheet_light::half::{Extended, HalfInput, HalfParams, Scattering, fold};
use sheet_light::{GatherKernel, Params, Reconstruction, SheetInput, Volume, prepare};
use splat_core::glam::DVec3;
use splat_core::shade::{ChannelLayout, LitBy};
use splat_core::{
    Accumulator, Camera, Grid, LayerSet, Light, LightShape, Material, Packing, Projection, Shading, Similarity,
    TransferFunction, TransferPoint,
};
use std::path::Path;
use std::time::Instant;

/// Runs each part this often.
const REPEATS: usize = 5;

const SIZE: [u32; 2] = [400, 400];

/// How sheets get their values, and what stands before the names of rows.
const RECONSTRUCTIONS: [(&str, Reconstruction); 3] = [
    ("", Reconstruction::Splat),
    ("Gaussian: ", Reconstruction::Gather(GatherKernel::Gaussian)),
    ("linear: ", Reconstruction::Gather(GatherKernel::Linear)),
];

fn main() {
    println!("{:>34} {:>8} {:>10} {:>10} {:>10} {:>10}", "ms", "clock", "processor", "M visible", "M eye", "M light");
    match std::env::args().skip(1).find(|a| !a.starts_with('-')) {
        Some(volume) => {
            let like = HeadLike::new(Some(volume.as_str()).filter(|&v| v != "head"));
            let transfer = like.transfer(HeadLike::SEMI);
            let camera = like.camera(SIZE[0], false);
            let name = Path::new(&volume).file_stem().unwrap_or_default().to_string_lossy().into_owned();
            let sun = DVec3::new(0.6, -0.5, -0.6);
            rows(&Setting { name, grid: &like.grid, transfer, camera, suns: [sun, -sun] }, false);
        }
        None => {
            for spacing in [4.0 / 128.0, 4.0 / 192.0] {
                let shape = CloudShape::default();
                let grid = procedural_cloud(&shape, spacing, &SplatParams::default(), None).expect("a cloud");
                rows(&Setting::cloud(&grid), true);
            }
        }
    }
}

/// All rows of a volume; with `disk` also those under a disk, whose place and size are those of the cloud.
fn rows(setting: &Setting<'_>, disk: bool) {
    println!("{:?} = {:.2} M voxels", setting.grid.dims, setting.grid.values.len() as f64 * 1e-6);
    for (form, reconstruction) in RECONSTRUCTIONS {
        let sheets = Params { reconstruction, ..Params::default() };
        across_the_view(&format!("{form}across the view"), setting, &sheets);
        half_vectors(&format!("{form}without light"), setting, &sheets, None, Scattering::None);
        for (from, direction) in [("before", setting.suns[0]), ("behind", setting.suns[1])] {
            for (how, scattering) in
                [("shadow", Scattering::None), ("ahead", Scattering::Forward), ("back", Scattering::ForwardAndBack)]
            {
                half_vectors(&format!("{form}{how}, sun {from}"), setting, &sheets, Some(direction), scattering);
            }
            if disk {
                soft(&format!("{form}soft, disk {from}"), setting, &sheets, direction);
            }
        }
    }
}

/// A volume, how it is seen, and the ways of light that comes from before and from behind it.
struct Setting<'a> {
    name: String,
    grid: &'a Grid,
    transfer: TransferFunction,
    camera: Camera,
    suns: [DVec3; 2],
}

fn material(shading: Shading) -> Material {
    Material { shading, single_scattering_albedo: 0.99, asymmetry: 0.7, ..Material::default() }
}

impl<'a> Setting<'a> {
    /// A cloud, whose values are extinctions.
    fn cloud(grid: &'a Grid) -> Self {
        let point = |value: f32| TransferPoint { value, color: [1.0; 3], extinction: value };
        let view = Projection::Perspective { fov_y: 0.5 };
        Self {
            name: format!("cloud of {:.1} M", grid.values.len() as f64 * 1e-6),
            grid,
            transfer: TransferFunction::new(vec![point(0.0), point(12.0)]).expect("values rise"),
            camera: Camera::look_at(DVec3::new(0.0, 0.6, 8.0), DVec3::Y * 0.5, DVec3::Y, view, SIZE).expect("a camera"),
            suns: [DVec3::new(0.3, -0.5, -1.0), DVec3::new(0.3, -0.5, 1.0)],
        }
    }

    fn input<'b>(&'b self, material: &'b Material, lights: Vec<LitBy<'b>>) -> SheetInput<'b> {
        let volume = Volume {
            grid: self.grid,
            packing: Packing::Cartesian,
            transform: Similarity::default(),
            transfer: &self.transfer,
            extinction_scale: 1.0,
            material,
            normals: false,
            object: 0,
            clip: &[],
            shadow_coefficient: 1.0,
            casts_shadow: true,
        };
        let volumes = vec![volume];
        let camera = &self.camera;
        SheetInput { volumes, splats: None, camera, lights, shadow_origin: DVec3::ZERO, ambient: [0.0; 3] }
    }
}

/// What something took, milliseconds by the clock of each run and of processors at least, and what was made.
struct Ran<T> {
    clock: Vec<f64>,
    processor: f64,
    made: T,
}

fn ran<T>(mut run: impl FnMut() -> T) -> Ran<T> {
    let mut clock = Vec::new();
    let mut processor = f64::INFINITY;
    loop {
        let start = Instant::now();
        let busy = processor_ms();
        let made = run();
        clock.push(start.elapsed().as_secs_f64() * 1e3);
        processor = processor.min(processor_ms() - busy);
        if clock.len() == REPEATS {
            return Ran { clock, processor, made };
        }
    }
}

fn across_the_view(name: &str, setting: &Setting<'_>, sheets: &Params) {
    let material = material(Shading::Unlit);
    let layout = ChannelLayout::new(&LayerSet::default());
    let ran = ran(|| {
        let mut out = Accumulator::new(SIZE, 1, 3, false, false);
        let input = setting.input(&material, Vec::new());
        let sheeted = prepare(input, sheets, None).expect("it can be drawn");
        sheeted.fold(f32::NEG_INFINITY..f32::INFINITY, &[], &layout, &mut out, None).expect("nobody cancels")
    });
    row(setting, name, &ran, |c| [c.visible, c.fragments, 0]);
}

fn half_vectors(name: &str, setting: &Setting<'_>, sheets: &Params, direction: Option<DVec3>, scattering: Scattering) {
    let material = material(if direction.is_some() { Shading::Phase } else { Shading::Unlit });
    let sun = |d: DVec3| {
        let shape = LightShape::Directional { direction: d.normalize() };
        LitBy { slide: None, light: Light { shape, intensity: [3.0; 3] }, shadow: None }
    };
    let input = setting.input(&material, direction.map(sun).into_iter().collect());
    sweep(name, setting, input, Vec::new(), &HalfParams { scattering, sheets: *sheets, ..HalfParams::default() });
}

/// Sixteen points of a disk as wide as the cloud is high, in one sweep.
fn soft(name: &str, setting: &Setting<'_>, sheets: &Params, direction: DVec3) {
    let material = material(Shading::Phase);
    let normal = direction.normalize();
    let shape = LightShape::Disk { center: DVec3::Y * 0.5 - normal * 10.0, normal, radius: 0.6 };
    let lit = LitBy { slide: None, light: Light { shape, intensity: [300.0; 3] }, shadow: None };
    let extended = vec![Extended { lit, samples: 16 }];
    let params = HalfParams { scattering: Scattering::None, sheets: *sheets, ..HalfParams::default() };
    sweep(name, setting, setting.input(&material, Vec::new()), extended, &params);
}

fn sweep(name: &str, setting: &Setting<'_>, sheets: SheetInput<'_>, extended: Vec<Extended<'_>>, params: &HalfParams) {
    let input = HalfInput { sheets, splats: None, polygons: &[], extended, mapped: Vec::new(), opaque: &[] };
    let layout = ChannelLayout::new(&LayerSet::default());
    let ran = ran(|| {
        let mut out = Accumulator::new(SIZE, 1, 3, false, false);
        fold(&input, params, &layout, &mut out, None).expect("half vectors serve it").counts
    });
    row(setting, name, &ran, |c| [c.visible, c.eye_fragments, c.light_fragments]);
}

fn row<T>(setting: &Setting<'_>, name: &str, ran: &Ran<T>, counts: impl Fn(&T) -> [u64; 3]) {
    let counts = counts(&ran.made);
    record(&format!("half_vector/{}, {name}", setting.name), &ran.clock, counts[0]);
    let [visible, eye, light] = counts.map(|n| n as f64 * 1e-6);
    let least = ran.clock.iter().copied().fold(f64::INFINITY, f64::min);
    println!("{name:>34} {least:8.0} {:10.0} {visible:10.2} {eye:10.1} {light:10.1}", ran.processor);
}
