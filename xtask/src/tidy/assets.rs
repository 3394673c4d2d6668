//! Files that tests and scenes read: few, small, and each with the words of those who made it beside it.

use crate::repo::Repo;

/// All of `assets/` together, bytes.
pub(crate) const MAX_BYTES: u64 = 8_000_000;

/// How the name of a file begins that says who made its folder's files and under which licence.
const CREDITS: [&str; 6] = ["LICENSE", "LICENCE", "CREDIT", "ORIGIN", "NOTICE", "README"];

/// Small enough, and every folder that holds a file holds a credit too.
pub(crate) fn assets(repo: &Repo) -> Vec<String> {
    let mut found = Vec::new();
    let bytes: u64 = in_assets(repo).map(|(_, bytes)| bytes).sum();
    if bytes > MAX_BYTES {
        found.push(format!("assets/: {bytes} bytes, at most {MAX_BYTES}"));
    }
    let bare = in_assets(repo).filter(|(path, _)| credit_of(repo, path).is_none());
    found.extend(bare.map(|(path, _)| format!("{path}: no licence or credit file in its folder")));
    found
}

/// The files under `assets/`: path and bytes.
pub(crate) fn in_assets(repo: &Repo) -> impl Iterator<Item = (&str, u64)> {
    repo.files.iter().map(|f| (f.path.as_str(), f.bytes)).filter(|(path, _)| path.starts_with("assets/"))
}

/// The credit file in the folder of an asset.
pub(crate) fn credit_of<'a>(repo: &'a Repo, path: &str) -> Option<&'a str> {
    let folder = path.rsplit_once('/').map(|(folder, _)| folder)?;
    let beside = in_assets(repo).filter_map(|(p, _)| Some((p, p.strip_prefix(folder)?.strip_prefix('/')?)));
    beside.filter(|(_, name)| CREDITS.iter().any(|c| name.to_uppercase().starts_with(c))).map(|(p, _)| p).next()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::repo::File;

    #[test]
    fn a_folder_without_credit_is_found() {
        let repo = Repo::in_memory(&[
            ("assets/README.md", "about"),
            ("assets/bunny/bunny.ply", "ply"),
            ("assets/bunny/ORIGIN.txt", "who"),
            ("assets/brain/mri.nii", "n"),
        ]);
        assert_eq!(assets(&repo), ["assets/brain/mri.nii: no licence or credit file in its folder"]);
    }

    #[test]
    fn too_many_bytes_are_found() {
        let mut repo = Repo::in_memory(&[("assets/LICENSE", "")]);
        let file = |bytes| File { path: "assets/large.bin".to_owned(), bytes, text: None };
        repo.files.push(file(MAX_BYTES));
        assert!(assets(&repo).is_empty());
        repo.files.push(file(1));
        assert_eq!(assets(&repo), ["assets/: 8000001 bytes, at most 8000000"]);
    }
}
