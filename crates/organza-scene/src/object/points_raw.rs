//! How raw points look, as it is written.

use schemars::JsonSchema;
use serde::Deserialize;

/// What points become.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
#[schemars(rename = "PointForm")]
pub(crate) enum RawPointForm {
    Surface,
    Medium,
}

/// The column of its file that points take their colours from.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a table")]
#[schemars(rename = "ColorBy")]
pub(crate) struct RawColorBy {
    /// Name of the column, one of those that `organza info` lists.
    pub(crate) column: String,
    /// A colour map, "classes" or "distinct"; default "classes" for classes, else "viridis". Not together with `transfer`.
    pub(crate) map: Option<String>,
    /// Numbers at the two ends of the map; default the 1st and the 99th percentile.
    pub(crate) range: Option<[f64; 2]>,
    /// How numbers lie along the map; default "linear".
    pub(crate) scale: Option<RawMapScale>,
}

/// How numbers lie along a colour map.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
#[schemars(rename = "MapScale")]
pub(crate) enum RawMapScale {
    Linear,
    Log,
}

/// The diameter of every disc of points.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a table")]
#[schemars(rename = "PointSize")]
pub(crate) struct RawPointSize {
    /// In pixels of the picture; or `world`.
    pub(crate) pixels: Option<f64>,
    /// In world units; or `pixels`.
    pub(crate) world: Option<f64>,
}

/// How the discs of points lie.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
#[schemars(rename = "DiscShape")]
pub(crate) enum RawDiscShape {
    Auto,
    Round,
    Elliptical,
    Balls,
}
