//! Light that is scattered more than once: its energy, closed forms, paths, and the hard cases MS1 to MS10.

use super::common::{exact, input, lamp, scattering, sun};
use super::paths::{Block, trace};
use crate::common::{constant, cubic, grid, noise, parallel, transfer, volume};
use sheet_light::half::{Balance, HalfParams, Scattering, balance};
use splat_core::glam::DVec3;
use splat_core::shade::LitBy;
use splat_core::{Grid, Material};

const BOTH: Scattering = Scattering::ForwardAndBack;

fn params(scattering: Scattering) -> HalfParams {
    HalfParams { scattering, ..exact(None) }
}

/// A medium of this albedo and asymmetry.
fn medium(albedo: f32, asymmetry: f32) -> Material {
    Material { single_scattering_albedo: albedo, asymmetry, ..scattering() }
}

/// The balance of one light over one volume of one extinction.
fn block(grid: &Grid, sigma: f32, material: &Material, lit: &LitBy<'static>, params: &HalfParams) -> Balance {
    let tf = constant(sigma);
    let (volumes, lights) = ([volume(grid, &tf, material)], [*lit]);
    let camera = parallel([0.0, 0.0, 10.0], 2.0, [8, 8]);
    balance(&input(&volumes, &camera, &lights), params, 0).unwrap()
}

#[test]
fn slabs_reflect_and_let_through_what_paths_do() {
    // 64 times as wide as deep.
    let slab = grid([256, 256, 4], cubic(0.5), |_| 1.0);
    for (n, tau) in [1.0, 5.0, 20.0].into_iter().enumerate() {
        for (m, albedo) in [0.5, 0.9, 0.99].into_iter().enumerate() {
            for asymmetry in [0.0, 0.85] {
                let paths = Block { width: f64::INFINITY, depth: tau, albedo, asymmetry };
                let expected = trace(&paths, 40_000, (10 * n + m) as u64);
                let material = medium(albedo as f32, asymmetry as f32);
                let found = block(&slab, tau as f32 / 2.0, &material, &sun([0.0, 0.0, 1.0]), &params(BOTH));
                let [back, through] = [found.reflected, found.transmitted].map(|v| v[0] / found.incident[0]);
                let what = format!("τ {tau}, ω {albedo}, g {asymmetry}: {back} {through}, not {expected:?}");
                println!("{what}");
                assert!((back - expected[0]).abs() < 0.05 && (through - expected[1]).abs() < 0.05, "{what}");
            }
        }
    }
}

#[test]
fn cubes_lose_by_the_sides_what_paths_do() {
    let cube = grid([32, 32, 32], cubic(0.25), |_| 1.0);
    for (n, tau) in [1.0, 5.0, 20.0].into_iter().enumerate() {
        for (albedo, asymmetry) in [(1.0, 0.0), (0.9, 0.0), (1.0, 0.85), (0.9, 0.85)] {
            let expected = trace(&Block { width: tau, depth: tau, albedo, asymmetry }, 40_000, n as u64);
            let material = medium(albedo as f32, asymmetry as f32);
            let found = block(&cube, tau as f32 / 8.0, &material, &sun([0.0, 0.0, 1.0]), &params(BOTH));
            let shares = [found.reflected, found.transmitted, found.sides].map(|v| v[0] / found.incident[0]);
            let what = format!("τ {tau}, ω {albedo}, g {asymmetry}: {shares:?}, not {expected:?}");
            println!("{what}");
        }
    }
}

#[test]
fn ms01_no_light_is_lost_or_made() {
    let tf = transfer(&[(0.2, 0.0), (0.5, 4.0), (0.9, 40.0)]);
    let white = constant(0.7);
    let grids = [grid([13, 12, 11], cubic(0.5), noise), grid([12, 12, 12], cubic(0.4), |_| 1.0)];
    let camera = parallel([0.0, 0.0, 10.0], 2.0, [8, 8]);
    for asymmetry in [-0.6, 0.0, 0.85] {
        let material = medium(1.0, asymmetry);
        let volumes = [volume(&grids[0], &tf, &material), volume(&grids[1], &white, &material)];
        let lights = [sun([1.0, 2.0, 3.0]), sun([0.0, 0.0, 1.0]), lamp([2.0, 5.0, 9.0])];
        for (light, scattering) in (0..3).flat_map(|n| [Scattering::Forward, BOTH].map(|s| (n, s))) {
            let input = input(&volumes[..], &camera, &lights);
            let found = balance(&input, &params(scattering), light).unwrap();
            let what = format!("{:?}, {scattering:?}, g {asymmetry}: {found:?}", lights[light].light.shape);
            assert!(found.incident[0] > 0.0 && found.missing().iter().all(|m| m.abs() < 1e-5), "{what}");
            // White alone absorbs nothing.
            let volumes = &volumes[1..];
            let found = balance(&self::input(volumes, &camera, &lights), &params(scattering), light).unwrap();
            assert!((0..3).all(|c| found.absorbed[c].abs() < 1e-5 * found.incident[c]), "{found:?}");
            assert!(found.missing().iter().all(|m| m.abs() < 1e-5), "{found:?}");
        }
    }
    let _ = DVec3::ZERO;
}
