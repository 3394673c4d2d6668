//! The one optical model, for the eye ray and the light ray alike.
//!
//! | symbol | name | meaning |
//! |---|---|---|
//! | τ | optical depth | ∫σ_t ds, Napierian |
//! | T | transmittance | e^−τ |
//! | α | opacity | 1 − T |
//! | K | cross-section | ∫τ dA of one splat, an area |
//!
//! Source: Gunjee 2007, Eqs. 4-9 (Beer's law); the forms here do not cancel for small τ or α.

use crate::{Cloud, Material, SplatKind};

/// Light that is no more than this, 2⁻⁹⁰ (8·10⁻²⁸), is a trace: an irradiance or a radiance that changes no picture. Its products
/// with opacities and colours would be numbers below the normal ones of f32, whose arithmetic takes many times as long.
pub const TRACE: f32 = f32::from_bits((127 - 90) << 23);

/// Matter of an optical depth that is no more than this, 2⁻⁴⁰ (9·10⁻¹³), is not drawn: even a million times as much is an opacity of
/// less than 10⁻⁶. The square of what a profile leaves of it, of which opacities are made, would be below the normal numbers of f32.
pub const FAINTEST: f32 = f32::from_bits((127 - 40) << 23);

/// [`FAINTEST`] for optical depths that are yet to be multiplied with [`Material::extinction_rgb`]: less where one of these materials
/// has a factor above 1.
pub fn faintest(materials: &[Material]) -> f32 {
    FAINTEST / materials.iter().map(Material::greatest_extinction).fold(1.0, f32::max)
}

/// Which of so many objects nothing is seen of, by rising id: they have splats, all of media, and none has a mean optical depth above
/// [`faintest`]. Surfaces may be clear and yet bend light.
///
/// # Panics
/// If an object of the cloud is out of range.
pub fn too_faint(cloud: &Cloud, materials: &[Material], objects: usize) -> Vec<usize> {
    let faintest = faintest(materials);
    // Whether an object has splats, and one that is seen.
    let mut visibility = vec![[false; 2]; objects];
    for i in 0..cloud.len() {
        let is_seen = cloud.kind[i] != SplatKind::Medium || cloud.cross_section[i] > faintest * cloud.radius[i].powi(2);
        let [has_splats, is_one_seen] = &mut visibility[cloud.object[i] as usize];
        (*has_splats, *is_one_seen) = (true, *is_one_seen | is_seen);
    }
    (0..objects).filter(|object| visibility[*object] == [true, false]).collect()
}

/// How the opacity of a translucent surface depends on the angle at which it is crossed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum SurfaceOpacity {
    /// One crossing has the same opacity at every angle.
    #[default]
    PerCrossing,
    /// A thin slab of matter: τ/|cos θ|, as in Tanaka 2012.
    ThinSlab,
}

impl SurfaceOpacity {
    /// Factor on τ for a ray at `cos_theta` to the normal. A ThinSlab is cut at |cos θ| = 1/1000, where any slab that
    /// could be seen at all is opaque.
    pub fn optical_depth_factor(self, cos_theta: f32) -> f32 {
        match self {
            Self::PerCrossing => 1.0,
            Self::ThinSlab => 1.0 / cos_theta.abs().max(1e-3),
        }
    }
}

/// α = 1 − e^−τ, exact for τ → 0.
pub fn opacity(optical_depth: f64) -> f64 {
    -libm::expm1(-optical_depth)
}

/// τ = −ln(1 − α), exact for α → 0; infinite for α = 1.
pub fn optical_depth(opacity: f64) -> f64 {
    -libm::log1p(-opacity)
}

/// Opacity of each of `k` coincident layers that together have opacity `alpha`: 1 − (1 − α)^(1/k).
pub fn coincident_layer_opacity(alpha: f64, k: u32) -> f64 {
    opacity(optical_depth(alpha) / f64::from(k))
}

/// Absorption coefficient α = 4πκ/λ per unit length (Gunjee 2007, Eq. 7), for the extinction coefficient κ (imaginary
/// part of the refractive index) and the wavelength λ in the same unit of length.
pub fn absorption_coefficient(kappa: f64, wavelength: f64) -> f64 {
    4.0 * std::f64::consts::PI * kappa / wavelength
}

/// How absorbance is made from a splat's attributes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum AbsorbanceModel {
    /// The optical model of this module: deposits are K over the area of the cell at the splat.
    #[default]
    CrossSection,
    /// Gunjee 2007, Eq. 6: A = α·l·c with α = 1 (translucent) or 100 (opaque), l the splat's size, c its opacity.
    Paper,
}

/// Absorbance A = α·l·c of one splat by Gunjee 2007, Eq. 6: α is 100 for an opaque splat and 1 otherwise, `size` and
/// `opacity` as the paper uses them.
pub fn paper_absorbance(opaque: bool, size: f64, opacity: f64) -> f64 {
    (if opaque { 100.0 } else { 1.0 }) * size * opacity
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cv06_tiny_opacities_survive_the_round_trip() {
        for alpha in [1e-12, 1e-6, 0.1, 0.9, 1.0 - 1e-9] {
            let back = opacity(optical_depth(alpha));
            assert!((back - alpha).abs() <= 4e-16_f64.max(alpha * 1e-12), "{alpha} → {back}");
        }
        assert_eq!(opacity(optical_depth(1.0)), 1.0);
    }

    #[test]
    fn cv05_coincident_layers_composite_to_the_whole() {
        for k in [1u32, 2, 17, 4096] {
            let through: f64 = (0..k).map(|_| 1.0 - coincident_layer_opacity(0.9, k)).product();
            assert!((1.0 - through - 0.9).abs() < 1e-6, "k {k}");
        }
    }
}
