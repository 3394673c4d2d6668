//! Radiance as it is displayed: the curve of sRGB, in numbers and in bytes.

use std::sync::LazyLock;

/// The last byte.
const WHITE: u8 = 255;
/// Low bits of a radiance that a bucket ignores. A bucket holds the radiances with the same exponent and the same seven leading bits of the mantissa, so
/// at most two bytes begin in it.
const IGNORED: u32 = 16;
/// Number of buckets for radiances from 0 to 1.
const BUCKETS: usize = (1.0f32.to_bits() >> IGNORED) as usize + 1;

/// The table from radiances to bytes. It replaces a power per channel and pixel.
struct Bytes {
    /// The least radiance that each byte displays.
    least: [f32; WHITE as usize + 1],
    /// The byte of the least radiance in each bucket.
    first: [u8; BUCKETS],
}

static BYTES: LazyLock<Box<Bytes>> = LazyLock::new(Bytes::new);

impl Bytes {
    fn new() -> Box<Self> {
        let mut bytes = Box::new(Self { least: [0.0; WHITE as usize + 1], first: [0; BUCKETS] });
        let mut low = 0u32;
        for byte in 1..=WHITE {
            // Bisects the bits, because radiances from 0 to 1 have the order of their bits.
            let mut high = 1.0f32.to_bits();
            while high - low > 1 {
                let middle = low + (high - low) / 2;
                if rounded(encoded(f32::from_bits(middle))) >= byte {
                    high = middle;
                } else {
                    low = middle;
                }
            }
            bytes.least[usize::from(byte)] = f32::from_bits(high);
        }
        for bucket in 0..BUCKETS {
            bytes.first[bucket] = rounded(encoded(f32::from_bits((bucket as u32) << IGNORED)));
        }
        bytes
    }

    /// Returns the byte that displays a radiance from 0 to 1.
    fn byte(&self, radiance: f32) -> u8 {
        let mut byte = self.first[(radiance.to_bits() >> IGNORED) as usize];
        while byte < WHITE && radiance >= self.least[usize::from(byte) + 1] {
            byte += 1;
        }
        byte
    }
}

/// Linear radiance → sRGB (IEC 61966-2-1), 0 to 1; NaN gives 0.
pub(crate) fn encoded(linear: f32) -> f32 {
    let x = clamped(linear);
    if x <= 0.003_130_8 { 12.92 * x } else { 1.055 * libm::powf(x, 1.0 / 2.4) - 0.055 }
}

/// Linear radiance → sRGB (IEC 61966-2-1) in 8 bits; NaN gives 0.
pub fn displayed(linear: f32) -> u8 {
    BYTES.byte(clamped(linear))
}

/// The byte of [`displayed`] as a number from 0 to 1.
pub(crate) fn stepped(linear: f32) -> f32 {
    f32::from(displayed(linear)) / f32::from(WHITE)
}

/// The nearest byte of a number from 0 to 1.
pub(crate) fn rounded(number: f32) -> u8 {
    (number * f32::from(WHITE) + 0.5) as u8
}

/// Clamps a radiance to 0 to 1 before the curve, whose power is undefined below 0. NaN and −0 become 0.
fn clamped(linear: f32) -> f32 {
    if linear > 0.0 { linear.min(1.0) } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ou4_hostile_values_are_displayable() {
        let cases = [(-1e-9, 0), (-1e30, 0), (f32::NAN, 0), (1e30, 255), (f32::INFINITY, 255), (0.0, 0), (1.0, 255)];
        for (linear, expected) in cases.into_iter().chain([(-0.0, 0), (f32::NEG_INFINITY, 0)]) {
            // Without clamping, what is beyond bytes would only be cut by the conversion to them.
            assert!((0.0..=1.0).contains(&encoded(linear)), "{linear}: {}", encoded(linear));
            assert_eq!(displayed(linear), expected, "{linear}");
        }
        // 18 % grey is 117.6 in sRGB.
        assert_eq!(displayed(0.18), 118);
    }

    #[test]
    fn a_byte_is_that_of_the_curve() {
        // Every 97th float from 0 to above 1, and every float near the radiances where a byte begins.
        let even = (0..1.01f32.to_bits()).step_by(97);
        let about = |least: f32| least.to_bits().saturating_sub(300)..least.to_bits() + 300;
        for bits in even.chain(BYTES.least.into_iter().flat_map(about)) {
            let radiance = f32::from_bits(bits);
            assert_eq!(displayed(radiance), rounded(encoded(radiance)), "{radiance:e}");
        }
    }

    #[test]
    fn a_step_is_its_byte() {
        (0..=WHITE).for_each(|byte| assert_eq!(rounded(f32::from(byte) / f32::from(WHITE)), byte));
        assert!(BYTES.least.windows(2).all(|pair| pair[0] < pair[1]));
    }
}
