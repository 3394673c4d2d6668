//! Objects that stop on their way where a light sees them meet others: collision by a shadow map (Gunjee 2007, sections 2 and 6).

use crate::animation::raw::{RawAnimation, RawStop};
use crate::animation::stop::{Path, Stop};
use crate::animation::tracks::{entry, items, path_of};
use crate::at::At;
use crate::source::extract::{check_light_index, check_names};
use crate::text::tree::{Node, Value};
use crate::{Error, SceneObject, Source, shown};
use glam::DVec3;

/// Checks what the tracks say of stopping; `at` is the place of the animation.
pub(crate) fn check_stops(
    at: &At<'_>,
    raw: &RawAnimation,
    objects: &[SceneObject],
    lights: usize,
) -> Result<Vec<Stop>, Error> {
    let stops = raw.track.iter().enumerate().filter_map(|(i, track)| Some((i, track.stop.as_ref()?)));
    stops.map(|(i, stop)| check_stop(at, raw, i, stop, objects, lights)).collect()
}

fn check_stop(
    at: &At<'_>,
    raw: &RawAnimation,
    i: usize,
    stop: &RawStop,
    objects: &[SceneObject],
    lights: usize,
) -> Result<Stop, Error> {
    let track = at.key("track").index(i);
    let at = track.key("stop");
    let tracks = Tracks { paths: raw.track.iter().filter_map(|track| path_of(track).ok()).collect(), objects };
    let Some(object) = tracks.moves(i) else {
        let message = format!("`stop`: expected a track of an object's place, found `{}`", shown(&raw.track[i].set));
        return Err(at.error(message, "such as set = \"object.ball.transform.translate\""));
    };
    if matches!(objects[object].source, Source::Extract(_)) {
        return Err(at.error("`stop`: an extraction is found where others stand, and meets nothing", "let them stop"));
    }
    if (0..raw.track.len()).any(|k| k != i && tracks.change(k, object, &["transform"])) {
        return Err(
            at.error("`stop`: another track moves the object too", "let one track move it, and none turn or scale it")
        );
    }
    let light = stop.light as usize;
    check_light_index(&at, light, lights)?;
    let of_light = |path: &Vec<String>| path[0] == "light" && path.get(1).is_none_or(|rank| *rank == light.to_string());
    if tracks.paths.iter().any(of_light) {
        return Err(at.key("light").error("`light`: a track changes it", "name a light that stays as it is"));
    }
    Ok(Stop {
        object,
        path: Path {
            frames: raw.track[i].keys.iter().map(|key| f64::from(key.frame)).collect(),
            places: places(&track)?,
            blend: raw.track[i].interpolation,
        },
        last: raw.frames.saturating_sub(1),
        frame: 0,
        light,
        objects: met(&at, stop, &tracks)?,
    })
}

/// The tracks of an animation by their paths, and the objects.
struct Tracks<'a> {
    paths: Vec<Vec<String>>,
    objects: &'a [SceneObject],
}

impl Tracks<'_> {
    /// The object whose place a track sets.
    fn moves(&self, track: usize) -> Option<usize> {
        let [list, object, transform, key] = &self.paths[track][..] else { return None };
        let is_place = [list, transform, key] == ["object", "transform", "translate"];
        let named = self.objects.iter().position(|o| o.name == *object);
        named.or_else(|| object.parse().ok().filter(|k| *k < self.objects.len())).filter(|_| is_place)
    }

    /// Whether a track changes what lies at these keys of an object, or within.
    fn change(&self, track: usize, rank: usize, keys: &[&str]) -> bool {
        let path = &self.paths[track];
        let is_object = path.get(1).is_none_or(|name| *name == self.objects[rank].name || *name == rank.to_string());
        path[0] == "object" && is_object && path.iter().skip(2).zip(keys).all(|(a, b)| a == b)
    }

    /// Whether any track changes an object.
    fn is_changed(&self, rank: usize) -> bool {
        (0..self.paths.len()).any(|k| self.change(k, rank, &[]))
    }
}

/// The names of the objects that one stops at.
fn met(at: &At<'_>, stop: &RawStop, tracks: &Tracks<'_>) -> Result<Vec<String>, Error> {
    let objects = tracks.objects;
    if let Some(names) = &stop.objects {
        check_names(at, names, objects)?;
        let changed = |name: &String| (0..objects.len()).any(|k| objects[k].name == *name && tracks.is_changed(k));
        if let Some(k) = names.iter().position(changed) {
            let message = format!("`objects`: `{}` is changed by a track", shown(&names[k]));
            return Err(at.key("objects").index(k).error(message, "an object stops at what stays as it is"));
        }
    }
    let is_met = |k: &usize| objects[*k].visible && !matches!(objects[*k].source, Source::Extract(_));
    let still =
        || (0..objects.len()).filter(is_met).filter(|k| !tracks.is_changed(*k)).map(|k| objects[k].name.clone());
    let names = stop.objects.clone().unwrap_or_else(|| still().collect());
    if names.is_empty() {
        let message = "`stop`: there is nothing to stop at, for no other object stays as it is";
        return Err(at.error(message, "name some by its key `objects`, which need not be visible"));
    }
    Ok(names)
}

/// The values of a track that sets places.
fn places(track: &At<'_>) -> Result<Vec<DVec3>, Error> {
    let number = |node: &Node| match node.value {
        Value::Int(i) => Some(i as f64),
        Value::Float(x) => Some(x),
        _ => None,
    };
    let place = |node: &Node| {
        let numbers: Option<Vec<f64>> = items(node).iter().map(number).collect();
        <[f64; 3]>::try_from(numbers?).ok()
    };
    let keys = entry(track.node(), "keys").map_or(&[][..], items);
    let values = keys.iter().enumerate().map(|(k, key)| {
        let at = track.key("keys").index(k).key("value");
        let found = entry(key, "value").and_then(place);
        let found = found.ok_or_else(|| at.error("`value`: expected three numbers, the place of an object", ""))?;
        at.vector("value", found)
    });
    values.collect()
}
