//! Points: a reader a format, and what these share: further columns, origins, directions, 3D Gaussians. PLY is among the meshes.

#[cfg(feature = "las")]
pub(crate) mod copc;
pub(crate) mod direction;
#[cfg(feature = "e57")]
pub(crate) mod e57;
pub(crate) mod extras;
pub(crate) mod gaussians;
#[cfg(feature = "las")]
pub(crate) mod las;
#[cfg(feature = "las")]
pub(crate) mod laz;
pub(crate) mod origin;
pub(crate) mod pcd;
pub(crate) mod splat;
pub(crate) mod spz;
pub(crate) mod xyz;
