//! Surfaces: meshes and implicit surfaces, where rays meet them, and how they reflect and refract.

pub(crate) mod dielectric;
pub(crate) mod implicit;
pub(crate) mod roots;
pub(crate) mod surface;
pub(crate) mod triangle;
pub(crate) mod visibility;
