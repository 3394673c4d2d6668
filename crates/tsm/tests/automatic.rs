//! TS10, TS12, TS16: the table that is chosen by itself, in any unit of length, for splats of any fineness.

use crate::common::*;
use splat_core::glam::{DVec3, Vec3};
use splat_core::{Cloud, Light, LightShape, Limits};
use tsm::{Deposits, Limit, Params, Resolution, Scene};

fn scaled(cloud: &Cloud, light: &Light, s: f64) -> (Cloud, Light) {
    let mut cloud = cloud.clone();
    let mut light = *light;
    let f = s as f32;
    cloud.origin *= s;
    cloud.position.iter_mut().for_each(|p| *p *= f);
    cloud.radius.iter_mut().for_each(|r| *r *= f);
    cloud.cross_section.iter_mut().for_each(|k| *k *= f * f);
    if let LightShape::Point { position } | LightShape::Spot { position, .. } = &mut light.shape {
        *position *= s;
    }
    (cloud, light)
}

/// Light on each splat, and behind everything along its ray.
fn shine(cloud: &Cloud, light: &Light, s: f64) -> Vec<f32> {
    let (cloud, light) = scaled(cloud, light, s);
    let map = build(&cloud, &light, &Params::default());
    let behind = |p: &Vec3| match light.shape {
        LightShape::Point { position } => position.as_vec3() + (*p - position.as_vec3()) * 2.0,
        LightShape::Directional { direction } => *p + direction.as_vec3() * (2.0 * s as f32),
        _ => *p,
    };
    let places = cloud.position.iter().copied().chain(cloud.position.iter().map(behind));
    places.map(|p| light_at(&map, p)).collect()
}

#[test]
fn ts12_tables_do_not_depend_on_the_unit_of_length() {
    // A square slab, whose table is a whole number of cells wide but for rounding, and random media.
    let slab = medium([30, 30, 4], 0.05, 3.0, |_| true);
    let mut random = mixed(4000, DVec3::ZERO);
    random.kind.fill(splat_core::SplatKind::Medium);
    let lights = [
        directional(DVec3::Z),
        directional(DVec3::new(0.3, -1.0, 0.7)),
        point_light(DVec3::new(0.3, 0.2, -5.0)),
        point_light(DVec3::new(0.03, 0.02, 0.01)),
    ];
    // Random media are steep: what rounding moves a place in a table of a thousand cells changes their light.
    let cases = [(&slab, 1e-5), (&random, 1e-4)];
    for ((cloud, bound), light) in cases.into_iter().flat_map(|c| lights.iter().map(move |l| (c, l))) {
        let base = shine(cloud, light, 1.0);
        for s in [1.3, 0.003] {
            let light_in = shine(cloud, light, s);
            let worst = light_in.iter().zip(&base).fold(0.0f32, |m, (a, b)| m.max((a - b).abs()));
            assert!(worst < bound, "{s}, {:?}: {worst:e}", light.shape);
        }
    }
}

/// Largest error of light behind a ball of radius 1 within 0.85 of its middle, and its root mean square over all.
fn errors(h: f32, light: &Light, sun: Vec3) -> (f64, f64, Limit) {
    let cloud = smooth_ball(h, 1.5, 1.0);
    let map = build(&cloud, light, &Params::default());
    let mut worst = 0.0f64;
    let mut square = 0.0;
    for i in 0..4000 {
        let u = |k| (splat_core::rng::unit_f32(2, 0, i, k) - 0.5) * 2.6;
        let to = Vec3::new(u(0), u(1), -1.6);
        let from = match light.shape {
            LightShape::Point { position } => position.as_vec3(),
            _ => to - sun * 6.0,
        };
        let error = f64::from(light_at(&map, to)) - (-1.5 * chord(from, to, 1.0)).exp();
        let way = (to - from).normalize();
        if (from - way * from.dot(way)).length() < 0.85 {
            worst = worst.max(error.abs());
        }
        square += error * error;
    }
    (worst, (square / 4000.0).sqrt(), map.prediction().limit)
}

#[test]
fn ts16_finer_splats_have_better_shadows() {
    let sun = Vec3::new(0.2, 0.1, -1.0).normalize();
    for light in [point_light(DVec3::new(0.3, 0.2, 4.0)), directional(sun.as_dvec3())] {
        let mut last = (f64::INFINITY, f64::INFINITY);
        let mut limits = Vec::new();
        for h in [0.12, 0.06, 0.03, 0.02] {
            let (worst, rms, limit) = errors(h, &light, sun);
            println!("{:?} h {h}: {worst:.4}, rms {rms:.4}, {limit:?}", light.shape);
            assert!(worst < last.0 && rms < last.1, "h {h}: {worst}, {rms}, not below {last:?}");
            (last, _) = ((worst, rms), limits.push(limit));
        }
        assert_eq!([limits[0], limits[3]], [Limit::Spacing, Limit::Entries]);
    }
}

#[test]
fn predictions_say_what_is_chosen_and_by_what() {
    let cloud = smooth_ball(0.06, 1.5, 1.0);
    for light in [point_light(DVec3::Z * 4.0), point_light(DVec3::ZERO), directional(DVec3::Z)] {
        let predicted = |params: &Params| Deposits::predict(&Scene::from(&cloud), &light, params).unwrap();
        let free = predicted(&Params::default());
        let map = build(&cloud, &light, &Params::default());
        assert_eq!(free, map.prediction());
        assert_eq!(free.size[0] * free.size[1], map.counts().cells);
        let ratio = free.entries / map.counts().entries as f64;
        assert!((0.6..1.4).contains(&ratio), "{:?}: {ratio}", light.shape);
        // Less memory, coarser cells that fit.
        let max_bytes = free.bytes / 3;
        let less = predicted(&Params { limits: Limits::bytes(max_bytes), ..Params::default() });
        assert!(less.limit == Limit::Memory && less.bytes <= max_bytes && less.size[0] < free.size[0], "{less:?}");
        assert_eq!(predicted(&Params { resolution: Resolution::Cells(32), ..Params::default() }).limit, Limit::Asked);
    }
}

#[test]
fn ts10_light_inside_a_ball_of_any_spacing() {
    let from = Vec3::new(0.013, 0.011, 0.009);
    for h in [0.1, 0.06, 0.04, 0.025] {
        let map = build(&smooth_ball(h, 1.5, 1.0), &point_light(from.as_dvec3()), &Params::default());
        let worst = (0..20_000).fold(0.0f64, |m, i| {
            let to = from + direction(3, i) * 2.0;
            m.max((f64::from(light_at(&map, to)) / (-1.5 * chord(from, to, 1.0)).exp() - 1.0).abs())
        });
        println!("h {h}: {worst:.4} {:?}", map.prediction());
        assert!(worst < 0.015, "h {h}: {worst}");
    }
}
