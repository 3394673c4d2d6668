//! Slow and obvious twins in f64, which tests compare the fast forms with.

use splat_core::glam::{DVec3, Vec3};
use splat_core::{Cloud, Footprint, Grid, SplatKind};

/// Optical depth of the layer at `p`: Σ K·norm/R²·profile over the surface splats whose plane the line through `p`
/// along `direction` crosses within the splat's radius of `p`. For opaque splats it is the area share, 1. `p` is
/// relative to the cloud's origin.
pub fn layer_depth(cloud: &Cloud, profile: Footprint, p: DVec3, direction: DVec3) -> f64 {
    let norm = profile.norm();
    let mut sum = 0.0;
    for i in 0..cloud.len() {
        let center = cloud.position[i].as_dvec3();
        let normal = cloud.normal_of(i).as_dvec3();
        let radius_sq = f64::from(cloud.radius[i]).powi(2);
        let cos = normal.dot(direction);
        if cloud.kind[i] == SplatKind::Medium || (center - p).length_squared() > 4.0 * radius_sq || cos.abs() < 0.1 {
            continue;
        }
        let along = normal.dot(center - p) / cos;
        let hit = p + direction * along;
        if along * along <= radius_sq {
            let s = (hit - center).length_squared() / radius_sq;
            sum += f64::from(cloud.cross_section[i]) * norm / radius_sq * profile.profile(s);
        }
    }
    sum
}

/// Optical depth of all medium splats along the whole line through `p` along the unit `direction`.
pub fn line_depth(cloud: &Cloud, profile: Footprint, p: DVec3, direction: DVec3) -> f64 {
    let norm = profile.norm();
    let mut sum = 0.0;
    for i in (0..cloud.len()).filter(|&i| cloud.kind[i] == SplatKind::Medium) {
        let offset = cloud.position[i].as_dvec3() - p;
        let across_sq = offset.length_squared() - offset.dot(direction).powi(2);
        let radius_sq = f64::from(cloud.radius[i]).powi(2);
        sum += f64::from(cloud.cross_section[i]) * norm / radius_sq * profile.profile(across_sq / radius_sq);
    }
    sum
}

/// Sobel gradient at lattice point (i, j, k), all 27 neighbours one by one.
pub fn sobel(grid: &Grid, i: usize, j: usize, k: usize) -> Vec3 {
    const SMOOTH: [f64; 3] = [0.25, 0.5, 0.25];
    let at = [i, j, k];
    let mut index = DVec3::ZERO;
    for n in 0..27usize {
        let d = [n % 3, n / 3 % 3, n / 9];
        let c = |a: usize| at[a] as isize + d[a] as isize - 1;
        let value = f64::from(grid.at_clamped(c(0), c(1), c(2)));
        for a in 0..3 {
            let span = if at[a] == 0 || at[a] + 1 == grid.dims[a] { 1.0 } else { 0.5 };
            index[a] += value * (d[a] as f64 - 1.0) * span * SMOOTH[d[(a + 1) % 3]] * SMOOTH[d[(a + 2) % 3]];
        }
    }
    (grid.axes.inverse().transpose() * index).as_vec3()
}
