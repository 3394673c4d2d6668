//! Materials: `[material.NAME]`.

pub(crate) mod check;
pub(crate) mod model;
pub(crate) mod raw;
pub(crate) mod recipes;
pub(crate) mod tint;
