//! What techniques draw, as far as it says where light comes through it.

use crate::Error;
use crate::form::PlannedObject;
use crate::lights::LightPoint;
use crate::load::own::Own;
use crate::scene::Scene;
use splat_core::{Camera, Cloud};

/// What techniques draw.
#[derive(Clone, Copy)]
pub(crate) struct Matter<'a> {
    pub(crate) scene: &'a Scene,
    pub(crate) own: &'a [Own],
    /// How each visible object is drawn.
    pub(crate) planned: &'a [PlannedObject],
    /// The splats of all objects, once they are made.
    pub(crate) cloud: Option<&'a Cloud>,
    /// In the unit of `own`.
    pub(crate) camera: &'a Camera,
}

/// How a technique carries light through what it draws.
pub(crate) struct Carries {
    /// For each point of a light: whether it does, or why not.
    pub(crate) points: Vec<Result<(), String>>,
    /// Whether light is scattered more than once on its way.
    pub(crate) scatters_again: bool,
}

/// How a technique is asked for that; it refuses what cannot be drawn so.
pub(crate) type CarriesLight = fn(&Matter<'_>, &[LightPoint]) -> Result<Carries, Error>;
