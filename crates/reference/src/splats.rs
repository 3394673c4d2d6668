//! Splats as they are defined, composited in exact order.

pub(crate) mod composite;
pub(crate) mod footprint;
pub(crate) mod gaussian;
pub(crate) mod pattern;
pub(crate) mod pixel;
