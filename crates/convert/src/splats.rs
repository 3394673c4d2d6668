//! Splats themselves: which footprint each has, 3D Gaussians, and splats that files hold already.

pub(crate) mod footprints;
pub(crate) mod from_splats;
pub(crate) mod gaussian_points;
