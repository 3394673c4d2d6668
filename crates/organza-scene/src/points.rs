//! How raw points look beside what all objects have, checked.

use super::SceneObject;
use convert::{ColorBy, DiscSize, Kept, PointsShown};

/// What a scene says of raw points; of other sources nothing.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct PointsLook {
    /// The column that they take their colours from; `None` for those of the file, the object or its material.
    pub color_by: Option<ColorBy>,
    /// Which of them are drawn, by their columns.
    pub keep: Vec<Kept>,
    /// Whether they are drawn without light; `None` where that follows from their file.
    pub unlit: Option<bool>,
    /// Diameter of their discs; `None` where it follows from their neighbours.
    pub size: Option<DiscSize>,
}

impl PointsLook {
    /// The columns that have to be read of their file.
    pub fn columns(&self) -> impl Iterator<Item = &str> {
        self.color_by.iter().map(|by| by.column.as_str()).chain(self.keep.iter().map(|kept| kept.column.as_str()))
    }
}

impl SceneObject {
    /// What is shown of its points, in the unit of their file.
    pub fn points_shown(&self) -> PointsShown<'_> {
        PointsShown {
            keep: &self.points.keep,
            clip: &self.clip,
            spacing: self.spacing.map(|spacing| spacing / self.transform.scale),
            color_by: self.points.color_by.as_ref(),
            up: self.up.axis.direction(),
        }
    }

    /// Whether its points are drawn without light: as the scene says, else those that have colours of their own, which no material and no
    /// other colours are put in the place of. Photographs hold the light of their day already.
    pub fn is_unlit(&self, has_colors: bool) -> bool {
        let is_bare = self.material == 0 && self.color.is_none() && self.points.color_by.is_none();
        self.points.unlit.unwrap_or(is_bare && has_colors)
    }
}
