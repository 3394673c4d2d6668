//! What lies behind everything: `[background]`.

pub(crate) mod check;
pub(crate) mod model;
pub(crate) mod raw;
