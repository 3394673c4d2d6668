//! Image-aligned sheets of the MRI head: prepare and fold at 400² and 512², semi-transparent and opaque, unlit and shaded.
//!
//! A plain table of minima: other work on the machine only ever adds time. The second number of each part is the time of all
//! threads on processors, which other work adds less to. The error is the RMSE of linear colours to slabs an eighth as wide and no
//! pixel ever done, of the file's lattice and by the paper's method whatever the row has. `benches/peers/vtk_volume.py` has the same rows by VTK.
//!
//! `-- WORD` draws the rows whose name has it. `-- FILE` draws that volume in the place of the head, and `-- dense` one of 256³ voxels
//! that are all visible: views, transfer functions and extinctions are the head's, stretched over the range of its values and by its diagonal.
#![allow(missing_docs, clippy::expect_used, reason = "a benchmark")]

use convert::read::{self, Loaded, ReadParams};
use convert::{SplatParams, body_centred};
use organza_benches::{processor_ms, record};
use sheet_light::{Aligned, Classify, Params, SheetCounts, SheetInput, Volume, prepare};
use splat_core::glam::{DMat3, DVec3};
use splat_core::shade::{ChannelLayout, LitBy};
use splat_core::{
    Accumulator, Camera, Grid, LayerSet, Light, LightShape, Material, Packing, Projection, Shading, Similarity,
    TransferFunction, TransferPoint,
};
use std::path::Path;
use std::time::Instant;

/// Runs each part this often.
const REPEATS: usize = 7;

/// What a row splats, and how.
struct Method<'a> {
    name: &'static str,
    grid: &'a Grid,
    packing: Packing,
    classify: Classify,
    aligned: Aligned,
    /// Transmittance below which a pixel is done.
    cutoff: f32,
    /// Width of slabs over the lattice's step along the view.
    width: f64,
}

impl<'a> Method<'a> {
    fn volume(&self, transfer: &'a TransferFunction, material: &'a Material, normals: bool) -> Volume<'a> {
        Volume {
            grid: self.grid,
            packing: self.packing,
            transform: Similarity::default(),
            transfer,
            extinction_scale: 1.0,
            material,
            normals,
            object: 0,
            clip: &[],
            shadow_coefficient: 1.0,
            casts_shadow: true,
        }
    }
}

/// All depths.
const ALL: std::ops::Range<f32> = f32::NEG_INFINITY..f32::INFINITY;

fn read(path: &Path) -> Grid {
    match read::file(path, &ReadParams::default(), None).expect("a volume that can be read") {
        (Loaded::Grid(grid), _) => grid,
        _ => panic!("{} is no volume", path.display()),
    }
}

/// Three waves whose values are 40 to 240: the head's transfer functions show all of them.
fn dense() -> Grid {
    let wave = |n: usize| (n as f64 / 256.0 * std::f64::consts::TAU * 3.0).sin();
    let value = |i: usize| (140.0 + 100.0 / 3.0 * (wave(i % 256) + wave(i / 256 % 256) + wave(i >> 16))).round();
    let values = (0..256 * 256 * 256).map(|i| value(i) as f32).collect();
    Grid { origin: DVec3::ZERO, axes: DMat3::IDENTITY, dims: [256; 3], values }
}

/// What a volume is to the head: the value in the place of 0, that of one step of its 255, and its diagonal over the head's.
struct Likeness {
    lowest: f32,
    step: f32,
    length: f64,
}

impl Likeness {
    fn new(grid: &Grid, bytes: bool) -> Self {
        const HEAD: DVec3 = DVec3::new(197.0, 233.0, 189.0);
        let range = |least: f32, of: fn(f32, f32) -> f32| grid.values.iter().copied().fold(least, of);
        let (lowest, highest) =
            if bytes { (0.0, 255.0) } else { (range(f32::MAX, f32::min), range(f32::MIN, f32::max)) };
        let diagonal = (grid.axes * DVec3::from_array(grid.dims.map(|n| n as f64))).length();
        Self { lowest, step: (highest - lowest) / 255.0, length: diagonal / HEAD.length() }
    }

    /// Extinction in 1/mm of the head at its values of 0 to 255.
    fn transfer(&self, points: &[(f32, f32)]) -> TransferFunction {
        let point = |&(value, extinction): &(f32, f32)| {
            let t = value / 255.0;
            let color = [0.4 + 0.6 * t, 0.9 * t, 0.8 - 0.6 * t];
            let extinction = extinction / self.length as f32;
            TransferPoint { value: self.lowest + self.step * value, color, extinction }
        };
        TransferFunction::new(points.iter().map(point).collect()).expect("values rise")
    }

    fn camera(&self, grid: &Grid, pixels: u32, perspective: bool) -> Camera {
        let middle = grid.origin + grid.axes * DVec3::from_array(grid.dims.map(|n| 0.5 * n as f64));
        let projection = if perspective {
            Projection::Perspective { fov_y: 0.54 }
        } else {
            Projection::Orthographic { height: 240.0 * self.length }
        };
        let eye = middle + self.length * DVec3::new(-260.0, 260.0, 100.0);
        Camera::look_at(eye, middle, DVec3::Z, projection, [pixels; 2]).expect("a camera")
    }
}

fn main() {
    let words: Vec<String> = std::env::args().skip(1).filter(|a| !a.starts_with('-')).collect();
    let (files, words): (Vec<_>, Vec<_>) =
        words.into_iter().partition(|word| Path::new(word).is_file() || word == "dense");
    let only = words.concat();
    let asset = Path::new(env!("CARGO_MANIFEST_DIR")).join("../assets/mni152/mni152_t1.nii.gz");
    let grid = match files.first() {
        Some(file) if file == "dense" => dense(),
        Some(file) => read(Path::new(file)),
        None => read(&asset),
    };
    let like = Likeness::new(&grid, files.first().is_none_or(|file| file == "dense"));
    let semi = like.transfer(&[(30.0, 0.0), (80.0, 0.004), (150.0, 0.01), (200.0, 0.05), (255.0, 0.08)]);
    let iso = like.transfer(&[(90.0, 0.0), (110.0, 2.0)]);
    let start = Instant::now();
    let bcc = body_centred(&grid, &SplatParams::default()).expect("a volume");
    let share = bcc.planes.values.len() as f64 / grid.values.len() as f64;
    println!(
        "{:?} resampled to {:?}, {share:.4} of the points, in {:.0?}",
        grid.dims,
        bcc.planes.dims,
        start.elapsed()
    );
    let paper = Method {
        name: "",
        grid: &grid,
        packing: Packing::Cartesian,
        classify: Classify::After,
        aligned: Aligned::View,
        cutoff: Params::PAPERS_CUTOFF,
        width: 1.0,
    };
    let methods = [
        Method { name: " bcc", grid: &bcc.planes, packing: Packing::BodyCentred, ..paper },
        Method { name: " before", classify: Classify::Before, ..paper },
        Method { name: " axis", aligned: Aligned::Axis, ..paper },
        Method { name: " all pixels", cutoff: 0.0, ..paper },
        Method { name: " 2 wide", width: 2.0, ..paper },
    ];
    println!(
        "{:>28} {:>12} {:>12} {:>7} {:>9} {:>7} {:>11} {:>10} {:>8}",
        "ms", "prepare", "fold", "M vox", "M splats", "M frag", "M frag/s", "M shaded", "RMSE"
    );
    for pixels in [400, 512] {
        for (class, tf) in [("semi", &semi), ("iso", &iso)] {
            for lit in [false, true] {
                for perspective in [false, true] {
                    let lens = if perspective { "pinhole" } else { "parallel" };
                    let light = if lit { "shaded" } else { "unlit" };
                    for method in std::iter::once(&paper).chain(&methods) {
                        let name = format!("{pixels} {class} {light} {lens}{}", method.name);
                        if name.contains(&only) && !(perspective && method.aligned == Aligned::Axis) {
                            row(&name, [method, &paper], tf, lit, &like.camera(&grid, pixels, perspective));
                        }
                    }
                }
            }
        }
    }
}

fn row(name: &str, [method, paper]: [&Method<'_>; 2], transfer: &TransferFunction, lit: bool, camera: &Camera) {
    let shading = if lit { Shading::Phong } else { Shading::Unlit };
    let material = Material { shading, specular: 0.2, ..Material::default() };
    let direction = DVec3::new(0.6, -0.5, -0.6).normalize();
    let sun = Light { shape: LightShape::Directional { direction }, intensity: [3.0; 3] };
    let lights = [LitBy { slide: None, light: sun, shadow: None }];
    let volume = method.volume(transfer, &material, lit);
    let lights = if lit { lights.to_vec() } else { Vec::new() };
    let input = SheetInput {
        volumes: vec![volume],
        splats: None,
        camera,
        lights,
        shadow_origin: DVec3::ZERO,
        ambient: [0.1; 3],
    };
    let params = Params {
        classify: method.classify,
        aligned: method.aligned,
        transmittance_cutoff: method.cutoff,
        ..Params::default()
    };
    let step = || prepare(input.clone(), &params, None).expect("a volume that can be drawn").slabs().1;
    let slab_width = (method.width != 1.0).then(|| method.width * step());
    let params = Params { slab_width, ..params };
    let layout = ChannelLayout::new(&LayerSet::default());
    let mut out = Accumulator::new(camera.size, 1, 3, false, false);
    let (mut best, mut counts) = ([[f64::INFINITY; 2]; 2], SheetCounts::default());
    let mut clock = Vec::new();
    for _ in 0..REPEATS {
        let (start, busy) = (Instant::now(), processor_ms());
        let sheeted = prepare(input.clone(), &params, None).expect("a volume that can be drawn");
        let (middle, middle_busy) = (Instant::now(), processor_ms());
        out = Accumulator::new(camera.size, 1, 3, false, false);
        counts = sheeted.fold(ALL, &[], &layout, &mut out, None).expect("nobody cancels");
        clock.push(start.elapsed().as_secs_f64() * 1e3);
        let times = [(middle - start, middle_busy - busy), (middle.elapsed(), processor_ms() - middle_busy)];
        for (best, (wall, busy)) in best.iter_mut().zip(times) {
            best[0] = best[0].min(wall.as_secs_f64() * 1e3);
            best[1] = best[1].min(busy);
        }
    }
    record(&format!("sheets/{name}"), &clock, counts.visible);
    let fine = fine(SheetInput { volumes: vec![paper.volume(transfer, &material, lit)], ..input }, &layout);
    let million = |n: u64| n as f64 * 1e-6;
    let [prepared, folded] = best.map(|[wall, busy]| format!("{wall:.1} {busy:.0}"));
    println!(
        "{name:>28} {prepared:>12} {folded:>12} {:7.2} {:9.2} {:7.1} {:11.0} {:10.1} {:8.5}",
        million(counts.visible),
        million(counts.records),
        million(counts.fragments),
        million(counts.fragments) / best[1][0] * 1e3,
        million(counts.shaded),
        rmse(&out, &fine),
    );
}

/// Slabs an eighth as wide as the lattice's steps, and no pixel ever done.
fn fine(input: SheetInput<'_>, layout: &ChannelLayout) -> Accumulator {
    let exact = Params { transmittance_cutoff: 0.0, ..Params::default() };
    let width = prepare(input.clone(), &exact, None).expect("a volume that can be drawn").slabs().1;
    let params = Params { slab_width: Some(0.125 * width), ..exact };
    let mut fine = Accumulator::new(input.camera.size, 1, 3, false, false);
    let sheeted = prepare(input, &params, None).expect("a volume that can be drawn");
    sheeted.fold(ALL, &[], layout, &mut fine, None).expect("nobody cancels");
    fine
}

/// Of all numbers of both pictures.
fn rmse(a: &Accumulator, b: &Accumulator) -> f64 {
    let pairs = a.channels.iter().flatten().zip(b.channels.iter().flatten());
    let squares = pairs.map(|(a, b)| f64::from(a - b).powi(2));
    (squares.sum::<f64>() / a.channels.iter().map(Vec::len).sum::<usize>() as f64).sqrt()
}
