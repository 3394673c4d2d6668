//! The nouns of splatting, shared by every stage of Organza, and the CPU rasterization of footprints.
//!
//! A scene of meshes, volumes, raw point clouds and implicit surfaces becomes one [`Cloud`] of splats with the
//! rendering-oriented attributes of Gunjee 2007, section 3. Stages meet through the types of this crate alone:
//! `convert` makes clouds, `hbsort` makes a [`SliceOrder`], `tsm` implements [`Transmittance`], and
//! [`raster`] folds shaded splats into an [`Accumulator`].
//!
//! Conventions: right-handed, +Y up, the camera looks along −Z; positions are an f64 origin plus f32 offsets;
//! colours are linear Rec.709; optical depth and absorbance are Napierian; view depth is linear and positive in front.
#![forbid(unsafe_code)]

mod camera;
mod canonical;
mod cloud;
mod cost;
mod depth_profile;
mod error;
mod field;
mod footprint;
mod grid;
mod layers;
mod light;
mod material;
mod mesh;
pub mod optics;
mod phase;
mod pixel_samples;
mod progress;
pub mod rng;
mod slice_order;
mod space;
mod transfer;
mod transmittance;

#[cfg(feature = "raster")]
pub mod raster;
#[cfg(feature = "raster")]
pub mod shade;

pub use camera::{Camera, Projection, ViewTransform};
pub use cloud::{Cloud, Splat, SplatKind};
pub use cost::{CostRecord, StageCost};
pub use depth_profile::{DepthFragment, DepthProfile};
pub use error::Error;
pub use field::ScalarField;
pub use footprint::{Footprint, FootprintStack};
pub use glam;
pub use grid::Grid;
pub use layers::{ADDITIVE_LAYERS, Accumulator, LayerData, LayerSet, Layers, SHADED_EFFECTS};
pub use light::{Light, LightShape};
pub use material::{Material, MaterialTable, Object, ObjectTable, Shading};
pub use mesh::Mesh;
pub use phase::henyey_greenstein;
pub use pixel_samples::PixelSamples;
pub use progress::Progress;
pub use slice_order::{Direction, SliceOrder};
pub use space::{Aabb, DAabb, Similarity};
pub use transfer::{TransferFunction, TransferPoint};
pub use transmittance::{Receiver, Transmittance};
