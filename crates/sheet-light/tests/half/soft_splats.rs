//! Soft shadows of translucent surfaces and of media that are classified already, and on them: the same light as many points, penumbras by similar
//! triangles, nothing between what hides half of a light and what hides the other.

use super::common::{ray, scattering};
use super::polygons::{polygons, wall, white};
use super::soft::{PIXEL, above, as_points, block, edge, extended, fine, on_threads, soft, under};
use super::splats::{Shown, lambert, plane, with};
use crate::common::{BEAUTY, constant, cubic, grid, parallel, perspective, volume};
use sheet_light::half::{Drawn, Extended, HalfInput, HalfParams, fold};
use splat_core::glam::DVec3;
use splat_core::{Accumulator, Camera, Cloud, LightShape, Material, Splat, SplatKind};

fn draw(input: &HalfInput<'_>, params: &HalfParams) -> (Accumulator, Drawn) {
    let mut out = Accumulator::new(input.sheets.camera.size, 1, 3, true, true);
    let drawn = fold(input, params, &BEAUTY, &mut out, None).unwrap();
    (out, drawn)
}

/// A medium, a pane before the light, another one in the medium, a ball of raw points beside it, and a floor that is opaque.
fn mixed(camera: &Camera, light: &Extended<'static>, one_sweep: bool, threads: usize) -> (Accumulator, Drawn) {
    let tf = constant(0.4);
    let material = scattering();
    let paper = white();
    let grid = grid([10, 6, 10], cubic(0.4), |_| 1.0);
    let volumes = [volume(&grid, &tf, &material)];
    let mut cloud = Cloud::new(DVec3::ZERO);
    plane(&mut cloud, (DVec3::new(0.9, 2.6, 0.9), DVec3::Y), 0.6, 1.5, &Splat::default());
    plane(&mut cloud, (DVec3::new(-0.8, 0.1, 0.3), DVec3::new(0.3, 1.0, 0.2).normalize()), 0.6, 0.7, &Splat::default());
    let ball = (0..216).map(|n| DVec3::from_array([n % 6, n / 6 % 6, n / 36].map(|n| f64::from(n) * 0.2 - 0.5)));
    for at in ball {
        let position = (at + DVec3::new(-2.4, 1.0, 1.6)).as_vec3();
        let kind = SplatKind::Medium;
        cloud.push(&Splat { position, radius: 0.35, cross_section: 0.01, kind, material: 1, ..Splat::default() });
    }
    let shown = Shown::new(cloud, camera, vec![lambert(), material], 0.2);
    let floor = wall([0.0, -1.8, 0.0], [3.0, 0.0, 0.0], [0.0, 0.0, -3.0]);
    let points = as_points(light, 16);
    let (input, params) = under(&volumes, camera, (light, &points), one_sweep);
    on_threads(threads, || draw(&HalfInput { polygons: &[polygons(&floor, &paper)], ..with(&shown, input) }, &params))
}

#[test]
fn surfaces_and_points_that_let_light_through_are_lit_as_under_many_points_of_an_extended_light() {
    let camera = perspective([1.0, 2.0, 12.0], 24.0, [24, 24]);
    let center = DVec3::new(2.0, 7.0, 3.0);
    let light = extended(LightShape::Disk { center, normal: -center.normalize(), radius: 0.8 }, 16);
    let [soft, points] = [true, false].map(|one_sweep| mixed(&camera, &light, one_sweep, 2));
    let sum = |all: &mut dyn Iterator<Item = f32>| all.map(f64::from).sum::<f64>();
    let apart =
        |a: &[f32], b: &[f32]| sum(&mut a.iter().zip(b).map(|(a, b)| (a - b).abs())) / sum(&mut b.iter().copied());
    let among = apart(&soft.0.channels[1], &points.0.channels[1]);
    let floor = apart(&soft.1.polygons.channels[1], &points.1.polygons.channels[1]);
    println!("apart, over the mean: medium and splats {among:.4}, floor {floor:.4}");
    assert!(among < 0.03 && floor < 0.03, "{among} {floor}");
    assert!(mixed(&camera, &light, true, 3) == soft, "as with two threads");
}

/// (x, share of the light that arrives) on a plane of splats at z = 0, under a half plane of splats 2 above it whose edge is at x = 0, and a block
/// beside it where that is asked for.
fn profile(light: &Extended<'static>, tau: f64, is_beside: bool) -> Vec<[f64; 2]> {
    let camera = parallel([8.0, 0.0, 5.0], 0.1, [110, 5]);
    let beside = block([0.0, -0.6, 1.98], [1.8, 0.6, 2.02], 0.2);
    let opaque = constant(400.0);
    let black = Material { single_scattering_albedo: 0.0, ..scattering() };
    let lit = |casts_shadow: bool| {
        let mut cloud = Cloud::new(DVec3::ZERO);
        plane(&mut cloud, (DVec3::ZERO, DVec3::Z), 2.0, 3.0, &Splat::default());
        // Discs stand for half a step to either side.
        let above = DVec3::new(-1.0625, 0.0, 2.0);
        plane(&mut cloud, (above, DVec3::Z), 1.0, tau, &Splat { object: 1, ..Splat::default() });
        let mut shown = Shown::new(cloud, &camera, vec![lambert()], 0.1);
        shown.objects[1].casts_shadow = casts_shadow;
        let volumes = [sheet_light::Volume { casts_shadow, ..volume(&beside, &opaque, &black) }];
        let volumes = if is_beside { &volumes[..] } else { &[] };
        draw(&with(&shown, soft(volumes, &camera, vec![*light])), &fine(50.0)).0
    };
    let dark = lit(true);
    let open = lit(false);
    let places = (0..550).filter_map(|k| {
        let (from, along) = ray(&camera, k % 110, k / 110);
        let place = from - along * (from.z / along.z);
        let share = f64::from(dark.channels[0][k] / open.channels[0][k]);
        (place.y.abs() < 0.001 && place.x.abs() < 1.55).then_some([place.x, share])
    });
    let mut out: Vec<[f64; 2]> = places.collect();
    out.sort_by(|a, b| a[0].total_cmp(&b[0]));
    assert!(out.len() > 60, "{} places are seen", out.len());
    out
}

#[test]
fn penumbras_of_translucent_surfaces_on_each_other_are_as_wide_as_similar_triangles_say() {
    // What the edge itself is blurred by, discs and pixels, is known by a light without an extent.
    let sharp = edge(&profile(&extended(LightShape::Point { position: DVec3::Z * 6.0 }, 1), 1.0, false))[1];
    for (kind, radius, widths) in [(0, 0.6, 4.0), (1, 0.6, 4.0), (2, 0.6, 12f64.sqrt())] {
        let [mean, deviation] = edge(&profile(&extended(above(kind, radius), 32), 1.0, false));
        let width = (deviation * deviation - sharp * sharp).sqrt() * widths;
        println!("light {kind}: {width} wide at {mean}, {sharp} without an extent");
        assert!((width - radius).abs() < PIXEL + 0.03 * radius && mean.abs() < 2.0 * PIXEL, "{width} at {mean}");
    }
}

/// Half of a light's points are behind the splats and half behind the volume: shares of each, one times the other, would let a quarter through.
#[test]
fn a_surface_and_a_volume_side_by_side_leave_no_light_between_them() {
    let profile = profile(&extended(above(0, 0.6), 32), 20.0, true);
    let most = profile.iter().filter(|[x, _]| x.abs() < 0.8).map(|[_, light]| *light).fold(0.0, f64::max);
    println!("{most}");
    assert!(most < 0.05, "{most} comes through");
}
