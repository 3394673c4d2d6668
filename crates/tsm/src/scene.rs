//! The casters of shadows, and the tables that they refer to.

use splat_core::{Cloud, Material, Object};

/// Splats that throw shadows. Those of objects that cast none, and those that are too faint to be seen
/// ([`splat_core::optics::FAINTEST`]), leave no trace in a map.
#[derive(Debug, Clone, Copy)]
pub struct Scene<'a> {
    /// The splats.
    pub cloud: &'a Cloud,
    /// Materials by id; an id without an entry means the default material.
    pub materials: &'a [Material],
    /// Objects by id; an id without an entry means an object that casts shadows.
    pub objects: &'a [Object],
}

impl<'a> From<&'a Cloud> for Scene<'a> {
    /// Splats of the default material that all cast shadows.
    fn from(cloud: &'a Cloud) -> Self {
        Self { cloud, materials: &[], objects: &[] }
    }
}
