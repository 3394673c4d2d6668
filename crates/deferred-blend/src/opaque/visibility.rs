//! 2+1 passes: visibility splatting at an offset of ε, then the sums of Eq. 1 (section 3.1).

use super::Averaged;
use super::block::{Block, DiscLanes, Rules, values_of};
use crate::disc::Discs;
use splat_core::raster::lanes::Lanes;
use splat_core::raster::pulp::Simd;
use splat_core::raster::tile::PIXELS;

/// First pass: the nearest disc, and what the discs of a list hide.
#[inline(always)]
pub(super) fn hide<S: Simd>(simd: S, list: &[u32], discs: &Discs, rules: &Rules, block: &mut Block) {
    for &i in list {
        for lane in (0..PIXELS).step_by(Lanes::<S>::COUNT) {
            let hit = rules.hit(simd, &discs.discs[i as usize], block.first(), lane);
            block.hide(simd, lane, &hit, rules, i);
        }
    }
}

/// Second pass: sums over the discs that nothing hides.
#[inline(always)]
pub(super) fn sum<S: Simd>(simd: S, list: &[u32], input: &Averaged<'_>, rules: &Rules, block: &mut Block) {
    let discs = input.discs;
    block.begin_sums(input);
    for &i in list {
        for lane in (0..PIXELS).step_by(Lanes::<S>::COUNT) {
            let hit = rules.hit(simd, &discs.discs[i as usize], block.first(), lane);
            if hit.depth.any_less(block.limit(simd, lane)) {
                let kernel = &discs.kernels[discs.looks[i as usize].footprint as usize];
                let side = block.side(simd, lane, hit.facing, discs.normals[i as usize]);
                let weight = block.weigh(
                    simd,
                    lane,
                    DiscLanes { depth: hit.depth, limit: hit.limit, side },
                    hit.weight(simd, kernel),
                );
                block.add(simd, lane, weight, values_of(input, f32::from_bits(i)));
            }
        }
    }
}
