//! Orders to compare with: one comparison sort by centres, as in most splatters, and no sort.

use splat_core::glam::Vec3;
use splat_core::{Camera, Cloud, SliceOrder};

/// The distance by which [`by_centre`] compares splats.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CentreKey {
    /// The view depth of the centre.
    Depth,
    /// The distance of the centre from the camera.
    Distance,
}

/// The splats `ids` of a cloud from near to far by one comparison sort of their centres, then by id, as one slice. Nothing is
/// culled.
///
/// ```
/// use hbsort::comparison::{CentreKey, by_centre};
/// use splat_core::{Camera, Cloud, Projection, Splat, glam::{DVec3, Vec3}};
/// let mut cloud = Cloud::new(DVec3::ZERO);
/// for position in [Vec3::new(3.0, 0.0, 1.0), Vec3::ZERO] {
///     cloud.push(&Splat { position, radius: 0.1, ..Splat::default() });
/// }
/// let view = Projection::Perspective { fov_y: 1.5 };
/// let camera = Camera::look_at(DVec3::Z * 2.0, DVec3::ZERO, DVec3::Y, view, [64, 64]).unwrap();
/// // The first is less deep, and farther away.
/// assert_eq!(by_centre(&cloud, &[0, 1], &camera, CentreKey::Depth).input_from_sorted, [0, 1]);
/// assert_eq!(by_centre(&cloud, &[0, 1], &camera, CentreKey::Distance).input_from_sorted, [1, 0]);
/// ```
pub fn by_centre(cloud: &Cloud, ids: &[u32], camera: &Camera, key: CentreKey) -> SliceOrder {
    let view = camera.view_from_offset(cloud.origin);
    let key_of = |p: Vec3| match key {
        CentreKey::Depth => f64::from(p.z),
        CentreKey::Distance => p.as_dvec3().length_squared(),
    };
    let keyed = ids.iter().map(|&i| (key_of(view.apply(cloud.position[i as usize])), i));
    let mut keyed: Vec<(f64, u32)> = keyed.collect();
    keyed.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    as_given(keyed.into_iter().map(|k| k.1).collect())
}

/// The splats `ids` in the order in which they are given, as one slice.
pub fn as_given(ids: Vec<u32>) -> SliceOrder {
    let slice_starts = vec![0, ids.len() as u32];
    SliceOrder { slice_starts, slice_indices: vec![0], input_from_sorted: ids, slices: 1, ..SliceOrder::default() }
}
