//! Workspaces of their own, Python's and the fuzz targets', lock the versions that the root's workspace locks.

use crate::repo::Repo;
use crate::toml_lines::{Line, lines, string};
use std::collections::BTreeSet;

/// A package and its version.
type Locked = (String, String);

/// A package that a test of the workspace has checked in one version is not shipped in another.
pub(crate) fn locks(repo: &Repo) -> Vec<String> {
    let root = locked(repo.text("Cargo.lock").unwrap_or_default());
    let others = repo.texts().filter(|(path, _)| path.ends_with("/Cargo.lock"));
    others.flat_map(|(path, text)| differing(&root, path, &locked(text))).collect()
}

fn differing(root: &BTreeSet<Locked>, path: &str, other: &BTreeSet<Locked>) -> Vec<String> {
    let mut found = Vec::new();
    for (name, version) in other.difference(root) {
        let expected: Vec<&str> = root.iter().filter(|locked| locked.0 == *name).map(|l| l.1.as_str()).collect();
        if !expected.is_empty() {
            found.push(format!("{path}: found {name} {version}, expected {} as in Cargo.lock", expected.join(" or ")));
        }
    }
    // One finding per version says what to do too often.
    found.extend(
        (!found.is_empty()).then(|| format!("{path}: copy Cargo.lock there, then run cargo metadata in its folder")),
    );
    found
}

/// The packages of a lock file.
fn locked(text: &str) -> BTreeSet<Locked> {
    let lines = lines(text);
    let names = lines.iter().filter(|line| line.table == "package" && line.key == "name");
    let with_version = |name: &Line<'_>| {
        let version = lines.iter().find(|line| line.heading == name.heading && line.key == "version")?;
        Some((string(name.value).ok()?, string(version.value).ok()?))
    };
    names.filter_map(with_version).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_version_that_the_workspace_does_not_lock_is_found() {
        let package =
            |name: &str, version: &str| format!("[[package]]\nname = \"{name}\"\nversion = \"{version}\"\n\n");
        let root =
            "version = 4\n\n".to_owned() + &package("a", "1.0.0") + &package("b", "1.0.0") + &package("b", "2.0.0");
        let same = package("b", "2.0.0") + &package("c", "3.0.0");
        let newer = package("a", "1.0.1") + &package("b", "2.0.1");
        let repo = Repo::in_memory(&[("Cargo.lock", &root), ("c/Cargo.lock", &same), ("d/Cargo.lock", &newer)]);
        assert_eq!(
            locks(&repo),
            [
                "d/Cargo.lock: found a 1.0.1, expected 1.0.0 as in Cargo.lock",
                "d/Cargo.lock: found b 2.0.1, expected 1.0.0 or 2.0.0 as in Cargo.lock",
                "d/Cargo.lock: copy Cargo.lock there, then run cargo metadata in its folder"
            ]
        );
    }
}
