//! An object, checked.

use crate::{FieldSource, ObjectLabels, PointsLook, Source, Technique};
use convert::FootprintChoice;
use read::VoxelSize;
use splat_core::{Clip, Packing, Similarity, UpAxis};
use std::path::Path;
use std::sync::Arc;

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
    /// Index into [`crate::Scene::materials`].
    pub material: usize,
    /// Those that a column of its points chooses among, the first of which is [`Self::material`]; empty where that is the one of all.
    pub materials: Vec<usize>,
    /// Colour that replaces the data's and the material's, linear Rec.709.
    pub color: Option<[f32; 3]>,
    /// Opacity of one crossing that replaces the material's, in \[0, 1\]; surfaces and raw points.
    pub opacity: Option<f64>,
    /// How the planes of the lattice lie that a volume is drawn on: of the file's, or of the body-centred one of the same spectrum.
    pub packing: Packing,
    /// Which array of a VTK file its volume is; `None` for the one that the file names, else the first of one number.
    pub array: Option<String>,
    /// The value that voxels of its volume have which have none, beside NaN.
    pub nodata: Option<f32>,
    /// Steps between the voxels of its volume, in the place of the file's.
    pub voxel_size: Option<VoxelSize>,
    /// Whether x and y of its points are degrees, which become metres.
    pub degrees: bool,
    /// The field that it shows, a surface alone.
    pub field: Option<FieldSource>,
    /// How raw points look.
    pub points: PointsLook,
    /// The labels of a volume whose surfaces it is.
    pub labels: Option<ObjectLabels>,
    /// Regions that it is kept in, before the object's transform.
    pub clip: Vec<Clip>,
    /// Distance between splats, world units; `None` means that it is chosen from the data and the camera.
    pub spacing: Option<f64>,
    /// Share of the shadow that it receives, in \[0, 1\].
    pub shadow_coefficient: f32,
    /// Whether it casts shadows.
    pub casts_shadow: bool,
    /// Whether it is drawn at all; an invisible object is not even read.
    pub visible: bool,
    /// Which of [`crate::Scene::footprints`] its splats have.
    pub footprints: Arc<FootprintChoice>,
    /// Whether splats at one place become one.
    pub merge_duplicates: bool,
    /// What draws it where it is translucent; `None` for the technique of the scene.
    pub technique: Option<Technique>,
    /// Whether the plan chose what draws it.
    pub is_chosen: bool,
    /// Whether a track of the animation changes more of it than its place, its looks, and what draws it.
    pub deforms: bool,
}

impl SceneObject {
    /// The files that it reads.
    pub fn paths(&self) -> impl Iterator<Item = &Path> {
        let table = self.labels.iter().filter_map(|labels| labels.file.as_deref());
        self.source.paths().into_iter().chain(self.field.iter().map(|field| &*field.path)).chain(table)
    }
}

/// The axis of a source that points up.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Up {
    /// The axis.
    pub axis: UpAxis,
    /// What says so.
    pub by: UpBy,
}

/// What says which axis of a source points up.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum UpBy {
    /// The format of its file, or what the file says of its space.
    File,
    /// The scene; of what has no file its coordinates are those of the scene.
    Scene,
    /// Nothing: y is taken.
    Nothing,
}
