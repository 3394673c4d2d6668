//! What the path tracer and the ray marcher look at.

use crate::environment::Environment;
use crate::lights::LightSource;
use crate::medium::Medium;
use crate::surface::Surface;
use splat_core::Error;

/// Media, meshes and lights.
#[derive(Clone, Default)]
pub struct Scene<'a> {
    /// Participating media; where they overlap their extinctions add.
    pub media: Vec<Medium<'a>>,
    /// Meshes.
    pub surfaces: Vec<Surface<'a>>,
    /// Lights.
    pub lights: Vec<LightSource>,
    /// Light from beyond the scene.
    pub environment: Environment,
    /// What an eye ray that meets nothing sees; `None` for the environment.
    pub background: Option<[f64; 3]>,
}

impl Scene<'_> {
    /// Checks every number.
    ///
    /// # Errors
    /// [`Error::Invalid`] for the first medium, surface, light or pixel that does not hold.
    pub fn validate(&self) -> Result<(), Error> {
        for (i, medium) in self.media.iter().enumerate() {
            medium.validate(i)?;
        }
        for (i, surface) in self.surfaces.iter().enumerate() {
            surface.mesh.validate()?;
            surface.material.validate(i)?;
        }
        for (i, light) in self.lights.iter().enumerate() {
            light.validate(i)?;
        }
        self.environment.validate()?;
        match self.background {
            Some(b) if !b.iter().all(|v| v.is_finite() && *v >= 0.0) => {
                Err(Error::invalid("background", 0, "color", b, "three finite numbers ≥ 0"))
            }
            _ => Ok(()),
        }
    }
}
