//! Polygons: every ray against every triangle.
//!
//! Where the fast form has z-buffers and lists of the light, of pixels, a ray is followed to the light here. Triangles are flat and of one colour.

use super::{Between, Carried, Fragment, Image, Lamp, View};
use crate::half_vector::polygons::surfaces::Polygons;
use crate::half_vector::slicing::serves;
use crate::image_aligned::reference::Picture;
use crate::shared::slabs::Slabs;
use splat_core::Light;
use splat_core::glam::DVec3;
use splat_core::shade::Point;

/// The triangles in world space, each with its mesh.
pub(super) struct Triangles<'a> {
    meshes: &'a [Polygons<'a>],
    triangles: Vec<([DVec3; 3], usize)>,
}

/// What a pixel of the eye sees.
#[derive(Clone, Copy)]
pub(super) struct Hit {
    /// View depth.
    pub(super) depth: f64,
    pub(super) world: DVec3,
    triangle: usize,
}

impl<'a> Triangles<'a> {
    pub(super) fn new(meshes: &'a [Polygons<'a>]) -> Self {
        let of_mesh = |(m, polygons): (usize, &Polygons<'_>)| {
            let mesh = polygons.placed.mesh;
            let transform = polygons.placed.transform;
            let corner = |v: u32| transform.apply(mesh.origin + mesh.position[v as usize].as_dvec3());
            mesh.triangles.iter().map(|t| (t.map(corner), m)).collect::<Vec<_>>()
        };
        Self { meshes, triangles: meshes.iter().enumerate().flat_map(of_mesh).collect() }
    }

    /// Where a line meets a triangle, as a multiple of `along` (Möller, Trumbore 1997).
    fn meets(&self, triangle: usize, from: DVec3, along: DVec3) -> Option<f64> {
        let [p, q, r] = self.triangles[triangle].0;
        let u = q - p;
        let v = r - p;
        let across = along.cross(v);
        let determinant = u.dot(across);
        let start = from - p;
        let a = start.dot(across) / determinant;
        let b = along.dot(start.cross(u)) / determinant;
        let is_inside = determinant != 0.0 && a >= 0.0 && b >= 0.0 && a + b <= 1.0;
        is_inside.then(|| v.dot(start.cross(u)) / determinant)
    }

    /// Those in a pixel of the eye that are opaque, or those that are not; nearest first.
    fn seen(&self, eye: &Image, pixel: usize, opaque: bool) -> Vec<Hit> {
        let camera = &eye.camera;
        let width = camera.size[0] as usize;
        let (from, along) = camera.view_ray((pixel % width) as f64 + 0.5, (pixel / width) as f64 + 0.5);
        let [right, up, forward] = camera.axes;
        let world = |v: DVec3| right * v.x + up * v.y + forward * v.z;
        let from = camera.position + world(from);
        let along = world(along);
        let mut hits: Vec<Hit> = (0..self.triangles.len())
            .filter(|triangle| self.mesh(*triangle).is_opaque() == opaque)
            .filter_map(|triangle| {
                let depth = self.meets(triangle, from, along).filter(|depth| *depth > 0.0)?;
                Some(Hit { depth, world: from + along * depth, triangle })
            })
            .collect();
        hits.sort_by(|a, b| a.depth.total_cmp(&b.depth));
        hits
    }

    /// The nearest opaque one in a pixel of the eye.
    pub(super) fn nearest(&self, eye: &Image, pixel: usize) -> Option<Hit> {
        self.seen(eye, pixel, true).first().copied()
    }

    /// The translucent ones in a pixel of the eye before the end of its ray.
    pub(super) fn before(&self, eye: &Image, pixel: usize) -> Vec<Hit> {
        let mut hits = self.seen(eye, pixel, false);
        hits.retain(|hit| hit.depth < eye.ends[pixel]);
        hits
    }

    fn mesh(&self, triangle: usize) -> &'a Polygons<'a> {
        &self.meshes[self.triangles[triangle].1]
    }

    /// Unit normal of a triangle.
    fn face(&self, triangle: usize) -> DVec3 {
        let [p, q, r] = self.triangles[triangle].0;
        (q - p).cross(r - p).normalize()
    }

    /// Green optical depth of one crossing along a direction.
    fn crossing(&self, triangle: usize, along: DVec3) -> f64 {
        let polygons = self.mesh(triangle);
        let cosine = along.normalize().dot(self.face(triangle));
        let factor =
            polygons.material.surface_opacity.optical_depth_factor(cosine as f32) * polygons.material.extinction_rgb[1];
        f64::from(polygons.optical_depth) * f64::from(factor)
    }

    /// Share of the light of the centre that comes to a place, which may lie on one of them.
    pub(super) fn through(&self, light: &Light, world: DVec3, lies_on: Option<usize>) -> f64 {
        let travel = serves::travel(light, world);
        let reach = light.shape.place().map_or(f64::INFINITY, |place| place.distance(world));
        let hides = |t: &usize| {
            let casts = Some(*t) != lies_on && self.mesh(*t).casts_shadow;
            casts && self.meets(*t, world, -travel).is_some_and(|way| way > 0.0 && way < reach)
        };
        libm::exp(-(0..self.triangles.len()).filter(hides).map(|t| self.crossing(t, travel)).sum::<f64>())
    }
}

impl View<'_> {
    /// Finds the radiance of the polygons in a slab, or behind the last; by pixel.
    pub(super) fn light_polygons(
        &self,
        hits: &[Option<Hit>],
        slab: u32,
        carried: Carried<'_, '_>,
        lamp: Lamp<'_, '_>,
        out: &mut [[f64; 3]],
    ) {
        for (out, hit) in out.iter_mut().zip(hits).filter_map(|(out, hit)| Some((out, hit.as_ref()?))) {
            if self.slab_of(hit) == slab {
                *out = self.polygon(hit, slab, carried, lamp);
            }
        }
    }

    /// Slab of a place, or one more for what lies behind the last.
    pub(super) fn slab_of(&self, hit: &Hit) -> u32 {
        let Slabs { width, count, .. } = self.frame.slabs;
        ((self.frame.point(hit.world).z / width).max(0.0) as u32).min(count)
    }

    /// Optical depth and radiance of a translucent polygon that a pixel shows.
    pub(super) fn pane(&self, hit: &Hit, slab: u32, carried: Carried<'_, '_>, lamp: Lamp<'_, '_>) -> Fragment {
        let eye = self.input.sheets.camera;
        let along = if eye.is_orthographic() { eye.axes[2] } else { hit.world - eye.position };
        let optical_depth = self.polygons.crossing(hit.triangle, along);
        Fragment { optical_depth, color: self.polygon(hit, slab, carried, lamp) }
    }

    /// The translucent polygons of a pixel in a slab, given nearest first, and what the slab has between them: optical depths and radiance in the
    /// order in which they are composited.
    pub(super) fn parted(
        &self,
        panes: &[&Hit],
        slab: u32,
        carried: Carried<'_, '_>,
        lamp: Lamp<'_, '_>,
        between: impl Fn(Between) -> Fragment,
    ) -> Vec<Fragment> {
        let mut fragments = Vec::new();
        for n in 0..=panes.len() {
            let depth = |n: usize| panes.get(n).map(|hit| self.frame.point(hit.world).z);
            let [nearer, farther] = [n.checked_sub(1).and_then(depth), depth(n)];
            let [low, high] = if self.frame.back_to_front { [farther, nearer] } else { [nearer, farther] };
            let part = Between { low: low.unwrap_or(f64::NEG_INFINITY), high: high.unwrap_or(f64::INFINITY) };
            fragments.push(between(part));
            fragments.extend(panes.get(n).map(|hit| self.pane(hit, slab, carried, lamp)));
        }
        if self.frame.back_to_front {
            fragments.reverse();
        }
        fragments
    }

    /// Adds the translucent polygons behind the last slab.
    pub(super) fn add_behind(
        &self,
        panes: &[Vec<Hit>],
        last: u32,
        carried: Carried<'_, '_>,
        lamp: Lamp<'_, '_>,
        out: &mut Picture,
    ) {
        for (pixel, panes) in panes.iter().enumerate() {
            let hits: Vec<&Hit> = panes.iter().filter(|hit| self.slab_of(hit) == last).collect();
            for fragment in self.parted(&hits, last, carried, lamp, |_| Fragment::default()) {
                self.composite(fragment, pixel, out);
            }
        }
    }

    /// Radiance of the polygon that a pixel shows, lit by what comes through to its slab.
    fn polygon(&self, hit: &Hit, slab: u32, carried: Carried<'_, '_>, lamp: Lamp<'_, '_>) -> [f64; 3] {
        let Carried { light, sums, splats } = carried;
        let Lamp { lit, with_ambient } = lamp;
        let polygons = self.polygons.mesh(hit.triangle);
        let place = self.frame.point(hit.world);
        let eye = self.input.sheets.camera;
        let to_eye = if eye.is_orthographic() { -eye.axes[2] } else { (eye.position - hit.world).normalize() };
        let face = self.polygons.face(hit.triangle);
        let normal = if face.dot(to_eye) < 0.0 { -face } else { face };
        let mut through = libm::exp(-self.through_volumes(light, sums, &lit.light, place, slab));
        through *= splats.map_or(1.0, |splats| splats.before(self, light, place, slab)[1]);
        through *= self.polygons.through(&lit.light, hit.world, Some(hit.triangle));
        let point = Point {
            position: hit.world,
            radius: 0.0,
            normal: normal.as_vec3(),
            to_eye: to_eye.as_vec3(),
            color: polygons.color,
            material: polygons.material,
        };
        let share = (1.0 - f64::from(polygons.shadow_coefficient) * (1.0 - through)) as f32;
        let radiance = point.radiance(self.input.sheets.ambient, std::iter::once(lit), |_, _| [share; 3]);
        let [ambient, emission, direct, scatter] = radiance.effects();
        let others = if with_ambient { 1.0 } else { 0.0 };
        [0, 1, 2].map(|c| f64::from(others * (ambient[c] + emission[c]) + direct[c] + scatter[c]))
    }
}
