//! Layers of a pixel: fragments of one surface, told from those of the next by gaps in depth.
//!
//! The paper floors depths to n steps (Eq. 10), and fragments of one step are one layer: a surface that crosses the end of a step is
//! two layers there, and lets less light through. Gaps between neighbours have no such places.

use crate::Params;
use crate::disc::Discs;
use crate::fragments::Fragment;
use splat_core::Footprint;

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
    fn joins(self, discs: &Discs, near: &Fragment, far: &Fragment) -> bool {
        let facing = (0.5 * (near.facing + far.facing)).max(LEAST_FACING);
        let radius = 0.5 * (discs.discs[near.disc as usize].radius + discs.discs[far.disc as usize].radius);
        (far.depth - near.depth) * facing < self.gap * radius
    }

    /// The layers of a pixel, near to far. One that no disc's core meets is none: rims alone stick out beyond silhouettes and creases.
    #[inline]
    pub(crate) fn layers<'f>(
        self,
        discs: &'f Discs,
        mut fragments: &'f [Fragment],
    ) -> impl Iterator<Item = &'f [Fragment]> {
        std::iter::from_fn(move || {
            while !fragments.is_empty() {
                let pairs = fragments.windows(2);
                let end = 1 + pairs.take_while(|pair| self.joins(discs, &pair[0], &pair[1])).count();
                let (layer, rest) = fragments.split_at(end);
                fragments = rest;
                if layer.iter().any(|f| f.distance_sq < self.core) {
                    return Some(layer);
                }
            }
            None
        })
    }
}
