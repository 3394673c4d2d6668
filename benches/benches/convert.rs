//! Benchmark of convert: files to nouns are not timed, nouns to splats are; splats (or points, voxels) per second.

use convert::{
    CloudShape, Density, MeshParams, Orientation, SplatParams, SurfelParams, VolumeParams, mesh_to_points,
    mesh_to_points_into, procedural_cloud, raw_to_surfels, sobel_gradient_into, surface_to_points, volume_to_points,
};
use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use field::ExpressionField;
use glam::{DMat3, DVec3, Vec3};
use rayon::prelude::*;
use read::{Loaded, ReadParams};
use rstar::RTree;
use splat_core::{Cloud, DAabb, Grid, Mesh, RawPoints, TransferFunction, TransferPoint, rng};
use std::path::Path;

fn asset(name: &str) -> Loaded {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../assets").join(name);
    read::file(&path, &ReadParams::default(), None).expect("an asset of the repository").0
}

fn bunny() -> Mesh {
    match asset("stanford-bunny/bunny.ply.gz") {
        Loaded::Mesh(mesh) => mesh,
        _ => Mesh::default(),
    }
}

fn terrain() -> RawPoints {
    match asset("autzen/autzen_trim.laz") {
        Loaded::Points(points) => points,
        _ => RawPoints::default(),
    }
}

fn head() -> Grid {
    match asset("mni152/mni152_t1.nii.gz") {
        Loaded::Grid(grid) => grid,
        _ => Grid { origin: DVec3::ZERO, axes: DMat3::IDENTITY, dims: [1; 3], values: vec![1.0] },
    }
}

fn meshes(c: &mut Criterion) {
    let mesh = bunny();
    let mut group = c.benchmark_group("mesh_to_points");
    for count in [440_000, 620_000, 1_840_000, 10_000_000] {
        let params = MeshParams { density: Density::Splats(count), ..MeshParams::default() };
        let mut cloud = Cloud::default();
        let Ok(report) = mesh_to_points_into(&mesh, &params, &mut cloud, None) else { continue };
        group.throughput(Throughput::Elements(report.splats));
        group.bench_function(BenchmarkId::new("reused memory", report.splats), |b| {
            b.iter(|| mesh_to_points_into(&mesh, &params, &mut cloud, None));
        });
        group.bench_function(BenchmarkId::new("fresh memory", report.splats), |b| {
            b.iter(|| mesh_to_points(&mesh, &params, None));
        });
    }
    group.finish();
}

fn volumes(c: &mut Criterion) {
    let n = 256usize;
    let wave = |i: usize| {
        let [x, y, z] = [i % n, i / n % n, i / n / n].map(|c| c as f32);
        (0.05 * x).sin() + (0.07 * y).cos() + (0.03 * z).sin()
    };
    let values = (0..n * n * n).map(wave).collect();
    let grid = Grid { origin: DVec3::ZERO, axes: DMat3::IDENTITY, dims: [n; 3], values };
    let mut group = c.benchmark_group("sobel");
    group.throughput(Throughput::Elements(grid.values.len() as u64));
    let mut gradient = vec![Vec3::ZERO; grid.values.len()];
    group.bench_function("256^3", |b| b.iter(|| sobel_gradient_into(&grid, &mut gradient)));
    group.finish();

    let head = head();
    let top = head.values.iter().copied().fold(f32::MIN_POSITIVE, f32::max);
    let point = |share: f32, extinction| TransferPoint { value: share * top, color: [1.0; 3], extinction };
    let Ok(tf) = TransferFunction::new(vec![point(0.1, 0.0), point(1.0, 1.0)]) else { return };
    let mut group = c.benchmark_group("volume_to_points");
    for normals in [false, true] {
        let params = VolumeParams { normals, ..VolumeParams::default() };
        let Ok((_, report)) = volume_to_points(&head, &tf, &params, None) else { continue };
        group.throughput(Throughput::Elements(report.splats));
        let name = if normals { "head with normals" } else { "head" };
        group.bench_function(BenchmarkId::new(name, report.splats), |b| {
            b.iter(|| volume_to_points(&head, &tf, &params, None));
        });
    }
    group.finish();
}

fn points(c: &mut Criterion) {
    let terrain = terrain();
    let mut group = c.benchmark_group("raw_to_surfels");
    group.throughput(Throughput::Elements(terrain.len() as u64));
    group.bench_function(BenchmarkId::new("terrain", terrain.len()), |b| {
        b.iter(|| raw_to_surfels(&terrain, &SurfelParams::default(), None));
    });
    let hills = hills(1 << 20);
    let Ok((cloud, _)) = raw_to_surfels(&hills, &SurfelParams::default(), None) else { return };
    group.throughput(Throughput::Elements(cloud.len() as u64));
    group.bench_function(BenchmarkId::new("hills", cloud.len()), |b| {
        b.iter(|| raw_to_surfels(&hills, &SurfelParams::default(), None));
    });
    // Nothing but the neighbours, in the order that suits its caches best.
    let at: Vec<[f32; 3]> = cloud.position.iter().map(Vec3::to_array).collect();
    group.bench_function(BenchmarkId::new("hills, neighbours by rstar", at.len()), |b| {
        b.iter(|| {
            let tree = RTree::bulk_load(at.clone());
            // The first is the point itself.
            let farthest = |p: &[f32; 3]| tree.nearest_neighbor_iter(p).nth(10).map_or(0.0, |n| f64::from(n[0]));
            at.par_iter().map(farthest).sum::<f64>()
        });
    });
    group.finish();
}

/// Points that no surface orders: of one density, thinner outwards, and with some of them far out.
fn clouds_of_points(c: &mut Criterion) {
    let uniform = |i: u64| DVec3::new(rng::unit(2, 0, i, 0), rng::unit(2, 0, i, 1), rng::unit(2, 0, i, 2));
    let bell = |i: u64, axis: u64| {
        let radius = (-2.0 * rng::unit(3, 0, i, 2 * axis).max(1e-300).ln()).sqrt();
        radius * (std::f64::consts::TAU * rng::unit(3, 0, i, 2 * axis + 1)).cos()
    };
    let normal = |i: u64| DVec3::new(bell(i, 0), bell(i, 1), bell(i, 2));
    let heavy = |i: u64| normal(i) * (6.0 * bell(i, 3)).exp();
    let kinds: [(&str, &dyn Fn(u64) -> DVec3); 3] =
        [("uniform", &uniform), ("normal", &normal), ("heavy tails", &heavy)];
    let params = SurfelParams { orientation: Orientation::Auto(DVec3::Y), ..SurfelParams::default() };
    let mut group = c.benchmark_group("clouds of points");
    for (name, point) in kinds {
        for count in [250_000, 1_000_000, 4_000_000] {
            let position = (0..count).map(|i| point(i).as_vec3()).collect();
            let points = RawPoints { position, ..RawPoints::default() };
            group.throughput(Throughput::Elements(count));
            group.bench_function(BenchmarkId::new(name, count), |b| b.iter(|| raw_to_surfels(&points, &params, None)));
        }
    }
    group.finish();
}

fn fields(c: &mut Criterion) {
    let mut group = c.benchmark_group("fields");
    let text = "sin(x)*cos(y) + sin(y)*cos(z) + sin(z)*cos(x)";
    let Ok(gyroid) = ExpressionField::parse(text) else { return };
    let bounds = DAabb::new(DVec3::ZERO, DVec3::splat(6.0));
    let params = MeshParams { density: Density::Spacing(0.03), ..MeshParams::default() };
    if let Ok((_, report)) = surface_to_points(&gyroid, bounds, &params, None) {
        group.throughput(Throughput::Elements(report.splats));
        group.bench_function(BenchmarkId::new("gyroid surface", report.splats), |b| {
            b.iter(|| surface_to_points(&gyroid, bounds, &params, None));
        });
    }
    let shape = CloudShape::default();
    let splat = SplatParams::default();
    if let Ok(grid) = procedural_cloud(&shape, 0.05, &splat, None) {
        group.throughput(Throughput::Elements(grid.values.len() as u64));
        group.bench_function(BenchmarkId::new("procedural cloud", grid.values.len()), |b| {
            b.iter(|| procedural_cloud(&shape, 0.05, &splat, None));
        });
    }
    group.finish();
}

/// Time from one to sixteen million of each: it should grow with the number, at most 2.3 times a doubling.
fn growth(c: &mut Criterion) {
    let mut group = c.benchmark_group("growth");
    let mesh = bunny();
    for millions in [1u64, 2, 4, 8, 16] {
        let n = millions << 20;
        group.throughput(Throughput::Elements(n));
        let params = MeshParams { density: Density::Splats(n), ..MeshParams::default() };
        let mut cloud = Cloud::default();
        let Ok(_) = mesh_to_points_into(&mesh, &params, &mut cloud, None) else { continue };
        group.bench_function(BenchmarkId::new("mesh", millions), |b| {
            b.iter(|| mesh_to_points_into(&mesh, &params, &mut cloud, None));
        });
        let hills = hills(n);
        group.bench_function(BenchmarkId::new("raw points", millions), |b| {
            b.iter(|| raw_to_surfels(&hills, &SurfelParams::default(), None));
        });
    }
    group.finish();
}

/// `n` points scattered over rolling ground of one point a unit².
fn hills(n: u64) -> RawPoints {
    let side = (n as f32).sqrt();
    let point = |i: u64| {
        let x = side * rng::unit_f32(1, 0, i, 0);
        let z = side * rng::unit_f32(1, 0, i, 1);
        Vec3::new(x, 9.0 * (x * 0.02).sin() * (z * 0.03).cos(), z)
    };
    RawPoints { position: (0..n).map(point).collect(), ..RawPoints::default() }
}

criterion_group! {
    name = benches;
    config = Criterion::default().sample_size(10);
    targets = meshes, volumes, points, clouds_of_points, fields, growth
}
criterion_main!(benches);
