//! Implicit surfaces f = c inside a box (Tanaka 2012, section 4), and the cells of the box that may hold a piece of them.
//!
//! The box is parted into cubes; an octree over them drops every cube where the field's `bound` over the ball around it
//! excludes c. Where a field knows no bound, nothing is dropped, and whatever follows from it is reported as unproven.

use crate::Error;
use crate::error::check;
use glam::DVec3;
use rayon::prelude::*;
use splat_core::{ScalarField, glam};

/// The surface f = level inside a box; open where the box or `inside` cuts it.
#[derive(Clone, Copy)]
pub struct ImplicitSurface<'a> {
    /// f.
    pub field: &'a dyn ScalarField,
    /// c.
    pub level: f64,
    /// Lowest corner of the box, world units.
    pub min: DVec3,
    /// Highest corner of the box, world units.
    pub max: DVec3,
    /// The part of the box that counts; all of it without.
    pub inside: Option<&'a (dyn Fn(DVec3) -> bool + Sync)>,
}

impl ImplicitSurface<'_> {
    /// Checks the box and that the field is finite at its corners and middle.
    ///
    /// # Errors
    /// [`Error::Parameter`] for a box without volume or a level that is not finite, [`Error::Field`].
    pub fn validate(&self) -> Result<(), Error> {
        check(self.level.is_finite(), "level", self.level, "a finite number")?;
        let extent = self.max - self.min;
        let ok = self.min.is_finite() && self.max.is_finite() && extent.min_element() > 0.0;
        check(ok, "box", (self.min, self.max), "two finite corners, the first less in all three")?;
        for k in 0..9u32 {
            let corner = DVec3::new(f64::from(k & 1), f64::from(k >> 1 & 1), f64::from(k >> 2 & 1));
            let at = self.min + extent * if k == 8 { DVec3::splat(0.5) } else { corner };
            let found = self.field.value(at);
            if !found.is_finite() {
                return Err(Error::Field { at: at.to_string(), found: found.to_string() });
            }
        }
        Ok(())
    }

    /// Whether `p` lies in the box and in the part of it that counts.
    pub(crate) fn contains(&self, p: DVec3) -> bool {
        p.cmpge(self.min).all() && p.cmple(self.max).all() && self.inside.is_none_or(|inside| inside(p))
    }

    /// f − c.
    #[inline]
    pub(crate) fn value(&self, p: DVec3) -> f64 {
        self.field.value(p) - self.level
    }
}

/// What a search for cells found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct CellCounts {
    /// Cells of the box.
    pub cells: u64,
    /// Cells that may hold a piece of the surface.
    pub active: u64,
    /// Of them, cells over which the field has no bound.
    pub unbounded: u64,
}

/// The cubes of the box, and how far each is from the surface.
#[derive(Debug, Clone)]
pub(crate) struct Cells {
    pub(crate) min: DVec3,
    /// Side of a cube.
    pub(crate) side: f64,
    pub(crate) dims: [i32; 3],
    /// Chebyshev distance to the nearest active cell, in cells, at most 255; 0 for an active one.
    distance: Vec<u8>,
    pub(crate) counts: CellCounts,
}

impl Cells {
    /// Cells of which the longest side of the box has `resolution`.
    pub(crate) fn new(surface: &ImplicitSurface<'_>, resolution: u32) -> Self {
        let extent = surface.max - surface.min;
        let side = extent.max_element() / f64::from(resolution);
        let dims = (extent / side).to_array().map(|n| (n - 1e-9).ceil().clamp(1.0, f64::from(resolution)) as i32);
        let mut cells = Self { min: surface.min, side, dims, distance: Vec::new(), counts: CellCounts::default() };
        let blocks = dims.map(|n| (n + 7) / 8);
        let found: Vec<(usize, bool)> = (0..blocks[0] * blocks[1] * blocks[2])
            .into_par_iter()
            .flat_map_iter(|b| {
                let corner = [b % blocks[0], b / blocks[0] % blocks[1], b / (blocks[0] * blocks[1])].map(|i| i * 8);
                let mut active = Vec::new();
                cells.search(surface, corner, 8, &mut active);
                active
            })
            .collect();
        let n = dims.iter().map(|n| *n as usize).product();
        cells.distance = vec![u8::MAX; n];
        found.iter().for_each(|(i, _)| cells.distance[*i] = 0);
        cells.counts = CellCounts {
            cells: n as u64,
            active: found.len() as u64,
            unbounded: found.iter().filter(|(_, unbounded)| *unbounded).count() as u64,
        };
        cells.spread();
        cells
    }

    /// Active cells of the cube of `size` cells at `corner`.
    fn search(&self, surface: &ImplicitSurface<'_>, corner: [i32; 3], size: i32, active: &mut Vec<(usize, bool)>) {
        if (0..3).any(|a| corner[a] >= self.dims[a]) {
            return;
        }
        let half = 0.5 * f64::from(size) * self.side;
        let middle = self.min + DVec3::from_array(corner.map(f64::from)) * self.side + DVec3::splat(half);
        // √3 rounded up: the ball must hold the cube.
        let bound = surface.field.bound(middle, half * 1.732_050_807_568_878);
        if bound.is_some_and(|(low, high)| low > surface.level || high < surface.level) {
            return;
        }
        if size == 1 {
            active.push((self.index(corner), bound.is_none()));
            return;
        }
        let half = size / 2;
        for k in 0..8 {
            let part = std::array::from_fn(|a| corner[a] + if k >> a & 1 == 1 { half } else { 0 });
            self.search(surface, part, half, active);
        }
    }

    pub(crate) fn index(&self, c: [i32; 3]) -> usize {
        (c[2] as usize * self.dims[1] as usize + c[1] as usize) * self.dims[0] as usize + c[0] as usize
    }

    #[inline]
    pub(crate) fn distance(&self, c: [i32; 3]) -> u8 {
        self.distance[self.index(c)]
    }

    /// Chebyshev distances to the active cells, by two sweeps over each cell's earlier neighbours.
    fn spread(&mut self) {
        let [nx, ny, nz] = self.dims;
        // Sweeps over all 13 earlier neighbours, forwards and backwards, are exact for this metric.
        let earlier: Vec<[i32; 3]> = (0..13).map(|k| [k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1]).collect();
        for sign in [1, -1] {
            for k in 0..nz {
                for j in 0..ny {
                    for i in 0..nx {
                        let c = if sign == 1 { [i, j, k] } else { [nx - 1 - i, ny - 1 - j, nz - 1 - k] };
                        let mut best = self.distance(c);
                        for step in &earlier {
                            let o: [i32; 3] = std::array::from_fn(|a| c[a] + sign * step[a]);
                            if (0..3).all(|a| o[a] >= 0 && o[a] < self.dims[a]) {
                                best = best.min(self.distance(o).saturating_add(1));
                            }
                        }
                        let at = self.index(c);
                        self.distance[at] = best;
                    }
                }
            }
        }
    }

    /// Centre and radius of a ball that holds all active cells, or `None` without any.
    pub(crate) fn ball(&self) -> Option<(DVec3, f64)> {
        let corners = || self.active().map(|c| DVec3::from_array(c.map(f64::from)));
        let low = corners().reduce(DVec3::min)?;
        let high = corners().reduce(DVec3::max)? + 1.0;
        let middle = 0.5 * (low + high);
        let far = corners().map(|c| (c + 0.5 - middle).abs() + 0.5).map(DVec3::length).fold(0.0, f64::max);
        Some((self.min + middle * self.side, far * self.side * (1.0 + 1e-12)))
    }

    /// All active cells.
    pub(crate) fn active(&self) -> impl Iterator<Item = [i32; 3]> {
        let [nx, ny, _] = self.dims.map(|n| n as usize);
        let zero = self.distance.iter().enumerate().filter(|(_, d)| **d == 0);
        zero.map(move |(i, _)| [i % nx, i / nx % ny, i / (nx * ny)].map(|v| v as i32))
    }

    pub(crate) fn bytes(&self) -> u64 {
        self.distance.len() as u64
    }
}
