//! Selects the voxels of a volume that become splats, with their colours and extinctions.

use crate::common::extremes::{greater, lesser};
use crate::volume::bricks::{Bricks, range_of_rows};
use crate::volume::cell_share::CellShares;
use crate::volume::classify::{Class, Classes, cell_length};
use crate::{ConvertError, VolumeParams};
use rayon::prelude::*;
use splat_core::{Grid, Progress, TransferFunction, glam::DVec3};

/// The longest straight line within the lattice's cells: the longest body diagonal.
pub(crate) fn longest_path(lattice: &Grid) -> f64 {
    let n = DVec3::from_array(lattice.dims.map(|n| n as f64));
    [DVec3::ONE, DVec3::new(-1.0, 1.0, 1.0), DVec3::new(1.0, -1.0, 1.0), DVec3::new(1.0, 1.0, -1.0)]
        .iter()
        .fold(0.0, |longest, s| (lattice.axes * (n * *s)).length().max(longest))
}

/// Which lattice points become splats.
pub(crate) struct Keep<'a> {
    lattice: &'a Grid,
    classes: Classes<'a>,
    /// Extinction that is left out up to here.
    threshold: f64,
    /// Values up to and from here have no extinction at all: two comparisons spare most look-ups.
    support: [f32; 2],
    bricks: Bricks,
    /// The part of each cell that is kept, where something is cut off.
    cut: Option<CellShares>,
}

/// The kept lattice points of one slab of constant k.
#[derive(Default)]
pub(crate) struct Slab {
    /// Index within the slab.
    pub(crate) kept: Vec<u32>,
    /// Those among them whose class is a mean, or that of the part that is kept of their cell, by their rank.
    pub(crate) averaged: Vec<(u32, Class)>,
    /// How many were left out.
    pub(crate) omitted: u64,
    /// Largest extinction left out.
    pub(crate) thickest: f32,
}

impl<'a> Keep<'a> {
    pub(crate) fn new(tf: &'a TransferFunction, lattice: &'a Grid, params: &VolumeParams) -> Self {
        let scale = params.splat.transform.scale;
        let threshold = params.omitted_optical_depth / (longest_path(lattice) * scale);
        let classes = Classes::new(tf, cell_length(lattice, scale), params.classification_error);
        let points = tf.points();
        let some = |p: &splat_core::TransferPoint| p.extinction > 0.0;
        let support = match (points.iter().position(some), points.iter().rposition(some)) {
            (Some(first), Some(last)) => [
                if first == 0 { f32::NEG_INFINITY } else { points[first - 1].value },
                points.get(last + 1).map_or(f32::INFINITY, |p| p.value),
            ],
            _ => [f32::INFINITY, f32::NEG_INFINITY],
        };
        let cut = (!params.clip.is_empty()).then(|| CellShares::new(&params.clip, lattice.origin, lattice.axes));
        Self { lattice, threshold, support, bricks: Bricks::new(lattice, &classes), classes, cut }
    }

    /// All slabs, in order.
    pub(crate) fn slabs(&self, progress: &Progress) -> Result<Vec<Slab>, ConvertError> {
        let points = (self.lattice.dims[0] * self.lattice.dims[1]) as u64;
        let slab = |k| {
            progress.tick(points).map_err(|_| ConvertError::Cancelled)?;
            Ok(self.slab(k))
        };
        (0..self.lattice.dims[2]).into_par_iter().map(slab).collect()
    }

    /// How many lattice points become splats.
    pub(crate) fn count(&self) -> u64 {
        (0..self.lattice.dims[2]).into_par_iter().map(|k| self.count_slab(k)).sum()
    }

    /// How many voxels have extinction themselves, whatever their cells have: what a finer lattice would find, on average.
    pub(crate) fn count_voxels(&self) -> u64 {
        let [nx, ny, nz] = self.lattice.dims;
        let is_some = |n: usize, k: usize| {
            f64::from(self.classes.at(self.lattice.values[k * nx * ny + n]).extinction) > self.threshold.max(0.0)
                && self.share(n, k) > 0.0
        };
        let of_row = |j, k| {
            let voxels = self.bricks.spans(self.lattice, j, k).flatten();
            voxels.filter(|i| is_some(j * nx + i, k)).count() as u64
        };
        (0..nz).into_par_iter().map(|k| (0..ny).map(|j| of_row(j, k)).sum::<u64>()).sum()
    }

    fn slab(&self, k: usize) -> Slab {
        let mut slab = Slab::default();
        self.visit(k, |voxel, range| {
            let (class, is_mean) = self.class(voxel, range);
            if class.extinction <= 0.0 {
                return;
            }
            if f64::from(class.extinction) <= self.threshold {
                slab.omitted += 1;
                slab.thickest = slab.thickest.max(class.extinction);
                return;
            }
            if is_mean {
                slab.averaged.push((slab.kept.len() as u32, class));
            }
            slab.kept.push(self.within_slab(voxel) as u32);
        });
        slab
    }

    fn count_slab(&self, k: usize) -> u64 {
        // Where all that is something is kept, most cells need no mean.
        let by_any = self.threshold <= 0.0 && self.cut.is_none();
        let mut count = 0;
        self.visit(k, |voxel, range| {
            let is_kept = if by_any {
                self.classes.is_extinct(self.lattice, voxel, range)
            } else {
                let extinction = self.class(voxel, range).0.extinction;
                extinction > 0.0 && f64::from(extinction) > self.threshold
            };
            count += u64::from(is_kept);
        });
        count
    }

    /// Calls `see` with the place of each voxel of a slab of whose cell something may be shown, and with the least and greatest values in and
    /// around it.
    fn visit(&self, k: usize, mut see: impl FnMut([usize; 3], [f32; 2])) {
        let [nx, ny, nz] = self.lattice.dims;
        let around = |i: usize, n: usize| i.saturating_sub(1)..(i + 2).min(n);
        let mut rows = [vec![0.0f32; nx], vec![0.0f32; nx]];
        for j in 0..ny {
            for span in self.bricks.spans(self.lattice, j, k) {
                let part = span.start.saturating_sub(1)..(span.end + 1).min(nx);
                range_of_rows(self.lattice, around(j, ny), around(k, nz), part, &mut rows);
                let [low, high] = &rows;
                for i in span {
                    let left = i.saturating_sub(1);
                    let right = (i + 1).min(nx - 1);
                    let low = lesser(low[i], lesser(low[left], low[right]));
                    let high = greater(high[i], greater(high[left], high[right]));
                    if high > self.support[0] && low < self.support[1] {
                        see([i, j, k], [low, high]);
                    }
                }
            }
        }
    }

    /// The class of a voxel's cell, and whether it is not that of the voxel itself.
    fn class(&self, voxel: [usize; 3], range: [f32; 2]) -> (Class, bool) {
        let (mut class, is_mean) = self.classes.cell(self.lattice, voxel, range);
        let share = if class.extinction > 0.0 { self.share(self.within_slab(voxel), voxel[2]) } else { 0.0 };
        if share >= 1.0 {
            return (class, is_mean);
        }
        class.extinction = (f64::from(class.extinction) * share) as f32;
        (class, true)
    }

    fn within_slab(&self, cell: [usize; 3]) -> usize {
        let [i, j, _] = cell;
        j * self.lattice.dims[0] + i
    }

    /// Share of a cell that nothing cuts off.
    fn share(&self, n: usize, k: usize) -> f64 {
        let nx = self.lattice.dims[0];
        let index = || DVec3::new((n % nx) as f64, (n / nx) as f64, k as f64);
        self.cut.as_ref().map_or(1.0, |cut| cut.at(index()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use splat_core::{TransferPoint, glam::DMat3, rng};

    /// Values that the function shows nothing of nearly everywhere, some blobs, and lone voxels at the borders of bricks.
    fn lattice() -> Grid {
        let dims = [29, 18, 11];
        let value = |n: usize| {
            let at = DVec3::new((n % 29) as f64, (n / 29 % 18) as f64, (n / 29 / 18) as f64);
            let blob = 2.5 - (at - DVec3::new(6.0, 5.0, 4.0)).length().min((at - DVec3::new(27.0, 15.0, 9.0)).length());
            let lone = [[8, 8, 8], [23, 0, 7], [0, 17, 10]].iter().any(|p| at == DVec3::from_array(p.map(f64::from)));
            if lone { 0.9 } else { (blob as f32).max(0.05 * rng::unit_f32(4, 0, n as u64, 0)) }
        };
        Grid {
            origin: DVec3::ZERO,
            axes: DMat3::IDENTITY,
            dims,
            values: (0..dims.iter().product()).map(value).collect(),
        }
    }

    #[test]
    fn bricks_leave_out_nothing_that_is_shown() {
        let point = |value, extinction| TransferPoint { value, color: [1.0; 3], extinction };
        let grid = lattice();
        // With nothing on both sides, with nothing between, and with something everywhere.
        for points in [
            vec![point(0.2, 0.0), point(0.5, 2.0), point(1.0, 0.0)],
            vec![point(0.0, 1.0), point(0.01, 0.0), point(0.6, 0.0), point(0.7, 3.0), point(2.0, 0.0)],
            vec![point(0.0, 0.5), point(1.0, 2.0)],
        ] {
            let tf = TransferFunction::new(points).unwrap();
            let keep = Keep::new(&tf, &grid, &VolumeParams::default());
            let slabs = keep.slabs(&Progress::new()).unwrap();
            for (k, slab) in slabs.iter().enumerate() {
                let shows = |n: &u32| {
                    let [i, j] = [*n as usize % 29, *n as usize / 29];
                    let around = |i: usize, n: usize| i.saturating_sub(1)..(i + 2).min(n);
                    let values = around(k, 11).flat_map(|k| around(j, 18).map(move |j| (j, k)));
                    let values = values.flat_map(|(j, k)| around(i, 29).map(move |i| (k * 18 + j) * 29 + i));
                    let values: Vec<f32> = values.map(|n| grid.values[n]).collect();
                    let range = [
                        values.iter().copied().fold(f32::INFINITY, f32::min),
                        values.iter().copied().fold(f32::NEG_INFINITY, f32::max),
                    ];
                    keep.classes.cell(&grid, [i, j, k], range).0.extinction > 0.0
                };
                let expected: Vec<u32> = (0..29 * 18).filter(shows).collect();
                assert_eq!(slab.kept, expected);
            }
            assert_eq!(keep.count(), slabs.iter().map(|s| s.kept.len() as u64).sum::<u64>());
        }
    }
}
