//! Counter-based random numbers: a value depends on (seed, stage, item, sample) alone, never on a thread.

/// 64 random bits of the counter; the SplitMix64 finalizer applied to each word in turn.
pub fn bits(seed: u64, stage: u64, item: u64, sample: u64) -> u64 {
    let mut h = hash(seed, stage);
    h = mix(h ^ item.wrapping_mul(0x8cb9_2ba7_2f3d_8dd7));
    mix(h ^ sample.wrapping_mul(0xaaaa_aaaa_aaaa_aaab))
}

/// What [`bits`] makes of the first two words: for whoever goes on with the others elsewhere, on a device say.
pub fn hash(seed: u64, stage: u64) -> u64 {
    let h = mix(seed ^ 0x9e37_79b9_7f4a_7c15);
    mix(h ^ stage.wrapping_mul(0xd1b5_4a32_d192_ed03))
}

/// Uniform f64 in (0, 1): 52 bits, the middle of each interval, so ln(u) and ln(1 − u) are finite.
pub fn unit(seed: u64, stage: u64, item: u64, sample: u64) -> f64 {
    ((bits(seed, stage, item, sample) >> 12) as f64 + 0.5) * (1.0 / (1u64 << 52) as f64)
}

/// Uniform f32 in (0, 1): 23 bits, the middle of each interval.
pub fn unit_f32(seed: u64, stage: u64, item: u64, sample: u64) -> f32 {
    ((bits(seed, stage, item, sample) >> 41) as f32 + 0.5) * (1.0 / (1u32 << 23) as f32)
}

fn mix(mut z: u64) -> u64 {
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unit_is_open_at_both_ends_and_uniform() {
        const CELLS: usize = 64;
        const N: usize = 64_000;
        let mut count = [0usize; CELLS];
        for i in 0..N {
            let u = unit(7, 1, i as u64, 0);
            assert!(u > 0.0 && u < 1.0);
            count[(u * CELLS as f64) as usize] += 1;
        }
        let expected = (N / CELLS) as f64;
        let chi2: f64 = count.iter().map(|&c| (c as f64 - expected).powi(2) / expected).sum();
        // χ² with 63 degrees of freedom exceeds 103.4 with probability 1e-3.
        assert!(chi2 < 103.4, "chi2 {chi2}");
        assert!(unit_f32(u64::MAX, u64::MAX, u64::MAX, u64::MAX) < 1.0);
    }
}
