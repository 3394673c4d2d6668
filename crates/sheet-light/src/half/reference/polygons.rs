//! Opaque polygons: every ray against every triangle.
//!
//! Where the fast form has z-buffers of the light, of pixels, a ray is followed to the light here. Triangles are flat and of one colour.

use super::{Carried, Image, View};
use crate::half::{Polygons, serves};
use crate::slabs::Slabs;
use splat_core::Light;
use splat_core::glam::DVec3;
use splat_core::shade::{LitBy, Point};

/// The triangles in world space, each with its mesh.
pub(super) struct Triangles<'a> {
    of: &'a [Polygons<'a>],
    all: Vec<([DVec3; 3], usize)>,
}

/// What a pixel of the eye sees.
#[derive(Clone, Copy)]
pub(super) struct Hit {
    /// View depth.
    pub(super) depth: f64,
    world: DVec3,
    triangle: usize,
}

impl<'a> Triangles<'a> {
    pub(super) fn new(of: &'a [Polygons<'a>]) -> Self {
        let of_mesh = |(m, polygons): (usize, &Polygons<'_>)| {
            let (mesh, transform) = (polygons.placed.mesh, polygons.placed.transform);
            let corner = |v: u32| transform.apply(mesh.origin + mesh.position[v as usize].as_dvec3());
            mesh.triangles.iter().map(|t| (t.map(corner), m)).collect::<Vec<_>>()
        };
        Self { of, all: of.iter().enumerate().flat_map(of_mesh).collect() }
    }

    /// Where a line meets a triangle, as a multiple of `along` (Möller, Trumbore 1997).
    fn meets(&self, triangle: usize, from: DVec3, along: DVec3) -> Option<f64> {
        let [p, q, r] = self.all[triangle].0;
        let (u, v) = (q - p, r - p);
        let across = along.cross(v);
        let determinant = u.dot(across);
        let start = from - p;
        let a = start.dot(across) / determinant;
        let b = along.dot(start.cross(u)) / determinant;
        let is_inside = determinant != 0.0 && a >= 0.0 && b >= 0.0 && a + b <= 1.0;
        is_inside.then(|| v.dot(start.cross(u)) / determinant)
    }

    /// The nearest of them in a pixel of the eye.
    pub(super) fn seen(&self, eye: &Image, at: usize) -> Option<Hit> {
        let (camera, width) = (&eye.camera, eye.camera.size[0] as usize);
        let (from, along) = camera.view_ray((at % width) as f64 + 0.5, (at / width) as f64 + 0.5);
        let [right, up, forward] = camera.axes;
        let world = |v: DVec3| right * v.x + up * v.y + forward * v.z;
        let (from, along) = (camera.position + world(from), world(along));
        let hits = (0..self.all.len()).filter_map(|triangle| {
            let depth = self.meets(triangle, from, along).filter(|depth| *depth > 0.0)?;
            Some(Hit { depth, world: from + along * depth, triangle })
        });
        hits.min_by(|a, b| a.depth.total_cmp(&b.depth))
    }

    /// Whether the light's centre sees a place, which may lie on one of them.
    pub(super) fn sees(&self, light: &Light, world: DVec3, own: Option<usize>) -> bool {
        let travel = serves::travel(light, world);
        let reach = light.shape.place().map_or(f64::INFINITY, |place| place.distance(world));
        (0..self.all.len()).all(|t| {
            let casts = Some(t) != own && self.of[self.all[t].1].casts_shadow;
            !casts || self.meets(t, world, -travel).is_none_or(|way| way <= 0.0 || way >= reach)
        })
    }
}

impl View<'_> {
    /// Finds the radiance of the polygons in a slab, or behind the last; by pixel.
    pub(super) fn light_polygons(
        &self,
        (hits, slab): (&[Option<Hit>], u32),
        carried: Carried<'_, '_>,
        light: (&LitBy<'_>, bool),
        out: &mut [[f64; 3]],
    ) {
        let Slabs { width, count, .. } = self.frame.slabs;
        for (out, hit) in out.iter_mut().zip(hits).filter_map(|(out, hit)| Some((out, hit.as_ref()?))) {
            let own = (self.frame.point(hit.world).z / width).max(0.0) as u32;
            if own.min(count) == slab {
                *out = self.polygon(hit, slab, carried, light);
            }
        }
    }

    /// Radiance of the polygon that a pixel shows, lit by what comes through to its slab.
    fn polygon(
        &self,
        hit: &Hit,
        slab: u32,
        (light, sums, splats): Carried<'_, '_>,
        (lit, with_ambient): (&LitBy<'_>, bool),
    ) -> [f64; 3] {
        let ([p, q, r], mesh) = self.polygons.all[hit.triangle];
        let (of, place) = (&self.polygons.of[mesh], self.frame.point(hit.world));
        let eye = self.input.sheets.camera;
        let to_eye = if eye.is_orthographic() { -eye.axes[2] } else { (eye.position - hit.world).normalize() };
        let face = (q - p).cross(r - p).normalize();
        let normal = if face.dot(to_eye) < 0.0 { -face } else { face };
        let mut through = libm::exp(-self.through_volumes((light, sums), &lit.light, (place, slab)));
        through *= splats.map_or(1.0, |splats| splats.before(self, light, (place, slab))[1]);
        if !self.polygons.sees(&lit.light, hit.world, Some(hit.triangle)) {
            through = 0.0;
        }
        let point = Point {
            position: hit.world,
            radius: 0.0,
            normal: normal.as_vec3(),
            to_eye: to_eye.as_vec3(),
            color: of.color,
            material: of.material,
        };
        let share = (1.0 - f64::from(of.shadow_coefficient) * (1.0 - through)) as f32;
        let radiance = point.radiance(self.input.sheets.ambient, std::iter::once(lit), |_, _| [share; 3]);
        let [ambient, emission, direct, scatter] = radiance.effects();
        let others = if with_ambient { 1.0 } else { 0.0 };
        [0, 1, 2].map(|c| f64::from(others * (ambient[c] + emission[c]) + direct[c] + scatter[c]))
    }
}
