//! Stored colours → linear Rec.709.

/// Linear value of an sRGB component in \[0, 1\] (IEC 61966-2-1).
pub(super) fn linear_from_srgb(c: f64) -> f32 {
    let linear = if c <= 0.04045 { c / 12.92 } else { libm::pow((c + 0.055) / 1.055, 2.4) };
    linear as f32
}
