//! The rays of one tile: where each enters and leaves a volume, how long it is per unit of view depth.
//!
//! What a pixel's ray has of the medium in a slab is the length of ray ∩ slab ∩ volume, the volume being a parallelepiped: three
//! pairs of planes in lattice coordinates. Lengths of neighbouring slabs add up to that of the whole, so a constant volume has
//! e^−τ at any slab width and through any lens.

use crate::aligned::Slant;
use crate::slabs::Slabs;
use crate::tile::{AREA, SIDE, TILE};
use crate::volume::Volume;
use splat_core::glam::{DMat3, DVec3};
use splat_core::raster::lanes::{Lanes, MAX_LANES};
use splat_core::raster::pulp::Simd;
use splat_core::{Camera, Clip, Similarity};

/// View depths between which each ray is inside, counted from the first slab; beyond each other where it is not. The rim of the
/// tile is included.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Crossings {
    pub(crate) near: Vec<f32>,
    pub(crate) far: Vec<f32>,
}

/// A volume's lattice coordinates of a view ray: origin + direction·z, and the planes that it is cut along.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct LatticeRays {
    lattice_from_view: DMat3,
    start: DVec3,
    lowest: DVec3,
    highest: DVec3,
    /// Normals that lead out, and what their products with the border are, in view space.
    planes: Vec<(DVec3, f64)>,
    origin: f64,
}

impl LatticeRays {
    /// Depths are counted from `origin`.
    pub(crate) fn new(volume: &Volume<'_>, camera: &Camera, origin: f64) -> Self {
        let world_from_view = DMat3::from_cols(camera.axes[0], camera.axes[1], camera.axes[2]);
        let inverse = volume.axes().inverse();
        let lowest = volume.packing.lowest();
        let Similarity { scale, rotation, .. } = volume.transform;
        let eye = rotation.inverse() * (camera.position - volume.transform.translation) / scale;
        let plane = |(normal, offset): (DVec3, f64)| {
            (world_from_view.transpose() * (rotation * normal), (offset - normal.dot(eye)) * scale)
        };
        Self {
            lattice_from_view: inverse * world_from_view,
            start: inverse * (camera.position - volume.origin()),
            lowest,
            highest: lowest + DVec3::from_array(volume.grid.dims.map(|n| n as f64)),
            planes: volume.clip.iter().flat_map(Clip::half_spaces).map(plane).collect(),
            origin,
        }
    }

    /// Rows of what leads from view positions, depths counted from the origin, to lattice coordinates.
    pub(crate) fn rows(&self) -> [[f64; 4]; 3] {
        let start = self.lattice(DVec3::Z * self.origin);
        [0, 1, 2].map(|a| {
            let row = self.lattice_from_view.row(a);
            [row.x, row.y, row.z, start[a]]
        })
    }

    /// Lattice coordinates of a view position.
    fn lattice(&self, at: DVec3) -> DVec3 {
        self.start + self.lattice_from_view * at
    }

    /// Where a view ray is inside, counted from the origin, not behind the eye.
    pub(crate) fn crossing(&self, (from, along): (DVec3, DVec3)) -> [f64; 2] {
        let mut near = 0.0f64;
        let mut far = f64::INFINITY;
        for (normal, offset) in &self.planes {
            let to_border = offset - normal.dot(from);
            let leaves = normal.dot(along);
            match leaves {
                0.0 if to_border < 0.0 => return [f64::INFINITY, f64::NEG_INFINITY],
                0.0 => {}
                _ if leaves > 0.0 => far = far.min(to_border / leaves),
                _ => near = near.max(to_border / leaves),
            }
        }
        let from = self.lattice(from);
        let along = self.lattice_from_view * along;
        for a in 0..3 {
            let to_low = self.lowest[a] - from[a];
            let to_high = self.highest[a] - from[a];
            if along[a] == 0.0 {
                if to_low > 0.0 || to_high < 0.0 {
                    return [f64::INFINITY, f64::NEG_INFINITY];
                }
                continue;
            }
            let one = to_low / along[a];
            let other = to_high / along[a];
            (near, far) = (near.max(one.min(other)), far.min(one.max(other)));
        }
        [near - self.origin, far - self.origin]
    }
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
        let at = |v: usize, a: usize| {
            let px = (corner[a] + v) as f64 - 0.5;
            let (from, along) = camera.view_ray(px, px);
            (if is_parallel { from } else { along })[a]
        };
        let x: [f64; SIDE] = std::array::from_fn(|v| at(v, 0));
        let y: [f64; SIDE] = std::array::from_fn(|v| at(v, 1));
        let column = |v: usize| x.get(v).map_or(0.0, |x| *x as f32);
        let reach = if is_parallel { 1.0 } else { origin };
        let start = [&x, &y].map(|at| std::array::from_fn(|v| at.get(v).map_or(0.0, |at| (at * reach) as f32)));
        Self { u: std::array::from_fn(column), v: y.map(|y| y as f32), x, y, start, is_parallel, slant }
    }

    /// View positions on neighbouring rays, depths counted from the first slab.
    #[inline(always)]
    pub(crate) fn places<S: Simd>(&self, simd: S, [x, y]: [usize; 2], depth: Lanes<S>) -> [Lanes<S>; 3] {
        let start = [Lanes::load(simd, &self.start[0][x..]), Lanes::splat(simd, self.start[1][y])];
        if self.slant.is_any() {
            let [sx, sy] = self.slant.single();
            let [sx, sy] = [Lanes::splat(simd, sx), Lanes::splat(simd, sy)];
            return [start[0], start[1], depth - (sx * start[0] + sy * start[1])];
        }
        if self.is_parallel {
            return [start[0], start[1], depth];
        }
        let [u, v] = [Lanes::load(simd, &self.u[x..]), Lanes::splat(simd, self.v[y])];
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

    /// Makes depths of slabs of neighbouring pixels, the first at (x, y) of the tile with its rim, view depths.
    pub(crate) fn unshear(&self, [x, y]: [usize; 2], depths: [&mut [f32; MAX_LANES]; 2]) {
        for depths in depths {
            for (lane, depth) in depths.iter_mut().enumerate().take_while(|(lane, _)| x + lane < SIDE) {
                *depth -= self.offset(x + lane, y) as f32;
            }
        }
    }

    /// View-space origin and direction of a ray, as [`Camera::view_ray`] has them.
    pub(crate) fn ray(&self, x: usize, y: usize) -> (DVec3, DVec3) {
        let at = DVec3::new(self.x[x], self.y[y], 0.0);
        if self.is_parallel { (at, DVec3::Z) } else { (DVec3::ZERO, at + DVec3::Z) }
    }
}

impl Crossings {
    pub(crate) fn new() -> Self {
        Self { near: vec![0.0; AREA + MAX_LANES], far: vec![0.0; AREA + MAX_LANES] }
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
    }
}
