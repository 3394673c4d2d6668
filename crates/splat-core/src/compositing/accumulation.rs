//! How exactly a pixel sums.

/// Precision of the optical depth and the colours that are summed in a pixel.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Accumulation {
    /// Single precision.
    #[default]
    F32,
    /// Half precision: every sum is rounded to 11 bits after every splat, and transmittance is e^−A of the rounded sum.
    /// To see what it costs; it saves no time here. Sums stall when a splat adds less than half a unit in the last place.
    F16,
}
