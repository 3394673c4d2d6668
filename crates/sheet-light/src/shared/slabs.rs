//! Slabs across the view axis, front to back, Δs wide: where they begin and how many there are.
//!
//! Depths are counted from the near face of the first slab, subtracted in f64. Some slabs lie before the nearest volume: kernels
//! reach there, and gradients are taken from neighbouring sheets.

use super::depths::DepthRange;
use crate::Error;

/// Most slabs where splats alone say how wide they are.
pub(crate) const MOST_BY_SPLATS: f64 = 65536.0;

/// Most slabs.
const MOST_SLABS: u32 = 1 << 20;

/// Most slabs that a kernel may touch.
const MOST_TOUCHED: u32 = 512;

/// Slabs whose sheets are finished together: half of the eight that a pixel's line holds, so that a kernel of up to five
/// sections finds room for all of them.
pub(crate) const BATCH: u32 = 4;

/// The slabs of one view.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Slabs {
    /// View depth of the near face of the first slab.
    pub(crate) origin: f64,
    /// Δs, world units.
    pub(crate) width: f64,
    /// Slabs, a multiple of [`BATCH`]. The last ones lie behind all volumes.
    pub(crate) count: u32,
}

/// Kernels of one volume.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Kernels {
    /// Radius along the view, world units.
    pub(crate) reach: f64,
    /// Slabs that one of the volume's own is wide.
    pub(crate) stride: u32,
}

impl Slabs {
    /// Slabs that hold view depths from `near` to `far`, for kernels of radius `reach`.
    pub(crate) fn new(near: f64, far: f64, width: f64, reach: f64) -> Result<Self, Error> {
        Self::for_kernels(near, far, width, &[Kernels { reach, stride: 1 }])
    }

    /// Slabs that hold view depths from `near` to `far`, and the slabs of all volumes, each of which is some of these.
    pub(crate) fn for_kernels(near: f64, far: f64, width: f64, kernels: &[Kernels]) -> Result<Self, Error> {
        let too_many = |what, needed: f64, limit| {
            // What is no number is more than can be counted.
            let needed = if needed.is_nan() { u64::MAX } else { needed as u64 };
            Err(Error::limit(what, needed, u64::from(limit), "slabs", format!("choose slabs wider than {width}")))
        };
        let mut before = 1.0f64;
        let mut behind = 1.0f64;
        for Kernels { reach, stride } in kernels {
            let stride = f64::from(*stride);
            let touched = (2.0 * reach / (width * stride)).ceil() + 1.0;
            if touched.is_nan() || touched > f64::from(MOST_TOUCHED) {
                return too_many("a kernel", touched, MOST_TOUCHED);
            }
            // A kernel that ends in the first slab of a volume begins so far before it. One more, for that slab's neighbour.
            before = before.max((2.0 * reach / width).ceil() + stride);
            behind = behind.max(stride);
        }
        let needed = ((far - near) / width).ceil() + before + behind + 1.0;
        if needed.is_nan() || needed > f64::from(MOST_SLABS) {
            return too_many("the depth of all volumes", needed, MOST_SLABS);
        }
        let count = (needed as u32).next_multiple_of(BATCH);
        Ok(Self { origin: near - before * width, width, count })
    }

    /// Slabs that are `stride` of these wide each.
    pub(crate) fn wider(&self, stride: u32) -> Self {
        let count = self.count.div_ceil(stride).next_multiple_of(BATCH);
        Self { origin: self.origin, width: self.width * f64::from(stride), count }
    }

    /// Near face of a slab, counted from the first.
    pub(crate) fn face(&self, slab: u32) -> f32 {
        (f64::from(slab) * self.width) as f32
    }

    /// Both faces of a slab.
    #[inline(always)]
    pub(crate) fn faces(&self, slab: u32) -> DepthRange {
        DepthRange { near: self.face(slab), far: self.face(slab + 1) }
    }

    /// The slab at a view depth, or the first or the one behind the last.
    pub(crate) fn slab_at(&self, depth: f64) -> u32 {
        ((depth - self.origin) / self.width).clamp(0.0, f64::from(self.count)) as u32
    }
}
