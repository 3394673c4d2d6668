//! Raw points become surfels: hard cases CV11 and CV12, normals, areas, orientation, invariances.

use convert::{DiscShape, Orientation, SurfelParams, raw_to_surfels, reference};
use splat_core::glam::{DQuat, DVec3, Vec3};
use splat_core::{Footprint, RawPoints, optics, rng};
use std::f64::consts::FRAC_PI_2;

fn plane(side: u32) -> RawPoints {
    let position = (0..side * side).map(|i| Vec3::new((i % side) as f32, 0.0, (i / side) as f32)).collect();
    RawPoints { position, ..RawPoints::default() }
}

fn sphere(n: u64) -> RawPoints {
    // A spiral of equal areas.
    let golden = std::f64::consts::PI * (3.0 - 5f64.sqrt());
    let point = |i: u64| {
        let y = 1.0 - 2.0 * (i as f64 + 0.5) / n as f64;
        let (s, c) = (golden * i as f64).sin_cos();
        (DVec3::new(c, 0.0, s) * (1.0 - y * y).sqrt() + DVec3::Y * y).as_vec3()
    };
    RawPoints { position: (0..n).map(point).collect(), ..RawPoints::default() }
}

#[test]
fn cv11_a_million_points_at_one_place_are_counted_and_do_not_darken() {
    let mut points = plane(10);
    points.position.extend(std::iter::repeat_n(Vec3::new(5.0, 0.0, 5.0), 999_999));
    let alone = raw_to_surfels(&plane(10), &SurfelParams::default(), None).unwrap().1;
    let (cloud, report) = raw_to_surfels(&points, &SurfelParams::default(), None).unwrap();
    assert_eq!(report.duplicates, 999_999);
    assert_eq!(cloud.len(), 1_000_099);
    assert!((report.area - alone.area).abs() < 1e-9 * alone.area);
    let sum: f64 = cloud.cross_section.iter().map(|k| f64::from(*k)).sum();
    assert!((sum / alone.area - 1.0).abs() < 1e-4);
    assert!(cloud.radius.iter().all(|r| *r >= 2.4 && r.is_finite()));
    let merged = SurfelParams { merge_duplicates: true, ..SurfelParams::default() };
    assert_eq!(raw_to_surfels(&points, &merged, None).unwrap().0.len(), 100);
    let same = RawPoints { position: vec![Vec3::ONE; 1_000_000], ..RawPoints::default() };
    let (cloud, report) = raw_to_surfels(&same, &SurfelParams::default(), None).unwrap();
    assert_eq!(report.duplicates, 999_999);
    cloud.validate().unwrap();
}

#[test]
fn cv12_points_far_away_keep_their_millimetres() {
    let mut points = plane(12);
    points.position.iter_mut().for_each(|p| *p *= 1e-3);
    let near = raw_to_surfels(&points, &SurfelParams::default(), None).unwrap().0;
    points.origin = DVec3::new(5_001_234.567, 0.0, 5e6);
    let mut far = raw_to_surfels(&points, &SurfelParams::default(), None).unwrap().0;
    assert_eq!(far.origin, points.origin);
    far.origin = DVec3::ZERO;
    assert_eq!(far, near);
}

#[test]
fn a_lattice_is_covered_once() {
    let params = SurfelParams { opacity: 0.4, ..SurfelParams::default() };
    let (cloud, report) = raw_to_surfels(&plane(20), &params, None).unwrap();
    assert!((report.median_spacing - 1.0).abs() < 1e-9);
    for i in 0..64u32 {
        let p = DVec3::new(9.0 + f64::from(i % 8) / 8.0, 0.0, 9.0 + f64::from(i / 8) / 8.0);
        let weight = reference::layer_depth(&cloud, Footprint::default(), p, DVec3::Y) / optics::optical_depth(0.4);
        assert!((weight - 1.0).abs() < 2.5e-4, "{weight}");
    }
}

#[test]
fn areas_of_a_sphere_sum_to_its_area_and_normals_are_radial() {
    for orientation in [
        Orientation::Propagate,
        Orientation::Toward(DVec3::Y),
        Orientation::Viewpoint(DVec3::Z * 9.0),
        Orientation::Auto(DVec3::Z),
    ] {
        let params = SurfelParams { orientation, ..SurfelParams::default() };
        let (cloud, report) = raw_to_surfels(&sphere(20_000), &params, None).unwrap();
        assert!((report.area / (4.0 * std::f64::consts::PI) - 1.0).abs() < 2e-3, "{}", report.area);
        for i in 0..cloud.len() {
            let p = cloud.position[i].normalize();
            let n = cloud.normal[i];
            assert!(n.dot(p).abs() > 0.999, "{p} {n}");
            match orientation {
                Orientation::Propagate | Orientation::Auto(_) => assert!(n.dot(p) > 0.0, "inwards at {p}"),
                Orientation::Toward(_) => assert!(n.y >= 0.0),
                Orientation::Viewpoint(eye) => assert!(n.dot(eye.as_vec3() - cloud.position[i]) >= 0.0),
            }
        }
    }
}

/// Hills with a house on them are no body, whatever is up; two balls are, and so is one that lacks its lowest tenth.
#[test]
fn normals_point_outwards_of_bodies_and_up_from_terrain() {
    let with = |position: Vec<Vec3>, up: DVec3| {
        let params = SurfelParams { orientation: Orientation::Auto(up), ..SurfelParams::default() };
        let points = RawPoints { position, origin: DVec3::new(1e7, 2e6, -3e5), ..RawPoints::default() };
        raw_to_surfels(&points, &params, None).unwrap().0
    };
    let ground = |k: usize| {
        let x = (k % 80) as f32;
        let z = (k / 80) as f32;
        let is_house = (30.0..45.0).contains(&x) && (20.0..40.0).contains(&z);
        Vec3::new(x, 4.0 * (0.2 * x).sin() * (0.15 * z).cos() + if is_house { 12.0 } else { 0.0 }, z)
    };
    let wall = (0..15 * 24).map(|k| Vec3::new(30.0 + (k % 15) as f32, 0.5 * (k / 15) as f32, 20.0));
    let terrain: Vec<Vec3> = (0..80 * 80).map(ground).chain(wall).collect();
    assert!(with(terrain.clone(), DVec3::Y).normal.iter().all(|n| n.y >= 0.0));
    let turned = terrain.iter().map(|p| Vec3::new(p.x, p.z, p.y)).collect();
    assert!(with(turned, DVec3::Z).normal.iter().all(|n| n.z >= 0.0));
    let ball = sphere(4000).position;
    let open = ball.iter().copied().filter(|p| p.y > -0.8).collect();
    let two = ball.iter().flat_map(|p| [*p, *p + 5.0 * Vec3::X]).collect();
    for (position, middle) in [(open, 1.0), (two, 2.5)] {
        let cloud = with(position, DVec3::Y);
        let center = |p: Vec3| if p.x > middle { 5.0 * Vec3::X } else { Vec3::ZERO };
        assert!(cloud.position.iter().zip(&cloud.normal).all(|(p, n)| n.dot(*p - center(*p)) > 0.0));
    }
}

#[test]
fn scattered_points_cover_their_plane_once_in_the_mean() {
    let n = 4000u64;
    let position = (0..n).map(|i| Vec3::new(rng::unit_f32(9, 0, i, 0), 0.0, rng::unit_f32(9, 0, i, 1))).collect();
    let points = RawPoints { position, ..RawPoints::default() };
    let (cloud, _) = raw_to_surfels(&points, &SurfelParams { opacity: 0.5, ..SurfelParams::default() }, None).unwrap();
    let mut mean = 0.0;
    let mut thinnest = f64::INFINITY;
    for i in 0..1024u32 {
        let p = DVec3::new(0.2 + 0.6 * f64::from(i % 32) / 32.0, 0.0, 0.2 + 0.6 * f64::from(i / 32) / 32.0);
        let weight = reference::layer_depth(&cloud, Footprint::default(), p, DVec3::Y) / optics::optical_depth(0.5);
        mean += weight / 1024.0;
        thinnest = thinnest.min(weight);
    }
    assert!((mean - 1.0).abs() < 0.01 && thinnest > 0.3, "mean {mean} thinnest {thinnest}");
}

#[test]
fn few_points_and_lines_have_finite_attributes() {
    for n in [0usize, 1, 2, 3, 11] {
        let position = (0..n).map(|i| Vec3::X * i as f32).collect();
        let points = RawPoints { position, ..RawPoints::default() };
        for orientation in [Orientation::Propagate, Orientation::default()] {
            let (cloud, report) =
                raw_to_surfels(&points, &SurfelParams { orientation, ..SurfelParams::default() }, None).unwrap();
            cloud.validate().unwrap();
            assert_eq!((cloud.len(), report.without_plane), (n, n as u64));
        }
    }
}

#[test]
fn a_lone_point_does_not_become_a_huge_disc() {
    let mut points = plane(30);
    points.position.push(Vec3::new(1e4, 1e4, 0.0));
    let (cloud, report) = raw_to_surfels(&points, &SurfelParams::default(), None).unwrap();
    assert!(report.lone >= 1);
    assert!(cloud.radius.iter().all(|r| *r <= 4.0 * 2.4 * 1.001));
}

#[test]
fn x4_and_x1_neither_order_nor_threads_matter() {
    let mut points = sphere(5000);
    points.color = (0..5000u64).map(|i| [rng::unit_f32(4, 0, i, 0); 3]).collect();
    points.value = (0..5000).map(|i| i as f32).collect();
    let mut reversed = points.clone();
    reversed.position.reverse();
    reversed.color.reverse();
    reversed.value.reverse();
    let params = SurfelParams { values: true, orientation: Orientation::Propagate, ..SurfelParams::default() };
    let run = |points: &RawPoints, threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| raw_to_surfels(points, &params, None).unwrap().0)
    };
    let one = run(&points, 1);
    assert!(run(&reversed, 3) == one);
    assert!(run(&points, 7) == one);
}

/// The square that ends cells among few neighbours lies as these do, and not as the axes: turned points have turned discs.
#[test]
fn discs_turn_with_their_points() {
    let scattered = |n: u64, round: bool| {
        let at = |i: u64| {
            let place = DVec3::from_array([0, 1, 2].map(|axis| 2.0 * rng::unit(31, n, i, axis) - 1.0));
            if round { place.normalize() } else { place }
        };
        (0..n).map(at).collect::<Vec<DVec3>>()
    };
    // Area and radius of every point, by its rank.
    let discs = |places: &[DVec3], turn: DQuat, shape| {
        let position = places.iter().map(|p| (turn * *p).as_vec3()).collect();
        let value = (0..places.len()).map(|i| i as f32).collect();
        let points = RawPoints { position, value, ..RawPoints::default() };
        let params = SurfelParams { values: true, shape, ..SurfelParams::default() };
        let (cloud, _) = raw_to_surfels(&points, &params, None).unwrap();
        let mut discs = vec![[0.0; 2]; places.len()];
        for i in 0..cloud.len() {
            discs[cloud.value[i] as usize] = [cloud.cross_section[i], cloud.radius[i]].map(f64::from);
        }
        discs
    };
    for (places, shape) in [
        (scattered(400, true), DiscShape::Round),
        (scattered(400, true), DiscShape::Elliptical),
        (scattered(60, false), DiscShape::Round),
    ] {
        let still = discs(&places, DQuat::IDENTITY, shape);
        for turn in [
            DQuat::from_rotation_x(FRAC_PI_2),
            DQuat::from_rotation_z(FRAC_PI_2),
            DQuat::from_axis_angle(DVec3::new(0.48, 0.6, -0.64), 1.0),
        ] {
            let turned = discs(&places, turn, shape);
            for (i, (a, b)) in still.iter().zip(&turned).enumerate() {
                let off = (0..2).map(|k| (b[k] / a[k] - 1.0).abs()).fold(0.0, f64::max);
                assert!(off < 1e-4, "{shape:?} {} {turn}: disc {i} is {a:?}, turned {b:?}", places.len());
            }
        }
    }
}
