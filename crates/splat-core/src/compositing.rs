//! What pixels hold: sums, layers, profiles of depth, and the light that arrives.

pub(crate) mod accumulation;
pub(crate) mod arrived;
pub(crate) mod depth_profile;
pub(crate) mod layers;
pub(crate) mod pixel_samples;
pub(crate) mod transmittance;
