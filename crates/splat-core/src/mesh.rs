//! Triangle meshes.

use crate::Error;
use glam::{DVec3, Vec3};

/// Indexed triangles; vertices relative to an f64 origin.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Mesh {
    /// World position that every vertex is relative to.
    pub origin: DVec3,
    /// Vertex positions.
    pub position: Vec<Vec3>,
    /// Unit vertex normals; empty when the file has none.
    pub normal: Vec<Vec3>,
    /// Linear Rec.709 vertex colours; empty when the file has none.
    pub color: Vec<[f32; 3]>,
    /// Vertex indices, three a triangle.
    pub triangles: Vec<[u32; 3]>,
}

impl Mesh {
    /// Checks column lengths, finite positions and index range.
    ///
    /// # Errors
    /// [`Error::Invalid`] or [`Error::ColumnLength`] for the first that does not hold.
    pub fn validate(&self) -> Result<(), Error> {
        let n = self.position.len();
        for (attribute, found) in [("normal", self.normal.len()), ("color", self.color.len())] {
            if found != 0 && found != n {
                return Err(Error::ColumnLength { attribute, found, expected: n });
            }
        }
        if let Some(i) = self.position.iter().position(|p| !p.is_finite()) {
            return Err(Error::invalid("vertex", i, "position", self.position[i], "finite numbers"));
        }
        if let Some(i) = self.triangles.iter().position(|t| t.iter().any(|&v| v as usize >= n)) {
            return Err(Error::invalid("face", i, "vertex index", self.triangles[i], "less than the vertex count"));
        }
        Ok(())
    }
}
