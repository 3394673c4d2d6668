//! The slow and obvious forms in f64: slices by a full sort, one comparison sort by centres, and the paper's own two levels of
//! buckets.

use crate::Params;
use splat_core::glam::Vec3;
use splat_core::{Camera, Cloud, Direction, Projection, SliceOrder, ViewTransform};

/// Slices of ready depths: each with its index counted from near and its ids, in the order in which they are drawn.
/// Inside a slice by depth, then id, when `params.exact`, else by id. `thickness` is ε.
pub fn slices(depth: &[f32], thickness: f64, params: &Params) -> Vec<(u64, Vec<u32>)> {
    let near = depth.iter().copied().fold(f32::INFINITY, f32::min);
    let far = depth.iter().copied().fold(f32::NEG_INFINITY, f32::max);
    let count = (((f64::from(far) - f64::from(near)) * (1.0 / thickness)).ceil() as u64).max(1);
    let slice_of = |d: f32| (((f64::from(d) - f64::from(near)) * (1.0 / thickness)) as u64).min(count - 1);
    let back = params.direction == Direction::BackToFront;
    let mut ids: Vec<u32> = (0..depth.len() as u32).collect();
    ids.sort_by(|&a, &b| {
        let x = depth[a as usize];
        let y = depth[b as usize];
        let by_slice = slice_of(x).cmp(&slice_of(y));
        // Depths are compared as numbers: −0 and +0 are equal, and the id decides.
        let by_depth = if params.exact { f64::from(x).partial_cmp(&f64::from(y)) } else { None };
        let order = by_slice.then(by_depth.unwrap_or(std::cmp::Ordering::Equal));
        (if back { order.reverse() } else { order }).then(a.cmp(&b))
    });
    let mut slices: Vec<(u64, Vec<u32>)> = Vec::new();
    for id in ids {
        let slice = slice_of(depth[id as usize]);
        match slices.last_mut() {
            Some((last, ids)) if *last == slice => ids.push(id),
            _ => slices.push((slice, vec![id])),
        }
    }
    slices
}

/// What splats are compared by in [`by_centre`].
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
/// use hbsort::reference::{CentreKey, by_centre};
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
    let of = |p: Vec3| match key {
        CentreKey::Depth => f64::from(p.z),
        CentreKey::Distance => p.as_dvec3().length_squared(),
    };
    let keyed = ids.iter().map(|&i| (of(view.apply(cloud.position[i as usize])), i));
    let mut keyed: Vec<(f64, u32)> = keyed.collect();
    keyed.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    as_given(keyed.into_iter().map(|k| k.1).collect())
}

/// The splats `ids` in the order in which they are given, as one slice.
pub fn as_given(ids: Vec<u32>) -> SliceOrder {
    let slice_starts = vec![0, ids.len() as u32];
    SliceOrder { slice_starts, slice_indices: vec![0], input_from_sorted: ids, slices: 1, ..SliceOrder::default() }
}

/// Whether any part of splat `i`'s sphere lies inside the view, in f64: `margin` is the distance in world units by
/// which it does (negative: by which it does not).
pub fn margin_inside(cloud: &Cloud, i: usize, camera: &Camera) -> f64 {
    let view: ViewTransform = camera.view_from_offset(cloud.origin);
    let p = view.apply(cloud.position[i]).as_dvec3();
    let radius = f64::from(cloud.radius[i].max(cloud.tangent_of(i).length()));
    let side = |offset: f64, size: u32| {
        let extent = 0.5 * f64::from(size) / camera.focal_px();
        match camera.projection {
            // Distance to the plane through the eye whose slope is `extent`.
            Projection::Perspective { .. } => (p.z * extent - offset.abs()) / extent.hypot(1.0),
            Projection::Orthographic { .. } => extent - offset.abs(),
        }
    };
    side(p.x, camera.size[0]).min(side(p.y, camera.size[1])).min(p.z) + radius
}

/// What the paper's Eqs. 10-13 give when they are followed to the letter.
#[derive(Debug, Clone, PartialEq)]
pub struct PaperBuckets {
    /// N of Eq. 11.
    pub buckets: u64,
    /// Splats whose second-level index falls outside \[0, N), which the paper does not foresee.
    pub out_of_range: u64,
    /// Ids from near to far, the second index clamped to its range.
    pub order: Vec<u32>,
}

/// The paper's two levels, from near to far: the first divides far − near by N, the second takes a first-level bucket
/// for ε·N wide. Nothing is shared with the sort itself.
pub fn paper_buckets(depth: &[f64], near: f64, far: f64, thickness: f64) -> PaperBuckets {
    let buckets = ((far - near) / thickness).sqrt().ceil();
    let mut out_of_range = 0;
    let mut keyed: Vec<([i64; 2], u32)> = (0u32..)
        .zip(depth)
        .map(|(id, d)| {
            let first = (buckets * (d - near) / (far - near)).floor().min(buckets - 1.0);
            let width = thickness * buckets;
            let second = (buckets * (d - (near + width * first)) / width).floor();
            out_of_range += u64::from(!(0.0..buckets).contains(&second));
            ([first as i64, second.clamp(0.0, buckets - 1.0) as i64], id)
        })
        .collect();
    keyed.sort();
    let order = keyed.into_iter().map(|(_, id)| id).collect();
    PaperBuckets { buckets: buckets as u64, out_of_range, order }
}

/// The furthest that a splat stands in front of one that was drawn before it, from near to far, in units of depth.
pub fn greatest_inversion(depth: &[f64], near_to_far: &[u32]) -> f64 {
    let mut farthest = f64::NEG_INFINITY;
    let mut worst = 0.0f64;
    for &id in near_to_far {
        worst = worst.max(farthest - depth[id as usize]);
        farthest = farthest.max(depth[id as usize]);
    }
    worst
}
