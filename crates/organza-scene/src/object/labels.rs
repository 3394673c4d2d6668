//! Labels of a volume, checked: their names, colours and opacities, of the scene and of the table that it names.

use super::labels_raw::{RawLabel, RawLabelLook, RawLabelTable, TextOr};
use super::raw::RawObject;
use crate::at::At;
use crate::paths::Paths;
use crate::text::de;
use crate::text::file::{self, BYTES_PER_CHARACTER, MAX_SCENE_BYTES, decode};
use crate::text::toml::read_toml;
use crate::text::tree::Document;
use crate::{Error, printable, shown};
use convert::{LARGEST_LABEL, Label, LabelTable};
use read::{LabelRow, LabelRows, ReadParams};
use splat_core::srgb::linear_from_hex;
use splat_core::{Exceeded, MemoryAccount};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// The column of the faces of label surfaces.
pub(crate) const LABEL_COLUMN: &str = "label";
/// Longest name of a label, bytes.
const LONGEST_NAME: usize = 256;

/// The labels of an object, with the file that they are from.
#[derive(Debug, Clone, PartialEq)]
pub struct ObjectLabels {
    /// The labels.
    pub table: Arc<LabelTable>,
    /// The file of the table, if the scene names one.
    pub file: Option<PathBuf>,
    /// How the file was understood where that is not plain, one sentence without a full stop each.
    pub remarks: Vec<String>,
}

/// Checks the labels of an object, and reads the table that it names.
pub(crate) fn check_labels(
    at: &At<'_>,
    raw: &RawObject,
    paths: &Paths,
    memory: &MemoryAccount,
) -> Result<Option<ObjectLabels>, Error> {
    let Some(labels) = &raw.labels else { return Ok(None) };
    let at_labels = at.key("labels");
    if raw.mesh.is_none() {
        let hint = if raw.volume.is_some() {
            "name the volume by `mesh`, which draws the surface of each label"
        } else {
            "name a volume of labels by `mesh`"
        };
        return Err(at_labels.error("`labels` belongs to a `mesh` of a volume of labels", hint));
    }
    for (key, on) in
        [("color", raw.color.is_some()), ("color_by", raw.color_by.is_some()), ("field", raw.field.is_some())]
    {
        if on {
            let message = format!("`{key}` and `labels` exclude each other");
            return Err(at.key(key).error(message, "labels have colours of their own: leave one of both out"));
        }
    }
    let read_file = |at: &At<'_>, text: &str| -> Result<(PathBuf, Table), Error> {
        let path = paths.resolve(at, text)?;
        let table = read_table(&path, memory).map_err(|error| match error {
            // The scene names the file: its place is told too.
            Error::Io { path, source, .. } => {
                at.error(format!("{} cannot be read: {source}", printable(&path)), "name a table of labels")
            }
            other => other,
        })?;
        Ok((path, table))
    };
    let (file, rows) = match labels {
        TextOr::Text(text) => (Some(read_file(&at_labels, text)?), None),
        TextOr::Other(rows) => {
            let file = rows.table.as_ref().map(|text| read_file(&at_labels.key("table"), text)).transpose()?;
            (file, Some(rows))
        }
    };
    let stated = rows.map(|rows| check_rows(&at_labels, rows)).transpose()?.unwrap_or_default();
    if rows.is_some_and(|rows| rows.table.is_none() && rows.labels.is_empty()) {
        return Err(at_labels.error("expected a label, found none", "such as { 3 = \"liver\" }"));
    }
    let (file, Table { labels, remarks }) = file.map_or_else(Default::default, |(path, table)| (Some(path), table));
    Ok(Some(ObjectLabels { table: Arc::new(labels.with(stated)), file, remarks }))
}

/// The labels of a file.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Table {
    /// The labels.
    pub labels: LabelTable,
    /// How the file was understood where that is not plain, one sentence without a full stop each.
    pub remarks: Vec<String>,
}

/// Reads a table of labels: TOML where its name ends so, else one of the texts that [`read::label_rows`] knows.
///
/// # Errors
/// [`Error::Io`] for a file that cannot be read, [`Error::Limit`], [`Error::Table`], and [`Error::Scene`] with the place in a TOML file.
pub fn read_label_table(path: &Path, memory: &MemoryAccount) -> Result<Table, Error> {
    read_table(path, memory)
}

fn read_table(path: &Path, memory: &MemoryAccount) -> Result<Table, Error> {
    if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("toml")) {
        return read_toml_table(path, memory);
    }
    let params = ReadParams { memory: memory.clone(), ..ReadParams::default() };
    let LabelRows { rows, remarks } = read::label_rows(path, &params).map_err(|e| match e.fault {
        read::Fault::FileSystem => {
            let source = std::io::Error::other(format!("expected {}, found {}", e.expected, e.found));
            Error::Io { path: path.to_owned(), action: "cannot read the table of labels", source }
        }
        _ => {
            let message = format!("{}{}: expected {}, found {}", e.file, e.place, e.expected, e.found);
            Error::Table { message, hint: e.hint.to_owned() }
        }
    })?;
    let label = |row: LabelRow| {
        let LabelRow { number, name, color, opacity } = row;
        (number, Label { name, color: Some(color), opacity })
    };
    Ok(Table { labels: rows.into_iter().map(label).collect(), remarks })
}

/// The table of a TOML file, whose rows are written as those of a scene.
fn read_toml_table(path: &Path, memory: &MemoryAccount) -> Result<Table, Error> {
    let bytes = file::read(path).map_err(|error| match error {
        Error::Io { path, source, .. } => Error::Io { path, action: "cannot read the table of labels", source },
        other => other,
    })?;
    let what = format!("the table of labels {}", printable(path));
    let hint = "leave out labels that no volume has";
    Exceeded::check(what.clone(), bytes.len() as u64, MAX_SCENE_BYTES, "bytes", hint).map_err(Error::Limit)?;
    let _held = memory.take(&what, bytes.len() as u64 * BYTES_PER_CHARACTER).map_err(Error::Limit)?;
    let text = decode(path, &bytes)?;
    let root = read_toml(path, text)?;
    let document = Document { file: path, text, flags: Vec::new(), root };
    let raw: RawLabelTable = de::from_document(&document)?;
    let at = At::root(&document);
    if raw.table.is_some() {
        let hint = "name both tables in a scene, one as `table` of its `labels`";
        return Err(at.key("table").error("a table of labels names no other table", hint));
    }
    if raw.labels.is_empty() {
        return Err(at.error("expected a label, found none", "such as 3 = { name = \"liver\", color = \"#b43c32\" }"));
    }
    Ok(Table { labels: check_rows(&at, &raw)?, remarks: Vec::new() })
}

fn check_rows(at: &At<'_>, raw: &RawLabelTable) -> Result<LabelTable, Error> {
    let mut rows = Vec::with_capacity(raw.labels.len());
    for (key, label) in &raw.labels {
        let at = at.key(key);
        // The digits alone: `+3` and `03` are no keys.
        let number = key.parse().ok().filter(|number: &u32| *number <= LARGEST_LABEL && number.to_string() == *key);
        let Some(number) = number else {
            let message =
                format!("expected the number of a label, whole, from 0 to {LARGEST_LABEL}, found `{}`", shown(key));
            return Err(at.error(message, "such as 3 = \"liver\"; `table` names a file"));
        };
        rows.push((number, check_label(&at, label)?));
    }
    Ok(rows.into_iter().collect())
}

fn check_label(at: &At<'_>, raw: &RawLabel) -> Result<Label, Error> {
    let named = |at: &At<'_>, name: &str| match name.len() {
        0..=LONGEST_NAME => Ok(shown(name).to_string()),
        length => Err(at.error(format!("expected a name of at most {LONGEST_NAME} bytes, found {length}"), "")),
    };
    let RawLabelLook { name, color, opacity, visible } = match raw {
        TextOr::Text(name) => return Ok(Label { name: named(at, name)?, ..Label::default() }),
        TextOr::Other(look) => look,
    };
    let name = name.as_ref().map(|name| named(&at.key("name"), name)).transpose()?.unwrap_or_default();
    let color = color.as_ref().map(|color| check_color(at, color)).transpose()?;
    let opacity = at.number("opacity", opacity.unwrap_or(1.0), 0.0..=1.0)? as f32;
    Ok(Label { name, color, opacity: if *visible == Some(false) { 0.0 } else { opacity } })
}

/// A colour in numbers or as `#rrggbb`.
fn check_color(at: &At<'_>, raw: &TextOr<[f64; 3]>) -> Result<[f32; 3], Error> {
    match raw {
        TextOr::Other(channels) => at.colors_up_to("color", *channels, 1.0),
        TextOr::Text(text) => {
            let digits = text.strip_prefix('#').filter(|d| d.len() == 6 && d.bytes().all(|b| b.is_ascii_hexdigit()));
            let rgb = digits.and_then(|digits| u32::from_str_radix(digits, 16).ok());
            rgb.map(linear_from_hex).ok_or_else(|| {
                let message = format!("`color`: expected three numbers or \"#rrggbb\", found \"{}\"", shown(text));
                at.key("color").error(message, "such as \"#b43c32\"")
            })
        }
    }
}
