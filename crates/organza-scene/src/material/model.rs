//! A material, checked.

use splat_core::Material;
use std::path::PathBuf;

/// A named material.
#[derive(Debug, Clone, PartialEq)]
pub struct SceneMaterial {
    /// Name in the scene file; empty for the default material.
    pub name: String,
    /// What shading needs.
    pub material: Material,
    /// Colour of data that has none. Linear Rec.709.
    pub color: [f32; 3],
    /// Opacity of one crossing of a surface, in \[0, 1\].
    pub opacity: f64,
    /// Extinction σ_t of a medium that states none itself, 1/world unit.
    pub extinction: Option<f64>,
    /// The image that has the heights of its bumps.
    pub bump_image: Option<PathBuf>,
    /// Index into [`crate::Scene::footprints`] for objects that state none.
    pub footprint: Option<u8>,
}
