//! One-off checks at p = 0.001 against closed forms: opacity of planes, spheres, slabs and clouds of splats.

use crate::common::*;
use pbsr::{
    Density, FieldVolumeParams, FieldVolumeSampler, GridSampler, LatticeSampler, MeshSampler, MetropolisParams,
    MetropolisSampler, Particles, Sampler, SplatParams, SplatSampler, SurfaceParams, VolumeParams, pixel_area,
};
use splat_core::glam::{DMat3, DVec3, Vec3};
use splat_core::optics::SurfaceOpacity;
use splat_core::{
    Cloud, DAabb, Footprint, Grid, Interpolation, Projection, Splat, SplatKind, TransferFunction, TransferPoint,
};

fn surface(opacity: f64, cross_section: f64, seed: u64) -> SurfaceParams {
    SurfaceParams { opacity, cross_section, seed, ..SurfaceParams::default() }
}

#[test]
fn a_stack_of_planes_has_the_product_of_their_transmittances() {
    let camera = front(32);
    let s = pixel_area(&camera, DVec3::Z);
    let planes: Vec<_> =
        [-0.5, 0.0, 0.5].map(|z| rectangle(Vec3::Z * z, Vec3::X * 1.5, Vec3::Y * 1.5, 3)).into_iter().collect();
    let samplers: Vec<_> = planes
        .iter()
        .zip([0.3, 0.05, 0.6])
        .zip(1..)
        .map(|((mesh, alpha), seed)| MeshSampler::new(mesh, &surface(alpha, s, seed), None).unwrap())
        .collect();
    let samplers: Vec<&dyn Sampler> = samplers.iter().map(|s| s as &dyn Sampler).collect();
    let ensemble = render(&camera, &samplers, 2000);
    let alpha = 1.0 - 0.7 * 0.95 * 0.4;
    let found = bias(&ensemble, &|_, _| Some(alpha));
    assert!(found.none(), "{found:?}");
    // The same picture against a wrong opacity.
    assert!(!bias(&ensemble, &|_, _| Some(alpha * 1.005)).none());
}

/// Figure 3, left: five isosurfaces of the trilinear field x·y·z within one cell. A ray along z at (x, y) meets that of the level v
/// once, at z = v/(x·y), where |v| ≤ |x·y|.
#[test]
fn five_isosurfaces_within_one_trilinear_cell_have_the_opacity_of_those_that_a_ray_meets() {
    const LEVELS: [f64; 5] = [-0.5, -0.25, 0.125, 0.375, 0.625];
    let sign = |i: usize, axis: usize| if i >> axis & 1 == 1 { 1.0 } else { -1.0 };
    let values = (0..8).map(|i| sign(i, 0) * sign(i, 1) * sign(i, 2)).collect();
    let axes = DMat3::from_diagonal(DVec3::splat(2.0));
    let grid = Grid { origin: DVec3::splat(-1.0), axes, dims: [2; 3], values };
    let camera = front(32);
    let s = pixel_area(&camera, DVec3::Z);
    let sampler = |level: f64, seed: u64| {
        let params = SurfaceParams { surface_opacity: SurfaceOpacity::PerCrossing, ..surface(0.1, s, seed) };
        LatticeSampler::new(&grid, Interpolation::Trilinear, level as f32, &params).unwrap()
    };
    let samplers: Vec<LatticeSampler<'_>> = LEVELS.into_iter().zip(1..).map(|(v, seed)| sampler(v, seed)).collect();
    let five: Vec<&dyn Sampler> = samplers.iter().map(|s| s as &dyn Sampler).collect();
    let crossings = |x: f64, y: f64| LEVELS.iter().filter(|v| v.abs() <= (x * y).abs()).count() as f64;
    let expected = |x: u32, y: u32| {
        const N: u32 = 32;
        let place = |pixel: u32, k: u32| (f64::from(pixel) + (f64::from(k) + 0.5) / f64::from(N)) / 16.0 - 1.0;
        let sum: f64 = (0..N * N).map(|k| crossings(place(x, k % N), place(y, k / N))).sum();
        Some(1.0 - 0.9f64.powf(sum / f64::from(N * N)))
    };
    let found = bias(&render(&camera, &five, 1500), &expected);
    assert!(found.none(), "{found:?}");
    // A picture that lacks one of the surfaces is told from it.
    let found = bias(&render(&camera, &five[1..], 1500), &expected);
    assert!(!found.none(), "{found:?}");
}

/// The sets of another sampler, several numbers standing for one set.
struct Correlated<'a>(&'a dyn Sampler);

impl Sampler for Correlated<'_> {
    fn origin(&self) -> DVec3 {
        self.0.origin()
    }
    fn cross_section(&self) -> f64 {
        self.0.cross_section()
    }
    fn chunks(&self) -> usize {
        self.0.chunks()
    }
    fn expected(&self, chunk: usize) -> f64 {
        self.0.expected(chunk)
    }
    fn chunk<'a>(&'a self, set: u64, chunk: usize, scratch: &'a mut Particles) -> &'a Particles {
        self.0.chunk(set / 2, chunk, scratch)
    }
}

#[test]
fn planted_correlation_between_sets_is_caught() {
    let camera = front(32);
    let s = pixel_area(&camera, DVec3::Z);
    let mesh = rectangle(Vec3::ZERO, Vec3::X * 1.5, Vec3::Y * 1.5, 1);
    let sampler = MeshSampler::new(&mesh, &surface(0.4, s, 1), None).unwrap();
    let good = bias(&render(&camera, &[&sampler], 500), &|_, _| Some(0.4));
    assert!(good.none(), "{good:?}");
    let bad = bias(&render(&camera, &[&Correlated(&sampler)], 500), &|_, _| Some(0.4));
    assert!(!bad.none(), "{bad:?}");
}

#[test]
fn two_intersecting_planes_have_four_regions() {
    // Planes z = ±x/2 in two colours, seen from the front: left and right one of them is nearer.
    let camera = front(32);
    let s = pixel_area(&camera, DVec3::Z);
    let tilted = |slope: f32| rectangle(Vec3::ZERO, Vec3::new(1.5, 0.0, 1.5 * slope), Vec3::Y * 0.5, 1);
    let a = tilted(0.5);
    let b = tilted(-0.5);
    let params = |color, seed| SurfaceParams { color, ..surface(0.5, s, seed) };
    let first = MeshSampler::new(&a, &params([1.0, 0.0, 0.0], 1), None).unwrap();
    let second = MeshSampler::new(&b, &params([0.0, 1.0, 0.0], 2), None).unwrap();
    const LEVELS: u32 = 4000;
    let ensemble = render(&camera, &[&first, &second], LEVELS);
    let cosine = 1.0 / 1.25f64.sqrt();
    let one = 1.0 - 0.5f64.powf(1.0 / cosine);
    let found = bias(&ensemble, &|_, y| match y {
        // Rows at the border: rounding of a corner may put a particle into the next.
        7 | 24 => None,
        8..24 => Some(1.0 - (1.0 - one).powi(2)),
        _ => Some(0.0),
    });
    assert!(found.none(), "{found:?}");
    let layers = ensemble.read(&|_, _| [0.0; 3], None);
    let beauty = layers.rgb("beauty").unwrap();
    for (side, nearer) in [(4..12, 1), (20..28, 0)] {
        let pixels: Vec<[f32; 3]> =
            (10..22).flat_map(|y| side.clone().map(move |x| y * 32 + x)).map(|k: usize| beauty[k]).collect();
        let n = pixels.len() as f64;
        for (channel, expected) in [(nearer, one), (1 - nearer, one * (1.0 - one))] {
            let mean = pixels.iter().map(|p| f64::from(p[channel])).sum::<f64>() / n;
            let sigma = (expected * (1.0 - expected) / (n * f64::from(LEVELS))).sqrt();
            assert!((mean - expected).abs() < 4.0 * sigma, "{side:?} {channel}: {mean} for {expected} ± {sigma}");
        }
    }
}

#[test]
fn in_perspective_a_wall_has_one_opacity_at_every_depth() {
    // A floor that runs away from the camera, α facing 0.2: per crossing and as a thin slab.
    let camera = camera(Projection::Perspective { fov_y: 1.0 }, 3.0, [48, 48]);
    let mesh = rectangle(Vec3::new(0.0, -0.6, -5.0), Vec3::X * 8.0, Vec3::Z * 7.5, 8);
    let f = camera.focal_px();
    let row_of = |z: f64| 24.0 + f * 0.6 / z;
    for (surface_opacity, s) in [
        (SurfaceOpacity::ThinSlab, pixel_area(&camera, DVec3::new(0.0, -0.6, 1.8))),
        (SurfaceOpacity::PerCrossing, pixel_area(&camera, DVec3::new(0.0, -0.6, 1.8))),
        (SurfaceOpacity::ThinSlab, pixel_area(&camera, DVec3::new(0.0, -0.6, 1.0))),
    ] {
        let params = SurfaceParams { surface_opacity, ..surface(0.2, s, 3) };
        let sampler = MeshSampler::new(&mesh, &params, None).unwrap();
        let ensemble = render(&camera, &[&sampler], 400);
        let found = bias(&ensemble, &|x, y| {
            // The mean over the pixel of 1 − e^(−τ/cos) is not the opacity of its mean: τ/cos is smooth at these rows.
            if f64::from(y) < row_of(10.0) || f64::from(y) + 1.0 > row_of(1.6) {
                return None;
            }
            let n = 16;
            let mut hits = 0.0;
            for k in 0..n * n {
                let at = |v: u32, k: u32| f64::from(v) + (f64::from(k) + 0.5) / f64::from(n);
                let (_, d) = camera.view_ray(at(x, k % n), at(y, k / n));
                let cosine = (d.y / d.length()).abs();
                hits += if surface_opacity == SurfaceOpacity::ThinSlab { 1.0 / cosine } else { 1.0 };
            }
            Some(1.0 - 0.8f64.powf(hits / f64::from(n * n)))
        });
        assert!(found.none(), "{surface_opacity:?}: {found:?}");
    }
}

#[test]
fn volumes_obey_beers_law_in_any_projection() {
    // Value rises along the ray; extinction by a transfer function with a peak inside cells.
    let n = 5;
    let values = (0..n * n * n).map(|i| (i / (n * n)) as f32).collect();
    let grid = Grid { origin: DVec3::splat(-2.0), axes: DMat3::IDENTITY, dims: [n; 3], values };
    let point = |value, extinction| TransferPoint { value, color: [0.5; 3], extinction };
    let points = vec![point(0.0, 0.1), point(1.4, 0.9), point(2.0, 0.0), point(4.0, 0.4)];
    let transfer = TransferFunction::new(points).unwrap();
    // Half a voxel of each border beyond the lattice points.
    let column: f64 = 0.5 * 0.1 + 0.5 * (0.1 + 0.9) * 1.4 + 0.5 * 0.9 * 0.6 + 0.5 * 0.4 * 2.0 + 0.5 * 0.4;
    let camera_a = camera(Projection::Orthographic { height: 3.0 }, 6.0, [24, 24]);
    let params = |s, seed| VolumeParams { cross_section: s, seed, normals: true, ..VolumeParams::default() };
    let sampler = GridSampler::new(&grid, &transfer, &params(pixel_area(&camera_a, DVec3::Z), 1), None).unwrap();
    let found = bias(&render(&camera_a, &[&sampler], 600), &|_, _| Some(1.0 - (-column).exp()));
    assert!(found.none(), "{found:?}");
    // From outside in perspective, through both faces: the ray at a slope sees 1/cos times as much.
    let camera_b = camera(Projection::Perspective { fov_y: 0.35 }, 6.0, [24, 24]);
    let s = pixel_area(&camera_b, DVec3::Z);
    let sampler = GridSampler::new(&grid, &transfer, &params(s, 2), None).unwrap();
    let found = bias(&render(&camera_b, &[&sampler], 600), &|x, y| {
        let (_, d) = camera_b.view_ray(f64::from(x) + 0.5, f64::from(y) + 0.5);
        Some(1.0 - (-column * d.length()).exp())
    });
    assert!(found.none(), "{found:?}");
}

#[test]
fn splats_have_the_optical_depth_of_their_kernels() {
    let camera = front(40);
    let s = pixel_area(&camera, DVec3::Z);
    let footprint = Footprint::default();
    let radius = 0.9f32;
    let cloud_of = |kind, normal| {
        let mut cloud = Cloud::new(DVec3::ZERO);
        cloud.push(&Splat { radius, cross_section: 0.8, kind, normal, ..Splat::default() });
        cloud
    };
    // τ(ρ) averaged over the pixel; α of a pixel that falls off inside.
    let facing = |cosine: f64| {
        move |x: u32, y: u32| {
            let n = 8;
            let mut depth = 0.0;
            for k in 0..n * n {
                let at = |v: u32, k: u32| (f64::from(v) + (f64::from(k) + 0.5) / f64::from(n)) / 20.0 - 1.0;
                // On the disc the first coordinate is stretched.
                let u = at(x, k % n) / cosine;
                let v = at(y, k / n);
                depth += footprint.profile((u * u + v * v) / f64::from(radius * radius));
            }
            let depth = 0.8 * footprint.norm() / f64::from(radius * radius) * depth / f64::from(n * n);
            let alpha = 1.0 - (-depth).exp();
            (alpha > 1e-3 || alpha == 0.0).then_some(alpha)
        }
    };
    let tilted = Vec3::new(0.6, 0.0, 0.8);
    for (kind, normal, cosine) in
        [(SplatKind::Medium, Vec3::ZERO, 1.0), (SplatKind::Surface, Vec3::Z, 1.0), (SplatKind::Surface, tilted, 0.8)]
    {
        let cloud = cloud_of(kind, normal);
        let params = SplatParams { cross_section: s, ..SplatParams::default() };
        let sampler = SplatSampler::new(&cloud, &params).unwrap();
        let found = bias(&render(&camera, &[&sampler], 4000), &facing(cosine));
        assert!(found.none(), "{kind:?} {cosine}: {found:?}");
    }
}

#[test]
fn samplers_of_one_volume_agree() {
    // Extinction x in the unit cube: τ = x along z. Its last voxel reaches beyond what is seen.
    let values = (0..4 * 3 * 3).map(|i| (i % 4) as f32 / 3.0).collect();
    let grid = Grid {
        origin: DVec3::new(0.0, -1.0 / 3.0, -1.0 / 3.0),
        axes: DMat3::from_diagonal(DVec3::splat(1.0 / 3.0)),
        dims: [4, 3, 3],
        values,
    };
    let point = |value| TransferPoint { value, color: [0.5; 3], extinction: value };
    let transfer = TransferFunction::new(vec![point(0.0), point(1.0)]).unwrap();
    let camera = front(32);
    let s = pixel_area(&camera, DVec3::Z);
    let params = VolumeParams { cross_section: s, ..VolumeParams::default() };
    let cells = GridSampler::new(&grid, &transfer, &params, None).unwrap();
    let chains = MetropolisParams { particles_per_chain: 4, ..MetropolisParams::default() };
    let thinned = Density { field: &Field::Ramp, max: 2.0 };
    let even = Grid { values: vec![1.0; 36], ..grid.clone() };
    let even = MetropolisSampler::new(&even, &transfer, &params, &chains, Some(thinned)).unwrap();
    let chains = MetropolisSampler::new(&grid, &transfer, &params, &chains, None).unwrap();
    let ramp = Density { field: &Field::Ramp, max: 1.0 };
    let [low, high] = [DVec3::new(0.0, -0.5, -0.5), DVec3::new(1.0, 0.5, 0.5)];
    let field = FieldVolumeSampler::new(
        ramp,
        DAabb::new(low, high),
        &FieldVolumeParams { resolution: 6, cross_section: s, color: [1.0; 3], seed: 3 },
    )
    .unwrap();
    let samplers: [&dyn Sampler; 4] = [&cells, &chains, &even, &field];
    for (name, sampler) in ["cells", "chains", "chains, thinned", "field"].iter().zip(samplers) {
        let found = bias(&render(&camera, &[sampler], 1500), &|x, y| {
            // The mean of e^−x over a pixel of width w is e^−x·sinh(w/2)/(w/2): 4·10⁻⁵ beside the middle's.
            let at = |v: u32| (f64::from(v) + 0.5) / 16.0 - 1.0;
            Some(if at(x) > 0.0 && at(y).abs() < 0.5 { 1.0 - (-at(x)).exp() } else { 0.0 })
        });
        assert!(found.none(), "{name}: {found:?}");
    }
}

#[test]
fn a_density_field_multiplies_the_optical_depth() {
    let camera = front(32);
    let s = pixel_area(&camera, DVec3::Z);
    let mesh = rectangle(Vec3::ZERO, Vec3::X * 1.5, Vec3::Y * 1.5, 2);
    let density = Density { field: &Field::Ramp, max: 2.0 };
    let sampler = MeshSampler::new(&mesh, &surface(0.6, s, 1), Some(density)).unwrap();
    let found = bias(&render(&camera, &[&sampler], 1500), &|x, _| {
        let x = (f64::from(x) + 0.5) / 16.0 - 1.0;
        Some(1.0 - 0.4f64.powf(x.max(0.0)))
    });
    assert!(found.none(), "{found:?}");
}
