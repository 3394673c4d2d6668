//! Path tracing and metrics against closed forms. One program: it is linked once, and its tests share all cores.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

mod agrees_with_raster;
mod classified;
mod flip;
mod path_liberties;
mod path_media;
mod path_surfaces;
mod support;
mod surfaces;
