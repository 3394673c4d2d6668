//! Footprints: `footprints`, and what objects choose of them.

pub(crate) mod check;
pub(crate) mod raw;
