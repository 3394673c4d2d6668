//! Where the data of an object comes from: its keys `mesh`, `points`, `volume`, `implicit` … with transfer functions and fields; and data that a program has in memory.

pub(crate) mod check;
pub(crate) mod extract;
pub(crate) mod field;
pub(crate) mod in_memory;
pub(crate) mod model;
pub(crate) mod raw;
pub(crate) mod transfer;
