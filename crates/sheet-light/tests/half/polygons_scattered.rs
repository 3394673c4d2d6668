//! Light that media scatter again and again to opaque polygons: closed forms of two streams, paths, and where none comes.

use super::common::{exact, input, lamp, scattering, sun};
use super::paths::{Block, trace};
use super::polygons::{polygons, wall, white};
use crate::common::{constant, cubic, grid, parallel, volume};
use sheet_light::half::{Drawn, HalfInput, HalfParams, Polygons, Scattering, fold};
use splat_core::shade::ChannelLayout;
use splat_core::{Accumulator, Camera, LayerSet, Material};
use std::f64::consts::PI;

/// Effects apart, `scatterN` among them, and the first channels of two.
const APART: ChannelLayout =
    ChannelLayout::new(&LayerSet { effects: true, shadow: false, normal: false, depth: false, object: false })
        .with_multiple();
const DIRECT: usize = 6;
const MORE: usize = 12;

/// A slab of 24 by 24 by 4 about the origin, lit along −z.
const DEPTH: f64 = 4.0;

fn params(voxels_per_cell: u32) -> HalfParams {
    let scattering = Scattering::ForwardAndBack;
    HalfParams { scattering, voxels_per_cell, most_light_pixels: 256, ..exact(None) }
}

/// Irradiance of a white wall in the slab: what comes unscattered, and what is scattered, at the middle of the picture.
fn received(tau: f64, medium: &Material, all: &[Polygons<'_>], camera: &Camera, params: &HalfParams) -> [f64; 2] {
    let slab = grid([48, 48, 8], cubic(0.5), |_| 1.0);
    let tf = constant((tau / DEPTH) as f32);
    let volumes = [volume(&slab, &tf, medium)];
    let lights = [sun([0.0, 0.0, 1.0])];
    let input = HalfInput { polygons: all, ..input(&volumes, camera, &lights) };
    let mut out = Accumulator::new(camera.size, 1, APART.count(), false, false);
    let Drawn { polygons, .. } = fold(&input, params, &APART, &mut out, None).unwrap();
    let middle = (camera.size[1] / 2 * camera.size[0] + camera.size[0] / 2) as usize;
    [DIRECT, MORE].map(|c| PI * f64::from(polygons.channels[c][middle]))
}

/// Two streams in Eddington's approximation in a white slab of isotropic scattering: what of light of 1 comes through scattered, and ψ at
/// a depth in it.
fn two_streams(tau: f64, depth: f64) -> [f64; 2] {
    // J' = e^−τ, ψ' = −3J/2, J = −ψ where light comes in and J = ψ on the other side.
    let first = (1.5 * tau + 0.5 * (-tau).exp_m1()) / (2.0 + 1.5 * tau);
    let through = 1.0 - first - (-tau).exp();
    [through, first - 1.5 * ((1.0 - first) * depth + (-depth).exp_m1())]
}

#[test]
fn a_floor_under_a_slab_and_a_wall_in_it_receive_what_two_streams_let_through() {
    let medium = scattering();
    let material = white();
    let camera = parallel([0.0, 0.0, 12.0], 2.0, [9, 9]);
    // Under it, and in it, where light ends and none comes from behind; the cells of the thick one have an optical depth of 0.6.
    for (tau, heights) in [(0.5, &[-2.0, -0.5, 0.7][..]), (2.0, &[-2.0, -0.5, 0.7]), (8.0, &[-2.0])] {
        for &z in heights {
            let mesh = wall([0.0, 0.0, z], [12.0, 0.0, 0.0], [0.0, 12.0, 0.0]);
            let before = tau * (2.0 - z) / DEPTH;
            let [direct, found] = received(tau, &medium, &[polygons(&mesh, &material)], &camera, &params(1));
            let [expected, _] = two_streams(before, 0.0);
            assert!((direct - (-before).exp()).abs() < 1e-3, "τ {before}: {direct}");
            assert!((found - expected).abs() < 0.03, "τ {before} of {tau}: {found}, expected {expected}");
            let paths = Block { width: f64::INFINITY, depth: before, albedo: 1.0, asymmetry: 0.0 };
            let [_, through, _] = trace(&paths, 40_000, 3);
            assert!((direct + found - through).abs() < 0.05, "τ {before}: {direct} and {found}, {through} by paths");
        }
    }
}

#[test]
fn cells_of_any_size_come_near_two_streams() {
    let medium = scattering();
    let material = white();
    let camera = parallel([0.0, 0.0, 12.0], 2.0, [9, 9]);
    let mesh = wall([0.0, 0.0, -2.0], [12.0, 0.0, 0.0], [0.0, 12.0, 0.0]);
    let error = |voxels_per_cell: u32| {
        let all = [polygons(&mesh, &material)];
        let [_, found] = received(4.0, &medium, &all, &camera, &params(voxels_per_cell));
        (found - two_streams(4.0, 0.0)[0]).abs()
    };
    let errors = [64, 8, 1].map(error);
    assert!(errors.iter().all(|error| *error < 0.004), "{errors:?}");
}

#[test]
fn a_wall_along_the_light_receives_a_quarter_of_the_fluence_on_either_side() {
    let medium = scattering();
    let material = white();
    let mesh = wall([0.0, 0.0, 0.0], [0.0, 12.0, 0.0], [0.0, 0.0, 2.0]);
    let shy = Polygons { casts_shadow: false, ..polygons(&mesh, &material) };
    let [_, psi] = two_streams(2.0, 1.0);
    for from in [[12.0, 0.0, 0.0], [-12.0, 0.0, 0.0]] {
        let camera = parallel(from, 2.0, [9, 9]);
        let [direct, found] = received(2.0, &medium, &[shy], &camera, &params(1));
        assert!(direct < 1e-6 && (found - 0.5 * psi).abs() < 0.02, "{direct} {found}, expected {}", 0.5 * psi);
    }
}

#[test]
fn ms10_the_back_of_a_wall_across_the_light_receives_nothing_and_a_thin_one_shows_what_comes_to_its_front() {
    let medium = scattering();
    let material = white();
    let mesh = wall([0.0, 0.0, 0.3], [12.0, 0.0, 0.0], [0.0, 12.0, 0.0]);
    let [before, behind] = [12.0, -12.0].map(|z| parallel([0.0, 0.0, z], 2.0, [9, 9]));
    let thick = polygons(&mesh, &material);
    assert_eq!(received(2.0, &medium, &[thick], &behind, &params(1)), [0.0; 2]);
    let paper = Material { transmission: 0.25, ..material };
    let shown = |material: &Material, camera: &Camera| {
        received(2.0, &medium, &[Polygons { material, ..thick }], camera, &params(1))
    };
    let all = shown(&material, &before)[1];
    for (camera, share) in [(&before, 0.75), (&behind, 0.25)] {
        let found = shown(&paper, camera)[1];
        assert!(all > 0.1 && (found - share * all).abs() < 1e-5, "{found}, {share} of {all}");
    }
}

#[test]
fn walls_far_from_a_thin_cube_receive_what_it_scatters_once() {
    let medium = scattering();
    let material = white();
    let sigma = 0.02;
    let side = 2.0f64;
    let distance = 10.0;
    let cube = grid([8, 8, 8], cubic(0.25), |_| 1.0);
    let tf = constant(sigma as f32);
    let volumes = [volume(&cube, &tf, &medium)];
    let lights = [sun([0.0, 0.0, 1.0])];
    let expected = sigma * side.powi(3) / (4.0 * PI * distance * distance);
    let floor = wall([0.0, 0.0, -distance], [4.0, 0.0, 0.0], [0.0, 4.0, 0.0]);
    let beside = wall([-distance, 0.0, 0.0], [0.0, 4.0, 0.0], [0.0, 0.0, 4.0]);
    for (mesh, from) in [(&floor, [0.0, 0.0, 12.0]), (&beside, [12.0, 0.0, 0.0])] {
        let camera = parallel(from, 2.0, [9, 9]);
        let all = [polygons(mesh, &material)];
        let input = HalfInput { polygons: &all, ..input(&volumes, &camera, &lights) };
        let mut out = Accumulator::new(camera.size, 1, APART.count(), false, false);
        let Drawn { polygons, .. } = fold(&input, &params(8), &APART, &mut out, None).unwrap();
        let found = PI * f64::from(polygons.channels[MORE][40]);
        assert!((found / expected - 1.0).abs() < 0.05, "from {from:?}: {found}, expected {expected}");
    }
}

#[test]
fn what_is_far_from_the_media_receives_less_and_black_media_scatter_none() {
    let medium = scattering();
    let material = white();
    let camera = parallel([0.0, 0.0, 12.0], 2.0, [9, 9]);
    let mesh = wall([0.0, 0.0, -9.0], [12.0, 0.0, 0.0], [0.0, 12.0, 0.0]);
    let all = [polygons(&mesh, &material)];
    let [direct, found] = received(1.0, &medium, &all, &camera, &params(8));
    let under = wall([0.0, 0.0, -2.0], [12.0, 0.0, 0.0], [0.0, 12.0, 0.0]);
    let [_, near] = received(1.0, &medium, &[polygons(&under, &material)], &camera, &params(8));
    assert!(found > 0.2 * near && found < 0.9 * near, "{found} of {near}");
    assert!((direct - (-1.0f64).exp()).abs() < 1e-3, "{direct}");
    let black = Material { single_scattering_albedo: 0.0, ..medium };
    assert_eq!(received(1.0, &black, &all, &camera, &params(8))[1], 0.0);
    // Nor is anything lit that gives light of its own alone.
    let unlit = Material { shading: splat_core::Shading::Unlit, ..material };
    let near = wall([0.0, 0.0, -1.0], [12.0, 0.0, 0.0], [0.0, 12.0, 0.0]);
    assert_eq!(received(1.0, &medium, &[polygons(&near, &unlit)], &camera, &params(8)), [0.0; 2]);
}

#[test]
fn a_lamp_far_away_is_a_sun_and_threads_are_not_known() {
    let medium = scattering();
    let material = white();
    let slab = grid([48, 48, 8], cubic(0.5), |_| 1.0);
    let tf = constant(0.5);
    let mesh = wall([0.0, 0.0, -1.0], [6.0, 0.0, 1.0], [0.0, 6.0, 0.5]);
    let volumes = [volume(&slab, &tf, &medium)];
    let all = [polygons(&mesh, &material)];
    let camera = parallel([0.0, 0.0, 12.0], 8.0, [24, 24]);
    let with = |light, intensity: f32, threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let mut lit: splat_core::shade::LitBy<'_> = light;
        lit.light.intensity = [intensity; 3];
        let lights = [lit];
        let input = HalfInput { polygons: &all, ..input(&volumes, &camera, &lights) };
        let mut out = Accumulator::new(camera.size, 1, APART.count(), false, false);
        pool.install(|| fold(&input, &params(8), &APART, &mut out, None).unwrap().polygons.channels[MORE].clone())
    };
    let sun = with(sun([0.0, 0.0, 1.0]), 1.0, 1);
    assert!(sun.iter().all(|v| *v > 0.02));
    assert_eq!(sun, with(self::sun([0.0, 0.0, 1.0]), 1.0, 3));
    let far = with(lamp([0.0, 0.0, 1e4]), 1e8, 2);
    assert!(sun.iter().zip(&far).all(|(a, b)| (a - b).abs() < 0.01 * a), "{sun:?} {far:?}");
}
