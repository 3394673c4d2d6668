//! Slices on real scenes: hard cases, promises, the recording. One program: it is linked once, and its tests share all cores.

mod common;
mod hard_cases;
mod promises;
#[cfg(feature = "gpu")]
mod recording;
