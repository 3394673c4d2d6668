//! The lights of a sweep, for splats and polygons.

use splat_core::Camera;
use splat_core::glam::DVec3;
use splat_core::shade::LitBy;

/// The lights of a sweep.
#[derive(Clone, Copy)]
pub(crate) struct Lamps<'a> {
    /// The one that is carried.
    pub(crate) carried: Option<LitBy<'a>>,
    /// Those whose shadows are known.
    pub(crate) mapped: &'a [LitBy<'a>],
    pub(crate) ambient: [f32; 3],
    /// The eye.
    pub(crate) camera: &'a Camera,
    /// World position that receivers of shadows are relative to.
    pub(crate) shadow_origin: DVec3,
    /// Whether ambient and emitted light belong to another sweep.
    pub(crate) light_alone: bool,
}

/// The same with all lights in one list.
pub(crate) struct LampList<'a> {
    pub(crate) lamps: Lamps<'a>,
    /// The carried one first.
    pub(crate) lights: Vec<LitBy<'a>>,
}

impl<'a> Lamps<'a> {
    pub(crate) fn listed(&self) -> LampList<'a> {
        LampList { lamps: *self, lights: self.carried.iter().chain(self.mapped).copied().collect() }
    }
}
