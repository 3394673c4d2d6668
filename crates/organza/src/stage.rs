//! Names of the stages of a render, for those who wait, beside those that are named after an object, a file or a light.

/// Generated sources are counted.
pub(crate) const READ: &str = "reading";
/// What comes after loading, while nobody knows more.
pub(crate) const DRAW: &str = "drawing";
/// Translucent splats are culled and sliced.
pub(crate) const SORT: &str = "sorting";
/// Discs are parted into groups.
pub(crate) const GROUP: &str = "grouping discs";
/// Splats get their footprints.
pub(crate) const PROJECT: &str = "projecting";
/// What lies between the eye and thick media is found.
pub(crate) const EYE_MAP: &str = "map of the eye";
/// Splats get their radiance.
pub(crate) const SHADE: &str = "shading";
/// Opaque splats are resolved.
pub(crate) const OPAQUE: &str = "opaque surfaces";
/// Translucent splats are composited.
pub(crate) const COMPOSITE: &str = "compositing";
/// What particles are sampled from is prepared.
pub(crate) const SAMPLERS: &str = "preparing particles";
/// Sets of particles are drawn and averaged.
pub(crate) const PARTICLES: &str = "particles";
/// Volumes and splats are composited in slabs.
pub(crate) const SHEETS: &str = "sheets";
/// Discs are blended to layers.
pub(crate) const SURFELS: &str = "surfels";
/// Translucent splats are composited exactly.
pub(crate) const REFERENCE: &str = "exact compositing";
/// Samples become pixels.
pub(crate) const FINISH: &str = "finishing";
