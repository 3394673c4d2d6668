//! Objects and materials as they are written.

use schemars::JsonSchema;
use serde::Deserialize;

/// An object: a name, exactly one source (`mesh`, `volume`, `points`, `implicit`, `isosurface`, `level_set`, `slice`,
/// `density`, `cloud`, `rectangle`, `medium_box` or `medium_ball`), and how it looks.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a table")]
#[schemars(rename = "Object")]
pub(super) struct RawObject {
    /// Unique name.
    pub(super) name: String,
    /// Path of a triangle mesh.
    pub(super) mesh: Option<String>,
    /// Path of a regular volume; needs `transfer`.
    pub(super) volume: Option<String>,
    /// Path of a raw point cloud.
    pub(super) points: Option<String>,
    /// The zero set of an expression.
    pub(super) implicit: Option<RawImplicit>,
    /// The surface in a volume on which its value is a given one.
    pub(super) isosurface: Option<RawIsosurface>,
    /// The surface through scattered points.
    pub(super) level_set: Option<RawLevelSet>,
    /// A plane through a volume, coloured by `transfer`.
    pub(super) slice: Option<RawSlice>,
    /// An expression as the density of a medium.
    pub(super) density: Option<RawDensity>,
    /// A procedural cloud.
    pub(super) cloud: Option<RawCloud>,
    /// A flat parallelogram.
    pub(super) rectangle: Option<RawRectangle>,
    /// A homogeneous box.
    pub(super) medium_box: Option<RawMediumBox>,
    /// A homogeneous ball.
    pub(super) medium_ball: Option<RawMediumBall>,
    /// Regions that an `implicit`, `isosurface` or `level_set` is kept in; it ends open at their borders.
    #[serde(default)]
    pub(super) clip: Vec<RawClip>,
    /// Control points of the transfer function of a `volume` or `slice`, by rising value.
    pub(super) transfer: Option<Vec<RawTransferPoint>>,
    /// World length that opacities of `transfer` refer to.
    pub(super) unit_length: Option<f64>,
    #[serde(default)]
    pub(super) transform: RawTransform,
    /// Name of a material.
    pub(super) material: Option<String>,
    /// Opacity of one crossing, from 0 to 1, instead of the material's.
    pub(super) opacity: Option<f64>,
    /// Colour, linear Rec.709, instead of the data's and the material's.
    pub(super) color: Option<[f64; 3]>,
    /// What draws it where it is translucent, "points", "particles" or "reference"; default the technique of `render`.
    pub(super) technique: Option<String>,
    /// Distance between splats, world units; default from the data and the camera.
    pub(super) spacing: Option<f64>,
    /// Share of shadow that it receives, from 0 to 1; default 1.
    pub(super) shadow_coefficient: Option<f64>,
    /// Whether it casts shadows; default true.
    pub(super) casts_shadow: Option<bool>,
    /// Whether it is drawn; default true.
    pub(super) visible: Option<bool>,
    /// Index into `footprints`; default 0.
    #[serde(default)]
    pub(super) footprint: u32,
    /// Make splats at one place one; default false.
    #[serde(default)]
    pub(super) merge_duplicates: bool,
}

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

/// A plane through a volume.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a table")]
#[schemars(rename = "Slice")]
pub(super) struct RawSlice {
    /// Path of a regular volume.
    pub(super) volume: String,
    /// A point of the plane, in the volume's own coordinates.
    pub(super) center: [f64; 3],
    /// Across the plane, any length.
    pub(super) normal: [f64; 3],
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

/// Turns `up`, then scales, rotates and translates.
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default, expecting = "a table")]
#[schemars(rename = "Transform")]
pub(super) struct RawTransform {
    /// Uniform scale, above 0; default 1.
    pub(super) scale: Option<f64>,
    /// Angles around x, then y, then z, degrees.
    pub(super) rotate: [f64; 3],
    /// World units.
    pub(super) translate: [f64; 3],
    /// The axis of the data that points up; default "auto": what the file's format says, else "y".
    pub(super) up: RawUp,
}

/// The axis that points up.
#[derive(Debug, Default, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
#[schemars(rename = "Up")]
pub(super) enum RawUp {
    #[default]
    Auto,
    Y,
    Z,
}

/// How light becomes radiance.
#[derive(Debug, Clone, Copy, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
#[schemars(rename = "Shading")]
pub(super) enum RawShading {
    Phong,
    Phase,
    Unlit,
}

/// How opacity grows at grazing angles.
#[derive(Debug, Default, Clone, Copy, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[schemars(rename = "SurfaceOpacity")]
pub(super) enum RawSurfaceOpacity {
    #[default]
    PerCrossing,
    ThinSlab,
}

/// A material.
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default, expecting = "a table")]
#[schemars(rename = "Material")]
pub(super) struct RawMaterial {
    /// Linear Rec.709; default white.
    pub(super) color: Option<[f64; 3]>,
    /// Opacity of one crossing of a surface, from 0 to 1; default 1.
    pub(super) opacity: Option<f64>,
    /// Share of ambient radiance that is reflected, from 0; default 1.
    pub(super) ambient: Option<f64>,
    /// Diffuse reflectance, from 0 to 1; default 1.
    pub(super) diffuse: Option<f64>,
    /// Specular reflectance, from 0 to 1; default 0.
    pub(super) specular: Option<f64>,
    /// Phong exponent, from 0; default 32.
    pub(super) shininess: Option<f64>,
    /// Share of diffuse light that passes a thin surface, from 0 to 1; default 0.
    pub(super) transmission: Option<f64>,
    /// Default "phase" with `medium`, else "phong".
    pub(super) shading: Option<RawShading>,
    /// Radiance per channel of a fully opaque column; default black.
    pub(super) emission: [f64; 3],
    /// Extinction per channel relative to the extinction itself, each from 0; default [1, 1, 1].
    pub(super) extinction_rgb: Option<[f64; 3]>,
    /// Extinction from the material's physics, instead of `extinction_rgb` and `medium.extinction`.
    pub(super) absorption: Option<RawAbsorption>,
    /// Default "per_crossing".
    pub(super) surface_opacity: RawSurfaceOpacity,
    /// What the matter of a medium does.
    pub(super) medium: Option<RawMedium>,
    /// Refraction is not in this version.
    #[schemars(skip)]
    pub(super) ior: Option<f64>,
}

/// Extinction 4πκ/λ per channel (Gunjee 2007, Eq. 7).
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a table")]
#[schemars(rename = "Absorption")]
pub(super) struct RawAbsorption {
    /// Imaginary part of the refractive index per channel, each from 0.
    pub(super) kappa: [f64; 3],
    /// Wavelength per channel, world units.
    pub(super) wavelength: [f64; 3],
}

/// A participating medium.
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default, expecting = "a table")]
#[schemars(rename = "Medium")]
pub(super) struct RawMedium {
    /// Extinction of objects that state none, 1/world unit.
    pub(super) extinction: Option<f64>,
    /// Single-scattering albedo, from 0 to 1; default 1, or 0 with `absorption`.
    pub(super) albedo: Option<f64>,
    /// Mean cosine of scattering, between −1 and 1; default 0.
    pub(super) asymmetry: Option<f64>,
}
