//! Implicit surfaces of a volume and of scattered points: what they cost.
//!
//! `cargo run --release -p organza-convert --example implicit`. Times are the least of several runs on one
//! thread.

use convert::points_to_field;
use field::{GridField, Inside, MpuParams, isosurface_to_mesh};
use read::{Loaded, ReadParams};
use splat_core::glam::{DMat3, DVec3};
use splat_core::{DAabb, Grid, Interpolation, Mesh, RawPoints, ScalarField, rng};
use std::hint::black_box;
use std::path::Path;
use std::time::Instant;

/// Least seconds of five runs.
fn least(mut run: impl FnMut()) -> f64 {
    let once = |()| {
        let start = Instant::now();
        run();
        start.elapsed().as_secs_f64()
    };
    [(); 5].map(once).into_iter().fold(f64::INFINITY, f64::min)
}

fn gyroid(n: usize) -> Grid {
    let wave = |u: DVec3| u.x.sin() * u.y.cos() + u.y.sin() * u.z.cos() + u.z.sin() * u.x.cos();
    let at = |i: usize| DVec3::from_array([i % n, i / n % n, i / n / n].map(|c| c as f64)) * (12.0 / n as f64);
    let values = (0..n * n * n).map(|i| wave(at(i)) as f32).collect();
    Grid { origin: DVec3::ZERO, axes: DMat3::IDENTITY, dims: [n; 3], values }
}

fn ball(n: usize) -> Grid {
    let grid = gyroid(n);
    let at = |i: usize| DVec3::from_array([i % n, i / n % n, i / n / n].map(|c| c as f64)) / n as f64 - 0.5;
    Grid { values: (0..n * n * n).map(|i| at(i).length() as f32).collect(), ..grid }
}

/// Places in a box, or near given ones.
fn places(bounds: DAabb, count: u64) -> Vec<DVec3> {
    let unit = |i| DVec3::from_array([0, 1, 2].map(|a| rng::unit(1, 0, i, a)));
    (0..count).map(|i| bounds.min + bounds.size() * unit(i)).collect()
}

fn rates(name: &str, field: &dyn ScalarField, places: &[DVec3], radii: &[f64]) {
    let rate = |f: &dyn Fn(DVec3) -> f64| {
        let seconds = least(|| {
            black_box(places.iter().map(|p| f(*p)).sum::<f64>());
        });
        1e-6 * places.len() as f64 / seconds
    };
    println!("{name}: million a second:");
    println!("  values {:.2}", rate(&|p| field.value(p)));
    println!("  values with gradient {:.2}", rate(&|p| field.value_gradient(p).1.x));
    println!("  hessians {:.2}", rate(&|p| field.hessian(p).x_axis.x));
    for r in radii {
        println!("  bounds of radius {r:.4} {:.2}", rate(&|p| field.bound(p, *r).map_or(0.0, |b| b.0)));
    }
}

fn bunny() -> Result<Mesh, Box<dyn std::error::Error>> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets/stanford-bunny/bunny.ply.gz");
    match read::file(&path, &ReadParams::default(), None)?.0 {
        Loaded::Mesh(mesh) => Ok(mesh),
        _ => Err("the bunny is a mesh".into()),
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    rayon::ThreadPoolBuilder::new().num_threads(1).use_current_thread().build_global()?;
    let grid = std::sync::Arc::new(gyroid(256));
    for interpolation in [Interpolation::Trilinear, Interpolation::CatmullRom] {
        let start = Instant::now();
        let field = GridField::new(grid.clone(), interpolation, 0.1, Inside::Below)?;
        println!("{interpolation:?} built in {:.0} ms", 1e3 * start.elapsed().as_secs_f64());
        rates(&format!("{interpolation:?}, 256³"), &field, &places(field.bounds(), 200_000), &[0.01, 0.5, 4.0, 40.0]);
    }
    for (name, grid, isovalue) in [("gyroid", &*grid, 0.1), ("ball", &ball(256), 0.4)] {
        let mut triangles = 0;
        let surface = least(|| {
            triangles = isosurface_to_mesh(grid, isovalue, Inside::Below).map_or(0, |m| m.triangles.len());
        });
        let none = least(|| {
            black_box(isosurface_to_mesh(grid, 100.0, Inside::Below).is_ok());
        });
        println!(
            "marching cubes, {name} 256³: {:.1} ms, {triangles} triangles; no surface {:.1} ms",
            1e3 * surface,
            1e3 * none
        );
    }
    let mesh = bunny()?;
    let normal = splat_core::vertex_normals(&mesh);
    let points = RawPoints { origin: mesh.origin, position: mesh.position, normal, ..RawPoints::default() };
    for tolerance in [1e-3, 3e-4, 1e-4] {
        let params = MpuParams { tolerance, ..MpuParams::default() };
        let start = Instant::now();
        let (field, report) = points_to_field(&points, &params, None)?;
        println!("bunny within {tolerance}: {:.0} ms, {report:?}", 1e3 * start.elapsed().as_secs_f64());
        let mut distance: Vec<f64> = Vec::new();
        for i in 0..points.len() {
            let (v, g) = field.value_gradient(points.exact_position(i));
            distance.push(v.abs() / g.length() / report.tolerance);
        }
        distance.sort_by(f64::total_cmp);
        let at = |part: f64| distance[(part * (distance.len() - 1) as f64) as usize];
        println!("  distance of vertices over ε₀: median {:.3}, 99 % {:.3}, all {:.3}", at(0.5), at(0.99), at(1.0));
        let near: Vec<DVec3> = (0..points.len()).map(|i| points.exact_position(i)).collect();
        let side = field.bounds().size().x;
        rates("near the bunny", &field, &near, &[1e-6 * side, 1e-3 * side, 1e-2 * side, 0.1 * side]);
        rates("anywhere in the cube", &field, &places(field.bounds(), 50_000), &[1e-3 * side]);
    }
    Ok(())
}
