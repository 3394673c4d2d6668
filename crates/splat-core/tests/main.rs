//! Footprints, opaque rims and recordings. One program: it is linked once, and its tests share all cores.

mod accumulation;
mod opaque_rim;
#[cfg(feature = "gpu")]
mod recording;
