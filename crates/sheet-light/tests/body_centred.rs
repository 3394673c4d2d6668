//! Body-centred cubic lattices: what Cartesian ones of the same spectrum show, with 1/√2 of the points.

use crate::common::{
    bcc_volume, body_centred, constant, cubic, draw, exact, grid, in_box, input, largest, lit_in_middles, noise,
    parallel, perspective, transfer, unlit, volume,
};
use crate::twin::{Slope, differences};
use sheet_light::{Error, Params};
use splat_core::glam::DVec3;
use splat_core::shade::LitBy;
use splat_core::{Accumulator, BccGrid, Camera, Grid, Light, LightShape, Material, TransferFunction};

/// Waves of lengths from 4.5 to 9 spacings of 1, along axes and diagonals: all inside the sphere that both spectra hold.
fn waves(p: DVec3) -> f64 {
    let wave = |direction: [f64; 3], length: f64, phase: f64| {
        let along = DVec3::from_array(direction).normalize().dot(p);
        (std::f64::consts::TAU * along / length + phase).cos()
    };
    let sum = wave([1.0, 0.0, 0.0], 5.1, 0.3)
        + wave([0.0, 1.0, 0.2], 4.5, 1.1)
        + wave([1.0, 1.0, 1.0], 4.7, 2.0)
        + wave([1.0, -1.0, 0.4], 6.0, 0.7)
        + wave([-0.3, 0.5, 1.0], 9.0, 0.1);
    0.2 * sum
}

/// Opacity and colour of each ray through the cube of side `side` around the origin, integrated in f64 by 2000 steps.
fn truth(camera: &Camera, tf: &TransferFunction, side: f64) -> Vec<[f64; 4]> {
    let [width, height] = camera.size.map(|s| s as usize);
    let pixel = |at: usize| {
        let (from, along) = camera.view_ray((at % width) as f64 + 0.5, (at / width) as f64 + 0.5);
        let world = |v: DVec3| camera.axes[0] * v.x + camera.axes[1] * v.y + camera.axes[2] * v.z;
        let from = camera.position + world(from);
        let along = world(along);
        let [near, far] = in_box(camera, DVec3::splat(side), at);
        let n = 2000;
        let mut tau = 0.0;
        let mut color = [0.0; 3];
        let step = (far - near).max(0.0) / f64::from(n);
        for i in 0..n {
            let class = tf.at(waves(from + along * (near + (f64::from(i) + 0.5) * step)) as f32);
            let own = f64::from(class.extinction) * step * along.length();
            let weight = f64::exp(-tau) * -f64::exp_m1(-own);
            (0..3).for_each(|c| color[c] += weight * f64::from(class.color[c]));
            tau += own;
        }
        [color[0], color[1], color[2], -f64::exp_m1(-tau)]
    };
    (0..width * height).map(pixel).collect()
}

/// Root mean square of the differences of colours and opacities.
fn rmse(found: &Accumulator, truth: &[[f64; 4]]) -> f64 {
    let square = |(at, expected): (usize, &[f64; 4])| -> f64 {
        let opacity = -f64::exp_m1(-f64::from(found.optical_depth[0][at]));
        let colors = (0..3).map(|c| (f64::from(found.channels[c][at]) - expected[c]).powi(2));
        colors.sum::<f64>() + (opacity - expected[3]).powi(2)
    };
    (truth.iter().enumerate().map(square).sum::<f64>() / (4 * truth.len()) as f64).sqrt()
}

#[test]
fn body_centred_sheets_are_those_of_the_twin() {
    let tf = transfer(&[(0.2, 0.0), (0.5, 0.4), (0.8, 0.1), (0.9, 1.5)]);
    let material = unlit();
    let bcc = body_centred([11, 9, 18], 7.0, noise);
    let volumes = [bcc_volume(&bcc, &tf, &material)];
    for camera in [parallel([3.0, 2.0, 8.0], 11.0, [70, 50]), perspective([2.0, 3.0, 6.0], 60.0, [50, 70])] {
        for slab_width in [None, Some(0.17), Some(1.7)] {
            let params = Params { slab_width, ..exact() };
            let [tau, color] = differences(&input(&volumes, &camera, &[]), &params);
            assert!(tau < 2e-5 && color < 1e-5, "{slab_width:?}: {tau:e} {color:e}");
        }
    }
}

#[test]
fn light_in_a_body_centred_lattice_is_that_of_the_twin() {
    let tf = transfer(&[(0.2, 0.0), (0.6, 0.8), (1.2, 0.1), (1.5, 3.0)]);
    let material = Material::default();
    let sun = LightShape::Directional { direction: DVec3::new(-1.0, -2.0, -1.5).normalize() };
    let light = |shape, shadow| LitBy { slide: None, light: Light { shape, intensity: [2.0, 1.5, 1.0] }, shadow };
    // Shadows that are linear are linear between voxels, too.
    let lamp = LightShape::Point { position: DVec3::new(4.0, 1.0, 5.0) };
    let lights = [light(sun, Some(&Slope as _)), light(lamp, None)];
    let bcc = body_centred([14, 13, 30], 6.0, |p| (1.3 * p.x).sin() + (0.9 * p.y + p.z).cos() + 0.2 * p.z);
    let mut volumes = [bcc_volume(&bcc, &tf, &material)];
    for normals in [false, true] {
        volumes[0].normals = normals;
        // The whole volume: gradients of the twin end at the border of the picture.
        for camera in [parallel([3.0, 2.0, 8.0], 14.0, [70, 60]), perspective([2.0, 3.0, 8.0], 70.0, [60, 70])] {
            let [tau, color] = differences(&input(&volumes, &camera, &lights), &lit_in_middles());
            assert!(tau < 2e-5 && color < 2e-4, "normals {normals}: {tau:e} {color:e}");
        }
    }
}

#[test]
fn voxels_of_a_body_centred_lattice_that_are_skipped_change_nothing() {
    let tf = transfer(&[(0.6, 0.0), (0.65, 3.0), (0.75, 3.0), (0.8, 0.0)]);
    let material = unlit();
    let bcc = body_centred([28, 28, 58], 8.0, |p| (-p.length_squared()).exp());
    crate::twin::skipping_changes_nothing(bcc_volume(&bcc, &tf, &material));
}

/// One shape, whatever it is made of: a constant body-centred volume has the optical depths of a Cartesian one of the same box.
#[test]
fn a_constant_body_centred_volume_fills_its_box() {
    let tf = constant(0.4);
    let material = unlit();
    let bcc = body_centred([9, 8, 20], 5.0, |_| 3.0);
    let one_cell = Grid { dims: [1; 3], values: vec![3.0], origin: DVec3::ZERO, axes: cubic(5.0) };
    for camera in [parallel([3.0, 4.0, 12.0], 9.0, [60, 50]), perspective([1.0, 2.0, 5.0], 80.0, [60, 50])] {
        let drawn = |volume| draw(&input(&[volume], &camera, &[]), &exact()).unwrap().0;
        let found = drawn(bcc_volume(&bcc, &tf, &material));
        let expected = drawn(volume(&one_cell, &tf, &material));
        assert!(expected.optical_depth[0].iter().any(|t| *t > 2.0));
        let off = largest(&found.optical_depth[0], &expected.optical_depth[0]);
        assert!(off < 1e-5, "{off:e}");
    }
}

#[test]
fn what_no_body_centred_lattice_is_is_refused() {
    let tf = constant(0.4);
    let material = unlit();
    let bcc = body_centred([4, 4, 8], 2.0, |_| 3.0);
    let camera = parallel([0.0, 0.0, 9.0], 3.0, [8, 8]);
    let odd = BccGrid { planes: Grid { dims: [4, 8, 4], ..bcc.planes.clone() } };
    let three = BccGrid { planes: Grid { dims: [16, 8, 1], ..bcc.planes.clone() } };
    assert!(draw(&input(&[bcc_volume(&odd, &tf, &material)], &camera, &[]), &exact()).is_ok());
    let refused = draw(&input(&[bcc_volume(&three, &tf, &material)], &camera, &[]), &exact());
    assert!(matches!(&refused, Err(e @ Error::Volume { volume: 0, .. }) if e.to_string().contains("even number")));
}

/// What takes long and rarely fails where the others hold: `cargo xtask deep`.
mod deep {
    use super::*;

    #[test]
    fn a_body_centred_lattice_shows_a_band_limited_field_as_well_with_less_points() {
        let tf = transfer(&[(-0.5, 0.0), (-0.1, 0.02), (0.2, 0.3), (0.4, 0.1), (0.9, 0.6)]);
        let material = unlit();
        let side = 34usize;
        let cartesian = grid([side; 3], cubic(1.0), waves);
        let bcc = body_centred([24, 24, 48], side as f64, waves);
        let share = bcc.planes.values.len() as f64 / cartesian.values.len() as f64;
        assert!(share <= 0.72, "{share}");
        let cameras = [
            parallel([0.0, 0.0, 60.0], 24.0, [64, 64]),
            parallel([20.0, 35.0, 50.0], 24.0, [64, 64]),
            perspective([-40.0, 15.0, 30.0], 25.0, [64, 64]),
        ];
        for camera in cameras {
            let truth = truth(&camera, &tf, side as f64);
            let error = |volume| rmse(&draw(&input(&[volume], &camera, &[]), &exact()).unwrap().0, &truth);
            let of_cartesian = error(volume(&cartesian, &tf, &material));
            let of_bcc = error(bcc_volume(&bcc, &tf, &material));
            println!("RMSE {of_cartesian:.5} Cartesian, {of_bcc:.5} body-centred, share {share}");
            assert!(
                of_cartesian > 1e-4 && of_bcc <= 1.1 * of_cartesian,
                "{of_bcc} body-centred, {of_cartesian} Cartesian"
            );
        }
    }
}
