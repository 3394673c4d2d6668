//! Points of extended lights against the irradiance of the whole lights in closed form.
//!
//! The errors that are allowed are about twice those that are found, at distances of half the light's width and more. They fall
//! with the square of the number of points of a disk on its axis, and with the number of those of a rectangle; those of a sphere
//! are 0.1 by 16 points at half its radius above it, and 0.002 by 256 and more.

use splat_core::glam::DVec3;
use splat_core::{Light, LightShape};
use std::f64::consts::PI;

/// Irradiance at `p` on a plane with this normal by `n` points of a light of intensity 1, and what one light gives there by
/// formula, over each other, minus 1.
fn error(shape: LightShape, n: u32, [p, normal]: [DVec3; 2], exact: f64) -> f64 {
    let light = Light { shape, intensity: [1.0; 3] };
    let received = |point: &Light| {
        point.validate(0).expect("a light");
        let light = point.irradiance(p, 0.0);
        f64::from(light.irradiance[1]) * light.to_light.dot(normal).max(0.0)
    };
    light.points(n).iter().map(received).sum::<f64>() / exact - 1.0
}

/// A turned frame, so that no axis is special.
const FRAME: [DVec3; 3] = [DVec3::new(0.36, 0.48, -0.8), DVec3::new(-0.8, 0.6, 0.0), DVec3::new(0.48, 0.64, 0.6)];
const CENTER: DVec3 = DVec3::new(3.0, -1.0, 0.5);

/// Holds the errors of rising numbers of points against what each may be.
fn check(what: &str, allowed: &[(u32, f64)], error: impl Fn(u32) -> f64) {
    let found: Vec<(u32, f64)> = allowed.iter().map(|(n, _)| (*n, error(*n).abs())).collect();
    println!("{what}: {found:?}");
    assert!(found.iter().zip(allowed).all(|(found, most)| found.1 < most.1), "{what}: {found:?}, allowed {allowed:?}");
}

#[test]
fn points_of_a_disk_tend_to_pi_l_sine_squared_on_its_axis() {
    let [_, _, z] = FRAME;
    for (radius, height) in [(1.0, 4.0), (1.0, 1.0), (2.0, 1.0)] {
        let disk = LightShape::Disk { center: CENTER, normal: z, radius };
        let p = CENTER + z * height;
        let l = 1.0 / (PI * radius * radius);
        let exact = PI * l * radius * radius / (radius * radius + height * height);
        let allowed = [(16, 1e-2), (256, 4e-5), (4096, 2e-7)];
        check("disk", &allowed, |n| error(disk, n, [p, -z], exact));
        // Behind it there is none.
        assert_eq!(error(disk, 256, [CENTER - z * height, z], 1.0), -1.0);
    }
}

/// ∫cos cos'/d² over a rectangle a × b, from a point at height c below its corner that faces it, over π: the form factor.
fn corner(a: f64, b: f64, c: f64) -> f64 {
    let x = a / c;
    let y = b / c;
    let side = |x: f64, y: f64| x / x.hypot(1.0) * (y / x.hypot(1.0)).atan();
    (side(x, y) + side(y, x)) / (2.0 * PI)
}

#[test]
fn points_of_a_rectangle_tend_to_the_form_factor_below_its_corner() {
    let [x, y, z] = FRAME;
    for (a, b, c) in [(1.0, 1.0, 2.0), (2.0, 1.0, 1.0), (1.0, 3.0, 1.5)] {
        let u = x * (0.5 * a);
        let v = y * (0.5 * b);
        let rect = LightShape::Rect { center: CENTER, u, v };
        let p = CENTER + u + v + z * c;
        let exact = PI * corner(a, b, c) / (a * b);
        let allowed = [(16, 0.2), (256, 0.01), (4096, 1e-3), (65536, 1e-4)];
        check("rect", &allowed, |n| error(rect, n, [p, -z], exact));
        assert_eq!(error(rect, 256, [CENTER - z * c, z], 1.0), -1.0);
    }
}

#[test]
fn points_of_a_sphere_give_what_a_point_at_its_centre_gives_outside_of_it() {
    let [x, _, z] = FRAME;
    let sphere = LightShape::Sphere { center: CENTER, radius: 1.0 };
    for distance in [1.5, 3.0, 10.0] {
        let p = CENTER + (x * 0.6 + z * 0.8) * distance;
        let normal = (CENTER - p).normalize();
        let allowed = [(16, 0.2), (256, 5e-3), (4096, 4e-3), (65536, 1e-3)];
        check("sphere", &allowed, |n| error(sphere, n, [p, normal], 1.0 / (distance * distance)));
    }
}

#[test]
fn extended_lights_have_their_intensity_far_away_along_the_normal() {
    let [x, y, z] = FRAME;
    let far = CENTER + z * 1e4;
    for shape in [
        LightShape::Sphere { center: CENTER, radius: 1.0 },
        LightShape::Disk { center: CENTER, normal: z, radius: 1.0 },
        LightShape::Rect { center: CENTER, u: x, v: y },
    ] {
        for n in [1, 16, 1000] {
            assert!(error(shape, n, [far, -z], 1e-8).abs() < 1e-3, "{shape:?}");
        }
        // The whole light where nobody makes points of it.
        let whole = Light { shape, intensity: [1.0; 3] }.irradiance(far, 0.0).irradiance[1];
        assert!((f64::from(whole) / 1e-8 - 1.0).abs() < 1e-6);
    }
}

#[test]
fn points_of_a_sphere_project_to_an_even_disc() {
    let light = Light { shape: LightShape::Sphere { center: DVec3::ZERO, radius: 2.0 }, intensity: [6.0, 3.0, 0.0] };
    let points = light.points(4096);
    let total: f64 = points.iter().map(|l| f64::from(l.intensity[0])).sum();
    assert!((total - 6.0).abs() < 1e-5);
    for axis in [DVec3::X, DVec3::Y, DVec3::Z, DVec3::new(0.6, 0.8, 0.0)] {
        // An even disc of radius 2 has mean squared radius 2 and half of it within √2.
        let places = points.iter().filter_map(|l| l.shape.place());
        let rho_sq: Vec<f64> = places.map(|p| (p - axis * p.dot(axis)).length_squared()).collect();
        let mean = rho_sq.iter().sum::<f64>() / 4096.0;
        let half = rho_sq.iter().filter(|r| **r < 2.0).count() as f64 / 4096.0;
        assert!((mean - 2.0).abs() < 0.02, "{axis}: {mean}");
        assert!((half - 0.5).abs() < 0.02, "{axis}: {half}");
    }
}

#[test]
fn points_of_flat_lights_lie_on_them() {
    let center = DVec3::ONE;
    let normal = DVec3::new(0.0, 0.6, 0.8);
    let places = |shape, n| -> Vec<DVec3> {
        Light { shape, intensity: [1.0; 3] }.points(n).iter().filter_map(|l| l.shape.place()).collect()
    };
    for p in places(LightShape::Disk { center, normal, radius: 1.0 }, 64) {
        assert!((p - center).dot(normal).abs() < 1e-12 && (p - center).length() <= 1.0);
    }
    let points = places(LightShape::Rect { center, u: DVec3::X * 2.0, v: DVec3::Y }, 256);
    assert!(points.iter().all(|p| p.z == 1.0 && (p.x - 1.0).abs() <= 2.0 && (p.y - 1.0).abs() <= 1.0));
    let mean = points.iter().sum::<DVec3>() / 256.0;
    assert!((mean - center).length() < 1e-12, "{mean}");
    // What has no extent is one point, itself.
    let lamp = Light { shape: LightShape::Point { position: center }, intensity: [1.0; 3] };
    assert_eq!(lamp.points(16), [lamp]);
}
