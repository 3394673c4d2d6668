//! Materials as they are written.

use schemars::JsonSchema;
use serde::Deserialize;

/// How light becomes radiance.
#[derive(Debug, Clone, Copy, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
#[schemars(rename = "Shading")]
pub(crate) enum RawShading {
    Phong,
    Phase,
    Unlit,
}

/// How opacity grows at grazing angles.
#[derive(Debug, Default, Clone, Copy, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[schemars(rename = "SurfaceOpacity")]
pub(crate) enum RawSurfaceOpacity {
    #[default]
    PerCrossing,
    ThinSlab,
}

/// A material.
#[derive(Debug, Default, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default, expecting = "a table")]
#[schemars(rename = "Material")]
pub(crate) struct RawMaterial {
    /// Name of a material that gives the keys that are not stated, such as "wax"; default none.
    pub(crate) preset: Option<String>,
    /// World units of a metre, by which `preset` gives lengths; default 1.
    pub(crate) metre: Option<f64>,
    /// Linear Rec.709; default white.
    pub(crate) color: Option<[f64; 3]>,
    /// Opacity of one crossing of a surface, from 0 to 1; default 1.
    pub(crate) opacity: Option<f64>,
    /// Share of ambient radiance that is reflected, from 0; default 1.
    pub(crate) ambient: Option<f64>,
    /// Diffuse reflectance, from 0 to 1; default 1.
    pub(crate) diffuse: Option<f64>,
    /// Specular reflectance, from 0 to 1; default 0.
    pub(crate) specular: Option<f64>,
    /// Phong exponent, from 0; default 32.
    pub(crate) shininess: Option<f64>,
    /// Share of diffuse light that passes a thin surface, from 0 to 1; default 0.
    pub(crate) transmission: Option<f64>,
    /// Default "phase" with `medium`, else "phong".
    pub(crate) shading: Option<RawShading>,
    /// Radiance per channel of a fully opaque column; default black.
    pub(crate) emission: [f64; 3],
    /// Extinction per channel relative to the extinction itself, each from 0; default [1, 1, 1].
    pub(crate) extinction_rgb: Option<[f64; 3]>,
    /// Share of light per channel that passes one crossing of a surface, each from 0.001 to 1: `color`, `opacity` and `extinction_rgb` in one key.
    pub(crate) tint: Option<[f64; 3]>,
    /// Extinction from the material's physics, instead of `extinction_rgb` and `medium.extinction`.
    pub(crate) absorption: Option<RawAbsorption>,
    /// Default "per_crossing".
    pub(crate) surface_opacity: RawSurfaceOpacity,
    /// What the matter of a medium does.
    pub(crate) medium: Option<RawMedium>,
    /// Index into `footprints` for objects that state none; default 0.
    pub(crate) footprint: Option<u32>,
    /// Refractive index of the matter that a surface bounds, from 0.1 to 10; default none, which bends no light.
    pub(crate) ior: Option<f64>,
    /// The index by wavelength, instead of `ior`.
    pub(crate) cauchy: Option<RawCauchy>,
    /// What the matter that a surface bounds absorbs, per channel, 1/world unit; default [0, 0, 0].
    pub(crate) absorption_inside: Option<[f64; 3]>,
    /// The same by the distance after which half of the light is left, per channel, world units; instead of `absorption_inside`.
    pub(crate) half_length: Option<[f64; 3]>,
    /// How surfaces are rough to light, by noise or an image that tilts their normals; default none.
    pub(crate) bump: Option<RawBump>,
}

/// Noise, or an image, as heights over a surface.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a table")]
#[schemars(rename = "Bump")]
pub(crate) struct RawBump {
    /// Height of the largest bumps, or of white over black in an image; the object's units, from 0.
    pub(crate) height: f64,
    /// Length of the largest bumps, or width of the image; the object's units, above 0.
    pub(crate) size: f64,
    /// A PNG, Radiance HDR or OpenEXR file, whose brightness is height, in the place of noise.
    pub(crate) image: Option<String>,
    /// Sizes of noise, each half as large and high as the one before, 1 to 12; default 4.
    pub(crate) octaves: Option<u32>,
    /// Seed of the noise, from 0; default 0.
    pub(crate) seed: Option<u32>,
}

/// The refractive index a + b/λ², λ in µm (Cauchy).
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a table")]
#[schemars(rename = "Cauchy")]
pub(crate) struct RawCauchy {
    /// From 0.1 to 10.
    pub(crate) a: f64,
    /// µm², from 0 to 1.
    pub(crate) b: f64,
}

/// Extinction 4πκ/λ per channel (Gunjee 2007, Eq. 7).
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a table")]
#[schemars(rename = "Absorption")]
pub(crate) struct RawAbsorption {
    /// Imaginary part of the refractive index per channel, each from 0.
    pub(crate) kappa: [f64; 3],
    /// Wavelength per channel, world units.
    pub(crate) wavelength: [f64; 3],
}

/// A participating medium.
#[derive(Debug, Default, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default, expecting = "a table")]
#[schemars(rename = "Medium")]
pub(crate) struct RawMedium {
    /// Extinction of objects that state none, 1/world unit.
    pub(crate) extinction: Option<f64>,
    /// The same by the distance after which half of the light is left, per channel, world units; instead of `extinction` and `extinction_rgb`.
    pub(crate) half_length: Option<[f64; 3]>,
    /// Single-scattering albedo, from 0 to 1; default 1, or 0 with `absorption`.
    pub(crate) albedo: Option<f64>,
    /// Mean cosine of scattering, between −1 and 1; default 0.
    pub(crate) asymmetry: Option<f64>,
}
