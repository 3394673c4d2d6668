//! Changes of the value tree by frame: a track sets one value of the scene, as `--set` does, before anything is checked.
//!
//! Between keys numbers are blended, one by one in lists and tables: linearly, or by the cubic through the keys whose slope
//! at a key is that between its neighbours (Catmull and Rom 1974). Texts and switches hold until the next key. Before the
//! first key and after the last one the value holds.

use crate::Error;
use crate::animation::raw::{RawAnimation, RawTrack};
use crate::animation::weights::weights;
use crate::at::At;
use crate::text::de::from_node;
use crate::text::overrides::{set, split_path};
use crate::text::tree::{Document, Entry, Node, Value};

/// Most frames of an animation.
const MOST_FRAMES: u32 = 1_000_000;

/// Checks the table `animation` and gives its number of frames.
pub(crate) fn check_animation(at: &At<'_>, raw: &RawAnimation) -> Result<u32, Error> {
    for (i, track) in raw.track.iter().enumerate() {
        let tracks = at.key("track");
        let at = tracks.index(i);
        if let Err(message) = path_of(track) {
            return Err(at.key("set").error(format!("`set`: {message}"), "such as \"object.bunny.transform.rotate\""));
        }
        if track.keys.is_empty() {
            return Err(at.key("keys").error("`keys`: expected at least one, found none", ""));
        }
        if let Some(k) = (1..track.keys.len()).find(|k| track.keys[*k].frame <= track.keys[k - 1].frame) {
            let before = track.keys[k - 1].frame;
            let found = track.keys[k].frame;
            let message = format!("`frame`: expected a frame after {before}, found {found}");
            return Err(at.key("keys").index(k).key("frame").error(message, "keys stand in the order of their frames"));
        }
    }
    at.whole("frames", raw.frames, 1..=MOST_FRAMES)
}

/// Whether a track changes a key of a table, or the whole table.
pub(crate) fn moves(raw: &RawAnimation, table: &str, key: &str) -> bool {
    let changes = |path: Vec<String>| path[0] == table && path.get(1).is_none_or(|changed| changed == key);
    raw.track.iter().filter_map(|track| path_of(track).ok()).any(changes)
}

/// Keys of an object that leave its shape as it is.
const LOOKS: [&str; 8] =
    ["transform", "material", "opacity", "color", "technique", "shadow_coefficient", "casts_shadow", "visible"];

/// Whether a track changes the shape of the object of this rank and name.
pub(crate) fn deforms(raw: &RawAnimation, rank: usize, name: &str) -> bool {
    let changes = |path: Vec<String>| {
        let of_object = path.get(1).is_none_or(|object| object == name || *object == rank.to_string());
        path[0] == "object" && of_object && path.get(2).is_none_or(|key| !LOOKS.contains(&key.as_str()))
    };
    raw.track.iter().filter_map(|track| path_of(track).ok()).any(changes)
}

/// Puts the values of a frame into the tree.
pub(crate) fn apply(document: &mut Document<'_>, frame: u32) -> Result<(), Error> {
    let Some(node) = entry(&document.root, "animation").cloned() else { return Ok(()) };
    let raw: RawAnimation = from_node(document, &node)?;
    check_animation(&At::root(document).key("animation"), &raw)?;
    let written = entry(&node, "track").map_or(&[][..], items);
    for (track, written) in raw.track.iter().zip(written) {
        let keys = entry(written, "keys").map_or(&[][..], items);
        let values: Vec<&Node> = keys.iter().filter_map(|key| entry(key, "value")).collect();
        let frames: Vec<f64> = track.keys.iter().map(|key| f64::from(key.frame)).collect();
        let (first, weights) = weights(&frames, f64::from(frame), track.interpolation);
        let held = frames.iter().rposition(|f| *f <= f64::from(frame)).unwrap_or(0);
        let terms: Vec<(&Node, f64)> =
            values[first..].iter().copied().zip(weights).filter(|(_, w)| *w != 0.0).collect();
        let value = blend(&terms, values[held]).map_err(|wrong| {
            let message = format!("expected {}, as at the key beside it, found {}", wrong.0, wrong.1.value.describe());
            document.error(wrong.1.place, message, "values of one track are alike")
        })?;
        let path = path_of(track).map_err(|message| document.error(written.place, message, ""))?;
        let place = values[held].place;
        set(&mut document.root, &path, value, place).map_err(|(message, hint)| {
            let place = entry(written, "set").map_or(written.place, |node| node.place);
            document.error(place, format!("`set`: {message}"), hint)
        })?;
    }
    Ok(())
}

pub(crate) fn path_of(track: &RawTrack) -> Result<Vec<String>, String> {
    let path = split_path(&track.set)?;
    if path[0] == "animation" || path[0] == "version" {
        return Err(format!("expected a value of the scene, found `{}`", crate::shown(&path[0])));
    }
    Ok(path)
}

pub(crate) fn entry<'a>(node: &'a Node, key: &str) -> Option<&'a Node> {
    let Value::Table(entries) = &node.value else { return None };
    entries.iter().find(|e| e.key == key).map(|e| &e.node)
}

pub(crate) fn items(node: &Node) -> &[Node] {
    let Value::List(items) = &node.value else { return &[] };
    items
}

/// The weighted sum of values, or what was expected and the value that is not alike.
fn blend<'a>(terms: &[(&'a Node, f64)], held: &'a Node) -> Result<Value, (String, &'a Node)> {
    let unlike = |other: &'a Node| (held.value.describe(), other);
    match &held.value {
        Value::Int(_) | Value::Float(_) => {
            let mut sum = 0.0;
            let mut whole = true;
            for (node, weight) in terms {
                let x = match node.value {
                    Value::Int(i) => i as f64,
                    Value::Float(x) => x,
                    _ => return Err(unlike(node)),
                };
                whole &= matches!(node.value, Value::Int(_));
                sum += weight * x;
            }
            // A count stays a count where it can.
            Ok(if whole && sum.fract() == 0.0 { Value::Int(sum as i64) } else { Value::Float(sum) })
        }
        Value::List(list) => {
            let element = |i: usize| {
                let mut of_terms = Vec::with_capacity(terms.len());
                for (node, weight) in terms {
                    match &node.value {
                        Value::List(other) if other.len() == list.len() => of_terms.push((&other[i], *weight)),
                        _ => return Err(unlike(node)),
                    }
                }
                Ok(Node { place: list[i].place, value: blend(&of_terms, &list[i])? })
            };
            (0..list.len()).map(element).collect::<Result<_, _>>().map(Value::List)
        }
        Value::Table(table) => {
            let element = |e: &'a Entry| {
                let mut of_terms = Vec::with_capacity(terms.len());
                for (node, weight) in terms {
                    of_terms.push((entry(node, &e.key).ok_or_else(|| unlike(node))?, *weight));
                }
                let node = Node { place: e.node.place, value: blend(&of_terms, &e.node)? };
                Ok(Entry { key: e.key.clone(), place: e.place, node })
            };
            table.iter().map(element).collect::<Result<_, _>>().map(Value::Table)
        }
        Value::Text(_) | Value::Bool(_) | Value::Null => Ok(held.value.clone()),
    }
}
