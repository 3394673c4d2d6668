//! Particle-based surface and volume rendering: translucency of anything, without sorting.
#![forbid(unsafe_code)]

mod bins;
mod blocks;
mod brownian;
mod checkpoint;
mod cost;
mod ensemble;
mod error;
mod implicit;
mod lines;
mod mesh;
mod metropolis;
pub mod opacity;
mod params;
mod particles;
mod project;
mod render;
mod roots;
mod sampler;
mod shade;
mod splats;
mod stream;
mod volume;
mod volume_field;
mod walk;

pub use brownian::{BrownianParams, BrownianReport, BrownianSampler};
pub use cost::{Counts, Prediction, predict};
pub use ensemble::{Ensemble, EnsembleParams};
pub use error::Error;
pub use implicit::{CellCounts, ImplicitSurface};
pub use lines::{LineReport, LineSampler};
pub use mesh::MeshSampler;
pub use metropolis::{MetropolisParams, MetropolisSampler};
pub use params::{Density, SurfaceParams};
pub use particles::{PackedColor, PackedNormal, Particles};
pub use project::{finest_pixel_area, pixel_area};
pub use render::{FoldParams, Object, Occluder, Renderer, Scene};
pub use sampler::{KeptSets, Sampler};
pub use shade::{Appearance, LitBy};
pub use splats::{SplatParams, SplatSampler};
pub use volume::{GridSampler, VolumeParams};
pub use volume_field::FieldVolumeSampler;
pub use walk::Walk;
