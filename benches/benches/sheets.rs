//! Image-aligned sheets of the MRI head: prepare and fold at 400² and 512², semi-transparent and opaque, unlit and shaded.
//!
//! A plain table of minima: other work on the machine only ever adds time. The second number of each part is the time of all
//! threads on processors, which other work adds less to. The error is the RMSE of linear colours to slabs an eighth as wide and no
//! pixel ever done, of the file's lattice, gathered by the row's kernel where the row gathers and else by the paper's method. `step` is the width of a
//! slab, millimetres. `benches/peers/vtk_volume.py` has the same rows by VTK, `benches/peers/volume_table.py` prints both beside each other.
//!
//! `-- WORD` draws the rows whose name has it. `-- FILE` draws that volume in the place of the head, and `-- dense` one of 256³ voxels
//! that are all visible: views, transfer functions and extinctions are the head's, stretched over the range of its values and by its diagonal.
#![allow(missing_docs, clippy::expect_used, reason = "a benchmark")]

use convert::{SplatParams, body_centred};
use organza_benches::{HeadLike, processor_ms, record};
use sheet_light::{Aligned, Classify, GatherKernel, Params, Reconstruction, SheetCounts, SheetInput, Volume, prepare};
use splat_core::glam::DVec3;
use splat_core::shade::{ChannelLayout, LitBy};
use splat_core::{
    Accumulator, Camera, Grid, LayerSet, Light, LightShape, Material, Packing, Shading, Similarity, TransferFunction,
};
use std::path::Path;
use std::time::Instant;

/// Runs each part this often.
const REPEATS: usize = 7;

/// What a row splats or reads, and how.
struct Method<'a> {
    name: &'static str,
    grid: &'a Grid,
    packing: Packing,
    reconstruction: Reconstruction,
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

fn main() {
    let words: Vec<String> = std::env::args().skip(1).filter(|a| !a.starts_with('-')).collect();
    let (files, words): (Vec<_>, Vec<_>) =
        words.into_iter().partition(|word| Path::new(word).is_file() || word == "dense");
    let only = words.concat();
    let file = files.first().map(String::as_str);
    let volume = file.and_then(|f| Path::new(f).file_stem()?.to_str()).map(|f| format!("{f} ")).unwrap_or_default();
    let like = HeadLike::new(file);
    let grid = &like.grid;
    let semi = like.transfer(HeadLike::SEMI);
    let iso = like.transfer(HeadLike::ISO);
    let start = Instant::now();
    let bcc = body_centred(grid, &SplatParams::default()).expect("a volume");
    let share = bcc.planes.values.len() as f64 / grid.values.len() as f64;
    println!(
        "{:?} resampled to {:?}, {share:.4} of the points, in {:.0?}",
        grid.dims,
        bcc.planes.dims,
        start.elapsed()
    );
    let paper = Method {
        name: "",
        grid,
        packing: Packing::Cartesian,
        reconstruction: Reconstruction::Splat,
        classify: Classify::After,
        aligned: Aligned::View,
        cutoff: Params::PAPERS_CUTOFF,
        width: 1.0,
    };
    let methods = [
        Method { name: " gathered", reconstruction: Reconstruction::Gather(GatherKernel::Gaussian), ..paper },
        Method { name: " linear", reconstruction: Reconstruction::Gather(GatherKernel::Linear), ..paper },
        Method { name: " bcc", grid: &bcc.planes, packing: Packing::BodyCentred, ..paper },
        Method { name: " before", classify: Classify::Before, ..paper },
        Method { name: " axis", aligned: Aligned::Axis, ..paper },
        Method { name: " all pixels", cutoff: 0.0, ..paper },
        Method { name: " 2 wide", width: 2.0, ..paper },
    ];
    println!(
        "{:>28} {:>12} {:>12} {:>7} {:>9} {:>7} {:>11} {:>10} {:>8} {:>8}",
        "ms", "prepare", "fold", "M vox", "M splats", "M frag", "M frag/s", "M shaded", "RMSE", "step"
    );
    for pixels in [400, 512] {
        for (class, tf) in [("semi", &semi), ("iso", &iso)] {
            for lit in [false, true] {
                for perspective in [false, true] {
                    let lens = if perspective { "pinhole" } else { "parallel" };
                    let light = if lit { "shaded" } else { "unlit" };
                    for method in std::iter::once(&paper).chain(&methods) {
                        let name = format!("{volume}{pixels} {class} {light} {lens}{}", method.name);
                        if name.contains(&only) && !(perspective && method.aligned == Aligned::Axis) {
                            row(&name, [method, &paper], tf, lit, &like.camera(pixels, perspective));
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
        reconstruction: method.reconstruction,
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
    let mut best = [[f64::INFINITY; 2]; 2];
    let mut counts = SheetCounts::default();
    let mut clock = Vec::new();
    for _ in 0..REPEATS {
        let start = Instant::now();
        let busy = processor_ms();
        let sheeted = prepare(input.clone(), &params, None).expect("a volume that can be drawn");
        let middle = Instant::now();
        let middle_busy = processor_ms();
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
    let exact = match method.reconstruction {
        Reconstruction::Splat => SheetInput { volumes: vec![paper.volume(transfer, &material, lit)], ..input.clone() },
        Reconstruction::Gather(_) => input.clone(),
    };
    let fine = fine(exact, method.reconstruction, &layout);
    let million = |n: u64| n as f64 * 1e-6;
    let [prepared, folded] = best.map(|[wall, busy]| format!("{wall:.1} {busy:.0}"));
    println!(
        "{name:>28} {prepared:>12} {folded:>12} {:7.2} {:9.2} {:7.1} {:11.0} {:10.1} {:8.5} {:8.5}",
        million(counts.visible),
        million(counts.records),
        million(counts.fragments),
        million(counts.fragments) / best[1][0] * 1e3,
        million(counts.shaded),
        rmse(&out, &fine),
        slab_width.unwrap_or_else(step),
    );
}

/// Slabs an eighth as wide as the lattice's steps, and no pixel ever done.
fn fine(input: SheetInput<'_>, reconstruction: Reconstruction, layout: &ChannelLayout) -> Accumulator {
    let exact = Params { reconstruction, transmittance_cutoff: 0.0, ..Params::default() };
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
