//! Splats in the slabs, for the eye and for the light.

pub(crate) mod light;
pub(crate) mod sheets;
pub(crate) mod squares;
