//! Files that appear whole or not at all.

use crate::Error;
use std::ffi::OsString;
use std::fs::{self, File, OpenOptions};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

/// Checks before any work that a file can be written: its folder exists and can be written to, nothing is there
/// already unless `force`, and it is none of the `inputs`.
///
/// # Errors
/// [`Error::Output`] or [`Error::Io`], exit code 4.
pub fn check_target(path: &Path, force: bool, inputs: &[PathBuf]) -> Result<(), Error> {
    let refuse = |message: &str, hint: &str| {
        Err(Error::Output { path: path.to_owned(), message: message.into(), hint: hint.into() })
    };
    if path.file_name().is_none() || path.is_dir() {
        return refuse("this is a folder", "name a file in it");
    }
    let is_input = |real: PathBuf| inputs.iter().any(|input| input.canonicalize().is_ok_and(|i| i == real));
    if path.canonicalize().is_ok_and(is_input) {
        return refuse("this output is also an input", "choose another name");
    }
    match fs::symlink_metadata(path) {
        Ok(_) if !force => {
            return refuse("this file exists already", "replace it with --force, or choose another name");
        }
        Ok(meta) if !(meta.is_file() || meta.is_symlink()) => {
            return refuse("this is not a regular file", "choose another name");
        }
        Ok(_) => {}
        Err(e) if e.kind() == io::ErrorKind::NotFound => {}
        // Such as a name that is too long, which the temporary file's would not be.
        Err(e) => return Err(Error::io(path, "cannot write here", e)),
    }
    // The only sure test of a folder is to make a file in it.
    let temporary = temporary_name(path);
    let made = OpenOptions::new().write(true).create_new(true).open(&temporary);
    made.map_err(|e| Error::io(path, "cannot write here", e))?;
    fs::remove_file(&temporary).map_err(|e| Error::io(&temporary, "cannot remove the temporary file", e))
}

/// Writes `bytes` to a temporary file beside `path`, flushes it to the disk, renames it to `path` and flushes the folder.
/// A link is followed, so that it goes on pointing where it does.
///
/// # Errors
/// [`Error::Io`]; the temporary file is then gone and a file that was there before is unchanged.
pub fn write_atomically(path: &Path, bytes: &[u8]) -> Result<(), Error> {
    let target = path.canonicalize().unwrap_or_else(|_| path.to_owned());
    let temporary = temporary_name(&target);
    let written = write_and_rename(&temporary, &target, bytes);
    if written.is_err() {
        // The error at hand says more than one about a file that is not there.
        let _ = fs::remove_file(&temporary);
    }
    written.map_err(|e| Error::io(path, "cannot write", e))
}

fn write_and_rename(temporary: &Path, target: &Path, bytes: &[u8]) -> io::Result<()> {
    let mut file = OpenOptions::new().write(true).create_new(true).open(temporary)?;
    file.write_all(bytes)?;
    file.sync_all()?;
    drop(file);
    if let Ok(meta) = fs::metadata(target) {
        fs::set_permissions(temporary, meta.permissions())?;
    }
    fs::rename(temporary, target)?;
    if cfg!(unix) {
        // The rename is on the disk once the folder is.
        File::open(folder_of(target))?.sync_all()?;
    }
    Ok(())
}

fn folder_of(path: &Path) -> &Path {
    match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    }
}

/// `.NAME.tmp-PID` beside the file, cut so that the name is not too long for the file system.
fn temporary_name(path: &Path) -> PathBuf {
    let mut name = OsString::from(".");
    let file_name = path.file_name().unwrap_or_default();
    // 255 bytes are common to file systems; a name of up to 200 is kept as it is.
    if file_name.len() <= 200 {
        name.push(file_name)
    } else {
        name.push("organza")
    }
    name.push(format!(".tmp-{}", std::process::id()));
    folder_of(path).join(name)
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use super::*;

    #[test]
    fn bi32_a_failed_write_leaves_the_old_file() {
        let folder = std::env::temp_dir().join(format!("organza-atomic-{}", std::process::id()));
        fs::create_dir_all(&folder).unwrap();
        let path = folder.join("a.exr");
        fs::write(&path, b"old").unwrap();
        // A temporary file of the same name in the way makes the write fail before the rename.
        let temporary = temporary_name(&path.canonicalize().unwrap());
        fs::create_dir(&temporary).unwrap();
        assert_eq!(write_atomically(&path, b"new").unwrap_err().exit_code(), 4);
        assert_eq!(fs::read(&path).unwrap(), b"old");
        fs::remove_dir(&temporary).unwrap();
        write_atomically(&path, b"new").unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"new");
        assert_eq!(fs::read_dir(&folder).unwrap().count(), 1);
        fs::remove_dir_all(&folder).unwrap();
    }
}
