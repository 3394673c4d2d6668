//! Places in an image, and what an image keeps of each.

use splat_core::Accumulator;

/// A pixel of an image, or of a part of it, by column and row; also a block of pixels.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Pixel {
    pub(crate) x: usize,
    pub(crate) y: usize,
}

/// What an image keeps of each pixel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct PixelForm {
    /// Channels of optical depth, 1 or 3.
    pub(crate) planes: usize,
    /// Numbers beside them: radiance by effect, normal, shadow.
    pub(crate) channels: usize,
    pub(crate) has_depths: bool,
    pub(crate) has_objects: bool,
}

impl PixelForm {
    /// That of an accumulator.
    pub(crate) fn of_image(image: &Accumulator) -> Self {
        Self {
            planes: image.optical_depth.len(),
            channels: image.channels.len(),
            has_depths: !image.depth.is_empty(),
            has_objects: !image.object.is_empty(),
        }
    }

    /// The same without depths and objects.
    pub(crate) fn without_extras(self) -> Self {
        Self { has_depths: false, has_objects: false, ..self }
    }
}
