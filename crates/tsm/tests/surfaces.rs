//! TS15: no shadow acne, and contact shadows; opaque shadows without holes.

use crate::common::*;
use splat_core::glam::{DVec3, Vec3};
use splat_core::{Receiver, SplatKind, Transmittance};
use tsm::{MappingChoice, Params, Resolution};

#[test]
fn ts15_plane_lit_at_any_angle_has_no_acne() {
    let h = 0.05;
    for kind in [SplatKind::Opaque, SplatKind::Surface] {
        let cloud = plane(Vec3::ZERO, Vec3::new(0.2, 1.0, -0.1), 60, h, kind, 1.0);
        let normal = cloud.normal_of(0).as_dvec3();
        let side = normal.any_orthonormal_vector();
        for degrees in [1.0f64, 10.0, 30.0, 45.0, 60.0, 75.0, 85.0, 89.0] {
            let (s, c) = degrees.to_radians().sin_cos();
            let towards = normal * c + side * s;
            for cells in [12, 60, 240, 720] {
                let params = Params { resolution: Resolution::Cells(cells), ..Params::default() };
                for light in [point_light(towards * 8.0), directional(-towards)] {
                    let map = build(&cloud, &light, &params);
                    let dark = (0..cloud.len()).filter(|&i| map.transmittance(&receiver(&cloud, i))[0] < 0.999).count();
                    let share = dark as f64 / cloud.len() as f64;
                    assert!(share <= 1e-3, "{kind:?} at {degrees}° in {cells} cells, {:?}: {share}", light.shape);
                }
            }
        }
    }
}

#[test]
fn ts15_octahedral_cells_of_any_width_have_no_acne() {
    let h = 0.05;
    let cloud = plane(Vec3::ZERO, Vec3::Y, 60, h, SplatKind::Opaque, 1.0);
    for degrees in [5.0f64, 45.0, 80.0] {
        let (s, c) = degrees.to_radians().sin_cos();
        for cells in [16, 64, 256, 1024] {
            let resolution = Resolution::Cells(cells);
            for mapping in [MappingChoice::Octahedral, MappingChoice::PolarAzimuth] {
                let params = Params { resolution, mapping, ..Params::default() };
                let map = build(&cloud, &point_light(DVec3::new(s, c, 0.1) * 4.0), &params);
                let dark = (0..cloud.len()).filter(|&i| map.transmittance(&receiver(&cloud, i))[0] < 0.999).count();
                assert!(dark as f64 <= 1e-3 * cloud.len() as f64, "{mapping:?} {degrees}° {cells}: {dark}");
            }
        }
    }
}

#[test]
fn ts15_contact_shadow_starts_within_a_splat_of_the_wall() {
    let h = 0.05;
    let mut cloud = plane(Vec3::ZERO, Vec3::Y, 40, h, SplatKind::Opaque, 1.0);
    let floor = cloud.len();
    // A wall of spacing h standing on the floor at x = 0, 20 splats high.
    let mut wall = plane(Vec3::new(0.0, 20.0 * h, 0.0), Vec3::X, 40, h, SplatKind::Opaque, 1.0);
    let keep: Vec<u32> = (0..wall.len() as u32).filter(|&i| wall.position[i as usize].y > 0.2 * h).collect();
    wall = wall.gather(&keep);
    cloud.append(&wall);
    for light in [directional(DVec3::new(1.0, -1.0, 0.0)), point_light(DVec3::new(-6.0, 6.0, 0.0))] {
        let map = build(&cloud, &light, &Params::default());
        let light_on = |x: f32| {
            map.transmittance(&Receiver { position: Vec3::new(x, 0.0, 0.013), normal: Vec3::Y, ..receiver(&cloud, 0) })
                [0]
        };
        assert!(light_on(1.5 * h) < 0.05, "{} at the foot of the wall", light_on(1.5 * h));
        assert!(light_on(10.0 * h) < 1e-3 && light_on(-2.0 * h) > 0.99);
    }
    assert!(floor > 0);
}

#[test]
fn opaque_sheets_have_no_holes() {
    let h = 0.05;
    let cloud = plane(Vec3::Z * 3.0, Vec3::new(0.3, 0.1, -1.0), 40, h, SplatKind::Opaque, 1.0);
    for resolution in [Resolution::Auto, Resolution::Cells(64), Resolution::Cells(2000)] {
        for mapping in [MappingChoice::Auto, MappingChoice::Octahedral] {
            let map = build(&cloud, &point_light(DVec3::ZERO), &Params { resolution, mapping, ..Params::default() });
            for i in 0..5000 {
                let u = |k| splat_core::rng::unit_f32(4, 0, i, k) - 0.5;
                assert_eq!(light_at(&map, Vec3::new(3.0 * u(0), 3.0 * u(1), 5.0)), 0.0);
            }
        }
    }
}

#[test]
fn an_opaque_disc_of_any_number_of_cells_hides_as_far_as_its_dilated_area_and_no_farther() {
    let params = Params { resolution: Resolution::Cells(64), ..Params::default() };
    // The table is no wider than the diagonal between two small splats.
    let cell = 8f32.sqrt() / 64.0;
    // Upright, and seen from the side, so that it is three times as wide as high, or as high as wide.
    for (across, seen) in (2..30).flat_map(|n| [[1.0f32, 1.0], [1.0, 0.3], [0.3, 1.0]].map(|seen| (n, seen))) {
        let shadow = 0.5 * across as f32 * cell;
        let least = seen[0].min(seen[1]);
        let lean = (1.0 - least * least).sqrt();
        let normal = if seen[0] < 1.0 { Vec3::new(lean, 0.0, least) } else { Vec3::new(0.0, lean, least) };
        let splat = |position, shadow: f32| splat_core::Splat {
            position,
            radius: shadow,
            normal,
            cross_section: std::f32::consts::PI * (shadow / params.opaque_dilation).powi(2),
            kind: SplatKind::Opaque,
            ..splat_core::Splat::default()
        };
        let mut cloud = splat_core::Cloud::new(DVec3::ZERO);
        cloud.push(&splat(Vec3::new(0.01, 0.017, 0.0), shadow));
        [-1.0, 1.0].iter().for_each(|at| cloud.push(&splat(Vec3::new(*at, *at, 0.0), 1e-3)));
        let map = build(&cloud, &directional(-DVec3::Z), &params);
        for i in 0..2000 {
            let u = |k| 1.8 * (splat_core::rng::unit_f32(6, across, i, k) - 0.5);
            let place = Vec3::new(u(0), u(1), -1.0);
            let from_middle = place - cloud.position[0];
            let beyond = (from_middle.x / seen[0]).hypot(from_middle.y / seen[1]) - shadow;
            let light = light_at(&map, place);
            let expected = if beyond > 0.0 { 1.0 } else { 0.0 };
            let what = || format!("{across} cells, {seen:?}, {beyond} beyond its rim: {light}");
            assert!(beyond.abs() * least < cell || light == expected, "{}", what());
        }
    }
}

#[test]
fn a_sphere_of_discs_is_lit_before_the_terminator_and_dark_behind() {
    let mut cloud = splat_core::Cloud::new(DVec3::ZERO);
    let n = 20_000u64;
    let h = (4.0 * std::f32::consts::PI / n as f32).sqrt();
    for i in 0..n {
        // A Fibonacci sphere: even spacing.
        let z = 1.0 - (2.0 * i as f32 + 1.0) / n as f32;
        let (s, c) = (i as f64 * 2.399_963_229_728_653).sin_cos();
        let r = (1.0 - z * z).sqrt();
        let normal = Vec3::new(r * c as f32, r * s as f32, z);
        cloud.push(&splat_core::Splat {
            position: normal,
            normal,
            radius: 2.4 * h,
            cross_section: h * h,
            kind: SplatKind::Opaque,
            ..splat_core::Splat::default()
        });
    }
    let map = build(&cloud, &point_light(DVec3::Z * 4.0), &Params::default());
    let mut wrong = 0;
    let mut counted = 0;
    for i in 0..cloud.len() {
        let light = map.transmittance(&receiver(&cloud, i))[0];
        let cosine = cloud.position[i].dot((Vec3::Z * 4.0 - cloud.position[i]).normalize());
        // Nearer to the terminator, the silhouette lies within one cell.
        if cosine.abs() > 0.25 {
            counted += 1;
            wrong += u32::from((light - f32::from(u8::from(cosine > 0.0))).abs() > 0.01);
        }
    }
    assert!(f64::from(wrong) <= 1e-3 * f64::from(counted), "{wrong} of {counted}");
}
