//! The bytes of a file in their order, whether packed, beside a header, or in another file.

pub(crate) mod beside;
pub(crate) mod detached;
pub(crate) mod inflate;
pub(crate) mod input;
mod unpacked;
