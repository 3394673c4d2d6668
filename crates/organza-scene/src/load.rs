//! From a file, or its bytes, to a checked scene.

pub(crate) mod options;

use super::Scene;
use crate::animation::tracks;
use crate::load::options::{LoadOptions, Turn};
use crate::scene::check;
use crate::scene::raw::RawScene;
use crate::text::de;
use crate::text::file::{BYTES_PER_CHARACTER, MAX_SCENE_BYTES, decode, read};
use crate::text::json::read_json;
use crate::text::overrides::{self, Override};
use crate::text::toml::read_toml;
use crate::text::tree::{Document, Node};
use crate::{Error, camera};
use sha2::{Digest, Sha256};
use splat_core::Exceeded;
use std::path::Path;
use std::sync::Arc;

/// Reads and checks a scene file; JSON if its name ends in `.json`, else TOML. Of data files that are drawn
/// only the beginning is looked at, for the axis that points up; images of footprints are read.
///
/// # Errors
/// [`Error::Io`], [`Error::Limit`] for a file over [`MAX_SCENE_BYTES`], [`Error::Scene`] with line and column,
/// [`Error::Usage`] when an override is at fault.
pub fn load(file: &Path, options: &LoadOptions) -> Result<Scene, Error> {
    parse(file, &read(file)?, options)
}

/// Checks the bytes of a scene file; `file` gives the format and the folder that paths are relative to.
///
/// # Errors
/// As [`load`], without those of reading.
pub fn parse(file: &Path, bytes: &[u8], options: &LoadOptions) -> Result<Scene, Error> {
    let what = format!("the scene file {}", crate::printable(file));
    let hint = "put data into files that the scene names";
    Exceeded::check(what, bytes.len() as u64, MAX_SCENE_BYTES, "bytes", hint).map_err(Error::Limit)?;
    let what = format!("the scene {}", crate::printable(file));
    let _held = options.memory.take(&what, bytes.len() as u64 * BYTES_PER_CHARACTER).map_err(Error::Limit)?;
    let text = decode(file, bytes)?;
    let mut document = Document { file, text, flags: Vec::new(), root: read_tree(file, text)? };
    camera::raw::expand(&mut document.root);
    overrides::apply(&mut document, &options.overrides)?;
    let turn = options.turntable.map(|frames| Turn { frames: frames.max(1), frame: options.frame.unwrap_or(0) });
    if let (Some(frame), None) = (options.frame, turn) {
        tracks::apply(&mut document, frame)?;
    }
    // An option or a track may have said it anew.
    camera::raw::expand(&mut document.root);
    let raw: RawScene = de::from_document(&document)?;
    if turn.is_some() && raw.animation.is_some() {
        let message = format!("--turntable: {} has an animation of its own", crate::printable(file));
        return Err(Error::usage(message, "draw it with --frames"));
    }
    let mut scene = check::scene(&document, raw, options, turn, hash(bytes, options))?;
    // At frame 0 everything is where it begins.
    let frame = options.frame.filter(|frame| turn.is_none() && *frame > 0);
    if let (Some(frame), false) = (frame, scene.stops.is_empty()) {
        scene.stops.iter_mut().for_each(|stop| stop.frame = frame);
        scene.start = Some(Arc::new(parse(file, bytes, &LoadOptions { frame: Some(0), ..options.clone() })?));
    } else {
        scene.stops.clear();
    }
    Ok(scene)
}

/// Checks the keys of a scene file, and the types of their values; `file` gives the format. Nothing that a value names is looked for.
///
/// # Errors
/// [`Error::Scene`] with line and column.
pub fn check_keys(file: &Path, text: &str) -> Result<(), Error> {
    let mut document = Document { file, text, flags: Vec::new(), root: read_tree(file, text)? };
    camera::raw::expand(&mut document.root);
    de::from_document::<RawScene>(&document).map(|_| ())
}

/// The keys that lead to what is written at a line and a column (both from 1) of a scene file, such as `object`, `scan`, `color_by`, `map`: an entry of a
/// list has its `name`, or its index from 0. `None` where no key and no value begins there, and for a text that is no scene file.
///
/// ```
/// let text = "{\"version\": 1, \"object\": [{\"name\": \"scan\", \"opacty\": 0.5}]}";
/// let error = organza_scene::check_keys("a.json".as_ref(), text).unwrap_err();
/// assert!(error.to_string().starts_with("a.json:1:44: unknown key `opacty`"), "{error}");
/// assert_eq!(organza_scene::keys_at("a.json".as_ref(), text, 1, 44).unwrap(), ["object", "scan", "opacty"]);
/// ```
pub fn keys_at(file: &Path, text: &str, line: usize, column: usize) -> Option<Vec<String>> {
    let root = read_tree(file, text).ok()?;
    Document { file, text, flags: Vec::new(), root }.keys_at(line, column)
}

fn read_tree(file: &Path, text: &str) -> Result<Node, Error> {
    let is_json = file.extension().is_some_and(|e| e.eq_ignore_ascii_case("json"));
    if is_json { read_json(file, text) } else { read_toml(file, text) }
}

fn hash(bytes: &[u8], options: &LoadOptions) -> String {
    let mut hasher = Sha256::new();
    hasher.update(bytes);
    for change in Override::in_order(&options.overrides) {
        hasher.update(b"\n");
        hasher.update(change.flag().as_bytes());
    }
    if let Some(frame) = options.frame {
        hasher.update(format!("\n--frames {frame}"));
    }
    if let Some(frames) = options.turntable {
        hasher.update(format!("\n--turntable {frames}"));
    }
    hasher.finalize().iter().map(|b| format!("{b:02x}")).collect()
}

/// The JSON Schema of scene files, as pretty-printed JSON.
pub fn schema() -> String {
    let schema = schemars::schema_for!(RawScene);
    serde_json::to_string_pretty(&schema).expect("invariant: a schema is JSON")
}
