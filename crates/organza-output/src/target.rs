//! One file that appears whole or not at all, and replaces no other file without permission.

use crate::Error;
use std::fs::{self, File};
use std::io::{self, ErrorKind, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};
use tempfile::{Builder, NamedTempFile, TempDir, TempPath};

/// Names of temporary files and folders begin so.
const PREFIX: &str = ".organza-";

/// Where an output goes: a regular file, or a name that is free.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Target {
    /// As it was named.
    path: PathBuf,
    /// The place itself: links are followed, the folder is there.
    real: PathBuf,
    /// Whether a file that is there may be replaced.
    replace: bool,
}

impl Target {
    /// Follows `path` to its place. Nothing may be there yet, unless `replace`; then it must be a regular file.
    ///
    /// # Errors
    /// [`Error::Output`] or [`Error::Io`].
    pub fn new(path: &Path, replace: bool) -> Result<Self, Error> {
        Self::resolve(path, replace)?.unless_taken()
    }

    /// The place, whether or not it is free.
    pub(super) fn resolve(path: &Path, replace: bool) -> Result<Self, Error> {
        if path == Path::new("-") {
            return refuse(path, "standard output is not a file", "name a file: `./-` is one of this name");
        }
        let fail = |e| Error::io(path, "cannot write here", e);
        let real = match fs::metadata(path) {
            Ok(meta) if meta.is_dir() => return refuse(path, "this is a folder", "name a file in it"),
            Ok(meta) if !meta.is_file() => {
                return refuse(path, "this is a device, a pipe or a socket", "name a regular file");
            }
            Ok(_) => path.canonicalize().map_err(fail)?,
            Err(e) if e.kind() != ErrorKind::NotFound => return Err(fail(e)),
            Err(_) if path.is_symlink() => {
                return refuse(path, "this link points to nothing", "remove the link, or choose another name");
            }
            Err(_) => match path.file_name() {
                Some(name) => folder_of(path).canonicalize().map_err(fail)?.join(name),
                None => return refuse(path, "this is a folder", "name a file in it"),
            },
        };
        Ok(Self { path: path.to_owned(), real, replace })
    }

    /// Refuses a file that is there and may not be replaced.
    pub(super) fn unless_taken(self) -> Result<Self, Error> {
        if !self.replace && fs::symlink_metadata(&self.real).is_ok() {
            return refuse(&self.path, "this file exists already", "replace it with --force, or choose another name");
        }
        Ok(self)
    }

    /// As it was named.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The folder that it lies in.
    pub(super) fn folder(&self) -> &Path {
        folder_of(&self.real)
    }

    /// Its own name in that folder.
    pub(super) fn name(&self) -> &Path {
        self.real.file_name().unwrap_or_default().as_ref()
    }

    /// Writes `bytes` to a temporary file beside the place, flushes it to the disk and gives it its name.
    ///
    /// # Errors
    /// [`Error::Io`] and [`Error::Output`], such as for what has appeared there since; the temporary file is then gone and
    /// what was there is unchanged.
    pub fn write(&self, bytes: &[u8]) -> Result<(), Error> {
        self.publish(bytes).map_err(|e| match e.kind() {
            ErrorKind::AlreadyExists => Error::Output {
                path: self.path.clone(),
                message: "a file of this name has appeared since".into(),
                hint: "replace it with --force, or choose another name".into(),
            },
            _ => Error::io(&self.path, "cannot write", e),
        })
    }

    fn publish(&self, bytes: &[u8]) -> io::Result<()> {
        let Listed { made: mut file, listing: _listed } = temporary_beside(&self.real)?;
        file.as_file_mut().write_all(bytes)?;
        file.as_file().sync_all()?;
        let temporary = file.into_temp_path();
        match fs::symlink_metadata(&self.real) {
            Ok(meta) if self.replace && meta.is_file() => {
                fs::set_permissions(&temporary, meta.permissions())?;
                temporary.persist(&self.real)?;
            }
            Ok(_) if self.replace => return Err(io::Error::other("this is not a regular file any more")),
            _ => take_free_name(temporary, &self.real)?,
        }
        // The name is on the disk once the folder is. A folder that cannot be opened has the file all the same.
        if cfg!(unix) {
            let _ = File::open(folder_of(&self.real)).and_then(|folder| folder.sync_all());
        }
        Ok(())
    }
}

fn refuse<T>(path: &Path, message: &str, hint: &str) -> Result<T, Error> {
    Err(Error::Output { path: path.to_owned(), message: message.into(), hint: hint.into() })
}

fn folder_of(path: &Path) -> &Path {
    match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    }
}

/// Temporary files that are being written, and folders in which names are tried.
static BEING_WRITTEN: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

/// Removes the temporary files of outputs that are being written, and the folders in which names are tried, and makes no further ones: for a
/// process that ends at once, in the middle.
pub fn abandon() {
    let mut being_written = being_written();
    for path in being_written.drain(..) {
        // A name that is tried meanwhile keeps its folder: once more without it.
        let gone = |_: &usize| fs::remove_file(&path).is_ok() || fs::remove_dir_all(&path).is_ok() || !path.exists();
        let _ = (0..ATTEMPTS).find(gone);
    }
    // Whoever would make another waits for the end.
    std::mem::forget(being_written);
}

fn being_written() -> MutexGuard<'static, Vec<PathBuf>> {
    BEING_WRITTEN.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Attempts to remove a folder in which names are tried.
const ATTEMPTS: usize = 100;

/// A temporary file or folder that [`abandon`] removes.
#[derive(Debug)]
pub(super) struct Listed<T> {
    pub(super) made: T,
    listing: Listing,
}

/// Takes a path from [`BEING_WRITTEN`] when it is dropped.
#[derive(Debug)]
struct Listing(PathBuf);

impl Drop for Listing {
    fn drop(&mut self) {
        being_written().retain(|path| *path != self.0);
    }
}

/// A file of our own that is gone when it is dropped. Its name is random: numbers of processes are shared by containers.
fn temporary_beside(real: &Path) -> io::Result<Listed<NamedTempFile>> {
    let mut builder = Builder::new();
    builder.prefix(PREFIX).suffix(".tmp").rand_bytes(12);
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    let mut being_written = being_written();
    let file = builder.tempfile_in(folder_of(real)).map_err(without_name)?;
    being_written.push(file.path().to_owned());
    let listing = Listing(file.path().to_owned());
    Ok(Listed { made: file, listing })
}

/// A folder of our own in a folder, that is gone with all in it when it is dropped.
pub(super) fn temporary_folder_in(folder: &Path) -> io::Result<Listed<TempDir>> {
    let mut being_written = being_written();
    let made = Builder::new().prefix(PREFIX).rand_bytes(12).tempdir_in(folder)?;
    being_written.push(made.path().to_owned());
    let listing = Listing(made.path().to_owned());
    Ok(Listed { made, listing })
}

/// An error of making something with a random name, which nobody asked for, without it.
pub(super) fn without_name(error: io::Error) -> io::Error {
    error.kind().into()
}

/// Gives a file a name, unless somebody else has it.
fn take_free_name(temporary: TempPath, real: &Path) -> io::Result<()> {
    match temporary.persist_noclobber(real) {
        // Some file systems can do neither of the ways there are.
        Err(e) if e.error.kind() != ErrorKind::AlreadyExists => take_free_name_by_placeholder(e.path, real),
        done => Ok(done?),
    }
}

/// [`take_free_name`] on any file system: an empty file of our own holds the name until it is replaced.
fn take_free_name_by_placeholder(temporary: TempPath, real: &Path) -> io::Result<()> {
    File::create_new(real)?;
    temporary.persist(real).inspect_err(|_| drop(fs::remove_file(real)))?;
    Ok(())
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use super::*;

    #[test]
    fn free_names_are_taken_by_a_placeholder_too_and_others_are_not() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.exr");
        for take in [take_free_name, take_free_name_by_placeholder] {
            let temporary = || {
                let Listed { made: mut file, listing: listed } = temporary_beside(&path).unwrap();
                file.write_all(b"new").unwrap();
                (file.into_temp_path(), listed)
            };
            take(temporary().0, &path).unwrap();
            assert_eq!(fs::read(&path).unwrap(), b"new");
            fs::write(&path, b"old").unwrap();
            assert_eq!(take(temporary().0, &path).unwrap_err().kind(), ErrorKind::AlreadyExists);
            assert_eq!(fs::read(&path).unwrap(), b"old");
            assert_eq!(fs::read_dir(&folder).unwrap().count(), 1);
            fs::remove_file(&path).unwrap();
        }
        assert!(being_written().is_empty());
    }
}
