//! Radiance of the particles that are seen: that of splats, [`splat_core::shade::Point`], at their own places.
//!
//! Near a light a particle receives what the splats of its object receive: 1/(d² + σ²), σ a third of their radius.

use crate::EnsembleParams;
use glam::{DVec3, Vec3};
use splat_core::shade::{LitBy, MAX_CHANNELS, Point, arriving, facing};
use splat_core::{Camera, Material, Receiver, SplatKind, glam};

/// The appearance of an object's particles.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Appearance {
    /// The material, which turns light into radiance.
    pub material: Material,
    /// What casts and receives shadows: a medium attenuates its own light, a surface does not.
    pub kind: SplatKind,
    /// Radius of the object's splats, world units, in the shadow map and near lights; 0 for bare points.
    pub radius: f32,
    /// Share of the shadow that is received, in \[0, 1\].
    pub shadow_coefficient: f32,
    /// A power of two by which the stored colours of its particles are multiplied, for colours outside of 2⁻²⁴ to 65408.
    pub color_unit: f32,
}

impl Default for Appearance {
    fn default() -> Self {
        Self {
            material: Material::default(),
            kind: SplatKind::Surface,
            radius: 0.0,
            shadow_coefficient: 1.0,
            color_unit: 1.0,
        }
    }
}

/// Lights and viewer.
pub(crate) struct Shader<'a> {
    pub(crate) lights: &'a [LitBy<'a>],
    /// World position that receivers are relative to.
    pub(crate) shadow_origin: DVec3,
    pub(crate) ambient: [f32; 3],
    pub(crate) camera: &'a Camera,
    pub(crate) channels: EnsembleParams,
}

/// One particle that is seen.
pub(crate) struct Seen<'a> {
    pub(crate) look: &'a Appearance,
    /// World position relative to the eye.
    pub(crate) from_eye: DVec3,
    /// World normal, or zero.
    pub(crate) normal: Vec3,
    pub(crate) color: [f32; 3],
}

impl Shader<'_> {
    /// Writes the channels of one hit.
    #[inline]
    pub(crate) fn shade(&self, seen: &Seen<'_>, out: &mut [f32; MAX_CHANNELS]) {
        let look = seen.look;
        let to_eye = if self.camera.is_orthographic() {
            -self.camera.axes[2].as_vec3()
        } else {
            -seen.from_eye.as_vec3().normalize_or_zero()
        };
        let point = Point {
            position: self.camera.position + seen.from_eye,
            radius: look.radius,
            normal: facing(look.kind, seen.normal, seen.normal, to_eye),
            to_eye,
            color: seen.color,
            material: &look.material,
        };
        let radiance = point.radiance(self.ambient, self.lights.iter(), |rank, irradiance| {
            let shadow = self.lights[rank].shadow.map(|map| {
                move || {
                    let position = (point.position - self.shadow_origin).as_vec3();
                    map.transmittance(&Receiver { position, normal: seen.normal, radius: look.radius, kind: look.kind })
                }
            });
            arriving(irradiance, look.shadow_coefficient, shadow)
        });
        radiance.write(point.normal, &self.channels.layout(), out);
    }
}
