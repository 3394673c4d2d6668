//! What the colours of objects stand for, as far as a scene alone tells.

use crate::{SceneObject, SliceSource, Source, VolumeSource};
use convert::ColorScale;

impl SceneObject {
    /// That of its values, where a transfer function gives them colours; `None` for points, whose numbers stand in their file.
    pub fn value_scale(&self) -> Option<ColorScale> {
        match &self.source {
            Source::Volume(VolumeSource { transfer, .. }) | Source::Slice(SliceSource { transfer, .. }) => {
                Some(ColorScale::of_values(&self.name, transfer))
            }
            _ => self.field.as_ref().map(|field| ColorScale::of_values(&self.name, &field.transfer)),
        }
    }

    /// Whether its colours stand for numbers: for those of a column of its points or its mesh, or for its values.
    pub fn has_scale(&self) -> bool {
        self.points.color_by.is_some() || self.value_scale().is_some()
    }
}
