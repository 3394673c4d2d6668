//! Elements (triangles, cells, splats) of given rates, in blocks, each block with an alias table (Walker; Vose).
//!
//! A Poisson process on many elements is the sum of one on each block; within a block, each arrival picks its element by
//! rate. A block's tables and the data of its elements stay in the first-level cache, and no set ever visits an element that
//! gets no particle. Rates are summed in f64; one look-up resolves shares of 2⁻³² of a block.

use crate::Error;
use crate::params::countable;
use crate::stream::{Stage, Stream};
use rayon::prelude::*;

/// Elements of a block.
const BLOCK: usize = 1024;

/// The most particles of a chunk, in the mean: a block of more is worked on by several tasks.
const CHUNK_MEAN: f64 = 8192.0;

/// Arrivals that are worked on at once.
pub(crate) const BATCH: usize = 64;

/// Some arrivals of a chunk.
pub(crate) struct Batch<const N: usize> {
    pub(crate) len: usize,
    /// Element of each.
    pub(crate) elements: [usize; BATCH],
    /// Random numbers of each.
    pub(crate) bits: [[u64; BATCH]; N],
}

/// Alias tables of all elements.
#[derive(Debug, Clone, Default)]
pub(crate) struct Blocks {
    elements: usize,
    /// 32-bit share of the slot's own element, and the element that has the rest.
    slots: Vec<(u32, u16)>,
    /// (block, mean number of particles), none of mean 0.
    chunks: Vec<(u32, f64)>,
}

impl Blocks {
    /// Tables for `elements` elements, of which `rate` gives the mean number of particles in a set, ≥ 0.
    ///
    /// # Errors
    /// [`Error::Limit`] for more than 4·10⁹ particles a set, before lists are made of them; [`Error::Parameter`] where
    /// rates are not numbers.
    pub(crate) fn new(elements: usize, rate: impl Fn(usize) -> f64 + Sync) -> Result<Self, Error> {
        let mut slots = vec![(0u32, 0u16); elements];
        let totals: Vec<f64> = slots
            .par_chunks_mut(BLOCK)
            .enumerate()
            .map(|(b, slots)| {
                let rates: Vec<f64> = (0..slots.len()).map(|i| rate(b * BLOCK + i)).collect();
                fill(slots, &rates)
            })
            .collect();
        countable(totals.iter().sum())?;
        let mut chunks = Vec::new();
        for (b, &total) in totals.iter().enumerate().filter(|(_, t)| **t > 0.0) {
            let parts = (total / CHUNK_MEAN).ceil().max(1.0);
            // Sums of independent Poisson variables are Poisson: a block may be shared by any number of tasks.
            chunks.extend((0..parts as u64).map(|_| (b as u32, total / parts)));
        }
        Ok(Self { elements, slots, chunks })
    }

    /// Number of chunks.
    pub(crate) fn chunks(&self) -> usize {
        self.chunks.len()
    }

    /// Mean number of arrivals in a chunk.
    pub(crate) fn mean(&self, chunk: usize) -> f64 {
        self.chunks[chunk].1
    }

    /// Mean number of arrivals in a set.
    pub(crate) fn total(&self) -> f64 {
        self.chunks.iter().map(|(_, mean)| mean).sum()
    }

    /// The arrivals of a chunk: `emit` gets the element of each, and the stream for whatever else it draws.
    #[inline]
    pub(crate) fn arrivals(
        &self,
        seed: u64,
        stage: Stage,
        set: u64,
        chunk: usize,
        mut emit: impl FnMut(usize, &mut Stream),
    ) {
        let (first, slots, mean) = self.of_chunk(chunk);
        let mut stream = Stream::new(seed, stage, set, chunk as u64);
        for _ in 0..stream.poisson(mean) {
            let pick = pick(slots, stream.bits());
            emit(first + pick, &mut stream);
        }
    }

    /// First element, number of elements and mean of each chunk.
    #[cfg(feature = "gpu")]
    pub(crate) fn spans(&self) -> impl Iterator<Item = (usize, usize, f64)> {
        self.chunks.iter().map(|&(block, mean)| {
            let first = block as usize * BLOCK;
            (first, BLOCK.min(self.elements - first), mean)
        })
    }

    /// The alias tables: the share of each slot's own element, and which other of its block has the rest.
    #[cfg(feature = "gpu")]
    pub(crate) fn slots(&self) -> &[(u32, u16)] {
        &self.slots
    }

    /// The arrivals of a chunk, some at once, each with `N` random numbers: those that [`Blocks::arrivals`] would give.
    pub(crate) fn batches<const N: usize>(
        &self,
        seed: u64,
        stage: Stage,
        set: u64,
        chunk: usize,
        mut emit: impl FnMut(&Batch<N>),
    ) {
        let (first, slots, mean) = self.of_chunk(chunk);
        let mut stream = Stream::new(seed, stage, set, chunk as u64);
        let mut left = stream.poisson(mean);
        let mut batch = Batch { len: 0, elements: [0; BATCH], bits: [[0; BATCH]; N] };
        while left > 0 {
            batch.len = left.min(BATCH as u64) as usize;
            left -= batch.len as u64;
            // Look-ups that miss the cache do not wait for each other.
            for j in 0..batch.len {
                batch.elements[j] = first + pick(slots, stream.bits());
                (0..N).for_each(|d| batch.bits[d][j] = stream.bits());
            }
            emit(&batch);
        }
    }

    /// First element, slots, and mean number of arrivals of a chunk.
    #[inline]
    fn of_chunk(&self, chunk: usize) -> (usize, &[(u32, u16)], f64) {
        let (block, mean) = self.chunks[chunk];
        let first = block as usize * BLOCK;
        (first, &self.slots[first..(first + BLOCK).min(self.elements)], mean)
    }

    /// Bytes of the tables.
    pub(crate) fn bytes(&self) -> u64 {
        (size_of_val(&*self.slots) + size_of_val(&*self.chunks)) as u64
    }
}

/// The element of a block that 64 random bits pick.
#[inline]
fn pick(slots: &[(u32, u16)], bits: u64) -> usize {
    let slot = (((bits >> 32) * slots.len() as u64) >> 32) as usize;
    let (share, other) = slots[slot];
    // A selection, not a branch: which it is cannot be foreseen.
    let mask = 0usize.wrapping_sub(usize::from((bits as u32) < share));
    slot & mask | usize::from(other) & !mask
}

/// One alias table; returns the sum of the rates.
fn fill(slots: &mut [(u32, u16)], rates: &[f64]) -> f64 {
    let total: f64 = rates.iter().sum();
    // Rates without end or value are refused by their sum.
    if total <= 0.0 || !total.is_finite() {
        return total;
    }
    let scale = rates.len() as f64 / total;
    let mut rest: Vec<f64> = rates.iter().map(|r| r * scale).collect();
    let (mut small, mut large): (Vec<usize>, Vec<usize>) = (0..rates.len()).partition(|i| rest[*i] < 1.0);
    while let (Some(s), Some(l)) = (small.last().copied(), large.last().copied()) {
        small.pop();
        slots[s] = ((rest[s] * 4_294_967_296.0) as u32, l as u16);
        rest[l] -= 1.0 - rest[s];
        if rest[l] < 1.0 {
            large.pop();
            small.push(l);
        }
    }
    // Left over by rounding: all their own. A rate of 0 never is: it gave up its whole slot above.
    large.into_iter().chain(small).for_each(|i| slots[i] = (u32::MAX, i as u16));
    total
}

#[cfg(test)]
mod tests {
    use super::*;
    use splat_core::Exceeded;

    #[test]
    fn equal_rates_leave_nobody_out() {
        // By rounding, all of them may be a little less than their mean.
        for n in [1usize, 3, 7, 8, 49, 1023] {
            for rate in [1.0 / 3.0, 49.906_597_000_315_7, 0.1, 1e-9, 1e9] {
                let mut slots = vec![(0, 0); n];
                fill(&mut slots, &vec![rate; n]);
                for (i, (share, other)) in slots.iter().enumerate() {
                    assert!(
                        *share > u32::MAX - 65536 || usize::from(*other) == i,
                        "{n} × {rate}: slot {i} has {share}"
                    );
                }
            }
        }
    }

    #[test]
    fn too_many_particles_are_refused_before_lists_are_made_of_them() {
        for rate in [1e7, 1e15, 1e300, f64::INFINITY] {
            let refused = Blocks::new(2000, |_| rate).err();
            assert!(matches!(refused, Some(Error::Limit(Exceeded { unit: "particles", .. }))), "{rate}: {refused:?}");
        }
        for broken in [f64::NAN, f64::NEG_INFINITY] {
            let rate = |i: usize| if i == 1500 { broken } else { f64::INFINITY };
            let refused = Blocks::new(2000, rate).err();
            assert!(matches!(refused, Some(Error::Parameter { .. })), "{broken}: {refused:?}");
        }
        let most = Blocks::new(2000, |_| 1.9e6).unwrap();
        assert_eq!(most.bytes(), 8 * 2000 + 16 * most.chunks() as u64);
        assert!(most.bytes() < 16 << 20, "{}", most.bytes());
    }

    #[test]
    fn elements_are_picked_by_their_rates_and_never_at_rate_zero() {
        let rate = |i: usize| [0.0, 1e-3, 1.0, 250.0, 7.0][i % 5] * (1.0 + (i / 1000) as f64);
        const N: usize = 3000;
        let blocks = Blocks::new(N, rate).unwrap();
        let mut count = vec![0u64; N];
        for set in 0..20 {
            for chunk in 0..blocks.chunks() {
                blocks.arrivals(1, Stage::Mesh, set, chunk, |i, _| count[i] += 1);
            }
        }
        let mut chi2 = 0.0;
        let mut bins = 0.0;
        for i in 0..N {
            let expected = 20.0 * rate(i);
            assert!(expected > 0.0 || count[i] == 0, "element {i} of rate 0 got {}", count[i]);
            if expected >= 5.0 {
                chi2 += (count[i] as f64 - expected).powi(2) / expected;
                bins += 1.0;
            }
        }
        let h: f64 = 2.0 / (9.0 * bins);
        let limit = bins * (1.0 - h + 3.09 * h.sqrt()).powi(3);
        assert!(chi2 < limit, "χ² {chi2} of {bins} bins, limit {limit}");
        let rare: u64 = (0..N).filter(|i| i % 5 == 1).map(|i| count[i]).sum();
        let expected: f64 = (0..N).filter(|i| i % 5 == 1).map(|i| 20.0 * rate(i)).sum();
        assert!((rare as f64 - expected).abs() < 4.5 * expected.sqrt() + 1.0, "{rare} for {expected}");
    }
}
