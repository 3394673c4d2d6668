//! What lies behind everything, checked.

use std::path::PathBuf;

/// An environment: the file of its image, and how it is turned.
#[derive(Debug, Clone, PartialEq)]
pub struct EnvironmentSource {
    /// The file.
    pub path: PathBuf,
    /// Rotation about +Y, turns; right-handed.
    pub turns: f64,
    /// Factor on its radiance, ≥ 0.
    pub scale: f64,
}
