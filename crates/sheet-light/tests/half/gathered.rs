//! Half-vector sheets that are gathered: how near they are to splatted ones, that nothing is skipped that shows, and what they refuse.

use super::common::{draw, exact, half_forms, input, lamp, scattering, sun};
use super::soft::{extended, soft};
use super::twin::differences_of_form;
use crate::common::{bcc_volume, body_centred, cubic, grid, noise, parallel, perspective, transfer, unlit, volume};
use sheet_light::half::HalfParams;
use sheet_light::{Error, Gradients, Params, Reconstruction};
use splat_core::glam::DVec3;
use splat_core::{Accumulator, Light, LightShape, Material, rng};
use std::f64::consts::PI;

#[test]
fn half_vector_sheets_that_are_gathered_are_the_splatted_ones_but_for_the_kernel() {
    let tf = transfer(&[(0.1, 0.0), (0.5, 0.6), (0.9, 1.5)]);
    let material = scattering();
    let edge = grid([24, 22, 20], cubic(0.3), |p| if p.dot(DVec3::new(0.5, 0.3, 0.8)) < 0.2 { 0.0 } else { 1.0 });
    let rough = grid([24, 22, 20], cubic(0.3), noise);
    let mut bright = lamp([6.0, 8.0, 9.0]);
    bright.light = Light { intensity: [150.0; 3], ..bright.light };
    let center = DVec3::new(-6.0, 8.0, 9.0);
    let disk = extended(LightShape::Disk { center, normal: -center.normalize(), radius: 1.5 }, 8);
    for (field, most) in [(&edge, 0.005), (&rough, 0.01)] {
        let volumes = [volume(field, &tf, &material)];
        for camera in [parallel([3.0, 2.0, 8.0], 8.0, [64, 56]), perspective([2.0, 3.0, 8.0], 60.0, [64, 56])] {
            for light in [Some(sun([1.0, 3.0, 2.0])), Some(sun([-1.0, 2.0, -3.0])), Some(bright), None] {
                let lights = light.into_iter().collect::<Vec<_>>();
                let scene = match light {
                    Some(_) => input(&volumes, &camera, &lights),
                    None => soft(&volumes, &camera, vec![disk]),
                };
                let forms = half_forms(&exact(None)).map(|params| draw(&scene, &params).unwrap().0);
                let [splatted, _, gathered] = &forms;
                // Of what is shown, 1 being what scatters all light alike to all sides.
                let scale = if light.is_none() { 1.0 / brightest(splatted) } else { 4.0 * PI };
                let squares = splatted.channels[0].iter().zip(&gathered.channels[0]);
                let squares = squares.map(|(a, b)| (f64::from(a - b) * scale).powi(2));
                let rmse = (squares.sum::<f64>() / (64.0 * 56.0)).sqrt();
                println!("RMSE {rmse:e}");
                assert!(rmse > 0.0 && rmse < most, "{rmse} of {most}");
            }
        }
    }
}

fn brightest(picture: &Accumulator) -> f64 {
    picture.channels[0].iter().copied().fold(0.0, f32::max).into()
}

/// Bricks without visible voxels are not read, for the eye and for the light: with a transfer function that gives a trace of extinction everywhere nothing is
/// skipped, and the picture is the same but for that. Normals are those of neighbouring pixels and sheets, which are read too.
#[test]
fn bricks_hide_nothing_from_the_eye_and_nothing_from_the_light() {
    let shining = Material { ambient: 0.0, ..Material::default() };
    let medium = scattering();
    for seed in 0..30u64 {
        let unit = |k: u64| rng::unit(19, seed, k, 0);
        let dims = [0, 1, 2].map(|a| 1 + (unit(a) * 40.0) as usize);
        let middle = DVec3::new(unit(3) - 0.5, unit(4) - 0.5, unit(5) - 0.5) * 4.0;
        let sharpness = 0.2 + 2.0 * unit(6);
        let field = grid(dims, cubic(0.25), |p| (-sharpness * (p - middle).length_squared()).exp() + 0.02 * noise(p));
        let low = (0.1 + 0.6 * unit(7)) as f32;
        let shown = [(low, 0.0), (low + 0.05, 4.0), (low + 0.1, 4.0), (low + 0.15, 0.0)];
        let tf = transfer(&shown);
        let traced = transfer(&shown.map(|(value, extinction)| (value, extinction + 1e-5)));
        let size = [20 + (unit(8) * 60.0) as u32, 20 + (unit(9) * 60.0) as u32];
        let from = [6.0 * unit(10) - 3.0, 6.0 * unit(11) - 3.0, 11.0];
        let light = sun([unit(12) - 0.5, unit(13) - 0.5, if seed % 2 == 0 { 1.0 } else { -1.0 }]);
        let material = if seed % 3 == 0 { &medium } else { &shining };
        for camera in [perspective(from, 30.0 + 30.0 * unit(14), size), parallel(from, 2.0 + 8.0 * unit(15), size)] {
            for params in &half_forms(&exact(None))[1..] {
                let drawn = |tf| {
                    let mut volumes = [volume(&field, tf, material)];
                    volumes[0].normals = seed % 3 != 0;
                    draw(&input(&volumes, &camera, &[light]), params).unwrap().0
                };
                let skipped = drawn(&tf);
                let whole = drawn(&traced);
                let trace = 1e-5 * 0.25 * dims.iter().map(|n| *n as f32).sum::<f32>() + 2e-5;
                for at in 0..skipped.optical_depth[0].len() {
                    let more = whole.optical_depth[0][at] - skipped.optical_depth[0][at];
                    assert!((-1e-5..=trace).contains(&more), "seed {seed}, pixel {at}: {more:e} of {trace:e}");
                    let brighter = (whole.channels[1][at] - skipped.channels[1][at]).abs();
                    assert!(brighter <= 4.0 * trace, "seed {seed}, pixel {at}: {brighter:e} of {trace:e}");
                }
            }
        }
    }
}

#[test]
fn normals_of_half_vector_sheets_that_are_gathered_are_those_of_the_twin() {
    let tf = transfer(&[(-1.5, 0.0), (0.0, 0.3), (1.5, 0.9)]);
    let material = Material { ambient: 0.0, ..Material::default() };
    let waves = |p: DVec3| (0.9 * p.x + 0.3 * p.z).sin() + 0.4 * (0.7 * p.y - 0.8 * p.z).cos();
    let field = grid([10, 9, 8], cubic(0.5), waves);
    let mut volumes = [volume(&field, &tf, &material)];
    volumes[0].normals = true;
    for camera in [parallel([3.0, 2.0, 8.0], 7.0, [28, 20]), perspective([2.0, 3.0, 8.0], 40.0, [20, 28])] {
        for (light, gradients) in [
            (sun([1.0, 3.0, 2.0]), Gradients::Sheets),
            (sun([-1.0, 2.0, -3.0]), Gradients::Sheets),
            (sun([1.0, 3.0, 2.0]), Gradients::Volume),
            (sun([1.0, 3.0, 2.0]), Gradients::Kernel),
        ] {
            for params in half_forms(&exact(None)) {
                if gradients == Gradients::Kernel && params.sheets.reconstruction == Reconstruction::Splat {
                    continue;
                }
                let params = HalfParams { sheets: Params { gradients, ..params.sheets }, ..params };
                let [tau, color] = differences_of_form(&input(&volumes, &camera, &[light]), &params);
                println!("{gradients:?}, {:?}: {tau:e} {color:e}", params.sheets.reconstruction);
                assert!(tau < 2e-5 && color < 2e-3, "{gradients:?}: {tau:e} {color:e}");
            }
        }
    }
}

#[test]
fn half_vector_sheets_of_body_centred_lattices_are_not_gathered() {
    let tf = transfer(&[(0.0, 0.0), (1.0, 1.0)]);
    let material = unlit();
    let field = body_centred([4, 4, 8], 2.0, noise);
    let volumes = [bcc_volume(&field, &tf, &material)];
    let camera = parallel([0.0, 0.0, 4.0], 3.0, [16, 16]);
    for params in &half_forms(&exact(None))[1..] {
        let refused = draw(&input(&volumes, &camera, &[sun([1.0, 1.0, 1.0])]), params);
        assert!(matches!(refused, Err(Error::Parameter { name: "reconstruction", .. })));
    }
}
