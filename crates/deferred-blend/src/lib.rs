//! Deferred blending: smooth surfaces from discs that overlap, opaque and transparent (Zhang and Pajarola 2007).
//!
//! A point-sampled surface is a set of discs, several of which cover each of its points. Two blends compete in a pixel: discs of
//! one layer are averaged by their weights (Eq. 1), layers are composited one behind the other. [`grouping`] separates the discs
//! into groups whose members do not overlap, so that within a group only the second blend is left.
#![forbid(unsafe_code)]

mod error;
pub mod grouping;

pub use error::Error;
