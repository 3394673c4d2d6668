//! 1+1 passes: a depth-colour image of each group (Fig. 11), by the depth of Eq. 14, and their composition (Fig. 6).
//!
//! Eq. 14 adds to a depth of n steps the distance from the disc's centre, as a share of a step. Added up in one number, a share
//! loses its digits where n is large. Here both are kept, and compared one after the other. An image
//! keeps the id of the disc instead of its colour, so the time of the walk does not grow with the number of channels.

use super::Averaged;
use super::block::{Block, DiscLanes, Hit, Rules, for_each_disc, line, values_of};
use crate::disc::Discs;
use crate::grouping::{Groups, MOST_GROUPS};
use splat_core::raster::lanes::{Broadcast, Lanes};
use splat_core::raster::pulp::Simd;
use splat_core::raster::tile::{Line, PIXELS};

/// 1.5·2²³: adding it to a number below 2²² rounds that.
const TO_WHOLE: f32 = 12_582_912.0;

/// What a group shows in a block.
#[derive(Clone, Copy)]
struct GroupImage {
    /// The two parts of Eq. 14, where it is used: a step of depth, and ρ²/R².
    step: Line,
    place: Line,
    /// Infinite where the group has no disc, as are the next and the step.
    depth: Line,
    /// z + ε.
    limit: Line,
    weight: Line,
    /// N.
    facing: Line,
    /// Rank, as bits.
    disc: Line,
}

/// The images of all groups in a block.
pub(super) struct GroupImages {
    images: Vec<GroupImage>,
    /// A bit for each group that has an image.
    met: [u64; MOST_GROUPS as usize / 64],
}

impl GroupImages {
    pub(super) fn new(count: usize) -> Self {
        let zero = line(0.0);
        let image =
            GroupImage { step: zero, place: zero, depth: zero, limit: zero, weight: zero, facing: zero, disc: zero };
        Self { images: vec![image; count], met: Default::default() }
    }

    /// Of so many.
    pub(super) fn bytes(count: usize) -> u64 {
        (count * size_of::<GroupImage>()) as u64
    }

    /// The image of a group, empty if it was not met.
    #[inline(always)]
    fn image(&mut self, group: u8) -> &mut GroupImage {
        let word = &mut self.met[usize::from(group / 64)];
        let bit = 1 << (group % 64);
        let image = &mut self.images[usize::from(group)];
        if *word & bit == 0 {
            *word |= bit;
            [image.step, image.depth, image.limit] = [line(f32::INFINITY); 3];
        }
        image
    }

    /// Calls for each image of a group that was met.
    #[inline(always)]
    fn for_each(&self, mut visit: impl FnMut(&GroupImage)) {
        for (word, mut bits) in self.met.into_iter().enumerate() {
            while bits != 0 {
                visit(&self.images[64 * word + bits.trailing_zeros() as usize]);
                bits &= bits - 1;
            }
        }
    }
}

/// The walk over the discs of a list: each hides what lies behind its core, and is kept where it is before what its group has; of equals
/// the first.
#[inline(always)]
pub(super) fn keep<S: Simd>(
    simd: S,
    list: &[u32],
    discs: &Discs,
    groups: &Groups,
    rules: &Rules,
    block: &mut Block,
    images: &mut GroupImages,
) {
    images.met = Default::default();
    for &i in list {
        let disc = &discs.discs[i as usize];
        for lane in (0..PIXELS).step_by(Lanes::<S>::COUNT) {
            let hit = rules.hit(simd, disc, block.first(), lane);
            block.hide(simd, lane, &hit, rules, i);
            let Hit { depth, limit, distance_sq, .. } = hit;
            // What is hidden already is never seen; by Eq. 14 it takes the place of what is, in whatever order both come.
            let beyond = if rules.floor.is_some() { simd.lanes(f32::INFINITY) } else { block.limit(simd, lane) };
            if !depth.any_less(beyond) {
                continue;
            }
            let image = images.image(groups.by_disc()[discs.ids[i as usize] as usize]);
            let behind = match rules.floor {
                Some(floor) => behind(simd, image, lane, floored(simd, floor, depth), distance_sq),
                None => depth - Lanes::load(simd, &image.depth.0[lane..]),
            };
            if !behind.any_less(simd.lanes(0.0)) {
                continue;
            }
            let kernel = &discs.kernels[discs.looks[i as usize].footprint as usize];
            if let Some(floor) = rules.floor {
                keep_nearer(simd, &mut image.step, lane, behind, floored(simd, floor, depth));
                keep_nearer(simd, &mut image.place, lane, behind, distance_sq);
            }
            keep_nearer(simd, &mut image.depth, lane, behind, depth);
            keep_nearer(simd, &mut image.limit, lane, behind, limit);
            keep_nearer(simd, &mut image.weight, lane, behind, hit.weight(simd, kernel));
            keep_nearer(simd, &mut image.facing, lane, behind, hit.facing);
            keep_nearer(simd, &mut image.disc, lane, behind, simd.lanes(f32::from_bits(i)));
        }
    }
}

/// Writes the new numbers to a line, from `lane` on, where `behind` is below 0.
#[inline(always)]
fn keep_nearer<S: Simd>(simd: S, line: &mut Line, lane: usize, behind: Lanes<S>, new: Lanes<S>) {
    let numbers = &mut line.0[lane..];
    new.where_less_or(behind, simd.lanes(0.0), Lanes::load(simd, numbers)).store(numbers);
}

/// By Eq. 14: below 0 where a disc is before an image. Steps are whole or the same, places differ by less than 1, so the sign is that of
/// the first difference that is not 0.
#[inline(always)]
fn behind<S: Simd>(simd: S, image: &GroupImage, lane: usize, step: Lanes<S>, place: Lanes<S>) -> Lanes<S> {
    (step - Lanes::load(simd, &image.step.0[lane..]))
        .mul_add(simd.lanes(4.0), place - Lanes::load(simd, &image.place.0[lane..]))
}

/// Eq. 10, in steps.
#[inline(always)]
fn floored<S: Simd>(simd: S, range: [f32; 2], depth: Lanes<S>) -> Lanes<S> {
    let [near, per_depth] = range;
    let steps = (depth - simd.lanes(near)) * simd.lanes(per_depth);
    let whole = (steps + simd.lanes(TO_WHOLE)) - simd.lanes(TO_WHOLE);
    whole - simd.lanes(1.0).where_less(steps, whole)
}

/// Fig. 6: of all images those discs are summed that no other hides.
#[inline(always)]
pub(super) fn composite<S: Simd>(simd: S, input: &Averaged<'_>, images: &GroupImages, block: &mut Block) {
    block.begin_sums(input);
    images.for_each(|image| {
        let mut weights = [0.0; PIXELS];
        for lane in (0..PIXELS).step_by(Lanes::<S>::COUNT) {
            let depth = Lanes::load(simd, &image.depth.0[lane..]);
            let weight = Lanes::load(simd, &image.weight.0[lane..]);
            weight.where_less(depth, block.limit(simd, lane)).store(&mut weights[lane..]);
        }
        for_each_disc(&image.disc, weights, |disc, shown| {
            let normal = input.discs.normals[disc.to_bits() as usize];
            for lane in (0..PIXELS).step_by(Lanes::<S>::COUNT) {
                let side = block.side(simd, lane, Lanes::load(simd, &image.facing.0[lane..]), normal);
                let discs = DiscLanes {
                    depth: Lanes::load(simd, &image.depth.0[lane..]),
                    limit: Lanes::load(simd, &image.limit.0[lane..]),
                    side,
                };
                let weight = block.weigh(simd, lane, discs, Lanes::load(simd, &shown[lane..]));
                block.add(simd, lane, weight, values_of(input, disc));
            }
        });
    });
}
