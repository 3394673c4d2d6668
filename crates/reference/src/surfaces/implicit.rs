//! Ordered compositing of surfaces along exact rays: implicit surfaces by proven roots, meshes by exact visibility.
//!
//! Every crossing of a pixel's central ray is found, sorted by distance (ties by surface), shaded, and composited front to
//! back: C = Σ T·α·L, T ← T(1 − α), with α of one crossing or of a thin slab (1 − (1 − α)^(1/|cos θ|)). Lights without
//! extent reach a crossing through the opacities in between.

use crate::lights::LightSource;
use crate::ray::Ray;
use crate::surfaces::roots::{RootParams, crossings};
use crate::surfaces::surface::{Surface, SurfaceKind, SurfaceMaterial};
use crate::surfaces::visibility::{Hit, Visibility};
use glam::DVec3;
use rayon::prelude::*;
use splat_core::{Camera, DAabb, Error, Progress, ScalarField};

/// The zero set of a field inside a box.
#[derive(Clone, Copy)]
pub struct ImplicitSurface<'a> {
    /// The field.
    pub field: &'a dyn ScalarField,
    /// Nothing outside.
    pub bounds: DAabb,
    /// Colour, linear Rec.709.
    pub color: [f64; 3],
    /// What it is made of; a dielectric counts as opaque.
    pub material: SurfaceMaterial,
}

/// Surfaces and lights for [`composite_surfaces`].
#[derive(Clone, Default)]
pub struct SurfaceScene<'a> {
    /// Implicit surfaces.
    pub implicits: Vec<ImplicitSurface<'a>>,
    /// Meshes.
    pub meshes: Vec<Surface<'a>>,
    /// Points, spots and parallel light.
    pub lights: Vec<LightSource>,
    /// Whether surfaces shadow each other.
    pub shadows: bool,
    /// How finely roots are told apart.
    pub roots: RootParams,
}

/// An exactly ordered image, row by row from the top left.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct SurfaceImage {
    /// Width and height, pixels.
    pub size: [u32; 2],
    /// Radiance, nothing from the background.
    pub radiance: Vec<[f64; 3]>,
    /// Transmittance to the background.
    pub transmittance: Vec<[f64; 3]>,
    /// Crossings per pixel.
    pub crossings: Vec<u32>,
    /// Stretches of eye rays on which roots are neither proven nor excluded: tangent contacts above all.
    pub unresolved: u64,
    /// Whether every field knew its bounds.
    pub proven: bool,
}

/// One crossing, not yet shaded.
struct Crossing {
    t: f64,
    /// Implicit surfaces first, then meshes.
    surface: usize,
    hit: Option<Hit>,
}

/// Renders surfaces through the centres of pixels. Rows of pixels are reported to `progress`, and work stops where that is
/// cancelled.
///
/// # Errors
/// [`Error::Invalid`] for a material, mesh or light that does not hold, an area light, or bounds that are not finite;
/// [`Error::Cancelled`].
pub fn composite_surfaces(
    scene: &SurfaceScene<'_>,
    camera: &Camera,
    progress: Option<&Progress>,
) -> Result<SurfaceImage, Error> {
    let quiet = Progress::new();
    let progress = progress.unwrap_or(&quiet);
    let renderer = Renderer::new(scene)?;
    let [width, height] = camera.size;
    progress.add_total(u64::from(height));
    let rows: Result<Vec<Vec<Pixel>>, Error> = (0..height)
        .into_par_iter()
        .map(|y| {
            progress.tick(1)?;
            let mut found = Found::default();
            let ray = |x: u32| Ray::of_pixel(camera, f64::from(x) + 0.5, f64::from(y) + 0.5);
            Ok((0..width).map(|x| renderer.pixel(&ray(x), &mut found)).collect())
        })
        .collect();
    let mut image = SurfaceImage { size: camera.size, proven: true, ..SurfaceImage::default() };
    for p in rows?.into_iter().flatten() {
        image.radiance.push(p.radiance);
        image.transmittance.push(p.transmittance);
        image.crossings.push(p.crossings);
        image.unresolved += u64::from(p.unresolved);
        image.proven &= p.proven;
    }
    Ok(image)
}

struct Pixel {
    radiance: [f64; 3],
    transmittance: [f64; 3],
    crossings: u32,
    unresolved: u32,
    proven: bool,
}

/// All crossings of a ray.
#[derive(Default)]
struct Found {
    crossings: Vec<Crossing>,
    hits: Vec<Hit>,
    unresolved: u32,
    proven: bool,
}

struct Renderer<'a> {
    scene: &'a SurfaceScene<'a>,
    visibility: Visibility,
}

impl<'a> Renderer<'a> {
    fn new(scene: &'a SurfaceScene<'a>) -> Result<Self, Error> {
        for (i, s) in scene.implicits.iter().enumerate() {
            s.material.validate(i)?;
            s.material.liberty.refuse("surface", i)?;
            let ordered = s.bounds.is_solid();
            if !ordered || !s.color.iter().all(|c| c.is_finite() && *c >= 0.0) {
                let found = (s.bounds, s.color);
                return Err(Error::invalid(
                    "surface",
                    i,
                    "bounds, color",
                    found,
                    "finite corners in order, colours ≥ 0",
                ));
            }
        }
        for (i, s) in scene.meshes.iter().enumerate() {
            s.material.validate(scene.implicits.len() + i)?;
            s.material.liberty.refuse("surface", scene.implicits.len() + i)?;
        }
        for (i, light) in scene.lights.iter().enumerate() {
            light.validate(i)?;
            if light.is_area() {
                return Err(Error::invalid("light", i, "shape", light, "a point, spot or parallel light"));
            }
        }
        let meshes: Vec<_> = scene.meshes.iter().map(|s| s.mesh).collect();
        Ok(Self { scene, visibility: Visibility::new(&meshes)? })
    }

    fn find(&self, ray: &Ray, t1: f64, found: &mut Found) {
        found.crossings.clear();
        (found.unresolved, found.proven) = (0, true);
        for (surface, implicit) in self.scene.implicits.iter().enumerate() {
            let Some((a, b)) = ray.clip(&implicit.bounds, 0.0, t1) else { continue };
            let crossed = crossings(implicit.field, ray, a, b, &self.scene.roots);
            found.unresolved += crossed.unresolved;
            found.proven &= crossed.proven;
            found.crossings.extend(crossed.roots.into_iter().map(|t| Crossing { t, surface, hit: None }));
        }
        self.visibility.hits(ray, t1, &mut found.hits);
        let first = self.scene.implicits.len();
        let of_mesh = |h: &Hit| Crossing { t: h.t, surface: first + h.mesh as usize, hit: Some(*h) };
        found.crossings.extend(found.hits.iter().map(of_mesh));
        found.crossings.sort_by(|a, b| a.t.total_cmp(&b.t).then(a.surface.cmp(&b.surface)));
    }

    fn material(&self, surface: usize) -> &SurfaceMaterial {
        match self.scene.implicits.get(surface) {
            Some(implicit) => &implicit.material,
            None => &self.scene.meshes[surface - self.scene.implicits.len()].material,
        }
    }

    /// Geometric normal, shading normal and colour of a crossing.
    fn point(&self, ray: &Ray, c: &Crossing) -> (DVec3, DVec3, [f64; 3]) {
        match &c.hit {
            Some(hit) => {
                let mesh = &self.scene.meshes[hit.mesh as usize];
                let geometric = self.visibility.normal(hit.id);
                (geometric, mesh.normal(hit.triangle, hit.uv, geometric), mesh.color(hit.triangle, hit.uv))
            }
            None => {
                let implicit = &self.scene.implicits[c.surface];
                let normal = implicit.field.gradient(ray.at(c.t)).normalize_or_zero();
                (normal, normal, implicit.color)
            }
        }
    }

    fn opacity(&self, ray: &Ray, c: &Crossing) -> [f64; 3] {
        let material = self.material(c.surface);
        if matches!(material.kind, SurfaceKind::Translucent { .. }) {
            material.opacity(self.point(ray, c).0.dot(ray.direction))
        } else {
            [1.0; 3]
        }
    }

    fn pixel(&self, ray: &Ray, found: &mut Found) -> Pixel {
        self.find(ray, f64::INFINITY, found);
        let mut radiance = [0.0; 3];
        let mut left = [1.0; 3];
        let mut shadow = Found::default();
        for crossing in &found.crossings {
            let opacity = self.opacity(ray, crossing);
            let seen = self.shade(ray, crossing, &mut shadow);
            for c in 0..3 {
                radiance[c] += left[c] * opacity[c] * seen[c];
                left[c] *= 1.0 - opacity[c];
            }
            if left == [0.0; 3] {
                break;
            }
        }
        let unresolved = found.unresolved;
        let proven = found.proven;
        Pixel { radiance, transmittance: left, crossings: found.crossings.len() as u32, unresolved, proven }
    }

    /// Radiance that a crossing sends back along the ray.
    fn shade(&self, ray: &Ray, crossing: &Crossing, scratch: &mut Found) -> [f64; 3] {
        let material = self.material(crossing.surface);
        let (_, normal, color) = self.point(ray, crossing);
        let mut sum = material.emitted(color);
        let response = material.response(color, normal, -ray.direction);
        let at = ray.at(crossing.t);
        for light in &self.scene.lights {
            let Some(s) = light.sample(at, [0.5; 2]) else { continue };
            let (share, _) = response.toward(s.direction);
            if share == [0.0; 3] {
                continue;
            }
            let arrives =
                if self.scene.shadows { self.shadow(at, s.direction, s.distance, crossing, scratch) } else { [1.0; 3] };
            (0..3).for_each(|c| sum[c] += share[c] * s.value[c] * arrives[c]);
        }
        sum
    }

    /// Transmittance from a crossing towards a light.
    fn shadow(&self, at: DVec3, direction: DVec3, distance: f64, from: &Crossing, found: &mut Found) -> [f64; 3] {
        let ray = Ray { origin: at, direction };
        self.find(&ray, distance, found);
        let mut left = [1.0; 3];
        for crossing in &found.crossings {
            let is_same = match (&from.hit, &crossing.hit) {
                (Some(a), Some(b)) => a.id == b.id,
                // The root itself, found again to its rounding.
                (None, None) => from.surface == crossing.surface && crossing.t <= self.rounding(at, from.surface),
                _ => false,
            };
            if !is_same {
                let opacity = self.opacity(&ray, crossing);
                (0..3).for_each(|c| left[c] *= 1.0 - opacity[c]);
            }
        }
        left
    }

    /// How far a refined root may lie from the surface: roundings of its coordinates and of the extent of its bounds.
    fn rounding(&self, at: DVec3, surface: usize) -> f64 {
        let bounds = &self.scene.implicits[surface].bounds;
        let size = bounds.size().max_element();
        (size + at.abs().max_element()) * 1e-9_f64.max(f64::EPSILON)
    }
}
