//! Sources of objects as they are written.

use schemars::JsonSchema;
use serde::Deserialize;

/// The zero set of an expression in x, y, z.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a table")]
#[schemars(rename = "Implicit")]
pub(crate) struct RawImplicit {
    /// The expression; negative inside.
    pub(crate) expression: String,
    /// Lowest and highest corner of the region that is searched.
    #[serde(rename = "box")]
    pub(crate) bounds: [[f64; 3]; 2],
    /// Samples along the longest side of the box; or `spacing`.
    pub(crate) resolution: Option<u32>,
    /// Distance between samples; or `resolution`.
    pub(crate) spacing: Option<f64>,
}

/// The surface in a volume on which its value is `level`.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a table")]
#[schemars(rename = "Isosurface")]
pub(crate) struct RawIsosurface {
    /// Path of a regular volume.
    pub(crate) volume: String,
    /// Which volume of a series, from 0; default 0.
    #[serde(default)]
    pub(crate) frame: u32,
    /// Physical value.
    pub(crate) level: f64,
    /// Values between lattice points; default "trilinear".
    #[serde(default)]
    pub(crate) interpolation: RawInterpolation,
    /// Where the inside is, to which normals do not point; default "above".
    #[serde(default)]
    pub(crate) inside: RawInside,
}

/// Values between lattice points.
#[derive(Debug, Default, Clone, Copy, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
#[schemars(rename = "Interpolation")]
pub(crate) enum RawInterpolation {
    #[default]
    Trilinear,
    CatmullRom,
}

/// Where the inside of an isosurface is.
#[derive(Debug, Default, Clone, Copy, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
#[schemars(rename = "Inside")]
pub(crate) enum RawInside {
    #[default]
    Above,
    Below,
}

/// The surface through scattered points, by multi-level partition of unity.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a table")]
#[schemars(rename = "LevelSet")]
pub(crate) struct RawLevelSet {
    /// Path of a raw point cloud, or of a mesh, whose vertices count.
    pub(crate) points: String,
    /// How far points may lie from the surface, over the diagonal of their box, above 0 and up to 1; default 0.001.
    pub(crate) tolerance: Option<f64>,
}

/// A solid among several: exactly one of the keys.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a table")]
#[schemars(rename = "Part")]
pub(crate) struct RawPart {
    /// What lies inside of the zero set of an expression, and within its box.
    pub(crate) implicit: Option<RawImplicit>,
    /// What lies inside of the surface in a volume on which its value is a given one, and within the volume.
    pub(crate) isosurface: Option<RawIsosurface>,
    /// What lies inside of the surface through scattered points.
    pub(crate) level_set: Option<RawLevelSet>,
    /// What lies in any of some parts.
    pub(crate) union: Option<Vec<RawPart>>,
    /// What lies in all of some parts.
    pub(crate) intersection: Option<Vec<RawPart>>,
    /// What lies in the first of some parts and in none of the others.
    pub(crate) difference: Option<Vec<RawPart>>,
}

/// A plane through a volume.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a table")]
#[schemars(rename = "Slice")]
pub(crate) struct RawSlice {
    /// Path of a regular volume.
    pub(crate) volume: String,
    /// Which volume of a series, from 0; default 0.
    #[serde(default)]
    pub(crate) frame: u32,
    /// A point of the plane, in the volume's own coordinates.
    pub(crate) center: [f64; 3],
    /// Across the plane, any length.
    pub(crate) normal: [f64; 3],
}

/// A volume whose values a surface shows.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a table")]
#[schemars(rename = "Field")]
pub(crate) struct RawField {
    /// Path of a regular volume, in the coordinates of the object before its transform.
    pub(crate) volume: String,
    /// Which volume of a series, from 0; default 0.
    #[serde(default)]
    pub(crate) frame: u32,
    /// Values between lattice points; default "trilinear".
    #[serde(default)]
    pub(crate) interpolation: RawInterpolation,
}

/// A half-space or a box; exactly one of them.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a table")]
#[schemars(rename = "Clip")]
pub(crate) struct RawClip {
    /// Leads out of the half-space, any length.
    pub(crate) normal: Option<[f64; 3]>,
    /// A point of the half-space's border.
    pub(crate) point: Option<[f64; 3]>,
    /// Lowest and highest corner.
    #[serde(rename = "box")]
    pub(crate) bounds: Option<[[f64; 3]; 2]>,
}

/// What a light sees first of other objects.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a table")]
#[schemars(rename = "Extract")]
pub(crate) struct RawExtract {
    /// Index of the light, from 0.
    #[serde(default)]
    pub(crate) light: u32,
    /// Absorbance up to the surface, above 0, at most 10; default 1.
    pub(crate) absorbance: Option<f64>,
    /// Names of the objects, visible or not; default all that are visible.
    pub(crate) objects: Option<Vec<String>>,
}

/// An expression in x, y, z as a density.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a table")]
#[schemars(rename = "Density")]
pub(crate) struct RawDensity {
    /// The expression; negative values count as 0.
    pub(crate) expression: String,
    /// Lowest and highest corner of the region that is sampled.
    #[serde(rename = "box")]
    pub(crate) bounds: [[f64; 3]; 2],
    /// Samples along the longest side of the box; or `spacing`.
    pub(crate) resolution: Option<u32>,
    /// Distance between samples; or `resolution`.
    pub(crate) spacing: Option<f64>,
    /// Extinction where the expression is 1, 1/world unit; default the material's.
    pub(crate) extinction: Option<f64>,
}

/// Ellipsoids disturbed by turbulence.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a table")]
#[schemars(rename = "Cloud")]
pub(crate) struct RawCloud {
    pub(crate) ellipsoids: Vec<RawEllipsoid>,
    /// Octaves of turbulence, 1 to 16; default 5.
    pub(crate) octaves: Option<u32>,
    /// Frequency of the first octave, 1/unit of length, above 0; default 1.
    pub(crate) frequency: Option<f64>,
    /// Strength of the disturbance in ellipsoid radii, from 0; default 0.5.
    pub(crate) amplitude: Option<f64>,
    /// Seed of the turbulence; default 0.
    #[serde(default)]
    pub(crate) seed: u32,
    /// Distance between samples.
    pub(crate) spacing: f64,
    /// Largest extinction, 1/world unit; default the material's.
    pub(crate) extinction: Option<f64>,
}

/// One ellipsoid along the axes.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a table")]
#[schemars(rename = "Ellipsoid")]
pub(crate) struct RawEllipsoid {
    pub(crate) center: [f64; 3],
    pub(crate) radii: [f64; 3],
}

/// A flat parallelogram.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a table")]
#[schemars(rename = "Rectangle")]
pub(crate) struct RawRectangle {
    pub(crate) center: [f64; 3],
    /// First half-axis.
    pub(crate) u: [f64; 3],
    /// Second half-axis.
    pub(crate) v: [f64; 3],
    /// Distance between splats.
    pub(crate) spacing: f64,
}

/// A homogeneous box along the axes.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a table")]
#[schemars(rename = "MediumBox")]
pub(crate) struct RawMediumBox {
    /// Lowest corner.
    pub(crate) min: [f64; 3],
    /// Highest corner.
    pub(crate) max: [f64; 3],
    /// Extinction, 1/world unit; default the material's.
    pub(crate) extinction: Option<f64>,
    /// Distance between splats.
    pub(crate) spacing: f64,
}

/// A homogeneous ball.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a table")]
#[schemars(rename = "MediumBall")]
pub(crate) struct RawMediumBall {
    pub(crate) center: [f64; 3],
    pub(crate) radius: f64,
    /// Extinction, 1/world unit; default the material's.
    pub(crate) extinction: Option<f64>,
    /// Distance between splats.
    pub(crate) spacing: f64,
}

/// A control point of a transfer function.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a table")]
#[schemars(rename = "TransferPoint")]
pub(crate) struct RawTransferPoint {
    /// Physical value.
    pub(crate) value: f64,
    /// Linear Rec.709.
    pub(crate) color: [f64; 3],
    /// Extinction, 1/world unit; or `opacity`. Not for a `slice`.
    pub(crate) extinction: Option<f64>,
    /// Opacity over `unit_length`, from 0 to below 1; or `extinction`.
    pub(crate) opacity: Option<f64>,
}
