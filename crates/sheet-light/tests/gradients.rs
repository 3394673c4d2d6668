//! Normals from neighbouring sheets and from a gradient volume.

use crate::common::{bcc_volume, body_centred, cubic, exact, grid, input, parallel, perspective, transfer, volume};
use crate::half::common::{exact as exact_half, input as half_input, lit, sun};
use crate::half::twin::differences as differences_half;
use crate::twin::differences;
use sheet_light::half::HalfParams;
use sheet_light::{Error, GatherKernel, Gradients, Params, Reconstruction, SheetInput, prepare};
use splat_core::glam::{DMat3, DVec3};
use splat_core::shade::ChannelLayout;
use splat_core::{Accumulator, Exceeded, LayerSet, Light, LightShape, Limits, Material};

const VOLUME: Gradients = Gradients::Volume;

fn smooth(p: DVec3) -> f64 {
    (1.3 * p.x).sin() + (0.9 * p.y + p.z).cos() + 0.2 * p.z
}

/// Mean and largest angle, degrees, between the normals of a sphere that is seen and its radii.
fn off_a_sphere(input: &SheetInput<'_>, radius: f64, params: &Params) -> [f64; 2] {
    let layout = ChannelLayout::new(&LayerSet { normal: true, ..LayerSet::default() });
    let camera = input.camera;
    let mut out = Accumulator::new(camera.size, 1, layout.count(), false, false);
    let sheets = prepare(input.clone(), params, None).unwrap();
    sheets.fold(f32::NEG_INFINITY..f32::INFINITY, &[], &layout, &mut out, None).unwrap();
    let first = layout.normal().unwrap();
    let mut sum = 0.0;
    let mut most = 0.0f64;
    let mut count = 0.0;
    for at in 0..out.optical_depth[0].len() {
        let [x, y] = [at % camera.size[0] as usize, at / camera.size[0] as usize].map(|v| v as f64 + 0.5);
        let from = camera.view_ray(x, y).0;
        let place = camera.position + camera.axes[0] * from.x + camera.axes[1] * from.y;
        let along = camera.axes[2];
        let nearest = place - along * place.dot(along);
        // Not at the rim, where rays graze.
        if nearest.length() < 0.9 * radius {
            let hit = nearest - along * (radius * radius - nearest.length_squared()).sqrt();
            let normal = DVec3::from_array([0, 1, 2].map(|a| f64::from(out.channels[first + a][at])));
            let angle = normal.normalize().angle_between(hit).to_degrees();
            (sum, most, count) = (sum + angle, most.max(angle), count + 1.0);
        }
    }
    assert!(count > 1000.0, "{count}");
    [sum / count, most]
}

#[test]
fn normals_of_a_sphere_are_its_radii_by_sheets_and_better_by_a_gradient_volume() {
    let radius = 1.6;
    let material = Material::default();
    let tf = transfer(&[(-1.61, 0.0), (-1.59, 500.0)]);
    let field = |p: DVec3| -p.length();
    let cartesian = grid([24, 24, 24], cubic(0.2), field);
    let bcc = body_centred([17, 17, 34], 4.8, field);
    let camera = parallel([3.0, 2.0, 8.0], 4.0, [64, 64]);
    for mut seen in [volume(&cartesian, &tf, &material), bcc_volume(&bcc, &tf, &material)] {
        seen.normals = true;
        let volumes = [seen];
        let sphere = input(&volumes, &camera, &[]);
        let off_by =
            |gradients| off_a_sphere(&sphere, radius, &Params { gradients, slab_width: Some(0.02), ..exact() });
        let [sheets, exact] = [Gradients::Sheets, VOLUME].map(off_by);
        let packing = seen.packing;
        assert!(sheets[0] < 0.35 && sheets[1] < 1.1, "{packing:?}: {sheets:?}");
        assert!(exact[0] < 0.27 && exact[1] < 0.8 && exact[0] < 0.9 * sheets[0], "{packing:?}: {exact:?}, {sheets:?}");
    }
}

#[test]
fn gradient_volumes_are_those_of_the_twin() {
    let tf = transfer(&[(0.2, 0.0), (0.6, 0.8), (1.2, 0.1), (1.5, 3.0)]);
    let material = Material { specular: 0.3, shininess: 12.0, ..Material::default() };
    let lights = [sun([1.0, 2.0, 1.5]), lit(LightShape::Point { position: DVec3::new(4.0, 1.0, 5.0) })];
    let sheared = DMat3::from_cols(DVec3::new(0.3, 0.05, 0.0), DVec3::new(0.1, 0.3, -0.05), DVec3::new(0.0, 0.1, -0.4));
    let grid = grid([16, 14, 12], sheared, smooth);
    let bcc = body_centred([9, 9, 18], 4.0, smooth);
    let params = Params { gradients: VOLUME, ..exact() };
    for mut seen in [volume(&grid, &tf, &material), bcc_volume(&bcc, &tf, &material)] {
        seen.normals = true;
        let volumes = [seen];
        for camera in [parallel([3.0, 2.0, 8.0], 6.0, [48, 40]), perspective([2.0, 3.0, 8.0], 40.0, [40, 48])] {
            let [tau, color] = differences(&input(&volumes, &camera, &lights), &params);
            assert!(tau < 2e-5 && color < 1e-4, "{:?}: {tau:e} {color:e}", seen.packing);
        }
    }
}

#[test]
fn gradients_of_the_field_that_is_gathered_are_those_of_the_twin() {
    let tf = transfer(&[(0.2, 0.0), (0.6, 0.8), (1.2, 0.1), (1.5, 3.0)]);
    let material = Material { specular: 0.3, shininess: 12.0, ..Material::default() };
    let lights = [sun([1.0, 2.0, 1.5]), lit(LightShape::Point { position: DVec3::new(4.0, 1.0, 5.0) })];
    let sheared = DMat3::from_cols(DVec3::new(0.3, 0.05, 0.0), DVec3::new(0.1, 0.3, -0.05), DVec3::new(0.0, 0.1, -0.4));
    let grid = grid([16, 14, 12], sheared, smooth);
    let mut volumes = [volume(&grid, &tf, &material)];
    volumes[0].normals = true;
    for kernel in [GatherKernel::Gaussian, GatherKernel::Linear] {
        let params = Params { gradients: Gradients::Kernel, reconstruction: Reconstruction::Gather(kernel), ..exact() };
        for camera in [parallel([3.0, 2.0, 8.0], 6.0, [48, 40]), perspective([2.0, 3.0, 8.0], 40.0, [40, 48])] {
            let [tau, color] = differences(&input(&volumes, &camera, &lights), &params);
            assert!(tau < 2e-5 && color < 1e-4, "{kernel:?}: {tau:e} {color:e}");
        }
    }
}

#[test]
fn gradients_of_the_field_are_those_of_a_sphere_however_wide_a_pixel_is() {
    let radius = 1.6;
    let material = Material::default();
    let tf = transfer(&[(-1.61, 0.0), (-1.59, 500.0)]);
    let cartesian = grid([24, 24, 24], cubic(0.2), |p: DVec3| -p.length());
    let mut volumes = [volume(&cartesian, &tf, &material)];
    volumes[0].normals = true;
    for (size, slab_width) in [(64, Some(0.02)), (64, Some(0.01)), (50, Some(0.02))] {
        let camera = parallel([3.0, 2.0, 8.0], 4.0, [size, size]);
        for kernel in [GatherKernel::Gaussian, GatherKernel::Linear] {
            let params = Params {
                gradients: Gradients::Kernel,
                reconstruction: Reconstruction::Gather(kernel),
                slab_width,
                ..exact()
            };
            let [mean, most] = off_a_sphere(&input(&volumes, &camera, &[]), radius, &params);
            println!("{size}, {slab_width:?}, {kernel:?}: {mean}, {most}");
            assert!(mean < 0.27 && most < 1.0, "{size}, {slab_width:?}, {kernel:?}: {mean}, {most}");
        }
    }
}

#[test]
fn splatted_sheets_have_no_field_to_differentiate() {
    let tf = transfer(&[(0.0, 1.0)]);
    let material = Material::default();
    let grid = grid([4, 4, 4], cubic(0.2), smooth);
    let camera = parallel([3.0, 2.0, 8.0], 6.0, [8, 8]);
    let volumes = [volume(&grid, &tf, &material)];
    let params = Params { gradients: Gradients::Kernel, reconstruction: Reconstruction::Splat, ..exact() };
    let refused = prepare(input(&volumes, &camera, &[]), &params, None);
    assert!(matches!(refused.err(), Some(Error::Parameter { name: "gradients", .. })));
}

#[test]
fn normals_across_half_vectors_are_those_of_the_twin() {
    let tf = transfer(&[(0.2, 0.0), (0.6, 0.8), (1.2, 0.1), (1.5, 3.0)]);
    let material = Material { specular: 0.3, shininess: 12.0, ..Material::default() };
    let grid = grid([9, 8, 7], cubic(0.5), smooth);
    let mut volumes = [volume(&grid, &tf, &material)];
    volumes[0].normals = true;
    let camera = perspective([2.0, 3.0, 8.0], 40.0, [22, 26]);
    let mut bright = lit(LightShape::Point { position: DVec3::new(3.0, 8.0, 7.0) });
    bright.light = Light { intensity: [100.0; 3], ..bright.light };
    for gradients in [Gradients::Sheets, VOLUME] {
        for (light, slab_width) in
            [(sun([1.0, 3.0, 2.0]), None), (sun([-1.0, 2.0, -3.0]), Some(1.3)), (bright, Some(0.3))]
        {
            let half = exact_half(slab_width);
            let params = HalfParams { sheets: Params { gradients, ..half.sheets }, ..half };
            let [tau, color] = differences_half(&half_input(&volumes, &camera, &[light]), &params);
            // Colours are times 4π: what is white shows 4 in full light.
            assert!(tau < 2e-5 && color < 1e-3, "{gradients:?}, {slab_width:?}: {tau:e} {color:e}");
        }
    }
}

#[test]
fn a_gradient_volume_is_counted_before_it_is_made() {
    let tf = transfer(&[(0.0, 1.0)]);
    let material = Material::default();
    let grid = grid([40, 40, 40], cubic(0.2), smooth);
    let mut volumes = [volume(&grid, &tf, &material)];
    volumes[0].normals = true;
    let camera = parallel([3.0, 2.0, 8.0], 6.0, [8, 8]);
    let needs = |gradients| {
        let limits = Limits::bytes(1000);
        let refused = prepare(input(&volumes, &camera, &[]), &Params { gradients, limits, ..exact() }, None);
        match refused.err() {
            Some(Error::Limit(Exceeded { needed, .. })) => needed,
            other => panic!("{other:?}"),
        }
    };
    assert!(needs(VOLUME) >= needs(Gradients::Sheets));
    let least = needs(Gradients::Sheets);
    let with = |gradients, bytes| {
        let limits = Limits::bytes(bytes);
        prepare(input(&volumes, &camera, &[]), &Params { gradients, limits, ..exact() }, None).is_ok()
    };
    // 12 bytes for each of 46³ voxels with their rim, and a bit less than a byte more.
    let more = 12 * 46u64.pow(3);
    assert!(with(Gradients::Sheets, least) && !with(VOLUME, least) && !with(VOLUME, least + more / 2));
    assert!(with(VOLUME, least + more * 11 / 10));
}
