//! Footprints of one group of lanes: as they are computed, and on their way to memory.

use super::gather::{Attributes, Column};
use super::lanes::Lanes;
use super::projected::ProjectedDepth;
use pulp::Simd;

/// Footprints of one group of lanes, on their way to memory.
#[derive(Default)]
pub(super) struct Image {
    pub(super) center: [Column; 2],
    pub(super) depth: Column,
    pub(super) conic: [Column; 3],
    /// Not positive for what has no image.
    pub(super) peak: Column,
    pub(super) half_extent: [Column; 2],
    pub(super) slope: [Column; 2],
    pub(super) core: [Column; 3],
    /// 1 for a disc that reaches through the eye plane, else −1.
    pub(super) near: Column,
}

/// What differs between media and discs.
pub(super) struct Shapes<S: Simd> {
    pub(super) conic: [Lanes<S>; 3],
    pub(super) peak: Lanes<S>,
    pub(super) half_extent: [Lanes<S>; 2],
    pub(super) slope: [Lanes<S>; 2],
    /// The conic of a disc without the filter.
    pub(super) core: [Lanes<S>; 3],
    /// 1 for a disc that reaches through the eye plane, else −1.
    pub(super) near: Lanes<S>,
}

impl Image {
    /// Whether one of the first `count` reaches through the eye plane.
    #[inline(always)]
    pub(super) fn any_near(&self, count: usize) -> bool {
        self.near[..count].iter().fold(false, |any, near| any | (*near > 0.0))
    }

    pub(super) fn write_depths(&self, attributes: &Attributes, depths: &mut [ProjectedDepth]) {
        for (l, depth) in depths.iter_mut().enumerate() {
            let center = self.depth[l];
            let slope = self.slope.map(|s| s[l]);
            let extent = attributes.radius[l];
            *depth = ProjectedDepth { center, slope, extent, core: self.core.map(|c| c[l]) };
        }
    }
}

impl<S: Simd> Shapes<S> {
    /// `self` where `a` < `b`, `other` elsewhere.
    #[inline(always)]
    pub(super) fn where_less(&self, a: Lanes<S>, b: Lanes<S>, other: &Self) -> Self {
        let mut chosen = Self {
            conic: self.conic,
            core: self.core,
            peak: self.peak.where_less_or(a, b, other.peak),
            half_extent: self.half_extent,
            near: self.near.where_less_or(a, b, other.near),
            slope: self.slope,
        };
        for k in 0..3 {
            chosen.conic[k] = self.conic[k].where_less_or(a, b, other.conic[k]);
            chosen.core[k] = self.core[k].where_less_or(a, b, other.core[k]);
        }
        for k in 0..2 {
            chosen.half_extent[k] = self.half_extent[k].where_less_or(a, b, other.half_extent[k]);
            chosen.slope[k] = self.slope[k].where_less_or(a, b, other.slope[k]);
        }
        chosen
    }
}
