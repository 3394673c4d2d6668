//! Points as files give them, before they become splats: what `read` reads and `convert` converts.

pub mod attributes;
mod raw_points;
mod ready_splats;

pub use raw_points::{Column, PointCell, PointLattice, RawPoints, unaliased};
pub use ready_splats::ReadySplats;
