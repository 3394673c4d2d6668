//! Named numbers of meshes, which colours may be taken from.

use super::Mesh;
use crate::glam::DVec3;

/// What the numbers of a column belong to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Association {
    /// One number a vertex; between vertices they are interpolated.
    Vertex,
    /// One number a triangle, the same all over it.
    Triangle,
}

/// Numbers of a mesh that have no other meaning to it.
#[derive(Debug, Clone, PartialEq)]
pub struct MeshColumn {
    /// Its name in the file; of one of several numbers with a colon and which: `U:magnitude`, `U:x`.
    pub name: String,
    /// What the numbers belong to.
    pub association: Association,
    /// One a vertex or triangle; gaps are not finite.
    pub values: Vec<f64>,
}

/// Names of the coordinates of vertices, which every mesh has.
const COORDINATES: [&str; 4] = ["x", "y", "z", "height"];

impl Association {
    /// Numbers that a column of a mesh has.
    pub fn count(self, mesh: &Mesh) -> usize {
        match self {
            Self::Vertex => mesh.position.len(),
            Self::Triangle => mesh.triangles.len(),
        }
    }

    /// What the numbers belong to, in messages.
    pub fn name(self) -> &'static str {
        match self {
            Self::Vertex => "vertices",
            Self::Triangle => "faces",
        }
    }
}

impl Mesh {
    /// The column of a name: one of [`Mesh::columns`], else a coordinate of the vertices in the mesh's own unit: `x`, `y`, `z`, or `height`, that
    /// along `up`.
    ///
    /// ```
    /// use splat_core::{Mesh, glam::DVec3};
    /// let mesh = Mesh::rectangle(DVec3::Z, DVec3::X, DVec3::Y);
    /// assert_eq!(mesh.column("height", DVec3::Y).unwrap().values, [-1.0, -1.0, 1.0, 1.0]);
    /// assert!(mesh.column("heat", DVec3::Y).is_none());
    /// ```
    pub fn column(&self, name: &str, up: DVec3) -> Option<MeshColumn> {
        if let Some(column) = self.columns.iter().find(|column| column.name == name) {
            return Some(column.clone());
        }
        let axis = match name {
            "x" => DVec3::X,
            "y" => DVec3::Y,
            "z" => DVec3::Z,
            "height" => up,
            _ => return None,
        };
        let values = self.position.iter().map(|p| (self.origin + p.as_dvec3()).dot(axis)).collect();
        Some(MeshColumn { name: name.to_owned(), association: Association::Vertex, values })
    }

    /// Whether [`Mesh::column`] knows a name.
    pub fn has_column(&self, name: &str) -> bool {
        COORDINATES.contains(&name) || self.columns.iter().any(|column| column.name == name)
    }

    /// Names that [`Mesh::column`] knows for this mesh.
    pub fn column_names(&self) -> impl Iterator<Item = &str> {
        COORDINATES.into_iter().chain(self.columns.iter().map(|column| column.name.as_str()))
    }
}
