//! Volumes: a reader a format, and what these share: voxels, lattices, which of several arrays is read, and cells that become a lattice.

#[cfg(any(feature = "vti", feature = "vtk"))]
pub(crate) mod cells;
pub(crate) mod dicom;
pub(crate) mod lattice;
pub(crate) mod metaimage;
#[cfg(feature = "nifti")]
pub(crate) mod nifti;
pub(crate) mod nrrd;
pub(crate) mod raw;
#[cfg(any(feature = "vti", feature = "vtk"))]
pub(crate) mod rectilinear;
pub(crate) mod selection;
#[cfg(any(feature = "tiff", feature = "png"))]
pub(crate) mod slices;
#[cfg(feature = "tiff")]
pub(crate) mod tiff;
pub(crate) mod voxels;
#[cfg(feature = "vti")]
pub(crate) mod vti;
#[cfg(feature = "vtk")]
pub(crate) mod vtk;

#[cfg(any(feature = "tiff", feature = "png"))]
use splat_core::glam::{DMat3, DVec3};

/// Place and axes of a stack of pictures with these steps: rows run down and the first picture lies in front, so that it is seen upright from there, and nothing
/// is mirrored.
#[cfg(any(feature = "tiff", feature = "png"))]
fn upright(dims: [u64; 3], steps: DVec3) -> (DVec3, DMat3) {
    let [_, rows, slices] = dims.map(|n| n.saturating_sub(1) as f64);
    let origin = DVec3::new(0.0, rows * steps.y, slices * steps.z);
    (origin, DMat3::from_diagonal(steps * DVec3::new(1.0, -1.0, -1.0)))
}

/// A number to six digits, as it is told.
pub(crate) fn rounded(number: f64) -> f64 {
    format!("{number:.5e}").parse().unwrap_or(number)
}
