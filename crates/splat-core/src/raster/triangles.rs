//! Triangles of meshes, rasterized without gaps: each pixel whose middle lies inside a surface is met once.
//!
//! 1. Corners become view-space positions in f64, the camera subtracted first (`view.rs`).
//! 2. A triangle is clipped at the eye plane and far outside of the picture before it is projected (`clip.rs`). What one edge
//!    of two triangles is clipped to is found the same way from both sides.
//! 3. Corners in the picture are rounded to 1/4096 of a pixel, and edges are decided by whole numbers: of the two triangles at
//!    an edge, a pixel's middle on that edge belongs to the one whose left or upper edge it is (`piece.rs`).
//! 4. Where a ray meets the triangle itself, not what it was rounded to, says depth and barycentric coordinates, so these are right
//!    in perspective too (`crossing.rs`).
//!
//! [`resolve_layers`] keeps all of them, nearest first, where they let light through.
//!
//! Rows of pixels are cut into bands, each a task of its own; of equally near triangles the first is seen. So no bit depends on
//! the number of threads.
//!
//! ```
//! use splat_core::raster::triangles::{PlacedMesh, TriangleHit, resolve};
//! use splat_core::{Camera, Mesh, Projection, Similarity, glam::{DVec3, Vec3}};
//!
//! // The ground to the horizon, two triangles that reach behind the eye.
//! let far = 1e4;
//! let position = [[-far, -far], [far, -far], [far, far], [-far, far]].map(|[x, z]| Vec3::new(x, 0.0, z)).to_vec();
//! let mesh = Mesh { position, triangles: vec![[0, 1, 2], [0, 2, 3]], ..Mesh::default() };
//! let view = Projection::Perspective { fov_y: 1.0 };
//! let camera = Camera::look_at(DVec3::Y, DVec3::new(0.0, 1.0, -5.0), DVec3::Y, view, [64, 64]).unwrap();
//! let seen = resolve(&[PlacedMesh { mesh: &mesh, transform: Similarity::default() }], &camera, None).unwrap();
//!
//! let ground = |row: usize| (0..64).filter(|x| seen.hits[row * 64 + x] != TriangleHit::NONE).count();
//! assert_eq!((ground(31), ground(32), ground(63)), (0, 64, 64));
//! // In the lowest row the eye's height is seen at a slope of tan(1/2)·63/64.
//! let expected = 1.0 / (0.5f64.tan() * 63.0 / 64.0);
//! assert!((f64::from(seen.depth[63 * 64]) - expected).abs() < 1e-6);
//! ```

mod bands;
mod clip;
mod crossing;
mod layers;
mod piece;
mod view;

use crate::{Camera, Error, Mesh, Progress, Similarity};
use crossing::Crossing;
use glam::Vec3;
pub use layers::{LayerLists, TriangleLayer, TriangleLayers, count_layers, resolve_layers};
use view::Meshes;

/// A mesh, and its place in the world.
#[derive(Debug, Clone, Copy)]
pub struct PlacedMesh<'a> {
    /// The triangles, seen from both sides.
    pub mesh: &'a Mesh,
    /// From the mesh to the world.
    pub transform: Similarity,
}

/// Where the ray through the middle of a pixel meets a triangle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TriangleHit {
    /// Place of the mesh in the input.
    pub mesh: u32,
    /// Place of the triangle in the mesh.
    pub triangle: u32,
    /// Barycentric coordinates of its second and third corner, in the plane of the triangle, in \[0, 1\].
    pub barycentric: [f32; 2],
}

/// The nearest triangle of each pixel, row by row from the top left.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct TriangleImage {
    /// View depth, world units; +∞ where there is none.
    pub depth: Vec<f32>,
    /// What is seen; [`TriangleHit::NONE`] where there is none.
    pub hits: Vec<TriangleHit>,
}

/// Depths of the nearest triangles, and how they go on beside the middle of a pixel.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct DepthPlanes {
    /// View depth, world units; +∞ where there is none.
    pub depth: Vec<f32>,
    /// Growth per pixel to the right and down: of depth where rays are parallel, world units; else of inverse depth, as a share of
    /// that here. See [`DepthPlanes::at`].
    pub slope: Vec<[f32; 2]>,
}

/// Resolves the nearest triangle of each pixel. One tick a band of rows.
///
/// # Errors
/// [`Error::Invalid`] or [`Error::ColumnLength`] for a mesh that does not hold what [`Mesh::validate`] asks for; [`Error::Cancelled`].
pub fn resolve(
    meshes: &[PlacedMesh<'_>],
    camera: &Camera,
    progress: Option<&Progress>,
) -> Result<TriangleImage, Error> {
    let keep = |mesh: u32, triangle: u32, at: &Crossing| {
        let [_, b, c] = at.barycentric;
        TriangleHit { mesh, triangle, barycentric: [b as f32, c as f32] }
    };
    let (depth, hits) = bands::resolve(&Meshes::new(meshes, camera)?, TriangleHit::NONE, keep, progress)?;
    Ok(TriangleImage { depth, hits })
}

/// Resolves depths alone, for the view of a light. One tick a band of rows.
///
/// # Errors
/// As [`resolve`].
pub fn resolve_depth(
    meshes: &[PlacedMesh<'_>],
    camera: &Camera,
    progress: Option<&Progress>,
) -> Result<DepthPlanes, Error> {
    let keep = |_, _, at: &Crossing| at.slope.map(|s| s as f32);
    let (depth, slope) = bands::resolve(&Meshes::new(meshes, camera)?, [0.0; 2], keep, progress)?;
    Ok(DepthPlanes { depth, slope })
}

impl TriangleHit {
    /// Where nothing is seen.
    pub const NONE: Self = Self { mesh: u32::MAX, triangle: u32::MAX, barycentric: [0.0; 2] };

    /// Attribute of the place by those of a mesh's vertices; `None` where the mesh has none.
    fn mix<const N: usize>(
        &self,
        mesh: &Mesh,
        attribute: impl Fn(usize) -> [f32; N],
        count: usize,
    ) -> Option<[f32; N]> {
        let [b, c] = self.barycentric;
        let [p, q, r] = mesh.triangles[self.triangle as usize].map(|v| v as usize);
        let mixed = || {
            let corners = [attribute(p), attribute(q), attribute(r)];
            std::array::from_fn(|i| (1.0 - b - c) * corners[0][i] + b * corners[1][i] + c * corners[2][i])
        };
        (count > 0).then(mixed)
    }

    /// Linear Rec.709 colour here; `None` for a mesh without colours.
    ///
    /// # Panics
    /// If the hit is of another mesh.
    pub fn color(&self, mesh: &Mesh) -> Option<[f32; 3]> {
        self.mix(mesh, |v| mesh.color[v], mesh.color.len())
    }

    /// Opacity of one crossing here; 1 for a mesh without opacities.
    ///
    /// # Panics
    /// If the hit is of another mesh.
    pub fn opacity(&self, mesh: &Mesh) -> f32 {
        self.mix(mesh, |v| [mesh.opacity[v]], mesh.opacity.len()).map_or(1.0, |[share]| share)
    }

    /// Unit normal of the triangle in the mesh's own space, to the side from which its corners run counterclockwise; zero for one without
    /// area.
    ///
    /// # Panics
    /// If the hit is of another mesh.
    pub fn face(&self, mesh: &Mesh) -> Vec3 {
        let [p, q, r] = mesh.triangles[self.triangle as usize].map(|v| mesh.position[v as usize].as_dvec3());
        (q - p).cross(r - p).normalize_or_zero().as_vec3()
    }

    /// Unit normal here in the mesh's own space, mixed of those of the corners; [`TriangleHit::face`] for a mesh without normals and
    /// where they cancel out.
    ///
    /// # Panics
    /// If the hit is of another mesh.
    pub fn normal(&self, mesh: &Mesh) -> Vec3 {
        let mixed = self.mix(mesh, |v| mesh.normal[v].to_array(), mesh.normal.len());
        let normal = Vec3::from(mixed.unwrap_or_default()).normalize_or_zero();
        if normal == Vec3::ZERO { self.face(mesh) } else { normal }
    }
}

impl DepthPlanes {
    /// View depth at which the plane of the triangle at pixel `k` lies beside the middle of that pixel, world units; +∞ where there is
    /// none, and where the plane lies behind the eye.
    #[inline]
    pub fn at(&self, k: usize, offset: [f32; 2], is_parallel: bool) -> f32 {
        depth_beside(self.depth[k], self.slope[k], offset, is_parallel)
    }
}

/// View depth at which the plane of a triangle lies beside the middle of a pixel, where it has this depth and slope.
#[inline]
pub fn depth_beside(depth: f32, slope: [f32; 2], offset: [f32; 2], is_parallel: bool) -> f32 {
    let step = slope[0] * offset[0] + slope[1] * offset[1];
    if is_parallel {
        return depth + step;
    }
    let share = 1.0 + step;
    if share > 0.0 { depth / share } else { f32::INFINITY }
}
