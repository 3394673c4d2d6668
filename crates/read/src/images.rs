//! Images of radiance: a reader a format.

#[cfg(feature = "exr")]
pub(crate) mod openexr;
#[cfg(feature = "png")]
pub(crate) mod png;
pub(crate) mod radiance;
