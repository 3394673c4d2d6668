//! Lights of a scene.

use splat_core::Light;

/// One light of the scene, whole.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SceneLight {
    /// Where it comes from and how strong it is.
    pub light: Light,
    /// Points that a technique which lights by points takes an extended light for, ≥ 1; 1 for any other.
    pub samples: u32,
    /// Whether it casts shadows.
    pub shadow: bool,
}
