//! The files of the working tree that belong to the repository, read once.

use crate::toml_lines::{lines, string};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// What a task says when it succeeds, or why it failed.
pub(crate) type Outcome = Result<String, String>;

/// One file of the repository.
pub(crate) struct File {
    /// Path from the root, with `/` on every system.
    pub(crate) path: String,
    /// Size in bytes.
    pub(crate) bytes: u64,
    /// The text; `None` for a file that is not UTF-8.
    pub(crate) text: Option<String>,
}

/// The working tree: tracked files, and untracked ones that are not ignored.
pub(crate) struct Repo {
    pub(crate) root: PathBuf,
    pub(crate) files: Vec<File>,
}

impl Repo {
    /// Reads the tree that this program was built from.
    pub(crate) fn open() -> Result<Self, String> {
        let here = Path::new(env!("CARGO_MANIFEST_DIR"));
        let root = here.parent().expect("invariant: xtask/ lies in the root").to_path_buf();
        let mut paths = listed_by_git(&root).map_or_else(|| walked(&root), Ok)?;
        paths.sort();
        paths.dedup();
        let mut files = Vec::with_capacity(paths.len());
        for path in paths {
            let full = root.join(&path);
            // A tracked file may be deleted in the working tree.
            if full.is_file() {
                let content = fs::read(&full).map_err(|e| format!("{path}: {e}"))?;
                files.push(File { bytes: content.len() as u64, text: String::from_utf8(content).ok(), path });
            }
        }
        Ok(Self { root, files })
    }

    /// Files whose name ends in `.rs`, with their text.
    pub(crate) fn rust(&self) -> impl Iterator<Item = (&str, &str)> {
        self.texts().filter(|(path, _)| path.ends_with(".rs"))
    }

    /// All files that are text.
    pub(crate) fn texts(&self) -> impl Iterator<Item = (&str, &str)> {
        self.files.iter().filter_map(|f| Some((f.path.as_str(), f.text.as_deref()?)))
    }

    /// The text of one file.
    pub(crate) fn text(&self, path: &str) -> Option<&str> {
        self.texts().find(|(p, _)| *p == path).map(|(_, text)| text)
    }

    /// The folders of the crates under `crates/`, in order: `crates/convert` and so on.
    pub(crate) fn crate_folders(&self) -> Vec<&str> {
        let manifests = self.files.iter().filter_map(|f| f.path.strip_suffix("/Cargo.toml"));
        manifests.filter(|folder| folder.starts_with("crates/")).collect()
    }

    /// The name of the package whose manifest lies in a folder.
    pub(crate) fn package(&self, folder: &str) -> Option<String> {
        let manifest = lines(self.text(&format!("{folder}/Cargo.toml"))?);
        string(manifest.iter().find(|l| l.table == "package" && l.key == "name")?.value).ok()
    }

    /// A tree that exists in memory only.
    #[cfg(test)]
    pub(crate) fn in_memory(files: &[(&str, &str)]) -> Self {
        let file = |&(path, text): &(&str, &str)| File {
            path: path.to_owned(),
            bytes: text.len() as u64,
            text: Some(text.to_owned()),
        };
        Self { root: PathBuf::new(), files: files.iter().map(file).collect() }
    }
}

fn listed_by_git(root: &Path) -> Option<Vec<String>> {
    let listing = Command::new("git")
        .args(["ls-files", "-z", "--cached", "--others", "--exclude-standard"])
        .current_dir(root)
        .output()
        .ok()
        .filter(|o| o.status.success())?;
    let names = String::from_utf8_lossy(&listing.stdout).into_owned();
    Some(names.split('\0').filter(|n| !n.is_empty()).map(str::to_owned).collect())
}

/// The same without git, for an unpacked archive.
fn walked(root: &Path) -> Result<Vec<String>, String> {
    let mut found = Vec::new();
    let mut folders = vec![root.to_path_buf()];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(&folder).map_err(|e| format!("{}: {e}", folder.display()))? {
            let path = entry.map_err(|e| e.to_string())?.path();
            let name = path.strip_prefix(root).expect("invariant: found under the root").to_string_lossy();
            if path.is_dir() && name != "target" && name != ".git" {
                folders.push(path);
            } else if path.is_file() {
                found.push(name.replace('\\', "/"));
            }
        }
    }
    Ok(found)
}
