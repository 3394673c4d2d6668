//! Settings of the technique `surfels` as they are written.

use super::raw_render::Auto;
use schemars::JsonSchema;
use serde::Deserialize;

/// Settings of the `surfels` technique.
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default, expecting = "a table")]
#[schemars(rename = "Surfels")]
pub(super) struct RawSurfels {
    /// Radius within which a disc is blended, over its cut-off radius, 0.45 to 1; default 0.6.
    pub(super) disc_scale: Option<f64>,
    /// ε: planes of discs that lie nearer to one another than this share of their radius are one layer, 1/1024 to 4; default 0.5.
    pub(super) gap: Option<f64>,
    /// A pixel is finished when its transmittance is below this, from 0 to below 1; default 1/1024.
    pub(super) transmittance_cutoff: Option<f64>,
    /// How rays are bent: "traced" from surface to surface, by the "power" of the index that layers are counted for, or at the
    /// "nearest" layer; default "traced".
    pub(super) bending: RawBending,
    /// What is opaque is seen along "bent" rays, or "straight" on; default "bent".
    pub(super) behind: RawBehind,
    /// When light falls on surfaces: on "pixels", once a layer, or on "discs", before they are averaged; default "pixels".
    pub(super) shading: RawSurfelShading,
    /// How opaque discs are drawn: "two_pass" (default) or "one_pass", into an image of each group.
    pub(super) opaque: RawOpaque,
    /// With "one_pass": whether of two discs of a group in one step of depth the one is kept whose centre is nearer; default true.
    pub(super) voronoi: Option<bool>,
    /// How the discs of a pixel become layers: told apart by "gaps" in depth (default), so many nearest of these, "peeled", or as the
    /// paper has it, "algorithm1" or "algorithm2".
    pub(super) layers: RawSurfelLayers,
    /// With "peeled": how many layers, 1 to 1024; default 8.
    pub(super) peeled_layers: Option<u32>,
    /// With the algorithms and "one_pass": number of groups, with "mgc" the most of them, 1 to 256; default 4, by "one_pass" 256.
    pub(super) groups: Option<u32>,
    /// With the algorithms and "one_pass": how groups are found, "auto" (default), "mgc", "wgc" or "hash".
    pub(super) grouping: Option<RawGrouping>,
    /// With "mgc": factor on radii when overlaps are found, above 0 to 1; default 1.
    pub(super) overlap_factor: Option<f64>,
    /// With "hash": what becomes of discs in one cell of the table: "resolve" (default), "keep", or "near", within `near_distance`.
    pub(super) collisions: Option<RawCollisions>,
    /// With "near": how far from the eye they are resolved, world units.
    pub(super) near_distance: Option<f64>,
    /// With the algorithms: how each group comes to cover the surface, "auto" (default), "partial", "duplicates", "enlarged" or "bound".
    pub(super) coverage: Option<RawCoverage>,
    /// With the algorithms: steps between the least depth and the greatest, 1 to 16777216, or "auto" (default), as long as `gap`.
    pub(super) depth_steps: Option<Auto>,
}

/// When light falls on surfaces.
#[derive(Debug, Default, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[schemars(rename = "SurfelShading")]
pub(super) enum RawSurfelShading {
    #[default]
    Pixels,
    Discs,
}

/// How often opaque discs are walked over.
#[derive(Debug, Default, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[schemars(rename = "OpaqueSurfels")]
pub(super) enum RawOpaque {
    #[default]
    TwoPass,
    OnePass,
}

/// How discs become layers.
#[derive(Debug, Default, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[schemars(rename = "SurfelLayers")]
pub(super) enum RawSurfelLayers {
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
pub(super) enum RawGrouping {
    Auto,
    Mgc,
    Wgc,
    Hash,
}

/// What is done with discs in one cell.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[schemars(rename = "Collisions")]
pub(super) enum RawCollisions {
    Resolve,
    Keep,
    Near,
}

/// How groups come to cover the surface.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[schemars(rename = "Coverage")]
pub(super) enum RawCoverage {
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
pub(super) enum RawBending {
    #[default]
    Traced,
    Power,
    Nearest,
}

/// How opaque surfaces are seen behind what bends rays.
#[derive(Debug, Default, Clone, Copy, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[schemars(rename = "Behind")]
pub(super) enum RawBehind {
    #[default]
    Bent,
    Straight,
}
