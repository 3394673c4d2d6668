//! Objects as they are written.

use crate::footprint::raw::RawChoice;
use crate::object::labels_raw::RawLabels;
use crate::object::points_raw::{RawColorBy, RawDiscShape, RawPointForm, RawPointSize};
use crate::source::raw::{
    RawClip, RawCloud, RawDensity, RawExtract, RawField, RawImplicit, RawIsosurface, RawLevelSet, RawMediumBall,
    RawMediumBox, RawPart, RawRectangle, RawSlice, RawTransferPoint,
};
use schemars::JsonSchema;
use serde::Deserialize;
use std::collections::BTreeMap;

/// An object: a name, exactly one source (`mesh`, `volume`, `points`, `extract`, `implicit`, `isosurface`, `level_set`, `union`,
/// `intersection`, `difference`, `slice`, `density`, `cloud`, `rectangle`, `medium_box` or `medium_ball`), and how it looks.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a table")]
#[schemars(rename = "Object")]
pub(crate) struct RawObject {
    /// Unique name.
    pub(crate) name: String,
    /// Path of a triangle mesh.
    pub(crate) mesh: Option<String>,
    /// Path of a regular volume; needs `transfer`.
    pub(crate) volume: Option<String>,
    /// Which volume of a series `volume` is, from 0; default 0.
    pub(crate) frame: Option<u32>,
    /// Which array of a VTK file a `volume`, `isosurface`, `slice` or `field` is; default the one that the file names, else the first of one
    /// number.
    pub(crate) array: Option<String>,
    /// The value of the voxels of a `volume`, `isosurface`, `slice` or `field` that have none, which draw nothing; default none but NaN.
    pub(crate) nodata: Option<f64>,
    /// Steps between the voxels of a `volume`, `isosurface`, `slice`, `field` or `mesh` of labels along x, y and z of the file, in its unit; default those of the file.
    pub(crate) voxel_size: Option<[f64; 3]>,
    /// Path of a raw point cloud.
    pub(crate) points: Option<String>,
    /// What a light sees first of other objects.
    pub(crate) extract: Option<RawExtract>,
    /// The zero set of an expression.
    pub(crate) implicit: Option<RawImplicit>,
    /// The surface in a volume on which its value is a given one.
    pub(crate) isosurface: Option<RawIsosurface>,
    /// The surface through scattered points.
    pub(crate) level_set: Option<RawLevelSet>,
    /// The surface of what lies in any of some solids.
    pub(crate) union: Option<Vec<RawPart>>,
    /// The surface of what lies in all of some solids.
    pub(crate) intersection: Option<Vec<RawPart>>,
    /// The surface of what lies in the first of some solids and in none of the others.
    pub(crate) difference: Option<Vec<RawPart>>,
    /// A plane through a volume, coloured by `transfer`.
    pub(crate) slice: Option<RawSlice>,
    /// An expression as the density of a medium.
    pub(crate) density: Option<RawDensity>,
    /// A procedural cloud.
    pub(crate) cloud: Option<RawCloud>,
    /// A flat parallelogram.
    pub(crate) rectangle: Option<RawRectangle>,
    /// A homogeneous box.
    pub(crate) medium_box: Option<RawMediumBox>,
    /// A homogeneous ball.
    pub(crate) medium_ball: Option<RawMediumBall>,
    /// What `points` become: "surface" (default), discs, or "medium", the matter around each of them.
    #[serde(rename = "as")]
    pub(crate) form: Option<RawPointForm>,
    /// Extinction within `points` that are a medium, 1/world unit; default the material's.
    pub(crate) extinction: Option<f64>,
    /// The column that `points` or a `mesh` take their colours from.
    pub(crate) color_by: Option<RawColorBy>,
    /// Names, colours and opacities of the labels of a `mesh` that is a volume of labels: the path of a table, or labels by their numbers.
    pub(crate) labels: Option<RawLabels>,
    /// Which `points` are drawn: classes by a list, other columns by their lowest and highest number.
    pub(crate) keep: Option<BTreeMap<String, Vec<f64>>>,
    /// Whether x and y of `points` are degrees of longitude and latitude, which become metres east and north of their middle, beside heights in
    /// metres; default false.
    pub(crate) degrees: Option<bool>,
    /// Whether `points` are drawn without light; default true where their file has colours and nothing else says how they look.
    pub(crate) unlit: Option<bool>,
    /// Diameter of the discs of `points`; default from their neighbours.
    pub(crate) point_size: Option<RawPointSize>,
    /// How discs of `points` lie whose file says nothing of it: "round" (default), or "elliptical", as long and wide as the points' cells.
    pub(crate) discs: Option<RawDiscShape>,
    /// Regions that it is kept in, but for homogeneous media; surfaces end open at their borders, volumes show their values there.
    #[serde(default)]
    pub(crate) clip: Vec<RawClip>,
    /// A volume whose values a surface shows by the colours, and the opacities if it has some, of `transfer`.
    pub(crate) field: Option<RawField>,
    /// Control points of the transfer function of a `volume`, `slice`, surface with a `field`, `points` or a `mesh` with `color_by`, by rising value.
    pub(crate) transfer: Option<Vec<RawTransferPoint>>,
    /// Length that opacities of `transfer` refer to, in the unit of the data: it grows with `transform.scale`.
    pub(crate) unit_length: Option<f64>,
    /// What a `volume` is drawn on, "cartesian" (default), the file's, or "bcc", a body-centred cubic lattice; `sheets` alone has that.
    pub(crate) lattice: Option<RawLattice>,
    #[serde(default)]
    pub(crate) transform: RawTransform,
    /// Name of a material.
    pub(crate) material: Option<String>,
    /// Names of materials that a column `material` of `points` chooses among, counted from 0; in the place of `material`.
    pub(crate) materials: Option<Vec<String>>,
    /// Opacity of one crossing, from 0 to 1, instead of the material's.
    pub(crate) opacity: Option<f64>,
    /// Colour, linear Rec.709, instead of the data's and the material's.
    pub(crate) color: Option<[f64; 3]>,
    /// What draws it where it is translucent, "points", "particles", "sheets", "surfels" or "reference"; default the technique of `render`.
    pub(crate) technique: Option<String>,
    /// Distance between splats, world units; default from the data and the camera.
    pub(crate) spacing: Option<f64>,
    /// Share of shadow that it receives, from 0 to 1; default 1.
    pub(crate) shadow_coefficient: Option<f64>,
    /// Whether it casts shadows; default true.
    pub(crate) casts_shadow: Option<bool>,
    /// Whether it is drawn; default true.
    pub(crate) visible: Option<bool>,
    /// Index into `footprints`, or how it is chosen for each disc; default the file's column `footprint`, else that of the material.
    pub(crate) footprint: Option<RawChoice>,
    /// Make splats at one place one; default false.
    #[serde(default)]
    pub(crate) merge_duplicates: bool,
}

/// What a volume is drawn on.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
#[schemars(rename = "Lattice")]
pub(crate) enum RawLattice {
    Cartesian,
    Bcc,
}

/// Turns `up`, then scales, rotates and translates.
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default, expecting = "a table")]
#[schemars(rename = "Transform")]
pub(crate) struct RawTransform {
    /// Uniform scale, above 0; default 1.
    pub(crate) scale: Option<f64>,
    /// Angles around x, then y, then z, degrees.
    pub(crate) rotate: [f64; 3],
    /// World units.
    pub(crate) translate: [f64; 3],
    /// The axis of the data that points up; default "auto": what the file's format says, else "y".
    pub(crate) up: RawUp,
}

/// The axis that points up.
#[derive(Debug, Default, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
#[schemars(rename = "Up")]
pub(crate) enum RawUp {
    #[default]
    Auto,
    Y,
    Z,
    #[serde(rename = "-y")]
    MinusY,
}
