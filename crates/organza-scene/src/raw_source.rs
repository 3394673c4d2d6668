//! Sources of objects as they are written.

use schemars::JsonSchema;
use serde::Deserialize;

/// The zero set of an expression in x, y, z.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a table")]
#[schemars(rename = "Implicit")]
pub(super) struct RawImplicit {
    /// The expression; negative inside.
    pub(super) expression: String,
    /// Lowest and highest corner of the region that is searched.
    #[serde(rename = "box")]
    pub(super) bounds: [[f64; 3]; 2],
    /// Samples along the longest side of the box; or `spacing`.
    pub(super) resolution: Option<u32>,
    /// Distance between samples; or `resolution`.
    pub(super) spacing: Option<f64>,
}

/// The surface in a volume on which its value is `level`.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a table")]
#[schemars(rename = "Isosurface")]
pub(super) struct RawIsosurface {
    /// Path of a regular volume.
    pub(super) volume: String,
    /// Which volume of a series, from 0; default 0.
    #[serde(default)]
    pub(super) frame: u32,
    /// Physical value.
    pub(super) level: f64,
    /// Values between lattice points; default "trilinear".
    #[serde(default)]
    pub(super) interpolation: RawInterpolation,
    /// Where the inside is, to which normals do not point; default "above".
    #[serde(default)]
    pub(super) inside: RawInside,
}

/// Values between lattice points.
#[derive(Debug, Default, Clone, Copy, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
#[schemars(rename = "Interpolation")]
pub(super) enum RawInterpolation {
    #[default]
    Trilinear,
    CatmullRom,
}

/// Where the inside of an isosurface is.
#[derive(Debug, Default, Clone, Copy, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
#[schemars(rename = "Inside")]
pub(super) enum RawInside {
    #[default]
    Above,
    Below,
}

/// The surface through scattered points, by multi-level partition of unity.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a table")]
#[schemars(rename = "LevelSet")]
pub(super) struct RawLevelSet {
    /// Path of a raw point cloud, or of a mesh, whose vertices count.
    pub(super) points: String,
    /// How far points may lie from the surface, over the diagonal of their box, above 0 and up to 1; default 0.001.
    pub(super) tolerance: Option<f64>,
}

/// A solid among several: exactly one of the keys.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a table")]
#[schemars(rename = "Part")]
pub(super) struct RawPart {
    /// What lies inside of the zero set of an expression, and within its box.
    pub(super) implicit: Option<RawImplicit>,
    /// What lies inside of the surface in a volume on which its value is a given one, and within the volume.
    pub(super) isosurface: Option<RawIsosurface>,
    /// What lies inside of the surface through scattered points.
    pub(super) level_set: Option<RawLevelSet>,
    /// What lies in any of some parts.
    pub(super) union: Option<Vec<RawPart>>,
    /// What lies in all of some parts.
    pub(super) intersection: Option<Vec<RawPart>>,
    /// What lies in the first of some parts and in none of the others.
    pub(super) difference: Option<Vec<RawPart>>,
}

/// A plane through a volume.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a table")]
#[schemars(rename = "Slice")]
pub(super) struct RawSlice {
    /// Path of a regular volume.
    pub(super) volume: String,
    /// Which volume of a series, from 0; default 0.
    #[serde(default)]
    pub(super) frame: u32,
    /// A point of the plane, in the volume's own coordinates.
    pub(super) center: [f64; 3],
    /// Across the plane, any length.
    pub(super) normal: [f64; 3],
}

/// A volume whose values a surface shows.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a table")]
#[schemars(rename = "Field")]
pub(super) struct RawField {
    /// Path of a regular volume, in the coordinates of the object before its transform.
    pub(super) volume: String,
    /// Which volume of a series, from 0; default 0.
    #[serde(default)]
    pub(super) frame: u32,
    /// Values between lattice points; default "trilinear".
    #[serde(default)]
    pub(super) interpolation: RawInterpolation,
}

/// A half-space or a box; exactly one of them.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a table")]
#[schemars(rename = "Clip")]
pub(super) struct RawClip {
    /// Leads out of the half-space, any length.
    pub(super) normal: Option<[f64; 3]>,
    /// A point of the half-space's border.
    pub(super) point: Option<[f64; 3]>,
    /// Lowest and highest corner.
    #[serde(rename = "box")]
    pub(super) bounds: Option<[[f64; 3]; 2]>,
}

/// What a light sees first of other objects.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a table")]
#[schemars(rename = "Extract")]
pub(super) struct RawExtract {
    /// Index of the light, from 0.
    #[serde(default)]
    pub(super) light: u32,
    /// Absorbance up to the surface, above 0, at most 10; default 1.
    pub(super) absorbance: Option<f64>,
    /// Names of the objects, visible or not; default all that are visible.
    pub(super) objects: Option<Vec<String>>,
}

/// An expression in x, y, z as a density.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a table")]
#[schemars(rename = "Density")]
pub(super) struct RawDensity {
    /// The expression; negative values count as 0.
    pub(super) expression: String,
    /// Lowest and highest corner of the region that is sampled.
    #[serde(rename = "box")]
    pub(super) bounds: [[f64; 3]; 2],
    /// Samples along the longest side of the box; or `spacing`.
    pub(super) resolution: Option<u32>,
    /// Distance between samples; or `resolution`.
    pub(super) spacing: Option<f64>,
    /// Extinction where the expression is 1, 1/world unit; default the material's.
    pub(super) extinction: Option<f64>,
}

/// Ellipsoids disturbed by turbulence.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a table")]
#[schemars(rename = "Cloud")]
pub(super) struct RawCloud {
    pub(super) ellipsoids: Vec<RawEllipsoid>,
    /// Octaves of turbulence, 1 to 16; default 5.
    pub(super) octaves: Option<u32>,
    /// Frequency of the first octave, 1/unit of length, above 0; default 1.
    pub(super) frequency: Option<f64>,
    /// Strength of the disturbance in ellipsoid radii, from 0; default 0.5.
    pub(super) amplitude: Option<f64>,
    /// Seed of the turbulence; default 0.
    #[serde(default)]
    pub(super) seed: u32,
    /// Distance between samples.
    pub(super) spacing: f64,
    /// Largest extinction, 1/world unit; default the material's.
    pub(super) extinction: Option<f64>,
}

/// One ellipsoid along the axes.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a table")]
#[schemars(rename = "Ellipsoid")]
pub(super) struct RawEllipsoid {
    pub(super) center: [f64; 3],
    pub(super) radii: [f64; 3],
}

/// A flat parallelogram.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a table")]
#[schemars(rename = "Rectangle")]
pub(super) struct RawRectangle {
    pub(super) center: [f64; 3],
    /// First half-axis.
    pub(super) u: [f64; 3],
    /// Second half-axis.
    pub(super) v: [f64; 3],
    /// Distance between splats.
    pub(super) spacing: f64,
}

/// A homogeneous box along the axes.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a table")]
#[schemars(rename = "MediumBox")]
pub(super) struct RawMediumBox {
    /// Lowest corner.
    pub(super) min: [f64; 3],
    /// Highest corner.
    pub(super) max: [f64; 3],
    /// Extinction, 1/world unit; default the material's.
    pub(super) extinction: Option<f64>,
    /// Distance between splats.
    pub(super) spacing: f64,
}

/// A homogeneous ball.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a table")]
#[schemars(rename = "MediumBall")]
pub(super) struct RawMediumBall {
    pub(super) center: [f64; 3],
    pub(super) radius: f64,
    /// Extinction, 1/world unit; default the material's.
    pub(super) extinction: Option<f64>,
    /// Distance between splats.
    pub(super) spacing: f64,
}

/// A control point of a transfer function.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a table")]
#[schemars(rename = "TransferPoint")]
pub(super) struct RawTransferPoint {
    /// Physical value.
    pub(super) value: f64,
    /// Linear Rec.709.
    pub(super) color: [f64; 3],
    /// Extinction, 1/world unit; or `opacity`. Not for a `slice`.
    pub(super) extinction: Option<f64>,
    /// Opacity over `unit_length`, from 0 to below 1; or `extinction`.
    pub(super) opacity: Option<f64>,
}
