//! Tiles, lanes, rings and skipped voxels against the slow form in f64.

use crate::common::{
    constant, cubic, draw, exact, forms, grid, input, lit_in_middles, noise, parallel, perspective, transfer, unlit,
    volume,
};
use sheet_light::{Params, SheetInput, Volume, prepare, reference};
use splat_core::glam::{DMat3, DVec3};
use splat_core::shade::LitBy;
use splat_core::{Light, LightShape, Material, Receiver, Transmittance};

/// Greatest differences from the twin: optical depth, colour; of splatted sheets, and of gathered ones where nothing is asked that these lack.
pub(crate) fn differences(input: &SheetInput<'_>, params: &Params) -> [f64; 2] {
    let mut worst = [0.0f64; 2];
    for params in forms(params).iter().filter(|params| prepare(input.clone(), params, None).is_ok()) {
        let found = differences_of(input, params);
        println!("{:?}: {found:?}", params.reconstruction);
        (0..2).for_each(|n| worst[n] = worst[n].max(found[n]));
    }
    worst
}

fn differences_of(input: &SheetInput<'_>, params: &Params) -> [f64; 2] {
    let (found, counts) = draw(input, params).unwrap();
    let twin = reference::draw(input, params).unwrap();
    let mut worst = [0.0f64; 2];
    for (at, expected) in twin.optical_depth.iter().enumerate() {
        worst[0] = worst[0].max((f64::from(found.optical_depth[0][at]) - expected).abs());
        for c in 0..3 {
            worst[1] = worst[1].max((f64::from(found.channels[c][at]) - twin.color[at][c]).abs());
        }
    }
    let seen = twin.optical_depth.iter().filter(|t| **t > 0.01).count();
    assert!(seen > 300 && counts.fragments > 0, "{seen} pixels show anything");
    worst
}

fn smooth(p: DVec3) -> f64 {
    (1.3 * p.x).sin() + (0.9 * p.y + p.z).cos() + 0.2 * p.z
}

#[test]
fn unlit_sheets_are_those_of_the_twin() {
    let tf = transfer(&[(0.2, 0.0), (0.5, 0.4), (0.8, 0.1), (0.9, 1.5)]);
    let material = unlit();
    let sheared = DMat3::from_cols(DVec3::new(0.5, 0.1, 0.0), DVec3::new(0.2, 0.6, -0.1), DVec3::new(-0.1, 0.1, -0.7));
    for axes in [cubic(0.5), sheared] {
        let grid = grid([17, 13, 11], axes, noise);
        let volumes = [volume(&grid, &tf, &material)];
        for camera in [parallel([3.0, 2.0, 8.0], 11.0, [70, 50]), perspective([2.0, 3.0, 6.0], 60.0, [50, 70])] {
            for slab_width in [None, Some(0.11), Some(1.7)] {
                let params = Params { slab_width, ..exact() };
                let [tau, color] = differences(&input(&volumes, &camera, &[]), &params);
                assert!(tau < 2e-5 && color < 1e-5, "{slab_width:?}: {tau:e} {color:e}");
            }
        }
    }
}

/// A volume that is hidden but for less than a quarter of its voxels is that of the twin.
pub(crate) fn skipping_changes_nothing(volume: Volume<'_>) {
    let volumes = [volume];
    for camera in [parallel([3.0, 2.0, 8.0], 2.5, [50, 44]), perspective([2.0, 3.0, 6.0], 20.0, [50, 44])] {
        let input = input(&volumes, &camera, &[]);
        let [tau, color] = differences(&input, &exact());
        assert!(tau < 2e-5 && color < 1e-5, "{tau:e} {color:e}");
        for params in forms(&exact()).iter().filter(|params| prepare(input.clone(), params, None).is_ok()) {
            let (_, counts) = draw(&input, params).unwrap();
            assert!(counts.visible < counts.voxels / 4, "{:?} {counts:?}", params.reconstruction);
        }
    }
}

#[test]
fn voxels_that_are_skipped_change_nothing() {
    // A thin shell in much that is hidden.
    let tf = transfer(&[(0.6, 0.0), (0.65, 3.0), (0.75, 3.0), (0.8, 0.0)]);
    let material = unlit();
    let grid = grid([40, 44, 40], cubic(0.2), |p| (-p.length_squared()).exp());
    skipping_changes_nothing(volume(&grid, &tf, &material));
}

#[test]
fn lit_sheets_are_those_of_the_twin() {
    let tf = transfer(&[(0.2, 0.0), (0.6, 0.8), (1.2, 0.1), (1.5, 3.0)]);
    let material = Material { specular: 0.3, shininess: 12.0, ..Material::default() };
    let light = |shape| LitBy { slide: None, light: Light { shape, intensity: [2.0, 1.5, 1.0] }, shadow: None };
    let lights = [
        light(LightShape::Directional { direction: DVec3::new(-1.0, -2.0, -1.5).normalize() }),
        light(LightShape::Point { position: DVec3::new(4.0, 1.0, 5.0) }),
    ];
    let grid = grid([22, 20, 18], cubic(0.3), smooth);
    for normals in [false, true] {
        let mut volumes = [volume(&grid, &tf, &material)];
        volumes[0].normals = normals;
        for camera in [parallel([3.0, 2.0, 8.0], 14.0, [70, 60]), perspective([2.0, 3.0, 8.0], 70.0, [60, 70])] {
            let [tau, color] = differences(&input(&volumes, &camera, &lights), &exact());
            assert!(tau < 2e-5 && color < 2e-4, "normals {normals}: {tau:e} {color:e}");
        }
    }
}

/// Light that falls off along a line, red more than blue.
pub(crate) struct Slope;

impl Transmittance for Slope {
    fn transmittance(&self, receiver: &Receiver) -> [f32; 3] {
        let along = 0.5 + 0.04 * receiver.position.x + 0.06 * receiver.position.z;
        [along, 0.5 + 0.5 * along, 0.9]
    }
}

#[test]
fn shadows_between_voxels_are_linear() {
    let tf = transfer(&[(0.2, 0.0), (0.6, 0.8), (1.2, 0.1), (1.5, 3.0)]);
    let material = Material::default();
    let light = |shape, shadow| LitBy { slide: None, light: Light { shape, intensity: [2.0, 1.5, 1.0] }, shadow };
    let lights = [
        light(LightShape::Directional { direction: DVec3::new(-1.0, -2.0, -1.5).normalize() }, Some(&Slope as _)),
        light(LightShape::Point { position: DVec3::new(4.0, 1.0, 5.0) }, None),
        light(LightShape::Point { position: DVec3::new(-4.0, 5.0, 1.0) }, Some(&Slope as _)),
    ];
    // 70 voxels a row: more than a word of 64.
    let sheared =
        DMat3::from_cols(DVec3::new(0.09, 0.01, 0.0), DVec3::new(0.1, 0.3, -0.05), DVec3::new(0.0, 0.1, -0.3));
    let grid = grid([70, 18, 16], sheared, smooth);
    let volumes = [volume(&grid, &tf, &material)];
    let camera = perspective([2.0, 3.0, 8.0], 60.0, [60, 50]);
    let input = input(&volumes, &camera, &lights);
    let [tau, color] = differences(&input, &lit_in_middles());
    assert!(tau < 2e-5 && color < 1e-4, "{tau:e} {color:e}");
    let mut unshadowed = input.clone();
    unshadowed.lights.iter_mut().for_each(|lit| lit.shadow = None);
    let apart = |a: &SheetInput<'_>| draw(a, &lit_in_middles()).unwrap().0.channels[0].iter().sum::<f32>();
    assert!(apart(&input) < 0.9 * apart(&unshadowed));
}

#[test]
fn ia13_volumes_that_overlap_are_classified_each_by_itself() {
    let tf = transfer(&[(0.2, 0.0), (0.7, 0.9)]);
    let other_tf = transfer(&[(300.0, 0.0), (900.0, 0.5), (1000.0, 0.0)]);
    let plain = unlit();
    let glowing = Material { emission: [0.2, 0.0, 1.0], ..unlit() };
    let one = grid([17, 13, 11], cubic(0.5), noise);
    let mut two = grid([9, 10, 8], cubic(0.7), |p| 1000.0 * noise(p));
    two.origin += DVec3::new(1.0, 0.3, 0.8);
    let volumes = [volume(&one, &tf, &plain), volume(&two, &other_tf, &glowing)];
    let camera = perspective([2.0, 3.0, 7.0], 65.0, [60, 50]);
    let [tau, color] = differences(&input(&volumes, &camera, &[]), &exact());
    assert!(tau < 2e-5 && color < 1e-5, "{tau:e} {color:e}");
    // Optical depths add: the other one without any extinction keeps the slabs where they are.
    let none = constant(0.0);
    let params = Params { slab_width: Some(0.5), ..exact() };
    let alone = |k: usize| {
        let mut volumes = volumes;
        volumes[1 - k].transfer = &none;
        draw(&input(&volumes, &camera, &[]), &params).unwrap().0
    };
    let both = draw(&input(&volumes, &camera, &[]), &params).unwrap().0;
    let one = alone(0);
    let two = alone(1);
    for (at, both) in both.optical_depth[0].iter().enumerate() {
        let sum = one.optical_depth[0][at] + two.optical_depth[0][at];
        assert!((both - sum).abs() < 2e-5, "{at}: {both}, {sum}");
    }
}
