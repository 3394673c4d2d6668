//! Maps a view depth to its slice, and a slice to the buckets of the two levels.
//!
//! Gunjee 2007, Eqs. 10-13, with near, far = smallest and greatest kept depth and ε = slice thickness:
//! ```text
//! slices  = ⌈(far − near)/ε⌉                         (10)
//! N       = ⌈√slices⌉                                (11)
//! first   = ⌊N·(d − near)/(far − near)⌋              (12-13)
//! second  = the same over [near + ε·N·first, near + ε·N·(first + 1))
//! ```
//! Deviation: a first-level bucket of (13) is (far − near)/N wide, and the second level takes it for ε·N wide. These
//! agree only when slices is N². Here ONE index `g = ⌊(d − near)/ε⌋`, clamped to the last slice, is split by division,
//! `(g / N, g mod N)`, so that every first-level bucket holds exactly N slices. `g` is a monotone function of `d` in
//! f64 (difference, product with 1/ε and floor each are), so slices never overlap in depth.

use crate::radix::key_of;
use splat_core::Direction;

/// The slices of one sort.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Slicing {
    /// Smallest depth.
    pub(crate) near: f32,
    /// Greatest depth.
    pub(crate) far: f32,
    /// ε.
    pub(crate) thickness: f64,
    /// 1/ε.
    inverse: f64,
    /// Number of slices, empty ones included, ≥ 1.
    pub(crate) slices: u64,
    /// N, buckets on each level; 0 when the slices are too many for two levels.
    pub(crate) buckets: u32,
    /// ⌈2³²/N⌉.
    reciprocal: u64,
    /// Which end comes first.
    pub(crate) direction: Direction,
}

impl Slicing {
    pub(crate) fn new(near: f32, far: f32, thickness: f64, direction: Direction, two_level_limit: u64) -> Self {
        let inverse = 1.0 / thickness;
        // `as` saturates: 1e300 slices become 2^64 − 1, and all that follows stays ordered.
        let slices = (((f64::from(far) - f64::from(near)) * inverse).ceil() as u64).max(1);
        let buckets = if slices <= two_level_limit { ceil_sqrt(slices) } else { 0 };
        let reciprocal = (1u64 << 32).div_ceil(u64::from(buckets.max(1)));
        Self { near, far, thickness, inverse, slices, buckets, reciprocal, direction }
    }

    /// The same slices, to be found from the order by depth bits.
    pub(crate) fn without_levels(&self) -> Self {
        Self { buckets: 0, ..*self }
    }

    /// Slice of a depth, counted from near, for any number of slices.
    pub(crate) fn slice_of(&self, depth: f32) -> u64 {
        (((f64::from(depth) - f64::from(self.near)) * self.inverse) as u64).min(self.slices - 1)
    }

    /// The greatest relative key up to which all keys from that of `slice` on surely belong to it: a bound that lacks
    /// a few keys at most, so that most need not be asked for their slice.
    pub(crate) fn surely_within(&self, slice: u64) -> u32 {
        let near = f64::from(self.near);
        let slice = slice as f64;
        // Two steps back from the edge outweigh the rounding of it.
        let edge = match self.direction {
            Direction::FrontToBack => ((near + (slice + 1.0) * self.thickness) as f32).next_down().next_down(),
            Direction::BackToFront => ((near + slice * self.thickness) as f32).next_up().next_up(),
        };
        match self.direction {
            // Behind the last slice there is nothing, and `far` has the greatest key.
            Direction::FrontToBack if edge >= self.near => self.relative_key(edge.min(self.far)),
            Direction::BackToFront if edge <= self.far => self.relative_key(edge.max(self.near)),
            _ => 0,
        }
    }

    /// First-level bucket in the upper and second-level bucket in the lower 16 bits, counted from the end that comes
    /// first; first level N for a depth of NaN, which marks a culled splat.
    ///
    /// Only for `buckets > 0`: then g < 2²⁰ and N ≤ 2¹⁰, so g·(N·⌈2³²/N⌉ − 2³²) < 2³⁰ < 2³² and the product's
    /// upper half is the quotient g / N without error.
    #[inline(always)]
    pub(crate) fn split<const BACK: bool>(&self, depth_bits: u32) -> u32 {
        let depth = f32::from_bits(depth_bits);
        let last = (self.slices - 1) as u32;
        // i32 and not u32: the conversion that every instruction set has.
        let g = (((f64::from(depth) - f64::from(self.near)) * self.inverse) as i32 as u32).min(last);
        let g = if BACK { last - g } else { g };
        let first = ((u64::from(g) * self.reciprocal) >> 32) as u32;
        let second = g - first * self.buckets;
        if depth.is_nan() { self.buckets << 16 } else { first << 16 | second }
    }

    /// Sort key of a depth, relative to the end that comes first; monotone in the depth, 0 for the first.
    #[inline(always)]
    pub(crate) fn relative_key(&self, depth: f32) -> u32 {
        match self.direction {
            Direction::FrontToBack => key_of(depth).wrapping_sub(key_of(self.near)),
            Direction::BackToFront => key_of(self.far).wrapping_sub(key_of(depth)),
        }
    }

    /// The depth of a relative key.
    #[inline(always)]
    pub(crate) fn depth_of(&self, relative_key: u32) -> f32 {
        crate::radix::depth_of_key(match self.direction {
            Direction::FrontToBack => relative_key.wrapping_add(key_of(self.near)),
            Direction::BackToFront => key_of(self.far).wrapping_sub(relative_key),
        })
    }
}

/// ⌈√n⌉ for n ≤ 2²⁰.
pub(crate) fn ceil_sqrt(n: u64) -> u32 {
    let root = n.isqrt();
    (root + u64::from(root * root < n)) as u32
}

#[cfg(test)]
mod tests {
    use super::*;

    fn slicing(slices: u32, direction: Direction) -> Slicing {
        Slicing::new(0.0, slices as f32, 1.0, direction, 1 << 20)
    }

    #[test]
    fn bs01_split_is_the_quotient_and_the_remainder_for_every_bucket_count() {
        for buckets in 1..=1024u32 {
            let s = slicing(buckets * buckets, Direction::FrontToBack);
            assert_eq!(s.buckets, buckets);
            let step = (buckets * buckets / 997).max(1);
            let near_multiples = (0..buckets).flat_map(|k| [k * buckets, k * buckets + buckets - 1]);
            for g in (0..buckets * buckets).step_by(step as usize).chain(near_multiples) {
                let packed = s.split::<false>((g as f32 + 0.5).to_bits());
                assert_eq!((packed >> 16, packed & 0xffff), (g / buckets, g % buckets), "{g} of {buckets}²");
                let packed = s.split::<true>((g as f32 + 0.5).to_bits());
                let back = buckets * buckets - 1 - g;
                assert_eq!((packed >> 16, packed & 0xffff), (back / buckets, back % buckets));
            }
        }
    }

    #[test]
    fn bs02_far_and_its_neighbour_stay_in_the_last_slice() {
        for n in (1..60_000u32).step_by(7) {
            let far = n as f32 * 0.37;
            let s = Slicing::new(0.0, far, f64::from(far) / f64::from(n), Direction::FrontToBack, 1 << 20);
            for d in [far, far.next_down()] {
                assert!(s.slice_of(d) < s.slices);
                let packed = s.split::<false>(d.to_bits());
                assert!(packed >> 16 < s.buckets && packed & 0xffff < s.buckets);
                assert_eq!(u64::from((packed >> 16) * s.buckets + (packed & 0xffff)), s.slice_of(d));
            }
        }
    }

    #[test]
    fn keys_of_depths_are_monotone_and_come_back() {
        let depths = [-3.0e38f32, -1.0, -1e-40, 0.0, 1e-40, 1.0, 1.0f32.next_up(), 3.0e38];
        for direction in [Direction::FrontToBack, Direction::BackToFront] {
            let s = Slicing::new(depths[0], depths[7], 1.0, direction, 1 << 20);
            for pair in depths.windows(2) {
                let keys = (s.relative_key(pair[0]), s.relative_key(pair[1]));
                assert_eq!(direction == Direction::FrontToBack, keys.0 < keys.1);
            }
            assert!(depths.iter().all(|&d| s.depth_of(s.relative_key(d)).to_bits() == d.to_bits()));
        }
    }

    #[test]
    fn ceil_sqrt_is_the_smallest_root_that_covers() {
        for n in 1..=(1u64 << 20) {
            let r = u64::from(ceil_sqrt(n));
            assert!(r * r >= n && (r - 1) * (r - 1) < n);
        }
    }
}
