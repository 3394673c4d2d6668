//! Particles: distributions, bias, extents, layers, the recording. One program: it is linked once, and its tests share all cores.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

mod bias;
mod brownian;
mod colored;
mod colors;
mod common;
mod ensemble;
mod extent;
mod lines;
#[cfg(feature = "gpu")]
mod recording;
mod uniformity;
