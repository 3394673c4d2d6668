//! Surfaces of meshes: how they reflect, let through and emit light.
//!
//! Reflection: f = ρ_d(1 − τ)/π + ρ_s(m + 2)/2π·⟨r·ω⟩^m on the viewer's side, ρ_d·τ/π on the other (Lambert and the
//! energy-normalised Phong lobe), ρ_d = `diffuse`·colour.

use crate::liberty::Liberty;
use crate::media::phase::{around, cosine_hemisphere};
use crate::path::random::Stream;
use crate::surfaces::dielectric::Dielectric;
use glam::DVec3;
use splat_core::optics::SurfaceOpacity;
use splat_core::{Error, Mesh};
use std::f64::consts::PI;

/// What happens at a crossing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum SurfaceKind {
    /// Nothing passes.
    Opaque,
    /// The share `opacity` meets the surface, the rest goes straight on.
    Translucent {
        /// Opacity of one perpendicular crossing per channel, in \[0, 1\].
        opacity: [f64; 3],
        /// How it grows at grazing angles.
        law: SurfaceOpacity,
    },
    /// A smooth interface to a dielectric; the other properties of the material are not used.
    Dielectric(Dielectric),
}

/// Optical properties of a surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SurfaceMaterial {
    /// What happens at a crossing.
    pub kind: SurfaceKind,
    /// Diffuse reflectance per channel, in \[0, 1\]; multiplied by the vertex colour.
    pub diffuse: [f64; 3],
    /// Share of the diffuse light that leaves on the other side, in \[0, 1\].
    pub transmission: f64,
    /// Specular reflectance, in \[0, 1\].
    pub specular: f64,
    /// Phong exponent, ≥ 0.
    pub shininess: f64,
    /// Emitted radiance per channel on both sides, ≥ 0.
    pub emission: [f64; 3],
    /// Emitted radiance per unit of vertex colour, ≥ 0.
    pub glow: [f64; 3],
    /// Whether vertex normals, where the mesh has them, shade instead of the triangle's.
    pub smooth: bool,
    /// What it does otherwise than nature.
    pub liberty: Liberty,
}

impl Default for SurfaceMaterial {
    /// An opaque Lambertian surface of reflectance ½.
    fn default() -> Self {
        Self {
            kind: SurfaceKind::Opaque,
            diffuse: [0.5; 3],
            transmission: 0.0,
            specular: 0.0,
            shininess: 32.0,
            emission: [0.0; 3],
            glow: [0.0; 3],
            smooth: false,
            liberty: Liberty::default(),
        }
    }
}

/// A mesh with a material.
#[derive(Debug, Clone, Copy)]
pub struct Surface<'a> {
    /// Its shape; vertex colours count when present.
    pub mesh: &'a Mesh,
    /// What it is made of.
    pub material: SurfaceMaterial,
}

/// A surface's response at one point, for one direction of view.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Response {
    /// Shading normal: of a surface on the viewer's side.
    normal: DVec3,
    mirrored: DVec3,
    diffuse: [f64; 3],
    transmission: f64,
    specular: f64,
    shininess: f64,
    /// Probability of sampling the specular lobe.
    lobe: f64,
}

impl SurfaceMaterial {
    /// Opacity per channel of a crossing at `cosine` to the normal.
    pub(crate) fn opacity(&self, cosine: f64) -> [f64; 3] {
        match self.kind {
            SurfaceKind::Translucent { opacity, law: SurfaceOpacity::PerCrossing } => opacity,
            SurfaceKind::Translucent { opacity, law: SurfaceOpacity::ThinSlab } => opacity.map(|a| {
                // 1 − (1 − α)^(1/|cos θ|); at cos θ = 0 any slab is opaque, and an absent one absent.
                if a > 0.0 { -((-a).ln_1p() / cosine.abs()).exp_m1() } else { 0.0 }
            }),
            _ => [1.0; 3],
        }
    }

    /// Emitted radiance where the vertex colour is `color`.
    pub(crate) fn emitted(&self, color: [f64; 3]) -> [f64; 3] {
        std::array::from_fn(|c| self.emission[c] + self.glow[c] * color[c])
    }

    /// Response seen from unit direction `to_eye`; `normal` on either side.
    pub(crate) fn response(&self, color: [f64; 3], normal: DVec3, to_eye: DVec3) -> Response {
        let normal = if normal.dot(to_eye) < 0.0 { -normal } else { normal };
        let diffuse = std::array::from_fn(|c| (self.diffuse[c] * color[c]).clamp(0.0, 1.0));
        Response::new(diffuse, [self.transmission, self.specular, self.shininess], normal, to_eye)
    }

    pub(crate) fn validate(&self, index: usize) -> Result<(), Error> {
        let bad = |attribute, found: String, expected| {
            Err(Error::Invalid { element: "surface", index, attribute, found, expected })
        };
        let unit = |v: &f64| (0.0..=1.0).contains(v);
        if !self.diffuse.iter().chain([&self.transmission, &self.specular]).all(unit) {
            return bad("reflectance", format!("{self:?}"), "diffuse, transmission and specular in [0, 1]");
        }
        if !self.emission.iter().chain(&self.glow).chain([&self.shininess]).all(|e| e.is_finite() && *e >= 0.0) {
            return bad("emission", format!("{self:?}"), "emission, glow and shininess finite and ≥ 0");
        }
        self.liberty.validate("surface", index)?;
        match self.kind {
            SurfaceKind::Translucent { opacity, .. } if !opacity.iter().all(unit) => {
                bad("opacity", format!("{opacity:?}"), "three numbers in [0, 1]")
            }
            SurfaceKind::Dielectric(d)
                if !(d.eta.iter().all(|e| e.is_finite() && *e > 0.0)
                    && d.absorption.iter().all(|a| a.is_finite() && *a >= 0.0)) =>
            {
                bad("dielectric", format!("{d:?}"), "finite indices > 0 and absorption ≥ 0")
            }
            _ => Ok(()),
        }
    }
}

impl Response {
    /// About a unit normal, as it is.
    pub(crate) fn new(diffuse: [f64; 3], optics: [f64; 3], normal: DVec3, to_eye: DVec3) -> Self {
        let [transmission, specular, shininess] = optics;
        let brightest = diffuse.iter().fold(0.0, |m: f64, d| m.max(*d));
        let sum = brightest + specular;
        Self {
            normal,
            mirrored: normal * (2.0 * normal.dot(to_eye)) - to_eye,
            diffuse,
            transmission,
            specular,
            shininess,
            lobe: if sum > 0.0 { specular / sum } else { 0.0 },
        }
    }

    /// BRDF or BTDF times the cosine, towards unit direction `leave`, and the density of sampling it.
    pub(crate) fn toward(&self, leave: DVec3) -> ([f64; 3], f64) {
        let cosine = self.normal.dot(leave);
        let share = if cosine >= 0.0 { 1.0 - self.transmission } else { self.transmission };
        let weight = share * cosine.abs() / PI;
        let mut specular = 0.0;
        let mut density = (1.0 - self.lobe) * weight;
        if self.lobe > 0.0 {
            let lobe = self.mirrored.dot(leave).max(0.0).powf(self.shininess);
            specular = self.specular * (self.shininess + 2.0) / (2.0 * PI) * lobe * cosine.max(0.0);
            density += self.lobe * (self.shininess + 1.0) / (2.0 * PI) * lobe;
        }
        (self.diffuse.map(|d| d * weight + specular), density)
    }

    /// A direction, with the response times cosine over density, and the density; `None` when light is absorbed.
    pub(crate) fn sample(&self, rng: &mut Stream) -> Option<(DVec3, [f64; 3], f64)> {
        let choice = rng.unit();
        let u = rng.pair();
        let leave = if choice < self.lobe {
            let cosine = u[0].powf(1.0 / (self.shininess + 1.0));
            around(self.mirrored.normalize(), cosine, ((1.0 - cosine) * (1.0 + cosine)).sqrt(), u[1])
        } else {
            let across = (choice - self.lobe) < (1.0 - self.lobe) * self.transmission;
            cosine_hemisphere(if across { -self.normal } else { self.normal }, u)
        };
        let (value, density) = self.toward(leave);
        (density > 0.0 && value.iter().any(|v| *v > 0.0)).then(|| (leave, value.map(|v| v / density), density))
    }
}

impl Surface<'_> {
    /// Vertex colour of a hit, white without.
    pub(crate) fn color(&self, triangle: u32, uv: [f64; 2]) -> [f64; 3] {
        if self.mesh.color.is_empty() {
            return [1.0; 3];
        }
        let corners = self.mesh.triangles[triangle as usize].map(|v| self.mesh.color[v as usize]);
        let weights = [1.0 - uv[0] - uv[1], uv[0], uv[1]];
        std::array::from_fn(|c| (0..3).map(|k| weights[k] * f64::from(corners[k][c])).sum())
    }

    /// Normal that shades a hit on the side of `geometric`.
    pub(crate) fn normal(&self, triangle: u32, uv: [f64; 2], geometric: DVec3) -> DVec3 {
        if !self.material.smooth || self.mesh.normal.is_empty() {
            return geometric;
        }
        let [a, b, c] = self.mesh.triangles[triangle as usize].map(|v| self.mesh.normal[v as usize].as_dvec3());
        let n = (a * (1.0 - uv[0] - uv[1]) + b * uv[0] + c * uv[1]).normalize_or_zero();
        if n == DVec3::ZERO { geometric } else { n }
    }
}
