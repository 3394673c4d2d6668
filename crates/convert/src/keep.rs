//! Which voxels of a volume become splats, and with which colour and extinction.

use crate::cell_share::CellShares;
use crate::classify::{Class, Classes, cell_length};
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
    classes: Classes<'a>,
    /// Extinction that is left out up to here.
    threshold: f64,
    /// Values up to and from here have no extinction at all: two comparisons spare most look-ups.
    support: [f32; 2],
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
    pub(crate) fn new(tf: &'a TransferFunction, lattice: &Grid, params: &VolumeParams) -> Self {
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
        let cut = (!params.clip.is_empty()).then(|| CellShares::new(&params.clip, lattice));
        Self { classes, threshold, support, cut }
    }

    /// All slabs, in order.
    pub(crate) fn slabs(&self, lattice: &Grid, progress: &Progress) -> Result<Vec<Slab>, ConvertError> {
        let points = (lattice.dims[0] * lattice.dims[1]) as u64;
        let slab = |k| progress.tick(points).map(|()| self.slab(lattice, k)).map_err(|_| ConvertError::Cancelled);
        (0..lattice.dims[2]).into_par_iter().map(slab).collect()
    }

    /// How many lattice points become splats.
    pub(crate) fn count(&self, lattice: &Grid) -> u64 {
        (0..lattice.dims[2]).into_par_iter().map(|k| self.slab(lattice, k).kept.len() as u64).sum()
    }

    /// How many voxels have extinction themselves, whatever their cells have: what a finer lattice would find, on average.
    pub(crate) fn count_voxels(&self, lattice: &Grid) -> u64 {
        let slab = lattice.dims[0] * lattice.dims[1];
        let is_some = |k: usize, n: usize| {
            f64::from(self.classes.at(lattice.values[k * slab + n]).extinction) > self.threshold.max(0.0)
                && self.share(lattice, n, k) > 0.0
        };
        let count = |k: usize| (0..slab).filter(|n| is_some(k, *n)).count() as u64;
        (0..lattice.dims[2]).into_par_iter().map(count).sum()
    }

    fn slab(&self, lattice: &Grid, k: usize) -> Slab {
        let [nx, ny, _] = lattice.dims;
        let mut slab = Slab::default();
        let mut rows = [vec![0.0f32; nx], vec![0.0f32; nx]];
        for j in 0..ny {
            range_of_rows(lattice, j, k, &mut rows);
            let [low, high] = &rows;
            for i in 0..nx {
                let (left, right) = (i.saturating_sub(1), (i + 1).min(nx - 1));
                let range =
                    [lesser(low[i], lesser(low[left], low[right])), greater(high[i], greater(high[left], high[right]))];
                if range[1] <= self.support[0] || range[0] >= self.support[1] {
                    continue;
                }
                let (mut class, mut is_mean) = self.classes.cell(lattice, [i, j, k], range);
                let n = j * nx + i;
                let share = if class.extinction > 0.0 { self.share(lattice, n, k) } else { 0.0 };
                if share < 1.0 {
                    (class.extinction, is_mean) = ((f64::from(class.extinction) * share) as f32, true);
                }
                if class.extinction <= 0.0 {
                    continue;
                }
                if f64::from(class.extinction) <= self.threshold {
                    slab.omitted += 1;
                    slab.thickest = slab.thickest.max(class.extinction);
                    continue;
                }
                if is_mean {
                    slab.averaged.push((slab.kept.len() as u32, class));
                }
                slab.kept.push(n as u32);
            }
        }
        slab
    }

    /// Share of a cell that nothing cuts off.
    fn share(&self, lattice: &Grid, n: usize, k: usize) -> f64 {
        let index = || DVec3::new((n % lattice.dims[0]) as f64, (n / lattice.dims[0]) as f64, k as f64);
        self.cut.as_ref().map_or(1.0, |cut| cut.of(index()))
    }
}

/// The lesser of two finite numbers, in the form that becomes one instruction.
fn lesser(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

/// The greater of two finite numbers.
fn greater(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

/// Least and greatest values at each place of a row, over it and the eight rows around it.
fn range_of_rows(lattice: &Grid, j: usize, k: usize, [low, high]: &mut [Vec<f32>; 2]) {
    let [nx, ny, nz] = lattice.dims;
    let row = |j: usize, k: usize| &lattice.values[(k * ny + j) * nx..][..nx];
    low.copy_from_slice(row(j, k));
    high.copy_from_slice(row(j, k));
    for k in k.saturating_sub(1)..(k + 2).min(nz) {
        for j in j.saturating_sub(1)..(j + 2).min(ny) {
            for ((low, high), v) in low.iter_mut().zip(high.iter_mut()).zip(row(j, k)) {
                (*low, *high) = (lesser(*v, *low), greater(*v, *high));
            }
        }
    }
}
