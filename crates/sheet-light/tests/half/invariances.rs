//! Threads, place, scale, and slabs that become thin.

use super::common::{draw, exact, half_forms, input, lamp, scattering, sun};
use crate::common::{apart, cubic, grid, moved_noise, noise, parallel, perspective, transfer, volume};
use sheet_light::half::HalfParams;
use splat_core::glam::DVec3;
use splat_core::{Accumulator, Camera, Light, LightShape, Material, Projection};
use std::f64::consts::PI;

#[test]
fn x1_any_number_of_threads_gives_the_same_bits() {
    let tf = transfer(&[(0.3, 0.0), (0.5, 0.4), (0.9, 2.5)]);
    let material = Material::default();
    let grid = grid([20, 20, 20], cubic(0.5), noise);
    let mut volumes = [volume(&grid, &tf, &material)];
    volumes[0].normals = true;
    let camera = perspective([2.0, 3.0, 16.0], 50.0, [100, 80]);
    for lights in [[sun([1.0, 2.0, 1.5]), lamp([9.0, 12.0, 4.0])], [sun([1.0, 2.0, -3.0]), lamp([0.0, 3.0, -14.0])]] {
        for params in half_forms(&HalfParams::default()) {
            let with = |threads: usize| {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
                pool.install(|| draw(&input(&volumes, &camera, &lights), &params).unwrap())
            };
            let one = with(1);
            assert!(one.0.channels[0].iter().any(|c| *c > 0.01));
            for threads in [2, 3, 7] {
                assert_eq!(with(threads), one, "{threads} threads, {:?}", params.sheets.reconstruction);
            }
        }
    }
}

/// A volume of noise moved by `shift` and scaled by `scale`, seen and lit the same way.
fn moved(shift: f64, scale: f64, shape: LightShape, form: usize) -> Accumulator {
    let (grid, tf) = moved_noise([14, 13, 12], shift, scale);
    let material = Material::default();
    let mut volumes = [volume(&grid, &tf, &material)];
    volumes[0].normals = true;
    let eye = DVec3::new(2.0, 3.0, 11.0) * scale + DVec3::splat(shift);
    let projection = Projection::Perspective { fov_y: 0.8 };
    let camera = Camera::look_at(eye, DVec3::splat(shift), DVec3::Y, projection, [50, 40]).unwrap();
    let mut lit = super::common::lit(match shape {
        LightShape::Point { position } => LightShape::Point { position: position * scale + DVec3::splat(shift) },
        other => other,
    });
    let bright = if shape.place().is_some() { 100.0 * (scale * scale) as f32 } else { 1.0 };
    lit.light = Light { intensity: [bright; 3], ..lit.light };
    draw(&input(&volumes, &camera, &[lit]), &half_forms(&exact(None))[form]).unwrap().0
}

fn shapes() -> [LightShape; 3] {
    let sun = |v: [f64; 3]| LightShape::Directional { direction: DVec3::from_array(v).normalize() };
    [sun([-1.0, -2.0, -1.5]), sun([1.0, -1.0, 2.0]), LightShape::Point { position: DVec3::new(-6.0, 7.0, 9.0) }]
}

#[test]
fn scale2_a_power_of_two_changes_no_bit() {
    for (shape, form) in shapes().into_iter().flat_map(|shape| [0, 1, 2].map(|form| (shape, form))) {
        let one = moved(0.0, 1.0, shape, form);
        assert!(one.channels[0].iter().any(|c| *c > 0.01));
        for exponent in [-10, 10] {
            let mut other = moved(0.0, 2f64.powi(exponent), shape, form);
            assert_ne!(other.depth, one.depth);
            other.depth.clone_from(&one.depth);
            assert_eq!(other, one, "2^{exponent}, {shape:?}");
        }
    }
}

#[test]
fn shift_a_place_far_from_the_origin_looks_the_same() {
    for (shape, form) in shapes().into_iter().flat_map(|shape| [0, 1, 2].map(|form| (shape, form))) {
        let difference = apart(&moved(0.0, 1.0, shape, form), &moved(1e7, 1.0, shape, form));
        assert!(difference < 2e-3, "{shape:?}: {difference:e}");
    }
}

/// Of one halving alone the order wavers between 1.6 and 2.2 with where the lattice lies in slabs as wide as its step, whatever faces
/// do; over three it does not.
#[test]
fn hv05_thinner_slabs_converge_in_second_order() {
    let tf = transfer(&[(-1.5, 0.0), (0.0, 0.3), (1.5, 0.9)]);
    let material = scattering();
    let waves = |p: DVec3| (0.9 * p.x + 0.3 * p.z).sin() + 0.4 * (0.7 * p.y - 0.8 * p.z).cos();
    let fade = |v: f64| (PI * v / 5.0).cos().powi(2);
    let cut_by_faces = grid([10, 10, 10], cubic(0.5), waves);
    let faded = grid([10, 10, 10], cubic(0.5), |p| (waves(p) + 1.5) * fade(p.x) * fade(p.y) * fade(p.z) - 1.5);
    let camera = parallel([0.0, 0.0, 12.0], 5.0, [16, 16]);
    for (grid, light) in [&cut_by_faces, &faded].into_iter().flat_map(|grid| [2.0, -2.0].map(|z| (grid, z))) {
        let volumes = [volume(grid, &tf, &material)];
        let lights = [sun([1.0, 0.3, light])];
        for form in 0..3 {
            let with = |width: f64| {
                let params = HalfParams { light_pixels: 3.0, ..half_forms(&exact(Some(width)))[form] };
                draw(&input(&volumes, &camera, &lights), &params).unwrap().0
            };
            let truth = with(0.015625);
            let error = |width: f64| {
                let squares = with(width).channels[1]
                    .iter()
                    .zip(&truth.channels[1])
                    .map(|(a, b)| f64::from((a - b) * (a - b)))
                    .sum::<f64>();
                squares.sqrt()
            };
            let coarse = error(0.5);
            let fine = error(0.0625);
            let order = (coarse / fine).log2() / 3.0;
            println!("form {form}, order {order}: {coarse:e} → {fine:e}");
            assert!(order > 1.9, "form {form}, order {order}: {coarse:e} → {fine:e}");
        }
    }
}
