//! What must not change a picture.

use crate::common::{
    BEAUTY, apart, constant, cubic, draw, exact, grid, input, largest, moved_noise, noise, parallel, perspective,
    transfer, unlit, volume,
};
use sheet_light::{Params, prepare};
use splat_core::glam::{DMat3, DQuat, DVec3};
use splat_core::shade::LitBy;
use splat_core::{Accumulator, Camera, Grid, Light, LightShape, Material, Projection, Similarity};

fn sun<'a>() -> LitBy<'a> {
    let shape = LightShape::Directional { direction: DVec3::new(-1.0, -2.0, -1.5).normalize() };
    LitBy { slide: None, light: Light { shape, intensity: [2.0, 1.5, 1.0] }, shadow: None }
}

#[test]
fn any_number_of_threads_gives_the_same_bits() {
    let tf = transfer(&[(0.3, 0.0), (0.5, 0.4), (0.9, 2.5)]);
    let material = Material::default();
    let grid = grid([30, 26, 22], cubic(0.3), noise);
    let mut volumes = [volume(&grid, &tf, &material)];
    volumes[0].normals = true;
    let camera = perspective([2.0, 3.0, 8.0], 60.0, [100, 80]);
    let lights = [sun()];
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| draw(&input(&volumes, &camera, &lights), &Params::default()).unwrap())
    };
    let one = with(1);
    assert!(one.0.channels[0].iter().any(|c| *c > 0.1));
    for threads in [2, 3, 7] {
        assert_eq!(with(threads), one, "{threads} threads");
    }
}

/// A volume of noise moved by `shift` and scaled by `scale`, seen the same way.
fn moved(shift: f64, scale: f64) -> Accumulator {
    let (grid, tf) = moved_noise([20, 18, 16], shift, scale);
    let material = Material::default();
    let mut volumes = [volume(&grid, &tf, &material)];
    volumes[0].normals = true;
    let eye = DVec3::new(2.0, 3.0, 8.0) * scale + DVec3::splat(shift);
    let projection = Projection::Perspective { fov_y: 1.0 };
    let camera = Camera::look_at(eye, DVec3::splat(shift), DVec3::Y, projection, [60, 50]).unwrap();
    draw(&input(&volumes, &camera, &[sun()]), &exact()).unwrap().0
}

#[test]
fn scale2_a_power_of_two_changes_no_bit() {
    let one = moved(0.0, 1.0);
    for exponent in [-10, 10] {
        let mut other = moved(0.0, 2f64.powi(exponent));
        assert_ne!(other.depth, one.depth);
        other.depth.clone_from(&one.depth);
        assert_eq!(other, one, "2^{exponent}");
    }
}

#[test]
fn shift_a_place_far_from_the_origin_looks_the_same() {
    let difference = apart(&moved(0.0, 1.0), &moved(1e7, 1.0));
    assert!(difference < 2e-3, "{difference:e}");
}

#[test]
fn a_transform_is_the_lattice_in_another_place() {
    let tf = transfer(&[(0.3, 0.0), (0.5, 0.4), (0.9, 2.5)]);
    let material = Material::default();
    let transform = Similarity {
        scale: 2.0,
        rotation: DQuat::from_axis_angle(DVec3::new(0.3, 1.0, -0.5).normalize(), 0.7),
        translation: DVec3::new(0.5, -0.25, 1.0),
    };
    let here = grid([16, 16, 16], cubic(0.25), noise);
    let mut there = here.clone();
    there.origin = transform.apply(here.origin);
    there.axes = DMat3::from_quat(transform.rotation) * here.axes * transform.scale;
    let camera = perspective([2.0, 3.0, 9.0], 50.0, [60, 50]);
    let drawn = |grid: &Grid, transform: Similarity| {
        let mut volumes = [volume(grid, &tf, &material)];
        (volumes[0].normals, volumes[0].transform) = (true, transform);
        draw(&input(&volumes, &camera, &[sun()]), &exact()).unwrap().0
    };
    let moved = drawn(&here, transform);
    let written = drawn(&there, Similarity::default());
    assert_eq!(moved, written);
    assert!(moved.channels[0].iter().any(|c| *c > 0.1));
}

#[test]
fn ia10_a_volume_that_turns_with_the_camera_looks_the_same() {
    let tf = transfer(&[(0.3, 0.0), (0.5, 0.4), (0.9, 2.5)]);
    let material = Material::default();
    let turned = |degrees: f64| {
        let turn =
            DMat3::from_quat(DQuat::from_axis_angle(DVec3::new(0.3, 1.0, -0.5).normalize(), degrees.to_radians()));
        let mut grid: Grid = grid([16, 16, 16], cubic(0.5), noise);
        grid.origin = turn * grid.origin;
        grid.axes = turn * grid.axes;
        let mut volumes = [volume(&grid, &tf, &material)];
        volumes[0].normals = true;
        let eye = turn * DVec3::new(2.0, 3.0, 9.0);
        let projection = Projection::Perspective { fov_y: 1.0 };
        let camera = Camera::look_at(eye, DVec3::ZERO, turn * DVec3::Y, projection, [60, 50]).unwrap();
        let shape = LightShape::Directional { direction: turn * DVec3::new(-1.0, -2.0, -1.5).normalize() };
        let lights = [LitBy { slide: None, light: Light { shape, intensity: [2.0, 1.5, 1.0] }, shadow: None }];
        draw(&input(&volumes, &camera, &lights), &exact()).unwrap().0
    };
    let still = turned(0.0);
    assert!(apart(&still, &turned(90.0)) < 1e-3, "{}", apart(&still, &turned(90.0)));
    assert!(apart(&still, &turned(37.0)) < 1e-3, "{}", apart(&still, &turned(37.0)));
}

/// Rows of pixels run down and columns to the right: what is told of one must hold of the other.
#[test]
fn ia10_a_camera_that_rolls_sees_the_picture_turned() {
    let tf = transfer(&[(0.3, 0.0), (0.5, 0.4), (0.9, 2.5)]);
    let material = Material::default();
    let grid = grid([16, 16, 16], cubic(0.5), noise);
    let mut volumes = [volume(&grid, &tf, &material)];
    volumes[0].normals = true;
    let n = 60;
    let lights = [sun()];
    for upright in [perspective([2.0, 3.0, 9.0], 50.0, [60, 60]), parallel([2.0, 3.0, 9.0], 8.0, [60, 60])] {
        let rolled =
            Camera::look_at(upright.position, DVec3::ZERO, upright.axes[0], upright.projection, [60, 60]).unwrap();
        let [one, other] =
            [&upright, &rolled].map(|camera| draw(&input(&volumes, camera, &lights), &exact()).unwrap().0);
        for c in 0..3 {
            let turned: Vec<f32> = (0..n * n).map(|at| one.channels[c][at % n * n + n - 1 - at / n]).collect();
            let off = largest(&turned, &other.channels[c]);
            assert!(off < 1e-4, "channel {c}: {off:e}");
        }
    }
}

#[test]
fn ia05_ranges_of_depth_that_meet_are_one() {
    let tf = transfer(&[(0.3, 0.0), (0.5, 0.4), (0.9, 1.5)]);
    let material = Material::default();
    let grid = grid([12, 12, 34], cubic(0.5), noise);
    let mut volumes = [volume(&grid, &tf, &material)];
    volumes[0].normals = true;
    let camera = perspective([2.0, 3.0, 12.0], 50.0, [50, 40]);
    let lights = [sun()];
    let input = input(&volumes, &camera, &lights);
    for slab_width in [None, Some(0.004)] {
        let params = Params { slab_width, ..exact() };
        let sheeted = prepare(input.clone(), &params, None).unwrap();
        assert!(slab_width.is_none() || sheeted.slabs().0 > 4096, "{:?}", sheeted.slabs());
        let whole = draw(&input, &params).unwrap().0;
        for parts in [2, 8] {
            let mut out = Accumulator::new(camera.size, 1, 3, true, true);
            let mut near = f32::NEG_INFINITY;
            for part in 1..=parts {
                let far = if part == parts { f32::INFINITY } else { 3.1 + 17.3 * part as f32 / parts as f32 };
                sheeted.fold(near..far, &[], &BEAUTY, &mut out, None).unwrap();
                near = far;
            }
            assert!(apart(&out, &whole) < 3e-6, "{slab_width:?}, {parts}: {:e}", apart(&out, &whole));
        }
    }
}

#[test]
fn what_is_behind_an_opaque_surface_is_not_seen() {
    let tf = constant(0.25);
    let material = unlit();
    let grid = grid([20, 20, 20], cubic(0.5), |_| 1.0);
    let volumes = [volume(&grid, &tf, &material)];
    let camera = parallel([0.0, 0.0, 20.0], 4.0, [40, 40]);
    let input = input(&volumes, &camera, &[]);
    let opaque: Vec<f32> = (0..1600).map(|i| 15.0 + (i % 40) as f32 * 0.1).collect();
    let mut out = Accumulator::new(camera.size, 1, 3, true, true);
    let sheeted = prepare(input.clone(), &exact(), None).unwrap();
    sheeted.fold(f32::NEG_INFINITY..f32::INFINITY, &opaque, &BEAUTY, &mut out, None).unwrap();
    for (tau, depth) in out.optical_depth[0].iter().zip(&opaque) {
        assert!((tau - 0.25 * (depth - 15.0)).abs() < 2e-6, "{tau} before {depth}");
    }
}

#[test]
fn what_is_hidden_is_not_splatted_and_nothing_else_changes() {
    let tf = transfer(&[(0.3, 0.0), (0.5, 0.1), (0.9, 0.3)]);
    let material = Material::default();
    let grid = grid([30, 26, 40], cubic(0.3), noise);
    let mut volumes = [volume(&grid, &tf, &material)];
    volumes[0].normals = true;
    let camera = perspective([1.0, 2.0, 14.0], 40.0, [100, 80]);
    let lights = [sun()];
    let sheeted = prepare(input(&volumes, &camera, &lights), &exact(), None).unwrap();
    let fold = |end: f32, opaque: &[f32]| {
        let mut out = Accumulator::new(camera.size, 1, 3, true, true);
        let counts = sheeted.fold(f32::NEG_INFINITY..end, opaque, &BEAUTY, &mut out, None).unwrap();
        (out, counts)
    };
    // Pixels of one column lie before a nearer wall than those of the next one.
    let walls = [11.0, 14.0];
    let opaque: Vec<f32> = (0..8000).map(|at| walls[at / 10 % 2]).collect();
    let (found, counts) = fold(f32::INFINITY, &opaque);
    let parts = walls.map(|wall| fold(wall, &[]).0);
    for (at, wall) in opaque.iter().enumerate() {
        let part = &parts[usize::from(*wall == walls[1])];
        assert!((found.optical_depth[0][at] - part.optical_depth[0][at]).abs() < 1e-6, "pixel {at}");
        for c in 0..3 {
            assert!((found.channels[c][at] - part.channels[c][at]).abs() < 1e-6, "pixel {at}");
        }
    }
    let all = fold(f32::INFINITY, &[]).1;
    assert!(counts.records * 4 < all.records * 3 && counts.fragments * 5 < all.fragments * 4, "{counts:?} of {all:?}");
    assert!(counts.shaded * 3 < all.shaded * 2, "{counts:?} of {all:?}");
}
