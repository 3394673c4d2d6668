//! `[background]` as it is written.

use schemars::JsonSchema;
use serde::Deserialize;

/// What lies behind everything: a colour or an environment.
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default, expecting = "a table")]
#[schemars(rename = "Background")]
pub(crate) struct RawBackground {
    /// Radiance per channel, linear Rec.709, each ≥ 0; default black.
    pub(crate) color: Option<[f64; 3]>,
    /// Path of a Radiance HDR or OpenEXR image of all directions by latitude and longitude, +Y up, its middle towards +Z; in the place
    /// of `color`. It is seen and lights nothing.
    pub(crate) environment: Option<String>,
    /// Degrees by which the environment is turned about +Y; default 0.
    pub(crate) rotate: Option<f64>,
    /// Factor on the environment's radiance, ≥ 0; default 1.
    pub(crate) scale: Option<f64>,
}
