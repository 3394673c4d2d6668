//! Paths of data: relative to the scene file, inside the scene's root folder, or inside the one that it names, unless allowed.

use super::{InMemory, LoadOptions};
use crate::at::At;
use crate::source::in_memory;
use crate::{Error, printable, shown};
use std::path::{Component, Path, PathBuf};

/// The key of a scene that names a further folder for data.
pub const ROOT_KEY: &str = "root";

/// The keys of a scene whose texts are paths of files or folders.
pub const PATH_KEYS: [&str; 9] =
    ["environment", "image", "images", "labels", "mesh", "points", "table", "texture", "volume"];

/// Where data may lie.
pub(crate) struct Paths {
    /// The scene's folder as it was named.
    folder: PathBuf,
    /// The root folder, absolute; `None` allows everything.
    root: Option<PathBuf>,
    /// The folder that the scene names, as the system knows it.
    named: Option<PathBuf>,
    /// The data that a source may name in the place of a file.
    in_memory: InMemory,
}

impl Paths {
    /// The root is the folder above the scene's folder, or the scene's folder where that would be the root of the file
    /// system; `named` is a further one, relative to the scene's.
    pub(crate) fn new(
        at_named: &At<'_>,
        scene_file: &Path,
        named: Option<&str>,
        options: &LoadOptions,
    ) -> Result<Self, Error> {
        let folder = folder_of(scene_file);
        let named = named.map(|named| check_named(at_named, &folder, named)).transpose()?;
        let root = if options.allow_path { None } else { Some(default_root(&folder)?) };
        if let (true, Some(named)) = (options.sandbox, &named) {
            let root = default_root(&folder)?;
            if !root.canonicalize().is_ok_and(|root| named.starts_with(root)) {
                let message =
                    format!("`{ROOT_KEY}`: {} lies outside the root folder {}", printable(named), printable(&root));
                return Err(at_named.error(message, "leave out --sandbox if you trust the scene"));
            }
        }
        Ok(Self { folder, root, named, in_memory: options.in_memory.clone() })
    }

    /// The path of a file named in the scene.
    pub(crate) fn resolve(&self, at: &At<'_>, text: &str) -> Result<PathBuf, Error> {
        check_text(at, text)?;
        if let Some(found) = in_memory::resolve(text, &self.in_memory) {
            return found.map_err(|(message, hint)| at.error(message, hint));
        }
        let path = self.folder.join(text);
        let Some(root) = &self.root else { return Ok(path) };
        let absolute = std::path::absolute(&path).map_err(|e| at.error(format!("\"{}\": {e}", shown(text)), ""))?;
        // A link that leads out is caught as well; a file that does not exist is reported when it is read.
        let real = absolute.canonicalize().ok();
        let outside_by_link = match (&real, root.canonicalize().ok()) {
            (Some(file), Some(root)) => !file.starts_with(root),
            _ => false,
        };
        let lexical = without_dots(&absolute);
        let is_in_root = lexical.starts_with(root) && !outside_by_link;
        let place = real.as_deref().unwrap_or(&lexical);
        if is_in_root || self.named.as_ref().is_some_and(|named| place.starts_with(named)) {
            return Ok(path);
        }
        let message = format!("\"{}\" lies outside the scene's root folder {}", shown(text), printable(root));
        Err(at.error(message, self.hint(place)))
    }

    /// What would allow a file that lies outside.
    fn hint(&self, place: &Path) -> String {
        let folder = self.folder.canonicalize();
        let above = place.parent().unwrap_or(place);
        // Another named folder is in the way of this one: both lie in what is above them.
        let above = self.named.as_deref().map_or(above.to_owned(), |named| common(named, above));
        let way = folder.ok().and_then(|folder| relative_path(&folder, &above)).unwrap_or(above);
        let line = format!("{ROOT_KEY} = {}", toml_text(&way.to_string_lossy()));
        format!("allow it with the line {} before the first table of the scene, or with --allow-path", shown(&line))
    }
}

/// A text in TOML's quotes, which are JSON's.
fn toml_text(text: &str) -> String {
    serde_json::Value::from(text).to_string()
}

fn check_text(at: &At<'_>, text: &str) -> Result<(), Error> {
    if text.is_empty() || text.contains('\0') {
        return Err(at.error(format!("expected a path, found \"{}\"", shown(text)), ""));
    }
    if text.contains("://") {
        return Err(at.error(format!("expected a path, found the address \"{}\"", shown(text)), "fetch the file first"));
    }
    Ok(())
}

/// The folder that a scene names for its data.
fn check_named(at: &At<'_>, folder: &Path, named: &str) -> Result<PathBuf, Error> {
    check_text(at, named)?;
    let path = Path::new(".").join(folder).join(named);
    let fail = |found: String| {
        let message = format!("`{ROOT_KEY}`: expected a folder, found \"{}\", {found}", shown(named));
        at.error(message, "a folder in which data may lie, relative to the scene file")
    };
    let real = path.canonicalize().map_err(|e| fail(format!("which cannot be opened: {e}")))?;
    if !real.is_dir() {
        return Err(fail("a file".to_owned()));
    }
    Ok(real)
}

fn folder_of(scene_file: &Path) -> PathBuf {
    scene_file.parent().unwrap_or(Path::new("")).to_owned()
}

fn default_root(folder: &Path) -> Result<PathBuf, Error> {
    let here = Path::new(".").join(folder);
    let absolute = std::path::absolute(&here).map_err(|e| Error::io(&here, "cannot find the folder", e))?;
    let absolute = without_dots(&absolute);
    let above = absolute.parent().filter(|above| above.parent().is_some());
    Ok(above.unwrap_or(&absolute).to_owned())
}

/// The value that the key `root` of a scene needs so that it may read these files: the deepest folder that holds all that lie outside
/// the scene's root folder, relative to the scene's where there is a way. `None` where all lie inside.
///
/// # Errors
/// [`Error::Io`] for what is not there.
pub fn root_for<'p>(scene_file: &Path, files: impl IntoIterator<Item = &'p Path>) -> Result<Option<PathBuf>, Error> {
    let stated = Path::new(".").join(folder_of(scene_file));
    let real = |path: &Path| path.canonicalize().map_err(|e| Error::io(path, "cannot find", e));
    let folder = real(&stated)?;
    let root = real(&default_root(&stated)?)?;
    let mut shared: Option<PathBuf> = None;
    for file in files {
        let file = real(file)?;
        if !file.starts_with(&root) {
            let above = file.parent().unwrap_or(&file);
            shared = Some(shared.map_or(above.to_owned(), |shared| common(&shared, above)));
        }
    }
    Ok(shared.map(|shared| relative_path(&folder, &shared).unwrap_or(shared)))
}

/// The deepest folder that holds all these files, absolute, links followed: the key `root` of a scene that may lie anywhere. `None` where no
/// folder does, as between drives, or without files.
pub fn folder_above<'p>(files: impl IntoIterator<Item = &'p Path>) -> Option<PathBuf> {
    // A file that is not there is hidden, perhaps: its folder may be.
    let real = |path: &Path| path.canonicalize().or_else(|_| std::path::absolute(path)).ok();
    let folders = files.into_iter().map(|file| real(file).and_then(|file| file.parent().map(Path::to_owned)));
    let folder = folders.reduce(|one, other| Some(common(&one?, &other?)))??;
    (!folder.as_os_str().is_empty()).then_some(folder)
}

/// The way from a folder to a file or folder, both as the system knows them; `None` where there is none, as between drives.
pub fn relative_path(folder: &Path, to: &Path) -> Option<PathBuf> {
    let shared = common(folder, to);
    if shared.as_os_str().is_empty() {
        return None;
    }
    let up = folder.strip_prefix(&shared).ok()?.components().map(|_| Component::ParentDir.as_os_str());
    let down = to.strip_prefix(&shared).ok()?.components().map(Component::as_os_str);
    let path: PathBuf = up.chain(down).collect();
    Some(if path.as_os_str().is_empty() { PathBuf::from(".") } else { path })
}

/// The deepest folder above both.
fn common(a: &Path, b: &Path) -> PathBuf {
    a.components().zip(b.components()).take_while(|(a, b)| a == b).map(|(a, _)| a.as_os_str()).collect()
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_way_between_folders_goes_up_and_down() {
        let way = |from: &str, to: &str| relative_path(from.as_ref(), to.as_ref()).unwrap();
        assert_eq!(way("/a/b", "/a/b/c.ply"), Path::new("c.ply"));
        assert_eq!(way("/a/b/c", "/a/x/y.ply"), Path::new("../../x/y.ply"));
        assert_eq!(way("/a", "/a"), Path::new("."));
        assert_eq!(common("/a/bc".as_ref(), "/a/bd".as_ref()), Path::new("/a"));
    }

    #[test]
    fn a_folder_is_found_above_files_that_are_not_there() {
        let above = |files: &[&str]| folder_above(files.iter().map(Path::new));
        let files = ["/nowhere/a/b/c.ply", "/nowhere/a/d.ply"];
        assert_eq!(above(&files), Some(PathBuf::from("/nowhere/a")));
        assert_eq!(above(&files[..1]), Some(PathBuf::from("/nowhere/a/b")));
        assert_eq!(above(&[]), None);
    }
}
