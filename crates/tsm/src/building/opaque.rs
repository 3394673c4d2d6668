//! Opaque discs end a list: per cell the nearest distance at which the cell's ray meets one.
//!
//! The disc has the area that the splat stands for, dilated so that neighbours leave no holes, and is met on the ray of
//! the cell's centre at the distance of its tangent plane. The least distance does not depend on the order of writing.
//! Discs of few cells away from the table's edges are met side by side ([`crate::building::lanes`]), with the same arithmetic.

use crate::building::caster::{Caster, Casters};
use crate::building::discs::Discs;
use crate::building::lanes::{Columns, LANES, Lane, Queue, Queues, batches};
use crate::building::overlap::Spread;
use crate::building::sampling::{NEAR, disc_coordinate};
use crate::frame::Frame;
use crate::mapping::{Mapping, Ray, floor};
use glam::{Vec2, Vec3};
use splat_core::glam;
use std::sync::atomic::{AtomicU32, Ordering::Relaxed};

/// Most cells along a side of a disc that goes side by side with others.
const MOST: f32 = 8.0;

/// Columns of a disc on the table: position, normal, semi-axes, first cell, number of cells.
const POSITION: usize = 0;
const NORMAL: usize = 3;
const AXES: usize = 6;
const FIRST: usize = 12;
const CELLS: usize = 14;
const COUNT: usize = 16;

/// Distances as bits, which are monotone for positive floats.
#[derive(Debug)]
pub(crate) struct OpaqueDepth {
    bits: Vec<AtomicU32>,
}

/// Discs of one worker on their way to the table.
#[derive(Debug, Default)]
pub(crate) struct DiscBatches {
    /// Splats of a chunk, and those that are met one by one.
    ids: [Vec<u32>; 2],
    discs: Discs,
    windows: Columns<COUNT>,
    queues: Queues<COUNT>,
}

/// How far a disc's footprint reaches from its place, in cells: its first derivatives and how the map bends beyond them.
#[inline(always)]
fn reach_of<M: Mapping>(mapping: &M, spread: Spread, angle: f32) -> Vec2 {
    let half = spread.half_extents();
    // Beyond its first derivative a map bends by about the angle that the disc spans.
    let bend = if mapping.is_parallel() { 1.0 } else { 1.0 + angle };
    let folded = mapping.is_folded() & (half.max_element() > 0.25);
    (if folded { Vec2::splat(half.max_element()) } else { half }) * bend + 1e-3
}

/// First and last cell whose centre lies within `reach` of `centre`.
#[inline(always)]
fn cells_within(centre: f32, reach: f32) -> [i32; 2] {
    [0i32.wrapping_sub(floor(reach + 0.5 - centre)), floor(centre + reach - 0.5)]
}

/// Distance along a ray to the disc, if it is met.
#[inline(always)]
fn distance_to(ray: &Ray, position: Vec3, normal: Vec3, axes: [Vec3; 2]) -> (f32, bool) {
    let t = (position - ray.base).dot(normal) / ray.direction.dot(normal);
    let hit = ray.base + ray.direction * t - position;
    (t, (t > 0.0) & (t < f32::INFINITY) & (disc_coordinate(axes, hit) <= 1.0))
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

    /// Enters the discs of opaque splats.
    #[inline(always)]
    pub(crate) fn add_all<M: Mapping>(
        &self,
        mapping: &M,
        casters: &Casters<'_>,
        frame: &Frame,
        splats: impl Iterator<Item = u32>,
        work: &mut DiscBatches,
    ) {
        let DiscBatches { ids: [ids, others], discs, windows, queues } = work;
        ids.clear();
        others.clear();
        ids.extend(splats);
        for batch in batches(ids) {
            discs.load(casters, batch, frame, true);
            fill(windows, mapping, discs);
            queues.push(windows, batch, others);
            for queue in queues.ready(batch.is_empty()) {
                self.meet_all(mapping, queue);
                queue.advance();
            }
        }
        for &i in &*others {
            self.add(mapping, &casters.get(i as usize, frame, mapping.is_parallel()));
        }
    }

    /// Enters one disc.
    #[inline(always)]
    fn add<M: Mapping>(&self, mapping: &M, caster: &Caster) {
        let [columns, rows] = mapping.size().map(|n| n as i32);
        if !mapping.is_parallel() && caster.radius > NEAR * caster.distance {
            (0..(columns * rows) as u32).for_each(|cell| self.meet(mapping, caster, cell));
            return;
        }
        let Some(place) = mapping.locate(caster.position) else { return };
        let spread = Spread::new(caster, mapping.gradients(caster.position));
        let reach = reach_of(mapping, spread, caster.radius / caster.distance);
        let span = |centre: f32, reach: f32, n: i32| {
            if 2.0 * reach >= n as f32 {
                return 0..n;
            }
            let [first, last] = cells_within(centre, reach);
            first..last + 1
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
        let (t, is_met) = distance_to(&mapping.cell_ray(cell), caster.position, caster.normal, caster.axes);
        if is_met {
            self.lower(cell, t.to_bits());
        }
    }

    /// Takes the lesser of a cell's distance and `bits`.
    #[inline(always)]
    fn lower(&self, cell: u32, bits: u32) {
        // Most discs lie behind another: reading is cheaper than an atomic minimum.
        if let Some(nearest) = self.bits.get(cell as usize).filter(|nearest| bits < nearest.load(Relaxed)) {
            nearest.fetch_min(bits, Relaxed);
        }
    }

    /// The first discs of a queue, cell by cell of their windows.
    #[inline(always)]
    fn meet_all<M: Mapping>(&self, mapping: &M, queue: &Queue<COUNT>) {
        let width = mapping.size()[0];
        let read = |first: usize, l: usize| Vec3::from_array([0, 1, 2].map(|k| queue.column(first + k)[l]));
        let most = |f: usize| floor(queue.column(f)[..queue.lanes()].iter().fold(0.0, |most: f32, n| most.max(*n)));
        let [us, vs] = [0, 1].map(|k| queue.column(FIRST + k));
        let [nu, nv] = [0, 1].map(|k| queue.column(CELLS + k));
        let [width_most, height_most] = [most(CELLS), most(CELLS + 1)];
        for (j, k) in (0..height_most).flat_map(|j| (0..width_most).map(move |k| (j, k))) {
            let mut cell: Lane<u32> = [0; LANES];
            let mut bits: Lane<u32> = [u32::MAX; LANES];
            // Rays first: some come from a table, which is no work for vectors.
            let mut rays = [Ray { base: Vec3::ZERO, direction: Vec3::Z }; LANES];
            for l in 0..LANES {
                let column = (floor(us[l]) + k) as u32;
                let row = (floor(vs[l]) + j) as u32;
                rays[l] = mapping.ray_of(column, row);
                cell[l] = row.wrapping_mul(width).wrapping_add(column);
            }
            for l in 0..LANES {
                let axes = [read(AXES, l), read(AXES + 3, l)];
                let (t, is_met) = distance_to(&rays[l], read(POSITION, l), read(NORMAL, l), axes);
                let is_inside = ((k as f32) < nu[l]) & ((j as f32) < nv[l]);
                bits[l] = if is_met & is_inside { t.to_bits() } else { u32::MAX };
            }
            cell[..queue.lanes()].iter().zip(bits).for_each(|(cell, bits)| self.lower(*cell, bits));
        }
    }
}

/// Which cells discs may cover.
#[inline(always)]
fn fill<M: Mapping>(windows: &mut Columns<COUNT>, mapping: &M, discs: &Discs) {
    let parallel = mapping.is_parallel();
    let [columns, rows] = mapping.size().map(|n| n as i32);
    for l in 0..LANES {
        let position = discs.position(l);
        let axes = discs.axes(l);
        let radius = discs.radius(l);
        let view = mapping.view(position);
        let at = view.place.at;
        let distance = view.place.distance;
        let is_far = parallel | (radius <= NEAR * distance);
        let reach = reach_of(mapping, Spread::of_disc(axes, view.gradients), radius / distance);
        let is_small = (reach.x < 0.5 * MOST) & (reach.y < 0.5 * MOST);
        let [u, v] = [cells_within(at.x, reach.x), cells_within(at.y, reach.y)];
        let is_inside = (u[0] >= 0) & (v[0] >= 0) & (u[1] < columns) & (v[1] < rows);
        let [nu, nv] = [u, v].map(|[first, last]| last.wrapping_sub(first).wrapping_add(1).max(0));
        let is_plain = view.is_seen & is_far & is_small & is_inside;
        windows.side[l] = if is_plain { if nu.min(nv) > 0 { nu.max(nv) } else { 0 } } else { -1 };
        windows.set(POSITION, l, position.to_array());
        windows.set(NORMAL, l, discs.normal(l).to_array());
        windows.set(AXES, l, axes[0].to_array());
        windows.set(AXES + 3, l, axes[1].to_array());
        windows.set(FIRST, l, [u[0] as f32, v[0] as f32, nu as f32, nv as f32]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Params;
    use crate::mapping::{Octahedral, Planar};
    use splat_core::glam::DVec3;
    use splat_core::{Cloud, Splat, SplatKind, rng};

    fn compare<M: Mapping>(mapping: &M) {
        let mut cloud = Cloud::new(DVec3::ZERO);
        for i in 0..1000 {
            let number = |k| rng::unit_f32(22, 0, i, k);
            let position = Vec3::new(number(0) - 0.5, number(1) - 0.5, number(2) - 0.1);
            let normal = Vec3::new(number(3) - 0.5, number(4) - 0.5, number(5) - 0.5).normalize();
            let tangent = normal.any_orthonormal_vector() * if i % 2 == 0 { 0.0 } else { 0.02 * number(6) };
            let radius = 0.005 + 0.05 * number(7);
            let cross_section = 0.003 * number(8);
            cloud.push(&Splat {
                position,
                radius,
                cross_section,
                kind: SplatKind::Opaque,
                normal,
                tangent,
                ..Splat::default()
            });
        }
        let params = Params::default();
        let casters = Casters::new(&crate::Scene::from(&cloud), &params);
        let frame = Frame::new(DVec3::ZERO, [DVec3::X, DVec3::Y, DVec3::Z], 1.0);
        let cells = mapping.size()[0] as usize * mapping.size()[1] as usize;
        let [together, single] = [(); 2].map(|()| OpaqueDepth::new(cells));
        let mut work = DiscBatches::default();
        together.add_all(mapping, &casters, &frame, 0..1000, &mut work);
        let alone = work.ids[1].len();
        (0..1000).for_each(|i| single.add(mapping, &casters.get(i, &frame, mapping.is_parallel())));
        let [together, single] = [together, single].map(OpaqueDepth::into_distances);
        assert!(single.iter().filter(|d| d.is_finite()).count() > 100);
        assert!(together == single && alone < 800, "{alone} alone");
    }

    #[test]
    fn discs_leave_the_same_bits_side_by_side_and_one_by_one() {
        let planar = |perspective| Planar { min: Vec2::NEG_ONE * 1.5, cell: 0.05, size: [60, 60], perspective };
        compare(&Octahedral::new(48));
        compare(&planar(true));
        compare(&planar(false));
    }
}
