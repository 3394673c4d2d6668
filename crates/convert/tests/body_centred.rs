//! Cartesian lattices on body-centred ones.

use convert::{ConvertError, SplatParams, body_centred};
use splat_core::glam::{DMat3, DVec3};
use splat_core::{BccGrid, Grid, Limits};

fn sampled(dims: [usize; 3], axes: DMat3, field: impl Fn(DVec3) -> f64) -> Grid {
    let [nx, ny, _] = dims;
    let mut grid = Grid { origin: DVec3::new(0.3, -2.0, 5.0), axes, dims, values: Vec::new() };
    let count: usize = dims.iter().product();
    let values = (0..count).map(|n| field(grid.position(n % nx, n / nx % ny, n / (nx * ny))) as f32).collect();
    grid.values = values;
    grid
}

/// Every value with its place.
fn points(bcc: &BccGrid) -> impl Iterator<Item = (DVec3, f64)> + '_ {
    let [nx, ny, _] = bcc.planes.dims;
    let place = move |n: usize| bcc.position(n % nx, n / nx % ny, n / (nx * ny));
    bcc.planes.values.iter().enumerate().map(move |(n, value)| (place(n), f64::from(*value)))
}

#[test]
fn constants_and_linear_fields_are_exact_on_any_lattice() {
    let sheared = DMat3::from_cols(DVec3::new(0.5, 0.1, 0.0), DVec3::new(0.2, 0.6, -0.1), DVec3::new(-0.1, 0.1, -0.7));
    for axes in [DMat3::from_diagonal(DVec3::new(1.0, 1.0, 2.5)), sheared] {
        for dims in [[34, 20, 17], [5, 3, 1], [1, 2, 30]] {
            let constant = body_centred(&sampled(dims, axes, |_| 1234.567), &SplatParams::default()).unwrap();
            assert!(constant.planes.values.iter().all(|v| *v == 1234.567), "{dims:?}");
        }
        let linear = |p: DVec3| 3.0 + p.dot(DVec3::new(0.7, -0.4, 0.2));
        let bcc = body_centred(&sampled([34, 20, 17], axes, linear), &SplatParams::default()).unwrap();
        let worst = points(&bcc).map(|(p, v)| (v - linear(p)).abs()).fold(0.0, f64::max);
        // Values are rounded to f32, before and behind.
        assert!(worst < 1e-5, "{worst:e}");
        // Both fill the same place.
        let volume = |g: &Grid| g.cell_volume() * g.values.len() as f64;
        let whole = axes.determinant().abs() * 34.0 * 20.0 * 17.0;
        assert!((volume(&bcc.planes) / whole - 1.0).abs() < 1e-12);
        let middle = |g: &Grid, shift: f64| {
            let [i, j, k] = g.dims.map(|n| 0.5 * (n as f64 - 1.0));
            g.origin + g.axes * DVec3::new(i + shift, j + shift, k)
        };
        let cartesian = sampled([34, 20, 17], axes, |_| 0.0);
        assert!(middle(&bcc.planes, 0.25).distance(middle(&cartesian, 0.0)) < 1e-12);
    }
}

#[test]
fn waves_that_both_lattices_hold_are_kept() {
    // Along an axis, a face's diagonal and a cell's, of 4 and of 3 spacings.
    let wave = |length: f64| {
        move |p: DVec3| {
            let along = [DVec3::X, DVec3::new(0.0, 1.0, 1.0).normalize(), DVec3::ONE.normalize()];
            along.map(|d| (std::f64::consts::TAU * d.dot(p) / length).cos()).iter().sum::<f64>() / 3.0
        }
    };
    for (length, limit) in [(4.0, 0.005), (3.0, 0.08)] {
        let bcc = body_centred(&sampled([41; 3], DMat3::IDENTITY, wave(length)), &SplatParams::default()).unwrap();
        let inside =
            |p: DVec3| (p - bcc.planes.origin).min_element() > 7.0 && (p - bcc.planes.origin).max_element() < 33.0;
        let off = points(&bcc).filter(|(p, _)| inside(*p)).map(|(p, v)| (v - wave(length)(p)).abs());
        let worst = off.fold(0.0, f64::max);
        assert!(worst < limit && worst > 1e-6, "{length}: {worst}");
    }
}

#[test]
fn any_number_of_threads_gives_the_same_bits_and_limits_hold() {
    let grid = sampled([23, 19, 17], DMat3::IDENTITY, |p| (1.3 * p.x).sin() * p.y + (0.9 * p.z).cos());
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| body_centred(&grid, &SplatParams::default()).unwrap())
    };
    let one = with(1);
    for threads in [2, 3, 7] {
        assert_eq!(with(threads), one, "{threads} threads");
    }
    let limits = Limits { max_elements: 100, ..Limits::default() };
    let refused = body_centred(&grid, &SplatParams { limits, ..SplatParams::default() });
    assert!(matches!(refused, Err(ConvertError::Limit { .. })), "{refused:?}");
    let refused = body_centred(&Grid { dims: [1; 3], ..grid.clone() }, &SplatParams::default());
    assert!(matches!(refused, Err(ConvertError::Input { .. })), "{refused:?}");
}
