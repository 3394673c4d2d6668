//! Lights: `[[light]]`, with slides, and their points.

pub(crate) mod check;
pub(crate) mod model;
pub(crate) mod points;
pub(crate) mod raw;
pub(crate) mod slide;
