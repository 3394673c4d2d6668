//! Scalar fields: formulas, isosurfaces of volumes, surfaces through points, solids of several; and triangles of their zero sets.
//!
//! A field is negative inside ([`splat_core::ScalarField`]). A field has exact derivatives and bounds itself over a ball.
//!
//! ```
//! use field::{CombinedField, ExpressionField};
//! use splat_core::{ScalarField, glam::DVec3};
//! use std::sync::Arc;
//! let ball = Arc::new(ExpressionField::parse("x^2 + y^2 + z^2 - 1").unwrap());
//! let slab = Arc::new(ExpressionField::parse("z^2 - 0.25").unwrap());
//! let ring = CombinedField::difference(ball, slab);
//! assert!(ring.value(DVec3::ZERO) > 0.0 && ring.value(DVec3::Z * 0.75) < 0.0);
//! ```
#![forbid(unsafe_code)]

mod combine;
mod domain;
mod error;
#[cfg(feature = "expression")]
mod expression;
mod grid_field;
mod isosurface_spacing;
mod marching_cubes;
mod mpu;
mod search;
mod solids;
mod surface_nets;

pub use combine::{ClippedField, CombinedField, RegionField, SharedField};
pub use error::FieldError;
#[cfg(feature = "expression")]
pub use expression::{ExpressionError, ExpressionField};
pub use grid_field::{GridField, Inside};
pub use isosurface_spacing::isosurface_spacing;
pub use marching_cubes::isosurface_to_mesh;
pub use mpu::{MpuField, MpuParams, MpuReport, SurfaceSample};
pub use search::{ZeroSearch, extinct_bounds, surface_ends, visible_ends};
pub use solids::{Combination, Solid};
/// The nouns that this crate takes and returns.
pub use splat_core;
pub use surface_nets::{Lattice, evaluations, surface_nets};

/// The page's example compiles and holds.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Page;
