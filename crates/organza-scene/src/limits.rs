//! Limits of the numbers that a scene may state.

/// Largest number that a scene may state: its square still fits an f32.
pub(crate) const LARGEST: f64 = 1e18;
/// Largest radiant intensity: it goes with the square of a length.
pub(crate) const LARGEST_INTENSITY: f64 = 1e30;
/// Smallest length that a scene may state.
pub(crate) const SMALLEST: f64 = 1e-18;
/// Most samples along one side of a region.
pub(crate) const MOST_SAMPLES: f64 = 65536.0;
/// Most cells along a side of a shadow map.
pub(crate) const MOST_SHADOW_CELLS: u32 = 16384;
