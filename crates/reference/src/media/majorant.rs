//! A coarse grid of majorants: no medium's extinction in a cell exceeds the cell's number, and the walk of a ray through
//! it makes the tentative collisions of delta tracking (Woodcock 1965; local majorants by cell: Szirmay-Kalos 2011).
//!
//! Between cells the walk carries the rest of one exponential number over, so that it is a single Poisson process of
//! the rate that the cells give.

use crate::media::medium::Medium;
use crate::path::random::Stream;
use crate::ray::Ray;
use glam::DVec3;
use rayon::prelude::*;
use splat_core::DAabb;

/// Majorants of several media over their common bounds.
pub(crate) struct MajorantGrid {
    bounds: DAabb,
    dims: [usize; 3],
    cell: DVec3,
    per_cell: DVec3,
    /// Largest extinction over channels, summed over media, 1/world unit.
    majorant: Vec<f64>,
    /// Media of cell i: members[first[i]..first[i + 1]].
    first: Vec<u32>,
    members: Vec<u32>,
}

impl MajorantGrid {
    /// The grid of some media, or `None` when nothing can collide.
    pub(crate) fn new(media: &[Medium<'_>]) -> Option<Self> {
        let some = media.iter().filter(|m| m.largest_extinction() > 0.0);
        let bounds = some.fold(DAabb::EMPTY, |bounds, m| bounds.union(m.density.bounds()));
        if !bounds.is_solid() {
            return None;
        }
        let size = bounds.size();
        let finest = |a: usize| {
            let details = media.iter().map(|m| {
                let share = size[a] / m.density.bounds().size()[a];
                (m.density.detail()[a] as f64 * share).ceil() as usize
            });
            // Several media share cells: a few cells each keep them apart.
            details.max().unwrap_or(1).max(if media.len() > 1 { 16 } else { 1 }).min(64)
        };
        let dims = [finest(0), finest(1), finest(2)];
        let cell = size / DVec3::from_array(dims.map(|d| d as f64));
        let mut out = Self {
            bounds,
            dims,
            cell,
            per_cell: cell.recip(),
            majorant: Vec::new(),
            first: vec![0],
            members: Vec::new(),
        };
        out.fill(media);
        out.majorant.iter().any(|m| *m > 0.0).then_some(out)
    }

    fn fill(&mut self, media: &[Medium<'_>]) {
        let [nx, ny, nz] = self.dims;
        let low = self.bounds.min;
        let cell = self.cell;
        let cells: Vec<(f64, Vec<u32>)> = (0..nx * ny * nz)
            .into_par_iter()
            .map(|i| {
                let at = DVec3::new((i % nx) as f64, (i / nx % ny) as f64, (i / (nx * ny)) as f64);
                // Grown by 2⁻²⁰ of a cell: a point may fall into the neighbour by rounding.
                let guard = cell / 1_048_576.0;
                let bounds = DAabb::new(low + at * cell - guard, low + (at + 1.0) * cell + guard);
                let mut sum = 0.0;
                let mut members = Vec::new();
                for (m, medium) in media.iter().enumerate() {
                    let upper = medium.density.upper(&bounds) * medium.largest_extinction();
                    if upper > 0.0 {
                        sum += upper;
                        members.push(m as u32);
                    }
                }
                (sum, members)
            })
            .collect();
        for (sum, members) in cells {
            self.majorant.push(sum);
            self.members.extend(members);
            self.first.push(self.members.len() as u32);
        }
    }

    /// Media that can collide in a cell.
    #[inline(always)]
    pub(crate) fn members(&self, cell: usize) -> &[u32] {
        &self.members[self.first[cell] as usize..self.first[cell + 1] as usize]
    }

    /// Bounds of all media.
    pub(crate) fn bounds(&self) -> &DAabb {
        &self.bounds
    }

    /// Where a ray enters and leaves the grid between two distances, and its steps from there: [`Ray::clip`] with the
    /// reciprocals shared.
    #[inline(always)]
    fn enter(&self, ray: &Ray, t0: f64, t1: f64) -> Option<(f64, f64, Steps)> {
        let mut enter = t0;
        let mut leave = t1;
        let per = ray.direction.recip();
        for a in 0..3 {
            let p = self.bounds.min[a] - ray.origin[a];
            let q = self.bounds.max[a] - ray.origin[a];
            if ray.direction[a] != 0.0 {
                let p = p * per[a];
                let q = q * per[a];
                enter = enter.max(p.min(q));
                leave = leave.min(p.max(q));
            } else if p > 0.0 || q < 0.0 {
                return None;
            }
        }
        (enter < leave).then(|| (enter, leave, Steps::new(self, ray, per, enter)))
    }

    /// Calls `event` (distance, cell, majorant) at the tentative collisions between `t0` and `t1`, until it says stop.
    #[inline(always)]
    pub(crate) fn walk(
        &self,
        ray: &Ray,
        t0: f64,
        t1: f64,
        rng: &mut Stream,
        mut event: impl FnMut(f64, usize, f64, &mut Stream) -> bool,
    ) {
        let Some((mut t, end, mut steps)) = self.enter(ray, t0, t1) else { return };
        let mut depth = rng.exponential();
        loop {
            let majorant = self.majorant[steps.cell];
            let axis = steps.nearest();
            let leave = steps.next[axis].min(end).max(t);
            if majorant > 0.0 {
                loop {
                    let reached = t + depth / majorant;
                    if reached >= leave {
                        depth -= (leave - t) * majorant;
                        break;
                    }
                    t = reached;
                    if event(t, steps.cell, majorant, rng) {
                        return;
                    }
                    depth = rng.exponential();
                }
            }
            t = leave;
            if t >= end || !steps.advance(axis) {
                return;
            }
        }
    }
}

/// Where a ray stands among the cells (Amanatides and Woo 1987).
struct Steps {
    cell: usize,
    /// Distance of the next cell boundary of each axis.
    next: [f64; 3],
    delta: [f64; 3],
    left: [usize; 3],
    stride: [isize; 3],
}

impl Steps {
    #[inline(always)]
    fn new(grid: &MajorantGrid, ray: &Ray, per: DVec3, t: f64) -> Self {
        let q = (ray.at(t) - grid.bounds.min) * grid.per_cell;
        let strides = [1, grid.dims[0], grid.dims[0] * grid.dims[1]];
        let mut out = Self { cell: 0, next: [f64::INFINITY; 3], delta: [0.0; 3], left: [0; 3], stride: [0; 3] };
        for a in 0..3 {
            let last = grid.dims[a] - 1;
            let i = (q[a].max(0.0) as i32 as usize).min(last);
            out.cell += i * strides[a];
            let d = ray.direction[a];
            if d != 0.0 {
                let edge = grid.bounds.min[a] + (i + usize::from(d > 0.0)) as f64 * grid.cell[a];
                out.next[a] = (edge - ray.origin[a]) * per[a];
                out.delta[a] = grid.cell[a] * per[a].abs();
                out.left[a] = if d > 0.0 { last - i } else { i };
                out.stride[a] = if d > 0.0 { strides[a] as isize } else { -(strides[a] as isize) };
            }
        }
        out
    }

    #[inline(always)]
    fn nearest(&self) -> usize {
        let [x, y, z] = self.next;
        if x <= y {
            if x <= z { 0 } else { 2 }
        } else if y <= z {
            1
        } else {
            2
        }
    }

    /// Steps over the boundary of one axis; false at the rim of the grid.
    #[inline(always)]
    fn advance(&mut self, axis: usize) -> bool {
        if self.left[axis] == 0 {
            return false;
        }
        self.left[axis] -= 1;
        self.cell = self.cell.wrapping_add_signed(self.stride[axis]);
        self.next[axis] += self.delta[axis];
        true
    }
}
