//! All outputs of a run, checked together before any work.

use super::target::{Target, temporary_folder_in, without_name};
use crate::Error;
use std::collections::{HashMap, HashSet};
use std::fs::{self, File};
use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};

/// Outputs that may be written: none is an input, and none is another one spelled in a second way, through links, hard
/// links, mounts or a file system that takes `A` for `a`.
#[derive(Debug, Default)]
pub struct Targets {
    inputs: HashSet<Identity>,
    /// Files that are there.
    there: HashSet<Identity>,
    folders: HashMap<Identity, Names>,
}

/// Names of outputs in one folder. Only the file system knows which names it takes, and which for the same: it is asked where it must be, by
/// empty files in a folder of our own that is gone at once. Frames that differ by their numbers are not asked of each other.
#[derive(Debug, Default)]
struct Names {
    /// By the digits in them, which no file system takes for others.
    by_digits: HashMap<String, Vec<PathBuf>>,
    /// Names without their digits, one of which the file system took.
    taken_shapes: HashSet<String>,
}

impl Names {
    /// Adds a name that the file system takes, and for none that is there; otherwise the error of making a file of it.
    fn add(&mut self, folder: &Path, name: &Path) -> io::Result<()> {
        let text = name.to_string_lossy();
        let digits: String = text.chars().filter(char::is_ascii_digit).collect();
        let shape: String = text.chars().map(|c| if c.is_ascii_digit() { '0' } else { c }).collect();
        let namesakes = self.by_digits.entry(digits).or_default();
        let doubtful: Vec<&PathBuf> = namesakes.iter().filter(|other| may_be_one(other, name)).collect();
        if !self.taken_shapes.contains(&shape) || !doubtful.is_empty() {
            let tried = temporary_folder_in(folder).map_err(without_name)?;
            for name in doubtful.into_iter().map(PathBuf::as_path).chain([name]) {
                File::create_new(tried.made.path().join(name))?;
            }
            self.taken_shapes.insert(shape);
        }
        namesakes.push(name.to_owned());
        Ok(())
    }
}

/// Whether some file system may take two names for one: other letters of ASCII are others everywhere, but for capitals.
fn may_be_one(a: &Path, b: &Path) -> bool {
    match (a.to_str(), b.to_str()) {
        (Some(a), Some(b)) if a.is_ascii() && b.is_ascii() => a.eq_ignore_ascii_case(b),
        _ => true,
    }
}

impl Targets {
    /// Also keeps outputs from replacing these files. One that is not there is not the matter of outputs.
    pub fn add_inputs(&mut self, inputs: &[PathBuf]) {
        self.inputs.extend(inputs.iter().filter_map(|path| identity(path).ok()));
    }

    /// Checks a further output: its folder can be written to, nothing is there yet unless `replace`, and then a regular file.
    ///
    /// # Errors
    /// [`Error::Output`] or [`Error::Io`].
    pub fn add(&mut self, path: &Path, replace: bool) -> Result<Target, Error> {
        let refuse = |message: &str| {
            let hint = "choose another name".into();
            Err(Error::Output { path: path.to_owned(), message: message.into(), hint })
        };
        let fail = |e| Error::io(path, "cannot write here", e);
        let target = Target::resolve(path, replace)?;
        if let Ok(there) = identity(path) {
            if self.inputs.contains(&there) {
                return refuse("this output is also an input");
            }
            if !self.there.insert(there) {
                return refuse(TWICE);
            }
        }
        let target = target.unless_taken()?;
        let names = self.folders.entry(identity(target.folder()).map_err(fail)?).or_default();
        match names.add(target.folder(), target.name()) {
            Ok(()) => Ok(target),
            Err(e) if e.kind() == ErrorKind::AlreadyExists => refuse(TWICE),
            Err(e) => Err(fail(e)),
        }
    }
}

const TWICE: &str = "this output is named twice";

/// The identity of a file or folder, independent of the spelling of its path.
#[cfg(unix)]
type Identity = [u64; 2];
#[cfg(not(unix))]
type Identity = PathBuf;

#[cfg(unix)]
fn identity(path: &Path) -> io::Result<Identity> {
    use std::os::unix::fs::MetadataExt;
    fs::metadata(path).map(|meta| [meta.dev(), meta.ino()])
}

#[cfg(not(unix))]
fn identity(path: &Path) -> io::Result<Identity> {
    fs::canonicalize(path)
}
