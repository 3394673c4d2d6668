//! Shadow maps: closed forms, continuity, invariances, the recording. One program: it is linked once, and its tests share all cores.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

mod automatic;
mod common;
mod continuity;
mod estimate;
mod folds;
mod invariance;
mod light;
mod mappings;
#[cfg(feature = "gpu")]
mod recording;
mod surfaces;
