//! The light's image: what it lets through, and the ways of light in volumes.

pub(crate) mod buffer;
pub(crate) mod camera;
pub(crate) mod illuminate;
pub(crate) mod path;
