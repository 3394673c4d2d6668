//! X1-X4, TS12, TS14: threads, permutation, shift, scale, linearity, memory.

use crate::common::*;
use splat_core::glam::{DVec3, Vec3};
use splat_core::optics::FAINTEST;
use splat_core::{Cloud, Exceeded, Light, LightShape, Limits, Material, SplatKind, TOGETHER, Transmittance};
use tsm::{Deposits, Error, Limit, MappingChoice, Params, Resolution, Scene, ShadowMap};

fn lights() -> [Light; 4] {
    let position = DVec3::new(0.25, -0.5, 0.125);
    let direction = DVec3::new(0.0, -0.6, 0.8);
    [
        point_light(position),
        point_light(DVec3::new(0.5, 6.0, 1.0)),
        directional(DVec3::new(1.0, -2.0, 0.5)),
        Light {
            // A place that f64 holds at 10⁷, too.
            shape: LightShape::Spot { position: DVec3::new(0.0, 1.75, -2.375), direction, inner: 0.3, outer: 0.5 },
            intensity: [1.0; 3],
        },
    ]
}

fn shine(map: &ShadowMap, cloud: &Cloud) -> Vec<u32> {
    (0..cloud.len()).map(|i| map.transmittance(&receiver(cloud, i))[0].to_bits()).collect()
}

#[test]
fn x1_thread_counts_change_no_bit() {
    let cloud = mixed(20_000, DVec3::ZERO);
    for light in lights() {
        let maps = [1, 2, 3, 7].map(|threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| build(&cloud, &light, &Params::default()))
        });
        assert!(maps.iter().all(|m| *m == maps[0]));
    }
}

#[test]
fn splats_that_are_looked_up_together_get_the_bits_of_each() {
    let cloud = mixed(9000, DVec3::ZERO);
    let [thin, red] = [[1.0; 3], [1.0, 0.4, 0.1]];
    let lit = |light: &Light, extinction_rgb| {
        let scene = Scene { materials: &[Material { extinction_rgb, ..Material::default() }], ..Scene::from(&cloud) };
        ShadowMap::build(&scene, light, &Params::default(), None).unwrap()
    };
    // Some lie out of the spot's table, and some discs graze the light.
    let ids: Vec<usize> = (0..cloud.len()).rev().collect();
    for (light, extinction_rgb) in lights().into_iter().zip([thin, red, thin, red]) {
        let map = lit(&light, extinction_rgb);
        for several in [1, 5, TOGETHER] {
            for ids in ids.chunks(several) {
                let together = map.at_splats(ids, &|i| receiver(&cloud, i));
                for (i, light) in ids.iter().zip(together) {
                    assert_eq!(light, map.transmittance(&receiver(&cloud, *i)));
                }
            }
        }
    }
}

#[test]
fn x6_matter_too_faint_to_be_seen_leaves_no_trace() {
    let mut faint = mixed(9000, DVec3::ZERO);
    let mut thin = mixed(9000, DVec3::ZERO);
    for (cloud, of) in [(&mut faint, FAINTEST), (&mut thin, 4.0 * FAINTEST)] {
        cloud.kind.fill(SplatKind::Medium);
        cloud.cross_section.iter_mut().zip(&cloud.radius).for_each(|(k, radius)| *k = of * radius * radius);
    }
    for light in lights() {
        let entries = |scene: &Scene<'_>| {
            let deposits = Deposits::new(scene, &light, &Params::default(), None).unwrap();
            deposits.entries().iter().sum::<u64>()
        };
        assert!(entries(&Scene::from(&faint)) == 0 && entries(&Scene::from(&thin)) > 9000);
        // A material may make more of it.
        let materials = &[Material { extinction_rgb: [0.0, 4.0, 0.0], ..Material::default() }];
        assert!(entries(&Scene { materials, ..Scene::from(&faint) }) > 9000);
    }
}

#[test]
fn x4_shuffled_clouds_make_the_same_map() {
    let mut forward = mixed(9000, DVec3::ZERO);
    let ids: Vec<u32> = (0..forward.len() as u32).rev().collect();
    let mut backward = forward.gather(&ids);
    // Lists are order-free by themselves; only the mean radius of media needs the canonical order.
    forward.canonicalize();
    backward.canonicalize();
    for light in lights() {
        let [a, b] = [&forward, &backward].map(|c| build(c, &light, &Params::default()));
        assert!(a == b);
    }
}

#[test]
fn x2_shift_by_1e7_changes_nothing() {
    let shift = DVec3::new(1e7, -1e7, 1e7);
    let [near, far] = [DVec3::ZERO, shift].map(|origin| mixed(9000, origin));
    for light in lights() {
        let mut moved = light;
        match &mut moved.shape {
            LightShape::Point { position } | LightShape::Spot { position, .. } => *position += shift,
            _ => {}
        }
        let a = build(&near, &light, &Params::default());
        let b = build(&far, &moved, &Params::default());
        let worst = (0..near.len()).fold(0.0f32, |m, i| {
            m.max((a.transmittance(&receiver(&near, i))[0] - b.transmittance(&receiver(&far, i))[0]).abs())
        });
        assert_eq!(worst, 0.0, "{:?}", light.shape);
    }
}

fn scaled(cloud: &Cloud, s: f32) -> Cloud {
    let mut out = cloud.clone();
    out.origin *= f64::from(s);
    out.position.iter_mut().for_each(|p| *p *= s);
    out.radius.iter_mut().for_each(|r| *r *= s);
    out.cross_section.iter_mut().for_each(|k| *k *= s * s);
    out
}

#[test]
fn ts12_x3_scaling_by_powers_of_two_changes_no_bit() {
    let cloud = mixed(9000, DVec3::ZERO);
    for light in lights() {
        let base = shine(&build(&cloud, &light, &Params::default()), &cloud);
        for exponent in [-40, -10, 10, 40] {
            let s = 2f32.powi(exponent);
            let big = scaled(&cloud, s);
            let mut moved = light;
            match &mut moved.shape {
                LightShape::Point { position } | LightShape::Spot { position, .. } => *position *= f64::from(s),
                _ => {}
            }
            let map = build(&big, &moved, &Params::default());
            assert!(base == shine(&map, &big), "2^{exponent}, {:?}", light.shape);
        }
    }
}

#[test]
fn ts14_one_cell_works_and_a_huge_table_is_refused_with_its_bytes() {
    let cloud = mixed(1000, DVec3::ZERO);
    let light = lights()[1];
    for mapping in [MappingChoice::Octahedral, MappingChoice::PolarAzimuth, MappingChoice::Planar] {
        let params = |n| Params { mapping, resolution: Resolution::Cells(n), ..Params::default() };
        let map = build(&cloud, &light, &params(1));
        assert!((0..cloud.len()).all(|i| (0.0..=1.0).contains(&map.transmittance(&receiver(&cloud, i))[0])));
        let refused = ShadowMap::build(&Scene::from(&cloud), &light, &params(65_536 * 4), None).unwrap_err();
        let Error::Limit(Exceeded { needed, limit, unit: "bytes", .. }) = &refused else { panic!("{refused}") };
        assert!(Some(*needed) > *limit && refused.to_string().contains(&needed.to_string()));
    }
}

#[test]
fn what_maps_cost_together_is_known_before_any_is_built_and_held_while_they_are() {
    let cloud = mixed(20_000, DVec3::ZERO);
    let lights = lights();
    let params = Params::default();
    for light in &lights {
        let predicted = Deposits::predict(&Scene::from(&cloud), light, &params).unwrap();
        let map = build(&cloud, light, &params);
        assert_eq!(map.prediction(), predicted);
        let finished = map.counts().bytes;
        assert!((finished..=3 * finished).contains(&(2 * predicted.map_bytes)), "{finished}, {predicted:?}");
        // What deposits more than was predicted is held to the limit while it is made.
        let entries = map.counts().entries;
        let resolution = Resolution::Cells(predicted.size[0].max(predicted.size[1]) as u32);
        let short = Params { resolution, limits: Limits::bytes(10 * entries), ..params.clone() };
        let held = ShadowMap::build(&Scene::from(&cloud), light, &short, None);
        assert!(matches!(held, Err(Error::Limit(_))));
        // Cells that nobody asked for become coarser until their entries fit.
        let room = Params { limits: Limits { max_elements: entries - 1, ..params.limits }, ..params.clone() };
        let coarser = ShadowMap::build(&Scene::from(&cloud), light, &room, None).unwrap();
        assert!(coarser.counts().entries < entries && coarser.prediction().limit == Limit::Memory, "{coarser:?}");
    }
}

#[test]
fn bad_parameters_are_refused_by_name() {
    let cloud = mixed(10, DVec3::ZERO);
    let light = lights()[0];
    for (params, name) in [
        (Params { tolerance: 0.0, ..Params::default() }, "tolerance"),
        (Params { tolerance: f32::NAN, ..Params::default() }, "tolerance"),
        (Params { entries_per_splat: 0.5, ..Params::default() }, "entries_per_splat"),
        (Params { opaque_dilation: f32::INFINITY, ..Params::default() }, "opaque_dilation"),
        (Params { bias: -1.0, ..Params::default() }, "bias"),
        (Params { resolution: Resolution::Cells(0), ..Params::default() }, "resolution"),
        (Params { mapping: MappingChoice::Planar, ..Params::default() }, "mapping"),
    ] {
        let error = ShadowMap::build(&Scene::from(&cloud), &light, &params, None).unwrap_err();
        assert!(matches!(error, Error::Parameter { name: found, .. } if found == name), "{error}");
    }
    let broken = point_light(DVec3::new(f64::NAN, 0.0, 0.0));
    assert!(matches!(ShadowMap::build(&Scene::from(&cloud), &broken, &Params::default(), None), Err(Error::Core(_))));
}

#[test]
fn empty_clouds_cast_no_shadow_and_cancelled_builds_stop() {
    let empty = Cloud::new(DVec3::ZERO);
    for light in lights() {
        let map = build(&empty, &light, &Params::default());
        assert_eq!(light_at(&map, Vec3::new(0.3, 0.2, 0.1)), 1.0);
        assert_eq!(map.counts().entries, 0);
    }
    let progress = splat_core::Progress::new();
    progress.cancel();
    let cloud = mixed(100, DVec3::ZERO);
    let stopped = ShadowMap::build(&Scene::from(&cloud), &lights()[0], &Params::default(), Some(&progress));
    assert_eq!(stopped.unwrap_err(), Error::Core(splat_core::Error::Cancelled));
}

#[test]
fn predicted_work_is_near_the_counted() {
    for light in lights() {
        let cloud = medium([17; 3], 0.06, 1.0, |p| p.length() < 1.0);
        for resolution in [Resolution::Auto, Resolution::Cells(32), Resolution::Cells(128)] {
            let map = build(&cloud, &light, &Params { resolution, ..Params::default() });
            let p = map.prediction();
            let c = map.counts();
            let ratio = p.entries / c.entries as f64;
            println!("{:?} {resolution:?}: {p:?} {c:?} ratio {ratio:.2}", light.shape);
            assert!((0.4..2.5).contains(&ratio) || matches!(light.shape, LightShape::Spot { .. }), "{ratio}");
            assert!(c.bytes <= 2 * p.bytes);
            assert!(c.kept <= c.entries && c.translucent == c.casters);
        }
    }
}

#[test]
fn queries_find_what_the_light_meets() {
    let mut cloud = plane(Vec3::Z * 3.0, Vec3::NEG_Z, 20, 0.05, SplatKind::Opaque, 1.0);
    cloud.append(&plane(Vec3::Z * 2.0, Vec3::NEG_Z, 20, 0.05, SplatKind::Surface, 1.0));
    let map = build(&cloud, &point_light(DVec3::ZERO), &Params::default());
    let cell = map.cell_of(Vec3::new(0.01, 0.02, 1.0)).unwrap();
    for (absorbance, distance) in [(0.5, 2.0), (1.5, 3.0)] {
        assert!((map.first_hit(cell, absorbance).unwrap() - distance).abs() < 1e-2);
        let hit = map.first_hit_towards(Vec3::new(0.1, 0.2, 1.0), absorbance).unwrap();
        assert!((f64::from(hit.z) - distance).abs() < 2e-2, "{hit}");
    }
    let list = map.list(cell);
    assert!(list.windows(2).all(|w| w[0].0 <= w[1].0));
    assert!(list.last().unwrap().1[0].is_infinite());
    for (z, radius, hits) in [(2.0, 0.1, true), (2.5, 0.3, false), (3.0, 0.2, true), (1.0, 0.5, false)] {
        assert_eq!(map.collides(Vec3::new(0.05, 0.0, z), radius), hits, "sphere at {z}");
    }
    assert!(!map.collides(Vec3::new(3.0, 0.0, 2.0), 0.5));
    assert!(map.list(u32::MAX).is_empty() && map.first_hit(u32::MAX, 0.1).is_none());
}

/// Places on the sides of a box around 0, half its least half extent apart.
fn bar(half: Vec3) -> Vec<Vec3> {
    let step = half.min_element() / 2.0;
    let n = (half / step).round().as_ivec3();
    let mut places = Vec::new();
    for x in -n.x..=n.x {
        for y in -n.y..=n.y {
            for z in -n.z..=n.z {
                if x.abs() == n.x || y.abs() == n.y || z.abs() == n.z {
                    places.push(Vec3::new(x as f32, y as f32, z as f32) * step);
                }
            }
        }
    }
    places
}

#[test]
fn bars_that_fall_flat_or_upright_are_free_until_their_own_sides_touch_the_plane() {
    let cloud = plane(Vec3::Z * 3.0, Vec3::NEG_Z, 20, 0.05, SplatKind::Opaque, 1.0);
    let flat = Vec3::new(0.4, 0.04, 0.04);
    let upright = Vec3::new(0.04, 0.04, 0.4);
    for light in [directional(DVec3::Z), point_light(DVec3::ZERO), directional(DVec3::new(0.4, 0.1, 1.0).normalize())] {
        // A slanted ray finds the plane within half a cell.
        let map = build(&cloud, &light, &Params { resolution: Resolution::Cells(512), ..Params::default() });
        for half in [flat, upright] {
            let from = 1.0f32;
            let way = |speed: f32| move |time: f64| Vec3::new(0.03, 0.02, from + speed * time as f32);
            for speed in [0.35, 50.0] {
                let met = map.free_until(&bar(half), &way(speed), 9);
                let stood = from + speed * met as f32;
                assert!((stood - (3.0 - half.z)).abs() < 2e-3, "{:?} {half}: stops at {stood}", light.shape);
            }
            // Beside the plane, away from it and behind it nothing is met; where it is met from the beginning there is no way.
            let aside = |time: f64| way(0.35)(time) + Vec3::X * 3.0;
            assert_eq!(map.free_until(&bar(half), &aside, 9), 9.0);
            assert_eq!(map.free_until(&bar(half), &|time| way(0.35)(-time), 2), 2.0);
            assert_eq!(map.free_until(&bar(half), &|time| way(0.35)(time) + Vec3::Z * 3.0, 9), 9.0);
            assert_eq!(map.free_until(&bar(half), &|_| Vec3::Z * 3.001, 3), 0.0);
        }
    }
}

#[test]
fn a_hit_is_where_a_look_up_on_its_ray_has_the_absorbance() {
    let mut cloud = smooth_ball(0.1, 6.0, 1.0);
    cloud.append(&plane(Vec3::Z * 0.4, Vec3::NEG_Z, 20, 0.05, SplatKind::Surface, 0.8));
    let resolution = Resolution::Cells(64);
    let map = build(&cloud, &directional(DVec3::NEG_Z), &Params { resolution, ..Params::default() });
    let mut within = 0;
    let mut at_plane = 0;
    for absorbance in [0.05, 0.4, 1.0, 1.7, 3.0] {
        for p in map.first_surface(absorbance) {
            if p.position.truncate().length() > 0.7 {
                continue;
            }
            // Media absorb continuously; the surface at once, and there the hit is between less and more.
            let [before, behind] = [1e-3, -1e-3].map(|z| -light_at(&map, p.position + Vec3::Z * z).ln());
            assert!(before <= absorbance + 1e-3 && absorbance <= behind + 1e-3, "{before} {absorbance} {behind}");
            let is_at_plane = (p.position.z - 0.4).abs() < 1e-3;
            assert!(behind - before < 0.03 || is_at_plane, "{before} {absorbance} {behind} {p:?}");
            *if is_at_plane { &mut at_plane } else { &mut within } += 1;
        }
    }
    assert!(within > 1000 && at_plane > 100, "{within} {at_plane}");
}

#[test]
fn the_greatest_absorbance_is_that_up_to_which_something_is_seen() {
    let mut cloud = smooth_ball(0.1, 2.0, 1.0);
    let params = Params { resolution: Resolution::Cells(64), ..Params::default() };
    let most = |cloud: &Cloud| {
        let map = build(cloud, &directional(DVec3::NEG_Z), &params);
        let most = map.most_absorbance();
        if most.is_finite() {
            assert!(map.first_surface(most * 1.0001).is_empty(), "{most}");
        }
        assert!(!map.first_surface((most * 0.9999).min(9.0)).is_empty(), "{most}");
        most
    };
    // Through the middle the ball is two radii thick.
    let ball = most(&cloud);
    assert!((ball / 4.0 - 1.0).abs() < 0.05, "{ball}");
    cloud.append(&plane(Vec3::Z * 2.0, Vec3::NEG_Z, 20, 0.05, SplatKind::Surface, 0.8));
    let both = most(&cloud);
    assert!((both / (ball + 0.8) - 1.0).abs() < 0.05, "{both} {ball}");
    cloud.append(&plane(Vec3::Z * 3.0, Vec3::NEG_Z, 20, 0.05, SplatKind::Opaque, 1.0));
    assert_eq!(most(&cloud), f32::INFINITY);
}

/// Greatest error of the depth to which light comes into a ball of fog, within `reach` of the light's axis, in spacings.
fn greatest_error(h: f32, absorbance: f32, light: &Light, reach: f32) -> f32 {
    let sigma_t = 2.0;
    let map = build(&smooth_ball(h, sigma_t, 1.0), light, &Params::default());
    let points = map.first_surface(absorbance);
    let near = points.iter().filter(|p| p.position.truncate().length() < reach);
    let errors = near.map(|p| {
        let depth = (1.0 - p.position.truncate().length_squared()).sqrt() - p.position.z;
        (depth - absorbance / sigma_t).abs() / h
    });
    assert!(errors.clone().count() > 500);
    errors.fold(0.0, f32::max)
}

#[test]
fn a_ball_of_fog_is_met_where_it_is_as_thick_as_is_asked_for() {
    for h in [0.06, 0.03] {
        for absorbance in [0.2, 1.0] {
            let error = greatest_error(h, absorbance, &directional(DVec3::NEG_Z), 0.7);
            println!("h {h}, absorbance {absorbance}: {error} spacings");
            assert!(error < 0.1, "{error} spacings at {h}");
        }
    }
}

#[test]
fn first_surface_is_the_isosurface_that_the_light_sees() {
    let h = 0.04;
    let cloud = medium([26; 3], h, 40.0, |p| p.length() < 1.0);
    let map = build(&cloud, &point_light(DVec3::Z * 4.0), &Params::default());
    let points = map.first_surface(0.5);
    assert!(points.len() > 500);
    let mut area = 0.0;
    for p in &points {
        let r = p.position.length();
        if p.position.normalize().dot(Vec3::Z) > 0.5 {
            assert!((r - 1.0).abs() < 2.0 * h, "{r}");
            assert!(p.normal.dot(p.position.normalize()) > 0.7, "{p:?}");
            area += p.area;
        }
    }
    // The cap beyond 60° of the axis has π of area.
    assert!((area / std::f32::consts::PI - 1.0).abs() < 0.1, "{area}");
}
