//! Layers of a pixel: fragments of one surface, separated from those of the next by gaps in depth.
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

/// The rule that separates layers.
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
    let mut weights = 0.0;
    let mut sum = 0.0;
    let nearest = layer[0].depth;
    for fragment in layer {
        weights += fragment.weight;
        sum += fragment.weight * (fragment.depth - nearest);
    }
    sum / weights + nearest
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::DiscInput;
    use crate::fragments::{BlockLists, WalkTile};
    use splat_core::glam::{DVec3, Vec3};
    use splat_core::raster::bins::bin_rectangles;
    use splat_core::raster::pulp;
    use splat_core::{Camera, Cloud, FootprintStack, Material, Projection, Splat, SplatKind, rng};

    /// Four balls within one another, along a spiral each.
    fn balls() -> Cloud {
        let mut cloud = Cloud::new(DVec3::ZERO);
        for k in 0..8000u32 {
            let ball = k / 2000;
            let k = k % 2000;
            let z = 1.0 - (2.0 * k as f32 + 1.0) / 2000.0;
            let around = k as f32 * 2.399_963_2;
            let across = (1.0 - z * z).sqrt();
            let normal = Vec3::new(across * libm::cosf(around), across * libm::sinf(around), z);
            let size = 1.0 - 0.2 * ball as f32;
            let radius = 2.4 * 0.079 * size;
            cloud.push(&Splat {
                position: normal * size,
                normal,
                radius,
                kind: SplatKind::Surface,
                ..Splat::default()
            });
        }
        cloud
    }

    /// Fragments, and comparisons that sorting them takes in all pixels.
    fn comparisons(cloud: &Cloud, ids: &[u32], camera: &Camera) -> (u64, u64) {
        let footprints = &FootprintStack::default();
        let materials = &[Material::default()];
        let discs = &Discs::project(&DiscInput { cloud, ids, camera, footprints, materials }, &Params::default());
        let ranks: Vec<u32> = (0..ids.len() as u32).collect();
        let bins = bin_rectangles(camera.size, &ranks, |i| discs.discs[i as usize].pixels);
        let mut fragments = 0;
        let mut compared = 0;
        for t in 0..bins.tiles() {
            let mut lists = BlockLists::default();
            lists.fill(discs, &bins, t);
            let visit = |_: usize, pixel: &mut [Fragment]| {
                pixel.sort_unstable_by(|a, b| {
                    compared += 1;
                    a.depth.total_cmp(&b.depth)
                });
            };
            let lists = &lists;
            let corner = bins.corner(t);
            fragments += pulp::Arch::new().dispatch(WalkTile { discs, lists, corner, visit });
        }
        (fragments, compared)
    }

    /// Layers are sorted in each pixel whatever the order of the discs; near ones first saves comparisons, and nothing else.
    #[test]
    fn discs_that_come_near_first_are_sorted_with_fewer_comparisons() {
        let cloud = balls();
        let eye = DVec3::new(0.5, 0.3, 4.0);
        let view = Projection::Perspective { fov_y: 0.6 };
        let camera = Camera::look_at(eye, DVec3::ZERO, DVec3::Y, view, [96, 96]).expect("a view");
        let near_first = |thickness: f32| {
            let mut ids: Vec<u32> = (0..cloud.len() as u32).collect();
            let depth = |i: &u32| (eye.as_vec3() - cloud.position[*i as usize]).dot(eye.as_vec3().normalize());
            ids.sort_by_key(|i| (depth(i) / thickness) as i64);
            ids
        };
        let shuffled = {
            let mut ids: Vec<u32> = (0..cloud.len() as u32).collect();
            ids.sort_by_key(|i| rng::bits(1, 0, u64::from(*i), 0));
            ids
        };
        let [sorted, sliced, shuffled] =
            [near_first(1e-4), near_first(0.1), shuffled].map(|ids| comparisons(&cloud, &ids, &camera));
        let a_fragment = |(fragments, compared): (u64, u64)| compared as f64 / fragments as f64;
        let [sorted, sliced, random] = [sorted, sliced, shuffled].map(a_fragment);
        println!(
            "comparisons a fragment: {sorted:.2} by depth, {sliced:.2} by slices of a tenth, {random:.2} at random"
        );
        assert!(sorted < 0.7 * random && sorted < 1.1 * sliced, "{sorted} {sliced} {random}");
    }
}
