//! Lights.

use crate::Error;
use glam::DVec3;

/// Where the light comes from.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum LightShape {
    /// Radiates equally in all directions from a point.
    Point {
        /// World position.
        position: DVec3,
    },
    /// Parallel light.
    Directional {
        /// Unit direction of travel, away from the light.
        direction: DVec3,
    },
    /// A cone of light from a point; full inside `inner`, smooth (cubic Hermite in the cosine) to zero at `outer`.
    Spot {
        /// World position.
        position: DVec3,
        /// Unit direction of travel along the axis.
        direction: DVec3,
        /// Half angle of full light, radians.
        inner: f64,
        /// Half angle of no light, radians, < π/2.
        outer: f64,
    },
}

/// One light. An extended light is several points, see `organza_scene::SceneLight`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Light {
    /// Where it comes from.
    pub shape: LightShape,
    /// Radiant intensity I in W/sr per channel (relative units allowed); irradiance in W/m² for directional light.
    pub intensity: [f32; 3],
}

impl Light {
    /// Checks that everything is finite, intensities are ≥ 0 and directions are of unit length.
    ///
    /// # Errors
    /// [`Error::Invalid`] naming the light by `index`.
    pub fn validate(&self, index: usize) -> Result<(), Error> {
        let bad = |attribute, found: String, expected| {
            Err(Error::Invalid { element: "light", index, attribute, found, expected })
        };
        if !self.intensity.iter().all(|i| i.is_finite() && *i >= 0.0) {
            return bad("intensity", format!("{:?}", self.intensity), "three finite numbers ≥ 0");
        }
        let (position, direction) = match self.shape {
            LightShape::Point { position } => (position, DVec3::Z),
            LightShape::Directional { direction } => (DVec3::ZERO, direction),
            LightShape::Spot { position, direction, inner, outer } => {
                if !(0.0 <= inner && inner <= outer && outer < std::f64::consts::FRAC_PI_2) {
                    return bad("cone", format!("{inner}..{outer}"), "0 ≤ inner ≤ outer < π/2 radians");
                }
                (position, direction)
            }
        };
        if !position.is_finite() {
            return bad("position", position.to_string(), "finite numbers");
        }
        if (direction.length_squared() - 1.0).abs() >= 1e-6 {
            return bad("direction", direction.to_string(), "a unit vector");
        }
        Ok(())
    }

    /// Shape and intensity as bits, the same for equal lights alone: a key that puts lights in an order of their own.
    pub fn bits(&self) -> (u8, [u64; 8], [u32; 3]) {
        let (kind, p, d, angles) = match self.shape {
            LightShape::Point { position } => (0, position, DVec3::ZERO, [0.0; 2]),
            LightShape::Directional { direction } => (1, DVec3::ZERO, direction, [0.0; 2]),
            LightShape::Spot { position, direction, inner, outer } => (2, position, direction, [inner, outer]),
        };
        let shape = [p.x, p.y, p.z, d.x, d.y, d.z, angles[0], angles[1]];
        (kind, shape.map(f64::to_bits), self.intensity.map(f32::to_bits))
    }

    /// Direction from `p` to the light, and the unshadowed irradiance per channel on a plane that faces it, W/m².
    ///
    /// `spread` is the standard deviation σ of the splat that receives the light, world units; 0 for a bare point. A
    /// splat is no point: near a light at distance d it receives 1/(d² + σ²), which is the mean of 1/d² over a Gaussian
    /// at d = 0 and tends to 1/d² away from it. The direction shrinks with it, d/√(d² + σ²), to nothing at the light
    /// itself.
    pub fn irradiance(&self, p: DVec3, spread: f64) -> (DVec3, [f32; 3]) {
        let from_point = |position: DVec3| {
            let to_light = position - p;
            let distance_sq = to_light.length_squared() + spread * spread;
            if distance_sq > 0.0 { (to_light / distance_sq.sqrt(), distance_sq.recip()) } else { (DVec3::ZERO, 0.0) }
        };
        let (to_light, falloff) = match self.shape {
            LightShape::Point { position } => from_point(position),
            LightShape::Directional { direction } => (-direction, 1.0),
            LightShape::Spot { position, direction, inner, outer } => {
                let (to_light, falloff) = from_point(position);
                let (low, high) = (libm::cos(outer), libm::cos(inner));
                let cosine = -to_light.dot(direction);
                let t =
                    if high > low { ((cosine - low) / (high - low)).clamp(0.0, 1.0) } else { f64::from(cosine >= low) };
                (to_light, falloff * t * t * (3.0 - 2.0 * t))
            }
        };
        (to_light, self.intensity.map(|i| (f64::from(i) * falloff) as f32))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ts01_a_splat_at_the_light_receives_a_finite_mean() {
        let light = Light { shape: LightShape::Point { position: DVec3::ONE }, intensity: [2.0; 3] };
        for offset in [0.0, 1e-12, 1e-3] {
            let (to_light, irradiance) = light.irradiance(DVec3::ONE + DVec3::X * offset, 0.1);
            assert!((irradiance[0] / 200.0 - 1.0).abs() < 1e-3, "{offset}: {irradiance:?}");
            assert!(to_light.length() < 0.011);
        }
        let (to_light, irradiance) = light.irradiance(DVec3::new(1.0, 1.0, -9.0), 0.1);
        assert!((irradiance[0] - 0.02).abs() < 1e-5 && (to_light - DVec3::Z).length() < 1e-4);
        assert_eq!(light.irradiance(DVec3::ONE, 0.0).1, [0.0; 3]);
    }
}
