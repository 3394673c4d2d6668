//! Particle-based rendering: translucency of surfaces and volumes, without sorting.
//!
//! S. Tanaka et al.: *Particle-Based Transparent Rendering of Implicit Surfaces and its Application to Fused
//! Visualization*, Eurographics 2012 short papers (PBSR); with particle-based volume rendering (PBVR) for media.
//!
//! Everything becomes opaque particles, as small as pixels, at random places. An image of them by a depth buffer is a
//! sample of the picture; the mean of many is the picture, with objects that overlap or intersect in any way. A
//! [`Sampler`] makes the sets, [`Renderer::fold`] adds them to an [`Ensemble`], which can be read after any number.
//!
//! ```
//! use pbsr::{Appearance, Ensemble, EnsembleParams, FoldParams, ImplicitSurface, LineParams, LineSampler, Object};
//! use pbsr::{Renderer, Scene, SurfaceParams, pixel_area};
//! use splat_core::glam::DVec3;
//! use splat_core::{Camera, DAabb, Projection, ScalarField, Similarity};
//!
//! struct Ball;
//! impl ScalarField for Ball {
//!     fn value(&self, p: DVec3) -> f64 { p.length_squared() - 1.0 }
//!     fn gradient(&self, p: DVec3) -> DVec3 { 2.0 * p }
//!     fn bound(&self, p: DVec3, r: f64) -> Option<(f64, f64)> {
//!         let [near, far] = [(p.length() - r).max(0.0), p.length() + r];
//!         Some((near * near - 1.0, far * far - 1.0))
//!     }
//! }
//!
//! let view = Projection::Orthographic { height: 2.4 };
//! let camera = Camera::look_at(DVec3::Z * 4.0, DVec3::ZERO, DVec3::Y, view, [48, 48]).unwrap();
//! let bounds = DAabb::around(DVec3::ZERO, DVec3::splat(1.1));
//! let ball = ImplicitSurface { field: &Ball, level: 0.0, bounds, inside: None };
//! let params = SurfaceParams { opacity: 0.3, cross_section: pixel_area(&camera, DVec3::Z), ..SurfaceParams::default() };
//! let sampler = LineSampler::new(&ball, &LineParams { resolution: 16 }, &params, None).unwrap();
//!
//! let objects = [Object { sampler: &sampler, transform: Similarity::default(), look: Appearance::default() }];
//! let shadow_origin = DVec3::ZERO;
//! let scene = Scene { objects: &objects, lights: &[], shadow_origin, ambient: [1.0; 3], camera: &camera, occluder: None };
//! let mut ensemble = Ensemble::new(camera.size, &EnsembleParams::default()).unwrap();
//! Renderer::new().fold(&scene, &mut ensemble, &FoldParams { levels: 100, ..FoldParams::default() }, None).unwrap();
//! let picture = ensemble.read(&|_, _| [0.0; 3], None);
//! // Front and back: 1 − 0.7² = 0.51.
//! let alpha = picture.scalar("alpha").unwrap()[24 * 48 + 24];
//! assert!((alpha - 0.51).abs() < 0.2, "{alpha}");
//! ```
//!
//! # Complexity
//! O(n) for n particles; n is the optical depth of all surfaces and media, in pixels, times the repeat level. The error of
//! a pixel of opacity α after L sets is √(α(1 − α)/L). See `README.md` for symbols, deviations from the paper, and speed.
#![forbid(unsafe_code)]

mod blocks;
mod cost;
mod ensemble;
mod error;
#[cfg(feature = "gpu")]
pub mod gpu;
mod media;
pub mod opacity;
mod params;
mod particles;
mod project;
#[cfg(feature = "reference")]
pub mod reference;
mod render;
mod sampler;
mod scene;
mod shown;
mod stream;
mod surfaces;

pub use cost::{Counts, Prediction, predict};
pub use ensemble::{Ensemble, EnsembleParams};
pub use error::Error;
pub use media::bounded::{BoundedExtinction, Matter};
pub use media::metropolis::{MetropolisParams, MetropolisSampler};
pub use media::splats::{SplatParams, SplatSampler};
pub use media::volume::{GridSampler, VolumeParams};
pub use media::volume_field::{FieldVolumeParams, FieldVolumeSampler};
pub use params::{Density, SurfaceParams};
pub use particles::{PackedColor, PackedNormal, Particles};
pub use project::shade::Appearance;
pub use project::{depth_range, finest_pixel_area, pixel_area};
pub use render::Renderer;
pub use sampler::{KeptSets, Sampler};
pub use scene::{FoldParams, Object, Scene};
pub use shown::{Look, ShownSampler};
/// The nouns that this crate takes and returns.
pub use splat_core;
pub use splat_core::shade::LitBy;
pub use surfaces::brownian::{BrownianParams, BrownianReport, BrownianSampler};
pub use surfaces::implicit::{CellCounts, ImplicitSurface};
pub use surfaces::lattice::LatticeSampler;
pub use surfaces::lines::{LineParams, LineReport, LineSampler};
pub use surfaces::mesh::MeshSampler;
pub use surfaces::walk::Walk;

/// The page's example compiles and holds.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Page;
