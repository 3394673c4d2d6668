//! The surface that a light of a scene sees first, straight from its shadow map (Gunjee 2007, Figure 15 a).

use glam::{DVec3, Vec3};
use organza::scene::Scene;
use organza::{Error, Loaded, Progress, RenderOptions, shadow_params};
use splat_core::{Light, LightShape};
use tsm::{Params, ShadowMap};

/// Greatest absorbance that may be asked for: lists of a map go somewhat farther.
const MOST: f32 = 10.0;

/// What is looked for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Seen {
    /// The light that looks, or the middle of one with an extent.
    light: Light,
    /// Its place in the scene.
    index: usize,
    /// Absorbance up to the surface.
    absorbance: f32,
}

impl Seen {
    /// What the light `index` of a scene, in the order of the file, sees up to an absorbance.
    ///
    /// # Errors
    /// [`Error::Usage`] for a light that there is not, and an absorbance out of range.
    pub fn new(scene: &Scene, index: usize, absorbance: f32) -> Result<Self, Error> {
        if !(absorbance > 0.0 && absorbance <= MOST) {
            let message = format!("--absorbance: expected a number above 0, at most {MOST}, found {absorbance}");
            return Err(Error::usage(message, ""));
        }
        let Some(light) = scene.lights.get(index) else {
            let message = format!("--light: expected a light below {}, found {index}", scene.lights.len());
            return Err(Error::usage(message, "lights are counted from 0, in the order of the scene"));
        };
        let shape = match light.light.shape {
            LightShape::Sphere { center, .. } => LightShape::Point { position: center },
            LightShape::Disk { center, normal, .. } => LightShape::Patch { position: center, normal },
            LightShape::Rect { center, u, v } => LightShape::Patch { position: center, normal: u.cross(v).normalize() },
            other => other,
        };
        Ok(Self { light: Light { shape, ..light.light }, index, absorbance })
    }

    /// Places in the world, with normals towards the light: one for each cell of its shadow map that is so thick. All of the scene is to be
    /// loaded as splats.
    ///
    /// # Errors
    /// [`Error::Input`] where no ray meets the absorbance, [`Error::Limit`] for a map beyond the memory that `options` allow,
    /// [`Error::Cancelled`].
    pub fn points(
        &self,
        scene: &Scene,
        mut loaded: Loaded,
        options: &RenderOptions,
        progress: &Progress,
    ) -> Result<Vec<(DVec3, Vec3)>, Error> {
        // From the scale of the cloud to that of the scene: a power of two.
        loaded.cloud.scale_world(2f64.powi(loaded.exponent));
        let casters = tsm::Scene { cloud: &loaded.cloud, materials: &loaded.materials, objects: &loaded.objects };
        let left = options.max_memory.saturating_sub(loaded.cloud.bytes());
        let params = shadow_params(&scene.render, &loaded, Params::default().tolerance, left);
        let map = ShadowMap::build(&casters, &self.light, &params, Some(progress)).map_err(|e| self.refused(&e))?;
        let points = map.first_surface(self.absorbance);
        if points.is_empty() {
            let message = format!("none of its rays meets an absorbance of {}", self.absorbance);
            let hint = "ask for less, or look whether objects cast shadows";
            return Err(Error::input(format!("light {}", self.index), message, hint));
        }
        Ok(points.iter().map(|p| (loaded.cloud.origin + p.position.as_dvec3(), p.normal)).collect())
    }

    fn refused(&self, error: &tsm::Error) -> Error {
        let what = format!("the shadow map of light {}", self.index);
        match error {
            tsm::Error::Limit(exceeded) => {
                Error::Limit(exceeded.clone().of(&what, "use fewer render.shadow.cells, or a larger --max-memory"))
            }
            tsm::Error::Core(splat_core::Error::Cancelled) => Error::Cancelled,
            other => Error::input(what, other.to_string(), ""),
        }
    }
}
