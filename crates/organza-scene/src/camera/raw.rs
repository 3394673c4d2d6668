//! The camera as it is written: its place, or the wish that one be found.

use crate::text::tree::{Entry, Node, Value};
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::Deserialize;

/// The camera: `position` and `target`, or `auto` and from where.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a table or \"auto\"")]
#[schemars(rename = "Camera")]
pub(crate) struct RawCamera {
    /// World position of the eye; not with `auto`.
    pub(crate) position: Option<[f64; 3]>,
    /// A point in the middle of the picture; not with `auto`.
    pub(crate) target: Option<[f64; 3]>,
    /// What points up in the picture; default [0, 1, 0]; not with `auto`.
    pub(crate) up: Option<[f64; 3]>,
    /// Whether the camera is placed so that it sees all objects; default false.
    #[serde(default)]
    pub(crate) auto: bool,
    /// With `auto`: where the eye is, degrees about +Y from +Z towards +X; default 30.
    pub(crate) azimuth: Option<f64>,
    /// With `auto`: degrees above the horizon, −90 to 90; default 15 to 40, the flatter the scene the higher.
    pub(crate) elevation: Option<f64>,
    /// With `auto`: share of the picture's width or height that is filled, above 0, at most 1; default 0.9.
    pub(crate) fit: Option<f64>,
    /// Full vertical angle of view, degrees, between 0 and 180; default 35.
    pub(crate) fov_y: Option<f64>,
    /// Height of the picture in world units, for parallel rays; instead of `fov_y`.
    pub(crate) orthographic: Option<f64>,
    /// Width and height of the picture, pixels; with `auto` default [960, 540].
    pub(crate) size: Option<[u32; 2]>,
}

/// The word for a camera that is placed by itself.
const AUTO: &str = "auto";

/// Makes a table of `camera = "auto"`, so that options and tracks can change what it says.
pub(crate) fn expand(root: &mut Node) {
    let Value::Table(entries) = &mut root.value else { return };
    for entry in entries.iter_mut().filter(|e| e.key == "camera") {
        let Node { place, value } = &mut entry.node;
        if matches!(value, Value::Text(word) if word == AUTO) {
            let auto = Node { place: *place, value: Value::Bool(true) };
            *value = Value::Table(vec![Entry { key: AUTO.to_owned(), place: *place, node: auto }]);
        }
    }
}

/// A table, or the word that [`expand`] makes one of.
pub(crate) fn schema(generator: &mut SchemaGenerator) -> Schema {
    let table = generator.subschema_for::<RawCamera>();
    json_schema!({ "anyOf": [table, { "type": "string", "const": AUTO }] })
}
