//! Settings of the technique `surfels` as they are written.

use crate::render::raw::Auto;
use schemars::JsonSchema;
use serde::Deserialize;

/// Settings of the `surfels` technique.
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default, expecting = "a table")]
#[schemars(rename = "Surfels")]
pub(crate) struct RawSurfels {
    /// Radius within which a disc is blended, over its cut-off radius, 0.45 to 1; default 0.6.
    pub(crate) disc_scale: Option<f64>,
    /// ε: planes of discs that lie nearer to one another than this share of their radius are one layer, 1/1024 to 4; default 0.5.
    pub(crate) gap: Option<f64>,
    /// A pixel is finished when its transmittance is below this, from 0 to below 1; default 1/1024.
    pub(crate) transmittance_cutoff: Option<f64>,
    /// How rays are bent: "traced" from surface to surface, by the "power" of the index that layers are counted for, or at the
    /// "nearest" layer; default "traced".
    pub(crate) bending: RawBending,
    /// What is opaque is seen along "bent" rays, or "straight" on; default "bent".
    pub(crate) behind: RawBehind,
    /// When light falls on surfaces: on "pixels", once a layer, or on "discs", before they are averaged; default "pixels".
    pub(crate) shading: RawSurfelShading,
    /// How opaque discs are drawn: "two_pass" (default) or "one_pass", into an image of each group.
    pub(crate) opaque: RawOpaque,
    /// With "one_pass": whether of two discs of a group in one step of depth the one is kept whose centre is nearer; default true.
    pub(crate) voronoi: Option<bool>,
    /// How the discs of a pixel become layers: told apart by "gaps" in depth (default), so many nearest of these, "peeled", or as the
    /// paper has it, "algorithm1" or "algorithm2".
    pub(crate) layers: RawSurfelLayers,
    /// With "peeled": how many layers, 1 to 1024; default 8.
    pub(crate) peeled_layers: Option<u32>,
    /// With the algorithms and "one_pass": number of groups, with "mgc" the most of them, 1 to 256; default 4, by "one_pass" 256.
    pub(crate) groups: Option<u32>,
    /// With the algorithms and "one_pass": how groups are found, "auto" (default), "mgc", "wgc" or "hash".
    pub(crate) grouping: Option<RawGrouping>,
    /// With "mgc": factor on radii when overlaps are found, above 0 to 1; default 1.
    pub(crate) overlap_factor: Option<f64>,
    /// With "hash": what becomes of discs in one cell of the table: "resolve" (default), "keep", or "near", within `near_distance`.
    pub(crate) collisions: Option<RawCollisions>,
    /// With "near": how far from the eye they are resolved, world units.
    pub(crate) near_distance: Option<f64>,
    /// With the algorithms: how each group comes to cover the surface, "auto" (default), "partial", "duplicates", "enlarged" or "bound".
    pub(crate) coverage: Option<RawCoverage>,
    /// With the algorithms: steps between the least depth and the greatest, 1 to 16777216, or "auto" (default), as long as `gap`.
    pub(crate) depth_steps: Option<Auto>,
}

/// When light falls on surfaces.
#[derive(Debug, Default, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[schemars(rename = "SurfelShading")]
pub(crate) enum RawSurfelShading {
    #[default]
    Pixels,
    Discs,
}

/// How often opaque discs are walked over.
#[derive(Debug, Default, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[schemars(rename = "OpaqueSurfels")]
pub(crate) enum RawOpaque {
    #[default]
    TwoPass,
    OnePass,
}

/// How discs become layers.
#[derive(Debug, Default, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[schemars(rename = "SurfelLayers")]
pub(crate) enum RawSurfelLayers {
    #[default]
    Gaps,
    Peeled,
    Algorithm1,
    Algorithm2,
}

/// How groups of discs are found.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[schemars(rename = "Grouping")]
pub(crate) enum RawGrouping {
    Auto,
    Mgc,
    Wgc,
    Hash,
}

/// What is done with discs in one cell.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[schemars(rename = "Collisions")]
pub(crate) enum RawCollisions {
    Resolve,
    Keep,
    Near,
}

/// How groups come to cover the surface.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[schemars(rename = "Coverage")]
pub(crate) enum RawCoverage {
    Auto,
    Partial,
    Duplicates,
    Enlarged,
    Bound,
}

/// Where surfaces bend rays.
#[derive(Debug, Default, Clone, Copy, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[schemars(rename = "Bending")]
pub(crate) enum RawBending {
    #[default]
    Traced,
    Power,
    Nearest,
}

/// How opaque surfaces are seen behind what bends rays.
#[derive(Debug, Default, Clone, Copy, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[schemars(rename = "Behind")]
pub(crate) enum RawBehind {
    #[default]
    Bent,
    Straight,
}
