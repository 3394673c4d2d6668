//! The facts of the scene that reading and converting an object need.

use super::files::Files;
use crate::scene::{Scene, SceneObject, Source, SourceData};
use crate::{Error, RenderOptions};
use convert::{Orientation, SplatParams, SurfelParams, VolumeParams};
use glam::DVec3;
use read::ReadParams;
use splat_core::{Limits, Progress, Reservation, Shading};
use std::path::Path;
use std::sync::Arc;

/// Bytes that a splat takes from its conversion to the finished picture, at most.
pub(crate) const BYTES_PER_SPLAT: u64 = 256;
/// The same for each point of a lattice that is made of an object: its value, and what a technique keeps for it.
pub(crate) const BYTES_PER_LATTICE_POINT: u64 = 32;

/// Largest spacing of raw points over their median: above it, leaves and wires would become petals.
const LARGEST_SPACING: f64 = 1.7;

/// Share of the tolerance that the optical depth of one cell of a volume may be off: some dozens that a ray
/// crosses are off to both sides.
const CLASSIFICATION_SHARE: f64 = 1.0 / 8.0;

/// The inputs of the conversion of an object beside the object.
pub(super) struct ObjectContext<'a> {
    pub(super) scene: &'a Scene,
    pub(super) options: &'a RenderOptions,
    pub(super) files: &'a Files,
    pub(super) progress: &'a Progress,
    /// Rank of the object.
    pub(super) id: usize,
    /// Bytes and splats that earlier objects take.
    pub(super) used: u64,
    pub(super) made: u64,
}

/// Whether the gradients of the object's volume could change the picture: lit by Phong, or in a layer of normals.
pub(super) fn needs_gradients(object: &SceneObject, scene: &Scene) -> bool {
    let lit = !scene.lights.is_empty() && scene.materials[object.material].material.shading == Shading::Phong;
    object.source.has_gradients() && (lit || scene.render.layers.set().normal)
}

impl ObjectContext<'_> {
    pub(super) fn splat_params(&self, object: &SceneObject) -> SplatParams {
        let material = &self.scene.materials[object.material];
        let mut params = SplatParams {
            object_name: object.name.clone(),
            object: self.id as u32,
            material: object.material as u16,
            footprint: object.footprints.ids[0],
            profile: self.scene.footprints.layers()[usize::from(object.footprints.ids[0])],
            footprints: Some(object.footprints.clone()),
            materials: self.scene.point_materials(object),
            transform: object.transform,
            color: object.color.unwrap_or(material.color),
            limits: Limits::NONE,
            keep_clear: material.material.bounds_matter(),
            cache: self.options.cache.clone(),
        };
        self.limit(&mut params);
        params
    }

    /// Limits to the splats that memory and the scene's own limit leave after earlier objects.
    fn limit(&self, params: &mut SplatParams) {
        let fits = self.files.memory(self.options).left().saturating_sub(self.used) / BYTES_PER_SPLAT;
        let asked = self.scene.render.max_points.map_or(u64::MAX, |most| most.saturating_sub(self.made));
        params.limits = Limits::elements(fits.min(asked).min(u64::from(u32::MAX)));
    }

    /// The same attributes within what is left now.
    pub(super) fn limited(&self, params: &SplatParams) -> SplatParams {
        let mut params = params.clone();
        self.limit(&mut params);
        params
    }

    /// The largest of the material's factors on extinction.
    pub(super) fn extinction_factor(&self, object: &SceneObject) -> f64 {
        let factors = self.scene.materials[object.material].material.extinction_rgb;
        f64::from(factors.into_iter().fold(0.0, f32::max))
    }

    /// Parameters of raw points.
    pub(super) fn surfel_params(&self, object: &SceneObject, splat: SplatParams) -> SurfelParams {
        SurfelParams {
            // Terrain faces the sky.
            orientation: Orientation::Auto(splat.transform.rotation.inverse() * DVec3::Y),
            splat,
            colors: object.color.is_none(),
            values: object.points.keeps_values,
            opacity: self.scene.opacity_of(object),
            largest_spacing: LARGEST_SPACING,
            shape: object.points.shape.unwrap_or_default(),
            size: object.points.size,
            camera: Some(self.scene.camera),
            merge_duplicates: object.merge_duplicates || self.options.merge_duplicates,
            ..SurfelParams::default()
        }
    }

    pub(super) fn read(&self, path: &Path) -> Result<SourceData, Error> {
        let columns = self.scene.columns_of(path);
        let matter = self.scene.has_matter(path);
        let most_points = self.scene.render.max_points;
        // A surface with a field takes the size of the field's voxels.
        let voxel_size =
            self.object_read(path).filter(|object| object.field.is_none()).and_then(|object| object.voxel_size);
        let surfaces = self.object_read(path).is_some_and(|object| matches!(object.source, Source::Mesh(_)));
        let params = ReadParams { columns, matter, most_points, voxel_size, surfaces, ..self.options.read_params() };
        self.files.data(self.scene, path, &params, self.progress)
    }

    /// The same of one volume of a series.
    pub(super) fn read_frame(&self, path: &Path, frame: u64) -> Result<SourceData, Error> {
        let object = self.scene.objects.get(self.id);
        let array = object.and_then(|object| object.array.clone());
        let voxel_size = object.and_then(|object| object.voxel_size);
        let params = ReadParams { frame, array, voxel_size, ..self.options.read_params() };
        self.files.data(self.scene, path, &params, self.progress)
    }

    /// The object that is loaded, if this is the file of its source.
    fn object_read(&self, path: &Path) -> Option<&SceneObject> {
        self.scene.objects.get(self.id).filter(|object| object.source.path() == Some(path))
    }

    /// The value of voxels without one, where the object states it.
    pub(super) fn nodata(&self) -> Option<f32> {
        self.scene.objects.get(self.id).and_then(|object| object.nodata)
    }

    /// The same of a file that nothing but what is made from it needs.
    pub(super) fn read_once(&self, path: &Path) -> Result<(SourceData, Arc<Reservation>), Error> {
        self.files.data_once(self.scene, path, &self.options.read_params(), self.progress)
    }

    /// Parameters of a volume: normals only where they are used.
    pub(super) fn volume_params(&self, splat: SplatParams) -> VolumeParams {
        let object = &self.scene.objects[self.id];
        let normals = needs_gradients(object, self.scene);
        let clip = object.clip.clone();
        let classification_error = CLASSIFICATION_SHARE * self.scene.render.tolerance;
        VolumeParams { splat, normals, classification_error, clip, ..VolumeParams::default() }
    }
}

/// Attributes with the limits of a lattice in the place of those of splats.
pub(super) fn of_lattice(params: &SplatParams) -> SplatParams {
    let points = params.limits.max_elements.saturating_mul(BYTES_PER_SPLAT / BYTES_PER_LATTICE_POINT);
    SplatParams { limits: Limits::elements(points.min(u64::from(u32::MAX))), ..params.clone() }
}
