//! Meshes as the camera sees them.

use super::PlacedMesh;
use crate::{Camera, Error, Similarity};
use glam::DVec3;
use rayon::prelude::*;

/// Corners this share of the farthest coordinate before the eye plane are behind it: no picture shows what is there, and projected
/// they would lie too far away.
const NEAR: f64 = 1.0 / (1u64 << 40) as f64;

/// Meshes in view space.
pub(super) struct Meshes<'a> {
    pub(super) camera: &'a Camera,
    /// By mesh: view-space positions of the vertices, x right, y up, z depth.
    pub(super) corners: Vec<Vec<DVec3>>,
    /// By mesh: indices.
    pub(super) triangles: Vec<&'a [[u32; 3]]>,
    /// Pixels per unit of x/z, or of x where rays are parallel.
    pub(super) focal: f64,
    /// Depth before which nothing is seen.
    pub(super) near: f64,
}

impl<'a> Meshes<'a> {
    pub(super) fn new(meshes: &[PlacedMesh<'a>], camera: &'a Camera) -> Result<Self, Error> {
        meshes.iter().try_for_each(|placed| placed.mesh.validate())?;
        let view = |placed: &PlacedMesh<'a>| -> Vec<DVec3> {
            let origin = placed.transform.apply(placed.mesh.origin);
            let Similarity { rotation, scale, .. } = placed.transform;
            let from = camera.view_from_world(origin);
            let [right, up, forward] = camera.axes;
            let place = |p: &glam::Vec3| {
                let p = rotation * (p.as_dvec3() * scale);
                from + DVec3::new(right.dot(p), up.dot(p), forward.dot(p))
            };
            placed.mesh.position.par_iter().map(place).collect()
        };
        let corners: Vec<Vec<DVec3>> = meshes.iter().map(view).collect();
        let farthest = corners.par_iter().flatten().map(|p| p.abs().max_element()).reduce(|| 0.0, f64::max);
        let near = if camera.is_orthographic() { 0.0 } else { NEAR * farthest };
        let triangles = meshes.iter().map(|placed| &placed.mesh.triangles[..]).collect();
        Ok(Self { camera, corners, triangles, focal: camera.focal_px(), near })
    }

    pub(super) fn triangle(&self, mesh: u32, triangle: u32) -> [DVec3; 3] {
        let corners = &self.corners[mesh as usize];
        self.triangles[mesh as usize][triangle as usize].map(|v| corners[v as usize])
    }
}
