//! The camera: `[camera]`, or one that finds its place.

pub(crate) mod check;
pub(crate) mod fit;
pub(crate) mod raw;
