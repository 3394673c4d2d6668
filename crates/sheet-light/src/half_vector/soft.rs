//! Soft shadows: the images of the points of a light with an extent.

pub(crate) mod buffer;
pub(crate) mod moved;
pub(crate) mod penumbra;
