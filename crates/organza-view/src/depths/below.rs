//! The state below the pointer: the number of the layer, the depth, the place, the object, and the values of its data.

use crate::depths::{Depths, PicturePlace};
use crate::picture::Drawn;
use organza::SourceData;
use organza::scene::{ObjectLabels, Scene, SceneObject, Source};
use serde::Serialize;
use splat_core::glam::DVec3;
use splat_core::{Grid, RawPoints};
use std::sync::{Arc, Weak};

/// Most columns of points that are told.
const MOST_COLUMNS: usize = 4;

/// The depth, the object and the data below the pointer.
#[derive(Debug, Clone, PartialEq, Serialize, Default)]
pub struct Below {
    /// The layer that is shown, and `beauty` where none is chosen.
    pub layer: String,
    /// Its numbers there: radiances of three channels, a vector, or one number; none before the whole picture is drawn.
    pub numbers: Vec<f64>,
    /// View depth at which half of the light is absorbed, world units.
    pub depth: Option<f64>,
    /// The place below the pointer, world units.
    pub position: Option<[f64; 3]>,
    /// The object that is seen first.
    pub object: Option<String>,
    /// The place in the coordinates of the object's file, where these are other than the world's.
    pub file_place: Option<FilePlace>,
    /// The values of its data at that place.
    pub values: Vec<NamedValue>,
}

/// A place in the coordinates of a file.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FilePlace {
    /// Units of the file.
    pub position: [f64; 3],
    /// World units that one unit of the file is long.
    pub scale: f64,
}

impl FilePlace {
    /// `None` for an object without a file, and for one that stands in the world as in its file.
    fn new(object: &SceneObject, place: DVec3) -> Option<Self> {
        let local = local_place(object, place);
        let is_other = object.source.path().is_some() && !local.abs_diff_eq(place, 1e-9 * place.length());
        is_other.then(|| Self { position: local.to_array(), scale: object.transform.scale })
    }
}

/// A place of the world in an object's own coordinates.
fn local_place(object: &SceneObject, place: DVec3) -> DVec3 {
    let transform = &object.transform;
    transform.rotation.inverse() * (place - transform.translation) / transform.scale
}

/// A number of an object's data.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct NamedValue {
    /// `value` of a volume; the name of a column of points.
    pub name: String,
    /// The number; of points that of the nearest one, of labels that of the region there.
    pub value: f64,
    /// The name of a label.
    pub meaning: Option<String>,
}

impl NamedValue {
    fn new(name: impl Into<String>, value: f64) -> Self {
        Self { name: name.into(), value, meaning: None }
    }
}

/// Data of an object, as long as something else keeps them.
#[derive(Debug, Clone)]
pub(crate) enum DataOfObject {
    Volume(Weak<Grid>),
    Points(Weak<RawPoints>),
}

impl DataOfObject {
    /// `None` for data whose numbers are not told.
    pub(crate) fn new(data: &SourceData) -> Option<Self> {
        match data {
            SourceData::Grid(grid) => Some(Self::Volume(Arc::downgrade(grid))),
            SourceData::Points(points) => Some(Self::Points(Arc::downgrade(points))),
            SourceData::Mesh(_) | SourceData::Painted(..) | SourceData::Image(_) => None,
        }
    }

    /// The numbers at a place, world units; none where data are not kept.
    fn at(&self, object: &SceneObject, place: DVec3) -> Vec<NamedValue> {
        let local = local_place(object, place);
        match self {
            // A volume whose regions are surfaces.
            Self::Volume(grid) if matches!(object.source, Source::Mesh(_)) => {
                grid.upgrade().and_then(|grid| of_labels(&grid, local, object.labels.as_ref())).into_iter().collect()
            }
            Self::Volume(grid) => grid.upgrade().and_then(|grid| of_volume(&grid, local)).into_iter().collect(),
            Self::Points(points) => points.upgrade().map_or_else(Vec::new, |points| of_points(&points, local)),
        }
    }
}

/// The eight voxels about a place, each with its share of what is interpolated there; `None` farther than `beyond` steps outside.
fn voxels_about(grid: &Grid, place: DVec3, beyond: f64) -> Option<[WeighedVoxel; 8]> {
    let at = grid.axes.inverse() * (place - grid.origin);
    let is_inside = (0..3).all(|k| at[k] >= -beyond && at[k] <= grid.dims[k] as f64 - 1.0 + beyond);
    if !is_inside {
        return None;
    }
    let low = at.floor();
    let share = at - low;
    Some(std::array::from_fn(|corner| {
        let step = |k: usize| (corner >> k & 1) as isize;
        let weight = (0..3).map(|k| if step(k) == 1 { share[k] } else { 1.0 - share[k] }).product();
        let value = grid.at_clamped(low.x as isize + step(0), low.y as isize + step(1), low.z as isize + step(2));
        WeighedVoxel { value, weight }
    }))
}

/// A voxel and its share of what is interpolated.
struct WeighedVoxel {
    value: f32,
    weight: f64,
}

/// The value of a volume between its voxels; `None` outside.
fn of_volume(grid: &Grid, place: DVec3) -> Option<NamedValue> {
    // A voxel without a value has no share in it.
    let known = voxels_about(grid, place, 0.5)?.into_iter().filter(|voxel| voxel.weight > 0.0);
    let value: f64 = known.map(|voxel| voxel.weight * f64::from(voxel.value)).sum();
    value.is_finite().then(|| NamedValue::new("value", value))
}

/// The label around a place on the surface of a region: the one that most of the voxels about it have, by their shares. 0 is nothing.
fn of_labels(grid: &Grid, place: DVec3, labels: Option<&ObjectLabels>) -> Option<NamedValue> {
    // Places are those of coarse pictures, which are a little off.
    let voxels = voxels_about(grid, place, 1.0)?;
    let share_of =
        |label: f32| -> f64 { voxels.iter().filter(|voxel| voxel.value == label).map(|voxel| voxel.weight).sum() };
    let regions = voxels.iter().map(|voxel| voxel.value).filter(|label| *label > 0.0);
    let label = regions.max_by(|a, b| share_of(*a).total_cmp(&share_of(*b)))?;
    let meaning = labels.and_then(|labels| labels.table.name(f64::from(label))).map(str::to_owned);
    Some(NamedValue { meaning, ..NamedValue::new("label", f64::from(label)) })
}

/// The numbers of the nearest point.
fn of_points(points: &RawPoints, place: DVec3) -> Vec<NamedValue> {
    let place = (place - points.origin).as_vec3();
    let distance = |(rank, position): (usize, &splat_core::glam::Vec3)| (rank, position.distance_squared(place));
    let nearest = points.position.iter().enumerate().map(distance).min_by(|a, b| a.1.total_cmp(&b.1));
    let Some((rank, _)) = nearest else { return Vec::new() };
    let of_columns = points.columns.iter().filter_map(|column| Some((column.name.clone(), *column.values.get(rank)?)));
    let scalar = points.value.get(rank).map(|value| (points.value_name().to_owned(), f64::from(*value)));
    let class = points.classification.get(rank).map(|class| ("classification".to_owned(), f64::from(*class)));
    let named = of_columns.chain(scalar).chain(class).filter(|(_, value)| value.is_finite());
    named.map(|(name, value)| NamedValue::new(name, value)).take(MOST_COLUMNS).collect()
}

/// What lies below a place of the picture.
pub(crate) fn below(
    place: PicturePlace,
    scene: &Scene,
    depths: &Depths,
    whole: Option<&Drawn>,
    data: impl Fn(&str) -> Option<DataOfObject>,
) -> Below {
    let (layer, numbers) = whole.and_then(|whole| whole.number_at(place)).unwrap_or_default();
    let position = depths.point_at(place);
    let object = position.and_then(|_| scene.objects.get(depths.object_at(place)?));
    let values = object
        .zip(position)
        .and_then(|(object, position)| Some(data(&object.name)?.at(object, position)))
        .unwrap_or_default();
    Below {
        layer,
        numbers,
        depth: depths.depth_at(place),
        position: position.map(DVec3::into),
        object: object.map(|object| object.name.clone()),
        file_place: object.zip(position).and_then(|(object, position)| FilePlace::new(object, position)),
        values,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use splat_core::glam::{DMat3, Vec3};

    #[test]
    fn a_volume_is_linear_between_its_voxels() {
        // The value is i + 10 j + 100 k.
        let value = |n: usize| (n % 2 + 10 * (n / 2 % 2) + 100 * (n / 4)) as f32;
        let grid = Grid {
            origin: DVec3::new(1.0, 2.0, 3.0),
            axes: DMat3::from_diagonal(DVec3::splat(0.5)),
            dims: [2, 2, 2],
            values: (0..8).map(value).collect(),
        };
        let found = of_volume(&grid, DVec3::new(1.25, 2.5, 3.125)).unwrap();
        assert!((found.value - (0.5 + 10.0 + 25.0)).abs() < 1e-12);
        assert_eq!(of_volume(&grid, DVec3::ZERO), None);
    }

    #[test]
    fn a_label_is_that_of_the_region_and_never_between_two() {
        // Nothing, label 3 from x = 1 on, label 8 from x = 3 on.
        let value = |n: usize| [0.0, 3.0, 3.0, 8.0][n % 4];
        let grid =
            Grid { origin: DVec3::ZERO, axes: DMat3::IDENTITY, dims: [4, 2, 2], values: (0..16).map(value).collect() };
        let label_at = |x: f64| of_labels(&grid, DVec3::new(x, 0.5, 0.5), None).map(|found| found.value);
        let found = [-0.9, 0.1, 0.5, 2.0, 2.4, 2.6].map(label_at);
        assert_eq!(found, [None, Some(3.0), Some(3.0), Some(3.0), Some(3.0), Some(8.0)]);
    }

    #[test]
    fn points_tell_the_columns_of_the_nearest() {
        let points = RawPoints {
            position: vec![Vec3::ZERO, Vec3::X],
            value: vec![5.0, 7.0],
            columns: vec![splat_core::Column { name: "height".into(), values: vec![1.5, f64::NAN] }],
            ..RawPoints::default()
        };
        let values_at = |x| of_points(&points, DVec3::new(x, 0.1, 0.0)).iter().map(|v| v.value).collect::<Vec<_>>();
        assert_eq!((values_at(0.2), values_at(0.9)), (vec![1.5, 5.0], vec![7.0]));
    }
}
