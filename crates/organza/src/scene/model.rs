//! The checked scene: everything a render needs, in radians and f64 world units.

use super::{LayerChoice, SceneLight};
use convert::read::UpAxis;
use convert::{Clip, Inside, Interpolation};
use glam::DVec3;
use splat_core::raster::Accumulation;
use splat_core::{Camera, Direction, FootprintStack, Material, Similarity, TransferFunction};
use std::path::{Path, PathBuf};

/// A whole scene. Made by [`super::load()`] or [`super::parse`] alone, so that every number in it is finite and in range.
#[derive(Debug, Clone, PartialEq)]
pub struct Scene {
    /// The scene file, as it was named.
    pub file: PathBuf,
    /// SHA-256 of the scene file's bytes, of the overrides from the command line and of the frame, lower-case hex.
    pub sha256: String,
    /// Number of frames of its animation, if it has one.
    pub frames: Option<u32>,
    /// The camera with the image size.
    pub camera: Camera,
    /// Radiance behind everything, linear Rec.709.
    pub background: [f32; 3],
    /// Ambient radiance, the same from all directions.
    pub ambient: [f32; 3],
    /// Lights in file order.
    pub lights: Vec<SceneLight>,
    /// Objects in file order, invisible ones included.
    pub objects: Vec<SceneObject>,
    /// Materials; entry 0 is the default one, the others are in order of name.
    pub materials: Vec<SceneMaterial>,
    /// How to render.
    pub render: RenderSettings,
    /// The footprints that objects name by index.
    pub footprints: FootprintStack,
}

impl Scene {
    /// Every file that the scene is made of, its own first.
    pub fn files(&self) -> Vec<PathBuf> {
        let data = self.objects.iter().filter_map(|o| o.source.path().map(Path::to_owned));
        std::iter::once(self.file.clone()).chain(data).collect()
    }
}

/// One object of the scene.
#[derive(Debug, Clone, PartialEq)]
pub struct SceneObject {
    /// Unique name.
    pub name: String,
    /// Where its data comes from.
    pub source: Source,
    /// From the source's axes (after `up`) to the world.
    pub transform: Similarity,
    /// The axis of the source that [`Self::transform`] turns up.
    pub up: Up,
    /// Index into [`Scene::materials`].
    pub material: usize,
    /// Colour that replaces the data's and the material's, linear Rec.709.
    pub color: Option<[f32; 3]>,
    /// Opacity of one crossing that replaces the material's, in \[0, 1\]; surfaces and raw points.
    pub opacity: Option<f64>,
    /// Regions outside of which a surface of a field ends, before the object's transform.
    pub clip: Vec<Clip>,
    /// Distance between splats, world units; `None` means that it is chosen from the data and the camera.
    pub spacing: Option<f64>,
    /// Share of the shadow that it receives, in \[0, 1\].
    pub shadow_coefficient: f32,
    /// Whether it casts shadows.
    pub casts_shadow: bool,
    /// Whether it is drawn at all; an invisible object is not even read.
    pub visible: bool,
    /// Index into [`Scene::footprints`].
    pub footprint: u8,
    /// Whether splats at one place become one.
    pub merge_duplicates: bool,
    /// What draws it where it is translucent; `None` for the technique of the scene.
    pub technique: Option<Technique>,
}

/// The axis of a source that points up.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Up {
    /// The axis.
    pub axis: UpAxis,
    /// Whether the file's format told it; else the scene, or it is the default of what has no file.
    pub by_file: bool,
}

/// Where an object's data comes from.
#[derive(Debug, Clone, PartialEq)]
pub enum Source {
    /// A triangle mesh in a file.
    Mesh(PathBuf),
    /// A raw point cloud in a file.
    Points(PathBuf),
    /// A regular volume in a file.
    Volume(VolumeSource),
    /// The zero set of an expression.
    Implicit(ImplicitSource),
    /// An isosurface of a volume.
    Isosurface(IsosurfaceSource),
    /// The surface through scattered points.
    LevelSet(LevelSetSource),
    /// A plane through a volume.
    Slice(SliceSource),
    /// An expression as a density.
    Density(DensitySource),
    /// A procedural cloud.
    Cloud(CloudSource),
    /// A plane.
    Rectangle(RectangleSource),
    /// A homogeneous medium.
    Medium(MediumShape),
}

impl Source {
    /// The file that it reads.
    pub fn path(&self) -> Option<&Path> {
        match self {
            Self::Mesh(path) | Self::Points(path) => Some(path),
            Self::Volume(source) => Some(&source.path),
            Self::Isosurface(source) => Some(&source.path),
            Self::LevelSet(source) => Some(&source.path),
            Self::Slice(source) => Some(&source.path),
            _ => None,
        }
    }
}

/// A volume file and how its values become colour and extinction.
#[derive(Debug, Clone, PartialEq)]
pub struct VolumeSource {
    /// The file.
    pub path: PathBuf,
    /// Value → colour and extinction, 1/world unit (after the object's transform).
    pub transfer: TransferFunction,
}

/// The surface where an expression in x, y, z is zero; negative inside. Lengths are before the object's transform.
#[derive(Debug, Clone, PartialEq)]
pub struct ImplicitSource {
    /// The expression.
    pub expression: String,
    /// Lowest and highest corner of the region that is searched.
    pub bounds: [DVec3; 2],
    /// Distance between samples.
    pub spacing: f64,
}

/// A volume file, and the surface on which its value is a given one.
#[derive(Debug, Clone, PartialEq)]
pub struct IsosurfaceSource {
    /// The file.
    pub path: PathBuf,
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

/// A plane through a volume. Lengths are before the object's transform.
#[derive(Debug, Clone, PartialEq)]
pub struct SliceSource {
    /// The file.
    pub path: PathBuf,
    /// Value → colour; the extinctions are 0.
    pub transfer: TransferFunction,
    /// A point of the plane.
    pub center: DVec3,
    /// Unit normal.
    pub normal: DVec3,
}

/// A medium whose density is an expression in x, y, z, negative values counting as 0. Lengths are before the object's
/// transform.
#[derive(Debug, Clone, PartialEq)]
pub struct DensitySource {
    /// The expression.
    pub expression: String,
    /// Lowest and highest corner of the region that is sampled.
    pub bounds: [DVec3; 2],
    /// Distance between samples.
    pub spacing: f64,
    /// Extinction σ_t where the expression is 1, 1/world unit.
    pub extinction: f64,
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

/// A flat parallelogram. Lengths are before the object's transform.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RectangleSource {
    /// Centre.
    pub center: DVec3,
    /// First half-axis.
    pub u: DVec3,
    /// Second half-axis, not parallel to the first.
    pub v: DVec3,
    /// Distance between splats.
    pub spacing: f64,
}

/// A homogeneous medium. Lengths are before the object's transform.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum MediumShape {
    /// An axis-aligned box.
    Box {
        /// Lowest corner.
        min: DVec3,
        /// Highest corner.
        max: DVec3,
        /// Extinction σ_t, 1/world unit.
        extinction: f64,
        /// Distance between splats.
        spacing: f64,
    },
    /// A ball.
    Ball {
        /// Centre.
        center: DVec3,
        /// Radius, > 0.
        radius: f64,
        /// Extinction σ_t, 1/world unit.
        extinction: f64,
        /// Distance between splats.
        spacing: f64,
    },
}

impl MediumShape {
    /// Distance between splats.
    pub fn spacing(&self) -> f64 {
        match self {
            Self::Box { spacing, .. } | Self::Ball { spacing, .. } => *spacing,
        }
    }
}

/// A named material.
#[derive(Debug, Clone, PartialEq)]
pub struct SceneMaterial {
    /// Name in the scene file; empty for the default material.
    pub name: String,
    /// What shading needs.
    pub material: Material,
    /// Colour of data that has none. Linear Rec.709.
    pub color: [f32; 3],
    /// Opacity of one crossing of a surface, in \[0, 1\].
    pub opacity: f64,
    /// Extinction σ_t of a medium that states none itself, 1/world unit.
    pub extinction: Option<f64>,
}

/// How to render.
#[derive(Debug, Clone, PartialEq)]
pub struct RenderSettings {
    /// The technique.
    pub technique: Technique,
    /// Samples along each side of a pixel, 1 to 8.
    pub antialias: u32,
    /// How much any pixel of the displayed picture may change by what is not simulated, in (0, 1].
    pub tolerance: f64,
    /// Exposure of the displayed picture: radiance is multiplied by 2^exposure.
    pub exposure: f64,
    /// Ranges into which the depths are cut that several techniques share.
    pub depth_ranges: u32,
    /// Images to keep.
    pub layers: LayerChoice,
    /// Seed of everything random.
    pub seed: u64,
    /// Most splats that the scene may become; more is a resource error.
    pub max_points: Option<u64>,
    /// Settings of the `points` technique; its shadow maps serve the others too.
    pub points: PointsSettings,
    /// Settings of the `particles` technique.
    pub particles: ParticlesSettings,
}

/// What draws the picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Technique {
    /// The planner chooses.
    #[default]
    Auto,
    /// Rendering-oriented points (Gunjee 2007).
    Points,
    /// Opaque particles, averaged over many sets (Tanaka 2012).
    Particles,
    /// Every fragment of every pixel, sorted, in f64: exact and slow.
    Reference,
}

impl Technique {
    /// All that can be asked for.
    pub const ALL: [Self; 4] = [Self::Auto, Self::Points, Self::Particles, Self::Reference];

    /// As scenes and reports name it.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Auto => "auto",
            Self::Points => "points",
            Self::Particles => "particles",
            Self::Reference => "reference",
        }
    }
}

/// Settings of the `particles` technique.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ParticlesSettings {
    /// Most sets of particles that are averaged, ≥ 2 (Tanaka 2012: repeat level L_R).
    pub repeat_level: u32,
    /// Root mean square of the pixels' standard errors of luminance at which enough sets are averaged, > 0.
    pub target_error: Option<f64>,
    /// How implicit surfaces are sampled.
    pub surface_sampler: SurfaceSampler,
}

/// How the particles of implicit surfaces are found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum SurfaceSampler {
    /// By lines, or on triangles where the field's bounds are too loose for lines to be fast.
    Auto,
    /// Where random lines meet the surface.
    Lines,
    /// On the triangles of a mesh, as fine as the object's splats.
    Triangles,
    /// Places of a Brownian motion on the surface (Tanaka 2012, section 4).
    Brownian {
        /// √(2Δt), over the longest side of the surface's box, > 0.
        step: f64,
    },
}

/// Settings of the `points` technique.
#[derive(Debug, Clone, PartialEq)]
pub struct PointsSettings {
    /// Thickness ε of a slice, world units; `None` takes the radius of the smallest splats.
    pub slice_thickness: Option<f64>,
    /// Whether splats are in exact order inside slices too.
    pub exact: bool,
    /// Which end of the view is composited first.
    pub direction: Direction,
    /// Composite only so many non-empty slices.
    pub first_slices: Option<u64>,
    /// A pixel is finished when its transmittance falls below this, in [0, 1).
    pub transmittance_cutoff: f64,
    /// Whether footprints are widened to a pixel so that small splats do not flicker.
    pub resampling_filter: bool,
    /// Precision of the running sums of a pixel.
    pub accumulation: Accumulation,
    /// Shadow maps.
    pub shadow: ShadowSettings,
}

/// Settings of the translucent shadow maps.
#[derive(Debug, Clone, PartialEq)]
pub struct ShadowSettings {
    /// How directions become cells.
    pub mapping: ShadowMapping,
    /// Cells along one side of the table, a power of two or not; `None` is chosen from splat sizes.
    pub cells: Option<u32>,
    /// Absorbance behind which light counts as gone; `None` follows from the tolerance.
    pub absorbance_cut: Option<f64>,
}

/// How directions from a light become cells of its table.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum ShadowMapping {
    /// Octahedral for points, planar for directional and spot lights.
    #[default]
    Auto,
    /// Equal-area octahedral.
    Octahedral,
    /// Polar angle and azimuth, as in the paper.
    Polar,
}
