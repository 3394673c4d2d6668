//! The slow and obvious forms in f64: slices by a full sort, and the paper's two levels of buckets.

use crate::Params;
use splat_core::{Camera, Cloud, Direction, Projection, ViewTransform};

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

/// Buckets of the paper's Eqs. 10-13, followed to the letter.
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
