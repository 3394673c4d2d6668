//! Stored colours → linear Rec.709.

/// Linear value of an sRGB component in \[0, 1\] (IEC 61966-2-1).
pub fn linear_from_srgb(c: f64) -> f32 {
    let linear = if c <= 0.04045 { c / 12.92 } else { libm::pow((c + 0.055) / 1.055, 2.4) };
    linear as f32
}

/// Linear value of a colour that is written as 0xRRGGBB in sRGB.
pub(crate) fn linear_from_hex(rgb: u32) -> [f32; 3] {
    [16, 8, 0].map(|shift| linear_from_srgb(f64::from(rgb >> shift & 0xff) / 255.0))
}
