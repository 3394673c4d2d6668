//! Attribute-driven shading: one radiance per splat from its attributes and the lookup tables (Gunjee 2007, section 4.3,
//! Figure 11), before rasterization.
//!
//! Surfaces: L = ρ/π·E·⟨n·l⟩ + ρ_s·(m + 2)/2π·⟨r·v⟩^m·E·⟨n·l⟩ (energy-normalised Phong), the normal turned to the viewer;
//! a thin translucent surface passes the share `transmission` of the diffuse light to its other side.
//! Media: L = ω·c·p(θ)·E, single scattering, or the surface form when they have a normal and ask for Phong.
//! E is the irradiance of a light times its transmittance; ambient radiance adds ρ·L_ambient.

#[cfg(feature = "gpu")]
pub mod gpu;

use crate::raster::Projected;
use crate::{
    Camera, Cloud, LayerSet, Light, Material, Object, Progress, Receiver, Shading, SplatKind, Transmittance,
    henyey_greenstein,
};
use glam::{DVec3, Vec3};
use rayon::prelude::*;

/// The most channels that a splat can have: three effects, the normal and the shadow.
pub const MAX_CHANNELS: usize = 13;

/// Splats shaded by one task.
const CHUNK: usize = 4096;

/// Which numbers each splat carries through compositing, and where.
///
/// First the effects: one beauty colour, or ambient, emission and direct apart. Then the normal, then the shadow.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct ChannelLayout {
    effects: bool,
    normal: bool,
    shadow: bool,
}

impl ChannelLayout {
    /// The channels that `layers` need.
    pub fn new(layers: &LayerSet) -> Self {
        Self { effects: layers.effects, normal: layers.normal, shadow: layers.shadow }
    }

    /// Numbers a splat.
    pub fn count(&self) -> usize {
        (if self.effects { 9 } else { 3 }) + 3 * usize::from(self.normal) + usize::from(self.shadow)
    }

    /// How many of `count` channels in all are red, green and blue, in threes. The others, normal and shadow, are no colours:
    /// where extinction differs by channel they take one weight, green's.
    pub(crate) const fn colors_of(count: usize) -> usize {
        match count {
            0..3 => 0,
            3..9 => 3,
            _ => 9,
        }
    }

    /// The plane of optical depth, of 1 or 3, that hides channel `channel` of `count`.
    #[inline(always)]
    pub const fn plane_of(channel: usize, count: usize, planes: usize) -> usize {
        if planes == 3 && channel < Self::colors_of(count) { channel % 3 } else { planes / 2 }
    }

    /// First channel of each effect colour: ambient, emission, direct; or of beauty alone.
    pub fn effects(&self) -> impl Iterator<Item = usize> + use<> {
        (0..if self.effects { 3 } else { 1 }).map(|e| 3 * e)
    }

    /// First channel of the normal.
    pub fn normal(&self) -> Option<usize> {
        self.normal.then_some(if self.effects { 9 } else { 3 })
    }

    /// Channel of the shadow.
    pub fn shadow(&self) -> Option<usize> {
        self.shadow.then(|| self.count() - 1)
    }
}

/// A light with its shadow map, if it has one.
pub struct LitBy<'a> {
    /// The light.
    pub light: Light,
    /// Its transmittance to any point; `None` when nothing casts or receives its shadow.
    pub shadow: Option<&'a dyn Transmittance>,
}

/// What shading reads beside the splats.
pub struct ShadeInput<'a> {
    /// The splats.
    pub cloud: &'a Cloud,
    /// Materials by id.
    pub materials: &'a [Material],
    /// Objects by id.
    pub objects: &'a [Object],
    /// Lights with their shadows.
    pub lights: &'a [LitBy<'a>],
    /// Ambient radiance, the same from everywhere.
    pub ambient: [f32; 3],
    /// The viewer, for specular reflection and the phase function.
    pub camera: &'a Camera,
}

/// Values of all splats that `projected` shows, `layout.count()` numbers each, by id; 0 for the others. After
/// `progress.cancel()` the rest stays 0.
///
/// # Panics
/// If a material or object of the cloud is out of range, or `projected` is of another cloud.
pub fn shade(input: &ShadeInput<'_>, projected: &Projected, layout: &ChannelLayout, progress: &Progress) -> Vec<f32> {
    assert_eq!(projected.splats.len(), input.cloud.len(), "invariant: one footprint a splat");
    let channels = layout.count();
    let eye = (input.camera.position - input.cloud.origin).as_vec3();
    let lights: Vec<LocalLight<'_>> = input.lights.iter().map(|l| LocalLight::new(l, input.cloud.origin)).collect();
    let mut values = vec![0.0; input.cloud.len() * channels];
    progress.add_total(input.cloud.len().div_ceil(CHUNK) as u64);
    values.par_chunks_mut(CHUNK * channels).enumerate().for_each(|(chunk, values)| {
        if progress.tick(1).is_err() {
            return;
        }
        for (k, out) in values.chunks_exact_mut(channels).enumerate() {
            let i = chunk * CHUNK + k;
            if projected.is_visible(i) {
                let point = Point::new(input, i, eye);
                point.shade(input, &lights).write(out, layout, point.normal);
            }
        }
    });
    values
}

/// A light relative to the cloud's origin.
struct LocalLight<'a> {
    light: Light,
    origin: DVec3,
    shadow: Option<&'a dyn Transmittance>,
}

impl<'a> LocalLight<'a> {
    fn new(lit: &LitBy<'a>, origin: DVec3) -> Self {
        Self { light: lit.light, origin, shadow: lit.shadow }
    }

    fn irradiance(&self, receiver: &Receiver) -> (Vec3, [f32; 3]) {
        let position = self.origin + receiver.position.as_dvec3();
        // σ = R/3 at the default cutoff.
        let (to_light, irradiance) = self.light.irradiance(position, f64::from(receiver.radius) / 3.0);
        (to_light.as_vec3(), irradiance)
    }
}

/// One splat being shaded.
struct Point {
    /// Its place in the cloud.
    splat: usize,
    receiver: Receiver,
    normal: Vec3,
    to_eye: Vec3,
    color: [f32; 3],
    material: Material,
    shadow_coefficient: f32,
}

/// Radiance by effect, and the mean transmittance of the shadows.
struct Shaded {
    ambient: [f32; 3],
    emission: [f32; 3],
    direct: [f32; 3],
    shadow: f32,
}

/// How much of a shadow splat `i` takes.
fn shadow_share(input: &ShadeInput<'_>, i: usize) -> f32 {
    input.cloud.shadow_coefficient_of(i) * input.objects[input.cloud.object[i] as usize].shadow_coefficient
}

impl Point {
    fn new(input: &ShadeInput<'_>, i: usize, eye: Vec3) -> Self {
        let cloud = input.cloud;
        let position = cloud.position[i];
        let to_eye = if input.camera.is_orthographic() {
            -input.camera.axes[2].as_vec3()
        } else {
            (eye - position).normalize_or_zero()
        };
        let own = cloud.normal_of(i);
        let kind = cloud.kind[i];
        // A surface shows its viewer the side that faces him; the gradient of a medium has one outside.
        let (facing, shading) = (own.dot(to_eye), cloud.shading_normal_of(i));
        let normal = if kind != SplatKind::Medium && facing < 0.0 { -shading } else { shading };
        Self {
            splat: i,
            receiver: Receiver { position, normal: own, radius: cloud.radius[i], kind },
            normal,
            to_eye,
            color: cloud.color[i],
            material: input.materials[cloud.material[i] as usize],
            shadow_coefficient: shadow_share(input, i),
        }
    }

    fn shade(&self, input: &ShadeInput<'_>, lights: &[LocalLight<'_>]) -> Shaded {
        let m = &self.material;
        let mut out = Shaded { ambient: [0.0; 3], emission: m.emission, direct: [0.0; 3], shadow: 1.0 };
        if m.shading == Shading::Unlit {
            (0..3).for_each(|c| out.emission[c] += self.color[c]);
            return out;
        }
        let by_phase = m.shading == Shading::Phase || self.normal == Vec3::ZERO;
        let reflectance = if by_phase { m.single_scattering_albedo } else { m.diffuse };
        for c in 0..3 {
            out.ambient[c] = input.ambient[c] * self.color[c] * reflectance * m.ambient;
        }
        let (mut received, mut arriving) = (0.0, 0.0);
        for light in lights {
            let (to_light, irradiance) = light.irradiance(&self.receiver);
            let (diffuse, specular) =
                if by_phase { (self.scatter(to_light), 0.0) } else { m.reflect(self.normal, to_light, self.to_eye) };
            let transmittance = self.transmittance(light, irradiance);
            for c in 0..3 {
                out.direct[c] += irradiance[c] * transmittance[c] * (self.color[c] * diffuse + specular);
            }
            received += irradiance[1] * transmittance[1];
            arriving += irradiance[1];
        }
        if arriving > 0.0 {
            out.shadow = received / arriving;
        }
        out
    }

    /// Share of a light that this splat receives.
    fn transmittance(&self, light: &LocalLight<'_>, irradiance: [f32; 3]) -> [f32; 3] {
        match light.shadow {
            // Nothing to attenuate: the map is not asked.
            Some(shadow) if self.shadow_coefficient > 0.0 && irradiance != [0.0; 3] => {
                shadow.at_splat(self.splat, &self.receiver).map(|t| 1.0 - self.shadow_coefficient * (1.0 - t))
            }
            _ => [1.0; 3],
        }
    }

    /// Single scattering per unit irradiance: the factor on the colour.
    fn scatter(&self, to_light: Vec3) -> f32 {
        // Light travels along −to_light and leaves along to_eye.
        let phase = henyey_greenstein(-to_light, self.to_eye, self.material.asymmetry);
        self.material.single_scattering_albedo * phase
    }
}

impl Shaded {
    fn write(&self, out: &mut [f32], layout: &ChannelLayout, normal: Vec3) {
        if layout.effects {
            out[0..3].copy_from_slice(&self.ambient);
            out[3..6].copy_from_slice(&self.emission);
            out[6..9].copy_from_slice(&self.direct);
        } else {
            for c in 0..3 {
                out[c] = self.ambient[c] + self.emission[c] + self.direct[c];
            }
        }
        if let Some(at) = layout.normal() {
            out[at..at + 3].copy_from_slice(&normal.to_array());
        }
        if let Some(at) = layout.shadow() {
            out[at] = self.shadow;
        }
    }
}
