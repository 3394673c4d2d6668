//! Soft shadows: penumbras by similar triangles, constants, energy, the same light as many points.

use super::common::{draw, exact, input, lamp, lit, scattering};
use crate::common::{constant, cubic, grid, noise, parallel, perspective, transfer, volume};
use sheet_light::half::{Bodies, Extended, HalfCounts, HalfInput, HalfParams, Reason, reference, serves_extended};
use sheet_light::{Error, Volume};
use splat_core::glam::{DMat3, DVec3};
use splat_core::shade::LitBy;
use splat_core::{Camera, Grid, Light, LightShape, Material};

/// With lights that have an extent.
pub(super) fn soft<'a>(volumes: &'a [Volume<'a>], camera: &'a Camera, extended: Vec<Extended<'a>>) -> HalfInput<'a> {
    HalfInput { extended, ..input(volumes, camera, &[]) }
}

pub(super) fn extended(shape: LightShape, samples: u32) -> Extended<'static> {
    let mut lit = lit(shape);
    lit.light.intensity = [100.0; 3];
    Extended { lit, samples }
}

/// The same light as that many points, a sweep each.
pub(super) fn as_points(light: &Extended<'static>, samples: u32) -> Vec<LitBy<'static>> {
    light.lit.light.points(samples).into_iter().map(|light| LitBy { slide: None, light, shadow: None }).collect()
}

/// Volumes under a light with an extent in one sweep, or under `points` of it; its image is fine, as the edges of blocks are as sharp as its pixels.
pub(super) fn under<'a>(
    volumes: &'a [Volume<'a>],
    camera: &'a Camera,
    (light, points): (&Extended<'a>, &'a [LitBy<'a>]),
    one_sweep: bool,
) -> (HalfInput<'a>, HalfParams) {
    let input = if one_sweep { soft(volumes, camera, vec![*light]) } else { input(volumes, camera, points) };
    (input, HalfParams { light_pixels: 6.0, ..exact(None) })
}

/// What is made with that many threads.
pub(super) fn on_threads<T: Send>(threads: usize, make: impl FnOnce() -> T + Send) -> T {
    rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap().install(make)
}

/// A constant block between two corners.
pub(super) fn block(from: [f64; 3], to: [f64; 3], step: f64) -> Grid {
    let from = DVec3::from_array(from);
    let to = DVec3::from_array(to);
    let dims = ((to - from) / step).ceil().to_array().map(|n| n.max(2.0) as usize);
    let axes = DMat3::from_diagonal((to - from) / DVec3::from_array(dims.map(|n| n as f64)));
    let mut grid = grid(dims, axes, |_| 1.0);
    grid.origin += 0.5 * (from + to);
    grid
}

/// Light 6 above a thin receiver, and what it shines on from there.
pub(super) fn above(kind: usize, radius: f64) -> LightShape {
    let center = DVec3::Z * 6.0;
    match kind {
        0 => LightShape::Disk { center, normal: DVec3::NEG_Z, radius },
        1 => LightShape::Sphere { center, radius },
        _ => LightShape::Rect { center, u: DVec3::Y * radius, v: DVec3::X * radius },
    }
}

/// From behind the receiver, where the eye meets last what light meets first, and from aside, where it meets it first.
fn views() -> [Camera; 2] {
    [parallel([0.0, 0.0, -10.0], 0.1, [160, 5]), parallel([8.0, 0.0, 5.0], 0.1, [110, 5])]
}

/// (x, share of the light that arrives) along the middle row or column of a picture of a thin receiver at z = 0 under blocks.
fn profile(
    light: &Extended<'static>,
    blocks: &[Grid],
    camera: &Camera,
    params: &HalfParams,
) -> (Vec<[f64; 2]>, HalfCounts) {
    let receiver = block([-1.6, -0.4, -0.02], [1.6, 0.4, 0.02], 0.1);
    let thin = constant(0.01);
    let opaque = constant(400.0);
    let material = scattering();
    let black = Material { single_scattering_albedo: 0.0, ..material };
    let with = |casts_shadow: bool| {
        let mut volumes: Vec<Volume<'_>> =
            blocks.iter().map(|b| Volume { casts_shadow, ..volume(b, &opaque, &black) }).collect();
        volumes.push(Volume { casts_shadow, ..volume(&receiver, &thin, &material) });
        draw(&soft(&volumes, camera, vec![*light]), params).unwrap()
    };
    let (dark, counts) = with(true);
    let (open, _) = with(false);
    let width = camera.size[0] as usize;
    let mut out: Vec<[f64; 2]> = Vec::new();
    for at in 0..dark.channels[0].len() {
        let (from, along) = super::common::ray(camera, at % width, at / width);
        let place = from - along * (from.z / along.z);
        if place.y.abs() < 0.001 && place.x.abs() < 1.55 {
            out.push([place.x, f64::from(dark.channels[0][at] / open.channels[0][at])]);
        }
    }
    out.sort_by(|a, b| a[0].total_cmp(&b[0]));
    assert!(out.len() > 60, "{} places are seen", out.len());
    (out, counts)
}

/// Mean and deviation of where the light rises, or falls.
pub(super) fn edge(profile: &[[f64; 2]]) -> [f64; 2] {
    let steps = || profile.windows(2).map(|w| (0.5 * (w[0][0] + w[1][0]), w[1][1] - w[0][1]));
    let all: f64 = steps().map(|(_, rise)| rise).sum();
    let mean = steps().map(|(x, rise)| x * rise).sum::<f64>() / all;
    [mean, (steps().map(|(x, rise)| (x - mean) * (x - mean) * rise).sum::<f64>() / all).max(0.0).sqrt()]
}

/// A pixel of the light buffer at the receiver.
pub(super) const PIXEL: f64 = 0.02 / 0.8 * 6.0 / 5.0;

pub(super) fn fine(slabs: f64) -> HalfParams {
    HalfParams { light_pixels: 0.8, ..exact(Some(2.04 / slabs)) }
}

#[test]
fn hv09_penumbras_are_as_wide_as_similar_triangles_say_whatever_the_slabs() {
    // An edge 4 below the light and 2 above the receiver: 2R·d2/d1 = R. A disk's projects to a half circle, whose deviation is a
    // quarter of its width; an even one is √12 deviations wide.
    let edge_of = [block([-1.8, -0.6, 1.98], [0.0, 0.6, 2.02], 0.2)];
    let lights = [(0, 0.6, 4.0), (1, 0.6, 4.0), (2, 0.6, 12f64.sqrt()), (0, 0.3, 4.0)];
    for (at, camera) in views().iter().enumerate() {
        for (kind, radius, widths) in lights.into_iter().skip(at).step_by(2) {
            let mut all = Vec::new();
            for slabs in [50.0, 200.0, 800.0] {
                let (profile, _counts) = profile(&extended(above(kind, radius), 32), &edge_of, camera, &fine(slabs));
                let [mean, deviation] = edge(&profile);
                let width = deviation * widths;
                let what = format!("{slabs} slabs, light {kind} of {radius}: {width} wide at {mean}");
                assert!((width - radius).abs() < PIXEL + 0.03 * radius && mean.abs() < PIXEL, "{what}");
                all.push(width);
            }
            assert!((all[0] - all[2]).abs() < 0.2 * PIXEL, "{all:?}");
        }
    }
}

#[test]
fn hv09a_occluders_at_two_distances_cast_penumbras_of_their_own() {
    // 1 and 3 above the receiver: 2R/5 and 2R, about x = −0.9 and 0.75.
    let blocks =
        [block([-1.7, -0.6, 0.98], [-0.75, 0.6, 1.02], 0.2), block([0.375, -0.6, 2.98], [1.3, 0.6, 3.02], 0.2)];
    let light = extended(above(0, 0.6), 32);
    let (seen, _) = profile(&light, &blocks, &views()[0], &fine(100.0));
    let apart = seen.iter().position(|p| p[0] > -0.2).unwrap();
    for (part, middle, expected) in [(&seen[..apart], -0.9, 0.24), (&seen[apart..], 0.75, 1.2)] {
        let [mean, deviation] = edge(part);
        let found = 4.0 * deviation;
        assert!((found - expected).abs() < PIXEL + 0.03 * expected, "{found}, not {expected}");
        assert!((mean - middle).abs() < 2.0 * PIXEL, "{mean}, not {middle}");
    }
    // One behind the other, with one edge: light that passes one passes the other or does not, and no distance is a mean of two.
    let blocks = [block([-1.7, -0.6, 0.98], [0.0, 0.6, 1.02], 0.2), block([-1.3, -0.6, 2.98], [0.0, 0.6, 3.02], 0.2)];
    let (seen, _) = profile(&light, &blocks, &views()[0], &fine(100.0));
    // But for where edges lie: within two pixels.
    let off = |[x, t]: &[f64; 2]| {
        let near = (-8..=8).map(|k| (t - beside_two_edges(x + f64::from(k) * 0.25 * PIXEL, 0.6)).abs());
        near.fold(f64::INFINITY, f64::min)
    };
    let worst = seen.iter().map(off).fold(0.0, f64::max);
    assert!(worst < 0.03, "{worst}");
}

/// Share of a disk of radius `r` 6 above that is seen from `x` past edges at x = 0, 1 and 3 above.
fn beside_two_edges(x: f64, r: f64) -> f64 {
    // A ray to the light at q is at x + (q − x)·h/6 at height h, and passes where that is above 0.
    let n = 4000;
    let share = |k: usize| {
        let q = ((k as f64 + 0.5) / f64::from(n as u32) * 2.0 - 1.0) * r;
        let passes = [1.0, 3.0].into_iter().all(|h| x + (q - x) * h / 6.0 > 0.0);
        if passes { (r * r - q * q).sqrt() } else { 0.0 }
    };
    let all: f64 = (0..n).map(share).sum();
    all * 2.0 * r / n as f64 / (0.5 * std::f64::consts::PI * r * r)
}

#[test]
fn hv07_hv08_what_is_constant_stays_so_after_a_thousand_slabs_and_at_borders() {
    let grid = block([-3.0, -3.0, -1.0], [3.0, 3.0, 1.0], 0.25);
    let thin = constant(0.5);
    let material = scattering();
    let camera = parallel([0.0, 0.0, 9.0], 5.6, [20, 20]);
    let disk = extended(LightShape::Disk { center: DVec3::Z * 1e3, normal: DVec3::NEG_Z, radius: 30.0 }, 8);
    let point = LitBy {
        slide: None,
        light: Light { shape: lamp([0.0, 0.0, 1e3]).light.shape, ..disk.lit.light },
        shadow: None,
    };
    let with = |casts_shadow: bool, is_soft: bool| {
        let volumes = [Volume { casts_shadow, ..volume(&grid, &thin, &material) }];
        let (extended, lights) = if is_soft { (vec![disk], vec![]) } else { (vec![], vec![point]) };
        let mut params = exact(Some(2.0 / 1000.0));
        params.light_pixels = 2.0;
        draw(&HalfInput { extended, ..input(&volumes, &camera, &lights) }, &params).unwrap()
    };
    // Nothing attenuates: 1 everywhere, at the borders too, to the bit.
    let (open, counts) = with(false, true);
    let (hard, _) = with(false, false);
    assert!(counts.slabs > 1000 && counts.soft_passes >= 1000 * 8, "{counts:?}");
    // All points together give the middle a little less than the centre does.
    let gain = open.channels[0][210] / hard.channels[0][210];
    let worst = open.channels[0].iter().zip(&hard.channels[0]).map(|(a, b)| (a / b / gain - 1.0).abs());
    let worst = worst.fold(0.0, f32::max);
    assert!((gain - 1.0).abs() < 1e-3, "{gain}");
    assert!(worst < 1e-5, "{worst:e}");
    // A constant medium lets through what it does of the centre's light, but beside the faces that light comes in at the sides.
    let (soft, _) = with(true, true);
    let (hard, _) = with(true, false);
    let apart = |at: usize| {
        let [x, y] = [at % 20, at / 20].map(|v| (v as f64 + 0.5) / 20.0 * 5.6 - 2.8);
        let scale = open.channels[0][at];
        (x.abs().max(y.abs()) < 2.6).then(|| (soft.channels[0][at] - gain * hard.channels[0][at]).abs() / scale)
    };
    let worst = (0..400).filter_map(apart).fold(0.0, f32::max);
    assert!(worst < 1e-5, "{worst:e}");
}

#[test]
fn hv10_a_light_without_extent_is_a_point_to_the_bit_and_moves_no_image() {
    let tf = transfer(&[(0.3, 0.0), (0.5, 0.4), (0.9, 2.5)]);
    let material = scattering();
    let grid = grid([12, 12, 12], cubic(0.5), noise);
    let volumes = [volume(&grid, &tf, &material)];
    let camera = perspective([2.0, 3.0, 16.0], 30.0, [40, 40]);
    let center = DVec3::new(6.0, 8.0, 9.0);
    let mut point = lamp(center.to_array());
    point.light.intensity = [100.0; 3];
    let hard = draw(&input(&volumes, &camera, &[point]), &exact(None)).unwrap();
    assert_eq!(hard.1.soft_passes, 0);
    let tiny = extended(LightShape::Sphere { center, radius: 1e-9 }, 16);
    assert_eq!(draw(&soft(&volumes, &camera, vec![tiny]), &exact(None)).unwrap(), hard);
    assert_eq!(draw(&soft(&volumes, &camera, vec![Extended { lit: point, samples: 16 }]), &exact(None)).unwrap(), hard);
    let wide = extended(LightShape::Sphere { center, radius: 1.0 }, 16);
    let (out, counts) = draw(&soft(&volumes, &camera, vec![wide]), &exact(None)).unwrap();
    assert!(counts.soft_passes > 0 && out != hard.0);
    // 2D images, as many as the light has points: no more for more slabs.
    let bytes =
        |slab_width: f64| draw(&soft(&volumes, &camera, vec![wide]), &exact(Some(slab_width))).unwrap().1.light_bytes;
    assert_eq!(bytes(0.12), bytes(0.0075));
    assert!(counts.light_bytes > hard.1.light_bytes);
}

#[test]
fn a_small_occluder_takes_as_much_light_softly_as_it_does_hard() {
    let receiver = block([-1.6, -1.6, -0.05], [1.6, 1.6, 0.05], 0.1);
    let blob = block([-0.3, -0.3, 2.9], [0.3, 0.3, 3.1], 0.1);
    let thin = constant(0.01);
    let dense = constant(3.0);
    let material = scattering();
    let black = Material { single_scattering_albedo: 0.0, ..material };
    let camera = parallel([0.0, 0.0, -10.0], 3.2, [64, 64]);
    let missing = |radius: f64| {
        let with = |casts_shadow: bool| {
            let volumes = [volume(&receiver, &thin, &material), volume(&blob, &dense, &black)]
                .map(|v| Volume { casts_shadow, ..v });
            draw(&soft(&volumes, &camera, vec![extended(above(0, radius), 32)]), &exact(None)).unwrap().0
        };
        let dark = with(true);
        let open = with(false);
        dark.channels[0].iter().zip(&open.channels[0]).map(|(d, o)| f64::from(1.0 - d / o)).collect::<Vec<f64>>()
    };
    let hard = missing(1e-9);
    let soft = missing(0.8);
    let all_hard: f64 = hard.iter().sum();
    let all_soft: f64 = soft.iter().sum();
    let most = |v: &[f64]| v.iter().copied().fold(0.0, f64::max);
    assert!((all_soft / all_hard - 1.0).abs() < 0.035 && most(&soft) < 0.8 * most(&hard), "{all_soft}, not {all_hard}");
}

/// A few lumps.
fn lumps(p: DVec3) -> f64 {
    let lump = |x: f64, y: f64, z: f64, s: f64| (-(p - DVec3::new(x, y, z)).length_squared() / (s * s)).exp();
    lump(-0.8, 0.3, 0.0, 0.8)
        + lump(0.9, -0.4, 0.4, 0.7)
        + lump(0.2, 1.1, -0.8, 0.5)
        + 0.1 * (9.0 * p.x).sin() * (8.0 * p.y).sin()
}

/// Root mean square difference to many points of a light, that of its centre alone, and the mean of what they show.
fn against_points(light: &Extended<'static>, points: u32, camera: &Camera) -> [f64; 3] {
    let tf = transfer(&[(0.2, 0.0), (0.5, 4.0), (1.0, 9.0)]);
    let material = scattering();
    let grid = grid([24, 24, 24], cubic(0.2), lumps);
    let volumes = [volume(&grid, &tf, &material)];
    let drawn = |input: HalfInput<'_>| draw(&input, &exact(None)).unwrap().0.channels[1].clone();
    let truth = drawn(input(&volumes, camera, &as_points(light, points)));
    let found = drawn(soft(&volumes, camera, vec![*light]));
    let centre = Extended { samples: 1, lit: LitBy { slide: None, light: central(&light.lit.light), shadow: None } };
    let hard = drawn(soft(&volumes, camera, vec![centre]));
    let rmse = |a: &[f32]| {
        let squares: f64 = a.iter().zip(&truth).map(|(a, b)| f64::from(a - b).powi(2)).sum();
        (squares / a.len() as f64).sqrt()
    };
    [rmse(&found), rmse(&hard), truth.iter().map(|v| f64::from(*v)).sum::<f64>() / truth.len() as f64]
}

/// A light with all of its extent at its centre.
fn central(light: &Light) -> Light {
    let position = light.shape.place().unwrap();
    let shape = match light.shape.normal() {
        Some(normal) => LightShape::Patch { position, normal },
        None => LightShape::Point { position },
    };
    Light { shape, ..*light }
}

#[test]
fn a_cloud_under_an_extended_light_is_that_under_many_points_of_it() {
    let toward = |p: [f64; 3]| -DVec3::from_array(p).normalize();
    // From the side two of the shapes, and from behind the third, where what comes through is a tenth as bright.
    for (at, radius, most) in [([3.0, 6.0, 5.0], 1.0, 0.06), ([-2.0, 5.0, -7.0], 1.5, 0.13)] {
        let center = DVec3::from_array(at);
        let u = toward(at).any_orthonormal_vector() * radius;
        let shapes = [
            LightShape::Sphere { center, radius },
            LightShape::Disk { center, normal: toward(at), radius },
            LightShape::Rect { center, u, v: toward(at).cross(u) },
        ];
        let is_behind = at[2] < 0.0;
        for shape in shapes.into_iter().filter(|s| is_behind == matches!(s, LightShape::Sphere { .. })) {
            let camera = perspective([1.0, 2.0, 12.0], 24.0, [24, 24]);
            let [rmse, hard, mean] = against_points(&extended(shape, 32), 64, &camera);
            assert!(rmse < most * mean && rmse < 0.9 * hard, "{rmse:e} and {hard:e} of {mean:e}: {shape:?}");
        }
    }
}

#[test]
fn soft_light_is_that_of_the_twin() {
    let tf = transfer(&[(0.2, 0.0), (0.5, 0.4), (0.9, 1.5)]);
    let material = scattering();
    let wave = |p: DVec3| 0.5 + 0.4 * (1.5 * p.x + 0.5 * p.z).sin() * (1.2 * p.y).cos();
    let grid = grid([8, 7, 6], cubic(0.5), wave);
    let params = HalfParams { light_pixels: 3.0, ..exact(Some(0.125)) };
    let volumes = [volume(&grid, &tf, &material)];
    for (camera, at) in [
        (parallel([3.0, 2.0, 8.0], 5.0, [20, 16]), [2.0, 9.0, 6.0]),
        (perspective([2.0, 3.0, 8.0], 40.0, [16, 20]), [-2.0, 4.0, -9.0]),
    ] {
        let light = extended(LightShape::Sphere { center: DVec3::from_array(at), radius: 1.0 }, 4);
        let input = soft(&volumes, &camera, vec![light]);
        let found = draw(&input, &params).unwrap().0;
        let twin = reference::draw(&input, &params).unwrap();
        let worst = (0..320).map(|at| (f64::from(found.channels[0][at]) - twin.color[at][0]).abs()).fold(0.0, f64::max);
        let brightest = twin.color.iter().map(|c| c[0]).fold(0.0, f64::max);
        let squares = (0..320).map(|at| (f64::from(found.channels[0][at]) - twin.color[at][0]).powi(2)).sum::<f64>();
        let rmse = (squares / 320.0).sqrt();
        assert!(worst < 0.06 * brightest && rmse < 0.015 * brightest, "{worst:e} {rmse:e} of {brightest:e}");
    }
}

#[test]
fn any_number_of_threads_gives_soft_light_the_same_bits() {
    let tf = transfer(&[(0.3, 0.0), (0.5, 0.4), (0.9, 2.5)]);
    let plain = scattering();
    let red = Material { extinction_rgb: [0.5, 1.0, 2.0], ..plain };
    let one = grid([14, 14, 14], cubic(0.5), noise);
    let other = block([-2.0, 3.0, -2.0], [2.0, 4.0, 2.0], 0.5);
    let volumes = [volume(&one, &tf, &plain), volume(&other, &tf, &red)];
    let camera = perspective([2.0, 3.0, 16.0], 40.0, [60, 50]);
    let lights = [([2.0, 14.0, 3.0], 3), ([-9.0, 3.0, -9.0], 7)]
        .map(|(at, samples)| extended(LightShape::Sphere { center: DVec3::from_array(at), radius: 1.0 }, samples));
    let with = |threads: usize, order: [usize; 2]| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let lights = order.map(|k| lights[k]).to_vec();
        pool.install(|| draw(&soft(&volumes, &camera, lights), &HalfParams::default()).unwrap())
    };
    let first = with(1, [0, 1]);
    assert!(first.0.channels[0].iter().any(|c| *c > 0.01) && first.1.sweeps == 2);
    for threads in [2, 3] {
        assert!(with(threads, [1, 0]) == first, "{threads} threads");
    }
}

#[test]
fn an_extended_light_that_no_sweep_carries_is_refused() {
    let tf = constant(0.5);
    let material = scattering();
    let grid = grid([12, 12, 12], cubic(0.5), |_| 1.0);
    let volumes = [volume(&grid, &tf, &material)];
    let camera = parallel([0.0, 0.0, 10.0], 3.0, [24, 24]);
    let sphere = |z: f64, radius: f64| extended(LightShape::Sphere { center: DVec3::Z * z, radius }, 16);
    let why = |e: Extended<'_>| serves_extended(&Bodies::volumes(&volumes), &camera, &e.lit.light, e.samples);
    assert_eq!(why(sphere(12.0, 2.0)), Ok(()));
    // The centre is outside; not all points are.
    assert!(matches!(why(sphere(4.5, 3.0)), Err(Reason::LampInside { .. } | Reason::LightAlongSlabs { .. })));
    assert!(matches!(why(sphere(3.4, 0.1)), Err(Reason::LightAlongSlabs { .. })));
    let found = |e: Extended<'static>| draw(&soft(&volumes, &camera, vec![e]), &exact(None)).unwrap_err();
    let none = Extended { samples: 0, ..sphere(12.0, 2.0) };
    assert!(matches!(found(none), Error::Parameter { name: "extended.samples", .. }));
    assert!(matches!(found(sphere(4.5, 3.0)), Error::HalfVector { light: 0, .. }));
    assert!(matches!(found(sphere(12.0, -1.0)), Error::Light(_)));
}
