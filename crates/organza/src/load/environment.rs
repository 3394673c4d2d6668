//! The environment of a scene, from its file.

use super::files::FileData;
use super::loading::Loading;
use crate::{Error, work};
use splat_core::{Environment, Exceeded};

impl Loading<'_> {
    /// The environment that the scene names, if it does, and the bytes of it and of its image.
    pub(super) fn environment(&self) -> Result<Option<(Environment, u64)>, Error> {
        let Some(source) = &self.scene.environment else { return Ok(None) };
        self.progress.begin(&work::reading_file(&source.path));
        let data = self.files.read(&source.path, &self.options.read_params(), self.progress)?;
        let FileData::Image(image) = data else {
            let hint = "name a Radiance HDR or OpenEXR file";
            return Err(Error::wrong_kind(&source.path, "an image of radiance", hint));
        };
        let file = crate::printable(&source.path);
        let (needed, limit) = (image.bytes() + Environment::bytes_of(image.size), self.options.max_memory);
        if needed > limit {
            let (what, hint) =
                (format!("{file} as an environment").into(), "use a smaller image, or a larger --max-memory");
            return Err(Error::Limit(Exceeded { what, needed, limit: Some(limit), unit: "bytes", hint: hint.into() }));
        }
        let made = Environment::new(&image, source.turns, source.scale);
        made.map(|made| Some((made, needed)))
            .map_err(|e| Error::input(file, e.to_string(), "use a smaller background.scale"))
    }
}
