//! What all conversions share: parameters, errors, columns of clouds, results that are kept.

#[cfg(feature = "cache")]
pub(crate) mod cache;
pub(crate) mod columns;
pub(crate) mod convert_error;
pub(crate) mod extremes;
pub(crate) mod params;
