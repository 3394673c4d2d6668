//! All outputs of a run, checked together before any work.

use super::target::{Listed, Target, temporary_folder_in, without_name};
use crate::Error;
use std::collections::hash_map::Entry;
use std::collections::{HashMap, HashSet};
use std::fs::{self, File};
use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};
use tempfile::TempDir;

/// Outputs that may be written: none is an input, and none is another one spelled in a second way, through links, hard
/// links, mounts or a file system that takes `A` for `a`.
#[derive(Debug, Default)]
pub struct Targets {
    inputs: HashSet<Identity>,
    /// Files that are there.
    there: HashSet<Identity>,
    /// For each folder one of our own in it, with an empty file for each output: only the file system itself knows which
    /// names it takes, and which for the same.
    folders: HashMap<Identity, Listed<TempDir>>,
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
        let folder = match self.folders.entry(identity(target.folder()).map_err(fail)?) {
            Entry::Occupied(entry) => entry.into_mut(),
            Entry::Vacant(entry) => {
                entry.insert(temporary_folder_in(target.folder()).map_err(|e| fail(without_name(e)))?)
            }
        };
        match File::create_new(folder.made.path().join(target.name())) {
            Ok(_) => Ok(target),
            Err(e) if e.kind() == ErrorKind::AlreadyExists => refuse(TWICE),
            Err(e) => Err(fail(e)),
        }
    }
}

const TWICE: &str = "this output is named twice";

/// What tells files and folders apart, however they are spelled.
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
