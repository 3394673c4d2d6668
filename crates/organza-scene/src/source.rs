//! Where the data of an object comes from: its keys `mesh`, `points`, `volume`, `implicit` … with transfer functions and fields.

pub(crate) mod check;
pub(crate) mod extract;
pub(crate) mod field;
pub(crate) mod model;
pub(crate) mod raw;
pub(crate) mod transfer;
