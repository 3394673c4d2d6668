//! Names of the passes, shared by plans and cost records.

/// Files are read, and what they will become is counted.
pub const READ: &str = "read";
/// Files and fields become splats.
pub const CONVERT: &str = "convert";
/// A shadow map is built.
pub const SHADOW_MAP: &str = "tsm build";
/// The map of the eye is built, for media whose spacing is optically thick.
pub const EYE_MAP: &str = "eye map";
/// Translucent splats are culled and sliced.
pub const SORT: &str = "hbsort";
/// Splats get their footprints.
pub const PROJECT: &str = "project";
/// Splats get their radiance.
pub const SHADE: &str = "shade";
/// Opaque splats are resolved.
pub const OPAQUE: &str = "opaque";
/// Translucent splats are composited.
pub const SPLAT: &str = "splat";
/// Samplers of particles are prepared: lines search surfaces, and areas and optical depths are summed.
pub const SAMPLERS: &str = "samplers";
/// Sets of particles are made that serve many frames.
pub const SAMPLE: &str = "sample";
/// Translucent objects become particles, which are projected and averaged.
pub const PARTICLES: &str = "particles";
/// Volumes and splats are composited in slabs.
pub const SHEETS: &str = "sheets";
/// Discs are parted into groups that hardly overlap.
pub const GROUP: &str = "group";
/// Discs are blended to layers, which are composited.
pub const SURFELS: &str = "surfels";
/// Translucent splats are composited exactly, pixel by pixel, in f64.
pub const REFERENCE: &str = "reference";
/// Samples become pixels and layers.
pub const FINISH: &str = "finish";
