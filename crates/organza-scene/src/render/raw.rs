//! Settings of a render as they are written.

use crate::render::surfels_raw::RawSurfels;
use schemars::JsonSchema;
use serde::Deserialize;
use std::collections::BTreeMap;

/// How to render.
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default, expecting = "a table")]
#[schemars(rename = "Render")]
pub(crate) struct RawRender {
    /// "auto", "points", "particles", "sheets", "surfels" or "reference"; default "auto", which is "points".
    pub(crate) technique: Option<String>,
    /// Samples along each side of a pixel, 1 to 8, or "auto" (the default): the plan takes 2.
    pub(crate) antialias: Option<Whole>,
    /// Largest change of a displayed pixel by what is not simulated, above 0, at most 1; default 1/255.
    pub(crate) tolerance: Option<f64>,
    /// Exposure of the displayed picture in stops; default 0.
    pub(crate) exposure: Option<f64>,
    /// Ranges into which the depths are cut that several techniques share, 1 to 1024; default 16.
    pub(crate) depth_ranges: Option<u32>,
    /// Images to keep besides beauty and alpha.
    pub(crate) layers: Vec<String>,
    /// Effects that are simulated whatever they change, "on", or never, "off", by name, such as "shadow.sun"; "auto" leaves it to the plan.
    pub(crate) effects: BTreeMap<String, RawSwitch>,
    /// Seed of everything random; default 0.
    pub(crate) seed: Option<u64>,
    /// Share of the splats that are drawn, above 0, at most 1, each for as many as it stands for; default 1.
    pub(crate) splat_share: Option<f64>,
    /// Most splats that the scene may become.
    pub(crate) max_points: Option<u64>,
    /// Milliseconds from files read to picture finished, 1 to 86400000, or "none" (the default): settings give way until they fit.
    pub(crate) budget_ms: Option<RawGoal>,
    /// Largest RMSE of the displayed picture against the scene's own settings, above 0, at most 1, or "none" (the default): settings give way as far.
    pub(crate) max_rmse: Option<RawGoal>,
    /// The same of the mean FLIP.
    pub(crate) max_flip: Option<RawGoal>,
    pub(crate) shadow: RawShadow,
    pub(crate) points: RawPoints,
    pub(crate) particles: RawParticles,
    pub(crate) sheets: RawSheets,
    pub(crate) surfels: RawSurfels,
}

/// Whether an effect is simulated.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
#[schemars(rename = "Switch")]
pub(crate) enum RawSwitch {
    On,
    Off,
    Auto,
}

/// Settings of the `particles` technique.
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default, expecting = "a table")]
#[schemars(rename = "Particles")]
pub(crate) struct RawParticles {
    /// Most sets of particles that are averaged, 2 to 1000000; default 100.
    pub(crate) repeat_level: Option<u32>,
    /// Standard error of luminance, root mean square over the pixels, at which enough sets are averaged; default none.
    pub(crate) target_error: Option<f64>,
    /// How implicit surfaces are sampled: "auto" (default), "lines", "triangles" or "brownian".
    pub(crate) surface_sampler: RawSurfaceSampler,
    /// Step of "brownian" over the longest side of the surface's box, 0.0001 to 0.1; default 0.01.
    pub(crate) brownian_step: Option<f64>,
    /// How media are sampled: "auto" (default), "cells" or "metropolis".
    pub(crate) volume_sampler: RawVolumeSampler,
    /// Steps of a chain of "metropolis" from one particle to the next, 1 to 4096; default 16.
    pub(crate) metropolis_stride: Option<u32>,
}

/// Settings of the `sheets` technique.
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default, expecting = "a table")]
#[schemars(rename = "Sheets")]
pub(crate) struct RawSheets {
    /// What slabs lie across, "view", "half_vector", the bisector of light and view, or "auto" (default).
    pub(crate) slicing: RawSlicing,
    /// With "view": when values become colours: "after" they are reconstructed, the value in the middle of a slab alone; "preintegrated", all values that a ray
    /// meets in a slab; "before" they are splatted; or "auto" (default).
    pub(crate) classify: Option<RawClassify>,
    /// With "view": what slabs lie along, "view" (default), or "axis", the lattice of the only volume, seen by parallel rays.
    pub(crate) aligned: Option<RawAligned>,
    /// With "half_vector": pixels of a light's buffer per step of the finest volume, 0.1 to 16; default 1.5.
    pub(crate) light_pixels: Option<f64>,
    /// With "half_vector": most pixels of a light's buffer along a side, 16 to 8192; default 2048.
    pub(crate) most_light_pixels: Option<u32>,
    /// With "half_vector": how a light with an extent is carried, "points" (default), a sweep for each of its points, or "one_sweep".
    pub(crate) soft_shadows: RawSoftShadows,
    /// With "half_vector": how often media scatter light, "once", "forward", "forward_and_back", or "auto" (default).
    pub(crate) scattering: RawScattering,
    /// With scattering: half angle of the cone that light spreads into ahead, degrees from 0 to below 90, or "auto" (the default).
    pub(crate) scattering_cone: Option<Auto>,
    /// With scattering: voxels for each cell of scattered light, 1 to 1048576; default 32.
    pub(crate) voxels_per_cell: Option<u32>,
    /// Width of a slab in world units, or "auto" (the default): the least step of the volumes across the slabs.
    pub(crate) slab_width: Option<Auto>,
    /// How slabs get their values: "gather", each pixel reads the lattice, "splat", each voxel writes into slabs, or "auto" (default).
    pub(crate) reconstruction: RawReconstruction,
    /// The kernel of gathered slabs: "gaussian" (default), that of splatted ones, or "linear", between eight voxels.
    pub(crate) kernel: Option<RawKernel>,
    /// Radius of a voxel's kernel in steps of its lattice, 0.5 to 8; default 2.
    pub(crate) kernel_extent: Option<f64>,
    /// Standard deviation of the kernel in steps of the lattice, an eighth of the extent to the whole; default 0.35 of it.
    pub(crate) kernel_sigma: Option<f64>,
    /// Sections of a kernel in a slab's width, the places within a slab where it may begin: a power of two up to 256, the default.
    pub(crate) kernel_sections: Option<u32>,
    /// Precision of the sums of voxels in a slab and of slabs in a pixel, "f32", "f16" or "auto" (the default): the plan takes "f32".
    pub(crate) accumulation: RawAccumulation,
    /// Where normals come from: "sheets", differences of neighbouring pixels and slabs, "volume", differences at voxels, "kernel", the field that gathered slabs
    /// read, or "auto" (default), "kernel" where slabs are gathered, else "sheets".
    pub(crate) gradients: RawGradients,
    /// A pixel is finished when its transmittance is below this, from 0 to below 1; default 1/1024.
    pub(crate) transmittance_cutoff: Option<f64>,
}

/// How slabs get their values.
#[derive(Debug, Default, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[schemars(rename = "Reconstruction")]
pub(crate) enum RawReconstruction {
    #[default]
    Auto,
    Gather,
    Splat,
}

/// The kernel of gathered slabs.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[schemars(rename = "Kernel")]
pub(crate) enum RawKernel {
    Gaussian,
    Linear,
}

/// Where normals come from.
#[derive(Debug, Default, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[schemars(rename = "Gradients")]
pub(crate) enum RawGradients {
    #[default]
    Auto,
    Sheets,
    Volume,
    Kernel,
}

/// What slabs lie across.
#[derive(Debug, Default, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[schemars(rename = "Slicing")]
pub(crate) enum RawSlicing {
    #[default]
    Auto,
    View,
    HalfVector,
}

/// When values become colours.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[schemars(rename = "Classify")]
pub(crate) enum RawClassify {
    Auto,
    After,
    Preintegrated,
    Before,
}

/// What slabs lie along.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[schemars(rename = "Aligned")]
pub(crate) enum RawAligned {
    View,
    Axis,
}

/// How a light with an extent is carried.
#[derive(Debug, Default, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[schemars(rename = "SoftShadows")]
pub(crate) enum RawSoftShadows {
    #[default]
    Points,
    OneSweep,
}

/// How often media scatter light.
#[derive(Debug, Default, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[schemars(rename = "Scattering")]
pub(crate) enum RawScattering {
    #[default]
    Auto,
    Once,
    Forward,
    ForwardAndBack,
}

impl RawScattering {
    /// Whether light is scattered once as long as the plan asks for no more.
    pub(crate) fn is_at_most_once(self) -> bool {
        matches!(self, Self::Auto | Self::Once)
    }
}

/// How implicit surfaces are sampled.
#[derive(Debug, Default, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
#[schemars(rename = "SurfaceSampler")]
pub(crate) enum RawSurfaceSampler {
    #[default]
    Auto,
    Lines,
    Triangles,
    Brownian,
}

/// How media are sampled.
#[derive(Debug, Default, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
#[schemars(rename = "VolumeSampler")]
pub(crate) enum RawVolumeSampler {
    #[default]
    Auto,
    Cells,
    Metropolis,
}

/// Settings of the `points` technique.
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default, expecting = "a table")]
#[schemars(rename = "Points")]
pub(crate) struct RawPoints {
    /// Thickness of a slice in world units, or "auto" (the default).
    pub(crate) slice_thickness: Option<Auto>,
    /// Exact order inside slices too, true, false or "auto" (the default): the plan takes true.
    pub(crate) exact: Option<Choice>,
    /// "front_to_back" (default) or "back_to_front".
    pub(crate) direction: RawDirection,
    /// Composite only so many non-empty slices.
    pub(crate) first_slices: Option<u64>,
    /// A pixel is finished when its transmittance is below this, from 0 to below 1; default 1/1024.
    pub(crate) transmittance_cutoff: Option<f64>,
    /// Widen footprints to a pixel; default true.
    pub(crate) resampling_filter: Option<bool>,
    /// Precision of the running sums, "f32", "f16" or "auto" (the default): the plan takes "f32".
    pub(crate) accumulation: RawAccumulation,
}

/// Which end of the view is composited first.
#[derive(Debug, Default, Clone, Copy, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[schemars(rename = "Direction")]
pub(crate) enum RawDirection {
    #[default]
    FrontToBack,
    BackToFront,
}

/// Precision of the running sums.
#[derive(Debug, Default, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
#[schemars(rename = "Accumulation")]
pub(crate) enum RawAccumulation {
    #[default]
    Auto,
    F32,
    F16,
}

/// Settings of the translucent shadow maps.
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default, expecting = "a table")]
#[schemars(rename = "Shadow")]
pub(crate) struct RawShadow {
    /// How directions become cells; default "auto".
    pub(crate) mapping: RawMapping,
    /// Cells along a side of the table, 1 to 16384, or "auto" (the default).
    pub(crate) cells: Option<Auto>,
    /// Absorbance behind which light counts as gone, above 0; default from the tolerance.
    pub(crate) absorbance_cut: Option<f64>,
}

/// How directions from a light become cells of its table.
#[derive(Debug, Default, Clone, Copy, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[schemars(rename = "Mapping")]
pub(crate) enum RawMapping {
    #[default]
    Auto,
    Octahedral,
    Polar,
}

/// A number, or "none".
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum RawGoal {
    None,
    Number(f64),
}

impl<'de> Deserialize<'de> for RawGoal {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct GoalVisitor;
        impl serde::de::Visitor<'_> for GoalVisitor {
            type Value = RawGoal;
            fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.write_str("a number or \"none\"")
            }
            fn visit_i64<E: serde::de::Error>(self, v: i64) -> Result<RawGoal, E> {
                Ok(RawGoal::Number(v as f64))
            }
            fn visit_f64<E: serde::de::Error>(self, v: f64) -> Result<RawGoal, E> {
                Ok(RawGoal::Number(v))
            }
            fn visit_str<E: serde::de::Error>(self, v: &str) -> Result<RawGoal, E> {
                if v == "none" {
                    Ok(RawGoal::None)
                } else {
                    Err(E::invalid_value(serde::de::Unexpected::Str(v), &self))
                }
            }
        }
        deserializer.deserialize_any(GoalVisitor)
    }
}

impl JsonSchema for RawGoal {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "Goal".into()
    }

    fn json_schema(_: &mut schemars::SchemaGenerator) -> schemars::Schema {
        schemars::json_schema!({ "anyOf": [{ "type": "number" }, { "const": "none" }] })
    }
}

/// A number, or "auto".
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Auto {
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

/// A whole number, or "auto".
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Whole {
    Auto,
    Number(u32),
}

impl Whole {
    /// The number that a scene states; `None` where it leaves the value to the plan.
    pub(crate) fn stated(value: Option<Self>) -> Option<u32> {
        match value {
            None | Some(Self::Auto) => None,
            Some(Self::Number(number)) => Some(number),
        }
    }
}

impl<'de> Deserialize<'de> for Whole {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct WholeVisitor;
        impl serde::de::Visitor<'_> for WholeVisitor {
            type Value = Whole;
            fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.write_str("a whole number or \"auto\"")
            }
            fn visit_i64<E: serde::de::Error>(self, v: i64) -> Result<Whole, E> {
                let number = u32::try_from(v);
                number.map(Whole::Number).map_err(|_| E::invalid_value(serde::de::Unexpected::Signed(v), &self))
            }
            fn visit_str<E: serde::de::Error>(self, v: &str) -> Result<Whole, E> {
                if v == "auto" { Ok(Whole::Auto) } else { Err(E::invalid_value(serde::de::Unexpected::Str(v), &self)) }
            }
        }
        deserializer.deserialize_any(WholeVisitor)
    }
}

impl JsonSchema for Whole {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "Whole".into()
    }

    fn json_schema(_: &mut schemars::SchemaGenerator) -> schemars::Schema {
        schemars::json_schema!({ "anyOf": [{ "type": "integer", "minimum": 0 }, { "const": "auto" }] })
    }
}

/// True, false, or "auto".
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Choice {
    Auto,
    Is(bool),
}

impl Choice {
    /// The value that a scene states; `None` where it leaves the value to the plan.
    pub(crate) fn stated(value: Option<Self>) -> Option<bool> {
        match value {
            None | Some(Self::Auto) => None,
            Some(Self::Is(is)) => Some(is),
        }
    }
}

impl<'de> Deserialize<'de> for Choice {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct ChoiceVisitor;
        impl serde::de::Visitor<'_> for ChoiceVisitor {
            type Value = Choice;
            fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.write_str("true, false or \"auto\"")
            }
            fn visit_bool<E: serde::de::Error>(self, v: bool) -> Result<Choice, E> {
                Ok(Choice::Is(v))
            }
            fn visit_str<E: serde::de::Error>(self, v: &str) -> Result<Choice, E> {
                if v == "auto" { Ok(Choice::Auto) } else { Err(E::invalid_value(serde::de::Unexpected::Str(v), &self)) }
            }
        }
        deserializer.deserialize_any(ChoiceVisitor)
    }
}

impl JsonSchema for Choice {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "Choice".into()
    }

    fn json_schema(_: &mut schemars::SchemaGenerator) -> schemars::Schema {
        schemars::json_schema!({ "anyOf": [{ "type": "boolean" }, { "const": "auto" }] })
    }
}
