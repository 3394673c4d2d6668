//! Voxels by the slab in which their kernels begin, and by bands of an image: bucket sort, in linear time.
//!
//! A voxel has the bucket of its first slab and of the first band that it reaches in any of its slabs. What a band has of a slab
//! lies in the buckets of the slabs before, as many as kernels touch, and of the bands before, as many as the largest footprint
//! touches: ranges without gaps. In a bucket voxels keep the order of the lattice, whoever counts them.

use super::band::ROWS;
use super::frame::Frame;
use super::placed::Placed;
use super::sight::{PixelBounds, Shape, Sight};
use crate::shared::depths::DepthRange;
use crate::shared::lattice::Lattice;
use crate::shared::sections::PHASES;
use crate::shared::voxels::{SEGMENT, Voxels};
use rayon::prelude::*;
use splat_core::glam::Vec2;
use std::ops::Range;

/// A voxel on its way into sheets.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Record {
    /// Slab coordinates along the slabs.
    pub(crate) center: Vec2,
    /// Value, less the volume's base.
    pub(crate) value: f32,
    /// Where its kernel begins, 256ths of a slab.
    pub(crate) place: u32,
}

/// The visible voxels of a volume, in the order of the lattice, plane by plane.
pub(crate) fn records(placed: &Placed<'_>, lattice: &Lattice<'_>, voxels: &Voxels) -> Vec<Vec<Record>> {
    let [nx, ny, nz] = lattice.dims;
    let plane = |k: usize| {
        let mut out = Vec::new();
        for (j, eighth) in (0..ny).flat_map(|j| (0..nx.div_ceil(SEGMENT)).map(move |e| (j, e))) {
            let mut bits = voxels.eight(eighth, j, k);
            while bits != 0 {
                let i = eighth * SEGMENT + bits.trailing_zeros() as usize;
                bits &= bits - 1;
                let p = placed.position(lattice.rim, [i, j, k]);
                let value = placed.base.relative(lattice.value(i, j, k));
                out.push(Record { center: p.truncate().as_vec2(), value, place: placed.place(p.z) });
            }
        }
        out
    };
    (0..nz).into_par_iter().map(plane).collect()
}

/// The voxels of one volume for one image.
#[derive(Debug)]
pub(crate) struct Buckets {
    records: Vec<Record>,
    /// By first slab and band.
    starts: Vec<u32>,
    bands: usize,
    /// Bands under the largest footprint, less one.
    span: usize,
    /// Slabs under a kernel.
    touched: usize,
}

impl Buckets {
    pub(crate) fn new(
        planes: &[Vec<Record>],
        placed: &Placed<'_>,
        frame: &Frame,
        sight: &Sight,
        shape: &Shape,
    ) -> Self {
        let [width, height] = sight.camera.size.map(|s| s as usize);
        let bands = height.div_ceil(ROWS);
        let touched = placed.sections.touched;
        let bucket = |record: &Record| {
            let first = (record.place / PHASES).min(frame.slabs.count - 1);
            // A slab that a face cuts asks for what its neighbours hold, too.
            let depths = DepthRange {
                near: frame.slabs.face(first.saturating_sub(1)),
                far: frame.slabs.face(first + touched as u32 + 1),
            };
            let PixelBounds { left, right, top, bottom } = sight.bounds(shape, record.center, depths);
            let is_outside = right < 0.0 || left > width as f32 || bottom < 0.0 || top > height as f32;
            // Saturating casts: what lies before the image is 0.
            let band = |row: f32| (row as usize / ROWS).min(bands - 1);
            (!is_outside).then(|| (first as usize * bands + band(top), band(bottom) - band(top)))
        };
        let plane = |records: &Vec<Record>| records.iter().map(bucket).collect::<Vec<_>>();
        let buckets: Vec<Vec<Option<(usize, usize)>>> = planes.par_iter().map(plane).collect();
        // starts[b + 2] first counts, then starts[b + 1] is the running end of bucket b.
        let mut starts = vec![0u32; frame.slabs.count as usize * bands + 2];
        let mut most = 0;
        for (bucket, span) in buckets.iter().flatten().flatten() {
            starts[bucket + 2] += 1;
            most = most.max(*span);
        }
        (2..starts.len()).for_each(|b| starts[b] += starts[b - 1]);
        let mut records = vec![Record::default(); starts.last().map_or(0, |n| *n as usize)];
        for (record, bucket) in planes.iter().flatten().zip(buckets.iter().flatten()) {
            if let Some((bucket, _)) = bucket {
                let next = &mut starts[bucket + 1];
                records[*next as usize] = *record;
                *next += 1;
            }
        }
        starts.pop();
        Self { records, starts, bands, span: most, touched }
    }

    /// Voxels that may reach `band` in any of some slabs, or a rim of up to a band around it, run by run.
    pub(crate) fn reaching(&self, slabs: Range<u32>, band: usize, has_rim: bool) -> impl Iterator<Item = &[Record]> {
        let rim = usize::from(has_rim);
        let count = (self.starts.len() - 1) / self.bands;
        let slabs = slabs.start as usize..(slabs.end as usize).min(count);
        (slabs.start.saturating_sub(self.touched - 1)..slabs.end).map(move |first| {
            let row = first * self.bands;
            let from = row + band.saturating_sub(self.span + rim);
            let to = row + (band + 1 + rim).min(self.bands);
            &self.records[self.starts[from] as usize..self.starts[to] as usize]
        })
    }

    /// Bytes of all lists.
    pub(crate) fn bytes(&self) -> u64 {
        (self.records.len() * size_of::<Record>() + 4 * self.starts.len()) as u64
    }
}
