//! Deposits in runs of cells, for more entries than a device's kernels can see in one buffer, and the lists of runs made
//! one map.
//!
//! The cells of media come first, those of surfaces behind them; a run may hold some of both. Cells are cut at the ranges
//! in which deposits lie parted, so that a chunk of splats gives a run one slice of its entries.

use super::{Capacities, GROUP, MOST_ENTRIES, Recorded, record};
use crate::building::deposits::{Parted2, Parts};
use crate::shadow_map::{Absorbances, Matter};
use crate::table::{Lists, Parted};
use crate::{Deposits, Error, ShadowMap};
use bytemuck::Pod;
use splat_shaders::Overflow;
use std::ops::Range;

/// A run of a map's cells, those of media before those of surfaces, whose lists are made at once.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Batch {
    /// Ranges of cells of media, and of surfaces.
    ranges: [Range<usize>; 2],
    cells: u64,
    entries: u64,
}

impl Batch {
    /// Its entries.
    pub fn entries(&self) -> u64 {
        self.entries
    }

    /// Its cells.
    pub fn cells(&self) -> u64 {
        self.cells
    }
}

/// The lists of a batch.
#[derive(Debug, Clone, PartialEq)]
pub struct Listed {
    pub(super) spans: Vec<[u32; 2]>,
    pub(super) distances: Vec<f32>,
    pub(super) totals: Vec<f32>,
}

impl Capacities {
    /// The most entries and cells for which no buffer is larger than this; none where not even those of one workgroup fit.
    pub fn most(binding_bytes: u64, channels: u32) -> Self {
        let number = |bytes: u64| u32::try_from(binding_bytes / bytes).unwrap_or(u32::MAX);
        let entries = number(if channels == 3 { 12 } else { 4 }).min(MOST_ENTRIES);
        let most = Self { entries, cells: number(8), channels };
        let fits = |most| record(most).recording.buffers().iter().all(|b| b.bytes <= binding_bytes);
        if entries >= GROUP && fits(most) { most } else { Self { entries: 0, cells: 0, channels } }
    }
}

impl Deposits {
    /// Runs of cells with no more entries and cells than this, in order; together they are all.
    ///
    /// # Errors
    /// [`Error::Overflow`] where neighbouring cells that lie together are more than that.
    pub fn batches(&self, most: Capacities) -> Result<Vec<Batch>, Error> {
        let count = self.ranges.count();
        let mut batches: Vec<Batch> = Vec::new();
        for (kind, r) in (0..2).flat_map(|kind| (0..count).map(move |r| (kind, r))) {
            let cells = (self.ranges.first_cell(r + 1) - self.ranges.first_cell(r)) as u64;
            let entries = self.entries_in(kind, r);
            for (what, needed, had) in [("entries", entries, most.entries), ("cells", cells, most.cells)] {
                if needed > u64::from(had) {
                    return Err(Error::Overflow(Overflow { what, needed, had: had.into() }));
                }
            }
            let fits =
                |b: &&mut Batch| b.entries + entries <= most.entries.into() && b.cells + cells <= most.cells.into();
            match batches.last_mut().filter(fits) {
                Some(batch) => {
                    let known = &mut batch.ranges[kind];
                    *known = if known.start == known.end { r..r + 1 } else { known.start..r + 1 };
                    batch.cells += cells;
                    batch.entries += entries;
                }
                None => {
                    let mut ranges = [0..0, 0..0];
                    ranges[kind] = r..r + 1;
                    batches.push(Batch { ranges, cells, entries });
                }
            }
        }
        Ok(batches)
    }

    fn entries_in(&self, kind: usize, range: usize) -> u64 {
        fn sum<const C: usize>(parts: &[Parted<C>], range: usize) -> u64 {
            parts.iter().map(|p| p.entries_of(range..range + 1).0.len() as u64).sum()
        }
        match &self.parts {
            Parts::Mono(parts) => sum(&parts[kind], range),
            Parts::Rgb(parts) => sum(&parts[kind], range),
        }
    }

    /// Bytes of the cells (counted from the batch's first), distances and absorbances of a batch.
    pub(super) fn columns(&self, batch: &Batch) -> [Vec<u8>; 3] {
        match &self.parts {
            Parts::Mono(parts) => self.columns_of(parts, batch),
            Parts::Rgb(parts) => self.columns_of(parts, batch),
        }
    }

    fn columns_of<const C: usize>(&self, parts: &Parted2<C>, batch: &Batch) -> [Vec<u8>; 3]
    where
        [f32; C]: Pod,
    {
        let n = 4 * batch.entries as usize;
        let [mut cells, mut distances, mut absorbances] = [n, n, n * C].map(Vec::<u8>::with_capacity);
        let mut before = 0u32;
        for (parts, ranges) in parts.iter().zip(&batch.ranges) {
            let first = self.ranges.first_cell(ranges.start) as u32;
            for part in parts {
                let (cell, distance, absorbance) = part.entries_of(ranges.clone());
                cells.extend(cell.iter().flat_map(|c| (c - first + before).to_ne_bytes()));
                distances.extend_from_slice(bytemuck::cast_slice(distance));
                absorbances.extend_from_slice(bytemuck::cast_slice(absorbance));
            }
            before += self.cells_of(ranges) as u32;
        }
        [cells, distances, absorbances]
    }

    fn cells_of(&self, ranges: &Range<usize>) -> usize {
        self.ranges.first_cell(ranges.end) - self.ranges.first_cell(ranges.start)
    }

    /// The map, from the lists of all its batches in order.
    ///
    /// # Errors
    /// [`Error::ReadBack`] when they are not those of these deposits.
    pub fn join(&self, batches: Vec<Listed>) -> Result<ShadowMap, Error> {
        let Self { map, parts, ranges, .. } = self;
        let entries = self.entries();
        let absorbances = match parts {
            Parts::Mono(_) => Absorbances::Mono(joined(batches, ranges.cells(), entries)?),
            Parts::Rgb(_) => Absorbances::Rgb(joined(batches, ranges.cells(), entries)?),
        };
        Ok(map.clone().with(absorbances))
    }
}

pub(super) fn joined<const C: usize>(batches: Vec<Listed>, cells: usize, entries: [u64; 2]) -> Result<Matter<C>, Error>
where
    [f32; C]: Pod,
{
    let mut batches = batches.into_iter();
    let mut listed = batches.next().unwrap_or(Listed { spans: Vec::new(), distances: Vec::new(), totals: Vec::new() });
    for more in batches {
        let before = listed.distances.len() as u32;
        listed.spans.extend(more.spans.iter().map(|[begin, kept]| [begin.wrapping_add(before), *kept]));
        listed.distances.extend(more.distances);
        listed.totals.extend(more.totals);
    }
    let expected = [2 * cells as u64, entries[0] + entries[1], (entries[0] + entries[1]) * C as u64];
    let found = [listed.spans.len(), listed.distances.len(), listed.totals.len()].map(|n| n as u64);
    for ((what, expected), found) in ["spans", "distances", "totals"].into_iter().zip(expected).zip(found) {
        if expected != found {
            return Err(Error::ReadBack { what, expected: 4 * expected, found: 4 * found });
        }
    }
    let of_media = entries[0] as usize;
    let mut surfaces = listed.spans.split_off(cells);
    surfaces.iter_mut().for_each(|[begin, _]| *begin = begin.wrapping_sub(entries[0] as u32));
    let distances = listed.distances.split_off(of_media);
    let totals = listed.totals.split_off(of_media * C);
    let lists = |spans: Vec<[u32; 2]>, distances: Vec<f32>, totals: &[f32]| {
        if distances.is_empty() {
            return Ok(None);
        }
        let cells = spans.len() as u64;
        let lists = Lists::from_parts(spans, distances, bytemuck::cast_slice(totals).to_vec());
        lists.map(Some).ok_or(Error::ReadBack { what: "spans", expected: 8 * cells, found: 0 })
    };
    Ok(Matter {
        media: lists(listed.spans, listed.distances, &listed.totals)?,
        surfaces: lists(surfaces, distances, &totals)?,
    })
}

impl Recorded {
    /// The lists of a batch, from the bytes that were read back of [`Recorded::spans`], [`Recorded::distances`] and
    /// [`Recorded::totals`] after a run with its uploads.
    ///
    /// # Errors
    /// [`Error::ReadBack`] for fewer bytes than a run gives.
    pub fn listed(&self, buffers: [&[u8]; 3], batch: &Batch) -> Result<Listed, Error> {
        let [spans, distances, totals] = buffers;
        let entries = batch.entries as usize;
        Ok(Listed {
            spans: read("spans", spans, batch.cells as usize)?,
            distances: read("distances", distances, entries)?,
            totals: read("totals", totals, entries * self.capacities.channels as usize)?,
        })
    }
}

/// The first numbers of some bytes.
pub(super) fn read<T: Pod>(what: &'static str, bytes: &[u8], count: usize) -> Result<Vec<T>, Error> {
    let size = count * size_of::<T>();
    let used = bytes.get(..size).ok_or(Error::ReadBack { what, expected: size as u64, found: bytes.len() as u64 })?;
    Ok(used.chunks_exact(size_of::<T>()).map(bytemuck::pod_read_unaligned).collect())
}
