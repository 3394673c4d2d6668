//! What techniques draw, as far as it says where light comes through it.

use crate::Error;
use crate::form::PlannedObject;
use crate::load::own::Own;
use crate::scene::{LightPoint, Scene};
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
    /// Whether the scene asks for light that is scattered more than once on its way.
    pub(crate) scatters_again: bool,
    /// Whether any medium does so: one that is seen and whose single-scattering albedo is above 0.
    pub(crate) has_scattering_media: bool,
    /// Whether the points of a light with an extent go through it together.
    pub(crate) together: bool,
    /// For each point of a light: how wide penumbras of the whole light become per distance behind what casts them, among what is
    /// drawn so; 0 for a light without an extent.
    pub(crate) widening: Vec<f64>,
}

/// How a technique is asked for that; it refuses what cannot be drawn so.
pub(crate) type CarriesLight = fn(&Matter<'_>, &[LightPoint]) -> Result<Carries, Error>;
