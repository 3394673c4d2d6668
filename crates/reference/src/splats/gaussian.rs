//! A Gaussian's image in f64 (Kerbl et al. 2023): Σ' = JΣJᵀ + filter, α = min(0.99, o·e^(−½·dᵀΣ'⁻¹d)), nothing below 1/255, and
//! τ = −ln(1 − α).
//!
//! Place in the image and view depth have one normal distribution, of which a ray sees the conditional one.

use crate::Input;
use glam::{DMat2, DVec2, DVec3};

/// The image model's numbers: the largest opacity, the least that is seen, and how far beyond the image perspective bends axes.
const MOST: f64 = 0.99;
const LEAST: f64 = 1.0 / 255.0;
const MOST_SLANT: f64 = 1.3;
/// Variance of the filter over that of other splats.
const FILTER: f64 = 0.3 / 0.25;
/// Least deviation of depth on a ray over that of all.
const FLATTEST: f64 = 1.0 / 1024.0;

/// One Gaussian in the image.
pub(crate) struct Gaussian {
    opacity: f64,
    /// Σ'⁻¹.
    inverse: DMat2,
    /// Change of the mean depth per pixel.
    pub(crate) depth_slope: DVec2,
    /// Deviation of depth on a ray.
    pub(crate) deviation: f64,
    /// Half the pixel extent to look at.
    pub(crate) reach_px: DVec2,
}

impl Gaussian {
    /// Gaussian `g` of the table with its centre in view space; `None` for one that is not seen.
    pub(crate) fn new(input: &Input<'_>, g: usize, center: DVec3) -> Option<Self> {
        let table = &input.cloud.gaussians;
        let camera = input.camera;
        let opacity = f64::from(table.opacity[g]);
        let to_view = |v: DVec3| DVec3::from_array(camera.axes.map(|axis| axis.dot(v)));
        let axes = table.axes[g].map(|axis| to_view(axis.as_dvec3()));
        let variance_z: f64 = axes.iter().map(|a| a.z * a.z).sum();
        let parallel = camera.is_orthographic();
        let nearest = if parallel { 0.0 } else { variance_z.sqrt() };
        if center.z <= nearest || opacity <= LEAST {
            return None;
        }
        let focal = camera.focal_px();
        let scale = if parallel { focal } else { focal / center.z };
        let half = DVec2::new(f64::from(camera.size[0]), f64::from(camera.size[1])) * 0.5;
        let most = half / focal * MOST_SLANT;
        let slant = if parallel { DVec2::ZERO } else { (center.truncate() / center.z).clamp(-most, most) };
        let m = axes.map(|a| DVec2::new(a.x - slant.x * a.z, slant.y * a.z - a.y) * scale);
        let outer = |a: DVec2, b: DVec2| DMat2::from_cols(a * b.x, a * b.y);
        let filter = FILTER * f64::from(input.resampling_sigma_px).powi(2);
        let covariance =
            m.iter().fold(DMat2::from_diagonal(DVec2::splat(filter)), |sum, axis| sum + outer(*axis, *axis));
        if covariance.determinant() <= 0.0 {
            return None;
        }
        let inverse = covariance.inverse();
        let with_depth: DVec2 = m.iter().zip(&axes).map(|(m, a)| *m * a.z).sum();
        let depth_slope = inverse * with_depth;
        let left = (variance_z - depth_slope.dot(with_depth)).max(0.0);
        let reach = 2.0 * (opacity / LEAST).ln();
        let reach_px = DVec2::new(covariance.x_axis.x, covariance.y_axis.y).map(|v| (reach * v).sqrt() + 1.0);
        let deviation = left.sqrt().max(FLATTEST * variance_z.sqrt());
        Some(Self { opacity, inverse, depth_slope, deviation, reach_px })
    }

    /// Optical depth at an offset from the centre's image, pixels; `None` where nothing is seen.
    pub(crate) fn optical_depth(&self, d: DVec2) -> Option<f64> {
        let alpha = (self.opacity * (-0.5 * d.dot(self.inverse * d)).exp()).min(MOST);
        (alpha >= LEAST).then(|| -(-alpha).ln_1p())
    }
}
