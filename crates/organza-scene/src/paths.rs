//! Paths of data: relative to the scene file, inside the scene's root folder unless allowed.

use super::check::At;
use crate::{Error, printable, shown};
use std::path::{Component, Path, PathBuf};

/// Where data may lie.
pub(super) struct Paths {
    /// The scene's folder as it was named.
    folder: PathBuf,
    /// The root folder, absolute; `None` allows everything.
    root: Option<PathBuf>,
}

impl Paths {
    /// The root is the folder above the scene's folder, or the scene's folder where that would be the root of the file
    /// system.
    pub(super) fn new(scene_file: &Path, allow_path: bool) -> Result<Self, Error> {
        let folder = scene_file.parent().unwrap_or(Path::new("")).to_owned();
        if allow_path {
            return Ok(Self { folder, root: None });
        }
        let here = Path::new(".").join(&folder);
        let absolute = std::path::absolute(&here).map_err(|e| Error::io(&here, "cannot find the folder", e))?;
        let absolute = without_dots(&absolute);
        let above = absolute.parent().filter(|above| above.parent().is_some());
        let root = above.unwrap_or(&absolute).to_owned();
        Ok(Self { folder, root: Some(root) })
    }

    /// The path of a file named in the scene.
    pub(super) fn resolve(&self, at: &At<'_>, text: &str) -> Result<PathBuf, Error> {
        if text.is_empty() || text.contains('\0') {
            return Err(at.error(format!("expected a path, found \"{}\"", shown(text)), ""));
        }
        if text.contains("://") {
            return Err(
                at.error(format!("expected a path, found the address \"{}\"", shown(text)), "fetch the file first")
            );
        }
        let path = self.folder.join(text);
        let Some(root) = &self.root else { return Ok(path) };
        let absolute = std::path::absolute(&path).map_err(|e| at.error(format!("\"{}\": {e}", shown(text)), ""))?;
        // A link that leads out is caught as well; a file that does not exist is reported when it is read.
        let real = |p: &Path| p.canonicalize().ok();
        let outside_by_link = match (real(&absolute), real(root)) {
            (Some(file), Some(root)) => !file.starts_with(root),
            _ => false,
        };
        if !without_dots(&absolute).starts_with(root) || outside_by_link {
            let message = format!("\"{}\" lies outside the scene's root folder {}", shown(text), printable(root));
            return Err(at.error(message, "allow it with --allow-path"));
        }
        Ok(path)
    }
}

/// An absolute path with `.` and `..` resolved by name.
fn without_dots(path: &Path) -> PathBuf {
    let mut out = PathBuf::new();
    for component in path.components() {
        match component {
            Component::ParentDir => _ = out.pop(),
            Component::CurDir => {}
            other => out.push(other),
        }
    }
    out
}
