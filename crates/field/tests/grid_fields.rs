//! Isosurfaces of volumes as fields: exactness, derivatives, borders, bounds.

use field::{GridField, Inside};
use splat_core::glam::{DMat3, DVec3};
use splat_core::{Grid, Interpolation, ScalarField, rng};
use std::sync::Arc;

const BOTH: [Interpolation; 2] = [Interpolation::Trilinear, Interpolation::CatmullRom];

fn noise(dims: [usize; 3], seed: u64) -> Grid {
    let n = dims[0] * dims[1] * dims[2];
    let values = (0..n).map(|i| 2.0 * rng::unit_f32(seed, 0, i as u64, 0) - 1.0).collect();
    Grid { origin: DVec3::ZERO, axes: DMat3::IDENTITY, dims, values }
}

fn sampled(dims: [usize; 3], f: impl Fn(DVec3) -> f64) -> Grid {
    let mut grid = noise(dims, 0);
    for (n, v) in grid.values.iter_mut().enumerate() {
        let at = [n % dims[0], n / dims[0] % dims[1], n / dims[0] / dims[1]];
        *v = f(DVec3::from_array(at.map(|i| i as f64))) as f32;
    }
    grid
}

fn field(grid: &Grid, interpolation: Interpolation) -> GridField {
    GridField::new(Arc::new(grid.clone()), interpolation, 0.0, Inside::Below).unwrap()
}

fn sheared() -> DMat3 {
    DMat3::from_cols(DVec3::new(0.5, 0.25, 0.0), DVec3::new(-0.25, 1.0, 0.5), DVec3::new(0.125, 0.0, -0.75))
}

/// A place in the lattice by three random numbers, object space.
fn place(grid: &Grid, i: u64) -> DVec3 {
    let u = DVec3::from_array([0, 1, 2].map(|a| rng::unit(5, 1, i, a as u64) * (grid.dims[a] - 1) as f64));
    grid.origin + grid.axes * u
}

#[test]
fn linear_fields_are_exact_up_to_the_border_on_any_lattice() {
    let slope = DVec3::new(0.5, -2.0, 3.0);
    for interpolation in BOTH {
        let mut grid = sampled([5, 4, 2], |u| sheared().mul_vec3(u).dot(slope));
        grid.axes = sheared();
        let f = field(&grid, interpolation);
        for i in 0..200 {
            let p = place(&grid, i);
            assert!((f.value(p) - p.dot(slope)).abs() < 1e-12 && f.in_domain(p));
            assert!((f.gradient(p) - slope).length() < 1e-12, "{}", f.gradient(p));
            assert!(f.hessian(p).to_cols_array().iter().all(|h| h.abs() < 1e-11));
        }
    }
}

#[test]
fn catmull_rom_reproduces_quadratics_away_from_the_border() {
    let f = |u: DVec3| u.x * u.x - 2.0 * u.y * u.z + 0.5 * u.z * u.z - u.x * u.y + 3.0;
    let hessian = DMat3::from_cols(DVec3::new(2.0, -1.0, 0.0), DVec3::new(-1.0, 0.0, -2.0), DVec3::new(0.0, -2.0, 1.0));
    let cubic = field(&sampled([7; 3], f), Interpolation::CatmullRom);
    let linear = field(&sampled([7; 3], f), BOTH[0]);
    let mut worst = 0.0f64;
    for i in 0..200 {
        let p = DVec3::from_array([0, 1, 2].map(|a| 1.0 + 4.0 * rng::unit(6, 0, i, a)));
        let gradient = DVec3::new(2.0 * p.x - p.y, -2.0 * p.z - p.x, p.z - 2.0 * p.y);
        assert!((cubic.value(p) - f(p)).abs() < 1e-12);
        assert!((cubic.gradient(p) - gradient).length() < 1e-12);
        assert!((cubic.hessian(p) - hessian).to_cols_array().iter().all(|h| h.abs() < 1e-11));
        worst = worst.max((linear.value(p) - f(p)).abs());
    }
    assert!(worst > 0.1, "trilinear would pass too");
    // Lattice points keep their values.
    assert_eq!(linear.value(DVec3::new(3.0, 2.0, 6.0)), f(DVec3::new(3.0, 2.0, 6.0)));
}

#[test]
fn derivatives_agree_with_finite_differences() {
    let h = 1e-5;
    for interpolation in BOTH {
        let mut grid = noise([6, 5, 4], 2);
        grid.axes = sheared();
        let f = field(&grid, interpolation);
        for i in 0..300 {
            let p = place(&grid, i);
            let u = f.grid().axes.inverse() * p;
            // Not across a face, where trilinear gradients and Catmull-Rom Hessians jump.
            if (u - u.round()).abs().min_element() < 10.0 * h {
                continue;
            }
            let (value, gradient) = f.value_gradient(p);
            assert_eq!((value, gradient), (f.value(p), f.gradient(p)));
            let hessian = f.hessian(p);
            for a in 0..3 {
                let d = DVec3::AXES[a] * h;
                let slope = (f.value(p + d) - f.value(p - d)) / (2.0 * h);
                assert!((slope - gradient[a]).abs() < 1e-6, "{slope} {gradient}");
                let bend = (f.gradient(p + d) - f.gradient(p - d)) / (2.0 * h);
                assert!((bend - hessian.col(a)).length() < 1e-5, "{bend} {}", hessian.col(a));
            }
        }
    }
}

#[test]
fn beyond_the_lattice_the_value_stays_and_there_is_no_surface() {
    for interpolation in BOTH {
        let f = field(&noise([4, 4, 4], 3), interpolation);
        let inside = DVec3::new(3.0, 1.3, 0.4);
        let outside = DVec3::new(7.0, 1.3, 0.4);
        assert_eq!(f.value(inside), f.value(outside));
        assert!(f.in_domain(inside) && !f.in_domain(outside));
        let g = f.gradient(outside);
        let at = f.gradient(inside);
        assert_eq!(g, DVec3::new(0.0, at.y, at.z));
        assert_eq!(f.hessian(outside).x_axis, DVec3::ZERO);
        let (low, high) = f.bound(outside, 0.25).unwrap();
        assert!(low <= f.value(outside) && f.value(outside) <= high && high - low < 1.5);
    }
}

/// Checks bounds of a volume's isosurfaces through the middles of balls against values in the balls; returns the mean
/// width of bounds over that of values.
fn check_bounds(f: &GridField, sizes: [f64; 2], balls: u64) -> f64 {
    let mut width = 0.0;
    let mut spread = 0.0;
    for i in 0..balls {
        let center = place(f.grid(), i);
        let radius = sizes[0] + (sizes[1] - sizes[0]) * rng::unit(7, 0, i, 0);
        let f = f.with_isovalue(f.value(center), Inside::Below).unwrap();
        let (low, high) = f.bound(center, radius).unwrap();
        let mut least = f64::INFINITY;
        let mut most = f64::NEG_INFINITY;
        for j in 0..100 {
            let d = DVec3::from_array([0, 1, 2].map(|a| 2.0 * rng::unit(8, i, j, a) - 1.0));
            let v = f.value(center + d.normalize() * (radius * rng::unit(8, i, j, 3).cbrt()));
            assert!(low <= v && v <= high, "{v} outside {low}..{high} at {center}, {radius}");
            (least, most) = (least.min(v), most.max(v));
        }
        (width, spread) = (width + (high - low), spread + (most - least));
    }
    width / spread
}

#[test]
fn bounds_contain_every_value_and_are_not_loose() {
    for (interpolation, loosest) in [(BOTH[0], [2.2, 1.6]), (BOTH[1], [2.2, 1.6])] {
        let mut grid = sampled([24, 20, 17], |u| (0.4 * u.x).sin() + (0.3 * u.y).cos() * (0.5 * u.z).sin());
        let upright = field(&grid, interpolation);
        let ratios = [check_bounds(&upright, [0.001, 0.3], 200), check_bounds(&upright, [0.3, 12.0], 200)];
        println!("{interpolation:?}: bounds over spreads of small and of large balls {ratios:?}");
        assert!(ratios[0] < loosest[0] && ratios[1] < loosest[1], "{ratios:?}");
        grid.axes = sheared();
        check_bounds(&field(&grid, interpolation), [0.01, 5.0], 200);
        check_bounds(&field(&noise([9, 8, 7], 4), interpolation), [0.01, 3.0], 300);
    }
}

#[test]
fn bounds_of_shrinking_balls_close_onto_the_value() {
    for interpolation in BOTH {
        let f = field(&noise([9, 8, 7], 4), interpolation);
        for i in 0..50 {
            let p = place(f.grid(), i);
            // The isovalue of the place itself: nothing may be excluded.
            let f = f.with_isovalue(f.value(p), Inside::Above).unwrap();
            let (low, high) = f.bound(p, 1e-5).unwrap();
            assert!(low <= 0.0 && high >= 0.0 && high - low < 1e-3, "{low} {high}");
        }
    }
}

#[test]
fn orientation_and_isovalue_turn_and_shift() {
    let grid = Arc::new(noise([4; 3], 9));
    let below = GridField::new(grid.clone(), Interpolation::CatmullRom, 0.25, Inside::Below).unwrap();
    let above = below.with_isovalue(0.25, Inside::Above).unwrap();
    let p = DVec3::new(1.2, 0.7, 2.9);
    assert_eq!(below.value(p), field(&grid, Interpolation::CatmullRom).value(p) - 0.25);
    assert_eq!(below.value(p), -above.value(p));
    assert_eq!(below.gradient(p), -above.gradient(p));
    let (low, high) = below.bound(p, 0.5).unwrap();
    assert_eq!(above.bound(p, 0.5).unwrap(), (-high, -low));
}

#[test]
fn far_away_is_like_here_and_scaling_by_two_scales_exactly() {
    for interpolation in BOTH {
        let mut grid = noise([6; 3], 12);
        grid.axes = sheared();
        let f = field(&grid, interpolation);
        let mut far = grid.clone();
        far.origin = DVec3::new(1e7, -1e7, 2e7);
        let mut large = grid.clone();
        large.axes *= 1024.0;
        let far = field(&far, interpolation);
        let large = field(&large, interpolation);
        for i in 0..100 {
            let p = place(&grid, i);
            // Places that survive the shift without rounding.
            let p = (p * 4096.0).round() / 4096.0;
            let q = p + DVec3::new(1e7, -1e7, 2e7);
            assert_eq!(f.value_gradient(p), far.value_gradient(q));
            let a = f.bound(p, 0.25).unwrap();
            let b = far.bound(q, 0.25).unwrap();
            assert!((a.0 - b.0).abs() < 1e-6 && (a.1 - b.1).abs() < 1e-6, "{a:?} {b:?}");
            assert_eq!(f.value(p), large.value(p * 1024.0));
            assert_eq!(f.gradient(p), large.gradient(p * 1024.0) * 1024.0);
            assert_eq!(f.bound(p, 0.3), large.bound(p * 1024.0, 0.3 * 1024.0));
        }
    }
}

#[test]
fn single_voxels_slices_and_pairs_are_fields_too() {
    for interpolation in BOTH {
        for dims in [[1, 1, 1], [5, 4, 1], [1, 4, 5], [2, 2, 2], [3, 1, 2]] {
            let grid = noise(dims, 13);
            let f = field(&grid, interpolation);
            assert_eq!(f.bounds().max, DVec3::from_array(dims.map(|n| (n - 1) as f64)));
            let p = place(&grid, 1);
            assert!(f.value(p).is_finite() && f.in_domain(p));
            for a in (0..3).filter(|a| dims[*a] == 1) {
                assert_eq!(f.gradient(p)[a], 0.0);
                assert_eq!(f.hessian(p).col(a), DVec3::ZERO);
                assert_eq!(f.value(p + DVec3::AXES[a]), f.value(p));
            }
            check_bounds(&f, [0.05, 3.0], 40);
        }
    }
}

#[test]
fn what_is_no_volume_is_refused() {
    let new = |grid: Grid, c: f64| GridField::new(Arc::new(grid), Interpolation::Trilinear, c, Inside::Above);
    let mut bad = noise([3; 3], 1);
    bad.values[4] = f32::NAN;
    assert!(new(bad, 0.0).unwrap_err().to_string().contains("voxel 4"));
    let flat = Grid { axes: DMat3::from_diagonal(DVec3::new(1.0, 1.0, 0.0)), ..noise([3; 3], 1) };
    assert!(new(flat, 0.0).is_err());
    assert!(new(Grid { values: Vec::new(), ..noise([3; 3], 1) }, 0.0).is_err());
    assert!(new(noise([3; 3], 1), f64::NAN).unwrap_err().to_string().contains("isovalue"));
    assert!(field(&noise([3; 3], 1), BOTH[1]).bound(DVec3::NAN, 1.0).is_none());
}
