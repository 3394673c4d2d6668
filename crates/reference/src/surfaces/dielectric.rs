//! Dielectric interfaces: Snell's law, exact Fresnel reflectance of unpolarised light, total internal reflection and
//! dispersion.
//!
//! | symbol | name | meaning |
//! |---|---|---|
//! | η | `eta` | index behind the interface over index before it, as the ray travels |
//! | θᵢ, θₜ | | angles to the normal before and behind, sin θᵢ = η sin θₜ |
//!
//! R = (r_s² + r_p²)/2, r_s = (cos θᵢ − η cos θₜ)/(cos θᵢ + η cos θₜ), r_p = (η cos θᵢ − cos θₜ)/(η cos θᵢ + cos θₜ)
//! (Born and Wolf, Principles of Optics, 1.5).

use glam::DVec3;

/// Wavelengths that stand for the channels: dominant wavelengths of the Rec.709 primaries, micrometres.
pub const CHANNEL_WAVELENGTHS_UM: [f64; 3] = [0.6114, 0.5491, 0.4642];

/// Refractive index by wavelength: n = a + b/λ² (Cauchy, 1836), λ in micrometres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cauchy {
    /// Index for λ → ∞.
    pub a: f64,
    /// Dispersion, µm².
    pub b: f64,
}

impl Cauchy {
    /// Index at a wavelength in micrometres.
    pub fn index(&self, wavelength_um: f64) -> f64 {
        self.a + self.b / (wavelength_um * wavelength_um)
    }

    /// Index of each channel, see [`CHANNEL_WAVELENGTHS_UM`].
    pub fn channels(&self) -> [f64; 3] {
        CHANNEL_WAVELENGTHS_UM.map(|w| self.index(w))
    }
}

/// A clear or coloured glass that fills the inside of a closed mesh (where normals point away from).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Dielectric {
    /// Index inside over index outside per channel, > 0; channels that differ disperse light.
    pub eta: [f64; 3],
    /// Absorption inside per channel, 1/world unit, ≥ 0.
    pub absorption: [f64; 3],
}

impl Dielectric {
    /// A clear dielectric without dispersion.
    pub fn clear(eta: f64) -> Self {
        Self { eta: [eta; 3], absorption: [0.0; 3] }
    }

    /// Whether channels refract alike.
    pub fn is_achromatic(&self) -> bool {
        self.eta[0] == self.eta[1] && self.eta[1] == self.eta[2]
    }
}

/// Share of the power of unpolarised light that an interface reflects; 1 beyond the critical angle.
/// `cos_i` is the cosine of the angle of incidence, in \[0, 1\].
pub fn fresnel_reflectance(cos_i: f64, eta: f64) -> f64 {
    let Some(cos_t) = transmitted_cosine(cos_i, eta) else { return 1.0 };
    let s = (cos_i - eta * cos_t) / (cos_i + eta * cos_t);
    let p = (eta * cos_i - cos_t) / (eta * cos_i + cos_t);
    if s.is_nan() || p.is_nan() { 1.0 } else { 0.5 * (s * s + p * p) }
}

/// cos θₜ by Snell's law, or `None` for total internal reflection.
pub fn transmitted_cosine(cos_i: f64, eta: f64) -> Option<f64> {
    let sin_sq = ((1.0 - cos_i) * (1.0 + cos_i)).max(0.0) / (eta * eta);
    (sin_sq < 1.0).then(|| (1.0 - sin_sq).sqrt())
}

/// Mirror image of a unit direction of travel at a plane of unit normal.
pub fn reflect(travel: DVec3, normal: DVec3) -> DVec3 {
    (travel - normal * (2.0 * travel.dot(normal))).normalize()
}

/// Unit direction of travel behind the interface, or `None` for total internal reflection. `normal` faces the ray:
/// travel·normal ≤ 0.
pub fn refract(travel: DVec3, normal: DVec3, eta: f64) -> Option<DVec3> {
    let cos_i = -travel.dot(normal);
    let cos_t = transmitted_cosine(cos_i, eta)?;
    Some((travel / eta + normal * (cos_i / eta - cos_t)).normalize())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Transmitted power by the transmission amplitudes, which share nothing with the reflection amplitudes.
    fn transmittance(cos_i: f64, eta: f64) -> f64 {
        let Some(cos_t) = transmitted_cosine(cos_i, eta) else { return 0.0 };
        let s = 2.0 * cos_i / (cos_i + eta * cos_t);
        let p = 2.0 * cos_i / (eta * cos_i + cos_t);
        0.5 * (s * s + p * p) * eta * cos_t / cos_i
    }

    #[test]
    fn reflected_and_transmitted_power_sum_to_one() {
        for eta in [0.4, 1.0 / 1.5, 1.0, 1.0001, 1.33, 2.4] {
            for i in 1..=1000 {
                let cos_i = f64::from(i) / 1000.0;
                let sum = fresnel_reflectance(cos_i, eta) + transmittance(cos_i, eta);
                assert!((sum - 1.0).abs() < 1e-12, "eta {eta}, cos {cos_i}: {sum}");
            }
        }
    }

    #[test]
    fn normal_incidence_reflects_the_square_of_the_index_contrast() {
        for eta in [1.5, 1.0 / 1.5, 2.0] {
            let r: f64 = (eta - 1.0) / (eta + 1.0);
            assert!((fresnel_reflectance(1.0, eta) - r * r).abs() < 1e-15);
        }
    }

    #[test]
    fn brewsters_angle_reflects_s_polarised_light_alone() {
        let eta = 1.5_f64;
        // tan θ_B = η: r_p = 0, and r_s = (1 − η²)/(1 + η²).
        let cos_b = 1.0 / (1.0 + eta * eta).sqrt();
        let s = (1.0 - eta * eta) / (1.0 + eta * eta);
        assert!((fresnel_reflectance(cos_b, eta) - 0.5 * s * s).abs() < 1e-15);
    }

    #[test]
    fn beyond_the_critical_angle_everything_is_reflected() {
        let eta = 1.0 / 1.5;
        let critical = f64::asin(eta);
        for below in [1e-3, 1e-6] {
            assert!(fresnel_reflectance((critical - below).cos(), eta) < 1.0);
            assert_eq!(fresnel_reflectance((critical + below).cos(), eta), 1.0);
        }
        let n = DVec3::Z;
        let travel = DVec3::new((critical + 1e-6).sin(), 0.0, -(critical + 1e-6).cos());
        assert!(refract(travel, n, eta).is_none());
    }

    #[test]
    fn refraction_obeys_snell_and_is_reversible() {
        let n = DVec3::new(0.36, 0.48, 0.8);
        for (i, eta) in [(1, 1.5), (2, 1.0 / 1.5), (3, 1.0), (4, 2.4)] {
            let tilt = n.any_orthonormal_vector();
            let angle = 0.13 * f64::from(i);
            let travel = tilt * angle.sin() - n * angle.cos();
            let behind = refract(travel, n, eta).expect("below the critical angle");
            assert!((behind.dot(tilt) * eta - travel.dot(tilt)).abs() < 1e-15, "eta {eta}");
            let back = refract(-behind, -n, 1.0 / eta).expect("a way back");
            assert!((back + travel).length() < 1e-14, "eta {eta}");
        }
    }

    #[test]
    fn dispersion_bends_blue_more_than_red() {
        let n = Cauchy { a: 1.5046, b: 0.0042 }.channels();
        assert!(n[0] < n[1] && n[1] < n[2]);
        // BK7 glass at the sodium line: 1.5168 by its data sheet.
        assert!((Cauchy { a: 1.5046, b: 0.0042 }.index(0.5876) - 1.5168).abs() < 5e-4);
    }
}
