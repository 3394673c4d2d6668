//! Triangle meshes.

mod columns;
mod creases;
mod cross;
mod halved;
mod vertex_normals;

pub use columns::{Association, MeshColumn};
pub use creases::{crease_bytes, part_at_creases};
pub use cross::robust_cross;
pub use halved::halve_edges;
pub use vertex_normals::{smooth, vertex_normals};

use crate::{DAabb, Error};
use glam::{DVec3, Vec3};
use rayon::prelude::*;
use std::cmp::Ordering;

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
    /// Opacity of one crossing at each vertex, in \[0, 1\], by which that of the object is multiplied; empty where it is 1 everywhere.
    pub opacity: Vec<f32>,
    /// Vertex indices, three a triangle.
    pub triangles: Vec<[u32; 3]>,
    /// Named numbers of vertices or triangles that were asked for.
    pub columns: Vec<MeshColumn>,
}

impl Mesh {
    /// The parallelogram about `center` with half-axes u and v, its normals along u × v.
    pub fn rectangle(center: DVec3, u: DVec3, v: DVec3) -> Self {
        let corner = |s: f64, t: f64| (u * s + v * t).as_vec3();
        Self {
            origin: center,
            position: vec![corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)],
            normal: vec![u.cross(v).normalize_or_zero().as_vec3(); 4],
            triangles: vec![[0, 1, 2], [0, 2, 3]],
            ..Self::default()
        }
    }

    /// Area of all triangles.
    pub fn area(&self) -> f64 {
        let corner = |v: u32| self.position[v as usize].as_dvec3();
        let area = |t: &[u32; 3]| 0.5 * (corner(t[1]) - corner(t[0])).cross(corner(t[2]) - corner(t[0])).length();
        self.triangles.iter().map(area).sum()
    }

    /// Puts triangles in an order that follows from where their corners are, and begins each with its least corner: however a file lists the same
    /// triangles, they come out alike. Triangles with the same corners keep the order of their indices.
    pub fn canonicalize(&mut self) {
        let position = &self.position;
        let compare = |a: u32, b: u32| {
            let a = position[a as usize];
            let b = position[b as usize];
            a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)).then(a.z.total_cmp(&b.z))
        };
        self.triangles.par_iter_mut().with_min_len(4096).for_each(|triangle| {
            let least = (0..3).min_by(|a, b| compare(triangle[*a], triangle[*b])).unwrap_or(0);
            triangle.rotate_left(least);
        });
        self.triangles.par_sort_unstable_by(|a, b| {
            let corners = a.iter().zip(b).map(|(a, b)| compare(*a, *b));
            corners.fold(Ordering::Equal, Ordering::then).then(a.cmp(b))
        });
    }

    /// A box in the world around all vertices that triangles use.
    pub fn bounds(&self) -> DAabb {
        DAabb::of_points(self.triangles.iter().flatten().map(|v| self.origin + self.position[*v as usize].as_dvec3()))
    }

    /// The least opacity of a vertex; 1 for a mesh without opacities.
    pub fn least_opacity(&self) -> f32 {
        self.opacity.iter().copied().fold(1.0, f32::min)
    }

    /// Appends a vertex at the place of vertex `v`, with its colour and its opacity. The normal, and the numbers of columns of vertices, are
    /// left to the caller.
    pub fn push_copy(&mut self, v: usize) {
        self.position.push(self.position[v]);
        self.color.extend(self.color.get(v).copied());
        self.opacity.extend(self.opacity.get(v).copied());
    }

    /// Bytes held by vertices, indices and columns.
    pub fn bytes(&self) -> u64 {
        let vertices = size_of_val(self.position.as_slice()) + size_of_val(self.normal.as_slice());
        let looks = size_of_val(self.color.as_slice()) + size_of_val(self.opacity.as_slice());
        let columns = self.columns.iter().map(|column| size_of_val(column.values.as_slice())).sum::<usize>();
        (vertices + looks + size_of_val(self.triangles.as_slice()) + columns) as u64
    }

    /// Checks column lengths, finite positions, opacities and index range.
    ///
    /// # Errors
    /// [`Error::Invalid`] or [`Error::ColumnLength`] for the first that does not hold.
    pub fn validate(&self) -> Result<(), Error> {
        let n = self.position.len();
        let lengths = [("normal", self.normal.len()), ("color", self.color.len()), ("opacity", self.opacity.len())];
        for (attribute, found) in lengths {
            if found != 0 && found != n {
                return Err(Error::ColumnLength { attribute, found, expected: n });
            }
        }
        if let Some(i) = self.position.iter().position(|p| !p.is_finite()) {
            return Err(Error::invalid("vertex", i, "position", self.position[i], "finite numbers"));
        }
        if let Some(i) = self.opacity.iter().position(|share| !(0.0..=1.0).contains(share)) {
            return Err(Error::invalid("vertex", i, "opacity", self.opacity[i], "a number in [0, 1]"));
        }
        for column in &self.columns {
            let expected = column.association.count(self);
            if column.values.len() != expected {
                return Err(Error::ColumnLength { attribute: "columns", found: column.values.len(), expected });
            }
        }
        if let Some(i) = self.triangles.iter().position(|t| t.iter().any(|&v| v as usize >= n)) {
            return Err(Error::invalid("face", i, "vertex index", self.triangles[i], "less than the vertex count"));
        }
        Ok(())
    }
}
