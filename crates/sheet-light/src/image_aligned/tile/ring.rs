//! Sheet buffers in the making: eight slabs of a pixel beside each other, so that a voxel adds all its sections at once.
//!
//! The paper keeps four slabs in the four colours of a pixel and turns them, R, G, B, A, R … (section 4.2, Figure 2). Here a pixel
//! has a line of sixteen numbers, Σ v·w and Σ w of eight slabs: one cache line, and one to four vectors. Slab s has place s mod 8.
//! A fragment is one footprint number times the voxel's line of sections, added to the pixel's line. Slabs are finished in
//! batches of four, half a line; five sections that begin in one half end in the other. Kernels that touch more slabs have as many
//! lines a pixel as they need.

use super::sheets::Sheets;
use super::size::{AREA, SIDE};
use crate::image_aligned::viewed::{PixelFootprint, Viewed};
use crate::shared::sections::{PHASES, SectionTable};
use crate::shared::slabs::BATCH;
use crate::shared::sums::rounded;
use crate::shared::vectors::COUNTING;
use splat_core::raster::kernel::Kernel;
use splat_core::raster::lanes::{Broadcast, Lanes, MAX_LANES};
use splat_core::raster::pulp::Simd;
use splat_core::raster::tile::Line;
use std::ops::Range;

/// Numbers between rows of a footprint.
const STRIDE: usize = SIDE + MAX_LANES;

/// Slabs in a line.
const SLABS: u32 = 8;

/// A voxel on its way into a tile.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Record {
    /// Pixels from the corner of the tile with its rim.
    pub(crate) center: [f32; 2],
    /// Value, less the volume's base.
    pub(crate) value: f32,
    /// Where its kernel begins, 256ths of a slab.
    pub(crate) place: u32,
}

/// Pixels of a tile that a footprint covers.
struct Rectangle {
    columns: Range<usize>,
    rows: Range<usize>,
}

/// The lines of one volume in one tile.
#[derive(Debug)]
pub(crate) struct Ring {
    /// Line by line of all pixels.
    lines: Vec<Line>,
    /// Lines a pixel.
    count: u32,
    /// By batch, modulo twice the lines: pixels of each row that were touched, a bit each.
    tags: Vec<[u64; SIDE]>,
    /// The footprint of one voxel, row by row.
    weights: Vec<f32>,
    /// s and Gaussian of its rows.
    rows: [[f32; STRIDE]; 2],
    is_clean: bool,
}

/// What all voxels of one volume share.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Splatter<'a> {
    pub(crate) viewed: &'a Viewed,
    pub(crate) kernel: &'a Kernel,
    pub(crate) taper: Taper,
    pub(crate) sections: &'a SectionTable,
    /// Whether sums are rounded to half precision.
    pub(crate) half: bool,
    /// The footprint of all voxels, where rays are parallel.
    pub(crate) footprint: Option<PixelFootprint>,
}

/// What a Gaussian e^(−qs) loses so that it ends smoothly at s = 1: −e^(−q)·(1 + y + y²/2), y = q(1 − s), by powers of s.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Taper {
    sharpness: f32,
    polynomial: [f32; 3],
}

impl Taper {
    pub(crate) fn new(sharpness: f64) -> Self {
        let q = sharpness;
        let rim = -libm::exp(-sharpness);
        let powers = [1.0 + q + 0.5 * q * q, -q - q * q, 0.5 * q * q];
        Self { sharpness: q as f32, polynomial: powers.map(|c| (rim * c) as f32) }
    }
}

impl Ring {
    /// Lines a pixel for kernels that touch so many slabs.
    pub(crate) fn lines_for(touched: usize) -> u32 {
        (touched as u32 + BATCH - 1).div_ceil(SLABS)
    }

    pub(crate) fn new(touched: usize) -> Self {
        let count = Self::lines_for(touched);
        Self {
            lines: vec![Line([0.0; 16]); count as usize * AREA],
            count,
            tags: vec![[0; SIDE]; 2 * count as usize],
            weights: vec![0.0; SIDE * STRIDE],
            rows: [[0.0; STRIDE]; 2],
            is_clean: true,
        }
    }

    /// Forgets what was added.
    pub(crate) fn clear(&mut self) {
        if !self.is_clean {
            self.lines.fill(Line([0.0; 16]));
            self.tags.fill([0; SIDE]);
            self.is_clean = true;
        }
    }

    fn tags_of(&self, batch: u32) -> usize {
        (batch % (2 * self.count)) as usize
    }

    /// Adds a voxel to the pixels of the rows of which any is in `mask`. Number of fragments.
    #[inline(always)]
    pub(crate) fn splat<S: Simd>(
        &mut self,
        simd: S,
        splatter: &Splatter<'_>,
        record: &Record,
        mask: &[u64; SIDE],
    ) -> u64 {
        let footprint = match splatter.footprint {
            Some(footprint) => footprint,
            None => {
                let Some(scale) = splatter.viewed.scale(splatter.viewed.depth(record.place)) else {
                    return 0;
                };
                splatter.viewed.footprint(scale)
            }
        };
        let columns = pixels(record.center[0], footprint.half[0]);
        let rows = pixels(record.center[1], footprint.half[1]);
        if columns.is_empty() || rows.is_empty() {
            return 0;
        }
        let width = columns.len();
        let span = (!0u64 >> (64 - width)) << columns.start;
        let mask = &mask[rows.clone()];
        if mask.iter().fold(0, |any, row| any | row) & span == 0 {
            return 0;
        }
        let first = record.place / PHASES;
        let last = record.place / PHASES + splatter.sections.touched as u32 - 1;
        self.tag(first, last, rows.clone(), span);
        let rectangle = Rectangle { columns, rows };
        if footprint.conic[1] == 0.0 {
            self.upright(simd, splatter, record, &footprint, &rectangle);
        } else {
            self.slanted(simd, splatter, record, &footprint, &rectangle);
        }
        let Rectangle { columns, rows } = rectangle;
        let mut touched = 0;
        let mut line = first / SLABS;
        while line <= last / SLABS {
            let (sums, plane) = self.line(splatter.sections, record, line);
            let covered = plane + rows.start * SIDE + columns.start..plane + (rows.end - 1) * SIDE + columns.end;
            let lines = &mut self.lines[covered.clone()];
            touched = Covered { lines, weights: &self.weights, mask, span }.add(simd, &sums, width);
            if splatter.half {
                round(simd, &mut self.lines[covered], width);
            }
            // With one line a pixel, what runs over its end went on at its beginning.
            line += if self.count == 1 { 2 } else { 1 };
        }
        touched * width as u64
    }

    /// A footprint whose axes are those of the image. The Gaussian is a product then, e^(−qs) = e^(−q·a·dx²)·e^(−q·c·dy²), and its
    /// Taylor polynomial at the rim is one of degree 2 in s: six operations a row.
    #[inline(always)]
    fn upright<S: Simd>(
        &mut self,
        simd: S,
        splatter: &Splatter<'_>,
        record: &Record,
        footprint: &PixelFootprint,
        rectangle: &Rectangle,
    ) {
        let [a, _, c] = footprint.conic;
        let q = simd.lanes(splatter.taper.sharpness);
        let rim = splatter.taper.polynomial;
        let Rectangle { columns, rows } = rectangle;
        let mut y = rows.start;
        while y < rows.end {
            let dy = simd.lanes(y as f32 + 0.5 - record.center[1]) + Lanes::load(simd, &COUNTING);
            let s = simd.lanes(c) * dy * dy;
            s.store(&mut self.rows[0][y - rows.start..]);
            (q * s).exp_neg().store(&mut self.rows[1][y - rows.start..]);
            y += Lanes::<S>::COUNT;
        }
        let mut x = columns.start;
        while x < columns.end {
            let dx = simd.lanes(x as f32 + 0.5 - record.center[0]) + Lanes::load(simd, &COUNTING);
            let across = simd.lanes(a) * dx * dx;
            let gauss = (q * across).exp_neg();
            for row in 0..rows.len() {
                let s = across + simd.lanes(self.rows[0][row]);
                let taper = simd.lanes(rim[2]).mul_add(s, simd.lanes(rim[1])).mul_add(s, simd.lanes(rim[0]));
                let weight = gauss
                    .mul_add(simd.lanes(self.rows[1][row]), taper)
                    .max(simd.lanes(0.0))
                    .where_less(s, simd.lanes(1.0));
                weight.store(&mut self.weights[row * STRIDE + x - columns.start..]);
            }
            x += Lanes::<S>::COUNT;
        }
    }

    /// Any other footprint.
    #[inline(always)]
    fn slanted<S: Simd>(
        &mut self,
        simd: S,
        splatter: &Splatter<'_>,
        record: &Record,
        footprint: &PixelFootprint,
        rectangle: &Rectangle,
    ) {
        let [a, b, c] = footprint.conic;
        let Rectangle { columns, rows } = rectangle;
        for y in rows.clone() {
            let dy = y as f32 + 0.5 - record.center[1];
            let mut x = columns.start;
            while x < columns.end {
                let dx = simd.lanes(x as f32 + 0.5 - record.center[0]) + Lanes::load(simd, &COUNTING);
                let s = simd.lanes(a).mul_add(dx, simd.lanes(2.0 * b * dy)).mul_add(dx, simd.lanes(c * dy * dy));
                let weight = splatter.kernel.profile(simd, (simd.lanes(1.0) - s).max(simd.lanes(0.0)));
                weight.store(&mut self.weights[(y - rows.start) * STRIDE + x - columns.start..]);
                x += Lanes::<S>::COUNT;
            }
        }
    }

    #[inline(always)]
    fn tag(&mut self, first: u32, last: u32, rows: Range<usize>, span: u64) {
        self.is_clean = false;
        for batch in first / BATCH..=last / BATCH {
            let tags = self.tags_of(batch);
            for row in &mut self.tags[tags][rows.clone()] {
                *row |= span;
            }
        }
    }

    /// What a voxel adds to the line of slabs 8·`line` to 8·`line` + 7, times the footprint; and where the lines of that place begin.
    #[inline(always)]
    fn line(&self, sections: &SectionTable, record: &Record, line: u32) -> ([f32; 16], usize) {
        let first = record.place / PHASES;
        let phase = record.place % PHASES;
        let begin = (SLABS * line) as isize - first as isize;
        let mut out = [0.0; 16];
        let eight = sections.eight(phase, begin);
        out[8..].copy_from_slice(eight);
        let next = begin + SLABS as isize;
        if self.count == 1 && next < sections.touched as isize {
            let eight = sections.eight(phase, next);
            for s in 0..8 {
                out[8 + s] += eight[s];
            }
        }
        for s in 0..8 {
            out[s] = out[8 + s] * record.value;
        }
        (out, (line % self.count) as usize * AREA)
    }

    /// Moves the sums of a batch's slabs to its sheets.
    #[inline(always)]
    pub(crate) fn take_batch<S: Simd>(&mut self, simd: S, batch: u32, sheets: &mut Sheets) {
        let tags = self.tags_of(batch);
        let plane = (batch / 2 % self.count) as usize * AREA;
        for y in 0..SIDE {
            let bits = std::mem::take(&mut self.tags[tags][y]);
            sheets.begin_row(batch * BATCH, y, bits);
            if bits == 0 {
                continue;
            }
            let row = &mut self.lines[plane + y * SIDE..][..SIDE];
            let range = bits.trailing_zeros() as usize..64 - bits.leading_zeros() as usize;
            if batch.is_multiple_of(2) {
                take::<0>(row, range.clone(), batch * BATCH, y, sheets);
            } else {
                take::<4>(row, range.clone(), batch * BATCH, y, sheets);
            }
            sheets.normalize_row(simd, batch * BATCH, y, range);
        }
    }
}

/// Moves half of the lines of a row.
#[inline(always)]
fn take<const AT: usize>(row: &mut [Line], range: Range<usize>, slab: u32, y: usize, sheets: &mut Sheets) {
    for x in range {
        let line = &mut row[x].0;
        for s in 0..BATCH as usize {
            sheets.put(slab + s as u32, y, x, line[AT + s], line[8 + AT + s]);
        }
        line[AT..AT + 4].copy_from_slice(&[0.0; 4]);
        line[8 + AT..12 + AT].copy_from_slice(&[0.0; 4]);
    }
}

/// Pixels whose centres lie within `half` of a place, as far as the tile goes.
#[inline(always)]
fn pixels(center: f32, half: f32) -> Range<usize> {
    // Saturating casts: what lies before the tile is 0.
    let low = (center - half - 0.5).ceil();
    let high = (center + half + 0.5).floor();
    low.max(0.0) as usize..(high as usize).min(SIDE)
}

/// The part of the lines that a footprint covers, row by row.
struct Covered<'a> {
    lines: &'a mut [Line],
    weights: &'a [f32],
    /// Pixels of each row that are wanted, and those of the footprint, a bit each.
    mask: &'a [u64],
    span: u64,
}

impl Covered<'_> {
    /// Adds weight times `sums` to the lines of the rows of which any pixel is wanted. Rows.
    #[inline(always)]
    fn add<S: Simd>(self, simd: S, sums: &[f32; 16], width: usize) -> u64 {
        let mut parts = [simd.lanes(0.0); 16];
        for p in 0..16 / Lanes::<S>::COUNT {
            parts[p] = Lanes::load(simd, &sums[p * Lanes::<S>::COUNT..]);
        }
        // Footprints of some pixels have rows of two lengths or so: no loop whose end has to be guessed at each of them.
        match width {
            5 => self.rows::<S, 5>(simd, &parts),
            6 => self.rows::<S, 6>(simd, &parts),
            7 => self.rows::<S, 7>(simd, &parts),
            8 => self.rows::<S, 8>(simd, &parts),
            9 => self.rows::<S, 9>(simd, &parts),
            10 => self.rows::<S, 10>(simd, &parts),
            11 => self.rows::<S, 11>(simd, &parts),
            12 => self.rows::<S, 12>(simd, &parts),
            _ => self.any_rows(simd, &parts, width),
        }
    }

    #[inline(always)]
    fn rows<S: Simd, const WIDTH: usize>(self, simd: S, parts: &[Lanes<S>; 16]) -> u64 {
        let mut rows = 0;
        for (y, mask) in self.mask.iter().enumerate() {
            let lines = &mut self.lines[y * SIDE..];
            let weights = &self.weights[y * STRIDE..];
            let (Some(lines), Some(weights)) = (lines.first_chunk_mut::<WIDTH>(), weights.first_chunk::<WIDTH>())
            else {
                break;
            };
            if mask & self.span != 0 {
                rows += 1;
                for x in 0..WIDTH {
                    add_line(simd, &mut lines[x], weights[x], parts);
                }
            }
        }
        rows
    }

    #[inline(always)]
    fn any_rows<S: Simd>(self, simd: S, parts: &[Lanes<S>; 16], width: usize) -> u64 {
        let mut rows = 0;
        for (y, mask) in self.mask.iter().enumerate() {
            if mask & self.span != 0 {
                rows += 1;
                let lines = &mut self.lines[y * SIDE..][..width];
                for (line, weight) in lines.iter_mut().zip(&self.weights[y * STRIDE..]) {
                    add_line(simd, line, *weight, parts);
                }
            }
        }
        rows
    }
}

/// Rounds the lines of the first pixels of each row to half precision.
#[inline(always)]
fn round<S: Simd>(simd: S, lines: &mut [Line], width: usize) {
    for row in lines.chunks_mut(SIDE) {
        for line in &mut row[..width] {
            for part in line.0.chunks_exact_mut(Lanes::<S>::COUNT) {
                rounded(simd, Lanes::load(simd, part)).store(part);
            }
        }
    }
}

#[inline(always)]
fn add_line<S: Simd>(simd: S, line: &mut Line, weight: f32, parts: &[Lanes<S>; 16]) {
    let weight = simd.lanes(weight);
    for p in 0..16 / Lanes::<S>::COUNT {
        let to = &mut line.0[p * Lanes::<S>::COUNT..];
        weight.mul_add(parts[p], Lanes::load(simd, to)).store(to);
    }
}
