//! Transparent surfaces: closed forms, the twin in f64, hard cases.

use crate::scenes::{Scene, camera, disc, parallel, plane, soup, sphere};
use deferred_blend::{Params, reference};
use splat_core::glam::{DVec3, Vec3};
use splat_core::{Accumulator, Cloud, Splat};

/// Opacity of a pixel.
fn alpha(picture: &Accumulator, k: usize) -> f32 {
    -libm::expm1f(-picture.optical_depth[0][k])
}

/// Every pixel against the twin. A gap that is ε but for rounding may be told either way.
fn agrees_with_the_twin(scene: &Scene, params: &Params) {
    let picture = scene.draw(params);
    let [width, height] = scene.camera.size;
    let mut met = 0;
    for (x, y) in (0..height).flat_map(|y| (0..width).map(move |x| (x, y))) {
        let k = (y * width + x) as usize;
        let difference = |factor: f32| {
            let params = Params { gap: params.gap * factor, ..*params };
            let layers = reference::layers(&scene.input(), &params, [x, y], &scene.values, [1, 3]);
            let exact = reference::composite(&layers, 1, 3);
            let colors =
                exact.values.iter().zip(&picture.channels).map(|(sum, plane)| (sum - f64::from(plane[k])).abs());
            let opacity = (1.0 - exact.transmittance[0] - f64::from(alpha(&picture, k))).abs();
            (colors.fold(opacity, f64::max), layers.len())
        };
        let (same, layers) = difference(1.0);
        met += layers;
        let least = [1.0 - 1e-4, 1.0 + 1e-4].map(|factor| difference(factor).0).into_iter().fold(same, f64::min);
        assert!(least < 2e-5, "pixel {x} {y}: {least:e}");
    }
    assert!(met > (width * height / 4) as usize, "{met} layers");
}

#[test]
fn every_pixel_is_the_twins() {
    let params = Params { transmittance_cutoff: 0.0, ..Params::default() };
    let size = [40, 30];
    let views = [camera(DVec3::new(0.4, 0.3, 4.0), size), parallel(DVec3::new(0.4, 0.3, 4.0), 2.5, size)];
    for view in views {
        agrees_with_the_twin(&Scene::new(soup(300, 1.0), view), &params);
    }
    let mut cloud = Cloud::new(DVec3::ZERO);
    sphere(&mut cloud, Vec3::ZERO, 1.0, 500, 0.5);
    agrees_with_the_twin(&Scene::new(cloud, camera(DVec3::new(0.0, 0.5, 3.0), size)), &params);
}

/// The eye is among the discs: behind some, on some, and some reach through its plane.
#[test]
fn db14_discs_edge_on_and_through_the_eye_plane_are_met_where_rays_meet_them() {
    let params = Params { transmittance_cutoff: 0.0, ..Params::default() };
    let mut cloud = soup(300, 0.5);
    for k in 0..20 {
        // Edge-on for the middle of the image, to the last bit.
        let place = Vec3::new(0.0, 0.02 * (k - 10) as f32, -0.5) - cloud.origin.as_vec3();
        cloud.push(&disc(place, Vec3::Y, 0.1, 0.4));
    }
    for view in [camera(DVec3::new(0.05, 0.0, 0.1), [40, 30]), camera(DVec3::new(0.0, 0.0, 0.4), [41, 31])] {
        agrees_with_the_twin(&Scene::new(cloud.clone(), view), &params);
    }
}

/// A plane that is seen at some angle, larger than the view.
fn tilted(angle: f32, half: i32, opacity: f32) -> Cloud {
    let mut cloud = Cloud::new(DVec3::ZERO);
    let normal = Vec3::new(0.3 * libm::sinf(angle), libm::sinf(angle), libm::cosf(angle));
    plane(&mut cloud, Vec3::ZERO, normal, half, &disc(Vec3::ZERO, normal, 0.1, opacity));
    cloud
}

#[test]
fn db3_a_tilted_plane_attenuates_once_in_every_pixel() {
    for (angle, gap) in [(0.0, 0.5), (0.5, 0.5), (1.0, 0.5), (0.9, 0.5), (1.0, 0.05), (1.0, 2.0)] {
        for disc_scale in [0.45, 0.6, 1.0] {
            let scene = Scene::new(tilted(angle, 120, 0.5), camera(DVec3::new(0.0, 0.0, 3.0), [48, 36]));
            let picture = scene.draw(&Params { gap, disc_scale, ..Params::default() });
            for k in 0..48 * 36 {
                let got = alpha(&picture, k);
                assert!((got - 0.5).abs() < 1e-6, "angle {angle}, ε {gap}, scale {disc_scale}, pixel {k}: {got}");
            }
        }
    }
}

#[test]
fn n_planes_let_the_product_through() {
    let mut cloud = Cloud::new(DVec3::ZERO);
    for k in 0..12 {
        let normal = Vec3::new(0.1, 0.05 * k as f32, 1.0);
        plane(&mut cloud, Vec3::Z * (0.8 * k as f32 - 9.0), normal, 60, &disc(Vec3::ZERO, normal, 0.2, 0.5));
    }
    let scene = Scene::new(cloud, camera(DVec3::new(0.0, 0.0, 2.0), [32, 24]));
    let picture = scene.draw(&Params { transmittance_cutoff: 0.0, ..Params::default() });
    for tau in &picture.optical_depth[0] {
        let through = libm::exp(-f64::from(*tau));
        assert!((through / 0.5f64.powi(12) - 1.0).abs() < 1e-5, "{through}");
    }
}

#[test]
fn db1_one_color_in_is_that_color_out() {
    let mut cloud = soup(400, 1.0);
    cloud.color.fill([0.7, 0.7, 0.7]);
    let scene = Scene::new(cloud, camera(DVec3::new(0.0, 0.0, 4.0), [48, 36]));
    for disc_scale in [0.45, 0.7, 1.0] {
        // So wide a gap that all discs of a pixel are one layer.
        let picture = scene.draw(&Params { disc_scale, gap: 4.0, ..Params::default() });
        let mut seen = 0;
        for k in (0..48 * 36).filter(|k| picture.optical_depth[0][*k] > 0.0) {
            let of_opaque = picture.channels[0][k] / alpha(&picture, k);
            assert!((of_opaque - 0.7).abs() < 4e-7, "pixel {k}: {of_opaque}");
            seen += 1;
        }
        assert!(seen > 200, "{seen} pixels");
    }
}

#[test]
fn a_layer_that_only_rims_touch_is_none() {
    let mut cloud = Cloud::new(DVec3::ZERO);
    cloud.push(&disc(Vec3::ZERO, Vec3::Z, 1.0 / 2.4, 0.5));
    let scene = Scene::new(cloud, parallel(DVec3::Z, 2.0, [200, 200]));
    for disc_scale in [0.45, 0.6, 1.0] {
        let picture = scene.draw(&Params { disc_scale, ..Params::default() });
        let covered = picture.optical_depth[0].iter().filter(|tau| **tau > 0.0).count() as f32 / 1e4;
        let expected = std::f32::consts::PI * 0.45 * 0.45;
        assert!((covered - expected).abs() < 0.01, "{covered}, {expected}");
    }
}

#[test]
fn db2_layers_look_alike_at_every_distance() {
    let picture = |exponent: i32| {
        let scale = 2f32.powi(exponent);
        let mut cloud = tilted(0.8, 40, 0.5);
        cloud.color.iter_mut().enumerate().for_each(|(k, color)| color[0] = (k % 7) as f32);
        cloud.position.iter_mut().for_each(|p| *p *= scale);
        cloud.radius.iter_mut().for_each(|r| *r *= scale);
        cloud.cross_section.iter_mut().for_each(|a| *a *= scale * scale);
        let scene = Scene::new(cloud, camera(DVec3::new(0.0, 0.0, 3.0 * f64::from(scale)), [32, 24]));
        let picture = scene.draw(&Params::default());
        (picture.optical_depth, picture.channels)
    };
    let one = picture(0);
    for exponent in [-20, -10, 10, 20] {
        assert_eq!(picture(exponent), one, "2^{exponent}");
    }
}

/// Two planes meet in a line: on either side there are two layers, near the line one.
#[test]
fn db17_layers_part_where_their_planes_do() {
    let mut cloud = Cloud::new(DVec3::ZERO);
    let spacing = 0.05;
    for slope in [0.0, 0.3] {
        let normal = Vec3::new(-slope, 0.0, 1.0);
        plane(&mut cloud, Vec3::ZERO, normal, 60, &disc(Vec3::ZERO, normal, spacing, 0.5));
    }
    let scene = Scene::new(cloud, parallel(DVec3::Z * 3.0, 0.1, [160, 8]));
    let params = Params::default();
    let picture = scene.draw(&params);
    // ε of the discs' radius is 0.5 · 0.6 · 2.4 spacings; the planes part by 0.3·x, a little less across their normals.
    let parts = 0.5 * 0.6 * 2.4 * spacing / 0.3;
    for k in 0..160 * 8 {
        let x = ((k % 160) as f32 + 0.5) / 80.0 - 1.0;
        let expected = if x.abs() < 0.9 * parts { 0.5 } else { 0.75 };
        let got = alpha(&picture, k);
        let between = x.abs() < 1.2 * parts && (0.5..=0.75).contains(&got);
        assert!((got - expected).abs() < 1e-5 || between, "x {x}: {got}");
    }
}

#[test]
fn db13_normals_that_point_the_wrong_way_change_nothing() {
    let mut cloud = Cloud::new(DVec3::ZERO);
    sphere(&mut cloud, Vec3::ZERO, 1.0, 800, 0.4);
    let view = camera(DVec3::new(0.0, 0.5, 3.0), [48, 36]);
    let one = Scene::new(cloud.clone(), view).draw(&Params::default());
    cloud.normal.iter_mut().step_by(3).for_each(|n| *n = -*n);
    let two = Scene::new(cloud, view).draw(&Params::default());
    for (a, b) in one.optical_depth[0].iter().zip(&two.optical_depth[0]) {
        assert!((a - b).abs() < 1e-5, "{a} {b}");
    }
}

#[test]
fn ten_thousand_discs_at_one_place_are_one_layer() {
    let mut cloud = Cloud::new(DVec3::ZERO);
    (0..10_000).for_each(|_| cloud.push(&disc(Vec3::ZERO, Vec3::Z, 1.0, 0.5)));
    let picture = Scene::new(cloud, camera(DVec3::Z * 3.0, [16, 16])).draw(&Params::default());
    assert!((alpha(&picture, 8 * 16 + 8) - 0.5).abs() < 1e-6);
}

#[test]
fn layers_end_at_what_is_opaque_and_go_on_behind_what_is_there() {
    let mut cloud = Cloud::new(DVec3::ZERO);
    for z in [1.0, 0.0, -1.0] {
        plane(&mut cloud, Vec3::Z * z, Vec3::Z, 40, &disc(Vec3::ZERO, Vec3::Z, 0.1, 0.5));
    }
    let scene = Scene::new(cloud, parallel(DVec3::Z * 3.0, 1.0, [8, 8]));
    let mut picture = Accumulator::new([8, 8], 1, 3, true, true);
    let wall = [3.5; 64];
    scene.draw_into(&Params::default(), &wall, &mut picture);
    assert!((alpha(&picture, 0) - 0.75).abs() < 1e-6);
    assert!((picture.channels[0][0] - 0.7 * 0.75).abs() < 1e-6);
    scene.draw_into(&Params::default(), &[], &mut picture);
    assert!((alpha(&picture, 0) - (1.0 - 0.5f32.powi(5))).abs() < 1e-6);
    let [first, median, ..] = picture.depth[0].depths(picture.optical_depth[0][0], None);
    assert!((first - 2.0).abs() < 1e-5 && (median - 2.0).abs() < 1e-5, "{first} {median}");
}

#[test]
fn colors_of_discs_weigh_by_their_opacity() {
    let mut cloud = Cloud::new(DVec3::ZERO);
    let one = disc(Vec3::ZERO, Vec3::Z, 1.0, 0.9);
    cloud.push(&Splat { color: [1.0, 0.0, 0.0], ..one });
    cloud.push(&Splat { color: [0.0, 1.0, 0.0], ..disc(Vec3::ZERO, Vec3::Z, 1.0, 0.1) });
    let picture = Scene::new(cloud, parallel(DVec3::Z * 3.0, 0.1, [1, 1])).draw(&Params::default());
    assert!((alpha(&picture, 0) - 0.5).abs() < 1e-6);
    assert!((picture.channels[0][0] - 0.45).abs() < 1e-6 && (picture.channels[1][0] - 0.05).abs() < 1e-6);
}

#[test]
fn threads_and_the_order_of_discs_change_nothing() {
    let mut scene = Scene::new(soup(2000, 1.0), camera(DVec3::new(0.0, 0.0, 4.0), [100, 70]));
    let draw = |scene: &Scene, threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        let picture = pool.install(|| scene.draw(&Params::default()));
        (picture.optical_depth, picture.channels, picture.object)
    };
    let one = draw(&scene, 1);
    for threads in [2, 3, 7] {
        assert_eq!(draw(&scene, threads), one, "{threads} threads");
    }
    scene.ids.reverse();
    assert_eq!(draw(&scene, 2), one);
}

#[test]
fn parameters_out_of_range_are_named() {
    let good = Params::default();
    for bad in [
        Params { disc_scale: 0.3, ..good },
        Params { disc_scale: f32::NAN, ..good },
        Params { gap: 0.0, ..good },
        Params { gap: 5.0, ..good },
        Params { transmittance_cutoff: 1.0, ..good },
    ] {
        assert!(bad.check().is_err(), "{bad:?}");
    }
}
