//! A tile from front to back: splat the voxels of a batch of slabs, finish its sheets, shade, add the splats of the slab,
//! composite (Figure 5).
//!
//! Each volume has slabs of its own, some of all volumes' slabs each. The sweep goes from face to face of what is there: of the
//! volumes that have kernels at a depth, and of slabs that hold splats. So a coarse volume costs its own slabs where it is alone,
//! and where it shares them its values and its light are those of its own slab, over the length of each part.

use super::fold_tile::{FoldTile, Scratch, VolumeScratch};
use super::picture::{Fragments, Picture};
use super::place::Place;
use super::rays::Slopes;
use super::shade::{Reconstructed, Shader};
use super::size::TILE;
use super::splat_sheet::SplatSheet;
use super::waiting_panes::NthPane;
use crate::image_aligned::counts::SheetCounts;
use crate::image_aligned::gather::SheetLines;
use crate::image_aligned::prepared::{Prepared, Sheeted};
use crate::shared::depths::{DepthRange, DepthSpans};
use crate::shared::pixel::Pixel;
use crate::shared::slabs::BATCH;
use splat_core::raster::lanes::{Lanes, MAX_LANES};
use splat_core::raster::pulp::Simd;
use std::ops::Range;

/// Pixels of a row of a tile, without its rim.
pub(crate) const INTERIOR: u64 = ((1 << TILE) - 1) << 1;

impl VolumeScratch {
    /// The volume's own slab at a slab, if any kernel reaches it.
    #[inline(always)]
    fn own_slab(&self, prepared: &Prepared<'_>, slab: u32) -> Option<u32> {
        let slab_of_volume = slab / prepared.stride;
        self.active.contains(&slab_of_volume).then_some(slab_of_volume)
    }

    /// Whether the sheet there, or the next one, which tells how values go on, is not finished. Beside the eye the next one needs another; a course of values needs two.
    #[inline(always)]
    fn needs(&self, prepared: &Prepared<'_>, slab: u32) -> bool {
        let is_near = prepared.lacking.as_ref().is_some_and(|lacking| slab / prepared.stride < lacking.end);
        let more = if is_near { 2 } else { prepared.beside() };
        let is_behind = |slab| !self.batches.is_empty() && self.batches.start * BATCH <= slab + more;
        self.own_slab(prepared, slab).is_some_and(is_behind)
    }

    /// Splats and finishes the next batch of sheets.
    #[inline(always)]
    fn finish<S: Simd>(
        &mut self,
        simd: S,
        prepared: &Prepared<'_>,
        slopes: &Slopes,
        picture: &Picture,
        counts: &mut SheetCounts,
    ) {
        let batch = self.batches.start;
        self.batches.start += 1;
        let mask = picture.mask(prepared.compares);
        if let Some(gathered) = &prepared.gathered {
            let lines = SheetLines {
                rays: &prepared.rays,
                slopes,
                slabs: &prepared.slabs,
                crossings: &self.crossings,
                beside: prepared.beside(),
            };
            counts.fragments += lines.batch(simd, gathered, batch, &mask, &mut self.sheets);
            return;
        }
        let splatter = prepared.splatter();
        let is_near = |lacking: &Range<u32>| batch <= lacking.end / BATCH;
        let mut near_eye = self.near_eye.as_deref_mut().filter(|_| prepared.lacking.as_ref().is_some_and(is_near));
        for record in self.queue.take(prepared, batch, picture.corner) {
            counts.records += 1;
            let fragments = self.ring.splat(simd, &splatter, record, &mask);
            counts.fragments += fragments;
            counts.hidden += u64::from(fragments == 0);
            if let Some(near_eye) = &mut near_eye {
                counts.fragments += near_eye.splat(simd, &splatter, &prepared.slabs, record, &mask);
            }
            if let Some(preclassified) = &mut self.preclassified {
                counts.fragments += preclassified.splat(simd, &splatter, &prepared.classifier, record, &mask);
            }
        }
        self.ring.take_batch(simd, batch, &mut self.sheets);
        if let Some(near_eye) = near_eye {
            near_eye.take_batch(simd, prepared, batch, &mut self.sheets);
        }
        if let Some(preclassified) = &mut self.preclassified {
            preclassified.take_batch(simd, batch);
        }
    }
}

impl FoldTile<'_> {
    #[inline(always)]
    pub(crate) fn sweep<S: Simd>(
        &mut self,
        simd: S,
        slopes: &Slopes,
        span: Range<u32>,
        picture: &mut Picture,
        counts: &mut SheetCounts,
    ) {
        let sheeted = self.sheeted;
        let shader = Shader {
            input: &sheeted.input,
            layout: self.layout,
            slopes,
            axes: sheeted.input.camera.axes.map(|a| a.as_vec3()),
            lamps: &sheeted.lamps,
        };
        let is_alone = self.is_alone(picture);
        let mut slab = span.start;
        let mut steps = 0;
        while slab < span.end {
            if self.needs_batch(slab) || steps % BATCH == 0 {
                picture.find_open(simd);
                picture.lit = picture.open;
                if !self.opaque.is_empty() {
                    picture.close(&self.scratch.far, sheeted.slabs.face(slab));
                }
                // A splat behind what is opaque may reach before it.
                let left = if self.scratch.splats.is_empty() { &picture.lit } else { &picture.open };
                if left.iter().all(|row| *row == 0) {
                    return;
                }
                self.finish(simd, shader.slopes, slab, picture, counts);
            }
            let end = if is_alone { self.run_end(slab, span.end) } else { self.next_face(slab, span.end) };
            if is_alone {
                self.shade_run(simd, &shader, slab..end, picture, counts);
                steps = 0;
            } else {
                self.shade(simd, &shader, slab..end, picture, counts);
                steps += 1;
            }
            slab = end;
        }
    }

    /// Whether a sheet of this slab, or the one behind it, is not finished.
    pub(crate) fn needs_batch(&self, slab: u32) -> bool {
        self.sheeted.volumes.iter().zip(&self.scratch.volumes).any(|(prepared, scratch)| scratch.needs(prepared, slab))
    }

    /// Finishes the sheets that are needed.
    #[inline(always)]
    fn finish<S: Simd>(&mut self, simd: S, slopes: &Slopes, slab: u32, picture: &Picture, counts: &mut SheetCounts) {
        for (prepared, scratch) in self.sheeted.volumes.iter().zip(&mut self.scratch.volumes) {
            while scratch.needs(prepared, slab) {
                scratch.finish(simd, prepared, slopes, picture, counts);
            }
        }
    }

    /// Where what is there changes next: a face of a volume's own slabs, or the slab of a splat.
    pub(crate) fn next_face(&self, slab: u32, end: u32) -> u32 {
        let mut next = end;
        for (prepared, scratch) in self.sheeted.volumes.iter().zip(&self.scratch.volumes) {
            let slab_of_volume = slab / prepared.stride;
            let active = &scratch.active;
            if slab_of_volume < active.end {
                next = next.min(active.start.max(slab_of_volume + 1).saturating_mul(prepared.stride));
            }
        }
        if let Some(splat) =
            self.drawn().and_then(|drawn| self.scratch.splats.next_slab(drawn.splats, &self.sheeted.slabs))
        {
            next = next.min(splat.max(slab + 1));
        }
        next
    }

    /// Shades and composites what all volumes and splats have between two faces.
    #[inline(always)]
    fn shade<S: Simd>(
        &mut self,
        simd: S,
        shader: &Shader<'_>,
        step: Range<u32>,
        picture: &mut Picture,
        counts: &mut SheetCounts,
    ) {
        let sheeted = self.sheeted;
        let drawn = self.drawn();
        let Scratch { volumes, splats, panes, near, far, fragments } = &mut *self.scratch;
        if let Some(drawn) = drawn {
            counts.splat_fragments += splats.fill(simd, drawn, &sheeted.slabs, step.end - 1, picture);
        }
        let faces = DepthRange { near: sheeted.slabs.face(step.start), far: sheeted.slabs.face(step.end) };
        let polygons = sheeted.panes.as_ref();
        for y in 1..=TILE {
            let mut tags = 0;
            for (prepared, scratch) in sheeted.volumes.iter().zip(volumes.iter()) {
                tags |= scratch.own_slab(prepared, step.start).map_or(0, |slab| scratch.sheets.tags(slab, y));
            }
            counts.touched += u64::from((tags & INTERIOR).count_ones());
            let tags = tags & picture.lit[y] | splats.sums.tags[y] & picture.open[y];
            for x in (1..=TILE).step_by(Lanes::<S>::COUNT) {
                let first = Pixel { x: x - 1, y: y - 1 };
                let is_any = tags >> x & ((1 << Lanes::<S>::COUNT) - 1) != 0;
                // Polygons are composited in order, with what lies before, among and behind them.
                let most = panes.most::<S>(polygons, first, faces.far);
                for n in 0..=most {
                    let nth = NthPane { first, n, end: faces.far };
                    if is_any {
                        let part = polygons.filter(|_| most > 0).map(|polygons| panes.part_before::<S>(polygons, nth));
                        let limits = Limits { near, far, part: part.as_ref(), faces };
                        counts.shaded += Lanes::<S>::COUNT as u64;
                        let mut between = Between { sheeted, volumes, splats, fragments, shader, picture };
                        between.shade(simd, Pixel { x, y }, &step, &limits);
                    }
                    if let Some(polygons) = polygons.filter(|_| n < most) {
                        panes.composite(simd, polygons, nth, fragments, picture);
                    }
                }
            }
            if let Some(polygons) = polygons {
                panes.pass(polygons, y - 1, faces.far);
            }
        }
    }
}

/// Depths, counted from the first slab, between which neighbouring pixels are shaded.
struct Limits<'a> {
    /// Of each pixel of the tile.
    near: &'a [f32],
    far: &'a [f32],
    /// Of each of the neighbours, where polygons part what they have.
    part: Option<&'a DepthSpans>,
    faces: DepthRange,
}

/// What lies between two faces.
struct Between<'a, 'b> {
    sheeted: &'a Sheeted<'b>,
    volumes: &'a mut [VolumeScratch],
    splats: &'a SplatSheet,
    fragments: &'a mut Fragments,
    shader: &'a Shader<'a>,
    picture: &'a mut Picture,
}

impl Between<'_, '_> {
    /// Shades and composites it in neighbouring pixels of the tile with its rim.
    #[inline(always)]
    fn shade<S: Simd>(&mut self, simd: S, first: Pixel, step: &Range<u32>, limits: &Limits<'_>) {
        let Self { sheeted, volumes, splats, fragments, shader, picture } = self;
        let Limits { near, far, part, faces } = *limits;
        let Pixel { x, y } = first;
        let origin = sheeted.slabs.origin;
        let open = (picture.open[y] >> x) as u32;
        fragments.any = false;
        for (prepared, scratch) in sheeted.volumes.iter().zip(volumes.iter_mut()) {
            let Some(slab) = scratch.own_slab(prepared, step.start) else {
                continue;
            };
            let VolumeScratch { sheets, crossings, kept, preclassified, .. } = scratch;
            // What polygons part is lit part by part.
            let is_part = part.is_none() && step.len() < prepared.stride as usize;
            let limits = [near, far];
            let preclassified = preclassified.as_deref();
            let is_whole = false;
            let reconstructed = Reconstructed {
                prepared,
                crossings,
                sheets,
                preclassified,
                limits,
                part,
                faces,
                is_part,
                is_whole,
                open,
            };
            shader.add(simd, &reconstructed, Place { slab, y, x }, picture, kept, fragments);
        }
        let inner = Pixel { x: x - 1, y: y - 1 };
        let mut share = [1.0; MAX_LANES];
        if let Some(spans) = part {
            share = splats.sums.between(simd, inner, origin, spans);
        }
        splats.sums.add(simd, inner, origin, &share, fragments);
        if fragments.any {
            if sheeted.slant.is_any() {
                shader.slopes.unshear(first, [&mut fragments.near, &mut fragments.far]);
            }
            picture.composite(simd, y - 1, x - 1, fragments, origin);
        }
    }
}
