//! A folder in which the command runs.

use crate::organza;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Output;
use tempfile::TempDir;

/// A temporary folder with the scene `s.toml`.
pub struct Place {
    folder: TempDir,
}

impl Place {
    /// A new folder with this scene.
    pub fn new(scene: &str) -> Self {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("s.toml"), scene).unwrap();
        Self { folder }
    }

    /// The folder.
    pub fn folder(&self) -> &Path {
        self.folder.path()
    }

    /// A file in it.
    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// The bytes of a file in it.
    pub fn bytes(&self, name: &str) -> Vec<u8> {
        fs::read(self.path(name)).unwrap()
    }

    /// Size and colours of a PNG file in it, without what the file says of how it was made.
    pub fn pixels(&self, name: &str) -> image::DynamicImage {
        image::open(self.path(name)).unwrap()
    }

    /// Writes a file in it.
    pub fn write(&self, name: &str, bytes: impl AsRef<[u8]>) {
        fs::write(self.path(name), bytes).unwrap();
    }

    /// Runs the command in it.
    pub fn run(&self, arguments: &[&str]) -> Output {
        organza().args(arguments).current_dir(&self.folder).output().unwrap()
    }

    /// Asserts the exit code and part of stderr, and that nothing panicked.
    #[track_caller]
    pub fn expect(&self, code: i32, arguments: &[&str], stderr: &str) -> Output {
        let out = self.run(arguments);
        let text = String::from_utf8_lossy(&out.stderr);
        assert_eq!(out.status.code(), Some(code), "{arguments:?}: {text}");
        assert!(text.contains(stderr), "{arguments:?}\n  expected: {stderr}\n  found:    {text}");
        assert!(!text.contains("panicked") && !text.contains("bug in Organza"), "{text}");
        out
    }

    /// Names of all files but the scene.
    pub fn made(&self) -> Vec<String> {
        let names = fs::read_dir(&self.folder).unwrap().map(|e| e.unwrap().file_name().to_string_lossy().into_owned());
        let mut names: Vec<String> = names.filter(|n| n != "s.toml").collect();
        names.sort();
        names
    }
}
