//! Parameters of a sort: direction, slice thickness, exactness, limits.

use crate::Error;
use splat_core::Direction;

/// The source of the slice thickness ε.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Thickness {
    /// The smallest splat radius (Gunjee 2007, section 4.2), or the first percentile of the radii when a few tiny
    /// splats would rule; [`crate::SortInfo::rule`] says which.
    #[default]
    Auto,
    /// A thickness in world units, finite and at least 1e-300.
    World(f64),
}

/// Parameters of a sort.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Params {
    /// The end of the view that comes first; default back to front, as in the paper.
    pub direction: Direction,
    /// Slice thickness ε.
    pub thickness: Thickness,
    /// Order inside slices too: (slice, depth, id). Otherwise splats of one slice stand in the order of their ids.
    pub exact: bool,
    /// The most slices that the two levels of buckets may hold, at most [`Params::MOST_SLICES`]. Beyond, splats are
    /// sorted by the bits of their depth, which is exact, and slices are cut afterwards.
    pub max_slices: u64,
    /// Widens the image by this many pixels on each side before culling, for a renderer whose resampling filter
    /// reaches further than the splat; ≥ 0.
    pub margin_px: f64,
}

impl Params {
    /// 1024 buckets on each of the two levels.
    pub const MOST_SLICES: u64 = 1 << 20;

    /// The given thickness, checked; `None` for [`Thickness::Auto`].
    pub(crate) fn given_thickness(&self) -> Result<Option<f64>, Error> {
        match self.thickness {
            Thickness::Auto => Ok(None),
            // From 1e-300 on the reciprocal is a normal number too.
            Thickness::World(found) if found.is_finite() && found >= 1e-300 => Ok(Some(found)),
            Thickness::World(found) => Err(Error::Thickness { found }),
        }
    }
}

impl Default for Params {
    fn default() -> Self {
        Self {
            direction: Direction::BackToFront,
            thickness: Thickness::Auto,
            exact: false,
            max_slices: Self::MOST_SLICES,
            margin_px: 0.0,
        }
    }
}
