//! Light sources: points, parallel light, spots, and areas (sphere, disk, rectangle), with sampling and densities.
//!
//! An area light is an emitter alone: it casts no shadow, and rays pass through it. Disk and rectangle shine on the side
//! of their normal, the sphere outwards.

pub(crate) mod environment;
pub(crate) mod slide;
use crate::media::phase::around;
use crate::ray::Ray;
use glam::DVec3;
use splat_core::{Error, Light, LightShape};
use std::f64::consts::PI;

/// One light.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum LightSource {
    /// Radiates equally in all directions from a point.
    Point {
        /// World position.
        position: DVec3,
        /// Radiant intensity per channel, W/sr.
        intensity: [f64; 3],
    },
    /// A cone of light from a point: cubic Hermite in the cosine from `inner` (full) to `outer` (none).
    Spot {
        /// World position.
        position: DVec3,
        /// Unit direction of travel along the axis.
        direction: DVec3,
        /// Half angle of full light, radians.
        inner: f64,
        /// Half angle of no light, radians, < π/2.
        outer: f64,
        /// Radiant intensity on the axis per channel, W/sr.
        intensity: [f64; 3],
    },
    /// Parallel light.
    Directional {
        /// Unit direction of travel.
        direction: DVec3,
        /// Irradiance on a facing plane per channel, W/m².
        irradiance: [f64; 3],
    },
    /// A sphere that shines outwards.
    Sphere {
        /// Centre, world units.
        center: DVec3,
        /// Radius, world units, > 0.
        radius: f64,
        /// Radiance per channel, W·m⁻²·sr⁻¹.
        radiance: [f64; 3],
    },
    /// A disk that shines to the side of its normal.
    Disk {
        /// Centre, world units.
        center: DVec3,
        /// Unit normal.
        normal: DVec3,
        /// Radius, world units, > 0.
        radius: f64,
        /// Radiance per channel, W·m⁻²·sr⁻¹.
        radiance: [f64; 3],
    },
    /// A parallelogram center ± u ± v that shines to the side of u × v.
    Rect {
        /// Centre, world units.
        center: DVec3,
        /// Half axis, world units.
        u: DVec3,
        /// Half axis, world units.
        v: DVec3,
        /// Radiance per channel, W·m⁻²·sr⁻¹.
        radiance: [f64; 3],
    },
}

/// Light that arrives at a point from one sampled direction.
#[derive(Debug, Clone, Copy)]
pub(crate) struct LightSample {
    /// Unit direction to the light.
    pub(crate) direction: DVec3,
    /// How far the light is; infinite for parallel light.
    pub(crate) distance: f64,
    /// Irradiance on a facing plane; radiance over density for an area.
    pub(crate) value: [f64; 3],
    /// Density of the direction, 1/sr; 0 for a light that no other sampling can hit.
    pub(crate) density: f64,
}

impl LightSource {
    /// The reference's form of a noun; `None` for a shape that is not known here, such as one of the points that others take
    /// a flat light for.
    pub fn from_light(light: &Light) -> Option<Self> {
        let power = light.intensity.map(f64::from);
        // Intensity along the normal over the area that is seen from there.
        let over = |area: f64| power.map(|i| i / area);
        match light.shape {
            LightShape::Point { position } => Some(Self::Point { position, intensity: power }),
            LightShape::Directional { direction } => Some(Self::Directional { direction, irradiance: power }),
            LightShape::Spot { position, direction, inner, outer } => {
                Some(Self::Spot { position, direction, inner, outer, intensity: power })
            }
            LightShape::Sphere { center, radius } => {
                Some(Self::Sphere { center, radius, radiance: over(PI * radius * radius) })
            }
            LightShape::Disk { center, normal, radius } => {
                Some(Self::Disk { center, normal, radius, radiance: over(PI * radius * radius) })
            }
            LightShape::Rect { center, u, v } => {
                Some(Self::Rect { center, u, v, radiance: over(4.0 * u.cross(v).length()) })
            }
            _ => None,
        }
    }

    /// Position of a light without extent, for the substitution at its pole.
    pub(crate) fn pole(&self) -> Option<DVec3> {
        match self {
            Self::Point { position, .. } | Self::Spot { position, .. } => Some(*position),
            _ => None,
        }
    }

    /// Whether it has an extent.
    pub(crate) fn is_area(&self) -> bool {
        matches!(self, Self::Sphere { .. } | Self::Disk { .. } | Self::Rect { .. })
    }

    /// Intensity towards `p` over the irradiance law 1/d²; the irradiance itself for parallel light.
    pub(crate) fn intensity(&self, p: DVec3) -> [f64; 3] {
        match self {
            Self::Point { intensity, .. } => *intensity,
            Self::Spot { position, direction, inner, outer, intensity } => {
                let cosine = (p - position).normalize_or_zero().dot(*direction);
                let low = outer.cos();
                let high = inner.cos();
                let t =
                    if high > low { ((cosine - low) / (high - low)).clamp(0.0, 1.0) } else { f64::from(cosine >= low) };
                intensity.map(|i| i * t * t * (3.0 - 2.0 * t))
            }
            Self::Directional { irradiance, .. } => *irradiance,
            Self::Sphere { radiance, .. } | Self::Disk { radiance, .. } | Self::Rect { radiance, .. } => *radiance,
        }
    }

    /// Light that arrives at `p`, unshadowed; `None` where none does.
    pub(crate) fn sample(&self, p: DVec3, u: [f64; 2]) -> Option<LightSample> {
        match self {
            Self::Directional { direction, irradiance } => {
                let distance = f64::INFINITY;
                Some(LightSample { direction: -*direction, distance, value: *irradiance, density: 0.0 })
            }
            Self::Point { position, .. } | Self::Spot { position, .. } => {
                let to_light = position - p;
                let distance = to_light.length();
                let value = self.intensity(p).map(|i| i / (distance * distance));
                (distance > 0.0).then(|| LightSample { direction: to_light / distance, distance, value, density: 0.0 })
            }
            Self::Sphere { center, radius, .. } => self.sample_sphere(p, *center, *radius, u),
            Self::Disk { center, normal, radius, .. } => {
                let on = center + around(*normal, 0.0, 1.0, u[1]) * (radius * u[0].sqrt());
                self.sample_flat(p, on)
            }
            Self::Rect { center, u: a, v: b, .. } => {
                self.sample_flat(p, center + a * (2.0 * u[0] - 1.0) + b * (2.0 * u[1] - 1.0))
            }
        }
    }

    fn sample_sphere(&self, p: DVec3, center: DVec3, radius: f64, u: [f64; 2]) -> Option<LightSample> {
        let axis = center - p;
        let apart = axis.length();
        if apart <= radius {
            return None;
        }
        let versine = u[0] * cone_versine(apart, radius);
        let direction = around(axis / apart, 1.0 - versine, (versine * (2.0 - versine)).sqrt(), u[1]);
        let ray = Ray { origin: p, direction };
        // A direction on the rim may miss by rounding: it touches the sphere.
        let distance = ray.clip_ball(center, radius, 0.0, f64::INFINITY).map_or(axis.dot(direction), |(t, _)| t);
        let density = self.density(p, direction, distance);
        let value = self.intensity(p).map(|l| l / density);
        Some(LightSample { direction, distance, value, density })
    }

    fn sample_flat(&self, p: DVec3, on: DVec3) -> Option<LightSample> {
        let to_light = on - p;
        let distance = to_light.length();
        if distance == 0.0 {
            return None;
        }
        let direction = to_light / distance;
        let density = self.density(p, direction, distance);
        let value = self.intensity(p).map(|l| l / density);
        (density > 0.0 && density.is_finite()).then_some(LightSample { direction, distance, value, density })
    }

    /// Unit normal and area of a flat light.
    fn plane(&self) -> Option<(DVec3, f64)> {
        match self {
            Self::Disk { normal, radius, .. } => Some((*normal, PI * radius * radius)),
            Self::Rect { u, v, .. } => {
                let n = u.cross(*v);
                Some((n.normalize_or_zero(), 4.0 * n.length()))
            }
            _ => None,
        }
    }

    /// Density with which [`LightSource::sample`] at `p` gives a direction that meets the light at `distance`, 1/sr; 0
    /// for lights without extent and on the dark side.
    pub(crate) fn density(&self, p: DVec3, direction: DVec3, distance: f64) -> f64 {
        match self {
            Self::Sphere { center, radius, .. } => {
                let apart = (center - p).length();
                if apart > *radius { 1.0 / (2.0 * PI * cone_versine(apart, *radius)) } else { 0.0 }
            }
            _ => self.plane().map_or(0.0, |(normal, area)| {
                let cosine = -normal.dot(direction);
                if cosine > 0.0 { distance * distance / (area * cosine) } else { 0.0 }
            }),
        }
    }

    /// Where a ray meets the shining side of an area light after distance `t0`.
    pub(crate) fn hit(&self, ray: &Ray, t0: f64) -> Option<f64> {
        let t = match self {
            Self::Sphere { center, radius, .. } => ray.clip_ball(*center, *radius, f64::NEG_INFINITY, f64::INFINITY)?.0,
            Self::Disk { center, .. } | Self::Rect { center, .. } => {
                let (normal, _) = self.plane()?;
                let cosine = normal.dot(ray.direction);
                if cosine >= 0.0 {
                    return None;
                }
                let t = normal.dot(center - ray.origin) / cosine;
                let offset = ray.at(t) - center;
                let covers = match self {
                    Self::Disk { radius, .. } => offset.length() <= *radius,
                    Self::Rect { u, v, .. } => {
                        let n = u.cross(*v);
                        let scale = n.length_squared();
                        let a = offset.cross(*v).dot(n) / scale;
                        let b = u.cross(offset).dot(n) / scale;
                        a.abs() <= 1.0 && b.abs() <= 1.0
                    }
                    _ => false,
                };
                covers.then_some(t)?
            }
            _ => return None,
        };
        (t > t0).then_some(t)
    }

    pub(crate) fn validate(&self, index: usize) -> Result<(), Error> {
        let bad = |attribute, found: String, expected| {
            Err(Error::Invalid { element: "light", index, attribute, found, expected })
        };
        let unit = |d: DVec3| (d.length_squared() - 1.0).abs() < 1e-6;
        let positive = |r: f64| r.is_finite() && r > 0.0;
        if !self.power().iter().all(|v| v.is_finite() && *v >= 0.0) {
            return bad("intensity", format!("{:?}", self.power()), "three finite numbers ≥ 0");
        }
        let fits = match self {
            Self::Point { position, .. } => position.is_finite(),
            Self::Spot { position, direction, inner, outer, .. } => {
                position.is_finite() && unit(*direction) && 0.0 <= *inner && inner <= outer && *outer < PI / 2.0
            }
            Self::Directional { direction, .. } => unit(*direction),
            Self::Sphere { center, radius, .. } => center.is_finite() && positive(*radius),
            Self::Disk { center, normal, radius, .. } => center.is_finite() && unit(*normal) && positive(*radius),
            Self::Rect { center, u, v, .. } => center.is_finite() && positive(u.cross(*v).length()),
        };
        if fits { Ok(()) } else { bad("shape", format!("{self:?}"), "finite places, unit directions, an extent > 0") }
    }

    fn power(&self) -> [f64; 3] {
        match self {
            Self::Spot { intensity, .. } => *intensity,
            _ => self.intensity(DVec3::ZERO),
        }
    }
}

/// 1 − cos of the half angle under which a sphere is seen, without cancellation.
fn cone_versine(apart: f64, radius: f64) -> f64 {
    let sine_sq = (radius / apart) * (radius / apart);
    sine_sq / (1.0 + (1.0 - sine_sq).max(0.0).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::path::random::Stream;

    #[test]
    fn areas_give_the_irradiance_of_their_closed_forms() {
        let radiance = [2.0; 3];
        let p = DVec3::new(0.1, -0.2, 0.3);
        // Facing irradiance in the direction z of a coaxial disk at distance h: π L r²/(r² + h²); of a sphere: π L (r/d)².
        let disk = LightSource::Disk { center: p + DVec3::Z * 2.0, normal: DVec3::NEG_Z, radius: 1.5, radiance };
        let ball = LightSource::Sphere { center: p + DVec3::Z * 2.0, radius: 1.5, radiance };
        let expected = [2.0 * PI * 2.25 / 6.25, 2.0 * PI * 2.25 / 4.0];
        for (light, expected) in [disk, ball].iter().zip(expected) {
            let mut rng = Stream::new(1, 2, 3, 4);
            let n = 20_000;
            let mut mean = 0.0;
            let mut square = 0.0;
            for _ in 0..n {
                let s = light.sample(p, rng.pair()).expect("light");
                let hit = light.hit(&Ray { origin: p, direction: s.direction }, 0.0);
                assert!(hit.is_none_or(|t| (t - s.distance).abs() < 1e-6), "{hit:?} {}", s.distance);
                let e = s.value[0] * s.direction.z;
                mean += e / f64::from(n);
                square += e * e / f64::from(n);
            }
            let error = ((square - mean * mean) / f64::from(n)).sqrt();
            // Two-sided 1e-4.
            assert!((mean - expected).abs() < 3.9 * error, "{mean} ± {error}, exactly {expected}");
        }
    }

    #[test]
    fn areas_are_dark_on_their_back() {
        let rect = LightSource::Rect { center: DVec3::Z, u: DVec3::X, v: DVec3::Y, radiance: [1.0; 3] };
        assert!(rect.sample(DVec3::ZERO, [0.5, 0.5]).is_none());
        assert!(rect.sample(DVec3::Z * 2.0, [0.5, 0.5]).is_some());
        assert!(rect.hit(&Ray { origin: DVec3::ZERO, direction: DVec3::Z }, 0.0).is_none());
        assert_eq!(rect.hit(&Ray { origin: DVec3::Z * 2.0, direction: DVec3::NEG_Z }, 0.0), Some(1.0));
    }
}
