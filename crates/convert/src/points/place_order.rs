//! The order of raw points along a Morton curve, so that the order of their file does not matter.

use crate::common::columns::CHUNK;
use rayon::prelude::*;
use splat_core::glam::{DVec3, Vec3};
use splat_core::{Aabb, Column, RawPoints};
use std::cmp::Ordering;

/// Ids by place (along a Morton curve), then by attributes: the order of the file does not matter.
pub(crate) fn canonical_order(points: &RawPoints) -> Vec<u32> {
    let bounds = Aabb::of_points(&points.position);
    let extent = (bounds.max - bounds.min).max_element().max(f32::MIN_POSITIVE);
    let mut keys: Vec<(u64, u32)> = points
        .position
        .par_iter()
        .enumerate()
        .with_min_len(CHUNK)
        .map(|(i, p)| (morton((p.as_dvec3() - bounds.min.as_dvec3()) / f64::from(extent)), i as u32))
        .collect();
    keys.par_sort_unstable_by(|a, b| a.0.cmp(&b.0).then_with(|| compare(points, a.1 as usize, b.1 as usize)));
    keys.into_iter().map(|k| k.1).collect()
}

pub(crate) fn compare(points: &RawPoints, a: usize, b: usize) -> Ordering {
    let bits = |v: Vec3| v.to_array().map(f32::to_bits);
    let place = |i: usize| points.position[i].to_array().map(|c| (c + 0.0).to_bits());
    let attributes = |i: usize| {
        let color = points.color.get(i).map(|c| c.map(f32::to_bits));
        let number = |column: &[f32]| column.get(i).map(|v| v.to_bits());
        (points.normal.get(i).map(|n| bits(*n)), color, number(&points.value), number(&points.opacity))
    };
    let further = || {
        let differ = |c: &Column| c.values[a].total_cmp(&c.values[b]);
        points.columns.iter().map(differ).fold(Ordering::Equal, Ordering::then)
    };
    place(a).cmp(&place(b)).then_with(|| attributes(a).cmp(&attributes(b))).then_with(further).then(a.cmp(&b))
}

/// 21 bits an axis of a place in the unit cube.
fn morton(p: DVec3) -> u64 {
    let spread = |v: f64| {
        let mut v = ((v * f64::from(1u32 << 21)) as u64).min((1 << 21) - 1);
        v = (v | v << 32) & 0x001f_0000_0000_ffff;
        v = (v | v << 16) & 0x001f_0000_ff00_00ff;
        v = (v | v << 8) & 0x100f_00f0_0f00_f00f;
        v = (v | v << 4) & 0x10c3_0c30_c30c_30c3;
        (v | v << 2) & 0x1249_2492_4924_9249
    };
    spread(p.x) | spread(p.y) << 1 | spread(p.z) << 2
}

/// The distinct places in order, and where the points of each begin in `order` (then the number of points).
pub(crate) fn distinct_places(points: &RawPoints, order: &[u32]) -> (Vec<Vec3>, Vec<u32>) {
    let mut distinct: Vec<Vec3> = order.par_iter().with_min_len(CHUNK).map(|i| points.position[*i as usize]).collect();
    let is_first = |s: &usize| *s == 0 || distinct[*s] != distinct[*s - 1];
    let mut starts: Vec<u32> = (0..order.len()).filter(is_first).map(|s| s as u32).collect();
    starts.push(order.len() as u32);
    distinct.dedup();
    (distinct, starts)
}
