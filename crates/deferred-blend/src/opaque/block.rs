//! Sixteen pixels: the hiding depth, and sums over discs that nothing hides.

use super::picture::Tile;
use super::{Averaged, Passes};
use crate::Params;
use crate::disc::{Disc, Meeting};
use crate::fragments::offsets;
use splat_core::Footprint;
use splat_core::glam::Vec3;
use splat_core::raster::kernel::Kernel;
use splat_core::raster::lanes::{Broadcast, Lanes};
use splat_core::raster::pulp::Simd;
use splat_core::raster::tile::{AREA, Line, PIXELS, position};

/// 1/|cosine| beyond which ε along the ray grows no more.
const MOST_OBLIQUE: f32 = 4.0;

/// ε is at least this share of the depth, eight units in its last place: discs of one plane, far away, do not hide one another.
const LEAST_EPSILON: f32 = 1.0 / (1 << 20) as f32;

/// Least weight of a disc that a ray meets, below any that can be seen beside another: where sharp kernels end in zero, Σw does not.
const LEAST_WEIGHT: f32 = 1.0 / (1u64 << 60) as f32;

/// Weight of a disc that faces away, where the nearest faces the viewer, beside that. Discs behind the silhouette of a closed surface stick
/// out over it, lit on the inside. Which side is the front is told by the nearest, for a scan does not know: normals turned to the
/// viewer make an obtuse angle across a silhouette.
const FACING_AWAY: f32 = 1.0 / 256.0;

/// Below any sum of weights.
const NO_WEIGHT: f32 = LEAST_WEIGHT * FACING_AWAY * FACING_AWAY;

/// Numbers of 16 pixels that are all the same.
pub(super) const fn line(value: f32) -> Line {
    Line([value; PIXELS])
}

/// Where rays meet a disc.
pub(super) struct Hit<S: Simd> {
    /// View depth, infinite where a ray misses.
    pub(super) depth: Lanes<S>,
    /// z + ε: what lies behind is hidden.
    pub(super) limit: Lanes<S>,
    /// ρ²/R², below 1 where a ray hits.
    pub(super) distance_sq: Lanes<S>,
    /// N: its sign is the side that is seen.
    pub(super) facing: Lanes<S>,
}

/// Discs that are weighed at a block of pixels, one a lane.
pub(super) struct DiscLanes<S: Simd> {
    /// View depth.
    pub(super) depth: Lanes<S>,
    /// z + ε, as [`Hit::limit`].
    pub(super) limit: Lanes<S>,
    /// As [`Block::side`] returns it.
    pub(super) side: Lanes<S>,
}

/// How discs hide one another.
pub(super) struct Rules {
    gap: f32,
    /// ρ²/R² within which a disc hides: rims alone stick out beyond silhouettes and borders.
    core: f32,
    /// For Eq. 14, the depth at which the first step of Eq. 10 begins, and steps in a unit of depth.
    pub(super) floor: Option<[f32; 2]>,
}

impl Rules {
    pub(super) fn new(input: &Averaged<'_>, params: &Params) -> Self {
        let floor = || {
            let [near, far] = input.discs.depths;
            // More steps than depths can be told apart by would part the discs of a plane.
            let steps = (input.discs.depth_steps(params) as f32).min(1.0 / LEAST_EPSILON);
            [near, if far > near { steps / (far - near) } else { 0.0 }]
        };
        let voronoi = matches!(input.passes, Passes::OnePlusOne { voronoi: true, .. });
        let core = Footprint::CORE / params.disc_scale;
        Self { gap: params.gap, core: core * core, floor: voronoi.then(floor) }
    }

    /// A disc met by pixels from `lane` on of the block whose first pixel is `first`.
    #[inline(always)]
    pub(super) fn hit<S: Simd>(&self, simd: S, disc: &Disc, first: [usize; 2], lane: usize) -> Hit<S> {
        let Meeting { facing, inverse, distance_sq, depth } = disc.meet(simd, offsets(simd, disc, first, lane));
        let far = simd.lanes(f32::INFINITY);
        let depth = depth.where_less_or(distance_sq, simd.lanes(1.0), far);
        let depth = depth.where_less_or(simd.lanes(0.0), depth, far);
        let across = simd.lanes(self.gap * disc.radius) * inverse.abs().min(simd.lanes(MOST_OBLIQUE));
        Hit { depth, limit: depth + across.max(depth * simd.lanes(LEAST_EPSILON)), distance_sq, facing }
    }
}

impl<S: Simd> Hit<S> {
    /// w of Eq. 1 where a ray hits.
    #[inline(always)]
    pub(super) fn weight(&self, simd: S, kernel: &Kernel) -> Lanes<S> {
        kernel.profile(simd, (simd.lanes(1.0) - self.distance_sq).max(simd.lanes(0.0))).max(simd.lanes(LEAST_WEIGHT))
    }
}

/// Sums of 16 pixels.
pub(super) struct Block {
    first: [usize; 2],
    /// Least z + ε.
    limit: Line,
    /// Depth and, as bits, rank of the nearest disc.
    near: Line,
    disc: Line,
    /// N of that disc, and its normal times this.
    facing: Line,
    front: [Line; 3],
    weight: Line,
    /// Σw·(z − nearest): relative, so that far surfaces keep their digits.
    depth: Line,
    /// Values of the nearest disc, and Σw·(v − nearest), by channel: so what is constant stays so to the last bit.
    nearest: Vec<Line>,
    sums: Vec<Line>,
}

impl Block {
    pub(super) fn new(channels: usize) -> Self {
        let zero = line(0.0);
        let lines = vec![line(0.0); channels];
        let limit = zero;
        let near = zero;
        let disc = zero;
        let facing = zero;
        let front = [zero; 3];
        let weight = zero;
        let depth = zero;
        let nearest = lines.clone();
        Self { first: [0; 2], limit, near, disc, facing, front, weight, depth, nearest, sums: lines }
    }

    /// Of one.
    pub(super) fn bytes(channels: usize) -> u64 {
        ((9 + 2 * channels) * size_of::<Line>()) as u64
    }

    /// Begins block `b` of the tile at `corner`.
    pub(super) fn clear(&mut self, b: usize, corner: [usize; 2]) {
        self.first = position(b * PIXELS, corner[0], corner[1]);
        [self.limit, self.near] = [line(f32::INFINITY); 2];
        [self.weight, self.depth] = [line(0.0); 2];
        self.sums.fill(line(0.0));
    }

    /// Image position of its first pixel.
    pub(super) fn first(&self) -> [usize; 2] {
        self.first
    }

    /// The core of a disc hides: the nearest so far and what hides most are kept; of several at one depth the first.
    #[inline(always)]
    pub(super) fn hide<S: Simd>(&mut self, simd: S, lane: usize, hit: &Hit<S>, rules: &Rules, rank: u32) {
        let core = simd.lanes(rules.core);
        let far = simd.lanes(f32::INFINITY);
        let near = Lanes::load(simd, &self.near.0[lane..]);
        let depth = hit.depth.where_less_or(hit.distance_sq, core, far);
        let limit = hit.limit.where_less_or(hit.distance_sq, core, far);
        Lanes::load(simd, &self.limit.0[lane..]).min(limit).store(&mut self.limit.0[lane..]);
        simd.lanes(f32::from_bits(rank))
            .where_less_or(depth, near, Lanes::load(simd, &self.disc.0[lane..]))
            .store(&mut self.disc.0[lane..]);
        hit.facing
            .where_less_or(depth, near, Lanes::load(simd, &self.facing.0[lane..]))
            .store(&mut self.facing.0[lane..]);
        near.min(depth).store(&mut self.near.0[lane..]);
    }

    /// Reads values and normals of the nearest discs, when all are known.
    #[inline(always)]
    pub(super) fn begin_sums(&mut self, input: &Averaged<'_>) {
        for k in (0..PIXELS).filter(|&k| self.near.0[k] < f32::INFINITY) {
            let front = input.discs.normals[self.disc.0[k].to_bits() as usize] * self.facing.0[k];
            self.front.iter_mut().zip(front.to_array()).for_each(|(line, n)| line.0[k] = n);
        }
        let seen = self.near.0.map(|depth| if depth < f32::INFINITY { 1.0 } else { 0.0 });
        for_each_disc(&self.disc, seen, |disc, shown| {
            for (line, value) in self.nearest.iter_mut().zip(values_of(input, disc)) {
                for (nearest, shown) in line.0.iter_mut().zip(shown) {
                    *nearest = if *shown > 0.0 { *value } else { *nearest };
                }
            }
        });
    }

    /// Least z + ε.
    #[inline(always)]
    pub(super) fn limit<S: Simd>(&self, simd: S, lane: usize) -> Lanes<S> {
        Lanes::load(simd, &self.limit.0[lane..])
    }

    /// Adds discs at some depth and limit, one a lane, to Σw and Σwz. Returns their weights, 0 for those that are hidden, and for rims of
    /// nearer surfaces, which lie farther than their ε before what hides.
    #[inline(always)]
    pub(super) fn weigh<S: Simd>(&mut self, simd: S, lane: usize, discs: DiscLanes<S>, weight: Lanes<S>) -> Lanes<S> {
        let DiscLanes { depth, limit: own_limit, side } = discs;
        let weight = (weight * simd.lanes(FACING_AWAY)).where_less_or(side, simd.lanes(0.0), weight);
        let limit = self.limit(simd, lane);
        let near = Lanes::load(simd, &self.near.0[lane..]);
        let weight = weight.where_less(depth, limit).where_less(near, own_limit);
        let behind = (depth - near).where_less(depth, limit).where_less(near, own_limit);
        add(simd, &mut self.weight.0[lane..], weight);
        add(simd, &mut self.depth.0[lane..], weight * behind);
        weight
    }

    /// Below 0 where a disc of some N and normal shows another side than the nearest.
    #[inline(always)]
    pub(super) fn side<S: Simd>(&self, simd: S, lane: usize, facing: Lanes<S>, normal: Vec3) -> Lanes<S> {
        let a = Lanes::load(simd, &self.front[0].0[lane..]);
        let b = Lanes::load(simd, &self.front[1].0[lane..]);
        let c = Lanes::load(simd, &self.front[2].0[lane..]);
        facing * simd.lanes(normal.x).mul_add(a, simd.lanes(normal.y).mul_add(b, simd.lanes(normal.z) * c))
    }

    /// Adds the values of one disc.
    #[inline(always)]
    pub(super) fn add<S: Simd>(&mut self, simd: S, lane: usize, weight: Lanes<S>, values: &[f32]) {
        for ((sum, nearest), value) in self.sums.iter_mut().zip(&self.nearest).zip(values) {
            let difference = simd.lanes(*value) - Lanes::load(simd, &nearest.0[lane..]);
            add(simd, &mut sum.0[lane..], weight * difference);
        }
    }

    /// Eq. 1.
    #[inline(always)]
    pub(super) fn normalize<S: Simd>(&self, simd: S, b: usize, tile: &mut Tile) {
        for lane in (0..PIXELS).step_by(Lanes::<S>::COUNT) {
            // Where groups have kept none of what is seen the nearest disc stands for all.
            let near = Lanes::load(simd, &self.near.0[lane..]);
            let weight = Lanes::load(simd, &self.weight.0[lane..]).max(simd.lanes(NO_WEIGHT));
            let far = simd.lanes(f32::INFINITY);
            let pixel = b * PIXELS + lane;
            (near + Lanes::load(simd, &self.depth.0[lane..]) / weight)
                .where_less_or(near, far, far)
                .store(&mut tile.depth[pixel..]);
            let channels = tile.channels.chunks_exact_mut(AREA).zip(&self.nearest).zip(&self.sums);
            for ((plane, nearest), sum) in channels {
                (Lanes::load(simd, &nearest.0[lane..]) + Lanes::load(simd, &sum.0[lane..]) / weight)
                    .where_less(near, far)
                    .store(&mut plane[pixel..]);
            }
        }
        for (k, disc) in tile.disc[b * PIXELS..][..PIXELS].iter_mut().enumerate() {
            *disc = if self.near.0[k] < f32::INFINITY { self.disc.0[k].to_bits() } else { u32::MAX };
        }
    }
}

/// Calls once for each disc that some pixels show, with the weights of the pixels that show it, 0 for others. Neighbours mostly show one.
#[inline(always)]
pub(super) fn for_each_disc(discs: &Line, mut weights: [f32; PIXELS], mut visit: impl FnMut(f32, &[f32; PIXELS])) {
    while let Some(first) = weights.iter().position(|weight| *weight > 0.0) {
        let disc = discs.0[first];
        let mut of_disc = [0.0; PIXELS];
        for ((rest, shown), other) in weights.iter_mut().zip(&mut of_disc).zip(&discs.0) {
            let is_same = other.to_bits() == disc.to_bits();
            *shown = if is_same { *rest } else { 0.0 };
            *rest = if is_same { 0.0 } else { *rest };
        }
        visit(disc, &of_disc);
    }
}

/// Values of a disc, whose rank is given as bits.
#[inline(always)]
pub(super) fn values_of<'a>(input: &Averaged<'a>, disc: f32) -> &'a [f32] {
    let channels = input.channels as usize;
    let rank = disc.to_bits() as usize;
    let row = if input.by_rank { rank } else { input.discs.ids[rank] as usize };
    &input.values[row * channels..][..channels]
}

#[inline(always)]
fn add<S: Simd>(simd: S, plane: &mut [f32], v: Lanes<S>) {
    (Lanes::load(simd, plane) + v).store(plane);
}
