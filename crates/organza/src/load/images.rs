//! The images of a scene, from their files: its environment, what lights shine through, and the heights of bumps.

use super::input::refuse;
use super::loading::Loading;
use crate::scene::{SceneLight, SourceData};
use crate::{Error, cost};
use read::ReadParams;
use splat_core::{Environment, Exceeded, HeightImage, RadianceImage, Reservation, Slide};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// What is made of them.
#[derive(Debug)]
pub(crate) struct Images {
    /// What is seen behind everything in the place of a colour.
    pub(crate) environment: Option<Environment>,
    /// The most radiance that this shows, in the channel that has most; 0 without it.
    pub(crate) brightest_environment: f64,
    /// What each light shines through.
    pub(crate) slides: Vec<Option<Slide>>,
    /// The heights of each material's bumps, where an image has them.
    pub(crate) heights: Vec<Option<HeightImage>>,
    /// The memory of all of them.
    _held: Vec<Reservation>,
}

impl Images {
    /// Bytes that they take.
    pub(crate) fn bytes(&self) -> u64 {
        let slides: u64 = self.slides.iter().flatten().map(Slide::bytes).sum();
        let heights: u64 = self.heights.iter().flatten().map(HeightImage::bytes).sum();
        self.environment.as_ref().map_or(0, Environment::bytes) + slides + heights
    }
}

impl Loading<'_> {
    /// All of them; slides for these lights.
    pub(super) fn images(&self, lights: &[SceneLight]) -> Result<Images, Error> {
        let mut held = Vec::new();
        let mut brightest_environment = 0.0;
        let environment = self.environment(&mut brightest_environment, &mut held)?;
        let slides = lights.iter().map(|light| self.slide(light, &mut held)).collect::<Result<_, _>>()?;
        let mut height = |path: &PathBuf| {
            let image = self.image(path, "as heights of bumps", true, HeightImage::bytes_of, &mut held)?;
            HeightImage::new(&image).map_err(|e| refuse(path, &e, "make its heights smaller"))
        };
        let materials = self.scene.materials.iter().map(|material| material.bump_image.as_ref());
        let heights = materials.map(|path| path.map(&mut height).transpose()).collect::<Result<_, _>>()?;
        Ok(Images { environment, brightest_environment, slides, heights, _held: held })
    }

    /// The environment; `brightest` becomes its most radiance.
    fn environment(&self, brightest: &mut f64, held: &mut Vec<Reservation>) -> Result<Option<Environment>, Error> {
        let Some(source) = &self.scene.environment else { return Ok(None) };
        let image = self.image(&source.path, "as an environment", false, Environment::bytes_of, held)?;
        let made = Environment::new(&image, source.turns, source.scale);
        // What is seen is a mean of texels.
        *brightest = f64::from(image.pixels.as_flattened().iter().copied().fold(0.0, f32::max)) * source.scale;
        made.map(Some).map_err(|e| refuse(&source.path, &e, "use a smaller background.scale"))
    }

    fn slide(&self, light: &SceneLight, held: &mut Vec<Reservation>) -> Result<Option<Slide>, Error> {
        let Some(source) = &light.slide else { return Ok(None) };
        let image = self.image(&source.path, "as the texture of a light", false, Slide::bytes_of, held)?;
        let made = Slide::new(&image, &light.light.shape, &source.framing);
        let hint = "place it in another way, by the keys that begin with `texture_`";
        made.map(Some).map_err(|e| refuse(&source.path, &e, hint))
    }

    /// An image, of colours or of numbers, of which something is made that takes `bytes_of` its size.
    fn image(
        &self,
        path: &Path,
        what: &str,
        is_data: bool,
        bytes_of: fn([u32; 2]) -> u64,
        held: &mut Vec<Reservation>,
    ) -> Result<Arc<RadianceImage>, Error> {
        self.context.progress.begin(&cost::reading_file(path));
        let params = ReadParams { is_data, ..self.context.options.read_params() };
        let SourceData::Image(image) = self.context.files.data(self.scene, path, &params, self.context.progress)?
        else {
            let hint = "name a Radiance HDR, OpenEXR or PNG file";
            return Err(Error::wrong_kind(path, "an image of radiance", hint));
        };
        let hint = "use a smaller image, or a larger --max-memory";
        let made = self
            .context
            .files
            .memory(self.context.options)
            .take(&format!("{} {what}", crate::printable(path)), bytes_of(image.size));
        held.push(made.map_err(|e| Error::Limit(Exceeded { hint: hint.into(), ..e }))?);
        Ok(image)
    }
}
