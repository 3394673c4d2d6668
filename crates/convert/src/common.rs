//! Shared by all conversions: parameters, errors, columns of clouds, cached results.

#[cfg(feature = "cache")]
pub(crate) mod cache;
pub(crate) mod columns;
pub(crate) mod convert_error;
pub(crate) mod extremes;
pub(crate) mod params;
