//! Depths as integers: the monotone map from f32 to u32.

/// Bits of a depth such that a smaller depth has a smaller key; finite input.
#[inline(always)]
pub(crate) fn key_of(depth: f32) -> u32 {
    // + 0.0 turns −0 into +0: equal depths have equal keys.
    let bits = (depth + 0.0).to_bits();
    // Negative numbers run backwards: flip all their bits, and only the sign of the others.
    bits ^ ((bits as i32 >> 31) as u32 | 0x8000_0000)
}

/// The depth of a key of [`key_of`].
#[inline(always)]
pub(crate) fn depth_of_key(key: u32) -> f32 {
    f32::from_bits(key ^ (!((key as i32) >> 31) as u32 | 0x8000_0000))
}
