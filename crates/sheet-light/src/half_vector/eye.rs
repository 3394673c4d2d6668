//! The eye's image: sheets, gradients, radiance, what is composited.

pub(crate) mod buffer;
pub(crate) mod gradient;
pub(crate) mod parted;
pub(crate) mod shade;
pub(crate) mod sheets;
