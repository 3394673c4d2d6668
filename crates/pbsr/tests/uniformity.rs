//! Every sampler by the same two tests: places are uniform (χ² on bins of equal measure, 99.9 % point), and sets are
//! independent (variance of a count, correlation at lags 1 to 5).

use crate::common::*;
use pbsr::{
    BrownianParams, BrownianSampler, Density, FieldVolumeParams, FieldVolumeSampler, GridSampler, ImplicitSurface,
    LatticeSampler, LineParams, LineSampler, MeshSampler, MetropolisParams, MetropolisSampler, Particles, Sampler,
    ShownSampler, SplatParams, SplatSampler, SurfaceParams, VolumeParams,
};
use splat_core::glam::{DMat3, DVec3, Vec3};
use splat_core::{Cloud, DAabb, Grid, Interpolation, Splat, SplatKind, TransferFunction, TransferPoint};

/// Sets in which a count is taken.
const SETS: u64 = 400;

/// Cross-sections: small for one large set, large for many small ones.
const FINE: f64 = 1e-4;
const COARSE: f64 = 1e-2;

/// Coordinates of a place that are uniform in (0, 1); a place that does not count has none.
type Measure = fn(DVec3) -> Option<[f64; 3]>;

/// Equal heights cut equal areas from the unit sphere.
fn on_sphere(p: DVec3) -> Option<[f64; 3]> {
    Some((0.5 * (p + 1.0)).to_array())
}

/// In the cube [−1, 1]³, or on the square z = 0 in it, whose third coordinate does not vary.
fn in_cube(p: DVec3) -> Option<[f64; 3]> {
    on_sphere(p)
}

/// In the inner part of a cube of splats, which fade out at its sides.
fn inside_cube(p: DVec3) -> Option<[f64; 3]> {
    let p = p / 0.4;
    (p.abs().max_element() < 1.0).then(|| (0.5 * (p + 1.0)).to_array())
}

/// A density x in the unit cube around (½, 0, 0).
fn by_ramp(p: DVec3) -> Option<[f64; 3]> {
    Some([p.x * p.x, p.y + 0.5, p.z + 0.5])
}

type Make<'a> = &'a dyn Fn(f64) -> Box<dyn Sampler>;

#[track_caller]
fn check(make: Make<'_>, measure: Measure, axes: usize) {
    assert_eq!(fault(make, measure, axes), None);
}

/// What is wrong with a sampler; `axes` is how many of the coordinates vary.
fn fault(make: Make<'_>, measure: Measure, axes: usize) -> Option<String> {
    let mut bins = [[0u64; 20]; 3];
    for at in positions(make(FINE).as_ref(), 3).into_iter().filter_map(measure) {
        (0..axes).for_each(|a| bins[a][((at[a] * 20.0) as usize).min(19)] += 1);
    }
    for (axis, bins) in bins[..axes].iter().enumerate() {
        let chi2 = chi2_equal(bins);
        if chi2 >= chi2_limit(19.0) {
            return Some(format!("axis {axis}: χ² {chi2} of {}", bins.iter().sum::<u64>()));
        }
    }
    let coarse = make(COARSE);
    let count = |set: u64| {
        let counted = positions(coarse.as_ref(), set).into_iter().filter_map(measure).filter(|at| at[0] > 0.8);
        counted.count() as f64
    };
    let counts: Vec<f64> = (0..SETS).map(count).collect();
    let n = SETS as f64;
    let mean = counts.iter().sum::<f64>() / n;
    let variance = counts.iter().map(|c| (c - mean).powi(2)).sum::<f64>() / n;
    assert!(mean > 5.0, "{mean} a set prove nothing");
    if (variance / mean - 1.0).abs() >= 4.0 * (2.0 / n).sqrt() {
        return Some(format!("variance {variance} of mean {mean}"));
    }
    let correlation = |lag: usize| counts.windows(lag + 1).map(|w| (w[0] - mean) * (w[lag] - mean)).sum::<f64>();
    let lag = (1..=5).find(|lag| (correlation(*lag) / (variance * n)).abs() >= 3.0 / n.sqrt());
    lag.map(|lag| format!("sets {lag} apart correlate"))
}

const SPHERE: ImplicitSurface<'static> = ImplicitSurface {
    field: &Field::UNIT,
    level: 0.0,
    bounds: DAabb::new(DVec3::splat(-1.1), DVec3::splat(1.1)),
    inside: None,
};

fn half(cross_section: f64) -> SurfaceParams {
    SurfaceParams { opacity: 0.5, cross_section, seed: 9, ..SurfaceParams::default() }
}

fn volume(cross_section: f64) -> VolumeParams {
    VolumeParams { cross_section, seed: 9, ..VolumeParams::default() }
}

/// Extinction ½ in the cube.
fn homogeneous() -> (&'static Grid, &'static TransferFunction) {
    let axes = DMat3::from_diagonal(DVec3::splat(0.25));
    let grid = Grid { origin: DVec3::splat(-0.875), axes, dims: [8; 3], values: vec![0.5; 512] };
    let point = |value| TransferPoint { value, color: [0.5; 3], extinction: value };
    let transfer = TransferFunction::new(vec![point(0.0), point(1.0)]).unwrap();
    (Box::leak(Box::new(grid)), Box::leak(Box::new(transfer)))
}

/// A lattice of splats, whose kernels sum to a constant inside: a medium in the cube, or discs on the square z = 0.
fn lattice(kind: SplatKind) -> &'static Cloud {
    const N: i32 = 20;
    let h = 2.0 / N as f32;
    let mut cloud = Cloud::new(DVec3::ZERO);
    let at = |i: i32| (i as f32 + 0.5) * h - 1.0;
    let layers = if kind == SplatKind::Medium { N } else { 1 };
    for i in 0..N * N * layers {
        let z = if kind == SplatKind::Medium { at(i / (N * N)) } else { 0.0 };
        let position = Vec3::new(at(i % N), at(i / N % N), z);
        let cross_section = if kind == SplatKind::Medium { 0.5 * h * h * h } else { 0.7 * h * h };
        let radius = 2.4 * h;
        let normal = Vec3::Z;
        cloud.push(&Splat {
            position,
            radius,
            cross_section,
            kind,
            normal,
            tangent: Vec3::X * radius,
            ..Splat::default()
        });
    }
    Box::leak(Box::new(cloud))
}

#[test]
fn pb13_pb14_lines() {
    check(
        &|s| Box::new(LineSampler::new(&SPHERE, &LineParams { resolution: 24 }, &half(s), None).unwrap()),
        on_sphere,
        3,
    );
}

#[test]
fn pb13_pb14_brownian_motion() {
    let walk = BrownianParams::for_width(2.0);
    check(&|s| Box::new(BrownianSampler::new(&SPHERE, &walk, &half(s)).unwrap()), on_sphere, 3);
}

#[test]
fn pb13_pb14_triangles() {
    let mesh = Box::leak(Box::new(rectangle(Vec3::ZERO, Vec3::X, Vec3::Y, 7)));
    check(&|s| Box::new(MeshSampler::new(mesh, &half(s), None).unwrap()), in_cube, 2);
}

#[test]
fn pb13_pb14_cells() {
    let (grid, transfer) = homogeneous();
    check(&|s| Box::new(GridSampler::new(grid, transfer, &volume(s), None).unwrap()), in_cube, 3);
}

#[test]
fn pb13_pb14_lattice_lines() {
    // The plane z + 0.3·x = 0.1·y through a lattice: uniform in x and y.
    const N: usize = 12;
    let step = 2.0 / (N - 1) as f32;
    let at = |i: usize| i as f32 * step - 1.0;
    let value = |i: usize| at(i / (N * N)) + 0.3 * at(i % N) - 0.1 * at(i / N % N);
    let axes = DMat3::from_diagonal(DVec3::splat(f64::from(step)));
    let grid = Grid { origin: DVec3::splat(-1.0), axes, dims: [N; 3], values: (0..N * N * N).map(value).collect() };
    let grid = Box::leak(Box::new(grid));
    for by in [Interpolation::Trilinear, Interpolation::CatmullRom] {
        check(&|s| Box::new(LatticeSampler::new(grid, by, 0.0, &half(s)).unwrap()), in_cube, 2);
    }
}

#[test]
fn pb13_pb14_metropolis_chains() {
    let (grid, transfer) = homogeneous();
    let chains = MetropolisParams { particles_per_chain: 1, ..MetropolisParams::default() };
    let make =
        |s| Box::new(MetropolisSampler::new(grid, transfer, &volume(s), &chains, None).unwrap()) as Box<dyn Sampler>;
    check(&make, in_cube, 3);
}

#[test]
fn pb13_pb14_fields() {
    let [low, high] = [DVec3::new(0.0, -0.5, -0.5), DVec3::new(1.0, 0.5, 0.5)];
    let make = |s| {
        let ramp = Density { field: &Field::Ramp, max: 1.0 };
        Box::new(
            FieldVolumeSampler::new(
                ramp,
                DAabb::new(low, high),
                &FieldVolumeParams { resolution: 6, cross_section: s, color: [1.0; 3], seed: 9 },
            )
            .unwrap(),
        ) as Box<dyn Sampler>
    };
    check(&make, by_ramp, 3);
}

/// A density (1 + x)/2 on the unit sphere, or on the square z = 0, where y stays uniform.
fn by_share(p: DVec3) -> Option<[f64; 3]> {
    let u = 0.5 * (p + 1.0);
    Some([u.x * u.x, u.y, u.z])
}

/// What is shown of a sampler: that share of it.
fn shown(bare: impl Sampler + 'static) -> Box<dyn Sampler> {
    let look = |p: DVec3| Some(([0.5 + 0.5 * p.x as f32, 0.25, 1.0], 0.5 * (1.0 + p.x)));
    Box::new(ShownSampler::new(Box::new(bare), Box::new(look), 5))
}

#[test]
fn pb13_pb14_shares_of_surfaces() {
    let lines = |s| shown(LineSampler::new(&SPHERE, &LineParams { resolution: 24 }, &half(s), None).unwrap());
    check(&lines, by_share, 1);
    let walk = BrownianParams::for_width(2.0);
    check(&|s| shown(BrownianSampler::new(&SPHERE, &walk, &half(s)).unwrap()), by_share, 1);
    let mesh = Box::leak(Box::new(rectangle(Vec3::ZERO, Vec3::X, Vec3::Y, 7)));
    let make = |s| shown(MeshSampler::new(mesh, &half(s), None).unwrap());
    check(&make, by_share, 2);
    // Half of a square of area 4, in the colours of its places.
    let sampler = make(FINE);
    let expected = 0.5 * 4.0 * half(FINE).particles_per_area();
    let mut scratch = Particles::default();
    let mut number = 0.0;
    for chunk in 0..sampler.chunks() {
        let particles = sampler.chunk(7, chunk, &mut scratch);
        number += particles.len() as f64;
        for (position, color) in particles.position.iter().zip(&particles.color) {
            let red = 0.5 + 0.5 * position.x;
            assert!((color.get()[0] - red).abs() <= 1.0 / 256.0 && (color.get()[2] - 1.0).abs() <= 1.0 / 256.0);
        }
    }
    assert!((number - expected).abs() < 4.0 * expected.sqrt(), "{number} of {expected}");
    // Where nothing is said of a place its particles stay as they are.
    let bare = MeshSampler::new(mesh, &half(COARSE), None).unwrap();
    let places = positions(&bare, 3);
    assert_eq!(positions(&ShownSampler::new(Box::new(bare), Box::new(|_| None), 5), 3), places);
}

#[test]
fn pb13_pb14_splats() {
    for (kind, axes) in [(SplatKind::Medium, 3), (SplatKind::Surface, 2)] {
        let cloud = lattice(kind);
        let make = |cross_section| {
            let params = SplatParams { cross_section, seed: 9, ..SplatParams::default() };
            Box::new(SplatSampler::new(cloud, &params).unwrap()) as Box<dyn Sampler>
        };
        check(&make, inside_cube, axes);
    }
}

/// A sampler with a fault.
struct Planted {
    sampler: Box<dyn Sampler>,
    /// Every second set is the one before; else particles come in pairs.
    copies: bool,
}

impl Sampler for Planted {
    fn origin(&self) -> DVec3 {
        self.sampler.origin()
    }

    fn cross_section(&self) -> f64 {
        self.sampler.cross_section()
    }

    fn chunks(&self) -> usize {
        self.sampler.chunks()
    }

    fn expected(&self, chunk: usize) -> f64 {
        self.sampler.expected(chunk)
    }

    fn chunk<'a>(&'a self, set: u64, chunk: usize, scratch: &'a mut Particles) -> &'a Particles {
        if self.copies {
            return self.sampler.chunk(set / 2, chunk, scratch);
        }
        let mut particles = Particles::default();
        let found = self.sampler.chunk(set, chunk, &mut particles);
        scratch.position = found.position.iter().flat_map(|p| [*p, *p]).collect();
        scratch
    }
}

#[test]
fn planted_copies_and_pairs_are_found() {
    let square = |s: f64| -> Box<dyn Sampler> {
        let mesh = Box::leak(Box::new(rectangle(Vec3::ZERO, Vec3::X, Vec3::Y, 7)));
        Box::new(MeshSampler::new(mesh, &half(s), None).unwrap())
    };
    check(&square, in_cube, 2);
    let copies = fault(&|s| Box::new(Planted { sampler: square(s), copies: true }), in_cube, 2).unwrap();
    assert!(copies.contains("sets 1 apart"), "{copies}");
    assert!(fault(&|s| Box::new(Planted { sampler: square(s), copies: false }), in_cube, 2).is_some());
}
