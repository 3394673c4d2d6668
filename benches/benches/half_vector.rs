//! Half-vector sheets of a procedural cloud at 400², the sun before and behind it: without light, with shadows, scattered ahead,
//! back and forth, and under a disk in one sweep; beside image-aligned sheets without light.
//!
//! A plain table of minima, as that of `sheets`: by the clock and in processor time of all threads.
#![allow(missing_docs, clippy::expect_used, reason = "a benchmark")]

use convert::{CloudShape, SplatParams, procedural_cloud};
use organza_benches::processor_ms;
use sheet_light::half::{Extended, HalfInput, HalfParams, Scattering, fold};
use sheet_light::{Params, SheetInput, Volume, prepare};
use splat_core::glam::DVec3;
use splat_core::shade::{ChannelLayout, LitBy};
use splat_core::{
    Accumulator, Camera, Grid, LayerSet, Light, LightShape, Material, Packing, Projection, Shading, Similarity,
    TransferFunction, TransferPoint,
};
use std::time::Instant;

/// Runs each part this often.
const REPEATS: usize = 5;

const SIZE: [u32; 2] = [400, 400];

fn main() {
    let shape = CloudShape::default();
    println!("{:>24} {:>8} {:>10} {:>10} {:>10} {:>10}", "ms", "clock", "processor", "M visible", "M eye", "M light");
    for spacing in [4.0 / 128.0, 4.0 / 192.0] {
        let grid = procedural_cloud(&shape, spacing, &SplatParams::default(), None).expect("a cloud");
        println!("{:?} = {:.2} M voxels", grid.dims, grid.values.len() as f64 * 1e-6);
        across_the_view(&grid);
        half_vectors("without light", &grid, None, Scattering::None);
        for (from, direction) in [("before", [0.3, -0.5, -1.0]), ("behind", [0.3, -0.5, 1.0])] {
            for (how, scattering) in
                [("shadow", Scattering::None), ("ahead", Scattering::Forward), ("back", Scattering::ForwardAndBack)]
            {
                half_vectors(&format!("{how}, sun {from}"), &grid, Some(direction), scattering);
            }
            soft(&format!("soft, disk {from}"), &grid, direction);
        }
    }
}

/// The cloud as extinction, and its view.
struct Setting {
    transfer: TransferFunction,
    material: Material,
    camera: Camera,
}

impl Setting {
    fn new(shading: Shading) -> Self {
        let point = |value: f32| TransferPoint { value, color: [1.0; 3], extinction: value };
        let view = Projection::Perspective { fov_y: 0.5 };
        Self {
            transfer: TransferFunction::new(vec![point(0.0), point(12.0)]).expect("values rise"),
            material: Material { shading, single_scattering_albedo: 0.99, asymmetry: 0.7, ..Material::default() },
            camera: Camera::look_at(DVec3::new(0.0, 0.6, 8.0), DVec3::Y * 0.5, DVec3::Y, view, SIZE).expect("a camera"),
        }
    }

    fn input<'a>(&'a self, grid: &'a Grid, lights: Vec<LitBy<'a>>) -> SheetInput<'a> {
        let volume = Volume {
            grid,
            packing: Packing::Cartesian,
            transform: Similarity::default(),
            transfer: &self.transfer,
            extinction_scale: 1.0,
            material: &self.material,
            normals: false,
            object: 0,
            clip: &[],
            shadow_coefficient: 1.0,
            casts_shadow: true,
        };
        let (volumes, camera) = (vec![volume], &self.camera);
        SheetInput { volumes, splats: None, camera, lights, shadow_origin: DVec3::ZERO, ambient: [0.0; 3] }
    }
}

/// Least milliseconds, by the clock and of processors, and what was made.
fn least<T>(mut run: impl FnMut() -> T) -> ([f64; 2], T) {
    let mut best = [f64::INFINITY; 2];
    let mut last = None;
    for _ in 0..REPEATS {
        let (start, busy) = (Instant::now(), processor_ms());
        last = Some(run());
        best = [best[0].min(start.elapsed().as_secs_f64() * 1e3), best[1].min(processor_ms() - busy)];
    }
    (best, last.expect("it ran"))
}

fn across_the_view(grid: &Grid) {
    let setting = Setting::new(Shading::Unlit);
    let layout = ChannelLayout::new(&LayerSet::default());
    let (best, counts) = least(|| {
        let mut out = Accumulator::new(SIZE, 1, 3, false, false);
        let sheeted = prepare(setting.input(grid, Vec::new()), &Params::default(), None).expect("it can be drawn");
        sheeted.fold(f32::NEG_INFINITY..f32::INFINITY, &[], &layout, &mut out, None).expect("nobody cancels")
    });
    row("across the view", best, [counts.visible, counts.fragments, 0]);
}

fn half_vectors(name: &str, grid: &Grid, direction: Option<[f64; 3]>, scattering: Scattering) {
    let setting = Setting::new(if direction.is_some() { Shading::Phase } else { Shading::Unlit });
    let sun = |d: [f64; 3]| {
        let shape = LightShape::Directional { direction: DVec3::from_array(d).normalize() };
        LitBy { slide: None, light: Light { shape, intensity: [3.0; 3] }, shadow: None }
    };
    let sheets = setting.input(grid, direction.map(sun).into_iter().collect());
    sweep(
        name,
        &HalfInput { sheets, splats: None, polygons: &[], extended: Vec::new(), mapped: Vec::new(), opaque: &[] },
        scattering,
    );
}

/// Sixteen points of a disk as wide as the cloud is high, in one sweep.
fn soft(name: &str, grid: &Grid, direction: [f64; 3]) {
    let setting = Setting::new(Shading::Phase);
    let normal = DVec3::from_array(direction).normalize();
    let shape = LightShape::Disk { center: DVec3::Y * 0.5 - normal * 10.0, normal, radius: 0.6 };
    let lit = LitBy { slide: None, light: Light { shape, intensity: [300.0; 3] }, shadow: None };
    let extended = vec![Extended { lit, samples: 16 }];
    let sheets = setting.input(grid, Vec::new());
    sweep(
        name,
        &HalfInput { sheets, splats: None, polygons: &[], extended, mapped: Vec::new(), opaque: &[] },
        Scattering::None,
    );
}

fn sweep(name: &str, input: &HalfInput<'_>, scattering: Scattering) {
    let params = HalfParams { scattering, ..HalfParams::default() };
    let layout = ChannelLayout::new(&LayerSet::default());
    let (best, counts) = least(|| {
        let mut out = Accumulator::new(SIZE, 1, 3, false, false);
        fold(input, &params, &layout, &mut out, None).expect("half vectors serve it").counts
    });
    row(name, best, [counts.visible, counts.eye_fragments, counts.light_fragments]);
}

fn row(name: &str, [clock, processor]: [f64; 2], counts: [u64; 3]) {
    let [visible, eye, light] = counts.map(|n| n as f64 * 1e-6);
    println!("{name:>24} {clock:8.0} {processor:10.0} {visible:10.2} {eye:10.1} {light:10.1}");
}
