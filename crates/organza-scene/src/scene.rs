//! The whole file, and the scene that it becomes.

pub(crate) mod check;
pub(crate) mod model;
pub(crate) mod raw;
