//! Chooses the material of each point by a column of its file, as the column `footprint` chooses footprints.

use crate::{ConvertError, SplatParams};
use splat_core::RawPoints;
use splat_core::points::attributes::MATERIAL;
use std::borrow::Cow;
use std::sync::Arc;

/// A material that points may have, with its defaults for points that state no value.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PointMaterial {
    /// Its index in the materials of the scene.
    pub id: u16,
    /// Linear Rec.709.
    pub color: [f32; 3],
    /// Opacity of one crossing, in \[0, 1\].
    pub opacity: f64,
}

/// The material of every point; `None` where the object has one for all.
pub(crate) fn materials_of(
    points: &RawPoints,
    params: &SplatParams,
) -> Result<Option<impl Fn(usize) -> PointMaterial + Sync + use<>>, ConvertError> {
    let Some(list) = params.materials.clone() else { return Ok(None) };
    let of_splats = || points.ready.column(MATERIAL).map(Cow::Owned);
    let Some(column) = points.own_column(MATERIAL).map(Cow::Borrowed).or_else(of_splats) else {
        let expected = "one with a column `material`, whose numbers choose among them";
        return Err(params.bad_text("materials", "a file without such a column".to_owned(), expected));
    };
    if !points.gaussians.is_empty() {
        let expected = "none: 3D Gaussians have the light of their captures";
        return Err(params.bad_text("materials", "a list".to_owned(), expected));
    }
    if let Some(i) = column.iter().position(|number| *number >= list.len() as f64) {
        let found = format!("{} in the column `material` of point {i}, and {} listed", column[i], list.len());
        return Err(params.bad_text("materials", found, "an index of the list, which is counted from 0"));
    }
    let ids: Vec<u16> = column.iter().map(|number| *number as u16).collect();
    Ok(Some(move |i: usize| list[usize::from(ids[i])]))
}

/// The points with the colours and opacities of their materials, where they have no colour of their own and the object states no opacity.
pub(crate) fn with_materials(
    points: Arc<RawPoints>,
    params: &SplatParams,
    has_opacity: bool,
) -> Result<Arc<RawPoints>, ConvertError> {
    let Some(material_of) = materials_of(&points, params)?.filter(|_| points.ready.cloud.is_empty()) else {
        return Ok(points);
    };
    let mut colored = Arc::unwrap_or_clone(points);
    if colored.color.is_empty() {
        colored.color = (0..colored.position.len()).map(|i| material_of(i).color).collect();
    }
    if !has_opacity {
        colored.opacity.resize(colored.position.len(), 1.0);
        colored.opacity.iter_mut().enumerate().for_each(|(i, opacity)| *opacity *= material_of(i).opacity as f32);
    }
    Ok(colored.into())
}
