//! Slices on real scenes: hard cases, promises, the recording. One program: it is linked once, and its tests share all cores.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

mod along;
mod common;
mod hard_cases;
mod promises;
#[cfg(feature = "gpu")]
mod recording;
