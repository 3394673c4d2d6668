//! A light with the points that stand for it.

use splat_core::Light;
use splat_core::shade::LitBy;

/// A light, and how many points stand for it: 1 for a light without an extent.
#[derive(Debug, Clone, Copy)]
pub struct SampledLight<'a> {
    /// The light.
    pub light: &'a Light,
    /// Points, those of [`Light::points`].
    pub samples: u32,
}

impl SampledLight<'_> {
    /// The points, of a light of this intensity.
    pub(crate) fn points(&self, intensity: [f32; 3]) -> Vec<Light> {
        Light { intensity, ..*self.light }.points(self.samples)
    }
}

/// A light that a sweep carries, with the shadows of all else.
#[derive(Clone, Copy)]
pub(crate) struct CarriedLight<'a> {
    pub(crate) lit: &'a LitBy<'a>,
    /// Points that stand for it.
    pub(crate) samples: u32,
}

impl<'a> CarriedLight<'a> {
    /// The light without shadows.
    pub(crate) fn sampled(&self) -> SampledLight<'a> {
        SampledLight { light: &self.lit.light, samples: self.samples }
    }
}
