//! The scene file as it is written: degrees, names and nothing checked but types. Source of the JSON Schema.

use super::raw_object::{RawMaterial, RawObject};
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
    pub(super) camera: RawCamera,
    #[serde(default)]
    pub(super) background: RawColor,
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
    /// Where each Gaussian footprint is cut, in standard deviations, 1 to 8. Objects name them by index.
    pub(super) footprints: Option<Vec<f64>>,
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

/// The camera.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a table")]
#[schemars(rename = "Camera")]
pub(super) struct RawCamera {
    /// World position of the eye.
    pub(super) position: [f64; 3],
    /// A point in the middle of the picture.
    pub(super) target: [f64; 3],
    /// What points up in the picture; default [0, 1, 0].
    #[serde(default = "up")]
    pub(super) up: [f64; 3],
    /// Full vertical angle of view, degrees, between 0 and 180; default 35.
    pub(super) fov_y: Option<f64>,
    /// Height of the picture in world units, for parallel rays; instead of `fov_y`.
    pub(super) orthographic: Option<f64>,
    /// Width and height of the picture, pixels.
    pub(super) size: [u32; 2],
}

fn up() -> [f64; 3] {
    [0.0, 1.0, 0.0]
}

/// A colour, linear Rec.709.
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default, expecting = "a table")]
#[schemars(rename = "Color")]
pub(super) struct RawColor {
    /// Radiance per channel, each ≥ 0; default black.
    pub(super) color: [f64; 3],
    /// Environment maps are not in this version.
    #[schemars(skip)]
    pub(super) environment: Option<String>,
}

fn yes() -> bool {
    true
}

fn sixteen() -> u32 {
    16
}

/// A light.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "lowercase", expecting = "a table with a key `kind`")]
#[schemars(tag = "kind")]
#[schemars(rename = "Light")]
pub(super) enum RawLight {
    /// Radiates equally in all directions from a point.
    Point {
        /// World position.
        position: [f64; 3],
        /// Radiant intensity per channel, W/sr or relative.
        intensity: [f64; 3],
        /// Whether it casts shadows; default true.
        #[serde(default = "yes")]
        shadow: bool,
    },
    /// Parallel light.
    Directional {
        /// Direction of travel, away from the light; any length.
        direction: [f64; 3],
        /// Irradiance per channel on a plane that faces the light, W/m² or relative.
        irradiance: [f64; 3],
        /// Whether it casts shadows; default true.
        #[serde(default = "yes")]
        shadow: bool,
    },
    /// A cone of light.
    Spot {
        /// World position.
        position: [f64; 3],
        /// A point on the axis; or `direction`.
        target: Option<[f64; 3]>,
        /// Direction of the axis; or `target`.
        direction: Option<[f64; 3]>,
        /// Half angle of full light, degrees; default 0.
        #[serde(default)]
        inner: f64,
        /// Half angle of no light, degrees, below 90.
        outer: f64,
        /// Radiant intensity on the axis per channel, W/sr or relative.
        intensity: [f64; 3],
        /// Whether it casts shadows; default true.
        #[serde(default = "yes")]
        shadow: bool,
    },
    /// A sphere, as several points.
    Sphere {
        /// World position of the centre.
        position: [f64; 3],
        /// Radius, world units.
        radius: f64,
        /// Radiant intensity of the whole light per channel, W/sr or relative.
        intensity: [f64; 3],
        /// Points that it becomes; default 16.
        #[serde(default = "sixteen")]
        samples: u32,
        /// Whether it casts shadows; default true.
        #[serde(default = "yes")]
        shadow: bool,
    },
    /// A flat disc, as several points.
    Disk {
        /// World position of the centre.
        position: [f64; 3],
        /// Normal; any length.
        normal: [f64; 3],
        /// Radius, world units.
        radius: f64,
        /// Radiant intensity of the whole light per channel, W/sr or relative.
        intensity: [f64; 3],
        /// Points that it becomes; default 16.
        #[serde(default = "sixteen")]
        samples: u32,
        /// Whether it casts shadows; default true.
        #[serde(default = "yes")]
        shadow: bool,
    },
    /// A flat parallelogram, as several points.
    Rect {
        /// World position of the centre.
        position: [f64; 3],
        /// First half-axis, world units.
        u: [f64; 3],
        /// Second half-axis, world units.
        v: [f64; 3],
        /// Radiant intensity of the whole light per channel, W/sr or relative.
        intensity: [f64; 3],
        /// Points that it becomes; default 16.
        #[serde(default = "sixteen")]
        samples: u32,
        /// Whether it casts shadows; default true.
        #[serde(default = "yes")]
        shadow: bool,
    },
}

/// How to render.
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default, expecting = "a table")]
#[schemars(rename = "Render")]
pub(super) struct RawRender {
    /// "auto", "points", "particles" or "reference"; default "auto", which is "points".
    pub(super) technique: Option<String>,
    /// Samples along each side of a pixel, 1 to 8; default 2.
    pub(super) antialias: Option<u32>,
    /// Largest change of a displayed pixel by what is not simulated, above 0, at most 1; default 1/255.
    pub(super) tolerance: Option<f64>,
    /// Exposure of the displayed picture in stops; default 0.
    pub(super) exposure: Option<f64>,
    /// Ranges into which the depths are cut that several techniques share, 1 to 1024; default 16.
    pub(super) depth_ranges: Option<u32>,
    /// Images to keep besides beauty and alpha.
    pub(super) layers: Vec<String>,
    /// Seed of everything random; default 0.
    pub(super) seed: Option<u64>,
    /// Most splats that the scene may become.
    pub(super) max_points: Option<u64>,
    pub(super) points: RawPoints,
    pub(super) particles: RawParticles,
}

/// Settings of the `particles` technique.
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default, expecting = "a table")]
#[schemars(rename = "Particles")]
pub(super) struct RawParticles {
    /// Most sets of particles that are averaged, 2 to 1000000; default 100.
    pub(super) repeat_level: Option<u32>,
    /// Standard error of luminance, root mean square over the pixels, at which enough sets are averaged; default none.
    pub(super) target_error: Option<f64>,
    /// How implicit surfaces are sampled: "auto" (default), "lines", "triangles" or "brownian".
    pub(super) surface_sampler: RawSurfaceSampler,
    /// Step of "brownian" over the longest side of the surface's box, 0.0001 to 0.1; default 0.01.
    pub(super) brownian_step: Option<f64>,
}

/// How implicit surfaces are sampled.
#[derive(Debug, Default, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
#[schemars(rename = "SurfaceSampler")]
pub(super) enum RawSurfaceSampler {
    #[default]
    Auto,
    Lines,
    Triangles,
    Brownian,
}

/// Settings of the `points` technique.
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default, expecting = "a table")]
#[schemars(rename = "Points")]
pub(super) struct RawPoints {
    /// Thickness of a slice in world units, or "auto" (the default).
    pub(super) slice_thickness: Option<Auto>,
    /// Exact order inside slices too; default true.
    pub(super) exact: Option<bool>,
    /// "front_to_back" (default) or "back_to_front".
    pub(super) direction: RawDirection,
    /// Composite only so many non-empty slices.
    pub(super) first_slices: Option<u64>,
    /// A pixel is finished when its transmittance is below this, from 0 to below 1; default 1/1024.
    pub(super) transmittance_cutoff: Option<f64>,
    /// Widen footprints to a pixel; default true.
    pub(super) resampling_filter: Option<bool>,
    /// Precision of the running sums, "f32" (default) or "f16".
    pub(super) accumulation: RawAccumulation,
    pub(super) shadow: RawShadow,
}

/// Which end of the view is composited first.
#[derive(Debug, Default, Clone, Copy, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[schemars(rename = "Direction")]
pub(super) enum RawDirection {
    #[default]
    FrontToBack,
    BackToFront,
}

/// Precision of the running sums.
#[derive(Debug, Default, Clone, Copy, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
#[schemars(rename = "Accumulation")]
pub(super) enum RawAccumulation {
    #[default]
    F32,
    F16,
}

/// Settings of the translucent shadow maps.
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default, expecting = "a table")]
#[schemars(rename = "Shadow")]
pub(super) struct RawShadow {
    /// How directions become cells; default "auto".
    pub(super) mapping: RawMapping,
    /// Cells along a side of the table, 1 to 16384, or "auto" (the default).
    pub(super) cells: Option<Auto>,
    /// Absorbance behind which light counts as gone, above 0; default from the tolerance.
    pub(super) absorbance_cut: Option<f64>,
}

/// How directions from a light become cells of its table.
#[derive(Debug, Default, Clone, Copy, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[schemars(rename = "Mapping")]
pub(super) enum RawMapping {
    #[default]
    Auto,
    Octahedral,
    Polar,
}

/// A number, or "auto".
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Auto {
    Auto,
    Number(f64),
}

impl<'de> Deserialize<'de> for Auto {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct AutoVisitor;
        impl serde::de::Visitor<'_> for AutoVisitor {
            type Value = Auto;
            fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.write_str("a number or \"auto\"")
            }
            fn visit_i64<E: serde::de::Error>(self, v: i64) -> Result<Auto, E> {
                Ok(Auto::Number(v as f64))
            }
            fn visit_f64<E: serde::de::Error>(self, v: f64) -> Result<Auto, E> {
                Ok(Auto::Number(v))
            }
            fn visit_str<E: serde::de::Error>(self, v: &str) -> Result<Auto, E> {
                if v == "auto" { Ok(Auto::Auto) } else { Err(E::invalid_value(serde::de::Unexpected::Str(v), &self)) }
            }
        }
        deserializer.deserialize_any(AutoVisitor)
    }
}

impl JsonSchema for Auto {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "Auto".into()
    }

    fn json_schema(_: &mut schemars::SchemaGenerator) -> schemars::Schema {
        schemars::json_schema!({ "anyOf": [{ "type": "number" }, { "const": "auto" }] })
    }
}
