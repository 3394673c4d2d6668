//! Slabs across the view axis, front to back, Δs wide: where they begin and how many there are.
//!
//! Depths are counted from the near face of the first slab, subtracted in f64. Some slabs lie before the nearest volume: kernels
//! reach there, and gradients are taken from neighbouring sheets.

use crate::Error;

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

impl Slabs {
    /// Slabs that hold view depths from `near` to `far`, for kernels of radius `reach`.
    pub(crate) fn new(near: f64, far: f64, width: f64, reach: f64) -> Result<Self, Error> {
        let too_many = |what, needed: f64, limit| {
            // What is no number is more than can be counted.
            let needed = if needed.is_nan() { u64::MAX } else { needed as u64 };
            Err(Error::limit(what, needed, u64::from(limit), "slabs", format!("choose slabs wider than {width}")))
        };
        let touched = (2.0 * reach / width).ceil() + 1.0;
        if touched.is_nan() || touched > f64::from(MOST_TOUCHED) {
            return too_many("a kernel", touched, MOST_TOUCHED);
        }
        // A kernel that ends in the first slab of a volume begins so far before it. One more, for that slab's neighbour.
        let before = (2.0 * reach / width).ceil() + 1.0;
        let needed = ((far - near) / width).ceil() + before + 2.0;
        if needed.is_nan() || needed > f64::from(MOST_SLABS) {
            return too_many("the depth of all volumes", needed, MOST_SLABS);
        }
        let count = (needed as u32).next_multiple_of(BATCH);
        Ok(Self { origin: near - before * width, width, count })
    }

    /// Near face of a slab, counted from the first.
    pub(crate) fn face(&self, slab: u32) -> f32 {
        (f64::from(slab) * self.width) as f32
    }
}
