//! The scene file as it is written: degrees, names and nothing checked but types. Source of the JSON Schema.

use crate::animation::raw::RawAnimation;
use crate::background::raw::RawBackground;
use crate::camera::raw::RawCamera;
use crate::footprint::raw::RawFootprint;
use crate::light::raw::RawLight;
use crate::material::raw::RawMaterial;
use crate::object::raw::RawObject;
use crate::render::raw::RawRender;
use schemars::JsonSchema;
use serde::Deserialize;
use std::collections::BTreeMap;

/// A scene of Organza.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a table")]
#[schemars(title = "Organza scene")]
pub(crate) struct RawScene {
    /// Version of the schema: 1.
    pub(crate) version: u32,
    /// A folder, relative to the scene file, in which data may lie beside the folder above the scene's.
    pub(crate) root: Option<String>,
    /// The camera, or "auto" for one that sees all objects.
    #[schemars(schema_with = "crate::camera::raw::schema")]
    pub(crate) camera: RawCamera,
    #[serde(default)]
    pub(crate) background: RawBackground,
    /// Radiance that comes from all directions alike and is not shadowed.
    #[serde(default)]
    pub(crate) ambient: RawColor,
    #[serde(default)]
    pub(crate) light: Vec<RawLight>,
    #[serde(default)]
    pub(crate) object: Vec<RawObject>,
    /// Materials by name.
    #[serde(default)]
    pub(crate) material: BTreeMap<String, RawMaterial>,
    #[serde(default)]
    pub(crate) render: RawRender,
    /// What changes from frame to frame.
    pub(crate) animation: Option<RawAnimation>,
    /// Footprints, which objects, materials and points name by index: where a Gaussian is cut, in standard deviations, 1 to 8, or images.
    pub(crate) footprints: Option<Vec<RawFootprint>>,
}

/// A colour, linear Rec.709.
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default, expecting = "a table")]
#[schemars(rename = "Color")]
pub(crate) struct RawColor {
    /// Radiance per channel, each ≥ 0; default black.
    pub(crate) color: [f64; 3],
}
