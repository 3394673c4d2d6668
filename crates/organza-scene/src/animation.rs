//! What changes from frame to frame: `[animation]`, its tracks, and objects that stop on their way.

pub(crate) mod raw;
pub(crate) mod stop;
pub(crate) mod stops;
pub(crate) mod tracks;
pub(crate) mod weights;
