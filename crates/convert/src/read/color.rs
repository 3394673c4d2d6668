//! Stored colours → linear Rec.709.

use splat_core::srgb;

/// Linear value of an sRGB component, in \[0, 1\] or beyond.
pub(super) fn linear_from_srgb(c: f64) -> f32 {
    srgb::decoded(c) as f32
}
