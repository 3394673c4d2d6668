//! Samplers of surfaces: meshes, implicit surfaces, isosurfaces of volumes.

pub(crate) mod brownian;
pub(crate) mod implicit;
pub(crate) mod lattice;
pub(crate) mod leaves;
pub(crate) mod lines;
pub(crate) mod mesh;
pub(crate) mod roots;
pub(crate) mod walk;
