//! Deferred blending: smooth surfaces from discs that overlap, opaque and transparent (Zhang and Pajarola 2007).
//!
//! A point-sampled surface is a set of discs, several of which cover each of its points. Two blends compete in a pixel: discs of
//! one layer are averaged by their weights (Eq. 1), layers are composited one behind the other. [`grouping`] separates the discs
//! into groups whose members do not overlap, so that within a group only the second blend is left.
#![forbid(unsafe_code)]

mod blend;
mod bump;
mod cone;
mod disc;
mod error;
mod floored;
mod fragments;
mod glass;
pub mod grouping;
mod interface;
mod layer;
mod layers;
mod opaque;
mod params;
#[cfg(feature = "reference")]
pub mod reference;
mod shade;
mod surfaces;
mod tile;
mod trace;

pub use blend::{BlendCounts, BlendInput, Blended, blend};
pub use disc::{DiscInput, Discs};
pub use error::Error;
pub use floored::{Floors, Layering};
pub use glass::{Bending, Glass};
pub use opaque::{Opaque, OpaqueInput, Passes, resolve_opaque};
pub use params::Params;
pub use shade::{Light, Shown};
/// The nouns that this crate takes and returns.
pub use splat_core;
pub use surfaces::Surfaces;

/// The page's example compiles and holds.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Page;
