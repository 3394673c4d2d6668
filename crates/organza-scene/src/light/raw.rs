//! Lights as they are written.

use crate::render::raw::Whole;
use schemars::JsonSchema;
use serde::Deserialize;

fn yes() -> bool {
    true
}

/// A light.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "lowercase", expecting = "a table with a key `kind`")]
#[schemars(tag = "kind")]
#[schemars(rename = "Light")]
pub(crate) enum RawLight {
    /// Radiates equally in all directions from a point.
    Point {
        /// Name by which effects of this light are called, such as "sun" in "shadow.sun"; default its index, from 0.
        name: Option<String>,
        /// World position.
        position: [f64; 3],
        /// Radiant intensity per channel, W/sr or relative.
        intensity: [f64; 3],
        /// Whether it casts shadows; default true.
        #[serde(default = "yes")]
        shadow: bool,
        /// Cells along a side of its shadow map, 1 to 16384; default those of `render.shadow`.
        shadow_cells: Option<u32>,
    },
    /// Parallel light.
    Directional {
        /// Name by which effects of this light are called, such as "sun" in "shadow.sun"; default its index, from 0.
        name: Option<String>,
        /// Direction of travel, away from the light; any length.
        direction: [f64; 3],
        /// Irradiance per channel on a plane that faces the light, W/m² or relative.
        irradiance: [f64; 3],
        /// Path of a picture that the light shines through: PNG, Radiance HDR or OpenEXR.
        texture: Option<String>,
        /// World direction that is upwards in the picture; default +Y, +Z for light along the Y axis.
        texture_up: Option<[f64; 3]>,
        /// Width of the picture, world units.
        texture_width: Option<f64>,
        /// World point that the middle of the picture falls on; default the origin.
        texture_center: Option<[f64; 3]>,
        /// Whether it casts shadows; default true.
        #[serde(default = "yes")]
        shadow: bool,
        /// Cells along a side of its shadow map, 1 to 16384; default those of `render.shadow`.
        shadow_cells: Option<u32>,
    },
    /// A cone of light.
    Spot {
        /// Name by which effects of this light are called, such as "sun" in "shadow.sun"; default its index, from 0.
        name: Option<String>,
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
        /// Path of a picture that the light shines through: PNG, Radiance HDR or OpenEXR.
        texture: Option<String>,
        /// World direction that is upwards in the picture; default +Y, +Z for light along the Y axis.
        texture_up: Option<[f64; 3]>,
        /// Angle across the width of the picture, degrees, below 180; default such that the shorter side is as wide as the cone.
        texture_angle: Option<f64>,
        /// Whether it casts shadows; default true.
        #[serde(default = "yes")]
        shadow: bool,
        /// Cells along a side of its shadow map, 1 to 16384; default those of `render.shadow`.
        shadow_cells: Option<u32>,
    },
    /// A sphere that shines outwards.
    Sphere {
        /// Name by which effects of this light are called, such as "sun" in "shadow.sun"; default its index, from 0.
        name: Option<String>,
        /// World position of the centre.
        position: [f64; 3],
        /// Radius, world units.
        radius: f64,
        /// Radiant intensity of the whole light per channel, seen from far away, W/sr or relative.
        intensity: [f64; 3],
        /// Number of points that replace the light in techniques that light by points, or "auto" (the default): the plan takes 16.
        samples: Option<Whole>,
        /// Whether it casts shadows; default true.
        #[serde(default = "yes")]
        shadow: bool,
        /// Cells along a side of its shadow map, 1 to 16384; default those of `render.shadow`.
        shadow_cells: Option<u32>,
    },
    /// A flat disc that shines to the side of its normal.
    Disk {
        /// Name by which effects of this light are called, such as "sun" in "shadow.sun"; default its index, from 0.
        name: Option<String>,
        /// World position of the centre.
        position: [f64; 3],
        /// Normal; any length.
        normal: [f64; 3],
        /// Radius, world units.
        radius: f64,
        /// Radiant intensity of the whole light per channel, along its normal, seen from far away, W/sr or relative.
        intensity: [f64; 3],
        /// Number of points that replace the light in techniques that light by points, or "auto" (the default): the plan takes 16.
        samples: Option<Whole>,
        /// Whether it casts shadows; default true.
        #[serde(default = "yes")]
        shadow: bool,
        /// Cells along a side of its shadow map, 1 to 16384; default those of `render.shadow`.
        shadow_cells: Option<u32>,
    },
    /// A flat parallelogram that shines to the side of u × v.
    Rect {
        /// Name by which effects of this light are called, such as "sun" in "shadow.sun"; default its index, from 0.
        name: Option<String>,
        /// World position of the centre.
        position: [f64; 3],
        /// First half-axis, world units.
        u: [f64; 3],
        /// Second half-axis, world units.
        v: [f64; 3],
        /// Radiant intensity of the whole light per channel, along its normal, seen from far away, W/sr or relative.
        intensity: [f64; 3],
        /// Number of points that replace the light in techniques that light by points, or "auto" (the default): the plan takes 16.
        samples: Option<Whole>,
        /// Whether it casts shadows; default true.
        #[serde(default = "yes")]
        shadow: bool,
        /// Cells along a side of its shadow map, 1 to 16384; default those of `render.shadow`.
        shadow_cells: Option<u32>,
    },
}

/// The keys of a light about its shadow.
pub(crate) struct RawLightShadow {
    pub(crate) is_cast: bool,
    pub(crate) cells: Option<u32>,
}

impl RawLight {
    /// Whether it casts shadows, and the cells of its map.
    pub(crate) fn shadow(&self) -> RawLightShadow {
        match *self {
            Self::Point { shadow, shadow_cells, .. }
            | Self::Directional { shadow, shadow_cells, .. }
            | Self::Spot { shadow, shadow_cells, .. }
            | Self::Sphere { shadow, shadow_cells, .. }
            | Self::Disk { shadow, shadow_cells, .. }
            | Self::Rect { shadow, shadow_cells, .. } => RawLightShadow { is_cast: shadow, cells: shadow_cells },
        }
    }

    /// The name that the scene gives it.
    pub(crate) fn name(&self) -> Option<&str> {
        match self {
            Self::Point { name, .. }
            | Self::Directional { name, .. }
            | Self::Spot { name, .. }
            | Self::Sphere { name, .. }
            | Self::Disk { name, .. }
            | Self::Rect { name, .. } => name.as_deref(),
        }
    }
}
