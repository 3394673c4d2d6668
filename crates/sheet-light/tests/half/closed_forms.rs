//! Constant media: optical depth and self shadow in closed form, whatever the slabs.

use super::common::{draw, exact, input, lamp, ray, scattering, single_scattering, sun};
use crate::common::{constant, cubic, grid, parallel, perspective, volume};
use sheet_light::half::HalfParams;
use splat_core::shade::LitBy;
use splat_core::{Camera, Grid};
use std::f64::consts::PI;

/// Greatest differences from the closed forms over every `step`-th pixel: transmittance, and scattered light as a share of what
/// scatters where nothing attenuates.
fn differences(
    grid: &Grid,
    sigma: f64,
    lit: &LitBy<'_>,
    camera: &Camera,
    params: &HalfParams,
    step: usize,
) -> [f64; 2] {
    let (tf, material) = (constant(sigma as f32), scattering());
    let (volumes, lights) = ([volume(grid, &tf, &material)], [*lit]);
    let (out, _) = draw(&input(&volumes, camera, &lights), params).unwrap();
    let (width, mut worst, mut seen) = (camera.size[0] as usize, [0.0f64; 2], 0);
    let mut at_worst = 0;
    for at in (0..out.optical_depth[0].len()).step_by(step) {
        let [light, tau] = single_scattering(grid, sigma, &lit.light, ray(camera, at % width, at / width));
        let found = f64::from(out.optical_depth[0][at]);
        worst[0] = worst[0].max(((-found).exp() - (-tau).exp()).abs());
        let d = (f64::from(out.channels[0][at]) * 4.0 * PI - light).abs();
        if d > worst[1] {
            at_worst = at;
            worst[1] = d;
        }
        seen += usize::from(tau > 0.0);
    }
    assert!(seen > 20, "the volume is out of the picture");
    eprintln!("worst {worst:?} at {} {}", at_worst % width, at_worst / width);
    worst
}

#[test]
fn hv05_first() {
    let grid = grid([12, 12, 12], cubic(0.5), |_| 3.0);
    for camera in [parallel([3.0, 4.0, 12.0], 12.0, [40, 40]), perspective([3.0, 4.0, 12.0], 50.0, [40, 40])] {
        for light in [
            sun([1.0, 3.0, 2.0]),
            sun([-1.0, 2.0, -3.0]),
            sun([3.0, 4.0, 12.0]),
            lamp([12.0, 8.0, 3.0]),
            lamp([-3.0, -4.0, -12.0]),
        ] {
            for slab_width in [0.06, 0.5, 1.3, 40.0] {
                for sigma in [0.01, 0.3, 1.0] {
                    eprintln!("{:?} {slab_width} {sigma} {:?}", camera.projection, light.light.shape);
                    differences(&grid, sigma, &light, &camera, &exact(Some(slab_width)), 1);
                }
            }
        }
    }
}
