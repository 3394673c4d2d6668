//! Depths along rays and across slabs, in single precision: counted from the near face of the first slab.

use splat_core::raster::lanes::MAX_LANES;

/// All depths from one to another.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct DepthRange {
    pub(crate) near: f32,
    pub(crate) far: f32,
}

/// Depths between which neighbouring rays have a part; beyond each other where they have none.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct DepthSpans {
    pub(crate) from: [f32; MAX_LANES],
    pub(crate) to: [f32; MAX_LANES],
}

impl DepthSpans {
    /// All of each ray.
    pub(crate) const WHOLE: Self = Self { from: [f32::NEG_INFINITY; MAX_LANES], to: [f32::INFINITY; MAX_LANES] };
}

/// Share of what is as thick as this around a depth that lies before a place.
#[inline]
pub(crate) fn share_before(place: f32, depth: f32, thickness: f32) -> f32 {
    if thickness == 0.0 {
        f32::from(u8::from(depth < place))
    } else {
        ((place - depth) / thickness + 0.5).clamp(0.0, 1.0)
    }
}
