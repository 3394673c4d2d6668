//! A volume fills its voxels: n lattice points along an axis span n steps, whatever their lengths and directions.

use crate::common::*;
use pbsr::{GridSampler, MetropolisParams, MetropolisSampler, Sampler, VolumeParams, pixel_area};
use splat_core::glam::{DMat3, DVec3};
use splat_core::{Camera, Grid, Projection, TransferFunction, TransferPoint};

/// Extinction of the homogeneous volumes, 1/unit.
const EXTINCTION: f32 = 1.25;

fn homogeneous(axes: DMat3, dims: [usize; 3]) -> Grid {
    let middle = axes * DVec3::from_array(dims.map(|n| (n - 1) as f64 / 2.0));
    Grid { origin: -middle, axes, dims, values: vec![1.0; dims.iter().product()] }
}

fn transfer() -> TransferFunction {
    let point = |value, extinction| TransferPoint { value, color: [0.5; 3], extinction };
    TransferFunction::new(vec![point(0.0, 0.0), point(1.0, EXTINCTION)]).unwrap()
}

/// Length of a ray within the voxels of a grid, and steps of it around them.
fn length_within(grid: &Grid, around: f64, (origin, direction): (DVec3, DVec3)) -> f64 {
    let index = grid.axes.inverse();
    let o = index * (origin - grid.origin);
    let d = index * direction;
    let mut from = 0.0;
    let mut to = f64::INFINITY;
    for a in 0..3 {
        let sides = [-0.5 - around, grid.dims[a] as f64 - 0.5 + around];
        let [near, far] = sides.map(|side| (side - o[a]) / d[a]);
        if d[a] != 0.0 {
            (from, to) = (near.min(far).max(from), near.max(far).min(to));
        } else if o[a] < sides[0] || o[a] > sides[1] {
            return 0.0;
        }
    }
    (to - from).max(0.0) * direction.length()
}

/// Lattices of equal steps, of unequal and skewed ones, and one that is a single layer.
fn lattices() -> [Grid; 3] {
    let skewed =
        DMat3::from_cols(DVec3::new(0.2, 0.0, 0.02), DVec3::new(0.06, 0.17, 0.0), DVec3::new(-0.04, 0.03, 0.3));
    [
        homogeneous(DMat3::from_diagonal(DVec3::splat(0.2)), [8; 3]),
        homogeneous(skewed, [5, 7, 3]),
        homogeneous(skewed, [6, 1, 2]),
    ]
}

fn samplers<'a>(grid: &'a Grid, transfer: &'a TransferFunction, params: &VolumeParams) -> [Box<dyn Sampler + 'a>; 2] {
    // The density is constant, so that chains forget soon where they began.
    let chains = MetropolisParams { particles_per_chain: 1, burn_in: 48, stride: 1 };
    [
        Box::new(GridSampler::new(grid, transfer, params, None).unwrap()),
        Box::new(MetropolisSampler::new(grid, transfer, params, &chains, None).unwrap()),
    ]
}

#[test]
fn particles_are_uniform_in_the_voxels() {
    let transfer = transfer();
    for (g, grid) in lattices().iter().enumerate() {
        let params = VolumeParams { cross_section: 2e-5, ..VolumeParams::default() };
        for (s, sampler) in samplers(grid, &transfer, &params).iter().enumerate() {
            let index = grid.axes.inverse();
            let dims = DVec3::from_array(grid.dims.map(|n| n as f64));
            let mut bins = [[0u64; 24]; 3];
            let places = positions(sampler.as_ref(), 5);
            for p in &places {
                let at = (index * (*p - grid.origin) + 0.5) / dims;
                assert!(at.min_element() > -1e-5 && at.max_element() < 1.0 + 1e-5, "lattice {g}, sampler {s}: {at}");
                (0..3).for_each(|a| bins[a][((at[a] * 24.0) as usize).min(23)] += 1);
            }
            for (axis, bins) in bins.iter().enumerate() {
                let chi2 = chi2_equal(bins);
                assert!(chi2 < chi2_limit(23.0), "lattice {g}, sampler {s}, axis {axis}: χ² {chi2}");
            }
            let volume = grid.cell_volume() * dims.element_product();
            let expected = volume * f64::from(EXTINCTION) / params.cross_section;
            let off = (places.len() as f64 - expected) / expected.sqrt();
            assert!(off.abs() < 4.0, "lattice {g}, sampler {s}: {} particles for {expected}", places.len());
        }
    }
}

/// What takes long and rarely fails where the others hold: `cargo xtask deep`.
mod deep {
    use super::*;

    #[test]
    fn a_homogeneous_volume_has_the_optical_depth_of_its_voxels_on_every_ray() {
        let transfer = transfer();
        let askew = Camera::look_at(
            DVec3::new(2.0, 1.0, 3.0),
            DVec3::ZERO,
            DVec3::Y,
            Projection::Orthographic { height: 2.4 },
            [40, 40],
        );
        let cameras = [front(40), askew.unwrap()];
        for (g, grid) in lattices().iter().enumerate() {
            for (c, camera) in cameras.iter().enumerate() {
                let params = VolumeParams { cross_section: pixel_area(camera, DVec3::Z), ..VolumeParams::default() };
                for (s, sampler) in samplers(grid, &transfer, &params).iter().enumerate() {
                    let found = bias(&render(camera, &[sampler.as_ref()], 400), &|x, y| {
                        // A pixel is hit unless none of its particles is there: the mean over the pixel of the length counts.
                        const N: u32 = 24;
                        let at = |v: u32, k: u32| f64::from(v) + (f64::from(k) + 0.5) / f64::from(N);
                        let ray = |k| camera.view_ray(at(x, k % N), at(y, k / N));
                        let world = |v: DVec3| camera.axes[0] * v.x + camera.axes[1] * v.y + camera.axes[2] * v.z;
                        let ray = |k| {
                            let (origin, direction) = ray(k);
                            (camera.position + world(origin), world(direction))
                        };
                        let mean = |around| (0..N * N).map(|k| length_within(grid, around, ray(k))).sum::<f64>();
                        let [length, around] = [0.0, 0.01].map(|around| mean(around) / f64::from(N * N));
                        // Not where the border goes through a corner of the pixel.
                        (around == 0.0 || length > 1e-3).then(|| 1.0 - (-length * f64::from(EXTINCTION)).exp())
                    });
                    assert!(found.none(), "lattice {g}, camera {c}, sampler {s}: {found:?}");
                }
            }
        }
    }

    #[test]
    fn eight_voxels_along_a_ray_have_eight_voxels_of_optical_depth() {
        let camera = front(40);
        let transfer = transfer();
        let [grid, ..] = lattices();
        let params = VolumeParams { cross_section: pixel_area(&camera, DVec3::Z), ..VolumeParams::default() };
        for (s, sampler) in samplers(&grid, &transfer, &params).iter().enumerate() {
            let ensemble = render(&camera, &[sampler.as_ref()], 400);
            let pixels = || (4..36).flat_map(|y| (4..36).map(move |x| (x, y)));
            let hits: f64 = pixels().map(|(x, y)| f64::from(ensemble.hits(x, y))).sum();
            let rays = pixels().count() as f64 * 400.0;
            let found = -(1.0 - hits / rays).ln();
            let expected = 8.0 * 0.2 * f64::from(EXTINCTION);
            // d τ = d α / (1 − α), of a binomial variable.
            let sigma = (expected.exp_m1() / rays).sqrt();
            assert!((found - expected).abs() < 4.0 * sigma, "sampler {s}: τ = {found} for {expected} ± {sigma}");
        }
    }
}
