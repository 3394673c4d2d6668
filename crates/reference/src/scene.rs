//! What the path tracer and the ray marcher look at.

use crate::lights::LightSource;
use crate::lights::environment::Environment;
use crate::lights::slide::Slide;
use crate::media::medium::Medium;
use crate::surfaces::surface::Surface;
use glam::DVec3;
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
    /// For each light whether nothing dims it; empty where all lights cast shadows.
    pub unshadowed: Vec<bool>,
    /// For each light what it shines through, which area lights cannot; empty where no light has any.
    pub slides: Vec<Option<Slide>>,
    /// Light from beyond the scene.
    pub environment: Environment,
    /// What an eye ray that meets nothing sees; `None` for the environment.
    pub background: Option<[f64; 3]>,
}

impl Scene<'_> {
    /// Whether some light has other shadows than those of nature.
    pub(crate) fn frees_shadows(&self) -> bool {
        self.unshadowed.contains(&true)
            || self.media.iter().any(|m| m.liberty.touches_shadows())
            || self.surfaces.iter().any(|s| s.material.liberty.touches_shadows())
    }

    /// Factor on a light that arrives at a point, per channel.
    pub(crate) fn passing(&self, light: usize, p: DVec3) -> [f64; 3] {
        self.slides.get(light).and_then(Option::as_ref).map_or([1.0; 3], |slide| slide.passing(p))
    }

    /// Refuses what only the path tracer follows.
    pub(crate) fn refuse_liberties(&self) -> Result<(), Error> {
        if let Some(i) = self.unshadowed.iter().position(|u| *u) {
            return Err(Error::invalid("light", i, "unshadowed", true, "shadows; ask the path tracer"));
        }
        if let Some(i) = self.slides.iter().position(Option::is_some) {
            return Err(Error::invalid("light", i, "slide", "one", "none; ask the path tracer"));
        }
        self.media.iter().enumerate().try_for_each(|(i, m)| m.liberty.refuse("medium", i))?;
        self.surfaces.iter().enumerate().try_for_each(|(i, s)| s.material.liberty.refuse("surface", i))
    }

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
        if !self.unshadowed.is_empty() && self.unshadowed.len() != self.lights.len() {
            let found = self.unshadowed.len();
            return Err(Error::invalid("scene", 0, "unshadowed", found, "none, or as many as there are lights"));
        }
        if !self.slides.is_empty() && self.slides.len() != self.lights.len() {
            let found = self.slides.len();
            return Err(Error::invalid("scene", 0, "slides", found, "none, or as many as there are lights"));
        }
        for (i, light) in self.lights.iter().enumerate() {
            light.validate(i)?;
            if light.is_area() && self.slides.get(i).is_some_and(Option::is_some) {
                return Err(Error::invalid("light", i, "slide", "one", "none before an area light"));
            }
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
