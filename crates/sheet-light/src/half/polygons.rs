//! Opaque polygons: triangles that stay triangles, and the buffers of the eye (steps 1, 7 and 25 of the pseudocode).
//!
//! They are rasterized once for the eye: depth, normal and colour of the nearest. Nothing that is drawn in slabs lies behind them, so
//! rays end there, and what they show is seen behind all else. What light they show is found when a sweep has come to them.

use super::HalfInput;
use crate::Error;
use rayon::prelude::*;
use splat_core::glam::{DVec3, Vec3};
use splat_core::raster::triangles::{PlacedMesh, TriangleHit, TriangleImage, resolve};
use splat_core::shade::{Point, facing};
use splat_core::{Camera, Material, Progress, Receiver, Shading, SplatKind};

/// A mesh of opaque polygons.
#[derive(Debug, Clone, Copy)]
pub struct Polygons<'a> {
    /// The triangles, with normals and colours where these are known.
    pub placed: PlacedMesh<'a>,
    /// How light becomes radiance.
    pub material: &'a Material,
    /// Linear Rec.709; a factor on the colours of the mesh where it has any.
    pub color: [f32; 3],
    /// Id of the object.
    pub object: u32,
    /// Share of shadows that it takes, in \[0, 1\].
    pub shadow_coefficient: f32,
    /// Whether it keeps light from others and from itself.
    pub casts_shadow: bool,
    /// Radius of the splats that stand for it in the shadow maps of [`HalfInput::mapped`], world units, ≥ 0; 0 for none.
    pub radius: f32,
}

/// What the eye sees of polygons.
pub(crate) struct EyePolygons<'a> {
    of: &'a [Polygons<'a>],
    image: TriangleImage,
    /// View depth of whatever hides things behind it.
    pub(crate) opaque: Vec<f32>,
    /// Pixels that show a polygon, ascending.
    pub(crate) pixels: Vec<u32>,
}

/// A place on a polygon that a pixel shows.
pub(crate) struct Seen<'a> {
    pub(crate) of: &'a Polygons<'a>,
    pub(crate) world: DVec3,
    /// Unit normal of the triangle, on the side of the shading normal.
    pub(crate) face: Vec3,
    /// Unit normal of the surface.
    normal: Vec3,
    to_eye: Vec3,
    color: [f32; 3],
}

impl Polygons<'_> {
    /// Whether it asks for light at all.
    pub(crate) fn is_lit(&self) -> bool {
        self.material.shading != Shading::Unlit
    }
}

impl<'a> EyePolygons<'a> {
    /// Those of an input; `None` without any.
    pub(crate) fn new(input: &HalfInput<'a>, progress: &Progress) -> Result<Option<Self>, Error> {
        if input.polygons.is_empty() {
            return Ok(None);
        }
        let meshes: Vec<PlacedMesh<'_>> = input.polygons.iter().map(|p| p.placed).collect();
        let image = resolve(&meshes, input.sheets.camera, Some(progress)).map_err(Error::of_polygons)?;
        let hides = |k: usize| input.opaque.get(k).copied().unwrap_or(f32::INFINITY);
        let is_seen = |k: &u32| {
            let k = *k as usize;
            image.hits[k] != TriangleHit::NONE && image.depth[k] < hides(k)
        };
        let pixels: Vec<u32> = (0..image.depth.len() as u32).filter(is_seen).collect();
        let opaque = (0..image.depth.len()).map(|k| image.depth[k].min(hides(k))).collect();
        Ok(Some(Self { of: input.polygons, image, opaque, pixels }))
    }

    /// Whether any asks for light.
    pub(crate) fn are_lit(&self) -> bool {
        self.of.iter().any(Polygons::is_lit)
    }

    /// Those that cast shadows.
    pub(crate) fn casters(&self) -> Vec<PlacedMesh<'a>> {
        self.of.iter().filter(|p| p.casts_shadow).map(|p| p.placed).collect()
    }

    /// View depth of the polygon that a pixel shows.
    pub(crate) fn depth(&self, pixel: u32) -> f32 {
        self.image.depth[pixel as usize]
    }

    /// Object of the polygon that a pixel shows.
    pub(crate) fn object(&self, pixel: u32) -> u32 {
        self.of[self.image.hits[pixel as usize].mesh as usize].object
    }

    /// A box around all that is seen of them; world.
    pub(crate) fn places(&self, camera: &Camera) -> Vec<DVec3> {
        self.pixels.par_iter().map(|pixel| self.seen(*pixel, camera).world).collect()
    }

    /// What a pixel shows, one of [`EyePolygons::pixels`].
    pub(crate) fn seen(&self, pixel: u32, camera: &Camera) -> Seen<'a> {
        let (hit, width) = (&self.image.hits[pixel as usize], camera.size[0]);
        let of = &self.of[hit.mesh as usize];
        let PlacedMesh { mesh, transform } = of.placed;
        let turned = |n: Vec3| transform.rotate(n.as_dvec3()).as_vec3();
        let (normal, face) = (turned(hit.normal(mesh)), turned(hit.face(mesh)));
        let (from, along) = camera.view_ray(f64::from(pixel % width) + 0.5, f64::from(pixel / width) + 0.5);
        let [right, up, forward] = camera.axes;
        let world = |v: DVec3| right * v.x + up * v.y + forward * v.z;
        let (from, along) = (camera.position + world(from), world(along));
        // By the plane of the triangle, in more digits than the depth has.
        let corner = mesh.position[mesh.triangles[hit.triangle as usize][0] as usize].as_dvec3();
        let plane = transform.rotate(exact_face(hit, of));
        let exact = (transform.apply(mesh.origin + corner) - from).dot(plane) / along.dot(plane);
        let depth = f64::from(self.image.depth[pixel as usize]);
        let depth = if (exact - depth).abs() <= 1e-4 * depth { exact } else { depth };
        let of_mesh = hit.color(mesh).unwrap_or([1.0; 3]);
        Seen {
            of,
            world: from + along * depth,
            face: if face.dot(normal) < 0.0 { -face } else { face },
            normal,
            to_eye: -along.normalize().as_vec3(),
            color: [0, 1, 2].map(|c| of.color[c] * of_mesh[c]),
        }
    }
}

/// Normal of a triangle in its mesh's own space, in double precision.
fn exact_face(hit: &TriangleHit, of: &Polygons<'_>) -> DVec3 {
    let mesh = of.placed.mesh;
    let [p, q, r] = mesh.triangles[hit.triangle as usize].map(|v| mesh.position[v as usize].as_dvec3());
    (q - p).cross(r - p).normalize_or_zero()
}

impl<'a> Seen<'a> {
    /// The place as it is shaded.
    pub(crate) fn point(&self) -> Point<'a> {
        Point {
            position: self.world,
            radius: 0.0,
            normal: facing(SplatKind::Opaque, self.face, self.normal, self.to_eye),
            to_eye: self.to_eye,
            color: self.color,
            material: self.of.material,
        }
    }

    /// The place as it asks shadow maps for light.
    pub(crate) fn receiver(&self, origin: DVec3) -> Receiver {
        let position = (self.world - origin).as_vec3();
        Receiver { position, normal: self.face, radius: self.of.radius, kind: SplatKind::Opaque }
    }
}
