//! Texels of an image.

use splat_core::srgb::linear_from_srgb;
use std::sync::LazyLock;

/// Linear values of the sRGB numbers 0 to 255.
pub(crate) static LINEAR: LazyLock<[f32; 256]> =
    LazyLock::new(|| std::array::from_fn(|i| linear_from_srgb(i as f64 / 255.0)));

/// Colours and opacities of texels, row by row from the top.
#[derive(Debug, Clone, PartialEq)]
pub enum Rgba {
    /// Bytes of sRGB and of opacity.
    Srgb(Vec<[u8; 4]>),
    /// Linear numbers.
    Linear(Vec<[f32; 4]>),
}

impl Rgba {
    /// Texels.
    #[cfg(feature = "ply")]
    pub(crate) fn len(&self) -> usize {
        match self {
            Self::Srgb(texels) => texels.len(),
            Self::Linear(texels) => texels.len(),
        }
    }

    /// Bytes that they take.
    pub(crate) fn bytes(&self) -> u64 {
        match self {
            Self::Srgb(texels) => size_of_val(texels.as_slice()) as u64,
            Self::Linear(texels) => size_of_val(texels.as_slice()) as u64,
        }
    }

    /// Linear colour and opacity of the texel at `rank`; white where there is none, as in an image that is not decoded.
    pub(crate) fn linear(&self, rank: usize) -> [f32; 4] {
        match self {
            Self::Linear(texels) => texels.get(rank).copied().unwrap_or([1.0; 4]),
            Self::Srgb(texels) => {
                let [r, g, b, alpha] = texels.get(rank).copied().unwrap_or([255; 4]);
                let linear: &[f32; 256] = &LINEAR;
                let [r, g, b] = [r, g, b].map(|c| linear[usize::from(c)]);
                [r, g, b, f32::from(alpha) / 255.0]
            }
        }
    }

    /// The first texel with a colour below 0, an opacity beyond 0 and 1, or a number that is not finite.
    #[cfg(feature = "ply")]
    pub(crate) fn wrong(&self) -> Option<usize> {
        let is_right = |[r, g, b, alpha]: &[f32; 4]| {
            [r, g, b].iter().all(|c| c.is_finite() && **c >= 0.0) && (0.0..=1.0).contains(alpha)
        };
        match self {
            Self::Srgb(_) => None,
            Self::Linear(texels) => texels.iter().position(|texel| !is_right(texel)),
        }
    }
}
