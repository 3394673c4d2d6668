//! Slices a random cloud and prints what came out: `cargo run --release -p organza-hbsort --example slices [SPLATS]`.

use hbsort::{Params, Scratch, slice_cloud};
use splat_core::glam::{DVec3, Vec3};
use splat_core::{Camera, Cloud, Projection, Splat, rng};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let n = std::env::args().nth(1).map_or(Ok(1_000_000), |n| n.parse::<u64>())?;
    let mut cloud = Cloud::new(DVec3::ZERO);
    for i in 0..n {
        let [x, y, z] = [0, 1, 2].map(|k| 2.0 * rng::unit_f32(1, 0, i, k) - 1.0);
        let radius = 0.002 + 0.002 * rng::unit_f32(1, 0, i, 3);
        cloud.push(&Splat { position: Vec3::new(x, y, z), radius, ..Splat::default() });
    }
    let view = Projection::Perspective { fov_y: 0.6 };
    let camera = Camera::look_at(DVec3::new(0.0, 1.0, 4.0), DVec3::ZERO, DVec3::Y, view, [600, 500])?;

    let mut scratch = Scratch::new();
    for exact in [false, true] {
        let start = std::time::Instant::now();
        let order = slice_cloud(&cloud, None, &camera, &Params { exact, ..Params::default() }, &mut scratch)?;
        println!(
            "{} of {n} splats in {} of {} slices of {:.4} ({:?}), depth {:.3} to {:.3}, {:.1} ms, {:.1} bytes a splat",
            order.input_from_sorted.len(),
            order.non_empty_slices(),
            order.slices,
            order.thickness,
            scratch.info().rule,
            order.near,
            order.far,
            1e3 * start.elapsed().as_secs_f64(),
            scratch.bytes() as f64 / n as f64,
        );
        scratch.recycle(order);
    }
    Ok(())
}
