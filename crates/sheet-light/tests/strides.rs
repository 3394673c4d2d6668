//! Volumes of unlike steps: each has slabs of its own, which those of the finest cut.

use crate::common::{
    BEAUTY, apart, constant, cubic, draw, exact, grid, input, lit_in_middles, noise, parallel, perspective, transfer,
    volume,
};
use sheet_light::{Params, SheetInput, prepare, reference};
use splat_core::glam::DVec3;
use splat_core::shade::LitBy;
use splat_core::{Accumulator, Camera, Grid, Light, LightShape, Material, Receiver, Shading, Transmittance};

/// A wide volume of 3.3 times the step of the one that lies in it, away from its middle.
fn coarse_and_fine(value: impl Fn(DVec3) -> f64) -> [Grid; 2] {
    let coarse = grid([16, 14, 15], cubic(0.5), &value);
    let mut fine = grid([18, 16, 20], cubic(0.15), &value);
    fine.origin += DVec3::new(0.8, 0.3, 1.1);
    [coarse, fine]
}

fn smooth(p: DVec3) -> f64 {
    0.5 + 0.25 * ((1.3 * p.x).sin() + (0.9 * p.y + p.z).cos())
}

/// Light that falls off along a line.
struct Slope;

impl Transmittance for Slope {
    fn transmittance(&self, receiver: &Receiver) -> [f32; 3] {
        let along = 0.5 + 0.04 * receiver.position.x + 0.06 * receiver.position.z;
        [along, 0.5 + 0.5 * along, 0.9]
    }
}

fn lights<'a>() -> [LitBy<'a>; 2] {
    let light = |shape, shadow| LitBy { slide: None, light: Light { shape, intensity: [2.0, 1.5, 1.0] }, shadow };
    let direction = DVec3::new(-1.0, -2.0, -1.5).normalize();
    [
        light(LightShape::Directional { direction }, Some(&Slope as _)),
        light(LightShape::Point { position: DVec3::new(4.0, 1.0, 5.0) }, None),
    ]
}

fn cameras() -> [Camera; 2] {
    [perspective([2.0, 3.0, 9.0], 50.0, [70, 64]), parallel([3.0, 2.0, 8.0], 8.0, [64, 70])]
}

/// Draws both volumes, the coarse one scattering and the fine one reflecting.
fn with_both(grids: &[Grid; 2], camera: &Camera, check: impl Fn(&SheetInput<'_>)) {
    let one = transfer(&[(0.2, 0.0), (0.8, 0.6)]);
    let other = transfer(&[(0.3, 0.0), (0.9, 1.5)]);
    let cloud = Material { shading: Shading::Phase, asymmetry: 0.4, ..Material::default() };
    let solid = Material { specular: 0.3, shininess: 12.0, ..Material::default() };
    let mut volumes = [volume(&grids[0], &one, &cloud), volume(&grids[1], &other, &solid)];
    (volumes[1].normals, volumes[1].object) = (true, 1);
    let lights = lights();
    check(&input(&volumes, camera, &lights));
}

#[test]
fn volumes_of_unlike_steps_are_those_of_the_twin() {
    let grids = coarse_and_fine(smooth);
    for camera in cameras() {
        with_both(&grids, &camera, |input| {
            let (found, _) = draw(input, &lit_in_middles()).unwrap();
            let twin = reference::draw(input, &lit_in_middles()).unwrap();
            for (at, expected) in twin.optical_depth.iter().enumerate() {
                assert!((f64::from(found.optical_depth[0][at]) - expected).abs() < 2e-5, "pixel {at}");
                for c in 0..3 {
                    let found = f64::from(found.channels[c][at]);
                    let expected = twin.color[at][c];
                    assert!((found - expected).abs() < 1e-4, "pixel {at}: {found}, expected {expected}");
                }
            }
            assert!(twin.optical_depth.iter().any(|tau| *tau > 1.0));
        });
    }
}

#[test]
fn a_coarse_volume_is_shaded_by_its_own_slabs() {
    let grids = [grid([16, 14, 15], cubic(0.5), noise), grid([6, 6, 6], cubic(0.15), noise)];
    let tf = transfer(&[(0.2, 0.4), (0.8, 0.6)]);
    let material = Material::default();
    let volumes = [volume(&grids[0], &tf, &material), volume(&grids[1], &tf, &material)];
    for camera in cameras() {
        let both = draw(&input(&volumes, &camera, &[]), &exact()).unwrap().1;
        let uniform = Params { slab_width: Some(0.15), ..exact() };
        let uniform = draw(&input(&volumes, &camera, &[]), &uniform).unwrap().1;
        // A third, and in the tiles of the fine one as many as before, as deep as it is.
        assert!(5 * both.shaded < 3 * uniform.shaded, "{both:?}, {uniform:?}");
    }
}

#[test]
fn wide_slabs_of_a_coarse_volume_err_no_more_than_its_own_spacing() {
    let grids = coarse_and_fine(smooth);
    let rmse = |a: &Accumulator, b: &Accumulator| {
        let squares = a.channels.iter().zip(&b.channels).flat_map(|(a, b)| a.iter().zip(b));
        let n = 3.0 * a.channels[0].len() as f64;
        (squares.map(|(a, b)| f64::from(a - b).powi(2)).sum::<f64>() / n).sqrt()
    };
    for camera in cameras() {
        with_both(&grids, &camera, |input| {
            let with = |slab_width| draw(input, &Params { slab_width, ..exact() }).unwrap().0;
            let own = with(None);
            let fine = with(Some(0.15));
            let wide = with(Some(0.45));
            let own = rmse(&own, &fine);
            let wide = rmse(&wide, &fine);
            assert!(own < 2e-3 && own < 0.7 * wide, "{own:e}, {wide:e}");
        });
    }
}

#[test]
fn constant_volumes_of_unlike_steps_keep_their_closed_form() {
    let grids = coarse_and_fine(|_| 1.0);
    let tf = constant(0.3);
    let material = crate::common::unlit();
    let volumes = [volume(&grids[0], &tf, &material), volume(&grids[1], &tf, &material)];
    for camera in cameras() {
        let (out, _) = draw(&input(&volumes, &camera, &[]), &exact()).unwrap();
        // Each alone has its own closed form, and extinctions add.
        let alone = |k: usize| draw(&input(&volumes[k..=k], &camera, &[]), &exact()).unwrap().0;
        let one = alone(0);
        let two = alone(1);
        for (at, tau) in out.optical_depth[0].iter().enumerate() {
            let sum = one.optical_depth[0][at] + two.optical_depth[0][at];
            assert!(((-tau).exp() - (-sum).exp()).abs() < 1e-5, "{at}: {tau}, expected {sum}");
            let light = out.channels[0][at];
            assert!((light - (1.0 - (-sum).exp())).abs() < 1e-5, "{at}: {light}");
        }
        assert!(two.optical_depth[0].iter().any(|tau| *tau > 0.5));
    }
}

#[test]
fn ranges_that_meet_within_a_wide_slab_are_one() {
    // Beside each other: where two volumes share a slab, it is one mixture, whatever part of it is there.
    let mut grids = [grid([7, 14, 15], cubic(0.5), smooth), grid([18, 16, 20], cubic(0.15), smooth)];
    grids[0].origin.x -= 2.2;
    grids[1].origin.x += 1.3;
    for camera in cameras() {
        with_both(&grids, &camera, |input| {
            let input = SheetInput { lights: Vec::new(), ..input.clone() };
            let sheeted = prepare(input.clone(), &exact(), None).unwrap();
            let whole = draw(&input, &exact()).unwrap().0;
            for parts in [2, 9] {
                let mut out = Accumulator::new(camera.size, 1, 3, true, true);
                let mut near = f32::NEG_INFINITY;
                for part in 1..=parts {
                    let far = if part == parts { f32::INFINITY } else { 4.1 + 9.3 * part as f32 / parts as f32 };
                    sheeted.fold(near..far, &[], &BEAUTY, &mut out, None).unwrap();
                    near = far;
                }
                assert!(apart(&out, &whole) < 3e-6, "{parts}: {:e}", apart(&out, &whole));
            }
        });
    }
}
