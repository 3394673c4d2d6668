//! Volumes become splats: hard cases CV7-CV9, conserved extinction, gradients, invariances.

use convert::{ConvertError, SplatParams, VolumeParams, reference, sobel_gradient, volume_to_points};
use splat_core::glam::{DMat3, DQuat, DVec3, Vec3};
use splat_core::{Clip, DAabb, Exceeded, Footprint, Grid, Similarity, TransferFunction, TransferPoint, rng};

fn grid(dims: [usize; 3], steps: DVec3, value: impl Fn(usize, usize, usize) -> f32) -> Grid {
    let values = (0..dims[0] * dims[1] * dims[2])
        .map(|n| value(n % dims[0], n / dims[0] % dims[1], n / dims[0] / dims[1]))
        .collect();
    Grid { origin: DVec3::ZERO, axes: DMat3::from_diagonal(steps), dims, values }
}

fn ramp(low: f32, high: f32, extinction: f32) -> TransferFunction {
    let point = |value, extinction| TransferPoint { value, color: [0.5; 3], extinction };
    TransferFunction::new(vec![point(low, 0.0), point(high, extinction)]).unwrap()
}

#[test]
fn cv07_linear_fields_have_exact_gradients_on_top_of_any_offset() {
    for offset in [0.0f32, 1e6] {
        let linear = |i: usize, j: usize, k: usize| offset + 0.0625 * i as f32 - 0.125 * j as f32 + 0.25 * k as f32;
        let grid = grid([9, 7, 5], DVec3::new(0.5, 1.0, 2.0), linear);
        let expected = Vec3::new(0.125, -0.125, 0.125);
        for g in sobel_gradient(&grid) {
            assert!((g - expected).length() < 1e-6, "offset {offset}: {g}");
        }
    }
}

#[test]
fn cv07_sheared_and_mirrored_lattices_map_gradients_to_space() {
    let axes = DMat3::from_cols(DVec3::new(-0.5, 0.0, 0.0), DVec3::new(0.25, 1.0, 0.0), DVec3::new(0.0, 0.5, 2.0));
    let slope = DVec3::new(3.0, -2.0, 1.0);
    let mut grid = grid([6, 5, 4], DVec3::ONE, |_, _, _| 0.0);
    grid.axes = axes;
    for n in 0..grid.values.len() {
        let p = grid.position(n % 6, n / 6 % 5, n / 30);
        grid.values[n] = slope.dot(p) as f32;
    }
    for g in sobel_gradient(&grid) {
        assert!((g.as_dvec3() - slope).length() < 1e-5, "{g}");
    }
}

#[test]
fn sobel_agrees_with_its_reference() {
    for dims in [[17, 6, 5], [1, 4, 3], [5, 1, 1], [2, 2, 2]] {
        let noisy = |i: usize, j: usize, k: usize| rng::unit_f32(1, i as u64, j as u64, k as u64);
        let grid = grid(dims, DVec3::new(1.0, 0.5, 2.0), noisy);
        for (n, g) in sobel_gradient(&grid).into_iter().enumerate() {
            let r = reference::sobel(&grid, n % dims[0], n / dims[0] % dims[1], n / dims[0] / dims[1]);
            assert!((g - r).length() < 1e-5, "{dims:?} {n}: {g} {r}");
        }
    }
}

#[test]
fn cv08_constant_volumes_and_empty_slices_have_no_normals_and_no_nan() {
    let params = VolumeParams { normals: true, values: true, ..VolumeParams::default() };
    let constant = grid([8, 8, 8], DVec3::ONE, |_, _, _| 3.0);
    let (cloud, report) = volume_to_points(&constant, &ramp(0.0, 3.0, 1.0), &params, None).unwrap();
    assert_eq!((report.splats, report.without_normal), (512, 512));
    assert!(cloud.normal.iter().all(|n| *n == Vec3::ZERO));
    assert_eq!(cloud.value, vec![3.0; 512]);
    cloud.validate().unwrap();
    let slices = grid([8, 8, 8], DVec3::ONE, |_, _, k| if k == 3 { 1.0 } else { 0.0 });
    let (cloud, report) = volume_to_points(&slices, &ramp(0.0, 1.0, 1.0), &params, None).unwrap();
    cloud.validate().unwrap();
    assert_eq!(report.splats, 64);
}

#[test]
fn cv09_absurd_lattices_are_refused() {
    let small = grid([2, 2, 2], DVec3::ONE, |_, _, _| 1.0);
    let named = SplatParams { object_name: "ct".into(), ..SplatParams::default() };
    let params = VolumeParams { splat: named, refine: 65536, ..VolumeParams::default() };
    let error = volume_to_points(&small, &ramp(0.0, 1.0, 1.0), &params, None).unwrap_err();
    assert!(matches!(error, ConvertError::Limit(Exceeded { unit: "lattice points", .. })), "{error}");
    assert!(error.to_string().contains("ct"));
    // A needle lattice would be split a million times along two axes.
    let needle = grid([2, 2, 2], DVec3::new(1e-9, 1.0, 1.0), |_, _, _| 1.0);
    assert!(volume_to_points(&needle, &ramp(0.0, 1.0, 1.0), &VolumeParams::default(), None).is_err());
    let lying = Grid { dims: [2048, 2048, 2048], ..small };
    assert!(matches!(
        volume_to_points(&lying, &ramp(0.0, 1.0, 1.0), &VolumeParams::default(), None),
        Err(ConvertError::Input { .. })
    ));
}

#[test]
fn cross_sections_of_a_homogeneous_box_sum_to_extinction_times_volume() {
    for steps in [DVec3::splat(0.5), DVec3::new(0.7, 0.7, 2.5), DVec3::new(3.0, 1.0, 0.4)] {
        for refine in [1, 2] {
            let box_grid = grid([6, 5, 4], steps, |_, _, _| 1.0);
            let mut params = VolumeParams { refine, ..VolumeParams::default() };
            params.splat.transform.scale = 2.0;
            let (cloud, _) = volume_to_points(&box_grid, &ramp(0.0, 1.0, 0.3), &params, None).unwrap();
            let sum: f64 = cloud.cross_section.iter().map(|k| f64::from(*k)).sum();
            let exact = f64::from(0.3f32) * 120.0 * box_grid.cell_volume() * 8.0;
            assert!((sum / exact - 1.0).abs() < 1e-6, "{steps} {refine}: {sum} {exact}");
        }
    }
}

#[test]
fn kernels_of_uneven_lattices_sum_to_a_homogeneous_medium() {
    let uneven = grid([24, 24, 12], DVec3::new(1.0, 1.0, 2.6), |_, _, _| 1.0);
    let (cloud, report) = volume_to_points(&uneven, &ramp(0.0, 1.0, 0.1), &VolumeParams::default(), None).unwrap();
    assert_eq!(report.lattice_points, 24 * 24 * 36);
    let exact = 0.1 * 24.0;
    for n in 0..64 {
        let p = DVec3::new(0.0, 11.0 + f64::from(n % 8) / 8.0, 12.0 + f64::from(n / 8) / 3.0);
        let depth = reference::line_depth(&cloud, Footprint::default(), p, DVec3::X);
        assert!((depth / exact - 1.0).abs() < 1e-3, "{p}: {depth}");
    }
}

#[test]
fn thin_voxels_may_be_left_out_within_the_bound() {
    let fading = grid([20, 20, 20], DVec3::ONE, |i, _, _| 0.5f32.powi(i as i32));
    let tf = ramp(0.0, 1.0, 1.0);
    let (all, _) = volume_to_points(&fading, &tf, &VolumeParams::default(), None).unwrap();
    let params = VolumeParams { omitted_optical_depth: 0.01, ..VolumeParams::default() };
    let (some, report) = volume_to_points(&fading, &tf, &params, None).unwrap();
    assert!(report.omitted > 0 && report.omitted + report.splats == 8000);
    assert!(report.omitted_optical_depth > 0.0 && report.omitted_optical_depth <= 0.01);
    for i in 0..20 {
        let p = DVec3::new(f64::from(i), 10.0, 10.0);
        let [a, b] = [&all, &some].map(|c| reference::line_depth(c, Footprint::default(), p, DVec3::Z));
        assert!((a - b).abs() <= report.omitted_optical_depth * 1.001, "{a} {b}");
    }
}

#[test]
fn normals_point_to_lower_values_and_turn_with_the_transform() {
    let ball = |i: usize, j: usize, k: usize| {
        10.0 - (DVec3::new(i as f64, j as f64, k as f64) - DVec3::splat(8.0)).length() as f32
    };
    let mut params = VolumeParams { normals: true, ..VolumeParams::default() };
    params.splat.transform =
        Similarity { rotation: DQuat::from_rotation_y(0.7), translation: DVec3::splat(1e7), ..Similarity::default() };
    let (cloud, _) = volume_to_points(&grid([17; 3], DVec3::ONE, ball), &ramp(0.0, 10.0, 1.0), &params, None).unwrap();
    let middle = (params.splat.transform.rotation * DVec3::splat(8.0)).as_vec3();
    for i in 0..cloud.len() {
        let out = cloud.position[i] - middle;
        if out.length() > 3.0 {
            assert!(cloud.normal[i].dot(out.normalize()) > 0.99, "{}", cloud.position[i]);
        }
    }
    cloud.validate().unwrap();
}

#[test]
fn a_clip_box_keeps_what_lies_inside_to_the_part_of_a_cell() {
    let params = VolumeParams {
        clip: vec![Clip::Box(DAabb::new(DVec3::splat(1.5), DVec3::splat(4.0)))],
        ..VolumeParams::default()
    };
    let (cloud, _) =
        volume_to_points(&grid([8; 3], DVec3::ONE, |_, _, _| 1.0), &ramp(0.0, 1.0, 1.0), &params, None).unwrap();
    assert_eq!(cloud.len(), 27);
    // Of the last cells half a step is kept: 2.5³ of extinction 1.
    assert_eq!(cloud.cross_section.iter().sum::<f32>(), 15.625);
}

#[test]
fn x1_any_number_of_threads_gives_the_same_bits() {
    let noisy = grid([33, 29, 31], DVec3::new(1.0, 1.0, 1.8), |i, j, k| rng::unit_f32(2, i as u64, j as u64, k as u64));
    let params = VolumeParams { normals: true, values: true, ..VolumeParams::default() };
    let run = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| volume_to_points(&noisy, &ramp(0.4, 1.0, 1.0), &params, None).unwrap())
    };
    let one = run(1);
    for threads in [2, 3, 7] {
        assert!(run(threads) == one, "{threads} threads");
    }
}

/// A sheet thinner than a cell, askew in its volume: the value is the distance from a plane, extinction a peak of ½ to 2
/// steps. Every line along z has the optical depth ∫ σ(n·x) dz = w·σ/n_z. Taken at voxels alone, depths stray by more than
/// a third of it in sheets of ½ a step.
#[test]
fn thin_oblique_sheets_have_no_moire() {
    for normal in [DVec3::new(0.1, 0.03, 1.0), DVec3::new(0.3, 0.1, 0.95), DVec3::new(1.0, 1.0, 1.05)] {
        let normal = normal.normalize();
        let middle = DVec3::new(11.5, 11.5, 15.5);
        let value = |i: usize, j: usize, k: usize| normal.dot(DVec3::new(i as f64, j as f64, k as f64) - middle) as f32;
        let sheet = grid([24, 24, 32], DVec3::ONE, value);
        for width in [0.25f32, 0.5, 1.0] {
            let point = |value, extinction| TransferPoint { value, color: [0.2, 0.4, 0.8], extinction };
            let tf = TransferFunction::new(vec![point(-width, 0.0), point(0.0, 2.0), point(width, 0.0)]).unwrap();
            let exact = 2.0 * f64::from(width) / normal.z;
            let worst = |params: &VolumeParams| {
                let (cloud, _) = volume_to_points(&sheet, &tf, params, None).unwrap();
                assert!(cloud.color.iter().all(|c| (c[2] - 0.8).abs() < 1e-6));
                let places = (0..100).map(|n| DVec3::new(f64::from(n % 10), f64::from(n / 10), 0.0) * 0.57);
                let depths = places.map(|p| {
                    let p = middle + p - DVec3::new(2.6, 2.6, 0.0);
                    reference::line_depth(&cloud, Footprint::default(), p, DVec3::Z)
                });
                depths.map(|depth| (depth / exact - 1.0).abs()).fold(0.0, f64::max)
            };
            let averaged = worst(&VolumeParams::default());
            assert!(averaged < 0.015, "{normal} {width}: {averaged}");
            let at_voxels = worst(&VolumeParams { classification_error: f64::MAX, ..VolumeParams::default() });
            assert!(width > 0.25 || at_voxels > 0.33, "{normal}: {at_voxels}");
        }
    }
}

/// Where the transfer function is straight over a cell, nothing is averaged and nothing changes.
#[test]
fn cells_without_a_bend_keep_their_voxels_value() {
    let linear = grid([9, 8, 7], DVec3::ONE, |i, j, k| 1.0 + 0.1 * (i + 2 * j + k) as f32);
    let (cloud, report) = volume_to_points(&linear, &ramp(0.5, 8.0, 3.0), &VolumeParams::default(), None).unwrap();
    assert_eq!((report.splats, report.averaged), (9 * 8 * 7, 0));
    let tf = ramp(0.5, 8.0, 3.0);
    assert!(cloud.cross_section.iter().zip(&linear.values).all(|(k, v)| *k == tf.at(*v).extinction));
}
