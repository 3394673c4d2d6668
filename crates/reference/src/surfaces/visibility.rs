//! Exact visibility of meshes: closest, any and all hits of a ray.
//!
//! Candidates come from a bounding volume hierarchy in f32 (crate `obvhs`) around the centre of the scene, scaled by a
//! power of two to size one. Its boxes are padded by 2⁻¹⁸, more than the f32 roundings of the boxes, the ray and the
//! slab test together (a ray is first brought to the edge of the scene in f64), so that no triangle is missed; triangles
//! are cut in f64.

use crate::ray::Ray;
use crate::surfaces::triangle::{Cut, Shear};
use glam::{DVec3, Vec3A};
use obvhs::aabb::Aabb;
use obvhs::bvh2::{Bvh2, builder::build_bvh2};
use obvhs::ray::RayHit;
use obvhs::{BvhBuildParams, ray};
use splat_core::{DAabb, Error, Exceeded, Mesh};
use std::time::Duration;

/// Padding of f32 boxes in a scene of size one.
const PAD: f32 = 1.0 / 262_144.0;

/// Distance over the size of coordinates below which a point on a triangle may lie on its neighbour: 2⁻⁴⁰, some thousand
/// roundings.
const COINCIDENT: f64 = 1.0 / 1_099_511_627_776.0;

/// One intersection of a ray and a mesh.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hit {
    /// Distance along the ray, > 0.
    pub t: f64,
    /// Which mesh.
    pub mesh: u32,
    /// Which triangle of it.
    pub triangle: u32,
    /// Barycentric weights of the triangle's second and third vertex.
    pub uv: [f64; 2],
    /// Rank in the scene: no two triangles share it.
    pub id: u32,
}

/// Meshes that rays can be sent through.
pub struct Visibility {
    center: DVec3,
    scale: f64,
    /// Half the extent of the scene, world units.
    half: DVec3,
    bvh: Option<Bvh2>,
    /// Relative to `center`.
    triangles: Vec<[DVec3; 3]>,
    owner: Vec<[u32; 2]>,
}

/// Which hits count.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Filter {
    /// Only hits after this (distance, id).
    pub(crate) after: (f64, u32),
    /// A triangle that the ray starts on.
    pub(crate) skip: u32,
}

impl Filter {
    /// Everything in front of the origin.
    pub(crate) const START: Self = Self { after: (0.0, u32::MAX), skip: u32::MAX };

    fn counts(&self, t: f64, id: u32) -> bool {
        (t > self.after.0 || (t == self.after.0 && id > self.after.1)) && id != self.skip
    }
}

impl Visibility {
    /// Builds the hierarchy of some meshes.
    ///
    /// # Errors
    /// As [`Mesh::validate`]; [`Error::Limit`] for 2³¹ triangles or more.
    pub fn new(meshes: &[&Mesh]) -> Result<Self, Error> {
        let total: u64 = meshes.iter().map(|m| m.triangles.len() as u64).sum();
        if total >= 1 << 31 {
            let what = "the meshes".into();
            let hint = "use a coarser mesh".into();
            return Err(Error::Limit(Exceeded { what, needed: total, limit: Some(1 << 31), unit: "triangles", hint }));
        }
        let mut low = DVec3::INFINITY;
        let mut high = DVec3::NEG_INFINITY;
        for mesh in meshes {
            mesh.validate()?;
            for p in &mesh.position {
                let p = mesh.origin + p.as_dvec3();
                (low, high) = (low.min(p), high.max(p));
            }
        }
        let center = if total == 0 { DVec3::ZERO } else { low + (high - low) * 0.5 };
        if total > 0 && !(high - low).is_finite() {
            return Err(Error::invalid("mesh", 0, "origin", [low, high], "finite positions"));
        }
        let mut triangles = Vec::with_capacity(total as usize);
        let mut owner = Vec::with_capacity(total as usize);
        for (m, mesh) in meshes.iter().enumerate() {
            let offset = mesh.origin - center;
            for (i, t) in mesh.triangles.iter().enumerate() {
                triangles.push(t.map(|v| offset + mesh.position[v as usize].as_dvec3()));
                owner.push([m as u32, i as u32]);
            }
        }
        let half = if total == 0 { DVec3::ZERO } else { high - center };
        let scale = (-half.max_element().max(f64::MIN_POSITIVE).log2().ceil()).clamp(-1000.0, 1000.0).exp2();
        let mut out = Self { center, scale, half, bvh: None, triangles, owner };
        out.build();
        Ok(out)
    }

    fn build(&mut self) {
        let boxed = |t: &[DVec3; 3]| {
            let [a, b, c] = t.map(|v| (v * self.scale).as_vec3a());
            Aabb::new(a.min(b).min(c) - Vec3A::splat(PAD), a.max(b).max(c) + Vec3A::splat(PAD))
        };
        let boxes: Vec<Aabb> = self.triangles.iter().map(boxed).collect();
        if boxes.is_empty() {
            return;
        }
        let params = BvhBuildParams { max_prims_per_leaf: 4, ..BvhBuildParams::medium_build() };
        self.bvh = Some(build_bvh2(&boxes, params, &mut Duration::default()));
    }

    /// Nothing to hit.
    pub fn is_empty(&self) -> bool {
        self.bvh.is_none()
    }

    /// Geometric normal of a triangle, its vertices counter-clockwise seen from the side that it points to; zero for a
    /// degenerate triangle and an id that is none.
    pub fn normal(&self, id: u32) -> DVec3 {
        let Some(&[a, b, c]) = self.triangles.get(id as usize) else { return DVec3::ZERO };
        // Scaled so that tiny triangles do not underflow.
        ((b - a) * self.scale).cross((c - a) * self.scale).normalize_or_zero()
    }

    /// First hit before distance `t1`.
    pub fn closest(&self, ray: &Ray, t1: f64) -> Option<Hit> {
        self.next(ray, Filter::START, t1)
    }

    /// Whether a ray that starts on a triangle meets, at its very start, the continuation of that triangle: its origin may
    /// lie on their common edge, and rounding decides on which side. Only rays of aligned scenes find such places.
    fn continues(&self, ray: &Ray, skip: u32, t: f64, id: u32) -> bool {
        let size = ray.origin.abs().max_element() + self.half.max_element();
        t <= size * COINCIDENT && self.normal(skip).dot(self.normal(id)).abs() > 0.999
    }

    /// First hit of those that `from` lets count.
    pub(crate) fn next(&self, ray: &Ray, from: Filter, t1: f64) -> Option<Hit> {
        let bvh = self.bvh.as_ref()?;
        let local = self.local(ray, t1)?;
        let mut best: Option<(Cut, u32)> = None;
        bvh.ray_traverse(local.ray, &mut RayHit::none(), |_, i| {
            let id = bvh.primitive_indices[i];
            if let Some(cut) = local.shear.cut(local.origin, &self.triangles[id as usize])
                && cut.t < t1
                && from.counts(cut.t, id)
                && !(from.skip != u32::MAX && self.continues(ray, from.skip, cut.t, id))
                && best.is_none_or(|(b, other)| (cut.t, id) < (b.t, other))
            {
                best = Some((cut, id));
            }
            // Never less than the exact distance, so that ties still reach the comparison above.
            best.map_or(f32::INFINITY, |(b, _)| local.upper(b.t))
        });
        best.map(|(cut, id)| self.hit(cut, id))
    }

    /// Whether anything is hit before distance `t1`.
    pub fn is_occluded(&self, ray: &Ray, t1: f64) -> bool {
        let (Some(bvh), Some(local)) = (self.bvh.as_ref(), self.local(ray, t1)) else { return false };
        !bvh.ray_traverse_miss(local.ray, |_, i| {
            let id = bvh.primitive_indices[i];
            let cut = local.shear.cut(local.origin, &self.triangles[id as usize]);
            if cut.is_some_and(|c| c.t < t1 && c.t > 0.0) { f32::NEG_INFINITY } else { f32::INFINITY }
        })
    }

    /// All hits before distance `t1` into `out`, sorted by distance, then id.
    pub fn hits(&self, ray: &Ray, t1: f64, out: &mut Vec<Hit>) {
        out.clear();
        let (Some(bvh), Some(local)) = (self.bvh.as_ref(), self.local(ray, t1)) else { return };
        bvh.ray_traverse_anyhit(local.ray, |_, i| {
            let id = bvh.primitive_indices[i];
            if let Some(cut) = local.shear.cut(local.origin, &self.triangles[id as usize])
                && cut.t < t1
                && cut.t > 0.0
            {
                out.push(self.hit(cut, id));
            }
        });
        out.sort_by(|a, b| a.t.total_cmp(&b.t).then(a.id.cmp(&b.id)));
    }

    fn hit(&self, cut: Cut, id: u32) -> Hit {
        let [mesh, triangle] = self.owner[id as usize];
        Hit { t: cut.t, mesh, triangle, uv: cut.uv, id }
    }

    /// The ray in the space of the hierarchy, or `None` when it passes the scene.
    fn local(&self, ray: &Ray, t1: f64) -> Option<Local> {
        if !(ray.origin.is_finite() && ray.direction.is_finite()) {
            return None;
        }
        let origin = ray.origin - self.center;
        let grown = self.half + DVec3::splat(f64::from(PAD) / self.scale);
        let (enter, leave) = Ray { origin, ..*ray }.clip(&DAabb::new(-grown, grown), 0.0, t1)?;
        let start = (origin + ray.direction * enter) * self.scale;
        let mut local = Local {
            ray: ray::Ray::new(start.as_vec3a(), ray.direction.as_vec3a(), 0.0, f32::INFINITY),
            shear: Shear::new(ray.direction),
            origin,
            enter,
            scale: self.scale,
        };
        local.ray.tmax = local.upper(leave);
        Some(local)
    }
}

struct Local {
    ray: ray::Ray,
    shear: Shear,
    origin: DVec3,
    enter: f64,
    scale: f64,
}

impl Local {
    /// A distance in the space of the hierarchy, not less than that of `t`.
    fn upper(&self, t: f64) -> f32 {
        (((t - self.enter) * self.scale) as f32).max(0.0) + 4.0 * PAD
    }
}
