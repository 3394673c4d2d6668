//! CPU rasterization of footprints: tiled, parallel, bit-identical for any thread count.
//!
//! 1. [`project`] turns all splats into image-space footprints: exact in perspective for media (the squared distance of a
//!    ray from a centre is a quadratic form in the pixel offset over |d|²), an affine conic for tangent discs and Gaussians.
//! 2. [`resolve_opaque`] finds the nearest opaque surface of each pixel by ε-z and normalised weights Σwc/Σw. [`NearestSurfaces`] and [`Cover`] tell
//!    which splats are seen at all, before any is shaded.
//! 3. [`fold`] composites translucent splats in a [`crate::SliceOrder`] in front of it.
//! 4. [`finish`] adds the opaque surface and the background, and box-filters samples to pixels.
//!
//! What blends splats in another way walks the same tiles ([`tile`]) over the same lists ([`bins`]), on the same lanes ([`lanes`]), with
//! the same profiles ([`kernel`]) and fragments ([`source`]).
//!
//! Meshes whose triangles stay triangles have a rasterizer of their own ([`triangles`]), for the eye and for lights.
//!
//! Every pixel belongs to one task and its splats are visited in list order, so the result does not depend on threads.

mod append;
pub mod bins;
mod cost;
mod finish;
mod gather;
mod gaussian;
#[cfg(feature = "gpu")]
pub mod gpu;
pub mod kernel;
pub mod lanes;
mod opaque;
mod project;
mod projected;
mod shapes;
pub mod source;
mod special;
pub mod tile;
mod translucent;
pub mod triangles;

pub use crate::Accumulation;
pub use cost::{Expected, expected, objects_in_view, tile_bytes};
pub use finish::{Background, FinishInput, GlassImage, finish};
pub use opaque::{Cover, NearestSurfaces, OpaqueImage, OpaqueInput, resolve_opaque};
pub use project::{ProjectInput, project, project_into};
pub use projected::{Detail, Projected, ProjectedDepth, ProjectedSplat, SpecialDisc};
pub use pulp;
pub use translucent::{FoldInput, Reached, fold};

/// What rasterization may trade.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Params {
    /// Standard deviation of the resampling filter, pixels, ≥ 0: footprints are widened so that none falls between
    /// pixels, their cross-section kept (EWA). 0 turns it off.
    pub resampling_sigma_px: f32,
    /// A pixel is done when its transmittance is below this; bounds the error by `cutoff` times the radiance behind.
    pub transmittance_cutoff: f32,
    /// Precision of the running sums.
    pub accumulation: Accumulation,
}

impl Default for Params {
    fn default() -> Self {
        Self { resampling_sigma_px: 0.5, transmittance_cutoff: 1e-6, accumulation: Accumulation::F32 }
    }
}

/// Work done by a rasterization step, for the cost record.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct RasterCounts {
    /// Splats that reach at least one tile.
    pub splats: u64,
    /// Entries of the tile lists.
    pub tile_entries: u64,
    /// Fragments evaluated, masked lanes included.
    pub fragments: u64,
    /// Bytes of the buffers made.
    pub bytes: u64,
}
