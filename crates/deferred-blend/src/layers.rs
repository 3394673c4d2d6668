//! Layers of a pixel: fragments of one surface, told from those of the next by gaps in depth.
//!
//! The paper floors depths to n steps (Eq. 10), and fragments of one step are one layer: a surface that crosses the end of a step is
//! two layers there, and lets less light through. Gaps between neighbours have no such places.

use crate::Params;
use crate::disc::Discs;
use crate::fragments::Fragment;
use splat_core::Footprint;
use std::ops::Range;

/// |cosine| below which a disc counts as if it were crossed at it: nearly edge-on, planes that are near to one another are met far
/// from one another, but no farther than this over ε.
const LEAST_FACING: f32 = 0.25;

/// What tells layers apart.
#[derive(Debug, Clone, Copy)]
pub(crate) struct GapRule {
    gap: f32,
    /// ρ²/R² within which a disc is solid.
    core: f32,
}

impl GapRule {
    pub(crate) fn new(params: &Params) -> Self {
        let core = Footprint::CORE / params.disc_scale;
        Self { gap: params.gap, core: core * core }
    }

    /// Whether of two neighbours along a ray the farther belongs to the layer of the nearer.
    #[inline]
    pub(crate) fn joins(self, discs: &Discs, near: &Fragment, far: &Fragment) -> bool {
        if near.object != far.object {
            return false;
        }
        let facing = (0.5 * (near.facing + far.facing)).max(LEAST_FACING);
        let radius = 0.5 * (discs.discs[near.disc as usize].radius + discs.discs[far.disc as usize].radius);
        (far.depth - near.depth) * facing < self.gap * radius
    }

    /// The layers of a pixel, near to far, as ranges of its fragments, which are put in order for it. Discs of different objects are
    /// never one layer. A layer that no disc's core meets is none: rims alone stick out beyond silhouettes and creases.
    #[inline]
    pub(crate) fn split(self, discs: &Discs, fragments: &mut [Fragment], layers: &mut Vec<Range<usize>>) {
        layers.clear();
        let id = |f: &Fragment| discs.ids[f.disc as usize];
        // Of several at one depth by their places in the cloud, so the order of the discs does not matter.
        fragments.sort_unstable_by(|a, b| a.depth.total_cmp(&b.depth).then_with(|| id(a).cmp(&id(b))));
        let several = fragments.iter().any(|f| f.object != fragments[0].object);
        if several {
            fragments.sort_by_key(|f| f.object);
        }
        let mut begin = 0;
        while begin < fragments.len() {
            let pairs = fragments[begin..].windows(2);
            let end = begin + 1 + pairs.take_while(|pair| self.joins(discs, &pair[0], &pair[1])).count();
            if fragments[begin..end].iter().any(|f| f.distance_sq < self.core) {
                layers.push(begin..end);
            }
            begin = end;
        }
        if several {
            layers.sort_by(|a, b| mean_depth(&fragments[a.clone()]).total_cmp(&mean_depth(&fragments[b.clone()])));
        }
    }
}

/// Depth of a layer: the average by weight. As a difference from the nearest, so that far layers keep their digits.
pub(crate) fn mean_depth(layer: &[Fragment]) -> f32 {
    let (mut weights, mut sum, nearest) = (0.0, 0.0, layer[0].depth);
    for fragment in layer {
        weights += fragment.weight;
        sum += fragment.weight * (fragment.depth - nearest);
    }
    sum / weights + nearest
}
