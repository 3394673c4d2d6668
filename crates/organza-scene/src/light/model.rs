//! Lights of a scene.

use splat_core::{Framing, Light};
use std::path::PathBuf;

/// One light of the scene, whole.
#[derive(Debug, Clone, PartialEq)]
pub struct SceneLight {
    /// How it is called: by the name that the scene gives it, or by its place in the scene's list, from 0.
    pub label: String,
    /// Where it comes from and how strong it is.
    pub light: Light,
    /// What it shines through; spots and parallel light alone.
    pub slide: Option<SlideSource>,
    /// Points that a technique which lights by points takes an extended light for, ≥ 1; 1 for any other.
    pub samples: u32,
    /// Whether the scene states them; else the plan chooses.
    pub states_samples: bool,
    /// Whether it casts shadows.
    pub shadow: bool,
    /// Cells along a side of its shadow map; `None` for those of [`crate::ShadowSettings`].
    pub shadow_cells: Option<u32>,
}

/// The picture that a light shines through: its file, and how it lies.
#[derive(Debug, Clone, PartialEq)]
pub struct SlideSource {
    /// The file.
    pub path: PathBuf,
    /// Where the picture lies before the light.
    pub framing: Framing,
}
