//! How a scene is loaded.

use crate::InMemory;
use crate::text::overrides::Override;
use splat_core::MemoryAccount;

/// How a scene is loaded.
#[derive(Debug, Clone, Default)]
pub struct LoadOptions {
    /// Allow data outside the scene's root folder: the folder above the scene's folder (or the scene's folder itself
    /// where that would be the root of the file system).
    pub allow_path: bool,
    /// Forbid that the scene's own word, its key `root`, allows data outside the scene's root folder: for scenes of strangers.
    pub sandbox: bool,
    /// The account on which the text of the scene and the images of its footprints are while they are read, with all else that is on it.
    pub memory: MemoryAccount,
    /// Data that the scene may name as `memory:NAME`.
    pub in_memory: InMemory,
    /// Changes from the command line, applied in order before anything is checked.
    pub overrides: Vec<Override>,
    /// The frame of the scene's animation; `None` loads the scene as it is written.
    pub frame: Option<u32>,
    /// Frames of a turntable, which take the place of an animation: in frame k of n the camera has gone k/n of a circle about +Y
    /// through its target, or through the middle of all that is seen.
    pub turntable: Option<u32>,
}

/// A frame of a turntable.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Turn {
    /// Frames of the whole circle.
    pub(crate) frames: u32,
    /// This one.
    pub(crate) frame: u32,
}

impl Turn {
    /// How far the camera has gone, radians.
    pub(crate) fn angle(self) -> f64 {
        std::f64::consts::TAU * f64::from(self.frame) / f64::from(self.frames)
    }
}
