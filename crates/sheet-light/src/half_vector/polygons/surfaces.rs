//! Polygons: triangles that stay triangles, and the buffers of the eye (steps 1, 7 and 25 of the pseudocode).
//!
//! They are rasterized once for the eye. Of opaque ones the nearest counts: nothing that is drawn in slabs lies behind it, so rays end there, and
//! what it shows is seen behind all else. Of translucent ones all count that lie before it, in a list a pixel ([`EyePanes`]). What light they show is
//! found when a sweep has come to them.

use crate::Error;
use rayon::prelude::*;
use splat_core::glam::{DVec3, Vec3};
use splat_core::optics::{self, SurfaceOpacity};
use splat_core::raster::triangles::{LayerLists, PlacedMesh, TriangleHit, TriangleLayer, resolve, resolve_layers};
use splat_core::shade::{ChannelLayout, Point, facing};
use splat_core::{Camera, Material, Progress, Receiver, Shading, SplatKind};
use std::ops::Range;

/// A mesh of polygons.
#[derive(Debug, Clone, Copy)]
pub struct Polygons<'a> {
    /// The triangles, with normals and colours where these are known.
    pub placed: PlacedMesh<'a>,
    /// How light becomes radiance.
    pub material: &'a Material,
    /// Linear Rec.709; a factor on the colours of the mesh where it has any.
    pub color: [f32; 3],
    /// Optical depth of one crossing of a triangle, times [`Material::extinction_rgb`] by channel and, of a thin slab, 1/|cos θ|; ≥ 0, +∞ for what
    /// is opaque. Where the mesh has opacities, that of a crossing where they are 1.
    pub optical_depth: f32,
    /// Id of the object.
    pub object: u32,
    /// Share of shadows that it takes, in \[0, 1\].
    pub shadow_coefficient: f32,
    /// Whether it keeps light from others and from itself.
    pub casts_shadow: bool,
    /// Radius of the splats that stand for it in the shadow maps of [`HalfInput::mapped`](crate::half::HalfInput::mapped), world units, ≥ 0; 0 for none.
    pub radius: f32,
}

/// What the eye sees of opaque polygons.
pub(crate) struct EyePolygons<'a> {
    pub(crate) seen: Surfaces<'a>,
    /// View depth of whatever hides things behind it.
    pub(crate) opaque: Vec<f32>,
}

/// What the eye sees of translucent polygons: pixel by pixel, nearest first.
pub(crate) struct EyePanes<'a> {
    pub(crate) seen: Surfaces<'a>,
    /// Where those of each pixel begin; and the end.
    starts: Vec<u32>,
}

/// Places on polygons that pixels show.
pub(crate) struct Surfaces<'a> {
    meshes: Vec<Polygons<'a>>,
    hits: Vec<Hit>,
}

/// A place on a polygon.
#[derive(Debug, Clone, Copy)]
struct Hit {
    pixel: u32,
    /// View depth.
    depth: f32,
    on: TriangleHit,
}

/// A place on a polygon that a pixel shows.
pub(crate) struct Seen<'a> {
    pub(crate) polygons: &'a Polygons<'a>,
    pub(crate) world: DVec3,
    /// Unit normal of the triangle, on the side of the shading normal.
    pub(crate) face: Vec3,
    /// Unit normal of the surface.
    normal: Vec3,
    to_eye: Vec3,
    color: [f32; 3],
    on: TriangleHit,
}

/// Optical depth of an opaque part of a mesh with opacities: 10⁻²⁸ of what is behind it comes through.
const DEEPEST: f64 = 64.0;

impl Polygons<'_> {
    /// Whether no light comes through.
    pub fn is_opaque(&self) -> bool {
        self.optical_depth == f32::INFINITY && self.placed.mesh.opacity.is_empty()
    }

    /// Optical depth of one crossing there, before the factors of [`Polygons::crossing`].
    pub(crate) fn depth_at(&self, on: &TriangleHit) -> f64 {
        let depth = f64::from(self.optical_depth);
        if self.placed.mesh.opacity.is_empty() {
            return depth;
        }
        let share = f64::from(on.opacity(self.placed.mesh).clamp(0.0, 1.0));
        optics::optical_depth(optics::opacity(depth) * share).min(DEEPEST)
    }

    /// Refuses what cannot be drawn, at the place `index` of an input.
    pub(crate) fn check(&self, index: usize) -> Result<(), Error> {
        self.placed.mesh.validate().map_err(Error::Polygons)?;
        let refuse = |what, found, expected| {
            Err(Error::Polygons(splat_core::Error::invalid("mesh", index, what, found, expected)))
        };
        if !(0.0..=1.0).contains(&self.shadow_coefficient) {
            return refuse("shadow_coefficient", self.shadow_coefficient, "a number in [0, 1]");
        }
        if self.optical_depth.is_nan() || self.optical_depth < 0.0 {
            return refuse("optical_depth", self.optical_depth, "a number >= 0, or infinity");
        }
        Ok(())
    }

    /// Whether it asks for light at all.
    pub(crate) fn is_lit(&self) -> bool {
        self.material.shading != Shading::Unlit
    }

    /// Optical depth by channel of one crossing there, at this cosine of the ray to the normal, which few ask for.
    pub(crate) fn crossing(&self, on: &TriangleHit, cosine: impl FnOnce() -> f32) -> [f32; 3] {
        let slanted = match self.material.surface_opacity {
            SurfaceOpacity::PerCrossing => 1.0,
            law @ SurfaceOpacity::ThinSlab => law.optical_depth_factor(cosine()),
        };
        let depth = self.depth_at(on) as f32;
        self.material.extinction_rgb.map(|factor| depth * slanted * factor)
    }

    /// Unit normal of a triangle in the world.
    pub(crate) fn face(&self, on: &TriangleHit) -> Vec3 {
        self.placed.transform.rotate(on.face(self.placed.mesh).as_dvec3()).as_vec3()
    }
}

impl<'a> EyePolygons<'a> {
    pub(crate) fn new(
        meshes: Vec<Polygons<'a>>,
        camera: &Camera,
        opaque: &[f32],
        progress: &Progress,
    ) -> Result<Self, Error> {
        let placed: Vec<PlacedMesh<'_>> = meshes.iter().map(|p| p.placed).collect();
        let image = resolve(&placed, camera, Some(progress)).map_err(Error::of_polygons)?;
        let hides = |k: usize| opaque.get(k).copied().unwrap_or(f32::INFINITY);
        let hit = |k: usize| {
            let on = image.hits[k];
            let depth = image.depth[k];
            (on != TriangleHit::NONE && depth < hides(k)).then_some(Hit { pixel: k as u32, depth, on })
        };
        let hits = (0..image.depth.len()).filter_map(hit).collect();
        let opaque = (0..image.depth.len()).map(|k| image.depth[k].min(hides(k))).collect();
        Ok(Self { seen: Surfaces { meshes, hits }, opaque })
    }
}

impl<'a> EyePanes<'a> {
    pub(crate) fn new(
        meshes: Vec<Polygons<'a>>,
        camera: &Camera,
        opaque: &[f32],
        most: u64,
        layout: &ChannelLayout,
        progress: &Progress,
    ) -> Result<Self, Error> {
        let placed: Vec<PlacedMesh<'_>> = meshes.iter().map(|p| p.placed).collect();
        let hit = |k: usize, layer: &TriangleLayer| Hit { pixel: k as u32, depth: layer.depth, on: layer.hit };
        let none = Hit { pixel: 0, depth: 0.0, on: TriangleHit::NONE };
        // What else is kept of each takes as much again and more.
        let most = most / bytes_of_a_pane(layout) * size_of::<Hit>() as u64;
        let layers = resolve_layers(&placed, camera, opaque, most, none, hit, Some(progress));
        let LayerLists { starts, layers: hits } = layers.map_err(Error::of_polygons)?.into_lists();
        Ok(Self { seen: Surfaces { meshes, hits }, starts })
    }

    /// Ranks of those that a pixel shows, nearest first.
    #[inline]
    pub(crate) fn of_pixel(&self, pixel: usize) -> Range<u32> {
        self.starts[pixel]..self.starts[pixel + 1]
    }

    /// Bytes of the lists, and of what sweeps keep of them.
    pub(crate) fn bytes(&self) -> u64 {
        4 * self.starts.len() as u64 + BYTES_OF_A_PANE * self.seen.count() as u64
    }
}

/// Bytes of a place on a translucent polygon: itself, where it lies in slabs, its light.
const BYTES_OF_A_PANE: u64 = 72;

/// The same with what it shows.
pub(crate) fn bytes_of_a_pane(layout: &ChannelLayout) -> u64 {
    BYTES_OF_A_PANE + 4 * layout.count() as u64
}

impl<'a> Surfaces<'a> {
    /// Places.
    pub(crate) fn count(&self) -> usize {
        self.hits.len()
    }

    /// Pixel that shows a place.
    pub(crate) fn pixel(&self, rank: usize) -> u32 {
        self.hits[rank].pixel
    }

    /// View depth of a place.
    pub(crate) fn depth(&self, rank: usize) -> f32 {
        self.hits[rank].depth
    }

    /// What a place lies on.
    pub(crate) fn polygons(&self, rank: usize) -> &Polygons<'a> {
        &self.meshes[self.hits[rank].on.mesh as usize]
    }

    /// All places; world.
    pub(crate) fn places(&self, camera: &Camera) -> Vec<DVec3> {
        (0..self.count()).into_par_iter().map(|rank| self.seen(rank, camera).world).collect()
    }

    /// What a pixel shows.
    pub(crate) fn seen(&self, rank: usize, camera: &Camera) -> Seen<'_> {
        let Hit { pixel, depth, on } = &self.hits[rank];
        let width = camera.size[0];
        let polygons = &self.meshes[on.mesh as usize];
        let PlacedMesh { mesh, transform } = polygons.placed;
        let normal = transform.rotate(on.normal(mesh).as_dvec3()).as_vec3();
        let face = polygons.face(on);
        let (from, along) = camera.view_ray(f64::from(pixel % width) + 0.5, f64::from(pixel / width) + 0.5);
        let [right, up, forward] = camera.axes;
        let world = |v: DVec3| right * v.x + up * v.y + forward * v.z;
        let from = camera.position + world(from);
        let along = world(along);
        // By the plane of the triangle, in more digits than the depth has.
        let corner = mesh.position[mesh.triangles[on.triangle as usize][0] as usize].as_dvec3();
        let plane = transform.rotate(exact_face(on, polygons));
        let exact = (transform.apply(mesh.origin + corner) - from).dot(plane) / along.dot(plane);
        let depth = f64::from(*depth);
        let depth = if (exact - depth).abs() <= 1e-4 * depth { exact } else { depth };
        let of_mesh = on.color(mesh).unwrap_or([1.0; 3]);
        Seen {
            polygons,
            world: from + along * depth,
            face: if face.dot(normal) < 0.0 { -face } else { face },
            normal,
            to_eye: -along.normalize().as_vec3(),
            color: [0, 1, 2].map(|c| polygons.color[c] * of_mesh[c]),
            on: *on,
        }
    }
}

/// Normal of a triangle in its mesh's own space, in double precision.
fn exact_face(on: &TriangleHit, polygons: &Polygons<'_>) -> DVec3 {
    let mesh = polygons.placed.mesh;
    let [p, q, r] = mesh.triangles[on.triangle as usize].map(|v| mesh.position[v as usize].as_dvec3());
    (q - p).cross(r - p).normalize_or_zero()
}

impl<'a> Seen<'a> {
    fn kind(&self) -> SplatKind {
        if self.polygons.is_opaque() { SplatKind::Opaque } else { SplatKind::Surface }
    }

    /// The place as it is shaded.
    pub(crate) fn point(&self) -> Point<'a> {
        Point {
            position: self.world,
            radius: 0.0,
            normal: facing(self.kind(), self.face, self.normal, self.to_eye),
            to_eye: self.to_eye,
            color: self.color,
            material: self.polygons.material,
        }
    }

    /// The place as it asks shadow maps for light.
    pub(crate) fn receiver(&self, origin: DVec3) -> Receiver {
        let position = (self.world - origin).as_vec3();
        Receiver { position, normal: self.face, radius: self.polygons.radius, kind: self.kind() }
    }

    /// Optical depth by channel that it has for the eye.
    pub(crate) fn crossing(&self) -> [f32; 3] {
        self.polygons.crossing(&self.on, || self.to_eye.dot(self.face))
    }
}
