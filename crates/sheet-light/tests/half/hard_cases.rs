//! Geometry, numbers and orders that break naive half-vector sheets.

use super::common::{draw, exact, half_forms, input, lamp, lit, scattering, sun};
use crate::common::{BEAUTY, apart, constant, cubic, grid, noise, parallel, perspective, transfer, volume};
use sheet_light::half::{Bodies, HalfInput, HalfParams, HalfVector, LEAST_COSINE, Reason, fold, serves};
use sheet_light::{Error, Params, Volume};
use splat_core::glam::DVec3;
use splat_core::shade::{ChannelLayout, LitBy};
use splat_core::{
    Accumulator, Exceeded, LayerSet, LightShape, Limits, Material, Progress, Receiver, Transmittance, rng,
};

#[test]
fn hv01_no_pair_of_directions_is_without_an_axis() {
    let unit = |n: u64, k: u64| rng::unit(7, 0, n, k) * 2.0 - 1.0;
    let direction = |n: u64, k: u64| DVec3::new(unit(n, k), unit(n, k + 1), unit(n, k + 2)).normalize();
    let mut backward = 0;
    for n in 0..500_000 {
        let eye = direction(n, 0);
        // Any direction, and one that is opposite but for a wobble.
        for light in [direction(n, 3), (-eye + 1e-8 * direction(n, 6)).normalize()] {
            let (raw, _) = HalfVector::raw(eye, light);
            let axis = HalfVector::between(eye, light);
            assert!(raw.length() >= 1.414 && axis.normal.is_finite(), "{eye} {light}");
            // Light crosses slabs one way, at 45° or steeper, and so do view rays in their own sense.
            let sense = if axis.back_to_front { 1.0 } else { -1.0 };
            assert!(axis.normal.dot(-light) > 0.707 && axis.normal.dot(eye) * sense > 0.707, "{eye} {light}");
            backward += u64::from(axis.back_to_front);
        }
    }
    assert!((700_000..800_000).contains(&backward), "{backward}");
}

/// A smooth cloud under a sun at an angle to the eye's axis.
fn turned(degrees: f64, slab_width: f64, light_pixels: f64) -> Accumulator {
    let grid = grid([20, 20, 20], cubic(0.25), |p| (-0.6 * p.length_squared()).exp() * (1.0 + 0.3 * (2.0 * p.x).sin()));
    let tf = transfer(&[(0.05, 0.0), (0.6, 1.0), (1.3, 2.0)]);
    let material = scattering();
    let volumes = [volume(&grid, &tf, &material)];
    let camera = parallel([0.0, 0.0, 9.0], 5.0, [48, 48]);
    let (sin, cos) = degrees.to_radians().sin_cos();
    let params = HalfParams { light_pixels, ..exact(Some(slab_width)) };
    draw(&input(&volumes, &camera, &[sun([sin, 0.2 * sin, cos])]), &params).unwrap().0
}

#[test]
fn hv02_nothing_pops_where_the_slabs_turn_over() {
    // In units of what is scattered where nothing attenuates.
    let bright = 4.0 * std::f32::consts::PI;
    let step = |from: f64, by: f64, w: f64| bright * apart(&turned(from - by, w, 1.5), &turned(from + by, w, 1.5));
    for width in [0.25, 0.125] {
        let others = [30.0, 60.0, 80.0, 88.0, 92.0, 120.0].map(|degrees| step(degrees, 1e-4, width));
        let most = others.into_iter().fold(0.0, f32::max);
        let turn = step(90.0, 1e-4, width);
        println!("slabs {width}: {turn:e} where they turn over, {others:?} elsewhere");
        assert!(turn <= 2.0 * most, "slabs {width}: {turn:e} where they turn over, {most:e} elsewhere");
    }
}

#[test]
fn hv13_light_times_a_power_of_two_is_the_picture_times_it() {
    let tf = transfer(&[(0.2, 0.0), (0.5, 0.4), (0.9, 1.5)]);
    let material = scattering();
    let grid = grid([12, 12, 12], cubic(0.5), noise);
    let volumes = [volume(&grid, &tf, &material)];
    let camera = perspective([2.0, 3.0, 12.0], 40.0, [40, 40]);
    let with = |factor: f32, mut light: LitBy<'static>| {
        light.light.intensity = [7.0 * factor, 3.0 * factor, factor];
        draw(&input(&volumes, &camera, &[light]), &exact(None)).unwrap().0
    };
    for light in [sun([1.0, 2.0, 1.0]), lamp([-9.0, 3.0, -12.0])] {
        let one = with(1.0, light);
        let mut other = with(2f32.powi(20), light);
        assert!(one.channels[0].iter().any(|c| *c > 1e-4));
        other.channels.iter_mut().flatten().for_each(|c| *c *= 2f32.powi(-20));
        assert_eq!(one, other);
    }
}

#[test]
fn hv14_hv15_light_and_lens_that_cross_slabs_backwards_are_refused() {
    let tf = constant(0.5);
    let material = scattering();
    let grid = grid([12, 12, 12], cubic(0.5), |_| 1.0);
    let volumes = [volume(&grid, &tf, &material)];
    let camera = perspective([0.0, 0.0, 12.0], 50.0, [24, 24]);
    let why = |light: LitBy<'_>| serves(&Bodies::volumes(&volumes), &camera, &light.light);
    assert_eq!(why(sun([1.0, 1.0, 1.0])), Ok(()));
    assert_eq!(why(lamp([8.0, 8.0, 8.0])), Ok(()));
    // Inside, on a face, and just outside of one.
    let inside = DVec3::new(1.0, 0.5, -2.0);
    assert_eq!(why(lamp(inside.to_array())), Err(Reason::LampInside { volume: 0, position: inside }));
    assert!(matches!(why(lamp([3.0, 0.0, 0.0])), Err(Reason::LampInside { .. })));
    let near = why(lamp([0.3, 3.2, 0.0]));
    assert!(matches!(near, Err(Reason::LightAlongSlabs { cosine }) if cosine < LEAST_COSINE), "{near:?}");
    // Half of a volume beside a wide lens.
    let wide = perspective([0.0, 0.0, 3.5], 120.0, [24, 24]);
    let flat = serves(&Bodies::volumes(&volumes), &wide, &sun([1.0, 0.0, 0.1]).light);
    assert!(matches!(flat, Err(Reason::ViewAlongSlabs { cosine }) if cosine < LEAST_COSINE), "{flat:?}");
    let sphere = lit(LightShape::Sphere { center: DVec3::splat(20.0), radius: 1.0 });
    assert_eq!(why(sphere), Err(Reason::Extended));
    let lights = [sun([1.0, 1.0, 1.0]), lamp([1.0, 0.5, -2.0])];
    let refused = draw(&input(&volumes, &camera, &lights), &exact(None));
    assert!(matches!(refused, Err(Error::HalfVector { light: 1, reason: Reason::LampInside { .. } })), "{refused:?}");
    assert!(refused.unwrap_err().to_string().contains("inside volume 0"));
}

#[test]
fn hv16_lights_in_any_order_give_the_same_bits() {
    let tf = transfer(&[(0.2, 0.0), (0.5, 0.4), (0.9, 1.5)]);
    let dark = scattering();
    let grid = grid([12, 12, 12], cubic(0.5), noise);
    let camera = perspective([2.0, 3.0, 12.0], 40.0, [40, 40]);
    let a = sun([1.0, 2.0, 1.0]);
    let b = lamp([-9.0, 3.0, -12.0]);
    let c = sun([-3.0, 1.0, -1.0]);
    let with = |material: &Material, lights: &[LitBy<'_>]| {
        draw(&input(&[volume(&grid, &tf, material)], &camera, lights), &exact(None)).unwrap()
    };
    let all = with(&dark, &[a, b, c]);
    assert_eq!(all, with(&dark, &[c, a, b]));
    assert_eq!(all, with(&dark, &[b, c, a]));
    assert_eq!(all.1.sweeps, 3);
    // Images add, and what is emitted is there once: as in one sweep, whichever comes first.
    let alone = [a, b, c].map(|light| with(&dark, &[light]).0);
    let glowing = Material { emission: [0.1; 3], ..dark };
    let lit = with(&glowing, &[a, b, c]).0;
    let glow = [a, b, c].map(|light| with(&glowing, &[light]).0);
    let mut is_one_of = [true; 3];
    for at in 0..1600 {
        let sum: f32 = alone.iter().map(|out| out.channels[0][at]).sum();
        assert!((all.0.channels[0][at] - sum).abs() < 1e-6, "{at}: {sum}");
        let emitted = lit.channels[0][at] - all.0.channels[0][at];
        for n in 0..3 {
            is_one_of[n] &= (emitted - (glow[n].channels[0][at] - alone[n].channels[0][at])).abs() < 1e-6;
        }
    }
    assert!(is_one_of.contains(&true));
}

#[test]
fn a_light_buffer_is_no_larger_at_800_slabs_than_at_50() {
    let tf = constant(0.5);
    let material = scattering();
    let grid = grid([12, 12, 12], cubic(0.5), |_| 1.0);
    let volumes = [volume(&grid, &tf, &material)];
    let lights = [sun([0.0, 0.0, 1.0])];
    let camera = parallel([0.0, 0.0, 12.0], 8.0, [24, 24]);
    let counts = |slabs: f64| draw(&input(&volumes, &camera, &lights), &exact(Some(6.0 / slabs))).unwrap().1;
    let few = counts(50.0);
    let many = counts(800.0);
    assert_eq!(few.light_bytes, many.light_bytes);
    assert!(few.slabs < 200 && many.slabs > 800 && few.light_bytes > 0, "{few:?} {many:?}");
    assert!(few.voxels == 1728 && few.visible >= 1728 && few.light_fragments > 0 && few.eye_fragments > 0);
}

#[test]
fn ia07_a_ramp_has_the_same_normal_everywhere() {
    let layers = LayerSet { normal: true, ..LayerSet::default() };
    let layout = ChannelLayout::new(&layers);
    let tf = constant(0.5);
    let material = Material::default();
    for slope in [DVec3::X, DVec3::Z, DVec3::new(1.0, 2.0, -1.5)] {
        let grid = grid([20, 20, 20], cubic(0.5), |p| 1e3 + slope.dot(p));
        let mut volumes = [volume(&grid, &tf, &material)];
        volumes[0].normals = true;
        for camera in [parallel([0.0, 0.0, 12.0], 9.0, [60, 60]), perspective([0.0, 0.0, 16.0], 30.0, [60, 60])] {
            let lights = [sun([1.0, 0.5, 1.0]), sun([1.0, 0.5, -1.0])];
            for (light, params) in lights.iter().flat_map(|light| half_forms(&exact(None)).map(|form| (*light, form))) {
                let mut out = Accumulator::new(camera.size, 1, layout.count(), false, false);
                fold(&input(&volumes, &camera, &[light]), &params, &layout, &mut out, None).unwrap();
                let first = layout.normal().unwrap();
                for at in 0..3600 {
                    let opacity = 1.0 - (-out.optical_depth[0][at]).exp();
                    // At the picture's border differences are one-sided.
                    let is_border = [at % 60, at / 60].into_iter().any(|v| v == 0 || v == 59);
                    if opacity > 0.2 && !is_border {
                        let n = [0, 1, 2].map(|a| f64::from(out.channels[first + a][at] / opacity));
                        let off = (DVec3::from_array(n) + slope.normalize()).length();
                        assert!(off < 0.01, "{slope}, pixel {at}: {n:?}, off by {off}");
                    }
                }
            }
        }
    }
}

#[test]
fn what_is_behind_an_opaque_surface_is_not_seen_but_lit_all_the_same() {
    let tf = constant(0.25);
    let material = scattering();
    let grid = grid([20, 20, 20], cubic(0.5), |_| 1.0);
    let volumes = [volume(&grid, &tf, &material)];
    let camera = parallel([0.0, 0.0, 20.0], 4.0, [40, 40]);
    let opaque: Vec<f32> = (0..1600).map(|i| 15.0 + (i % 40) as f32 * 0.1).collect();
    for light in [sun([1.0, 0.0, 1.0]), sun([0.0, 0.0, -1.0])] {
        let lights = [light];
        let whole = input(&volumes, &camera, &lights);
        for params in half_forms(&exact(None)) {
            let (out, _) = draw(&HalfInput { opaque: &opaque, ..whole.clone() }, &params).unwrap();
            for (tau, depth) in out.optical_depth[0].iter().zip(&opaque) {
                assert!((tau - 0.25 * (depth - 15.0)).abs() < 4e-6, "{tau} before {depth}");
            }
            assert!(out.channels[0][39] > 1e-4);
        }
    }
}

#[test]
fn depths_are_those_of_slabs_across_the_view() {
    let tf = transfer(&[(0.2, 0.0), (0.5, 0.2), (1.5, 0.8)]);
    let material = scattering();
    let grid = grid([16, 16, 16], cubic(0.5), |p| 0.6 + 0.4 * (p.x + 0.5 * p.z).sin());
    let volumes = [volume(&grid, &tf, &material)];
    let camera = perspective([1.0, 2.0, 14.0], 30.0, [24, 24]);
    let lights = [sun([1.0, 1.0, 2.0]), sun([1.0, 1.0, -2.0])];
    for (light, params) in lights.iter().flat_map(|light| half_forms(&exact(Some(0.2))).map(|form| (*light, form))) {
        let view = crate::common::draw(&crate::common::input(&volumes, &camera, &[]), &params.sheets).unwrap().0;
        let half = draw(&input(&volumes, &camera, &[light]), &params).unwrap().0;
        for at in (0..576).filter(|at| view.optical_depth[0][*at] > 0.5) {
            let [one, other] = [&view, &half].map(|out| out.depth[at].depths(out.optical_depth[0][at], None));
            for (a, b) in one.into_iter().zip(other) {
                // Within a slab.
                assert!((a - b).abs() < 0.2 || a == b, "{at}: {one:?} {other:?}");
            }
        }
        assert_eq!(view.object, half.object);
    }
}

#[test]
fn pixels_that_are_done_err_by_no_more_than_what_they_hide() {
    let tf = transfer(&[(0.1, 0.0), (0.5, 2.0), (0.9, 6.0)]);
    let material = scattering();
    let grid = grid([24, 24, 24], cubic(0.25), noise);
    let volumes = [volume(&grid, &tf, &material)];
    let lights = [sun([1.0, 1.0, 1.0])];
    let camera = perspective([2.0, 3.0, 12.0], 30.0, [60, 60]);
    for mut params in half_forms(&exact(None)) {
        let full = draw(&input(&volumes, &camera, &lights), &params).unwrap().0;
        params.sheets.transmittance_cutoff = 0.02;
        let early = draw(&input(&volumes, &camera, &lights), &params).unwrap().0;
        let difference = apart(&full, &early);
        assert!(difference > 0.0 && difference <= 0.02, "{difference}");
    }
}

#[test]
fn what_cannot_be_drawn_is_refused() {
    let tf = constant(0.5);
    let material = scattering();
    let good = grid([12, 12, 12], cubic(0.5), |_| 1.0);
    let volumes = [volume(&good, &tf, &material)];
    let lights = [sun([1.0, 1.0, 1.0])];
    let camera = parallel([0.0, 0.0, 10.0], 3.0, [24, 24]);
    let whole = input(&volumes, &camera, &lights);
    let found = |params| draw(&whole, &params).unwrap_err();
    let bad = |light_pixels, most_light_pixels| {
        found(sheet_light::half::HalfParams { light_pixels, most_light_pixels, ..exact(None) })
    };
    assert!(matches!(bad(0.0, 64), Error::Parameter { name: "light_pixels", .. }));
    assert!(matches!(bad(1.0, 4), Error::Parameter { name: "most_light_pixels", .. }));
    let mut params = exact(None);
    params.sheets = Params { limits: Limits::bytes(1000), ..params.sheets };
    assert!(matches!(found(params), Error::Limit(Exceeded { limit: Some(1000), .. })));
    let dark = [lit(LightShape::Directional { direction: DVec3::ZERO })];
    assert!(matches!(draw(&input(&volumes, &camera, &dark), &exact(None)), Err(Error::Light(_))));
    let progress = Progress::new();
    progress.cancel();
    let mut out = Accumulator::new(camera.size, 1, 3, false, false);
    assert_eq!(fold(&whole, &exact(None), &BEAUTY, &mut out, Some(&progress)), Err(Error::Cancelled));
}

/// Lets the same share of light through everywhere.
struct Veil(f32);

impl Transmittance for Veil {
    fn transmittance(&self, _: &Receiver) -> [f32; 3] {
        [self.0; 3]
    }
}

/// A share that the 16 bits of a voxel hold.
static VEIL: Veil = Veil(1.0 / 3.0);

#[test]
fn what_else_casts_shadows_attenuates_the_light_as_far_as_it_is_received() {
    let tf = transfer(&[(0.2, 0.0), (0.5, 0.4), (0.9, 1.5)]);
    let material = scattering();
    let grid = grid([10, 10, 10], cubic(0.5), noise);
    let camera = perspective([2.0, 3.0, 12.0], 40.0, [30, 30]);
    for light in [sun([1.0, 2.0, 1.0]), lamp([-9.0, 3.0, -12.0])] {
        let with = |shadow: Option<&'static Veil>, shadow_coefficient: f32| {
            let shadow: Option<&dyn Transmittance> = shadow.map(|veil| veil as &dyn Transmittance);
            let volumes = [Volume { shadow_coefficient, ..volume(&grid, &tf, &material) }];
            draw(&input(&volumes, &camera, &[LitBy { shadow, ..light }]), &exact(None)).unwrap().0
        };
        let open = with(None, 1.0);
        let veiled = with(Some(&VEIL), 1.0);
        assert!(open.channels[0].iter().any(|c| *c > 1e-4) && open.optical_depth == veiled.optical_depth);
        for (open, veiled) in open.channels[0].iter().zip(&veiled.channels[0]) {
            assert!((open * VEIL.0 - veiled).abs() <= 1e-6 * open, "{open} {veiled}");
        }
        // Who receives no shadow has none, neither his own nor another's.
        assert_eq!(with(None, 0.0), with(Some(&VEIL), 0.0));
        assert!(with(None, 0.0).channels[0].iter().zip(&open.channels[0]).all(|(lit, shadowed)| lit >= shadowed));
    }
}

#[test]
fn a_light_without_a_sweep_and_a_volume_without_a_shadow_take_nothing_of_the_light() {
    let tf = transfer(&[(0.5, 0.7)]);
    let material = scattering();
    let grid = grid([12, 12, 6], cubic(0.5), |_| 0.5);
    let camera = parallel([0.0, 0.0, 9.0], 2.0, [12, 12]);
    let volumes = [volume(&grid, &tf, &material)];
    let see_through = [Volume { casts_shadow: false, ..volumes[0] }];
    let sun = sun([0.4, 0.3, 1.0]);
    let with = |volumes: &[Volume<'_>], lights: &[LitBy<'static>], mapped: &[LitBy<'static>]| {
        let input = HalfInput { mapped: mapped.to_vec(), ..input(volumes, &camera, lights) };
        draw(&input, &exact(None)).unwrap().0.channels[1].clone()
    };
    let near = |seen: &[f32], expected: &dyn Fn(usize) -> f32| {
        let worst = seen.iter().enumerate().map(|(k, c)| (c - expected(k)).abs()).fold(0.0, f32::max);
        assert!(worst < 1e-6, "{worst:e}");
    };
    // τ = 2.1, of which light is scattered alike everywhere.
    let open = tf.at(0.5).color[1] * (1.0 - (-2.1f32).exp()) / (4.0 * std::f32::consts::PI);
    near(&with(&volumes, &[], &[sun]), &|_| open);
    near(&with(&see_through, &[sun], &[]), &|_| open);
    let veiled = LitBy { shadow: Some(&VEIL), ..sun };
    near(&with(&volumes, &[], &[veiled]), &|_| open * VEIL.0);
    // Beside a sweep it adds up.
    let carried = with(&volumes, &[sun], &[]);
    assert!(carried.iter().all(|c| *c < 0.6 * open));
    near(&with(&volumes, &[sun], &[sun, veiled]), &|k| carried[k] + open * (1.0 + VEIL.0));
}
