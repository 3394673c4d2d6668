//! Particles: sampling of meshes, volumes and implicit surfaces, and the projection of kept sets at the sizes of Tanaka 2012
//! (1024²) and of a volume of 256³ at 512² with 16 repeat levels.

use convert::points_to_field;
use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use field::{ExpressionField, GridField, Inside, MpuParams};
use pbsr::{
    Appearance, BrownianParams, BrownianSampler, Ensemble, EnsembleParams, FoldParams, GridSampler, ImplicitSurface,
    KeptSets, LineParams, LineSampler, MeshSampler, MetropolisParams, MetropolisSampler, Object, Particles, Renderer,
    Sampler, Scene, SplatParams, SplatSampler, SurfaceParams, VolumeParams, pixel_area,
};
use rayon::prelude::*;
use splat_core::glam::{DMat3, DVec3, Vec3};
use splat_core::{
    Camera, Cloud, DAabb, Grid, Interpolation, Material, Mesh, Projection, RawPoints, ScalarField, Shading, Similarity,
    Splat, SplatKind, TransferFunction, TransferPoint, rng,
};
use std::f64::consts::TAU;

/// (√(x² + y²) − 0.7)² + z² − 0.09.
struct Torus;

impl ScalarField for Torus {
    fn value(&self, p: DVec3) -> f64 {
        let r = (p.x * p.x + p.y * p.y).sqrt() - 0.7;
        r * r + p.z * p.z - 0.09
    }

    fn gradient(&self, p: DVec3) -> DVec3 {
        let k = 2.0 - 1.4 / (p.x * p.x + p.y * p.y).sqrt();
        DVec3::new(k * p.x, k * p.y, 2.0 * p.z)
    }

    fn hessian(&self, p: DVec3) -> DMat3 {
        let r = (p.x * p.x + p.y * p.y).sqrt();
        let c = p.x / r;
        let s = p.y / r;
        let turn = 2.0 - 1.4 / r;
        let xy = (2.0 - turn) * c * s;
        let x = DVec3::new(2.0 * c * c + turn * s * s, xy, 0.0);
        DMat3::from_cols(x, DVec3::new(xy, 2.0 * s * s + turn * c * c, 0.0), DVec3::new(0.0, 0.0, 2.0))
    }

    fn bound(&self, p: DVec3, radius: f64) -> Option<(f64, f64)> {
        let d = ((p.x * p.x + p.y * p.y).sqrt() - 0.7).hypot(p.z);
        let near = (d - radius).max(0.0);
        Some((near * near - 0.09, (d + radius) * (d + radius) - 0.09))
    }
}

/// A wavy sheet of 70 688 triangles.
fn sheet() -> Mesh {
    let n = 188u32;
    let mut mesh = Mesh::default();
    for k in 0..(n + 1) * (n + 1) {
        let at = |i: u32| 2.0 * i as f32 / n as f32 - 1.0;
        let x = at(k % (n + 1));
        let y = at(k / (n + 1));
        mesh.position.push(Vec3::new(x, y, 0.2 * (9.0 * x.hypot(y)).cos()));
        mesh.normal.push(Vec3::new(x, y, 4.0).normalize());
    }
    for k in (0..(n + 1) * n).filter(|k| k % (n + 1) < n) {
        mesh.triangles.extend([[k, k + 1, k + n + 2], [k, k + n + 2, k + n + 1]]);
    }
    mesh
}

/// 40 000 points with normals around a torus with bumps.
fn torus_points() -> RawPoints {
    let mut points = RawPoints::default();
    for i in 0..40_000 {
        let angle = |k| TAU * rng::unit(3, 1, i, k);
        let (sin, cos) = angle(0).sin_cos();
        let b = angle(1);
        let normal = DVec3::new(cos * b.cos(), sin * b.cos(), b.sin());
        let tube = 0.3 + 0.05 * (7.0 * angle(0)).sin() * (5.0 * b).cos();
        points.position.push((DVec3::new(0.7 * cos, 0.7 * sin, 0.0) + normal * tube).as_vec3());
        points.normal.push(normal.as_vec3());
    }
    points
}

/// 256³ values that fall with the distance from the middle.
fn ball() -> (Grid, TransferFunction) {
    let n = 256usize;
    let value = |i: usize| {
        let p = Vec3::new((i % n) as f32, (i / n % n) as f32, (i / n / n) as f32) / n as f32 - 0.5;
        (1.0 - 2.0 * p.length()).max(0.0)
    };
    let axes = DMat3::from_diagonal(DVec3::splat(2.0 / n as f64));
    let grid = Grid { origin: DVec3::splat(-1.0), axes, dims: [n; 3], values: (0..n * n * n).map(value).collect() };
    let point = |value, extinction| TransferPoint { value, color: [value, 0.5, 1.0 - value], extinction };
    let points = vec![point(0.2, 0.0), point(0.4, 2.0), point(0.7, 0.5), point(1.0, 6.0)];
    (grid, TransferFunction::new(points).expect("invariant: rising values"))
}

/// 64³ values of a gyroid.
fn gyroid(interpolation: Interpolation) -> GridField {
    let n = 64usize;
    let at = |i: usize| TAU * (i as f64 / (n - 1) as f64 * 2.0 - 1.0);
    let value = |i: usize| {
        let [x, y, z] = [at(i % n), at(i / n % n), at(i / n / n)];
        (x.sin() * y.cos() + y.sin() * z.cos() + z.sin() * x.cos()) as f32
    };
    let axes = DMat3::from_diagonal(DVec3::splat(2.0 / (n - 1) as f64));
    let grid = Grid { origin: DVec3::splat(-1.0), axes, dims: [n; 3], values: (0..n * n * n).map(value).collect() };
    GridField::new(grid.into(), interpolation, 0.0, Inside::Below).expect("invariant: a grid")
}

/// 100 000 splats of one kind.
fn cloud(kind: SplatKind) -> Cloud {
    let mut cloud = Cloud::new(DVec3::ZERO);
    for i in 0..100_000 {
        let u = |k| rng::unit_f32(3, 0, i, k);
        let normal = Vec3::new(u(4) - 0.5, u(5) - 0.5, u(6) + 0.1).normalize();
        cloud.push(&Splat {
            kind,
            normal: if kind == SplatKind::Medium { Vec3::ZERO } else { normal },
            position: Vec3::new(u(0), u(1), u(2)),
            radius: 0.01 + 0.01 * u(3),
            cross_section: 1e-4 * (1.0 + u(7)),
            ..Splat::default()
        });
    }
    cloud
}

fn camera(n: u32) -> Camera {
    let view = Projection::Orthographic { height: 2.0 };
    Camera::look_at(DVec3::Z * 4.0, DVec3::ZERO, DVec3::Y, view, [n, n]).expect("invariant: a camera")
}

/// `sets` sets, those of one chunk one after the other.
fn sample(sampler: &dyn Sampler, sets: u64) -> usize {
    let of_chunk = |particles: &mut Particles, c: usize| -> usize {
        (0..sets).map(|set| sampler.chunk(set, c, particles).len()).sum()
    };
    (0..sampler.chunks()).into_par_iter().map_init(Particles::default, of_chunk).sum()
}

fn lines<'a>(surface: &ImplicitSurface<'a>, resolution: u32, params: &SurfaceParams) -> Box<dyn Sampler + 'a> {
    Box::new(LineSampler::new(surface, &LineParams { resolution }, params, None).expect("invariant: it has a surface"))
}

fn sampling(c: &mut Criterion) {
    let s = pixel_area(&camera(1024), DVec3::Z);
    let mesh = sheet();
    let flat = Mesh { normal: Vec::new(), ..mesh.clone() };
    let (grid, transfer) = ball();
    let surface = |opacity| SurfaceParams { opacity, cross_section: s, ..SurfaceParams::default() };
    let volume = VolumeParams { cross_section: s, ..VolumeParams::default() };
    let lit = VolumeParams { normals: true, ..volume };
    let bounds = DAabb::around(DVec3::ZERO, DVec3::new(1.1, 1.1, 0.4));
    let torus = ImplicitSurface { field: &Torus, level: 0.0, bounds, inside: None };
    let why = "invariant: the benchmark's scene";
    let walk = BrownianParams::for_width(2.0);
    let formula = ExpressionField::parse("z - 0.2*cos(9*sqrt(x^2 + y^2))").expect(why);
    let bounds = DAabb::around(DVec3::ZERO, DVec3::ONE);
    let wave = ImplicitSurface { field: &formula, level: 0.0, bounds, inside: None };
    let volumes = [Interpolation::Trilinear, Interpolation::CatmullRom].map(gyroid);
    let levels = volumes.each_ref().map(|field| ImplicitSurface { field, level: 0.0, bounds, inside: None });
    let (blend, _) = points_to_field(&torus_points(), &MpuParams::default(), None).expect(why);
    let scattered = ImplicitSurface { field: &blend, level: 0.0, bounds: blend.bounds(), inside: None };
    let clouds = [SplatKind::Medium, SplatKind::Surface].map(cloud);
    let of_splats = SplatParams { cross_section: 1e-5, ..SplatParams::default() };
    let by_lines = surface(0.1);
    let samplers: [(&str, u64, Box<dyn Sampler>); 13] = [
        ("mesh, flat", 8, Box::new(MeshSampler::new(&flat, &surface(0.5), None).expect(why))),
        ("mesh, smooth", 8, Box::new(MeshSampler::new(&mesh, &surface(0.5), None).expect(why))),
        ("volume", 16, Box::new(GridSampler::new(&grid, &transfer, &volume, None).expect(why))),
        ("volume, normals", 16, Box::new(GridSampler::new(&grid, &transfer, &lit, None).expect(why))),
        (
            "volume, Metropolis",
            1,
            Box::new(MetropolisSampler::new(&grid, &transfer, &volume, &MetropolisParams::default(), None).expect(why)),
        ),
        ("torus, lines", 2, lines(&torus, 32, &by_lines)),
        ("cosine wave, lines", 2, lines(&wave, 48, &by_lines)),
        ("trilinear volume, lines", 1, lines(&levels[0], 64, &by_lines)),
        ("Catmull-Rom volume, lines", 1, lines(&levels[1], 64, &by_lines)),
        ("scattered points, lines", 1, lines(&scattered, 48, &by_lines)),
        ("splats, media", 2, Box::new(SplatSampler::new(&clouds[0], &of_splats).expect(why))),
        ("splats, discs", 2, Box::new(SplatSampler::new(&clouds[1], &of_splats).expect(why))),
        ("torus, Brownian", 2, Box::new(BrownianSampler::new(&torus, &walk, &surface(0.1)).expect(why))),
    ];
    let mut group = c.benchmark_group("pbsr/sample");
    group.sample_size(10);
    for (name, sets, sampler) in &samplers {
        group.throughput(Throughput::Elements(sample(&**sampler, *sets) as u64));
        group.bench_function(*name, |b| b.iter(|| sample(&**sampler, *sets)));
    }
    group.finish();
}

fn projection(c: &mut Criterion) {
    let mut group = c.benchmark_group("pbsr/project");
    group.sample_size(10);
    let why = "invariant: the benchmark's scene";
    let (grid, transfer) = ball();
    let mesh = sheet();
    // The last has the 5·10⁷ particles of the paper's scenes: 1 GB.
    for (name, size, levels, opacity) in [
        ("volume 512, 16 levels", 512, 16, 0.0),
        ("surface 1024, 64 levels", 1024, 64, 0.1),
        ("surface 1024, 64 levels, 5e7", 1024, 64, 0.375),
    ] {
        let camera = camera(size);
        let s = pixel_area(&camera, DVec3::Z);
        let kept = if size == 512 {
            let volume = VolumeParams { cross_section: s, normals: true, ..VolumeParams::default() };
            KeptSets::new(&GridSampler::new(&grid, &transfer, &volume, None).expect(why), 0, levels as usize)
        } else {
            let surface = SurfaceParams { opacity, cross_section: s, ..SurfaceParams::default() };
            KeptSets::new(&MeshSampler::new(&mesh, &surface, None).expect(why), 0, levels as usize)
        };
        let material = Material { shading: Shading::Unlit, ..Material::default() };
        let look = Appearance { material, ..Appearance::default() };
        let objects = [Object { sampler: &kept, transform: Similarity::default(), look }];
        let scene = Scene {
            objects: &objects,
            lights: &[],
            shadow_origin: DVec3::ZERO,
            ambient: [0.0; 3],
            camera: &camera,
            occluder: None,
        };
        let mut renderer = Renderer::new();
        group.throughput(Throughput::Elements(kept.particles()));
        group.bench_function(name, |b| {
            b.iter(|| {
                let mut ensemble = Ensemble::new(camera.size, &EnsembleParams::default()).expect(why);
                renderer.fold(&scene, &mut ensemble, &FoldParams { levels, ..FoldParams::default() }, None).expect(why);
                ensemble
            });
        });
    }
    group.finish();
}

criterion_group!(benches, sampling, projection);
criterion_main!(benches);
