//! Triangles become discs. Before that they may be cut, closed again and divided.

pub(crate) mod borders;
pub(crate) mod clipped_mesh;
#[cfg(feature = "lids")]
pub(crate) mod lid;
pub(crate) mod mesh_points;
pub(crate) mod pieces;
pub(crate) mod subdivide;
pub(crate) mod surface_colors;
