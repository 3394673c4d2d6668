//! What draws the opaque surfaces that techniques keep in a form of their own: handed to a frame, which knows no technique.

use super::Frame;
use crate::{CostRecord, Error};
use splat_core::raster::OpaqueImage;

/// The opaque image of such surfaces. Each is asked for once a frame, when its image is first needed.
#[derive(Clone, Copy)]
pub(crate) struct OpaqueEngines {
    /// That of discs which rays meet exactly, by their ids among the drawn splats.
    pub(crate) discs: fn(&Frame<'_>, &[u32], &mut CostRecord) -> Result<OpaqueImage, Error>,
    /// That of triangles which stay triangles; without any pixel where there are none.
    pub(crate) polygons: fn(&Frame<'_>, &mut CostRecord) -> Result<OpaqueImage, Error>,
}
