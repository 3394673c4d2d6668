//! Gaussians in the image (Kerbl et al. 2023, Eq. 5 and 6; Zwicker's EWA): Σ' = JΣJᵀ + filter, J the Jacobian at the centre, and the
//! opacity α = min(0.99, o·e^(−½·dᵀΣ'⁻¹d)) of a fragment, which is nothing below 1/255.
//!
//! From the axes mₖ = J·aₖ the determinant is Σ(mᵢ × mⱼ)² + filter·trace + filter², so that one seen edge-on does not cancel. View depth
//! and place in the image have one normal distribution: on the ray of a pixel matter has the depth z + Σ'_zx·Σ'⁻¹·d on average, and the
//! deviation that is left. By the share before an opaque surface α counts as other media do.
//!
//! Deviations: what lies less than a standard deviation before the eye plane is not seen, where its authors cut at 0.2 units of a scene; and
//! every fragment is what α says, where they stop at a transmittance of 10⁻⁴.

use super::lanes::{Broadcast, Lanes};
use super::project::Projector;
use super::projected::{Coverage, ProjectedDepth, ProjectedSplat};
use crate::Gaussians;
use glam::{Vec2, Vec3};
use pulp::Simd;

/// Least deviation of depth on a ray over that of all rays: a flat one that a ray meets at one depth.
const FLATTEST: f32 = 1.0 / 1024.0;

impl Projector<'_> {
    /// Writes the footprints of those splats from `first` on that are Gaussians.
    pub(super) fn write_gaussians(
        &self,
        first: usize,
        splats: &mut [ProjectedSplat],
        coverage: &mut [Coverage],
        depths: &mut [ProjectedDepth],
    ) {
        let cloud = self.columns.cloud;
        for (l, (splat, coverage)) in splats.iter_mut().zip(coverage).enumerate() {
            let Some(g) = cloud.gaussian_of(first + l) else { continue };
            let kernel = &self.columns.kernels[cloud.footprint[first + l] as usize];
            let (seen, depth) = self.gaussian(cloud.position[first + l], g).unwrap_or_default();
            *splat = ProjectedSplat { material: splat.material, footprint: splat.footprint, kind: splat.kind, ..seen };
            splat.set_gaussian();
            *coverage = if splat.peak > 0.0 { Coverage::from_bounds(splat.bounds(self.size)) } else { Coverage::NONE };
            if let Some(to) = depths.get_mut(l) {
                let per_depth = 1.0 / (kernel.half_width * kernel.cutoff * depth.core[0]);
                *to = ProjectedDepth { core: [per_depth, 0.0, 0.0], ..depth };
            }
        }
    }

    /// The footprint of Gaussian `g` at an offset, with the deviation of its depth on a ray as the first number of `core`; `None` where
    /// it is not seen.
    fn gaussian(&self, offset: Vec3, g: usize) -> Option<(ProjectedSplat, ProjectedDepth)> {
        let gaussians = &self.columns.cloud.gaussians;
        let axes = gaussians.axes[g].map(|axis| self.view.rotation * axis);
        let opacity = gaussians.opacity[g];
        let center = self.view.apply(offset);
        let variance_z: f32 = axes.iter().map(|a| a.z * a.z).sum();
        let level = Gaussians::level(opacity);
        let nearest = if self.orthographic { 0.0 } else { variance_z.sqrt() };
        // Comparisons with NaN are false.
        if !(center.z > nearest && level > 0.0) {
            return None;
        }
        let px_per_world = if self.orthographic { self.focal } else { self.focal / center.z };
        let most = self.reach * Gaussians::MOST_SLANT;
        let slant =
            if self.orthographic { Vec2::ZERO } else { (Vec2::new(center.x, center.y) / center.z).clamp(-most, most) };
        let to_image = |a: Vec3| Vec2::new(a.x - slant.x * a.z, slant.y * a.z - a.y) * px_per_world;
        let m = axes.map(to_image);
        let filter = Gaussians::FILTER_VARIANCE * self.filter_sigma_px * self.filter_sigma_px;
        let area_sq = [(0, 1), (0, 2), (1, 2)].map(|(i, j)| m[i].perp_dot(m[j]).powi(2)).iter().sum::<f32>();
        let sum = |term: &dyn Fn(usize) -> f32| term(0) + term(1) + term(2);
        let trace = sum(&|k| m[k].length_squared());
        let xx = sum(&|k| m[k].x * m[k].x) + filter;
        let yy = sum(&|k| m[k].y * m[k].y) + filter;
        let xy = sum(&|k| m[k].x * m[k].y);
        let inverse = 1.0 / (area_sq + filter * trace + filter * filter);
        let [zx, zy] = [sum(&|k| m[k].x * axes[k].z), sum(&|k| m[k].y * axes[k].z)];
        let slope = [(yy * zx - xy * zy) * inverse, (xx * zy - xy * zx) * inverse];
        let left = (variance_z - slope[0] * zx - slope[1] * zy).max(0.0);
        let deviation = left.sqrt().max(FLATTEST * variance_z.sqrt()).max(f32::MIN_POSITIVE);
        let mut splat = ProjectedSplat {
            center_px: (self.half + Vec2::new(center.x, -center.y) * px_per_world).to_array(),
            // Halved: α = o·e^−s.
            conic: [0.5 * yy * inverse, -xy * inverse, 0.5 * xx * inverse],
            peak: if inverse.is_finite() { opacity } else { 0.0 },
            ..ProjectedSplat::default()
        };
        splat.set_half_extent([xx, yy].map(|variance| (2.0 * level * variance).sqrt()));
        Some((splat, ProjectedDepth { center: center.z, slope, extent: f32::INFINITY, core: [deviation, 0.0, 0.0] }))
    }
}

/// Optical depth of a fragment whose s is `distance_sq`: −ln(1 − α).
#[inline(always)]
pub(super) fn optical_depth<S: Simd>(simd: S, opacity: f32, distance_sq: Lanes<S>) -> Lanes<S> {
    let alpha = (simd.lanes(opacity) * distance_sq.exp_neg()).min(simd.lanes(Gaussians::MOST_OPACITY));
    let tau = simd.lanes(0.0) - (simd.lanes(1.0) - alpha).logarithm();
    simd.lanes(0.0).where_less_or(alpha, simd.lanes(Gaussians::LEAST_OPACITY), tau)
}
