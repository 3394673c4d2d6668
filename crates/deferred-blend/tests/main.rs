//! Tests of deferred blending.

mod blend;
mod glass;
mod grouping;
mod scenes;
