//! Opaque discs end a list: per cell the nearest distance at which the cell's ray meets one.
//!
//! The disc has the area that the splat stands for, dilated so that neighbours leave no holes, and is met on the ray of
//! the cell's centre at the distance of its tangent plane. The least distance does not depend on the order of writing.

use crate::caster::Caster;
use crate::mapping::{Mapping, floor};
use crate::overlap::Spread;
use crate::sampling::{NEAR, disc_coordinate};
use glam::Vec2;
use splat_core::glam;
use std::sync::atomic::{AtomicU32, Ordering::Relaxed};

/// Distances as bits, which are monotone for positive floats.
#[derive(Debug)]
pub(crate) struct OpaqueDepth {
    bits: Vec<AtomicU32>,
}

impl OpaqueDepth {
    /// Nothing in any of `cells` cells.
    pub(crate) fn new(cells: usize) -> Self {
        Self { bits: (0..cells).map(|_| AtomicU32::new(f32::INFINITY.to_bits())).collect() }
    }

    /// Distances, infinite where no disc is met.
    pub(crate) fn into_distances(self) -> Vec<f32> {
        self.bits.into_iter().map(|b| f32::from_bits(b.into_inner())).collect()
    }

    /// Enters one disc.
    #[inline(always)]
    pub(crate) fn add<M: Mapping>(&self, mapping: &M, caster: &Caster) {
        let [columns, rows] = mapping.size().map(|n| n as i32);
        if !mapping.is_parallel() && caster.radius > NEAR * caster.distance {
            (0..(columns * rows) as u32).for_each(|cell| self.meet(mapping, caster, cell));
            return;
        }
        let Some(place) = mapping.locate(caster.position) else { return };
        let half = Spread::new(caster, mapping.gradients(caster.position)).half_extents();
        // Beyond its first derivative a map bends by about the angle that the disc spans.
        let bend = if mapping.is_parallel() { 1.0 } else { 1.0 + caster.radius / caster.distance };
        let folded = mapping.is_folded() && half.max_element() > 0.25;
        let reach = if folded { Vec2::splat(half.max_element()) } else { half } * bend + 1e-3;
        let span = |centre: f32, reach: f32, n: i32| {
            if 2.0 * reach >= n as f32 {
                return 0..n;
            }
            -floor(reach + 0.5 - centre)..floor(centre + reach - 0.5) + 1
        };
        let us = span(place.at.x, reach.x, columns);
        for row in span(place.at.y, reach.y, rows) {
            for column in us.clone() {
                if let Some(cell) = mapping.wrap(column, row) {
                    self.meet(mapping, caster, cell);
                }
            }
        }
    }

    #[inline(always)]
    fn meet<M: Mapping>(&self, mapping: &M, caster: &Caster, cell: u32) {
        let ray = mapping.cell_ray(cell);
        let t = (caster.position - ray.base).dot(caster.normal) / ray.direction.dot(caster.normal);
        let hit = ray.base + ray.direction * t - caster.position;
        if t > 0.0 && t.is_finite() && disc_coordinate(caster, hit) <= 1.0 {
            let nearest = &self.bits[cell as usize];
            // Most discs lie behind another: reading is cheaper than an atomic minimum.
            if t.to_bits() < nearest.load(Relaxed) {
                nearest.fetch_min(t.to_bits(), Relaxed);
            }
        }
    }
}
