//! What techniques draw from objects' own data, as far as it says where light comes through it: known before splats are made.

use crate::Error;
use crate::form::PlannedObject;
use crate::lights::LightPoint;
use crate::load::own::Own;
use crate::scene::Scene;
use splat_core::Camera;

/// What techniques draw from objects' own data.
#[derive(Clone, Copy)]
pub(crate) struct Matter<'a> {
    pub(crate) scene: &'a Scene,
    pub(crate) own: &'a [Own],
    /// How each visible object is drawn.
    pub(crate) planned: &'a [PlannedObject],
    /// In the unit of `own`.
    pub(crate) camera: &'a Camera,
}

/// For each point of a light: whether a technique carries its light through what it draws by itself, or why not.
pub(crate) type Carries = Vec<Result<(), String>>;

/// How a technique answers that; or it refuses what cannot be drawn so.
pub(crate) type CarriesLight = fn(&Matter<'_>, &[LightPoint]) -> Result<Carries, Error>;
