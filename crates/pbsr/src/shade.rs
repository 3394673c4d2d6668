//! Radiance of the particles that are seen, by the same formulas as splats have (`splat_core::shade`).
//!
//! Surfaces: L = ρ/π·E·⟨n·l⟩ + ρ_s·(m + 2)/2π·⟨r·v⟩^m·E·⟨n·l⟩, the normal turned to the viewer; the share `transmission` of
//! the diffuse light passes to the other side. Media: L = ω·c·p(θ)·E. Ambient radiance adds ρ·L_ambient.
//!
//! Near a light a particle receives what the splats of its object receive: 1/(d² + σ²), σ a third of their radius.

use crate::EnsembleParams;
use glam::{DVec3, Vec3};
use splat_core::{Camera, Light, Material, Receiver, Shading, SplatKind, Transmittance, glam, henyey_greenstein};

/// The most numbers that a hit brings.
pub(crate) const MAX_CHANNELS: usize = 13;

/// A light with its shadow map, if it has one.
#[derive(Clone, Copy)]
pub struct LitBy<'a> {
    /// The light.
    pub light: Light,
    /// Its transmittance to any point, and the world position that the map's receivers are relative to.
    pub shadow: Option<(&'a dyn Transmittance, DVec3)>,
}

/// How the particles of an object look.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Appearance {
    /// How light becomes radiance.
    pub material: Material,
    /// What casts and receives shadows: a medium attenuates its own light, a surface does not.
    pub kind: SplatKind,
    /// Radius of the object's splats, world units, in the shadow map and near lights; 0 for bare points.
    pub radius: f32,
    /// Share of the shadow that is received, in \[0, 1\].
    pub shadow_coefficient: f32,
}

impl Default for Appearance {
    fn default() -> Self {
        Self { material: Material::default(), kind: SplatKind::Surface, radius: 0.0, shadow_coefficient: 1.0 }
    }
}

/// Lights and viewer.
pub(crate) struct Shader<'a> {
    pub(crate) lights: &'a [LitBy<'a>],
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
        let m = &seen.look.material;
        let (mut ambient, mut emission, mut direct) = ([0.0; 3], m.emission, [0.0; 3]);
        let mut shadow = 1.0;
        let to_eye = if self.camera.is_orthographic() {
            -self.camera.axes[2].as_vec3()
        } else {
            -seen.from_eye.as_vec3().normalize_or_zero()
        };
        let turned = seen.look.kind != SplatKind::Medium && seen.normal.dot(to_eye) < 0.0;
        let normal = if turned { -seen.normal } else { seen.normal };
        if m.shading == Shading::Unlit {
            (0..3).for_each(|c| emission[c] += seen.color[c]);
        } else {
            let by_phase = m.shading == Shading::Phase || normal == Vec3::ZERO;
            let reflectance = if by_phase { m.single_scattering_albedo } else { m.diffuse };
            ambient = std::array::from_fn(|c| self.ambient[c] * seen.color[c] * reflectance * m.ambient);
            (direct, shadow) = self.direct(seen, normal, to_eye, by_phase);
        }
        let light = self.channels.light_channels();
        if self.channels.effects {
            out[..3].copy_from_slice(&ambient);
            out[3..6].copy_from_slice(&emission);
            out[6..9].copy_from_slice(&direct);
        } else {
            (0..3).for_each(|c| out[c] = ambient[c] + emission[c] + direct[c]);
        }
        if self.channels.normal {
            out[light..light + 3].copy_from_slice(&normal.to_array());
        }
        if self.channels.shadow {
            out[self.channels.channels() - 1] = shadow;
        }
    }

    /// Direct light, and the mean transmittance of the shadows.
    fn direct(&self, seen: &Seen<'_>, normal: Vec3, to_eye: Vec3, by_phase: bool) -> ([f32; 3], f32) {
        let m = &seen.look.material;
        let mut direct = [0.0; 3];
        let (mut received, mut arriving) = (0.0, 0.0);
        let position = self.camera.position + seen.from_eye;
        for lit in self.lights {
            let (to_light, irradiance) = lit.light.irradiance(position, f64::from(seen.look.radius) / 3.0);
            let to_light = to_light.as_vec3();
            let (diffuse, specular) = if by_phase {
                let phase = henyey_greenstein(-to_light, to_eye, m.asymmetry);
                (m.single_scattering_albedo * phase, 0.0)
            } else {
                m.reflect(normal, to_light, to_eye)
            };
            let share = seen.look.shadow_coefficient;
            let transmittance = match lit.shadow {
                Some((map, origin)) if share > 0.0 && irradiance != [0.0; 3] => {
                    let receiver = Receiver {
                        position: (position - origin).as_vec3(),
                        normal: seen.normal,
                        radius: seen.look.radius,
                        kind: seen.look.kind,
                    };
                    map.transmittance(&receiver).map(|t| 1.0 - share * (1.0 - t))
                }
                _ => [1.0; 3],
            };
            for c in 0..3 {
                direct[c] += irradiance[c] * transmittance[c] * (seen.color[c] * diffuse + specular);
            }
            received += irradiance[1] * transmittance[1];
            arriving += irradiance[1];
        }
        (direct, if arriving > 0.0 { received / arriving } else { 1.0 })
    }
}
