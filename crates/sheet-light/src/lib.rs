//! Image-aligned sheets: volumes splatted in slabs across the view, classified and shaded after reconstruction.
//!
//! N. Neophytou, K. Mueller, *GPU Accelerated Image Aligned Splatting*, 2005, here on the processor.
#![forbid(unsafe_code)]

mod classify;
mod counts;
mod error;
mod fold;
mod lattice;
mod params;
mod picture;
mod rays;
pub mod reference;
mod ring;
pub mod sections;
mod segments;
mod shade;
mod sheets;
mod slabs;
mod tile;
mod viewed;
mod visible;
mod volume;

pub use counts::SheetCounts;
pub use error::Error;
pub use fold::{Sheeted, prepare};
pub use params::{KernelShape, Params};
pub use volume::{SheetInput, Volume};
