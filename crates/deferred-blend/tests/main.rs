//! Tests of deferred blending.

mod blend;
mod floored;
mod glass;
mod grouping;
mod hard_cases;
mod opaque;
mod scenes;
mod shade;
