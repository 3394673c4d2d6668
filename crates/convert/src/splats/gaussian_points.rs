//! Gaussians of a file become splats of a cloud.
//!
//! The eye sees such a splat as a Gaussian. Shadows, and other code that takes splats for media, see a ball. Its variance σ² gives the ball
//! the Gaussian's mean shadow area over all directions: by Cauchy a quarter of the surface, which Thomsen's formula gives within 1.1 %,
//! σ² = (((ab)^p + (ac)^p + (bc)^p)/3)^(1/p) with p = 1.6075. The ball has the optical depth of the Gaussian through its middle,
//! τ = −ln(1 − o), and all over: opacity has the shape of a Gaussian, so K = ∫−ln(1 − o·G) dA = 2πσ²·Li₂(o).

use crate::common::columns::{self, CHUNK, ColumnSet};
use crate::{ConvertError, SurfelParams};
use rayon::prelude::*;
use splat_core::{Cloud, Footprint, Gaussians, RawPoints, SplatKind, glam::Vec3, optics};
use std::f64::consts::PI;
use std::sync::Arc;

/// p of Thomsen's formula.
const POWER: f64 = 1.6075;
/// Least radius of a ball over the longest axis of its Gaussian, which may be a line.
const THINNEST: f64 = 1e-3;

/// Which columns they fill.
pub(crate) fn column_set(points: &RawPoints, params: &SurfelParams) -> ColumnSet {
    let degree = if params.colors { points.gaussians.degree } else { 0 };
    ColumnSet { tangent: true, gaussian: Some(degree), ..ColumnSet::default() }
}

/// The cloud of points that were checked.
pub(crate) fn to_cloud(points: &RawPoints, params: &SurfelParams) -> Result<Cloud, ConvertError> {
    let splat = &params.splat;
    let t = &splat.transform;
    let mut cloud = Cloud::new(t.apply(points.origin));
    columns::size_columns(&mut cloud, points.len(), SplatKind::Medium, column_set(points, params), splat)?;
    let gaussians = seen(points, params);
    let columns = (
        (&mut cloud.position, &mut cloud.radius, &mut cloud.cross_section),
        (&mut cloud.color, &mut cloud.tangent, &mut cloud.gaussian),
    );
    columns.into_par_iter().enumerate().with_min_len(CHUNK).for_each(
        |(i, ((position, radius, cross_section), (color, tangent, gaussian)))| {
            *position = (t.rotation * (points.position[i].as_dvec3() * t.scale)).as_vec3();
            let axes = &gaussians.axes[i];
            let opacity = gaussians.opacity[i];
            let [r, k] = ball(axes, opacity.min(Gaussians::MOST_OPACITY), &splat.profile);
            (*radius, *cross_section) = ((r as f32).max(f32::MIN_POSITIVE), k as f32);
            *color = gaussians.mean_color(i);
            *tangent = longest(axes) * reach(opacity);
            *gaussian = i as u32;
        },
    );
    cloud.gaussians = Arc::new(gaussians);
    Ok(cloud)
}

/// The Gaussians in the world, as transparent and coloured as the object is.
fn seen(points: &RawPoints, params: &SurfelParams) -> Gaussians {
    let mut gaussians = points.gaussians.transformed(&params.splat.transform);
    gaussians.opacity.iter_mut().for_each(|o| *o = (f64::from(*o) * params.opacity) as f32);
    if !params.colors {
        gaussians.recolor(&vec![params.splat.color; points.len()]);
    }
    gaussians
}

fn longest(axes: &[Vec3; 3]) -> Vec3 {
    axes.iter().copied().fold(Vec3::ZERO, |longest, a| if a.length() > longest.length() { a } else { longest })
}

/// Standard deviations within which a Gaussian is seen, also where perspective stretches it beside the image.
fn reach(opacity: f32) -> f32 {
    Gaussians::MOST_SLANT * (2.0 * Gaussians::level(opacity).max(0.0)).sqrt()
}

/// Radius and cross-section of the ball that stands for it.
fn ball(axes: &[Vec3; 3], opacity: f32, profile: &Footprint) -> [f64; 2] {
    let opacity = f64::from(opacity);
    let spread = 2.0 * PI * ball_deviation(axes).powi(2);
    let depth = optics::optical_depth(opacity);
    let cross_section = spread * dilogarithm(opacity);
    let share = if depth > 0.0 { cross_section / depth } else { spread };
    [(share * profile.norm() * profile.profile(0.0)).sqrt(), cross_section]
}

/// Li₂(x) = Σ x^k/k² for x from 0 to below 1; beyond ½ by Euler's reflection, so that the sum is short.
fn dilogarithm(x: f64) -> f64 {
    if x > 0.5 {
        return PI * PI / 6.0 - libm::log(x) * libm::log1p(-x) - dilogarithm(1.0 - x);
    }
    let mut power = 1.0;
    let term = |k: i32| {
        power *= x;
        power / f64::from(k * k)
    };
    (1..50).map(term).sum()
}

/// Standard deviation of the ball that stands for it.
fn ball_deviation(axes: &[Vec3; 3]) -> f64 {
    let [a, b, c] = axes.map(|axis| axis.as_dvec3().length());
    let scale = a.max(b).max(c);
    if scale == 0.0 {
        return 0.0;
    }
    let area = |u: f64, v: f64| libm::pow(u / scale * (v / scale), POWER);
    let mean = libm::pow((area(a, b) + area(a, c) + area(b, c)) / 3.0, 0.5 / POWER);
    scale * mean.max(THINNEST)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ball_stands_for_itself_and_a_disc_for_half_its_area() {
        let axes = |a: f32, b: f32, c: f32| [Vec3::X * a, Vec3::Y * b, Vec3::Z * c];
        assert!((ball_deviation(&axes(2.0, 2.0, 2.0)) - 2.0).abs() < 1e-12);
        // Seen from all directions a disc has half of its area on average.
        let disc = ball_deviation(&axes(3.0, 3.0, 0.0));
        assert!((disc * disc / 9.0 - 0.5).abs() < 0.011, "{}", disc * disc / 9.0);
        assert_eq!(ball_deviation(&axes(1.0, 0.0, 0.0)), THINNEST);
        assert_eq!(ball_deviation(&axes(0.0, 0.0, 0.0)), 0.0);
    }
    #[test]
    fn a_ball_has_the_optical_depth_of_its_gaussian_in_the_middle_and_all_over() {
        let axes = [Vec3::X, Vec3::Y, Vec3::Z];
        for (cutoff, opacity) in [(3.0, 0.05), (3.0, 0.6), (2.0, 0.99), (5.0, 0.9)] {
            let profile = Footprint { cutoff };
            let [r, k] = ball(&axes, opacity, &profile);
            let middle = k * profile.norm() / (r * r) * profile.profile(0.0);
            assert!((-(-middle).exp_m1() - f64::from(opacity)).abs() < 1e-6, "{cutoff} {opacity}: {middle}");
            // ∫−ln(1 − o·e^(−t)) 2π dt, t = ½ρ².
            let n = 200_000;
            let depth = |i: i32| -(-f64::from(opacity) * (-20.0 * (f64::from(i) + 0.5) / f64::from(n)).exp()).ln_1p();
            let integral = 2.0 * PI * (0..n).map(depth).sum::<f64>() * 20.0 / f64::from(n);
            assert!((k / integral - 1.0).abs() < 1e-5, "{cutoff} {opacity}: {k} {integral}");
        }
        assert_eq!(ball(&axes, 0.0, &Footprint::default())[1], 0.0);
    }
}
