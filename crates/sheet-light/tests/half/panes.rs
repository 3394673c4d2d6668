//! Translucent polygons: closed forms for the eye and for light, order, edges, what they let through to all that receives, hard cases.

use super::common::{exact, input, lamp, lit, scattering, sun};
use super::polygons::{polygons, wall, white};
use crate::common::{BEAUTY, constant, cubic, grid, noise, parallel, perspective, transfer, volume};
use sheet_light::Error;
use sheet_light::half::{Drawn, Extended, HalfInput, HalfParams, Polygons, Scattering, fold, reference};
use splat_core::glam::DVec3;
use splat_core::optics::SurfaceOpacity;
use splat_core::shade::{ChannelLayout, LitBy};
use splat_core::{Accumulator, LayerSet, LightShape, Limits, Material, Mesh, Shading};
use std::f64::consts::PI;

/// One that lets e^−τ through.
fn pane<'a>(mesh: &'a Mesh, material: &'a Material, optical_depth: f32) -> Polygons<'a> {
    Polygons { optical_depth, ..polygons(mesh, material) }
}

/// A large square across z.
fn across(z: f64) -> Mesh {
    wall([0.0, 0.0, z], [9.0, 0.0, 0.0], [0.0, 9.0, 0.0])
}

/// Shows its colour.
fn flat() -> Material {
    Material { shading: Shading::Unlit, ..Material::default() }
}

fn coarse(slab_width: Option<f64>) -> HalfParams {
    HalfParams { most_light_pixels: 256, ..exact(slab_width) }
}

fn draw(input: &HalfInput<'_>, params: &HalfParams, planes: usize) -> (Accumulator, Drawn) {
    let mut out = Accumulator::new(input.sheets.camera.size, planes, 3, true, true);
    let drawn = fold(input, params, &BEAUTY, &mut out, None).unwrap();
    (out, drawn)
}

#[test]
fn panes_in_a_medium_have_the_closed_form_for_eye_and_light_at_any_slabs_and_angle() {
    let sigma = 0.4;
    let half = 3.0;
    let tau = 0.35f64;
    let grid = grid([12, 12, 12], cubic(0.5), |_| 1.0);
    let tf = constant(sigma as f32);
    let medium = scattering();
    let paper = Material { transmission: 0.5, ..white() };
    let volumes = [volume(&grid, &tf, &medium)];
    let places = [3.4, 2.2, 0.9, 0.25, 0.0, -0.6, -2.9, -3.2];
    let meshes = places.map(across);
    let all = meshes.each_ref().map(|mesh| pane(mesh, &paper, tau as f32));
    let phase = 1.0 / (4.0 * PI);
    for (from, camera) in [
        ([0.0, 0.0, 1.0], parallel([0.0, 0.0, 12.0], 2.0, [9, 9])),
        ([0.28, 0.0, 0.96], perspective([0.0, 0.0, 12.0], 20.0, [9, 9])),
        ([0.0, -0.28, 0.96], parallel([0.0, 0.0, 12.0], 2.0, [9, 9])),
        ([0.0, 0.0, -1.0], parallel([0.0, 0.0, 12.0], 2.0, [9, 9])),
        ([0.28, 0.0, -0.96], perspective([0.0, 0.0, 12.0], 20.0, [9, 9])),
    ] {
        let lights = [sun(from)];
        let secant = 1.0 / from[2].abs();
        // Optical depths to the eye and to the light: of the medium, per depth below its upper face, and of the panes before.
        let side = from[2].signum();
        let light = |z: f64| {
            let way = (half - side * z).clamp(0.0, 2.0 * half);
            let before = places.iter().filter(|p| (*p - z) * side > 1e-9).count();
            sigma * secant * way + tau * before as f64
        };
        let eye = |z: f64| {
            let before = places.iter().filter(|p| **p > z + 1e-9).count();
            sigma * (half - z).clamp(0.0, 2.0 * half) + tau * before as f64
        };
        let mut expected = 0.0;
        for z in places {
            expected += -(-tau).exp_m1() * 0.5 / PI / secant * (-eye(z) - light(z)).exp();
        }
        let faces: Vec<f64> =
            [half].into_iter().chain(places.into_iter().filter(|z| z.abs() < half)).chain([-half]).collect();
        for ends in faces.windows(2) {
            let middle = 0.5 * (ends[0] + ends[1]);
            let length = ends[0] - ends[1];
            // ∫ σ·e^(−τ_eye − τ_light) dz, whose exponent is linear.
            let slope = sigma * (1.0 + side * secant);
            let shape = if slope.abs() < 1e-12 { 1.0 } else { (slope * length / 2.0).sinh() / (slope * length / 2.0) };
            expected += phase * sigma * length * (-eye(middle) - light(middle)).exp() * shape;
        }
        let through = (-sigma * 2.0 * half - tau * places.len() as f64).exp();
        for slab_width in [0.1, 0.5, 1.3, 40.0] {
            let input = HalfInput { polygons: &all, ..input(&volumes, &camera, &lights) };
            let (out, _) = draw(&input, &coarse(Some(slab_width)), 1);
            let found = [out.channels[0][40], (-out.optical_depth[0][40]).exp()].map(f64::from);
            assert!((found[1] - through).abs() < 1e-6, "{from:?}, slabs {slab_width}: {found:?}, not {through}");
            let error = (found[0] - expected).abs();
            assert!(error < 1e-5, "{from:?}, slabs {slab_width}: {}, not {expected}, by {error:e}", found[0]);
        }
    }
}

#[test]
fn panes_that_cross_are_in_order_on_each_side_of_the_crossing_in_the_open_and_in_a_medium() {
    let red = flat();
    let green = flat();
    let slanted = [0.3, -0.3].map(|slope| wall([0.0; 3], [4.0, 0.0, 4.0 * slope], [0.0, 4.0, 0.0]));
    let all = [
        Polygons { color: [1.0, 0.0, 0.0], object: 1, ..pane(&slanted[0], &red, 0.7) },
        Polygons { color: [0.0, 1.0, 0.0], object: 2, ..pane(&slanted[1], &green, 0.7) },
    ];
    let thin = grid([12, 12, 12], cubic(0.5), |_| 1.0);
    let tf = constant(1e-6);
    let medium = scattering();
    let volumes = [volume(&thin, &tf, &medium)];
    let camera = parallel([0.0, 0.0, 9.0], 4.0, [16, 16]);
    let first = -(-0.7f64).exp_m1();
    let second = -(-0.7f64).exp_m1() * (-0.7f64).exp();
    let cases =
        [(&volumes[..], sun([0.0, 0.0, 1.0])), (&volumes[..], sun([0.0, 0.2, -1.0])), (&[], sun([0.0, 0.0, 1.0]))];
    for ((volumes, light), slab_width) in cases.into_iter().flat_map(|case| [0.05, 40.0].map(|width| (case, width))) {
        let input = HalfInput { polygons: &all, ..input(volumes, &camera, std::slice::from_ref(&light)) };
        let (out, _) = draw(&input, &coarse(Some(slab_width)), 1);
        for k in 0..256 {
            // The red one is nearer on the right.
            let is_right = k % 16 >= 8;
            let expected = if is_right { [first, second] } else { [second, first] };
            let found = [0, 1].map(|c| f64::from(out.channels[c][k]));
            let worst = (0..2).map(|c| (found[c] - expected[c]).abs()).fold(0.0, f64::max);
            assert!(worst < 1e-5, "{k}, slabs {slab_width}: {found:?}, not {expected:?}");
            // The haze before them is an object, too.
            let object = if !volumes.is_empty() { 0 } else { 1 + u32::from(!is_right) };
            assert_eq!(out.object[k], object, "{k}, slabs {slab_width}");
        }
    }
}

#[test]
fn an_edge_of_a_pane_is_that_of_an_opaque_one_and_depths_are_its_own() {
    let tf = constant(0.2);
    let medium = scattering();
    let material = white();
    let haze = grid([12, 12, 12], cubic(0.5), |_| 1.0);
    let volumes = [volume(&haze, &tf, &medium)];
    let mesh = wall([0.13, -0.21, 0.4], [0.9, 0.31, 0.0], [-0.27, 0.83, 0.1]);
    let camera = perspective([0.3, 0.4, 6.0], 30.0, [48, 48]);
    let lights = [sun([0.0, 0.0, 1.0])];
    let opaque = [polygons(&mesh, &material)];
    let solid = draw(&HalfInput { polygons: &opaque, ..input(&[], &camera, &lights) }, &coarse(None), 1).1.polygons;
    for volumes in [&volumes[..], &[]] {
        let shown = |all: &[Polygons<'_>]| {
            draw(&HalfInput { polygons: all, ..input(volumes, &camera, &lights) }, &coarse(None), 1).0
        };
        let with = shown(&[pane(&mesh, &material, 0.5)]);
        let without = shown(&[]);
        let mut covered = 0;
        for k in 0..48 * 48 {
            let own = with.optical_depth[0][k] - without.optical_depth[0][k];
            let expected = if solid.depth[k].is_finite() { 0.5 } else { 0.0 };
            covered += usize::from(expected > 0.0);
            assert!((own - expected).abs() < 2e-6, "pixel {k}: {own}, not {expected}");
            if volumes.is_empty() && expected > 0.0 {
                let [first, ..] = with.depth[k].depths(0.5, None).map(|depth| depth - solid.depth[k]);
                assert!(first.abs() < 1e-5, "pixel {k}: {first} too deep");
            }
        }
        assert!(covered > 200, "{covered}");
    }
}

#[test]
fn a_pane_tints_by_channel_what_is_behind_it_for_eye_and_light() {
    let tf = constant(0.3);
    let medium = scattering();
    let material = white();
    let tinted = Material { extinction_rgb: [0.25, 1.0, 2.0], ..flat() };
    let above = across(1.0);
    let floor = across(-2.0);
    let all = [Polygons { color: [0.0; 3], ..pane(&above, &tinted, 0.6) }, polygons(&floor, &material)];
    let haze = grid([40, 40, 4], cubic(0.25), |_| 1.0);
    let volumes = [volume(&haze, &tf, &medium)];
    let camera = parallel([0.0, 0.0, 9.0], 2.0, [8, 8]);
    for volumes in [&[][..], &volumes] {
        let lights = [sun([0.3, 0.1, 1.0])];
        let shown = |all: &[Polygons<'_>]| {
            draw(&HalfInput { polygons: all, ..input(volumes, &camera, &lights) }, &coarse(Some(0.3)), 3)
        };
        let with = shown(&all);
        let without = shown(&all[1..]);
        for (c, factor) in [0.25f64, 1.0, 2.0].into_iter().enumerate() {
            let through = (-0.6 * factor).exp();
            let floors = [&with, &without].map(|(_, drawn)| f64::from(drawn.polygons.channels[c][27]));
            assert!((floors[0] / floors[1] - through).abs() < 1e-5, "{c}: {floors:?}");
            if !volumes.is_empty() {
                // Once for the light and once for the eye.
                let scattered = [&with, &without].map(|(out, _)| f64::from(out.channels[c][27]));
                assert!((scattered[0] / scattered[1] - through * through).abs() < 1e-5, "{c}: {scattered:?}");
            }
        }
    }
}

#[test]
fn light_with_an_extent_comes_through_panes_as_that_of_its_points() {
    let tf = constant(0.3);
    let medium = scattering();
    let material = white();
    let haze = grid([16, 16, 8], cubic(0.5), |_| 1.0);
    let volumes = [volume(&haze, &tf, &medium)];
    // Half of the floor lies behind the pane's edge.
    let half = wall([4.0, 0.0, 3.0], [4.0, 0.0, 0.0], [0.0, 8.0, 0.0]);
    let floor = across(-3.0);
    let all = [pane(&half, &material, 0.8), polygons(&floor, &material)];
    let camera = parallel([0.5, 0.3, 12.0], 5.0, [24, 24]);
    let shape = LightShape::Disk { center: DVec3::new(0.0, 0.0, 14.0), normal: DVec3::NEG_Z, radius: 0.8 };
    let lamp = LitBy { light: splat_core::Light { intensity: [200.0; 3], ..lit(shape).light }, ..lit(shape) };
    let params = HalfParams { most_light_pixels: 512, ..exact(Some(0.4)) };
    let points: Vec<LitBy<'_>> =
        lamp.light.points(8).into_iter().map(|light| LitBy { slide: None, light, shadow: None }).collect();
    for volumes in [&[][..], &volumes] {
        let soft = HalfInput {
            polygons: &all,
            extended: vec![Extended { lit: lamp, samples: 8 }],
            ..input(volumes, &camera, &[])
        };
        let one = draw(&soft, &params, 1);
        let many = draw(&HalfInput { polygons: &all, ..input(volumes, &camera, &points) }, &params, 1);
        let mean = |values: &[f32]| values.iter().map(|v| f64::from(*v)).sum::<f64>() / values.len() as f64;
        for [one, many] in
            [[&one.1.polygons.channels[0], &many.1.polygons.channels[0]], [&one.0.channels[0], &many.0.channels[0]]]
        {
            let mut apart: Vec<f64> =
                one.iter().zip(many).map(|(a, b)| f64::from((a - b).abs()) / mean(many)).collect();
            apart.sort_by(f64::total_cmp);
            // Steps of the points, of which one takes a fifteenth, lie where pixels of their images have them.
            let [most, worst] = [apart[apart.len() * 9 / 10], apart[apart.len() - 1]];
            assert!(most < 0.016 && worst < 0.09, "{most}, {worst} of {}", mean(many));
        }
    }
}

#[test]
fn a_pane_in_a_medium_that_scatters_again_tints_what_it_lets_through() {
    const APART: ChannelLayout =
        ChannelLayout::new(&LayerSet { effects: true, shadow: false, normal: false, depth: false, object: false })
            .with_multiple();
    let slab = grid([48, 48, 8], cubic(0.5), |_| 1.0);
    let tf = constant(0.5);
    let medium = scattering();
    let volumes = [volume(&slab, &tf, &medium)];
    let tinted = Material { extinction_rgb: [0.5, 1.0, 2.0], ..flat() };
    let params = HalfParams { scattering: Scattering::ForwardAndBack, voxels_per_cell: 1, ..coarse(Some(0.1)) };
    let camera = parallel([0.0, 0.0, -12.0], 2.0, [9, 9]);
    let lights = [sun([0.0, 0.0, 1.0])];
    let middle = |all: &[Polygons<'_>]| {
        let mut out = Accumulator::new(camera.size, 3, APART.count(), false, false);
        let input = HalfInput { polygons: all, ..input(&volumes, &camera, &lights) };
        fold(&input, &params, &APART, &mut out, None).unwrap();
        [0, 1, 2].map(|c| f64::from(out.channels[12 + c][40]))
    };
    let plain = middle(&[]);
    for (z, tau) in [(5.0, 0.7), (0.0, 0.7)] {
        let mesh = wall([0.0, 0.0, z], [15.0, 0.0, 0.0], [0.0, 15.0, 0.0]);
        let found = middle(&[Polygons { color: [0.0; 3], ..pane(&mesh, &tinted, tau) }]);
        for (c, factor) in [0.5f64, 1.0, 2.0].into_iter().enumerate() {
            let through = (-f64::from(tau) * factor).exp();
            let share = found[c] / plain[c];
            // One before the medium takes its share of all; one amidst of what comes through, and of what comes back.
            let expected = if z > 2.0 { through * 0.99..through * 1.01 } else { 0.3 * through..1.1 * through };
            assert!(expected.contains(&share), "{z}, {c}: {share}, not {expected:?}");
        }
    }
}

#[test]
fn hv_panes_are_those_of_the_twin_but_at_the_edges_of_shadows() {
    let tf = transfer(&[(0.2, 0.0), (0.5, 0.4), (0.8, 0.1), (0.9, 1.5)]);
    let material = scattering();
    let grid = grid([8, 7, 6], cubic(0.5), noise);
    let volumes = [volume(&grid, &tf, &material)];
    let paper = Material { transmission: 0.3, ..white() };
    let film = Material { surface_opacity: SurfaceOpacity::ThinSlab, extinction_rgb: [0.5; 3], ..flat() };
    // Two that cross each other, and an opaque one.
    let meshes = [
        wall([0.2, 0.1, 0.0], [1.5, 0.3, 0.2], [0.0, 0.2, 1.6]),
        wall([0.2, 0.1, 0.0], [1.6, -0.3, 0.1], [0.1, 1.3, 0.4]),
        wall([-0.5, 1.5, -0.2], [0.8, 0.0, 0.1], [0.0, 0.1, 0.7]),
    ];
    let [a, b, c] = meshes.each_ref();
    let all = [pane(a, &paper, 0.5), pane(b, &film, 0.8), polygons(c, &paper)];
    for (camera, light, slab_width) in [
        (parallel([3.0, 2.0, 8.0], 5.0, [24, 20]), sun([1.0, 3.0, 2.0]), None),
        (perspective([2.0, 3.0, 8.0], 35.0, [20, 24]), sun([-1.0, 2.0, -3.0]), Some(1.3)),
        (perspective([2.0, 3.0, 8.0], 35.0, [20, 24]), sun([8.0, 0.1, -3.0]), Some(0.5)),
    ] {
        let lights = [light];
        let input = HalfInput { polygons: &all, ..input(&volumes, &camera, &lights) };
        let params = HalfParams { most_light_pixels: 1024, ..exact(slab_width) };
        let twin = exact(slab_width);
        let (out, drawn) = draw(&input, &params, 1);
        let twin = reference::draw(&input, &twin).unwrap();
        let mut apart = Vec::new();
        let mut shown = 0;
        for (at, expected) in twin.color.iter().enumerate() {
            let tau = f64::from(out.optical_depth[0][at]);
            // At the edges of polygons one form sees them, the other does not.
            if (tau - twin.optical_depth[at]).abs() < 1e-4 {
                let color = f64::from(out.channels[1][at]) + (-tau).exp() * f64::from(drawn.polygons.channels[1][at]);
                apart.push((color - expected[1]).abs());
                shown += usize::from(tau > 0.4);
            }
        }
        let size = apart.len();
        apart.sort_by(f64::total_cmp);
        let most = apart[size * 9 / 10];
        let edges = apart.iter().filter(|d| **d > 1e-3).count();
        assert!(shown > 100 && size > twin.color.len() * 98 / 100, "{shown} pixels show any, {size} in all");
        let worst = apart[size - 1];
        assert!(most < 1e-4 && edges < 6, "{:?}: {most:e}, {edges} edges, {worst:e}", light.light.shape);
    }
}

#[test]
fn hv11_a_pane_seen_and_lit_along_its_plane_gives_numbers_and_any_threads_the_same_bits() {
    let tf = transfer(&[(0.3, 0.0), (0.9, 1.5)]);
    let medium = scattering();
    let grid = grid([10, 10, 10], cubic(0.5), noise);
    let volumes = [volume(&grid, &tf, &medium)];
    let film = Material { surface_opacity: SurfaceOpacity::ThinSlab, ..white() };
    let meshes = [
        // In the plane of the eye and of the light; slanted; without area.
        wall([0.0; 3], [0.0, 0.0, 4.0], [0.0, 4.0, 0.0]),
        wall([0.4, 0.1, 0.2], [2.0, 0.3, 0.1], [0.0, 1.0, 1.5]),
        wall([0.5, 0.5, 0.5], [1.0, 0.0, 0.0], [1.0, 0.0, 0.0]),
    ];
    let all = meshes.each_ref().map(|mesh| pane(mesh, &film, 0.4));
    let lights = [sun([0.0, 1.0, 1.0]), lamp([0.0, 7.0, 3.0])];
    for camera in [parallel([0.0, 0.0, 9.0], 5.0, [33, 33]), perspective([0.0, 0.0, 9.0], 40.0, [33, 33])] {
        let shown = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            let input = HalfInput { polygons: &all, ..input(&volumes, &camera, &lights) };
            pool.install(|| draw(&input, &coarse(None), 1).0)
        };
        let one = shown(1);
        let numbers = one.channels.iter().chain(&one.optical_depth).flatten();
        assert!(numbers.clone().all(|v| v.is_finite() && *v >= 0.0));
        let bits = |picture: &Accumulator| {
            picture.channels.iter().chain(&picture.optical_depth).flatten().map(|v| v.to_bits()).collect::<Vec<u32>>()
        };
        for threads in [2, 3, 7] {
            assert!(bits(&shown(threads)) == bits(&one), "{threads} threads");
        }
    }
}

#[test]
fn what_lists_of_panes_would_take_is_refused_before() {
    let material = white();
    let meshes: Vec<Mesh> = (0..40).map(|n| across(-0.05 * f64::from(n))).collect();
    let all: Vec<Polygons<'_>> = meshes.iter().map(|mesh| pane(mesh, &material, 0.05)).collect();
    let camera = parallel([0.0, 0.0, 9.0], 2.0, [64, 64]);
    let lights = [sun([0.0, 0.0, 1.0])];
    let with = |max_bytes: u64| {
        let mut params = HalfParams { most_light_pixels: 64, ..exact(None) };
        params.sheets.limits = Limits::bytes(max_bytes);
        let mut out = Accumulator::new([64, 64], 1, 3, false, false);
        let input = HalfInput { polygons: &all, ..input(&[], &camera, &lights) };
        fold(&input, &params, &BEAUTY, &mut out, None).map(|drawn| drawn.counts.bytes)
    };
    let taken = with(1 << 30).unwrap();
    assert!(taken > 40 * 4096 * 72, "{taken}");
    let Err(Error::Limit(said)) = with(1 << 22) else { panic!("not refused") };
    assert!(said.to_string().contains("layers of translucent triangles") && said.needed > 0, "{said}");
    // Many layers of little are what they are in all.
    let mut out = Accumulator::new([64, 64], 1, 3, false, false);
    fold(&HalfInput { polygons: &all, ..input(&[], &camera, &[]) }, &coarse(None), &BEAUTY, &mut out, None).unwrap();
    assert!(out.optical_depth[0].iter().all(|tau| (tau - 2.0).abs() < 1e-5));
}

#[test]
fn a_pane_that_lets_all_through_changes_nothing_and_no_number_is_refused() {
    let material = white();
    let mesh = across(0.0);
    let camera = parallel([0.0, 0.0, 9.0], 2.0, [8, 8]);
    let shown = |tau: f32| {
        let all = [pane(&mesh, &material, tau)];
        let mut out = Accumulator::new([8, 8], 1, 3, false, false);
        fold(&HalfInput { polygons: &all, ..input(&[], &camera, &[]) }, &coarse(None), &BEAUTY, &mut out, None)
            .map(|_| out)
    };
    assert!(shown(0.0).unwrap().optical_depth[0].iter().all(|tau| *tau == 0.0));
    for tau in [-1.0, f32::NAN] {
        let said = shown(tau).err().unwrap().to_string();
        assert!(said.contains("optical_depth") && said.contains("0"), "{said}");
    }
}
