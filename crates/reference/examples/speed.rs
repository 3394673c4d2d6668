//! How fast the truth is: paths a second in a cloud of 64³ voxels and the time to 1 % standard error; the exact
//! compositor on 1.84 million points. `cargo run --release -p organza-reference --example speed [paths|error|error5|points]…`
//! (`error5` stops at 5 %, in a 25th of the time)

use reference::{Density, Input, Lattice, LightSource, Medium, Order, PathSettings, Scene, composite, path_trace};
use splat_core::glam::{DMat3, DVec3, Vec3};
use splat_core::{Camera, Cloud, FootprintStack, Grid, Material, Projection, Splat, rng};
use std::time::Instant;

const N: usize = 64;

/// Seconds of all cores that this process has used, by 1/100 s, where the system tells; else of the wall clock.
fn seconds() -> f64 {
    static START: std::sync::OnceLock<Instant> = std::sync::OnceLock::new();
    let wall = START.get_or_init(Instant::now).elapsed().as_secs_f64() * rayon::current_num_threads() as f64;
    let stat = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    let after_name = stat.rsplit_once(')').map_or("", |(_, rest)| rest);
    let ticks: Vec<f64> = after_name.split_whitespace().skip(11).take(2).filter_map(|t| t.parse().ok()).collect();
    if let [user, system] = ticks[..] { (user + system) / 100.0 } else { wall }
}

/// Overlapping soft balls in the unit cube around the origin.
fn cloud() -> Grid {
    let h = 1.0 / N as f64;
    let balls: Vec<(DVec3, f64)> = (0..24)
        .map(|i| {
            let u = |k| rng::unit(1, 0, i, k) - 0.5;
            (DVec3::new(u(0), u(1), u(2)) * 0.6, 0.1 + 0.2 * (u(3) + 0.5))
        })
        .collect();
    let value = |i: usize| {
        let at = |k: usize| (k as f64 + 0.5) * h - 0.5;
        let p = DVec3::new(at(i % N), at(i / N % N), at(i / (N * N)));
        balls.iter().map(|(c, r)| (1.0 - p.distance_squared(*c) / (r * r)).max(0.0)).fold(0.0, f64::max) as f32
    };
    Grid {
        origin: DVec3::splat(0.5 * h - 0.5),
        axes: DMat3::from_diagonal(DVec3::splat(h)),
        dims: [N; 3],
        values: (0..N * N * N).map(value).collect(),
    }
}

fn scene<'a>(grid: &'a Grid, extinction: f64) -> Result<Scene<'a>, splat_core::Error> {
    let medium = Medium::new(Density::Grid(Lattice::new(grid)?), extinction, 0.99);
    let light = LightSource::Directional { direction: DVec3::new(0.48, -0.8, -0.36), irradiance: [3.0; 3] };
    Ok(Scene { media: vec![medium], lights: vec![light], ..Scene::default() })
}

fn camera(size: [u32; 2]) -> Result<Camera, splat_core::Error> {
    let projection = Projection::Perspective { fov_y: 0.5 };
    Camera::look_at(DVec3::new(0.0, 0.3, 2.2), DVec3::ZERO, DVec3::Y, projection, size)
}

fn paths(grid: &Grid) -> Result<(), splat_core::Error> {
    println!("64^3 cloud, albedo 0.99, isotropic, one sun, no limit of bounces, 256x256, 16 samples a pixel");
    for extinction in [10.0, 30.0, 100.0] {
        let scene = scene(grid, extinction)?;
        let settings = PathSettings { samples: 16, batch: 16, ..PathSettings::default() };
        let run = || -> Result<(f64, u64), splat_core::Error> {
            let start = seconds();
            let image = path_trace(&scene, &camera([256; 2])?, &settings, None)?;
            Ok((seconds() - start, image.bounces))
        };
        let runs: Result<Vec<_>, _> = (0..5).map(|_| run()).collect();
        let runs = runs?;
        let fastest = runs.iter().fold(f64::INFINITY, |m, r| m.min(r.0));
        let n = 256.0 * 256.0 * 16.0;
        println!(
            "  extinction {extinction:>4}: {:.2} Mpaths/s, {:.2} bounces a path, {:.1} Mbounces/s (two cores' time, best of 5)",
            2.0 * n / fastest / 1e6,
            runs[0].1 as f64 / n,
            2.0 * runs[0].1 as f64 / fastest / 1e6
        );
    }
    Ok(())
}

fn error(grid: &Grid, target: f64) -> Result<(), splat_core::Error> {
    let scene = scene(grid, 30.0)?;
    let settings =
        PathSettings { samples: 20_000, batch: 64, target_relative_error: Some(target), ..PathSettings::default() };
    let start = seconds();
    let image = path_trace(&scene, &camera([256; 2])?, &settings, None)?;
    let seconds = seconds() - start;
    let error = 100.0 * image.relative_error();
    println!(
        "extinction 30, 256x256: {error:.2} % standard error after {} samples a pixel, {seconds:.1} core seconds",
        image.samples
    );
    Ok(())
}

fn points() -> Result<(), splat_core::Error> {
    let n = 1_841_320;
    let mut cloud = Cloud::new(DVec3::ZERO);
    cloud.reserve(n);
    // As many points as the largest scene of Gunjee 2007, footprints of about 3 pixels across.
    for i in 0..n as u64 {
        let u = |k| rng::unit_f32(2, 0, i, k) - 0.5;
        let radius = 0.004;
        let cross_section = 0.1 * radius * radius;
        let position = Vec3::new(u(0), u(1), u(2));
        cloud.push(&Splat { position, radius, cross_section, ..Splat::default() });
    }
    let values: Vec<f32> = cloud.color.iter().flatten().copied().collect();
    let camera = camera([600, 500])?;
    let start = seconds();
    let image = composite(
        &Input {
            cloud: &cloud,
            camera: &camera,
            footprints: &FootprintStack::default(),
            materials: &[Material::default()],
            values: &values,
            channels: 3,
            resampling_sigma_px: 0.3,
            order: Order::Fragment,
        },
        None,
    )?;
    let seconds = seconds() - start;
    let mean = image.transmittance.iter().map(|t| t[0]).sum::<f64>() / image.transmittance.len() as f64;
    println!("exact compositor: {n} points, 600x500: {seconds:.1} core seconds (mean transmittance {mean:.4})");
    Ok(())
}

fn main() -> Result<(), splat_core::Error> {
    let asked: Vec<String> = std::env::args().skip(1).collect();
    let wants = |what: &str| asked.is_empty() || asked.iter().any(|a| a == what);
    let grid = cloud();
    if wants("paths") {
        paths(&grid)?;
    }
    if wants("error") {
        error(&grid, 0.01)?;
    }
    if asked.iter().any(|a| a == "error5") {
        error(&grid, 0.05)?;
    }
    if wants("points") {
        points()?;
    }
    Ok(())
}
