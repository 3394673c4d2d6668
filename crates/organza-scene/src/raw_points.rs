//! How raw points look, as it is written.

use schemars::JsonSchema;
use serde::Deserialize;

/// What points become.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
#[schemars(rename = "PointForm")]
pub(super) enum RawPointForm {
    Surface,
    Medium,
}

/// The column of its file that points take their colours from.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a table")]
#[schemars(rename = "ColorBy")]
pub(super) struct RawColorBy {
    /// Name of the column, one of those that `organza info` lists.
    pub(super) column: String,
    /// A colour map, "classes" or "distinct"; default "classes" for classes, else "viridis". Not together with `transfer`.
    pub(super) map: Option<String>,
    /// Numbers at the two ends of the map; default the 1st and the 99th percentile.
    pub(super) range: Option<[f64; 2]>,
}

/// The diameter of every disc of points.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a table")]
#[schemars(rename = "PointSize")]
pub(super) struct RawPointSize {
    /// In pixels of the picture; or `world`.
    pub(super) pixels: Option<f64>,
    /// In world units; or `pixels`.
    pub(super) world: Option<f64>,
}

/// How the discs of points lie.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
#[schemars(rename = "DiscShape")]
pub(super) enum RawDiscShape {
    Round,
    Elliptical,
}
