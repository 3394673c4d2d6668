//! The pairs of places that wait for Prim's algorithm, the best first: a heap of heaps.
//!
//! Most pairs disagree much and wait for long; many of them are never taken. In a single heap of all pairs, a path from root to leaves
//! fits no cache. Here pairs that disagree about as much share a box, and only the box that is taken from next is a heap.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// Boxes, as many as two levels of 64 bits tell apart.
const BOXES: usize = 64 * 64;

/// Bits of an f64 that do not choose its box: 6 of its mantissa do.
const IN_BOX: u32 = 46;

/// Of 2⁻⁵⁴, which is less than any difference of a product from 1 but none.
const LEAST: u64 = (1023 - 54) << 52 >> IN_BOX;

/// A place that a pair leads to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Led {
    /// Bits of a number from 0 to 1, how much the pair disagrees.
    pub(crate) disagreement: u64,
    /// Its place; of pairs that disagree as much that with the least one comes first.
    pub(crate) place: u32,
}

/// Pairs by how much they disagree: boxes, of which the one that is taken from is a heap.
pub(crate) struct PairQueue {
    /// By box: pairs in order.
    heaps: Vec<BinaryHeap<Reverse<Led>>>,
    /// By box: pairs that came after its heap was made.
    loose: Vec<Vec<Led>>,
    /// A bit for each box, set while it has something.
    filled: [u64; 64],
    /// A bit for each word of `filled`, set while that is not 0.
    filled_words: u64,
}

impl PairQueue {
    pub(crate) fn new() -> Self {
        Self {
            heaps: (0..BOXES).map(|_| BinaryHeap::new()).collect(),
            loose: vec![Vec::new(); BOXES],
            filled: [0; 64],
            filled_words: 0,
        }
    }

    pub(crate) fn push(&mut self, led: Led) {
        let number = (led.disagreement >> IN_BOX).saturating_sub(LEAST).min(BOXES as u64 - 1) as usize;
        self.loose[number].push(led);
        self.filled[number / 64] |= 1 << (number % 64);
        self.filled_words |= 1 << (number / 64);
    }

    /// Takes the best. What `is_over` names is left out, sooner or later.
    pub(crate) fn pop(&mut self, is_over: impl Fn(u32) -> bool) -> Option<Led> {
        while self.filled_words != 0 {
            let word = self.filled_words.trailing_zeros() as usize;
            let number = 64 * word + self.filled[word].trailing_zeros() as usize;
            let heap = &mut self.heaps[number];
            heap.extend(self.loose[number].drain(..).filter(|led| !is_over(led.place)).map(Reverse));
            if let Some(Reverse(led)) = heap.pop() {
                return Some(led);
            }
            self.filled[word] &= !(1 << (number % 64));
            if self.filled[word] == 0 {
                self.filled_words &= !(1 << word);
            }
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use splat_core::rng;

    /// Against one heap, with pairs that disagree as much as others, not at all, and wholly.
    #[test]
    fn pairs_come_as_out_of_one_heap() {
        let mut queue = PairQueue::new();
        let mut heap = BinaryHeap::new();
        let numbers = [0.0, 1.0, 1e-16, 1.0 - 1e-16, f64::MIN_POSITIVE, 0.3, 0.30000001];
        for step in 0..20_000u64 {
            let unit = |a: u64| rng::unit(17, 0, step, a);
            if unit(0) < 0.6 {
                let disagreement = if unit(1) < 0.3 { numbers[(7.0 * unit(2)) as usize] } else { unit(2).powi(9) };
                let led = Led { disagreement: disagreement.to_bits(), place: (100.0 * unit(3)) as u32 };
                queue.push(led);
                heap.push(Reverse(led));
            } else {
                assert_eq!(queue.pop(|_| false), heap.pop().map(|Reverse(led)| led));
            }
        }
        while let Some(Reverse(led)) = heap.pop() {
            assert_eq!(queue.pop(|_| false), Some(led));
        }
        assert_eq!(queue.pop(|_| false), None);
    }
}
