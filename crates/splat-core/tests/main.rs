//! Footprints, opaque rims, shaded points, environments, slides and recordings. One program: it is linked once, and its tests share all cores.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

mod accumulation;
mod environment;
mod extended_lights;
mod image_footprints;
mod opaque_rim;
#[cfg(feature = "gpu")]
mod recording;
mod shaded_points;
mod slides;
mod triangles;
