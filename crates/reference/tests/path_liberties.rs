//! What a scene may ask otherwise than nature: shadows left out or weakened, and more light than arrives. Closed forms; a
//! pixel is held to 4.5 of its standard errors (two-sided 7e-6).

use crate::support::{assert_mean, parallel, quad, trace};
use reference::{
    Density, Estimate, Liberty, LightSource, MarchParams, Medium, PathRules, PathSettings, PixelSampling, Scene,
    Surface, SurfaceMaterial, march_image, path_trace,
};
use splat_core::glam::{DVec3, Vec3};
use splat_core::{Camera, DAabb};
use std::f64::consts::PI;

const ALBEDO: f64 = 0.5;

fn settings(samples: u32) -> PathSettings {
    let rules =
        PathRules { max_bounces: Some(1), lights_visible: false, emission_illuminates: false, ..PathRules::default() };
    PathSettings { seed: 5, samples, batch: samples, rules, pixel: PixelSampling::Center, ..PathSettings::default() }
}

fn flat(height: f32, half: f32) -> splat_core::Mesh {
    let corner = |x: f32, z: f32| Vec3::new(x * half, height, z * half);
    quad([corner(-1.0, 1.0), corner(1.0, 1.0), corner(1.0, -1.0), corner(-1.0, -1.0)])
}

/// From the side, below the blocker, onto the middle of the ground.
fn camera() -> Camera {
    parallel(DVec3::new(0.0, 0.6, 3.0), DVec3::ZERO, 0.1, [3, 3])
}

fn sun() -> LightSource {
    LightSource::Directional { direction: DVec3::NEG_Y, irradiance: [2.0, 1.0, 0.5] }
}

/// The ground under a blocker that hides the sun from it.
fn ground(unshadowed: Vec<bool>, of_ground: Liberty, of_blocker: Liberty, light: LightSource) -> Estimate {
    let floor = flat(0.0, 5.0);
    let lid = flat(1.0, 0.5);
    let material = |liberty| SurfaceMaterial { diffuse: [ALBEDO; 3], liberty, ..SurfaceMaterial::default() };
    let surfaces = vec![
        Surface { mesh: &floor, material: material(of_ground) },
        Surface { mesh: &lid, material: material(of_blocker) },
    ];
    let scene = Scene { surfaces, lights: vec![light], unshadowed, ..Scene::default() };
    trace(&scene, &camera(), &settings(4096))
}

fn lit(share: f64) -> impl Fn(usize) -> [f64; 3] {
    move |_| [2.0, 1.0, 0.5].map(|e| share * ALBEDO * e / PI)
}

#[test]
fn what_casts_no_shadow_and_what_receives_part_of_it() {
    let nature = Liberty::default();
    assert_mean(&ground(Vec::new(), nature, nature, sun()), lit(0.0), 4.5, "shadow");
    assert_mean(&ground(vec![true], nature, nature, sun()), lit(1.0), 4.5, "a light without shadows");
    let ghost = Liberty { casts_shadow: false, ..nature };
    assert_mean(&ground(Vec::new(), nature, ghost, sun()), lit(1.0), 4.5, "a blocker without shadow");
    assert_mean(&ground(Vec::new(), ghost, nature, sun()), lit(0.0), 4.5, "the ground's own shadow does not matter");
    for k in [0.0, 0.25, 1.0] {
        let part = Liberty { shadow_coefficient: k, ..nature };
        assert_mean(&ground(Vec::new(), part, nature, sun()), lit(1.0 - k), 4.5, "a share of shadow");
    }
    let bright = Liberty { gain: 3.0, ..nature };
    assert_mean(&ground(vec![true], bright, nature, sun()), lit(3.0), 4.5, "gain");
}

#[test]
fn media_that_cast_no_shadow_are_seen_all_the_same() {
    let floor = flat(0.0, 5.0);
    let surfaces = vec![Surface {
        mesh: &floor,
        material: SurfaceMaterial { diffuse: [ALBEDO; 3], ..SurfaceMaterial::default() },
    }];
    // A black slab over the ground, between it and both the sun and the eye: the eye's path is 0.2·√(1 + 25).
    let slab = Density::Box(DAabb::new(DVec3::new(-5.0, 0.1, -5.0), DVec3::new(5.0, 0.3, 5.0)));
    let seen = (-2.0 * 0.2 * (1.0f64 + 25.0).sqrt()).exp();
    for (casts_shadow, arrives) in [(true, (-2.0f64 * 0.2).exp()), (false, 1.0)] {
        let liberty = Liberty { casts_shadow, ..Liberty::default() };
        let media = vec![Medium { liberty, ..Medium::new(slab, 2.0, 0.0) }];
        let scene = Scene { media, surfaces: surfaces.clone(), lights: vec![sun()], ..Scene::default() };
        assert_mean(&trace(&scene, &camera(), &settings(20_000)), lit(seen * arrives), 4.5, "slab");
    }
}

#[test]
fn area_lights_without_shadows_are_as_bright_as_those_with() {
    let rect = LightSource::Rect { center: DVec3::Y * 0.8, u: DVec3::X * 0.6, v: DVec3::Z * 0.6, radiance: [3.0; 3] };
    let nature = Liberty::default();
    // The lid stands above the light. So freedom changes the method alone: no ray that meets the light counts.
    let free = Liberty { casts_shadow: false, ..nature };
    let a = ground(Vec::new(), nature, nature, rect);
    let b = ground(Vec::new(), nature, free, rect);
    for k in 0..9 {
        let x = a.radiance.mean[k][0];
        let y = b.radiance.mean[k][0];
        let error = a.radiance.standard_error[k][0].hypot(b.radiance.standard_error[k][0]);
        assert!((x - y).abs() < 4.5 * error && error < 0.02 * x, "{k}: {x} and {y} ± {error}");
    }
    assert!(a.radiance.mean[4][0] > 0.1);
}

#[test]
fn around_a_lamp_inside_a_medium_shadow_is_linear_in_its_coefficient_and_gain_a_factor() {
    let camera = parallel(DVec3::Z * 5.0, DVec3::ZERO, 1.2, [2, 2]);
    let ball = Density::Ball { center: DVec3::ZERO, radius: 1.0 };
    let lamp = LightSource::Point { position: DVec3::new(0.05, 0.0, 0.1), intensity: [1.0; 3] };
    let radiance = |liberty: Liberty, unshadowed: bool| {
        let media = vec![Medium { liberty, ..Medium::new(ball, 2.0, 0.9) }];
        let scene = Scene { media, lights: vec![lamp], unshadowed: vec![unshadowed], ..Scene::default() };
        trace(&scene, &camera, &settings(40_000)).radiance
    };
    let nature = Liberty::default();
    let share = |k: f64| radiance(Liberty { shadow_coefficient: k, ..nature }, false);
    let none = share(0.0);
    let half = share(0.5);
    let full = share(1.0);
    let free = radiance(nature, true);
    let ghost = radiance(Liberty { casts_shadow: false, ..nature }, false);
    let bright = radiance(Liberty { gain: 4.0, ..nature }, false);
    for k in 0..4 {
        let at = |s: &reference::Statistics| (s.mean[k][0], s.standard_error[k][0]);
        let same = |a: (f64, f64), b: (f64, f64), what: &str| {
            assert!((a.0 - b.0).abs() < 4.5 * a.1.hypot(b.1), "{what}, pixel {k}: {a:?} and {b:?}");
        };
        let middle = (0.5 * (at(&none).0 + at(&full).0), 0.5 * at(&none).1.hypot(at(&full).1));
        same(at(&half), middle, "half of the shadow");
        same(at(&free), at(&none), "a lamp without shadows");
        same(at(&ghost), at(&none), "a medium without shadow");
        same(at(&bright), (4.0 * at(&full).0, 4.0 * at(&full).1), "gain");
        assert!(at(&none).0 > at(&full).0 + 10.0 * at(&none).1, "shadows matter here");
    }
}

#[test]
fn what_cannot_be_followed_is_refused() {
    let ball = Density::Ball { center: DVec3::ZERO, radius: 1.0 };
    let scene_with = |liberty| Scene {
        media: vec![Medium { liberty, ..Medium::new(ball, 1.0, 0.5) }],
        lights: vec![sun()],
        ..Scene::default()
    };
    let camera = camera();
    let traced = |scene: &Scene<'_>, rules| {
        path_trace(scene, &camera, &PathSettings { samples: 2, rules, ..PathSettings::default() }, None)
    };
    let bright = scene_with(Liberty { gain: 2.0, ..Liberty::default() });
    assert!(traced(&bright, PathRules::default()).unwrap_err().to_string().contains("bounces"));
    assert!(traced(&bright, PathRules { max_bounces: Some(3), ..PathRules::default() }).is_ok());
    for bad in [
        Liberty { gain: f64::NAN, ..Liberty::default() },
        Liberty { gain: -1.0, ..Liberty::default() },
        Liberty { shadow_coefficient: 1.5, ..Liberty::default() },
    ] {
        assert!(traced(&scene_with(bad), PathRules::default()).is_err(), "{bad:?}");
    }
    let two = Scene { unshadowed: vec![true, false], ..scene_with(Liberty::default()) };
    assert!(traced(&two, PathRules::default()).is_err());
    // The marcher follows nature alone.
    let marched = |scene: &Scene<'_>| march_image(scene, &camera, &MarchParams::default(), None);
    assert!(marched(&scene_with(Liberty::default())).is_ok());
    assert!(marched(&bright).is_err());
    assert!(marched(&Scene { unshadowed: vec![true], ..scene_with(Liberty::default()) }).is_err());
}
