//! Footprints, opaque rims, packed clouds, shaded points, environments, slides, traces and recordings. One program: it is linked once, and its tests share all cores.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

mod accumulation;
mod closed_forms;
mod drawn;
mod environment;
mod extended_lights;
mod hidden;
mod image_footprints;
mod lattice;
mod opaque_rim;
mod packed;
#[cfg(feature = "gpu")]
mod recording;
mod shaded_points;
mod slides;
mod traces;
mod triangles;
