//! Points: a reader a format, and what these share: further columns, origins, directions, 3D Gaussians. PLY is among the meshes.

#[cfg(feature = "las")]
pub(crate) mod copc;
pub(crate) mod direction;
#[cfg(feature = "e57")]
pub(crate) mod e57;
pub(crate) mod extras;
pub(crate) mod gaussians;
pub(crate) mod ksplat;
#[cfg(feature = "las")]
pub(crate) mod las;
#[cfg(feature = "las")]
pub(crate) mod laz;
pub(crate) mod origin;
pub(crate) mod pcd;
#[cfg(feature = "sog")]
pub(crate) mod sog;
pub(crate) mod splat;
pub(crate) mod spz;
pub(crate) mod xyz;
