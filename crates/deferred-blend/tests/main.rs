//! Tests of deferred blending.

mod blend;
mod grouping;
mod scenes;
