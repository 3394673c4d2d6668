//! Lights of a scene; extended ones become points.
//!
//! An extended light is `samples` point lights that share its intensity evenly. Each point radiates equally in all
//! directions: the cosine of a flat emitter is not simulated.

use glam::DVec3;
use splat_core::{Light, LightShape};

/// What a light of the scene is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum LightSource {
    /// A point, a parallel beam or a cone.
    Simple(Light),
    /// A sphere.
    Sphere {
        /// Centre, world.
        position: DVec3,
        /// Radius, world units, > 0.
        radius: f64,
    },
    /// A flat disc.
    Disk {
        /// Centre, world.
        position: DVec3,
        /// Unit normal.
        normal: DVec3,
        /// Radius, world units, > 0.
        radius: f64,
    },
    /// A flat parallelogram.
    Rect {
        /// Centre, world.
        position: DVec3,
        /// First half-axis, world.
        u: DVec3,
        /// Second half-axis, world.
        v: DVec3,
    },
}

/// One light of the scene.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SceneLight {
    /// What it is.
    pub source: LightSource,
    /// Intensity of the whole light, W/sr per channel; irradiance in W/m² for a directional one.
    pub intensity: [f32; 3],
    /// Points that an extended light becomes; 1 for a simple one.
    pub samples: u32,
    /// Whether it casts shadows.
    pub shadow: bool,
}

/// The golden ratio's fractional part and the plastic number's two: steps of low-discrepancy sequences.
const GOLDEN: f64 = 0.618_033_988_749_894_8;
const PLASTIC: [f64; 2] = [0.754_877_666_246_692_7, 0.569_840_290_998_053_2];

impl SceneLight {
    /// The point lights that stand for this light.
    pub fn points(&self) -> Vec<Light> {
        let n = f64::from(self.samples);
        let share = self.intensity.map(|i| (f64::from(i) / n) as f32);
        let at = |position| Light { shape: LightShape::Point { position }, intensity: share };
        match self.source {
            LightSource::Simple(light) => vec![light],
            LightSource::Sphere { position, radius } => {
                (0..self.samples).map(|i| at(position + in_ball(i, n) * radius)).collect()
            }
            LightSource::Disk { position, normal, radius } => {
                let u = normal.any_orthonormal_vector();
                let v = normal.cross(u);
                let place = |i| {
                    let (x, y) = in_disc(i, n);
                    at(position + (u * x + v * y) * radius)
                };
                (0..self.samples).map(place).collect()
            }
            LightSource::Rect { position, u, v } => {
                let place = |i: u32| {
                    let [s, t] = PLASTIC.map(|step| 2.0 * (0.5 + step * f64::from(i)).fract() - 1.0);
                    at(position + u * s + v * t)
                };
                (0..self.samples).map(place).collect()
            }
        }
    }
}

/// Point `i` of `n` in the unit disc, evenly spread (a sunflower spiral).
fn in_disc(i: u32, n: f64) -> (f64, f64) {
    let radius = ((f64::from(i) + 0.5) / n).sqrt();
    let angle = std::f64::consts::TAU * (GOLDEN * f64::from(i)).fract();
    (radius * libm::cos(angle), radius * libm::sin(angle))
}

/// Point `i` of `n` in the unit ball with density ∝ 1/√(1 − r²), which projects to an even disc in every direction, as
/// a sphere of even radiance is seen.
///
/// Directions are a Fibonacci spiral; r inverts the share inside, (2/π)(asin r − r√(1 − r²)), by bisection.
fn in_ball(i: u32, n: f64) -> DVec3 {
    let z = 1.0 - 2.0 * (f64::from(i) + 0.5) / n;
    let angle = std::f64::consts::TAU * (GOLDEN * f64::from(i)).fract();
    let ring = (1.0 - z * z).sqrt();
    let direction = DVec3::new(ring * libm::cos(angle), ring * libm::sin(angle), z);
    let share = (0.5 + PLASTIC[0] * f64::from(i)).fract();
    let (mut low, mut high) = (0.0, 1.0f64);
    for _ in 0..40 {
        let r = 0.5 * (low + high);
        let inside = std::f64::consts::FRAC_2_PI * (libm::asin(r) - r * (1.0 - r * r).sqrt());
        if inside < share { low = r } else { high = r }
    }
    direction * (0.5 * (low + high))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn positions(source: LightSource, samples: u32) -> Vec<DVec3> {
        let light = SceneLight { source, intensity: [6.0, 3.0, 0.0], samples, shadow: true };
        let points = light.points();
        let total: f64 = points.iter().map(|l| f64::from(l.intensity[0])).sum();
        assert!((total - 6.0).abs() < 1e-5);
        let position = |l: &Light| match l.shape {
            LightShape::Point { position } => position,
            _ => panic!("an extended light becomes points"),
        };
        points.iter().map(position).collect()
    }

    #[test]
    fn sphere_light_projects_to_an_even_disc() {
        let points = positions(LightSource::Sphere { position: DVec3::ZERO, radius: 2.0 }, 4096);
        for axis in [DVec3::X, DVec3::Y, DVec3::Z, DVec3::new(0.6, 0.8, 0.0)] {
            // An even disc of radius 2 has mean squared radius 2 and half of it within √2.
            let rho_sq: Vec<f64> = points.iter().map(|p| (*p - axis * p.dot(axis)).length_squared()).collect();
            let mean = rho_sq.iter().sum::<f64>() / 4096.0;
            let half = rho_sq.iter().filter(|r| **r < 2.0).count() as f64 / 4096.0;
            assert!((mean - 2.0).abs() < 0.02, "{axis}: {mean}");
            assert!((half - 0.5).abs() < 0.02, "{axis}: {half}");
        }
    }

    #[test]
    fn disk_and_rect_lights_lie_on_their_shape() {
        let normal = DVec3::new(0.0, 0.6, 0.8);
        for p in positions(LightSource::Disk { position: DVec3::ZERO, normal, radius: 1.0 }, 64) {
            assert!(p.dot(normal).abs() < 1e-12 && p.length() <= 1.0);
        }
        let rect = LightSource::Rect { position: DVec3::ONE, u: DVec3::X * 2.0, v: DVec3::Y };
        let points = positions(rect, 256);
        assert!(points.iter().all(|p| p.z == 1.0 && (p.x - 1.0).abs() <= 2.0 && (p.y - 1.0).abs() <= 1.0));
        let mean = points.iter().sum::<DVec3>() / 256.0;
        assert!((mean - DVec3::ONE).length() < 0.02, "{mean}");
    }
}
