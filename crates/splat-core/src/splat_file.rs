//! The PLY file of splats: its columns, and how it is written. The crate `read` reads it.

mod columns;
mod write;

pub use columns::{COLUMNS, PACKED, SplatColumn, SplatColumns, Stored, VERSION};
pub use write::{packed_splats_to_ply, splats_to_ply};
