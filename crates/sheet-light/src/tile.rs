//! One tile of the image: what lies in it, and what a thread keeps from tile to tile.

use crate::counts::SheetCounts;
use crate::fold::{Prepared, Sheeted};
use crate::kept::Kept;
use crate::near_eye::NearEye;
use crate::panes::Waiting;
use crate::params::Classify;
use crate::picture::{Fragments, Picture};
use crate::preclassified::Preclassified;
use crate::queue::Queue;
use crate::rays::{Crossings, Slopes};
use crate::ring::Ring;
use crate::sheets::Sheets;
use crate::slabs::BATCH;
use crate::splats::{Drawn, SplatSheet};
use splat_core::raster::lanes::MAX_LANES;
use splat_core::raster::pulp::{self, Simd};
use splat_core::shade::{ChannelLayout, MAX_CHANNELS};
use splat_core::{Accumulator, Camera};
use std::ops::Range;

/// Side of a tile, pixels.
pub(crate) const TILE: usize = 48;

/// Side with the rim of one pixel that gradients are taken from.
pub(crate) const SIDE: usize = TILE + 2;

/// Pixels with the rim.
pub(crate) const AREA: usize = SIDE * SIDE;

/// What a thread keeps from tile to tile.
pub(crate) struct Scratch {
    pub(crate) volumes: Vec<VolumeScratch>,
    pub(crate) splats: SplatSheet,
    pub(crate) panes: Waiting,
    /// View depths between which there may be light, counted from the first slab.
    pub(crate) near: Vec<f32>,
    pub(crate) far: Vec<f32>,
    pub(crate) fragments: Fragments,
}

pub(crate) struct VolumeScratch {
    pub(crate) ring: Ring,
    pub(crate) sheets: Sheets,
    pub(crate) crossings: Crossings,
    pub(crate) queue: Queue,
    pub(crate) kept: Kept,
    /// Where voxels are classified before they are splatted.
    pub(crate) preclassified: Option<Box<Preclassified>>,
    /// Where kernels lie behind the eye.
    pub(crate) near_eye: Option<Box<NearEye>>,
    /// Batches of its own slabs that are not finished yet.
    pub(crate) batches: Range<u32>,
}

impl Scratch {
    pub(crate) fn new(volumes: &[Prepared<'_>]) -> Self {
        let of = |v: &Prepared<'_>| VolumeScratch {
            ring: Ring::new(v.sections.touched),
            sheets: Sheets::new(),
            crossings: Crossings::new(),
            queue: Queue::new(v),
            kept: Kept::new(v.stride),
            preclassified: (v.classify == Classify::Before).then(|| Box::new(Preclassified::new(v.sections.touched))),
            near_eye: v.lacking.as_ref().map(|_| Box::new(NearEye::new(v.sections.touched))),
            batches: 0..0,
        };
        Self {
            volumes: volumes.iter().map(of).collect(),
            splats: SplatSheet::new(),
            panes: Waiting::new(),
            near: vec![0.0; TILE * TILE],
            far: vec![0.0; TILE * TILE],
            fragments: Fragments {
                any: false,
                optical_depth: [[0.0; MAX_LANES]; 3],
                values: [[0.0; MAX_LANES]; MAX_CHANNELS],
                near: [0.0; MAX_LANES],
                far: [0.0; MAX_LANES],
                object: [u32::MAX; MAX_LANES],
            },
        }
    }
}

/// One tile's work, in the form that [`pulp`] compiles once per instruction set.
pub(crate) struct FoldTile<'a> {
    pub(crate) of: &'a Sheeted<'a>,
    pub(crate) layout: &'a ChannelLayout,
    pub(crate) into: &'a Accumulator,
    /// View depths that are folded.
    pub(crate) range: Range<f64>,
    /// Depth of what is opaque, a number a pixel or none at all.
    pub(crate) opaque: &'a [f32],
    pub(crate) t: usize,
    pub(crate) scratch: &'a mut Scratch,
}

impl pulp::WithSimd for FoldTile<'_> {
    type Output = (Option<Picture>, SheetCounts);

    #[inline(always)]
    fn with_simd<S: Simd>(mut self, simd: S) -> Self::Output {
        let mut counts = SheetCounts::default();
        let of = self.of;
        let corner = [self.t % of.tiles[0] * TILE, self.t / of.tiles[0] * TILE];
        let mut picture = Picture::load(self.into, corner, &of.params);
        if picture.open.iter().all(|row| *row == 0) {
            counts.tiles_skipped = 1;
            return (None, counts);
        }
        let span = self.span();
        let before = self.limits(corner);
        for (prepared, scratch) in of.volumes.iter().zip(&mut self.scratch.volumes) {
            scratch.batches = batches(prepared, &(span.start..span.end.min(before)));
            scratch.queue.fill(prepared, self.t, &scratch.batches);
        }
        let has_splats = self.drawn().is_some_and(|drawn| {
            self.scratch.splats.begin(drawn, corner, &self.range, (self.into, of.panes.is_some()))
        });
        let has_panes = self.scratch.panes.begin(of.panes.as_ref(), corner, &self.range);
        if !has_splats && !has_panes && self.scratch.volumes.iter().all(|v| v.queue.is_empty()) {
            counts.tiles_skipped = 1;
            return (None, counts);
        }
        let slopes = Slopes::new(of.input.camera, corner, of.slabs.origin, of.slant);
        if of.slant.is_any() {
            slopes.shear([&mut self.scratch.near, &mut self.scratch.far]);
        }
        for (prepared, scratch) in of.volumes.iter().zip(&mut self.scratch.volumes) {
            scratch.begin(prepared, &slopes);
        }
        self.sweep(simd, &slopes, span, &mut picture, &mut counts);
        let Scratch { panes, fragments, .. } = &mut *self.scratch;
        panes.finish(simd, of.panes.as_ref(), (fragments, &mut picture));
        (Some(picture), counts)
    }
}

impl VolumeScratch {
    /// Forgets the tile before.
    fn begin(&mut self, of: &Prepared<'_>, slopes: &Slopes) {
        self.crossings.of_tile(&of.rays, slopes, &of.slabs);
        self.ring.clear();
        self.sheets.clear();
        self.kept.clear();
        self.preclassified.iter_mut().for_each(|p| p.clear());
        self.near_eye.iter_mut().for_each(|n| n.clear());
        // Nothing begins before.
        self.batches.start = self.batches.start.max(self.queue.active.start / BATCH);
    }
}

/// The batches of a volume's own slabs that lie in a range of slabs, with their neighbours, and the beginnings of all kernels that
/// reach them.
fn batches(of: &Prepared<'_>, span: &Range<u32>) -> Range<u32> {
    let first = span.start / of.stride;
    let last = span.end.saturating_sub(1) / of.stride;
    let begin = first.saturating_sub(of.sections.touched as u32 + 1);
    let behind = if of.lacking.is_some() { 3 } else { 2 };
    begin / BATCH..(last + behind).min(of.slabs.count).div_ceil(BATCH)
}

impl<'a> FoldTile<'a> {
    /// The slabs of the range of depths.
    fn span(&self) -> Range<u32> {
        let slabs = &self.of.slabs;
        if self.of.slant.is_any() {
            // Any depth of the view is in any of them.
            return 1..slabs.count - 1;
        }
        slabs.at(self.range.start).max(1)..(slabs.at(self.range.end) + 1).min(slabs.count - 1)
    }

    /// What the tile reads of splats, if there are any at all.
    pub(crate) fn drawn(&self) -> Option<Drawn<'a>> {
        let splats = self.of.input.splats.as_ref()?;
        let bins = self.of.bins.as_ref()?;
        Some(Drawn { splats, bins, opaque: self.opaque })
    }

    /// Depths that each pixel may have light at; the slab behind all that volumes may be seen in.
    fn limits(&mut self, [left, top]: [usize; 2]) -> u32 {
        let slabs = &self.of.slabs;
        let [width, height] = self.into.size.map(|s| s as usize);
        self.scratch.near.fill((self.range.start - slabs.origin) as f32);
        self.scratch.far.fill((self.range.end - slabs.origin) as f32);
        if self.opaque.is_empty() {
            return slabs.count;
        }
        let mut farthest = f64::NEG_INFINITY;
        for y in 0..TILE.min(height - top) {
            for x in 0..TILE.min(width - left) {
                let depth = f64::from(self.opaque[(top + y) * width + left + x]);
                farthest = farthest.max(depth);
                let far = &mut self.scratch.far[y * TILE + x];
                *far = far.min((depth - slabs.origin) as f32);
            }
        }
        if self.of.slant.is_any() { slabs.count } else { slabs.at(farthest) + 1 }
    }
}

/// Tiles of an image, columns and rows.
pub(crate) fn tiles(camera: &Camera) -> [usize; 2] {
    camera.size.map(|s| (s as usize).div_ceil(TILE))
}
