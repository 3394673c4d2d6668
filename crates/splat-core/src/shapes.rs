//! What files and memory give: meshes, volumes, fields, 3D Gaussians, and images of heights.

pub(crate) mod field;
pub(crate) mod gaussians;
pub(crate) mod grid;
pub(crate) mod harmonics;
pub(crate) mod height_image;
pub(crate) mod image_levels;
pub(crate) mod mesh;
