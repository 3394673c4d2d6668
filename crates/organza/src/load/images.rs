//! The images of a scene, from their files: its environment, and what lights shine through.

use super::files::FileData;
use super::loading::Loading;
use crate::scene::SceneLight;
use crate::{Error, work};
use splat_core::{Environment, Exceeded, RadianceImage, Slide};
use std::path::Path;
use std::sync::Arc;

impl Loading<'_> {
    /// The environment that the scene names, if it does, and the bytes of it and of its image.
    pub(super) fn environment(&self) -> Result<Option<(Environment, u64)>, Error> {
        let Some(source) = &self.scene.environment else { return Ok(None) };
        let (image, bytes) = self.image(&source.path, "as an environment", Environment::bytes_of)?;
        let made = Environment::new(&image, source.turns, source.scale);
        made.map(|made| Some((made, bytes)))
            .map_err(|e| Error::input(crate::printable(&source.path), e.to_string(), "use a smaller background.scale"))
    }

    /// What each light shines through, if anything, and the bytes of all that and of its images.
    pub(super) fn slides(&self, lights: &[SceneLight]) -> Result<(Vec<Option<Slide>>, u64), Error> {
        let mut all = 0;
        let one = |light: &SceneLight| {
            let Some(source) = &light.slide else { return Ok(None) };
            let (image, bytes) = self.image(&source.path, "as the texture of a light", Slide::bytes_of)?;
            all += bytes;
            let made = Slide::new(&image, &light.light.shape, &source.framing);
            made.map(Some).map_err(|e| {
                let hint = "place it in another way, by the keys that begin with `texture_`";
                Error::input(crate::printable(&source.path), e.to_string(), hint)
            })
        };
        let slides = lights.iter().map(one).collect::<Result<_, _>>()?;
        Ok((slides, all))
    }

    /// An image, and its bytes with those of what is made of one of its size.
    fn image(
        &self,
        path: &Path,
        what: &str,
        bytes_of: fn([u32; 2]) -> u64,
    ) -> Result<(Arc<RadianceImage>, u64), Error> {
        self.progress.begin(&work::reading_file(path));
        let FileData::Image(image) = self.files.read(path, &self.options.read_params(), self.progress)? else {
            let hint = "name a Radiance HDR, OpenEXR or PNG file";
            return Err(Error::wrong_kind(path, "an image of radiance", hint));
        };
        let (needed, limit) = (image.bytes().saturating_add(bytes_of(image.size)), self.options.max_memory);
        if needed > limit {
            let what = format!("{} {what}", crate::printable(path)).into();
            let hint = "use a smaller image, or a larger --max-memory".into();
            return Err(Error::Limit(Exceeded { what, needed, limit: Some(limit), unit: "bytes", hint }));
        }
        Ok((image, needed))
    }
}
