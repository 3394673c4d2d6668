//! A finished map read: the light that arrives, and other queries.

pub(crate) mod lookup;
pub(crate) mod patch;
pub(crate) mod query;
pub(crate) mod wider;
