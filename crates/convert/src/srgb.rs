//! Stored colours → linear Rec.709.

use splat_core::srgb;

/// Linear value of an sRGB component, in \[0, 1\] or beyond.
pub(crate) fn linear_from_srgb(c: f64) -> f32 {
    srgb::decoded(c) as f32
}

/// Linear value of a colour that is written as 0xRRGGBB in sRGB.
pub(crate) fn linear_from_hex(rgb: u32) -> [f32; 3] {
    [16, 8, 0].map(|shift| linear_from_srgb(f64::from(rgb >> shift & 0xff) / 255.0))
}
