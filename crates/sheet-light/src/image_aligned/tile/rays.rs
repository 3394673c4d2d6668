//! The rays of one tile: where each enters and leaves a volume, how long it is per unit of view depth.

use super::size::{AREA, SIDE, TILE};
use crate::image_aligned::gather::{GROUP, GROUPS};
use crate::image_aligned::slant::Slant;
use crate::shared::depths::DepthRange;
use crate::shared::lattice::rays::{LatticeRays, ViewRay};
use crate::shared::pixel::Pixel;
use crate::shared::slabs::Slabs;
use splat_core::Camera;
use splat_core::glam::DVec3;
use splat_core::raster::lanes::{Broadcast, Lanes, MAX_LANES};
use splat_core::raster::pulp::Simd;
use std::ops::Range;

/// View depths between which each ray is inside, counted from the first slab; beyond each other where it is not. The rim of the
/// tile is included.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Crossings {
    pub(crate) near: Vec<f32>,
    pub(crate) far: Vec<f32>,
    /// The nearest and the farthest of these of the neighbours that are read together, row by row; beyond each other where none is inside.
    pub(crate) groups: Vec<DepthRange>,
    /// Depths between which all of these are inside.
    pub(crate) wholes: Vec<DepthRange>,
}

/// The rays of a tile with its rim: x and y per unit of view depth in perspective, or where they are if they are parallel.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Slopes {
    /// By column.
    pub(crate) u: [f32; SIDE + MAX_LANES],
    /// By row.
    pub(crate) v: [f32; SIDE],
    x: [f64; SIDE],
    y: [f64; SIDE],
    /// Where rays cross the first slab, by column and by row.
    start: [[f32; SIDE + MAX_LANES]; 2],
    is_parallel: bool,
    /// Of slabs that do not lie across the view; rays are parallel then.
    pub(crate) slant: Slant,
}

impl Slopes {
    /// Those of the tile at `corner`, the first slab at a view depth of `origin`.
    pub(crate) fn new(camera: &Camera, corner: [usize; 2], origin: f64, slant: Slant) -> Self {
        let is_parallel = camera.is_orthographic();
        let slope = |v: usize, a: usize| {
            let px = (corner[a] + v) as f64 - 0.5;
            let ray = ViewRay::through(camera, px, px);
            (if is_parallel { ray.from } else { ray.along })[a]
        };
        let x: [f64; SIDE] = std::array::from_fn(|v| slope(v, 0));
        let y: [f64; SIDE] = std::array::from_fn(|v| slope(v, 1));
        let column = |v: usize| x.get(v).map_or(0.0, |x| *x as f32);
        let reach = if is_parallel { 1.0 } else { origin };
        let start =
            [&x, &y].map(|slope| std::array::from_fn(|v| slope.get(v).map_or(0.0, |slope| (slope * reach) as f32)));
        Self { u: std::array::from_fn(column), v: y.map(|y| y as f32), x, y, start, is_parallel, slant }
    }

    /// View positions on neighbouring rays, depths counted from the first slab.
    #[inline(always)]
    pub(crate) fn places<S: Simd>(&self, simd: S, first: Pixel, depth: Lanes<S>) -> [Lanes<S>; 3] {
        let Pixel { x, y } = first;
        let start = [Lanes::load(simd, &self.start[0][x..]), simd.lanes(self.start[1][y])];
        if self.slant.is_any() {
            let [sx, sy] = self.slant.single();
            let [sx, sy] = [simd.lanes(sx), simd.lanes(sy)];
            return [start[0], start[1], depth - (sx * start[0] + sy * start[1])];
        }
        if self.is_parallel {
            return [start[0], start[1], depth];
        }
        let [u, v] = [Lanes::load(simd, &self.u[x..]), simd.lanes(self.v[y])];
        [u.mul_add(depth, start[0]), v.mul_add(depth, start[1]), depth]
    }

    /// From view depths to depths of slabs, of a ray.
    pub(crate) fn offset(&self, x: usize, y: usize) -> f64 {
        self.slant.offset(self.x[x], self.y[y])
    }

    /// Makes view depths of the tile's pixels, without its rim, depths of slabs.
    pub(crate) fn shear(&self, depths: [&mut [f32]; 2]) {
        for depths in depths {
            for (at, depth) in depths.iter_mut().enumerate() {
                *depth += self.offset(at % TILE + 1, at / TILE + 1) as f32;
            }
        }
    }

    /// Makes depths of slabs of neighbouring pixels, from `first` of the tile with its rim on, view depths.
    pub(crate) fn unshear(&self, first: Pixel, depths: [&mut [f32; MAX_LANES]; 2]) {
        let Pixel { x, y } = first;
        for depths in depths {
            for (lane, depth) in depths.iter_mut().enumerate().take_while(|(lane, _)| x + lane < SIDE) {
                *depth -= self.offset(x + lane, y) as f32;
            }
        }
    }

    /// View-space origin and direction of a ray, as [`Camera::view_ray`] has them.
    pub(crate) fn ray(&self, x: usize, y: usize) -> ViewRay {
        let across = DVec3::new(self.x[x], self.y[y], 0.0);
        if self.is_parallel {
            ViewRay { from: across, along: DVec3::Z }
        } else {
            ViewRay { from: DVec3::ZERO, along: across + DVec3::Z }
        }
    }
}

impl Crossings {
    pub(crate) fn new() -> Self {
        let depths = vec![0.0; AREA + MAX_LANES];
        let groups = vec![DepthRange { near: 0.0, far: 0.0 }; SIDE * GROUPS];
        Self { near: depths.clone(), far: depths, wholes: groups.clone(), groups }
    }

    /// The slabs between the nearest and the farthest place that any ray is inside at.
    pub(crate) fn slabs(&self, slabs: &Slabs) -> Range<u32> {
        let mut near = f32::INFINITY;
        let mut far = f32::NEG_INFINITY;
        for (from, to) in self.near[..AREA].iter().zip(&self.far[..AREA]).filter(|(from, to)| from < to) {
            (near, far) = (near.min(*from), far.max(*to));
        }
        if near > far {
            return 0..0;
        }
        let slab = |depth: f32| (f64::from(depth) / slabs.width).clamp(0.0, f64::from(slabs.count - 1)) as u32;
        slab(near)..slab(far) + 1
    }

    /// Those of a tile, in the slabs of a volume.
    pub(crate) fn of_tile(&mut self, rays: &LatticeRays, slopes: &Slopes, slabs: &Slabs) {
        for y in 0..SIDE {
            for x in 0..SIDE {
                let offset = slopes.offset(x, y);
                let crossing = rays.crossing(slopes.ray(x, y));
                let [near, far] = crossing.map(|depth| slopes.slant.snapped(depth + offset, slabs));
                (self.near[y * SIDE + x], self.far[y * SIDE + x]) = (near as f32, far as f32);
            }
        }
        for (at, (group, whole)) in self.groups.iter_mut().zip(&mut self.wholes).enumerate() {
            let first = at / GROUPS * SIDE + 1 + at % GROUPS * GROUP;
            *group = DepthRange { near: f32::INFINITY, far: f32::NEG_INFINITY };
            *whole = DepthRange { near: f32::NEG_INFINITY, far: f32::INFINITY };
            for (near, far) in self.near[first..first + GROUP].iter().zip(&self.far[first..first + GROUP]) {
                *whole = DepthRange { near: whole.near.max(*near), far: whole.far.min(*far) };
                if near < far {
                    *group = DepthRange { near: group.near.min(*near), far: group.far.max(*far) };
                }
            }
        }
    }
}
