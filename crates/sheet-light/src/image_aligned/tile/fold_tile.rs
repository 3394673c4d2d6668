//! One tile of the image: what lies in it, and what a thread keeps from tile to tile.

use super::kept::Kept;
use super::near_eye::NearEye;
use super::picture::{Fragments, Picture};
use super::preclassified::Preclassified;
use super::queue::Queue;
use super::rays::{Crossings, Slopes};
use super::ring::Ring;
use super::sheets::Sheets;
use super::size::TILE;
use super::splat_sheet::{Drawn, SplatSheet};
use super::waiting_panes::Waiting;
use crate::image_aligned::counts::SheetCounts;
use crate::image_aligned::prepared::{Prepared, Sheeted};
use crate::shared::params::Classify;
use crate::shared::pixel::PixelForm;
use crate::shared::slabs::BATCH;
use splat_core::Accumulator;
use splat_core::raster::lanes::MAX_LANES;
use splat_core::raster::pulp::{self, Simd};
use splat_core::shade::{ChannelLayout, MAX_CHANNELS};
use std::ops::Range;

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
    /// Its own slabs that hold anything of it in the tile.
    pub(crate) active: Range<u32>,
}

impl Scratch {
    pub(crate) fn new(volumes: &[Prepared<'_>]) -> Self {
        let scratch = |v: &Prepared<'_>| VolumeScratch {
            ring: Ring::new(if v.gathered.is_some() { 0 } else { v.sections.touched }),
            sheets: Sheets::new(),
            crossings: Crossings::new(),
            queue: Queue::new(v),
            kept: Kept::new(v.stride),
            preclassified: (v.classify == Classify::Before).then(|| Box::new(Preclassified::new(v.sections.touched))),
            near_eye: v.lacking.as_ref().map(|_| Box::new(NearEye::new(v.sections.touched))),
            batches: 0..0,
            active: 0..0,
        };
        Self {
            volumes: volumes.iter().map(scratch).collect(),
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
    pub(crate) sheeted: &'a Sheeted<'a>,
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
        let sheeted = self.sheeted;
        let corner = [self.t % sheeted.tiles[0] * TILE, self.t / sheeted.tiles[0] * TILE];
        let mut picture = Picture::load(simd, self.into, corner, &sheeted.params);
        if picture.open.iter().all(|row| *row == 0) {
            counts.tiles_skipped = 1;
            return (None, counts);
        }
        let span = self.span();
        let before = self.limits(corner);
        for (prepared, scratch) in sheeted.volumes.iter().zip(&mut self.scratch.volumes) {
            scratch.batches = batches(prepared, &(span.start..span.end.min(before)));
            if prepared.gathered.is_none() {
                scratch.queue.fill(prepared, self.t, &scratch.batches);
            }
        }
        let has_splats = self.drawn().is_some_and(|drawn| {
            let form = PixelForm::of_image(self.into);
            let form = PixelForm { has_depths: form.has_depths || sheeted.panes.is_some(), ..form };
            self.scratch.splats.begin(drawn, corner, &self.range, form)
        });
        let has_panes = self.scratch.panes.begin(sheeted.panes.as_ref(), corner, &self.range);
        let splats_nothing = |(prepared, scratch): (&Prepared<'_>, &VolumeScratch)| {
            prepared.gathered.is_none() && scratch.queue.is_empty()
        };
        if !has_splats && !has_panes && sheeted.volumes.iter().zip(&self.scratch.volumes).all(splats_nothing) {
            counts.tiles_skipped = 1;
            return (None, counts);
        }
        let slopes = Slopes::new(sheeted.input.camera, corner, sheeted.slabs.origin, sheeted.slant);
        if sheeted.slant.is_any() {
            slopes.shear([&mut self.scratch.near, &mut self.scratch.far]);
        }
        for (prepared, scratch) in sheeted.volumes.iter().zip(&mut self.scratch.volumes) {
            scratch.begin(prepared, &slopes);
        }
        if !has_splats && !has_panes && self.scratch.volumes.iter().all(|v| v.active.is_empty()) {
            counts.tiles_skipped = 1;
            return (None, counts);
        }
        self.sweep(simd, &slopes, span, &mut picture, &mut counts);
        let Scratch { panes, fragments, .. } = &mut *self.scratch;
        panes.finish(simd, sheeted.panes.as_ref(), fragments, &mut picture);
        (Some(picture), counts)
    }
}

impl VolumeScratch {
    /// Forgets the tile before.
    fn begin(&mut self, prepared: &Prepared<'_>, slopes: &Slopes) {
        self.crossings.of_tile(&prepared.rays, slopes, &prepared.slabs);
        self.ring.clear();
        self.sheets.clear();
        self.kept.clear();
        self.preclassified.iter_mut().for_each(|p| p.clear());
        self.near_eye.iter_mut().for_each(|n| n.clear());
        self.active = match prepared.gathered {
            Some(_) => self.crossings.slabs(&prepared.slabs),
            None => self.queue.active.clone(),
        };
        // Nothing begins before, but sheets from which values change to the first one's.
        let before = if prepared.preintegrated.is_some() { prepared.beside() } else { 0 };
        let begin = self.active.start.saturating_sub(before);
        self.batches.start = self.batches.start.max(begin / BATCH);
    }
}

/// The batches of a volume's own slabs that lie in a range of slabs, with their neighbours, and the beginnings of all kernels that
/// reach them.
fn batches(prepared: &Prepared<'_>, span: &Range<u32>) -> Range<u32> {
    let first = span.start / prepared.stride;
    let last = span.end.saturating_sub(1) / prepared.stride;
    let begin = first.saturating_sub(prepared.sections.touched as u32 + 1);
    let behind = if prepared.lacking.is_some() { 3 } else { prepared.beside() + 1 };
    begin / BATCH..(last + behind).min(prepared.slabs.count).div_ceil(BATCH)
}

impl<'a> FoldTile<'a> {
    /// The slabs of the range of depths.
    fn span(&self) -> Range<u32> {
        let slabs = &self.sheeted.slabs;
        if self.sheeted.slant.is_any() {
            // Any depth of the view is in any of them.
            return 1..slabs.count - 1;
        }
        slabs.slab_at(self.range.start).max(1)..(slabs.slab_at(self.range.end) + 1).min(slabs.count - 1)
    }

    /// What the tile reads of splats, if there are any at all.
    pub(crate) fn drawn(&self) -> Option<Drawn<'a>> {
        let splats = self.sheeted.input.splats.as_ref()?;
        let bins = self.sheeted.bins.as_ref()?;
        Some(Drawn { splats, bins, opaque: self.opaque })
    }

    /// Depths that each pixel may have light at; the slab behind all that volumes may be seen in.
    fn limits(&mut self, corner: [usize; 2]) -> u32 {
        let [left, top] = corner;
        let slabs = &self.sheeted.slabs;
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
        if self.sheeted.slant.is_any() { slabs.count } else { slabs.slab_at(farthest) + 1 }
    }
}
