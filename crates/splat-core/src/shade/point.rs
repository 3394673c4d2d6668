//! The radiance of one point by effect, whoever asks: a splat before it is composited, a particle that is seen.
//!
//! Surfaces: L = ρ/π·E·⟨n·l⟩ + ρ_s·(m + 2)/2π·⟨r·v⟩^m·E·⟨n·l⟩ (energy-normalised Phong), the normal turned to the viewer;
//! a thin translucent surface passes the share `transmission` of the diffuse light to its other side.
//! Media: L = ω·c·p(θ)·E, single scattering, or the surface form when they have a normal and ask for Phong.
//! E is the irradiance of a light times its transmittance; ambient radiance adds ρ·L_ambient.

use super::{ChannelLayout, LitBy};
use crate::optics::TRACE;
use crate::{Incidence, Material, Reflection, SHADED_EFFECTS, Shading, SplatKind, henyey_greenstein};
use glam::{DVec3, Vec3};

/// One point being shaded.
#[derive(Debug, Clone, Copy)]
pub struct Point<'a> {
    /// World position.
    pub position: DVec3,
    /// Radius of the splat that it stands for, world units, ≥ 0: near a light it receives 1/(d² + σ²), σ a third of it.
    pub radius: f32,
    /// Unit normal as [`facing`] turns it, or zero.
    pub normal: Vec3,
    /// Unit direction to the viewer, or zero at the eye itself.
    pub to_eye: Vec3,
    /// Linear Rec.709.
    pub color: [f32; 3],
    /// How light becomes radiance.
    pub material: &'a Material,
}

/// Radiance by effect, linear Rec.709, and the mean transmittance of the shadows.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Radiance {
    /// Ambient radiance that is reflected or scattered.
    pub ambient: [f32; 3],
    /// What the material gives off.
    pub emission: [f32; 3],
    /// Light of lights that is reflected about the normal.
    pub direct: [f32; 3],
    /// Light of lights that is scattered once, by the phase function.
    pub scatter1: [f32; 3],
    /// Share of green light that shadows let through, in \[0, 1\]; 1 where no light arrives.
    pub shadow: f32,
}

/// The normal that light is reflected about: a surface shows its viewer the side that faces him, by the normal `face` that it
/// lies across; the gradient of a medium has one outside.
#[inline]
pub fn facing(kind: SplatKind, face: Vec3, shading: Vec3, to_eye: Vec3) -> Vec3 {
    if kind != SplatKind::Medium && face.dot(to_eye) < 0.0 { -shading } else { shading }
}

/// Share of a light that arrives at a point that takes the share `coefficient`, in \[0, 1\], of its shadow, which is not asked
/// where there is nothing to attenuate.
#[inline(always)]
pub fn arriving(irradiance: [f32; 3], coefficient: f32, shadow: Option<impl FnOnce() -> [f32; 3]>) -> [f32; 3] {
    match shadow {
        Some(shadow) if is_attenuated(irradiance, coefficient) => passing(shadow(), coefficient),
        _ => [1.0; 3],
    }
}

/// Whether there is something to attenuate.
#[inline(always)]
pub(super) fn is_attenuated(irradiance: [f32; 3], coefficient: f32) -> bool {
    coefficient > 0.0 && irradiance != [0.0; 3]
}

/// Share of a light that arrives through a shadow of this transmittance, of which a point takes the share `coefficient`.
#[inline(always)]
pub(super) fn passing(transmittance: [f32; 3], coefficient: f32) -> [f32; 3] {
    transmittance.map(|t| 1.0 - coefficient * (1.0 - t))
}

impl Point<'_> {
    /// Direction to a light, and its irradiance here without shadow.
    #[inline]
    pub fn irradiance(&self, lit: &LitBy<'_>) -> Incidence<Vec3> {
        // σ = R/3 at the default cutoff.
        let Incidence { to_light, irradiance } = lit.irradiance(self.position, f64::from(self.radius) / 3.0);
        Incidence { to_light: to_light.as_vec3(), irradiance }
    }

    /// Radiance towards the viewer under `lights` and the same ambient radiance from everywhere; `transmittance` gives the
    /// share that arrives of the light of this rank and irradiance.
    #[inline]
    pub fn radiance<'l, 'a: 'l>(
        &self,
        ambient: [f32; 3],
        lights: impl Iterator<Item = &'l LitBy<'a>>,
        transmittance: impl Fn(usize, [f32; 3]) -> [f32; 3],
    ) -> Radiance {
        let m = self.material;
        let by_phase = m.shading == Shading::Phase || self.normal == Vec3::ZERO;
        let incoming = lights.map(|lit| {
            let Incidence { to_light, irradiance } = self.irradiance(lit);
            let Reflection { diffuse, specular } = if by_phase {
                Reflection { diffuse: self.scatter(to_light), specular: 0.0 }
            } else {
                m.reflect(self.normal, to_light, self.to_eye)
            };
            Incoming { irradiance, diffuse, specular }
        });
        Radiance::new(m, self.color, by_phase, ambient, incoming, transmittance)
    }

    /// Single scattering per unit irradiance: the factor on the colour.
    #[inline]
    fn scatter(&self, to_light: Vec3) -> f32 {
        // Light travels along −to_light and leaves along to_eye.
        let phase = henyey_greenstein(-to_light, self.to_eye, self.material.asymmetry);
        self.material.single_scattering_albedo * phase
    }
}

/// Light as it comes to a point.
pub(super) struct Incoming {
    /// Irradiance without shadow.
    pub(super) irradiance: [f32; 3],
    /// How much of it leaves to the viewer: as a factor on the colour, and beside that.
    pub(super) diffuse: f32,
    pub(super) specular: f32,
}

impl Radiance {
    /// Of a colour and a material that scatter or reflect what comes to them; `transmittance` is asked as by [`Point::radiance`].
    #[inline]
    pub(super) fn new(
        m: &Material,
        color: [f32; 3],
        by_phase: bool,
        ambient: [f32; 3],
        lights: impl Iterator<Item = Incoming>,
        transmittance: impl Fn(usize, [f32; 3]) -> [f32; 3],
    ) -> Self {
        let dark = [0.0; 3];
        let mut out = Self { ambient: dark, emission: m.emission, direct: dark, scatter1: dark, shadow: 1.0 };
        if m.shading == Shading::Unlit {
            (0..3).for_each(|c| out.emission[c] += color[c]);
            return out;
        }
        let reflectance = if by_phase { m.single_scattering_albedo } else { m.diffuse };
        out.ambient = std::array::from_fn(|c| ambient[c] * color[c] * reflectance * m.ambient);
        let mut lit = dark;
        let mut received = 0.0;
        let mut unshadowed = 0.0;
        for (rank, Incoming { irradiance, diffuse, specular }) in lights.enumerate() {
            let transmittance = transmittance(rank, irradiance);
            for c in 0..3 {
                lit[c] += irradiance[c] * transmittance[c] * (color[c] * diffuse + specular);
            }
            received += irradiance[1] * transmittance[1];
            unshadowed += irradiance[1];
        }
        if unshadowed > 0.0 {
            out.shadow = received / unshadowed;
        }
        *(if by_phase { &mut out.scatter1 } else { &mut out.direct }) = lit;
        out
    }

    /// Each of [`SHADED_EFFECTS`].
    #[inline]
    pub fn effects(&self) -> [[f32; 3]; SHADED_EFFECTS.len()] {
        [self.ambient, self.emission, self.direct, self.scatter1]
    }

    /// Writes the channels of `layout`, with the normal that the point has; 0 for what is scattered more than once, and for a [`TRACE`].
    ///
    /// # Panics
    /// If `out` has fewer numbers than the layout.
    #[inline(always)]
    pub fn write(&self, normal: Vec3, layout: &ChannelLayout, out: &mut [f32]) {
        let effects = self.effects();
        if layout.is_apart() {
            out[3 * effects.len()..layout.colors()].fill(0.0);
            out[..3 * effects.len()].copy_from_slice(effects.as_flattened());
        } else {
            let [first, others @ ..] = effects;
            // One of `direct` and `scatter1` is 0: beauty has the same bits as if they were one.
            out[..3].copy_from_slice(&others.iter().fold(first, |sum, e| [0, 1, 2].map(|c| sum[c] + e[c])));
        }
        out[..layout.colors()].iter_mut().filter(|v| v.abs() <= TRACE).for_each(|v| *v = 0.0);
        if let Some(at) = layout.normal() {
            out[at..at + 3].copy_from_slice(&normal.to_array());
        }
        if let Some(at) = layout.shadow() {
            out[at] = self.shadow;
        }
    }
}
