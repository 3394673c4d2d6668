//! The voxels of one tile in the order of the slabs in which their kernels begin (section 4.2: "arranged into arrays according to the
//! first image aligned slab that they intersect").
//!
//! Segments of eight are put in order by counting, and become voxels only when the sweep comes to them: what lies behind opaque
//! tiles never does.

use super::ring::Record;
use super::size::SIDE;
use crate::image_aligned::prepared::Prepared;
use crate::image_aligned::segments::Segment;
use crate::shared::sections::PHASES;
use crate::shared::slabs::BATCH;
use crate::shared::voxels::SEGMENT;
use std::ops::Range;

/// Segments whose values are asked for together.
const AT_ONCE: usize = 32;

/// Voxels waiting for their batch.
#[derive(Debug)]
pub(crate) struct Queue {
    found: Vec<(u32, Segment)>,
    /// Segments by the batch of their nearest voxel.
    segments: Vec<Segment>,
    starts: Vec<u32>,
    first: u32,
    /// Slabs that hold any of their kernels.
    pub(crate) active: Range<u32>,
    /// Voxels by batch, modulo the batches that a segment may span.
    voxels: Vec<Vec<Record>>,
    /// Those of the batch that was taken last.
    taken: Vec<Record>,
}

impl Queue {
    pub(crate) fn new(prepared: &Prepared<'_>) -> Self {
        let slabs = (SEGMENT - 1) as f64 * prepared.viewed.axes.x_axis.z.abs() / prepared.viewed.width;
        let span = (slabs / f64::from(BATCH)) as usize + 3;
        Self {
            found: Vec::new(),
            segments: Vec::new(),
            starts: Vec::new(),
            first: 0,
            active: 0..0,
            voxels: vec![Vec::new(); span],
            taken: Vec::new(),
        }
    }

    /// Whether there is nothing in the tile.
    pub(crate) fn is_empty(&self) -> bool {
        self.segments.is_empty()
    }

    /// The segments of tile `t` that begin in `batches`.
    pub(crate) fn fill(&mut self, prepared: &Prepared<'_>, t: usize, batches: &Range<u32>) {
        self.first = batches.start;
        self.voxels.iter_mut().for_each(Vec::clear);
        self.found.clear();
        self.starts.clear();
        self.starts.resize(batches.len() + 2, 0);
        let mut active = [u32::MAX, 0];
        for segment in prepared.segments.tile(t) {
            let start = prepared.viewed.position(segment.eighth * SEGMENT, segment.j, segment.k);
            let end = start + prepared.viewed.axes.x_axis * (SEGMENT - 1) as f64;
            let slab = |z: f64| prepared.viewed.place(z as f32).map_or(0, |place| place / PHASES);
            let [begin, last] = [slab(start.z.min(end.z)), slab(start.z.max(end.z))];
            let nearest = (begin / BATCH).max(batches.start);
            if nearest < batches.end && last / BATCH >= batches.start {
                let end = last + prepared.sections.touched as u32;
                active = [active[0].min(begin), active[1].max(end)];
                self.starts[(nearest - batches.start) as usize + 2] += 1;
                self.found.push((nearest - batches.start, segment));
            }
        }
        self.active = active[0]..active[1];
        (2..self.starts.len()).for_each(|b| self.starts[b] += self.starts[b - 1]);
        self.segments.clear();
        self.segments.resize(self.found.len(), Segment { eighth: 0, j: 0, k: 0 });
        for (batch, segment) in &self.found {
            let next = &mut self.starts[*batch as usize + 1];
            self.segments[*next as usize] = *segment;
            *next += 1;
        }
    }

    /// The voxels whose kernels begin in `batch`; batches are taken one after the other.
    #[inline(always)]
    pub(crate) fn take(&mut self, prepared: &Prepared<'_>, batch: u32, corner: [usize; 2]) -> &[Record] {
        let slot_of_batch = (batch - self.first) as usize;
        let mut values = [[0.0; SEGMENT]; AT_ONCE];
        for begin in (self.starts[slot_of_batch]..self.starts[slot_of_batch + 1]).step_by(AT_ONCE) {
            let segments = begin as usize..(begin as usize + AT_ONCE).min(self.starts[slot_of_batch + 1] as usize);
            // Values lie anywhere in memory: they are asked for together, so that one is not waited for after the other.
            for (segment, values) in self.segments[segments.clone()].iter().zip(&mut values) {
                prepared.lattice.eight(segment.eighth * SEGMENT, segment.j, segment.k, values);
            }
            for (n, values) in segments.zip(&values) {
                self.expand(prepared, self.segments[n], batch, values, corner);
            }
        }
        let slot = batch as usize % self.voxels.len();
        std::mem::swap(&mut self.taken, &mut self.voxels[slot]);
        self.voxels[slot].clear();
        &self.taken
    }

    /// The voxels of a segment that reach the tile.
    #[inline(always)]
    fn expand(
        &mut self,
        prepared: &Prepared<'_>,
        segment: Segment,
        batch: u32,
        values: &[f32; SEGMENT],
        corner: [usize; 2],
    ) {
        let slots = self.voxels.len();
        let mut bits = prepared.voxels.eight(segment.eighth, segment.j, segment.k);
        let start = prepared.viewed.position(segment.eighth * SEGMENT, segment.j, segment.k);
        let eight = prepared.viewed.eight(start);
        while bits != 0 {
            let i = bits.trailing_zeros() as usize;
            bits &= bits - 1;
            let place = eight.places[i] as u32;
            let begins = place / (PHASES * BATCH);
            if !eight.is_before_the_eye[i] || begins < batch {
                continue;
            }
            let half = prepared.half(eight.scales[i]);
            let center = [eight.x[i] - (corner[0] as f32 - 1.0), eight.y[i] - (corner[1] as f32 - 1.0)];
            let inside = |a: usize| center[a] + half[a] > 0.5 && center[a] - half[a] < SIDE as f32 - 0.5;
            if inside(0) && inside(1) {
                let value = prepared.base.relative(values[i]);
                self.voxels[begins as usize % slots].push(Record { center, value, place });
            }
        }
    }
}
