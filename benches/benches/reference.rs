//! The truth: paths through a cloud of 64³ voxels (albedo 0.99, 256x256, 4 samples a pixel), and the exact compositor on
//! the outdoor scene's points at 600x500. The example `speed` of the crate `reference` adds the time to 1 % error.
#![allow(missing_docs, clippy::expect_used, reason = "a benchmark")]

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use organza_benches::{TABLE_1, outdoor, outdoor_cloud};
use reference::{Density, Input, Lattice, LightSource, Medium, Order, PathSettings, Scene, composite, path_trace};
use splat_core::glam::{DMat3, DVec3};
use splat_core::{Camera, Grid, Projection};
use std::hint::black_box;

/// A soft ball in the unit cube around the origin.
fn ball() -> Grid {
    let n = 64;
    let h = 1.0 / 64.0;
    let place = |i: usize| (i as f64 + 0.5) * h - 0.5;
    let value = |i: usize| {
        let p = DVec3::new(place(i % n), place(i / n % n), place(i / (n * n)));
        (1.0 - p.length_squared() * 5.0).max(0.0) as f32
    };
    Grid {
        origin: DVec3::splat(place(0)),
        axes: DMat3::from_diagonal(DVec3::splat(h)),
        dims: [n; 3],
        values: (0..n * n * n).map(value).collect(),
    }
}

fn paths(c: &mut Criterion) {
    let mut group = c.benchmark_group("path tracer 256x256");
    group.sample_size(10);
    let grid = ball();
    let lattice = Lattice::new(&grid).expect("a density");
    let projection = Projection::Perspective { fov_y: 0.5 };
    let camera = Camera::look_at(DVec3::Z * 2.2, DVec3::ZERO, DVec3::Y, projection, [256; 2]).expect("a camera");
    let light = LightSource::Directional { direction: DVec3::NEG_Y, irradiance: [3.0; 3] };
    let settings = PathSettings { samples: 4, batch: 4, ..PathSettings::default() };
    for extinction in [10, 30, 100] {
        let medium = Medium::new(Density::Grid(lattice), f64::from(extinction), 0.99);
        let scene = Scene { media: vec![medium], lights: vec![light], ..Scene::default() };
        group.throughput(Throughput::Elements(256 * 256 * u64::from(settings.samples)));
        group.bench_function(BenchmarkId::new("paths", extinction), |b| {
            b.iter(|| black_box(path_trace(&scene, &camera, &settings, None)));
        });
    }
    group.finish();
}

fn exact(c: &mut Criterion) {
    let mut group = c.benchmark_group("exact compositor 600x500");
    group.sample_size(10);
    let scene = outdoor();
    for n in TABLE_1 {
        let (cloud, mut camera) = outdoor_cloud(n);
        camera.size = [600, 500];
        let values: Vec<f32> = cloud.color.iter().flatten().copied().collect();
        let input = Input {
            cloud: &cloud,
            camera: &camera,
            footprints: &scene.footprints,
            materials: &scene.materials,
            values: &values,
            channels: 3,
            resampling_sigma_px: 0.3,
            order: Order::Fragment,
        };
        group.throughput(Throughput::Elements(n as u64));
        group.bench_function(BenchmarkId::new("composite", n), |b| b.iter(|| black_box(composite(&input, None))));
    }
    group.finish();
}

criterion_group!(benches, paths, exact);
criterion_main!(benches);
