//! Lights.
//!
//! A sphere, a disk and a rectangle are lights of their own: each stays whole until somebody needs points of it and asks
//! [`Light::points`]. What is flat shines to one side, with the cosine.

mod brightest;
mod points;
mod slide;

pub use brightest::LitBounds;
pub use slide::{Framing, Slide, SlideProjection};

use crate::Error;
use glam::DVec3;
use std::f64::consts::FRAC_PI_2;

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
    /// A point of a flat light: intensity times the cosine to its normal, and none behind it.
    Patch {
        /// World position.
        position: DVec3,
        /// Unit normal, to the side that it shines to.
        normal: DVec3,
    },
    /// A sphere of even radiance that shines outwards.
    Sphere {
        /// Centre, world.
        center: DVec3,
        /// Radius, world units, > 0.
        radius: f64,
    },
    /// A flat disc of even radiance that shines to the side of its normal.
    Disk {
        /// Centre, world.
        center: DVec3,
        /// Unit normal.
        normal: DVec3,
        /// Radius, world units, > 0.
        radius: f64,
    },
    /// A parallelogram `center` ± `u` ± `v` of even radiance that shines to the side of u × v.
    Rect {
        /// Centre, world.
        center: DVec3,
        /// First half-axis, world units.
        u: DVec3,
        /// Second half-axis, world units, not parallel to the first.
        v: DVec3,
    },
}

impl LightShape {
    /// World position of a light, the centre of one with an extent; `None` for parallel light.
    pub fn place(&self) -> Option<DVec3> {
        match *self {
            Self::Point { position } | Self::Spot { position, .. } | Self::Patch { position, .. } => Some(position),
            Self::Sphere { center, .. } | Self::Disk { center, .. } | Self::Rect { center, .. } => Some(center),
            Self::Directional { .. } => None,
        }
    }

    /// Unit normal of what is flat, to the side that it shines to; `None` for all else.
    pub fn normal(&self) -> Option<DVec3> {
        match *self {
            Self::Patch { normal, .. } | Self::Disk { normal, .. } => Some(normal),
            Self::Rect { u, v, .. } => Some(rect_normal(u, v)),
            _ => None,
        }
    }

    /// Whether it has an extent, so that [`Light::points`] makes other lights of it.
    pub fn is_extended(&self) -> bool {
        matches!(self, Self::Sphere { .. } | Self::Disk { .. } | Self::Rect { .. })
    }

    /// What is wrong with it: attribute, found, expected.
    fn fault(&self) -> Option<(&'static str, String, &'static str)> {
        let positive = |radius: f64| radius.is_finite() && radius > 0.0;
        if let Some(place) = self.place().filter(|p| !p.is_finite()) {
            return Some(("position", place.to_string(), "finite numbers"));
        }
        match *self {
            Self::Spot { inner, outer, .. } if !(0.0 <= inner && inner <= outer && outer < FRAC_PI_2) => {
                return Some(("cone", format!("{inner}..{outer}"), "0 ≤ inner ≤ outer < π/2 radians"));
            }
            Self::Sphere { radius, .. } | Self::Disk { radius, .. } if !positive(radius) => {
                return Some(("radius", radius.to_string(), "a finite length > 0"));
            }
            Self::Rect { u, v, .. } if !positive(u.cross(v).length()) => {
                return Some(("half-axes", format!("{u}, {v}"), "two finite vectors that are not parallel"));
            }
            _ => {}
        }
        let (attribute, direction) = match *self {
            Self::Directional { direction } | Self::Spot { direction, .. } => ("direction", direction),
            Self::Patch { normal, .. } | Self::Disk { normal, .. } => ("normal", normal),
            _ => return None,
        };
        // Not a number is no unit vector either.
        let is_unit = (direction.length_squared() - 1.0).abs() < 1e-6;
        (!is_unit).then(|| (attribute, direction.to_string(), "a unit vector"))
    }
}

/// One light.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Light {
    /// Where it comes from.
    pub shape: LightShape,
    /// Radiant intensity I in W/sr per channel (relative units allowed), on the axis of a spot and along the normal of what
    /// is flat; irradiance in W/m² for directional light. That of an extended light is the whole light's as it is seen from
    /// far away: its radiance is I over the area that is seen from there, πr² of a sphere or disk, 4·|u × v| of a rectangle.
    pub intensity: [f32; 3],
}

impl Light {
    /// The light without its extent, in its middle: it shines to the same side.
    #[must_use]
    pub fn middle(&self) -> Self {
        let shape = match (self.shape.place(), self.shape.normal()) {
            (Some(position), Some(normal)) => LightShape::Patch { position, normal },
            (Some(position), None) if self.shape.is_extended() => LightShape::Point { position },
            _ => self.shape,
        };
        Self { shape, ..*self }
    }

    /// Checks that everything is finite, intensities are ≥ 0, directions are of unit length, and extents above 0.
    ///
    /// # Errors
    /// [`Error::Invalid`] naming the light by `index`.
    pub fn validate(&self, index: usize) -> Result<(), Error> {
        let dark = || ("intensity", format!("{:?}", self.intensity), "three finite numbers ≥ 0");
        let is_bright = self.intensity.iter().all(|i| i.is_finite() && *i >= 0.0);
        match self.shape.fault().or_else(|| (!is_bright).then(dark)) {
            Some((attribute, found, expected)) => {
                Err(Error::Invalid { element: "light", index, attribute, found, expected })
            }
            None => Ok(()),
        }
    }

    /// A key that is the same for equal lights alone.
    pub fn key(&self) -> LightKey {
        let zero = DVec3::ZERO;
        let (kind, vectors) = match self.shape {
            LightShape::Point { position } => (0, [position, zero, zero]),
            LightShape::Directional { direction } => (1, [zero, direction, zero]),
            LightShape::Spot { position, direction, inner, outer } => {
                (2, [position, direction, DVec3::new(inner, outer, 0.0)])
            }
            LightShape::Patch { position, normal } => (3, [position, normal, zero]),
            LightShape::Sphere { center, radius } => (4, [center, DVec3::new(radius, 0.0, 0.0), zero]),
            LightShape::Disk { center, normal, radius } => (5, [center, normal, DVec3::new(radius, 0.0, 0.0)]),
            LightShape::Rect { center, u, v } => (6, [center, u, v]),
        };
        let mut shape = [0; 9];
        let numbers = vectors.iter().flat_map(|v| v.to_array());
        shape.iter_mut().zip(numbers).for_each(|(bits, number)| *bits = number.to_bits());
        LightKey { kind, shape, intensity: self.intensity.map(f32::to_bits) }
    }

    /// The same light in a world whose lengths are `scale` times as large, so that everything there receives the same
    /// irradiance: intensities times `scale`², the irradiance of parallel light as it is.
    pub fn scaled(&self, scale: f64) -> Self {
        let at = |p: DVec3| p * scale;
        let shape = match self.shape {
            LightShape::Point { position } => LightShape::Point { position: at(position) },
            LightShape::Directional { .. } => return *self,
            LightShape::Spot { position, direction, inner, outer } => {
                LightShape::Spot { position: at(position), direction, inner, outer }
            }
            LightShape::Patch { position, normal } => LightShape::Patch { position: at(position), normal },
            LightShape::Sphere { center, radius } => LightShape::Sphere { center: at(center), radius: radius * scale },
            LightShape::Disk { center, normal, radius } => {
                LightShape::Disk { center: at(center), normal, radius: radius * scale }
            }
            LightShape::Rect { center, u, v } => LightShape::Rect { center: at(center), u: at(u), v: at(v) },
        };
        let area = (scale * scale) as f32;
        Self { shape, intensity: self.intensity.map(|i| i * area) }
    }

    /// Direction from `p` to the light, and the unshadowed irradiance per channel on a plane that faces it, W/m².
    ///
    /// `spread` is the standard deviation σ of the splat that receives the light, world units; 0 for a bare point. A
    /// splat is no point: near a light at distance d it receives 1/(d² + σ²), which is the mean of 1/d² over a Gaussian
    /// at d = 0 and tends to 1/d² away from it. The direction shrinks with it, d/√(d² + σ²), to nothing at the light
    /// itself; so does the cosine to the normal of a patch, which has nothing behind it at any distance.
    ///
    /// A light with an extent counts as one point at its centre. That is exact outside of a sphere that is seen whole, and
    /// far from what is flat; who lights what is nearer asks for [`Light::points`].
    #[inline]
    pub fn irradiance(&self, p: DVec3, spread: f64) -> Incidence<DVec3> {
        let from_point = |position: DVec3| {
            let to_light = position - p;
            let distance_sq = to_light.length_squared() + spread * spread;
            if distance_sq > 0.0 { (to_light / distance_sq.sqrt(), distance_sq.recip()) } else { (DVec3::ZERO, 0.0) }
        };
        let from_patch = |position: DVec3, normal: DVec3| {
            let (to_light, falloff) = from_point(position);
            (to_light, falloff * (-to_light.dot(normal)).max(0.0))
        };
        let (to_light, falloff) = match self.shape {
            LightShape::Point { position } | LightShape::Sphere { center: position, .. } => from_point(position),
            LightShape::Directional { direction } => (-direction, 1.0),
            LightShape::Spot { position, direction, inner, outer } => {
                let (to_light, falloff) = from_point(position);
                let low = libm::cos(outer);
                let high = libm::cos(inner);
                let cosine = -to_light.dot(direction);
                let t =
                    if high > low { ((cosine - low) / (high - low)).clamp(0.0, 1.0) } else { f64::from(cosine >= low) };
                (to_light, falloff * t * t * (3.0 - 2.0 * t))
            }
            LightShape::Patch { position, normal } | LightShape::Disk { center: position, normal, .. } => {
                from_patch(position, normal)
            }
            LightShape::Rect { center, u, v } => from_patch(center, rect_normal(u, v)),
        };
        Incidence { to_light, irradiance: self.intensity.map(|i| (f64::from(i) * falloff) as f32) }
    }
}

/// Light of a source at a point, without shadow.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Incidence<V> {
    /// Direction to the source; shorter than 1 near a source, see [`Light::irradiance`].
    pub to_light: V,
    /// W/m² by channel, on a plane that faces the source.
    pub irradiance: [f32; 3],
}

/// A light as bits, which orders lights.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct LightKey {
    kind: u8,
    shape: [u64; 9],
    intensity: [u32; 3],
}

/// Unit normal of a rectangle with these half-axes, to the side that it shines to.
pub(crate) fn rect_normal(u: DVec3, v: DVec3) -> DVec3 {
    u.cross(v).normalize_or_zero()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn light(shape: LightShape) -> Light {
        Light { shape, intensity: [2.0; 3] }
    }

    #[test]
    fn what_is_flat_has_the_normal_of_the_side_that_it_shines_to() {
        let center = DVec3::ONE;
        let normal = DVec3::NEG_Y;
        let disk = LightShape::Disk { center, normal, radius: 0.5 };
        let rect = LightShape::Rect { center, u: DVec3::X * 2.0, v: DVec3::Z };
        assert_eq!([disk.normal(), rect.normal()], [Some(normal); 2]);
        assert_eq!(LightShape::Point { position: center }.normal(), None);
    }

    #[test]
    fn ts01_a_splat_at_the_light_receives_a_finite_mean() {
        let light = light(LightShape::Point { position: DVec3::ONE });
        for offset in [0.0, 1e-12, 1e-3] {
            let Incidence { to_light, irradiance } = light.irradiance(DVec3::ONE + DVec3::X * offset, 0.1);
            assert!((irradiance[0] / 200.0 - 1.0).abs() < 1e-3, "{offset}: {irradiance:?}");
            assert!(to_light.length() < 0.011);
        }
        let Incidence { to_light, irradiance } = light.irradiance(DVec3::new(1.0, 1.0, -9.0), 0.1);
        assert!((irradiance[0] - 0.02).abs() < 1e-5 && (to_light - DVec3::Z).length() < 1e-4);
        assert_eq!(light.irradiance(DVec3::ONE, 0.0).irradiance, [0.0; 3]);
    }

    #[test]
    fn a_patch_shines_to_one_side_with_the_cosine() {
        let patch = light(LightShape::Patch { position: DVec3::ONE, normal: DVec3::NEG_Y });
        let at = |x: f64, y: f64| patch.irradiance(DVec3::ONE + DVec3::new(x, y, 0.0), 0.0).irradiance[0];
        // I·cos θ/d²: 2 at a distance of 1 along the normal, and at 60° to it a half of that.
        assert_eq!(at(0.0, -1.0), 2.0);
        assert!((at(0.75f64.sqrt(), -0.5) - 1.0).abs() < 1e-6);
        // Nothing beside it and behind it, whatever receives it.
        assert_eq!([at(1.0, 0.0), at(0.5, 1.0)], [0.0; 2]);
        assert_eq!(patch.irradiance(DVec3::ONE + DVec3::Y * 0.01, 0.1).irradiance, [0.0; 3]);
        assert!(patch.irradiance(DVec3::ONE - DVec3::Y * 0.01, 0.1).irradiance[0] > 0.0);
    }

    #[test]
    fn a_scaled_light_gives_a_scaled_world_the_same_irradiance() {
        let center = DVec3::new(1.0, 2.0, 3.0);
        let normal = DVec3::NEG_Y;
        let shapes = [
            LightShape::Point { position: center },
            LightShape::Directional { direction: normal },
            LightShape::Spot { position: center, direction: normal, inner: 0.2, outer: 0.9 },
            LightShape::Patch { position: center, normal },
            LightShape::Sphere { center, radius: 0.5 },
            LightShape::Disk { center, normal, radius: 0.5 },
            LightShape::Rect { center, u: DVec3::X, v: DVec3::Z },
        ];
        for shape in shapes {
            let light = light(shape);
            let p = DVec3::new(0.5, 0.25, 2.5);
            light.validate(0).expect("a light");
            for (one, other) in light.points(5).iter().zip(light.scaled(0.25).points(5)) {
                assert_eq!(one.irradiance(p, 0.125), other.irradiance(p * 0.25, 0.125 * 0.25), "{shape:?}");
                assert_eq!(one.scaled(0.25), other);
            }
        }
    }

    #[test]
    fn lights_without_extent_direction_or_place_are_refused() {
        let center = DVec3::ZERO;
        let normal = DVec3::Y;
        let nan = f64::NAN;
        let bad = [
            ("position", LightShape::Patch { position: DVec3::splat(nan), normal }),
            ("normal", LightShape::Patch { position: center, normal: normal * 2.0 }),
            ("radius", LightShape::Sphere { center, radius: 0.0 }),
            ("radius", LightShape::Disk { center, normal, radius: nan }),
            ("normal", LightShape::Disk { center, normal: DVec3::splat(nan), radius: 1.0 }),
            ("half-axes", LightShape::Rect { center, u: DVec3::X, v: DVec3::X * 3.0 }),
            ("half-axes", LightShape::Rect { center, u: DVec3::X, v: DVec3::splat(nan) }),
            ("cone", LightShape::Spot { position: center, direction: normal, inner: 1.0, outer: 0.5 }),
            ("direction", LightShape::Directional { direction: DVec3::ZERO }),
        ];
        for (expected, shape) in bad {
            match light(shape).validate(7) {
                Err(Error::Invalid { index: 7, attribute, .. }) => assert_eq!(attribute, expected),
                other => panic!("{shape:?}: {other:?}"),
            }
        }
    }
}
