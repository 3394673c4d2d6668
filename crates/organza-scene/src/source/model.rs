//! Where an object's data comes from, checked: files, expressions and shapes.

use crate::{Error, SceneObject, Written};
use convert::{Classified, CloudShape, Ellipsoid, HomogeneousMedium, Rectangle};
use field::{Combination, ExpressionField, Inside};
use glam::DVec3;
use splat_core::{DAabb, Interpolation, RawPoints, TransferFunction};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Where an object's data comes from.
#[derive(Debug, Clone, PartialEq)]
pub enum Source {
    /// A triangle mesh in a file.
    Mesh(PathBuf),
    /// A raw point cloud in a file, as samples of a surface.
    Points(PathBuf),
    /// A raw point cloud in a file, as matter.
    Matter(MatterSource),
    /// What a light sees first of other objects.
    Extract(ExtractSource),
    /// A regular volume in a file.
    Volume(VolumeSource),
    /// The zero set of an expression.
    Implicit(ImplicitSource),
    /// An isosurface of a volume.
    Isosurface(IsosurfaceSource),
    /// The surface through scattered points.
    LevelSet(LevelSetSource),
    /// The surface of a solid that is made of several.
    Combined(CombinedSource),
    /// A plane through a volume.
    Slice(SliceSource),
    /// An expression as a density.
    Density(DensitySource),
    /// A procedural cloud.
    Cloud(CloudSource),
    /// A plane.
    Rectangle(Rectangle),
    /// A homogeneous medium.
    Medium(HomogeneousMedium),
}

impl Source {
    /// Whether it is a participating medium, which no ray crosses at one place.
    pub fn is_medium(&self) -> bool {
        matches!(self, Self::Matter(_) | Self::Volume(_) | Self::Density(_) | Self::Cloud(_) | Self::Medium(_))
    }

    /// Whether it is made of points without faces.
    pub fn is_of_points(&self) -> bool {
        matches!(self, Self::Points(_) | Self::Matter(_) | Self::Extract(_))
    }

    /// Whether it is the zero set of a field.
    pub fn is_of_field(&self) -> bool {
        matches!(self, Self::Implicit(_) | Self::Isosurface(_) | Self::LevelSet(_) | Self::Combined(_))
    }

    /// Operations of its expressions, all of them, at one place.
    ///
    /// # Errors
    /// As [`ImplicitSource::field`].
    pub fn operations(&self) -> Result<usize, Error> {
        match self {
            Self::Implicit(source) => Ok(source.field()?.operations()),
            Self::Density(source) => Ok(source.field()?.operations()),
            Self::Combined(source) => source.parts.iter().map(Self::operations).sum(),
            _ => Ok(0),
        }
    }

    /// The files that it reads.
    pub fn paths(&self) -> Vec<&Path> {
        match self {
            Self::Combined(source) => source.parts.iter().flat_map(Self::paths).collect(),
            _ => self.path().into_iter().collect(),
        }
    }

    /// The file that it reads; of several the first.
    pub fn path(&self) -> Option<&Path> {
        match self {
            Self::Combined(source) => source.parts.iter().find_map(Self::path),
            Self::Mesh(path) | Self::Points(path) => Some(path),
            Self::Matter(source) => Some(&source.path),
            Self::Volume(source) => Some(&source.path),
            Self::Isosurface(source) => Some(&source.path),
            Self::LevelSet(source) => Some(&source.path),
            Self::Slice(source) => Some(&source.path),
            _ => None,
        }
    }
}

/// Points that stand for matter.
#[derive(Debug, Clone, PartialEq)]
pub struct MatterSource {
    /// The file.
    pub path: PathBuf,
    /// Extinction σ_t within the points, 1/world unit (after the object's transform).
    pub extinction: f64,
}

/// Where a light sees other objects first, by its shadow map of them alone: points of a surface, in the world.
#[derive(Debug, Clone, PartialEq)]
pub struct ExtractSource {
    /// Index into [`Scene::lights`](crate::Scene::lights).
    pub light: usize,
    /// Absorbance up to them, in (0, [`MOST_ABSORBANCE`]].
    pub absorbance: f32,
    /// Names of the objects, visible or not; empty for all that are visible and made of data.
    pub objects: Vec<String>,
    /// Where the scene asks for that absorbance, or for the extraction without one; `None` where no scene does.
    pub written: Option<Written>,
    /// The points, once they are found.
    pub points: Option<Arc<RawPoints>>,
}

/// Greatest absorbance up to which a light is asked what it sees: lists of a shadow map go somewhat farther.
pub const MOST_ABSORBANCE: f32 = 10.0;

impl ExtractSource {
    /// Whether the light is to see an object.
    pub fn sees(&self, object: &SceneObject) -> bool {
        match self.objects.is_empty() {
            true => object.visible && !matches!(object.source, Source::Extract(_)),
            false => self.objects.contains(&object.name),
        }
    }
}

/// A volume file and how its values become colour and extinction.
#[derive(Debug, Clone, PartialEq)]
pub struct VolumeSource {
    /// The file.
    pub path: PathBuf,
    /// Which volume of a series, from 0.
    pub frame: u64,
    /// Value → colour and extinction, 1/world unit (after the object's transform).
    pub transfer: TransferFunction,
    /// Voxels along each side of a block that is taken as one: 1, but for previews.
    pub block: usize,
}

/// The surface where an expression in x, y, z is zero; negative inside. Lengths are before the object's transform.
#[derive(Debug, Clone, PartialEq)]
pub struct ImplicitSource {
    /// The expression.
    pub expression: String,
    /// The region that is searched.
    pub bounds: DAabb,
    /// Distance between samples.
    pub spacing: f64,
}

impl ImplicitSource {
    /// Its field, in the coordinates of the expression: before the object's transform.
    ///
    /// # Errors
    /// [`Error::Internal`] for a text that is no expression, which no checked scene has.
    pub fn field(&self) -> Result<ExpressionField, Error> {
        parsed(&self.expression)
    }
}

fn parsed(expression: &str) -> Result<ExpressionField, Error> {
    ExpressionField::parse(expression).map_err(|e| Error::Internal(e.to_string()))
}

/// A volume file, and the surface on which its value is a given one.
#[derive(Debug, Clone, PartialEq)]
pub struct IsosurfaceSource {
    /// The file.
    pub path: PathBuf,
    /// Which volume of a series, from 0.
    pub frame: u64,
    /// Physical value.
    pub level: f64,
    /// Values between lattice points.
    pub interpolation: Interpolation,
    /// Which side the normals do not point to.
    pub inside: Inside,
}

/// Scattered points through which a surface is laid.
#[derive(Debug, Clone, PartialEq)]
pub struct LevelSetSource {
    /// The file.
    pub path: PathBuf,
    /// How far points may lie from the surface, over the diagonal of their box.
    pub tolerance: f64,
}

/// Solids that become one.
#[derive(Debug, Clone, PartialEq)]
pub struct CombinedSource {
    /// How.
    pub combination: Combination,
    /// At least two, each [`Source::Implicit`], [`Source::Isosurface`], [`Source::LevelSet`] or [`Source::Combined`].
    pub parts: Vec<Source>,
}

/// A plane through a volume. Lengths are before the object's transform.
#[derive(Debug, Clone, PartialEq)]
pub struct SliceSource {
    /// The file.
    pub path: PathBuf,
    /// Which volume of a series, from 0.
    pub frame: u64,
    /// Value → colour; the extinctions are 0.
    pub transfer: TransferFunction,
    /// A point of the plane.
    pub center: DVec3,
    /// Unit normal.
    pub normal: DVec3,
}

/// A volume whose values a surface shows, in the coordinates of its source: before its transform.
#[derive(Debug, Clone, PartialEq)]
pub struct FieldSource {
    /// The file.
    pub path: PathBuf,
    /// Which volume of a series, from 0.
    pub frame: u64,
    /// Values between lattice points.
    pub interpolation: Interpolation,
    /// Value → colour, and extinctions that are what `classified` says.
    pub transfer: TransferFunction,
    /// Whether the surface has a share of its opacity by the values.
    pub classified: Classified,
}

/// A medium whose density is an expression in x, y, z, negative values counting as 0. Lengths are before the object's
/// transform.
#[derive(Debug, Clone, PartialEq)]
pub struct DensitySource {
    /// The expression.
    pub expression: String,
    /// The region that is sampled.
    pub bounds: DAabb,
    /// Distance between samples.
    pub spacing: f64,
    /// Extinction σ_t where the expression is 1, 1/world unit.
    pub extinction: f64,
}

impl DensitySource {
    /// Its field, as [`ImplicitSource::field`].
    ///
    /// # Errors
    /// As there.
    pub fn field(&self) -> Result<ExpressionField, Error> {
        parsed(&self.expression)
    }
}

/// A cloud: ellipsoids whose density is disturbed by turbulence. Lengths are before the object's transform.
#[derive(Debug, Clone, PartialEq)]
pub struct CloudSource {
    /// Centre and three radii of each ellipsoid.
    pub ellipsoids: Vec<(DVec3, DVec3)>,
    /// Octaves of turbulence.
    pub octaves: u32,
    /// Frequency of the first octave, 1/unit of length.
    pub frequency: f64,
    /// Strength of the disturbance, in ellipsoid radii.
    pub amplitude: f64,
    /// Seed of the turbulence.
    pub seed: u32,
    /// Distance between samples.
    pub spacing: f64,
    /// Largest extinction σ_t, 1/world unit.
    pub extinction: f64,
}

impl CloudSource {
    /// What [`convert::procedural_cloud`] makes a lattice of, lengths before the object's transform.
    pub fn shape(&self) -> CloudShape {
        CloudShape {
            ellipsoids: self.ellipsoids.iter().map(|&(center, radii)| Ellipsoid { center, radii }).collect(),
            octaves: self.octaves,
            frequency: self.frequency,
            amplitude: self.amplitude,
            seed: self.seed,
            extinction: self.extinction,
            base: None,
            ..CloudShape::default()
        }
    }
}
