//! Points around what is seen of some data, for cameras that are placed by it.

use crate::RawPoints;
use splat_core::glam::DVec3;
use splat_core::{DAabb, Mesh, Similarity};

/// Points around data, in its own coordinates.
#[derive(Debug)]
pub enum Outline<'a> {
    /// The corners of all triangles.
    Mesh(&'a Mesh),
    /// All points, with the reach of their discs where these count.
    Points(&'a RawPoints, Option<f64>),
    /// These.
    Places(Vec<DVec3>),
}

impl<'a> Outline<'a> {
    /// Of points: among many a disc reaches no farther than a pixel or two; of Gaussians the bulk.
    pub fn of_points(points: &'a RawPoints) -> Self {
        points.bulk().map_or_else(|| Self::Points(points, points.sparse_reach()), |bulk| Self::of_boxes([bulk]))
    }

    /// Of boxes their corners.
    pub fn of_boxes(boxes: impl IntoIterator<Item = DAabb>) -> Self {
        Self::Places(boxes.into_iter().flat_map(|bounds| bounds.corners()).collect())
    }

    /// Gives all of them, led to the world by a transform.
    pub fn each(&self, transform: &Similarity, add: &mut dyn FnMut(DVec3)) {
        let mut add = |p: DVec3| add(transform.apply(p));
        match self {
            Self::Mesh(mesh) => {
                let corners = mesh.triangles.iter().flatten();
                corners.for_each(|v| add(mesh.origin + mesh.position[*v as usize].as_dvec3()));
            }
            Self::Points(points, reach) => {
                for p in points.position.iter().map(|p| points.origin + p.as_dvec3()) {
                    match reach {
                        Some(reach) => DAabb::around(p, DVec3::splat(*reach)).corners().into_iter().for_each(&mut add),
                        None => add(p),
                    }
                }
            }
            Self::Places(places) => places.iter().copied().for_each(add),
        }
    }
}
