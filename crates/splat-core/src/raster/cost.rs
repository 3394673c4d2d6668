//! What rasterization will take, from the places and sizes of splats alone: for memory that is planned, and for progress.

use super::bins::TILE;
use crate::{Camera, Cloud};
use glam::Vec3;
use rayon::prelude::*;
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};

/// Splats that are counted together.
const CHUNK: usize = 1 << 15;
/// Splats whose footprints stand for all.
const LOOKED_AT: usize = 4096;
/// Splats whose tiles stand for those of all.
const COUNTED: usize = 1 << 18;

/// Bytes of the lists of splats by tile: how many tiles a splat reaches depends on how near it is. Of large clouds splats at even
/// distances in the list stand for all.
pub fn tile_bytes(cloud: &Cloud, camera: &Camera) -> u64 {
    let side = TILE as f32;
    let [columns, rows] = camera.size.map(|s| (s as f32 / side).ceil());
    let view = camera.view_from_offset(cloud.origin);
    let focal = camera.focal_px() as f32;
    let tiles = |(position, radius): (&Vec3, &f32)| {
        let nearest = view.depth(*position) - radius;
        let radius_px = if camera.is_orthographic() {
            radius * focal
        } else if nearest > 0.0 {
            radius * focal / nearest
        } else {
            f32::INFINITY
        };
        // A footprint begins anywhere in a tile.
        let reach = 2.0 * radius_px / side + 1.0;
        let behind = !camera.is_orthographic() && nearest + 2.0 * radius <= 0.0;
        if behind { 0.0 } else { f64::from(reach.min(columns) * reach.min(rows)) }
    };
    let lists = cloud.position.par_chunks(CHUNK).zip(cloud.radius.par_chunks(CHUNK));
    let stride = cloud.len().div_ceil(COUNTED).max(1);
    let counted = |(p, r): (&[Vec3], &[f32])| -> f64 {
        let sampled: f64 = p.iter().zip(r).step_by(stride).map(tiles).sum();
        sampled * p.len() as f64 / p.len().div_ceil(stride) as f64
    };
    let entries: Vec<f64> = lists.map(counted).collect();
    let starts = entries.len() as f64 * f64::from(columns * rows);
    (4.0 * (entries.into_iter().sum::<f64>() + starts)) as u64
}

/// For each of so many objects whether a splat of it may be seen.
pub fn objects_in_view(cloud: &Cloud, camera: &Camera, objects: usize) -> Vec<bool> {
    let seen: Vec<AtomicBool> = (0..objects).map(|_| AtomicBool::new(false)).collect();
    let place = camera.view_from_offset(cloud.origin);
    let columns =
        cloud.object.par_chunks(CHUNK).zip(cloud.position.par_chunks(CHUNK)).zip(cloud.radius.par_chunks(CHUNK));
    columns.for_each(|((objects, positions), radii)| {
        for ((object, position), radius) in objects.iter().zip(positions).zip(radii) {
            let known = &seen[*object as usize];
            // Most objects are found at their first splat.
            if !known.load(Relaxed) && camera.may_see(place.apply(*position).as_dvec3(), f64::from(*radius)) {
                known.store(true, Relaxed);
            }
        }
    });
    seen.into_iter().map(AtomicBool::into_inner).collect()
}

/// Splats in view, and the fragments of their footprints.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Expected {
    /// Splats, those out of view among them.
    pub splats: f64,
    /// Fragments.
    pub fragments: f64,
}

/// What is to be expected of the splats of a cloud that `is_one` says yes to, by their ids; from some at even distances in the list.
pub fn expected(cloud: &Cloud, camera: &Camera, is_one: impl Fn(usize) -> bool) -> Expected {
    let place = camera.view_from_offset(cloud.origin);
    let focal = camera.focal_px();
    let picture = camera.size.iter().map(|s| f64::from(*s)).product::<f64>();
    let footprint = |i: usize| {
        let p = place.apply(cloud.position[i]).as_dvec3();
        let near = if camera.is_orthographic() { 1.0 } else { p.z.max(f64::from(cloud.radius[i])) };
        let radius = focal * f64::from(cloud.radius[i]) / near;
        let at = |v: f64| (focal * v / near).abs() - radius;
        let half = camera.size.map(|s| 0.5 * f64::from(s));
        let seen = p.z > 0.0 && at(p.x) < half[0] && at(p.y) < half[1];
        if seen { (std::f64::consts::PI * radius * radius).max(4.0).min(picture) } else { 0.0 }
    };
    let stride = cloud.len().div_ceil(LOOKED_AT).max(1);
    let mut total = Expected::default();
    for i in (0..cloud.len()).step_by(stride).filter(|i| is_one(*i)) {
        total.splats += stride as f64;
        total.fragments += stride as f64 * footprint(i);
    }
    total
}
