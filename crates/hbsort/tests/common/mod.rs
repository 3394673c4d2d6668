//! Scenes that several tests sort.

use hbsort::SliceOrder;
use splat_core::glam::{DVec3, Vec3};
use splat_core::{Camera, Cloud, Projection, Splat, rng};

/// Ground and clusters in front of [`camera`], some of it outside its view and behind it; in canonical order.
pub(crate) fn outdoor(n: usize, origin: DVec3) -> Cloud {
    let mut cloud = Cloud::new(origin);
    for i in 0..n as u64 {
        let u = |k| rng::unit_f32(11, 0, i, k);
        let position = if i % 3 == 0 {
            Vec3::new(u(0) * 40.0 - 20.0, 0.0, u(1) * 60.0 - 50.0)
        } else {
            let c = |k| rng::unit_f32(12, 1, i % 23, k);
            let center = Vec3::new(c(0) * 30.0 - 15.0, 2.0, c(1) * -35.0);
            center + c(2) * Vec3::new(u(2) + u(3) - 1.0, u(4) + u(5) - 1.0, u(6) + u(7) - 1.0)
        };
        cloud.push(&Splat { position, radius: 0.002 + 0.01 * u(8), ..Splat::default() });
    }
    cloud.canonicalize();
    cloud
}

/// The camera for [`outdoor`].
pub(crate) fn camera(origin: DVec3) -> Camera {
    let view = Projection::Perspective { fov_y: 1.0 };
    let eye = origin + DVec3::new(0.0, 4.0, 8.0);
    Camera::look_at(eye, origin + DVec3::new(0.0, 0.0, -15.0), DVec3::Y, view, [600, 500]).unwrap()
}

/// Depths of clusters and a uniform share between `near` and `far`, the ends included.
pub(crate) fn depths(n: usize, near: f32, far: f32) -> Vec<f32> {
    let mut depth: Vec<f32> = (0..n as u64)
        .map(|i| {
            let u = rng::unit_f32(13, 2, i, 0);
            let t = if i % 4 == 0 { u } else { (0.1 * u + rng::unit_f32(13, 3, i % 7, 1)).min(1.0) };
            near + (far - near) * t
        })
        .collect();
    if n > 1 {
        depth[n / 3] = near;
        depth[n / 2] = far;
    }
    depth
}

/// The order as slices.
pub(crate) fn slices_of(order: &SliceOrder) -> Vec<Vec<u32>> {
    (0..order.non_empty_slices()).map(|k| order.slice(k).to_vec()).collect()
}
