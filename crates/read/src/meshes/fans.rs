//! Faces as they are read, one after the other: fans of triangles until all vertices are known.

use super::polygon::{self, Polygon};
use crate::error::{Place, ReadError};
use crate::reading::{Fix, Reading};
use crate::stream::input::{self, Growing};
use splat_core::Mesh;

/// The faces so far.
pub(crate) struct Fans {
    triangles: Vec<[u32; 3]>,
    /// Faces of more than three corners, and where they are.
    polygons: Vec<Polygon>,
    places: Vec<Place>,
    /// Memory of the triangles, and of what is known of larger faces.
    held: Growing,
}

impl Default for Fans {
    fn default() -> Self {
        let held = Growing::new("the triangles");
        Self { triangles: Vec::new(), polygons: Vec::new(), places: Vec::new(), held }
    }
}

impl Fans {
    /// Takes the face of that number; one of fewer than three corners is left out.
    pub(crate) fn add(
        &mut self,
        face: u64,
        corners: &[u32],
        place: Place,
        reading: &mut Reading<'_>,
    ) -> Result<(), ReadError> {
        let Some(count) = corners.len().checked_sub(2).filter(|n| *n > 0) else {
            return reading.mend(Fix::TooFewCorners, place, Some(face), || {
                let expected = format!("3 or more corners of face {face}");
                ReadError::input(place, expected, corners.len().to_string(), "remove degenerate faces")
            });
        };
        let polygons = self.polygons.len() * (size_of::<Polygon>() + size_of::<Place>());
        let bytes = (self.triangles.len() + count) * size_of::<[u32; 3]>() + polygons;
        self.held.hold(bytes as u64, reading.params)?;
        input::reserve(&mut self.triangles, count)?;
        if count > 1 {
            input::reserve(&mut self.polygons, 1)?;
            input::reserve(&mut self.places, 1)?;
            self.polygons.push(Polygon { face, first: self.triangles.len(), count });
            self.places.push(place.whole_line());
        }
        self.triangles.extend(corners.windows(2).skip(1).map(|pair| [corners[0], pair[0], pair[1]]));
        Ok(())
    }

    /// Triangles so far.
    pub(crate) fn len(&self) -> usize {
        self.triangles.len()
    }

    /// The mesh of these vertices; columns of triangles are in the order of the fans.
    pub(crate) fn into_mesh(self, vertices: Mesh, reading: &mut Reading<'_>) -> Result<Mesh, ReadError> {
        let mut mesh = Mesh { triangles: self.triangles, ..vertices };
        polygon::triangulate(&mut mesh, &self.polygons, reading, |rank| self.places[rank])?;
        Ok(mesh)
    }
}
