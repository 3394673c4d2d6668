//! 2+1 passes: visibility splatting at an offset of ε, then the sums of Eq. 1 (section 3.1).

use super::OpaqueInput;
use super::block::{Block, Hit, Rules, values_of, weight};
use crate::disc::Discs;
use splat_core::raster::lanes::Lanes;
use splat_core::raster::pulp::Simd;
use splat_core::raster::tile::PIXELS;

/// First pass: the nearest disc, and what the discs of a list hide.
#[inline(always)]
pub(super) fn hide<S: Simd>(simd: S, list: &[u32], discs: &Discs, rules: &Rules, block: &mut Block) {
    for &i in list {
        let rank = Lanes::splat(simd, f32::from_bits(i));
        for lane in (0..PIXELS).step_by(Lanes::<S>::COUNT) {
            let Hit { depth, limit, .. } = rules.hit(simd, &discs.discs[i as usize], block.first(), lane);
            block.hide(simd, lane, [depth, limit, rank]);
        }
    }
}

/// Second pass: sums over the discs that nothing hides.
#[inline(always)]
pub(super) fn sum<S: Simd>(simd: S, list: &[u32], input: &OpaqueInput<'_>, rules: &Rules, block: &mut Block) {
    let discs = input.discs;
    block.begin_sums(input);
    for &i in list {
        for lane in (0..PIXELS).step_by(Lanes::<S>::COUNT) {
            let Hit { depth, distance_sq, .. } = rules.hit(simd, &discs.discs[i as usize], block.first(), lane);
            if depth.any_less(block.limit(simd, lane)) {
                let kernel = &discs.kernels[discs.looks[i as usize].footprint as usize];
                let weight = block.weigh(simd, lane, depth, weight(simd, kernel, distance_sq));
                block.add(simd, lane, weight, values_of(input, f32::from_bits(i)));
            }
        }
    }
}
