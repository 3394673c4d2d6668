//! A stream of random numbers for one path: keyed by (seed, stage, pixel, sample) through the counter-based generator,
//! so that it depends on no thread; within the path a SplitMix64 sequence, which costs two multiplications a number.

use splat_core::rng;

/// Random numbers of one path.
#[derive(Debug, Clone)]
pub(crate) struct Stream {
    state: u64,
}

impl Stream {
    /// The stream of one sample of one item (pixel).
    pub(crate) fn new(seed: u64, stage: u64, item: u64, sample: u64) -> Self {
        Self { state: rng::bits(seed, stage, item, sample) }
    }

    /// Uniform in (0, 1), open at both ends: ln(u) is finite.
    #[inline(always)]
    pub(crate) fn unit(&mut self) -> f64 {
        self.state = self.state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.state;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^= z >> 31;
        ((z >> 12) as f64 + 0.5) * (1.0 / (1u64 << 52) as f64)
    }

    /// A point of the unit square.
    pub(crate) fn pair(&mut self) -> [f64; 2] {
        [self.unit(), self.unit()]
    }

    /// Exponential with mean 1.
    #[inline(always)]
    pub(crate) fn exponential(&mut self) -> f64 {
        -self.unit().ln()
    }
}
