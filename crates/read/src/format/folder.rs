//! Files of a folder in the order of their names: numbers count as numbers, so that slice2 comes before slice10.

use crate::error::{Place, ReadError};
use splat_core::text::escaped;
use std::path::{Path, PathBuf};

/// Most files of a folder.
const MOST_FILES: usize = 1 << 20;

/// The regular files of a folder in the order of their names, without hidden ones.
pub(crate) fn files(folder: &Path) -> Result<Vec<PathBuf>, ReadError> {
    let refused =
        |e: std::io::Error| ReadError::file_system("a folder that can be read", e.to_string(), "check its permissions");
    let mut files = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(refused)? {
        let path = entry.map_err(refused)?.path();
        let is_hidden = path.file_name().is_some_and(|name| name.as_encoded_bytes().starts_with(b"."));
        // Asked before opening: opening a pipe waits for its writer.
        if is_hidden || !std::fs::metadata(&path).is_ok_and(|about| about.is_file()) {
            continue;
        }
        if files.len() == MOST_FILES {
            let hint = "put the slices of one volume into a folder of their own";
            return Err(ReadError::input(Place::File, format!("a folder of at most {MOST_FILES} files"), "more", hint));
        }
        files.push(path);
    }
    files.sort_by_cached_key(|path| {
        let name = path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
        (parts(&name), name)
    });
    Ok(files)
}

/// The description of SOG among the files of a folder, which its images lie beside.
pub(crate) fn sog_description(files: &[PathBuf]) -> Option<&PathBuf> {
    let is_named = |file: &&PathBuf| file.file_name().is_some_and(|name| name == "meta.json");
    files.iter().find(is_named).filter(|file| super::is_sog_description(&super::unread::beginning(file)))
}

/// Refuses a file of a folder that is a link out of it: a scene may not read what lies outside of its folder.
pub(crate) fn check_inside(folder: &Path, file: &Path) -> Result<(), ReadError> {
    // Links are followed before they are judged.
    let lies_inside = match (folder.canonicalize(), file.canonicalize()) {
        (Ok(folder), Ok(file)) => file.starts_with(folder),
        _ => false,
    };
    if lies_inside {
        return Ok(());
    }
    let name = file.file_name().map(|name| escaped(name.as_encoded_bytes(), 60)).unwrap_or_default();
    let found = format!("'{name}', a link out of it");
    let hint = "copy the slices into the folder";
    Err(ReadError::input(Place::File, "slices that lie in the folder", found, hint))
}

/// A part of a name.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Part {
    /// Its value; numbers of more digits than that can hold are texts.
    Number(u128),
    /// What lies between numbers.
    Text(String),
}

/// Runs of digits, and what lies between them.
pub(crate) fn parts(name: &str) -> Vec<Part> {
    let mut parts = Vec::new();
    let mut rest = name;
    while let Some(first) = rest.chars().next() {
        let is_digit = first.is_ascii_digit();
        let end = rest.find(|c: char| c.is_ascii_digit() != is_digit).unwrap_or(rest.len());
        let run = &rest[..end];
        let number = if is_digit { run.parse().ok() } else { None };
        parts.push(number.map_or_else(|| Part::Text(run.to_owned()), Part::Number));
        rest = &rest[end..];
    }
    parts
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_count_as_numbers() {
        let mut names = ["s10.png", "s9.png", "s2.png", "s02.png", "r3.png", "t.png"];
        names.sort_by_key(|name| (parts(name), *name));
        assert_eq!(names, ["r3.png", "s02.png", "s2.png", "s9.png", "s10.png", "t.png"]);
        let long = "9".repeat(50);
        assert_eq!(parts(&long), [Part::Text(long.clone())]);
    }
}
