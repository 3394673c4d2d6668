//! `[animation]` as it is written.

use schemars::JsonSchema;
use serde::Deserialize;

/// What changes from frame to frame.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a table")]
#[schemars(rename = "Animation")]
pub(crate) struct RawAnimation {
    /// Number of frames, counted from 0.
    pub(crate) frames: u32,
    /// One value of the scene each, in the order in which they are set.
    #[serde(default)]
    pub(crate) track: Vec<RawTrack>,
}

/// One value of the scene by frame.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a table")]
#[schemars(rename = "Track")]
pub(crate) struct RawTrack {
    /// Path of the value as for `--set`, such as `object.bunny.transform.rotate`.
    pub(crate) set: String,
    /// Its values, by increasing frame.
    pub(crate) keys: Vec<RawKey>,
    /// What lies between keys; default linear.
    #[serde(default)]
    pub(crate) interpolation: Blend,
    /// Where an object whose `transform.translate` is set stops on its way; default nowhere.
    pub(crate) stop: Option<RawStop>,
}

/// Where an object stops: at the first place where a light sees it meet others.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a table")]
#[schemars(rename = "Stop")]
pub(crate) struct RawStop {
    /// Index of the light, from 0.
    #[serde(default)]
    pub(crate) light: u32,
    /// Names of the objects that it stops at, visible or not; default all visible ones that no track changes.
    pub(crate) objects: Option<Vec<String>>,
}

/// A value at a frame.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a table")]
#[schemars(rename = "Key")]
pub(crate) struct RawKey {
    /// The frame.
    pub(crate) frame: u32,
    /// The value; it stays in the value tree.
    #[serde(rename = "value")]
    #[schemars(with = "serde_json::Value")]
    pub(crate) _value: serde::de::IgnoredAny,
}

/// What lies between two keys.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
#[schemars(rename = "Interpolation")]
pub(crate) enum Blend {
    /// A straight line.
    #[default]
    Linear,
    /// A cubic without corners at the keys.
    Smooth,
}
