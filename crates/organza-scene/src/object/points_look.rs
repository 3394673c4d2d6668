//! How raw points look beside what all objects have, checked.

use crate::{MatterSource, Scene, SceneMaterial, SceneObject, Source};
use convert::{ColorBy, DiscShape, DiscSize, Kept, MatterParams, PointMaterial, PointsShown, SplatParams};
use std::sync::Arc;

/// The look that a scene states for raw points. A mesh uses its colours alone; other sources ignore it.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct PointsLook {
    /// The column that they, or a mesh, take their colours from; `None` for those of the file, the object or its material.
    pub color_by: Option<ColorBy>,
    /// Which of them are drawn, by their columns.
    pub keep: Vec<Kept>,
    /// Whether they are drawn without light; `None` where that follows from their file.
    pub unlit: Option<bool>,
    /// How their discs lie, where neither `size` nor the file says so; `None` where that follows from whether they lie on a surface.
    pub shape: Option<DiscShape>,
    /// Diameter of their discs; `None` where it follows from their neighbours.
    pub size: Option<DiscSize>,
    /// Whether splats keep a number each: the point's value, or that of its colour column. Pictures do not need it.
    pub keeps_values: bool,
}

impl Scene {
    /// Opacity of one crossing of the surfaces of an object; 1 if its points have materials of their own.
    pub fn opacity_of(&self, object: &SceneObject) -> f64 {
        let of_material = if object.materials.is_empty() { self.materials[object.material].opacity } else { 1.0 };
        object.opacity.unwrap_or(of_material)
    }

    /// What the points of an object choose their materials from, if they do.
    pub fn point_materials(&self, object: &SceneObject) -> Option<Arc<[PointMaterial]>> {
        let point_material = |id: &usize| {
            let SceneMaterial { color, opacity, .. } = self.materials[*id];
            PointMaterial { id: *id as u16, color, opacity }
        };
        (!object.materials.is_empty()).then(|| object.materials.iter().map(point_material).collect())
    }
}

impl PointsLook {
    /// The columns that have to be read of their file.
    pub fn columns(&self) -> impl Iterator<Item = &str> {
        self.color_by.iter().map(|by| by.column.as_str()).chain(self.keep.iter().map(|kept| kept.column.as_str()))
    }
}

impl SceneObject {
    /// The materials that its splats may have.
    pub fn material_ids(&self) -> impl Iterator<Item = usize> + Clone + '_ {
        let single = self.materials.is_empty().then_some(self.material);
        single.into_iter().chain(self.materials.iter().copied())
    }

    /// How its points become a medium of these attributes, if they do.
    pub fn matter_params(&self, splat: &SplatParams) -> Option<MatterParams> {
        let Source::Matter(MatterSource { extinction, .. }) = self.source else { return None };
        let spacing = self.spacing.map(|spacing| spacing / self.transform.scale);
        let splat = splat.clone();
        let colors = self.color.is_none();
        let values = self.points.keeps_values;
        Some(MatterParams { splat, colors, values, extinction, spacing, ..MatterParams::default() })
    }

    /// What is shown of its points, in the unit of their file. Those of a medium are made fewer when they stand for volumes.
    pub fn points_shown(&self) -> PointsShown<'_> {
        PointsShown {
            keep: &self.points.keep,
            clip: &self.clip,
            spacing: self.spacing.filter(|_| !self.source.is_medium()).map(|spacing| spacing / self.transform.scale),
            color_by: self.points.color_by.as_ref(),
            as_matter: self.source.is_medium(),
            shape: self.points.shape.unwrap_or_default(),
            has_size: self.points.size.is_some(),
            has_opacity: self.opacity.is_some(),
            has_field: self.field.is_some(),
            keeps_values: self.points.keeps_values,
            up: self.up.axis.direction(),
        }
    }

    /// Whether its points are drawn without light: as the scene says, else those that have colours of their own, which no material and no
    /// other colours are put in the place of. Photographs hold the light of their day already; a medium is lit.
    pub fn is_unlit(&self, has_colors: bool) -> bool {
        let is_bare = self.material == 0 && self.color.is_none() && !self.has_scale();
        self.points.unlit.unwrap_or(is_bare && has_colors && !self.source.is_medium())
    }
}
