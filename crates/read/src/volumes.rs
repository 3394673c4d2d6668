//! Volumes: a reader a format, and what these share: voxels, lattices, which of several arrays is read, and cells that become a lattice.

#[cfg(any(feature = "vti", feature = "vtk"))]
pub(crate) mod cells;
pub(crate) mod lattice;
pub(crate) mod metaimage;
#[cfg(feature = "nifti")]
pub(crate) mod nifti;
pub(crate) mod nrrd;
pub(crate) mod raw;
#[cfg(any(feature = "vti", feature = "vtk"))]
pub(crate) mod rectilinear;
pub(crate) mod selection;
pub(crate) mod voxels;
#[cfg(feature = "vti")]
pub(crate) mod vti;
#[cfg(feature = "vtk")]
pub(crate) mod vtk;
