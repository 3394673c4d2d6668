//! The scene file as it is written: degrees, names and nothing checked but types. Source of the JSON Schema.

use super::raw_camera::RawCamera;
use super::raw_footprint::RawFootprint;
use super::raw_light::RawLight;
use super::raw_material::RawMaterial;
use super::raw_object::RawObject;
use super::raw_render::RawRender;
use schemars::JsonSchema;
use serde::Deserialize;
use std::collections::BTreeMap;

/// A scene of Organza.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a table")]
#[schemars(title = "Organza scene")]
pub(super) struct RawScene {
    /// Version of the schema: 1.
    pub(super) version: u32,
    /// A folder, relative to the scene file, in which data may lie beside the folder above the scene's.
    pub(super) root: Option<String>,
    /// The camera, or "auto" for one that sees all objects.
    #[schemars(schema_with = "super::raw_camera::schema")]
    pub(super) camera: RawCamera,
    #[serde(default)]
    pub(super) background: RawBackground,
    /// Radiance that comes from all directions alike and is not shadowed.
    #[serde(default)]
    pub(super) ambient: RawColor,
    #[serde(default)]
    pub(super) light: Vec<RawLight>,
    #[serde(default)]
    pub(super) object: Vec<RawObject>,
    /// Materials by name.
    #[serde(default)]
    pub(super) material: BTreeMap<String, RawMaterial>,
    #[serde(default)]
    pub(super) render: RawRender,
    /// What changes from frame to frame.
    pub(super) animation: Option<RawAnimation>,
    /// Footprints, which objects, materials and points name by index: where a Gaussian is cut, in standard deviations, 1 to 8, or images.
    pub(super) footprints: Option<Vec<RawFootprint>>,
}

/// What changes from frame to frame.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a table")]
#[schemars(rename = "Animation")]
pub(super) struct RawAnimation {
    /// Number of frames, counted from 0.
    pub(super) frames: u32,
    /// One value of the scene each, in the order in which they are set.
    #[serde(default)]
    pub(super) track: Vec<RawTrack>,
}

/// One value of the scene by frame.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a table")]
#[schemars(rename = "Track")]
pub(super) struct RawTrack {
    /// Path of the value as for `--set`, such as `object.bunny.transform.rotate`.
    pub(super) set: String,
    /// Its values, by increasing frame.
    pub(super) keys: Vec<RawKey>,
    /// What lies between keys; default linear.
    #[serde(default)]
    pub(super) interpolation: Blend,
    /// Where an object whose `transform.translate` is set stops on its way; default nowhere.
    pub(super) stop: Option<RawStop>,
}

/// Where an object stops: at the first place where a light sees it meet others.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a table")]
#[schemars(rename = "Stop")]
pub(super) struct RawStop {
    /// Index of the light, from 0.
    #[serde(default)]
    pub(super) light: u32,
    /// Names of the objects that it stops at, visible or not; default all visible ones that no track changes.
    pub(super) objects: Option<Vec<String>>,
}

/// A value at a frame.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a table")]
#[schemars(rename = "Key")]
pub(super) struct RawKey {
    /// The frame.
    pub(super) frame: u32,
    /// The value; it stays in the value tree.
    #[serde(rename = "value")]
    #[schemars(with = "serde_json::Value")]
    pub(super) _value: serde::de::IgnoredAny,
}

/// What lies between two keys.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
#[schemars(rename = "Interpolation")]
pub(super) enum Blend {
    /// A straight line.
    #[default]
    Linear,
    /// A cubic without corners at the keys.
    Smooth,
}

/// A colour, linear Rec.709.
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default, expecting = "a table")]
#[schemars(rename = "Color")]
pub(super) struct RawColor {
    /// Radiance per channel, each ≥ 0; default black.
    pub(super) color: [f64; 3],
}

/// What lies behind everything: a colour or an environment.
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default, expecting = "a table")]
#[schemars(rename = "Background")]
pub(super) struct RawBackground {
    /// Radiance per channel, linear Rec.709, each ≥ 0; default black.
    pub(super) color: Option<[f64; 3]>,
    /// Path of a Radiance HDR or OpenEXR image of all directions by latitude and longitude, +Y up, its middle towards +Z; in the place
    /// of `color`. It is seen and lights nothing.
    pub(super) environment: Option<String>,
    /// Degrees by which the environment is turned about +Y; default 0.
    pub(super) rotate: Option<f64>,
    /// Factor on the environment's radiance, ≥ 0; default 1.
    pub(super) scale: Option<f64>,
}
