//! Fields and their triangles against closed forms. One program: it is linked once, and its tests share all cores.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

mod grid_fields;
mod marching_cubes;
mod readme;
