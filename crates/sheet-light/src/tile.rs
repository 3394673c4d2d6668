//! One tile from front to back: splat the voxels of a batch of slabs, finish its sheets, shade, add the splats of the slab,
//! composite (Figure 5).

use crate::counts::SheetCounts;
use crate::fold::{Prepared, Sheeted};
use crate::picture::{Fragments, Picture};
use crate::queue::Queue;
use crate::rays::{Crossings, Slopes};
use crate::ring::Ring;
use crate::shade::{Place, Reconstructed, Shader};
use crate::sheets::Sheets;
use crate::slabs::BATCH;
use crate::splats::{Drawn, SplatSheet};
use splat_core::raster::lanes::{Lanes, MAX_LANES};
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
    volumes: Vec<VolumeScratch>,
    splats: SplatSheet,
    /// View depths between which there may be light, counted from the first slab.
    near: Vec<f32>,
    far: Vec<f32>,
    fragments: Fragments,
}

struct VolumeScratch {
    ring: Ring,
    sheets: Sheets,
    crossings: Crossings,
    queue: Queue,
}

impl Scratch {
    pub(crate) fn new(volumes: &[Prepared<'_>]) -> Self {
        let of = |v: &Prepared<'_>| VolumeScratch {
            ring: Ring::new(v.sections.touched),
            sheets: Sheets::new(),
            crossings: Crossings::new(),
            queue: Queue::new(v),
        };
        Self {
            volumes: volumes.iter().map(of).collect(),
            splats: SplatSheet::new(),
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
        let mut picture = Picture::load(self.into, corner, of.params.transmittance_cutoff);
        if picture.open.iter().all(|row| *row == 0) {
            counts.tiles_skipped = 1;
            return (None, counts);
        }
        let span = self.span();
        for (prepared, scratch) in of.volumes.iter().zip(&mut self.scratch.volumes) {
            scratch.queue.fill(prepared, self.t, &span.batches);
        }
        let has_splats =
            self.drawn().is_some_and(|drawn| self.scratch.splats.begin(drawn, corner, &self.range, self.into));
        if !has_splats && self.scratch.volumes.iter().all(|v| v.queue.is_empty()) {
            counts.tiles_skipped = 1;
            return (None, counts);
        }
        let slopes = Slopes::new(of.input.camera, corner, of.slabs.origin);
        for (prepared, scratch) in of.volumes.iter().zip(&mut self.scratch.volumes) {
            scratch.crossings.of_tile(&prepared.rays, &slopes);
            scratch.ring.clear();
            scratch.sheets.clear();
        }
        self.limits(corner);
        self.sweep(simd, &slopes, &span, &mut picture, &mut counts);
        (Some(picture), counts)
    }
}

/// The slabs of a range of depths.
struct Span {
    /// The first one.
    first: u32,
    /// The batches that hold them, their neighbours, and the beginnings of all kernels that reach them.
    batches: Range<u32>,
}

impl<'a> FoldTile<'a> {
    fn span(&self) -> Span {
        let slabs = &self.of.slabs;
        let slab = |z: f64| ((z - slabs.origin) / slabs.width).clamp(0.0, f64::from(slabs.count)) as u32;
        let (first, last) = (slab(self.range.start).max(1), (slab(self.range.end) + 2).min(slabs.count));
        let begin = first.saturating_sub(self.of.touched + 1);
        Span { first, batches: begin / BATCH..last.div_ceil(BATCH) }
    }

    /// What the tile reads of splats, if there are any at all.
    fn drawn(&self) -> Option<Drawn<'a>> {
        let (splats, bins) = (self.of.input.splats.as_ref()?, self.of.bins.as_ref()?);
        Some(Drawn { splats, bins, opaque: self.opaque })
    }

    /// Depths that each pixel may have light at.
    fn limits(&mut self, [left, top]: [usize; 2]) {
        let origin = self.of.slabs.origin;
        let [width, height] = self.into.size.map(|s| s as usize);
        self.scratch.near.fill((self.range.start - origin) as f32);
        self.scratch.far.fill((self.range.end - origin) as f32);
        if self.opaque.is_empty() {
            return;
        }
        for y in 0..TILE.min(height - top) {
            for x in 0..TILE.min(width - left) {
                let depth = f64::from(self.opaque[(top + y) * width + left + x]) - origin;
                let far = &mut self.scratch.far[y * TILE + x];
                *far = far.min(depth as f32);
            }
        }
    }

    #[inline(always)]
    fn sweep<S: Simd>(
        &mut self,
        simd: S,
        slopes: &Slopes,
        span: &Span,
        picture: &mut Picture,
        counts: &mut SheetCounts,
    ) {
        let of = self.of;
        let shader = Shader {
            input: &of.input,
            slabs: &of.slabs,
            layout: self.layout,
            slopes,
            axes: of.input.camera.axes.map(|a| a.as_vec3()),
            lamps: &of.lamps,
        };
        let behind = u32::from(of.has_gradients);
        // Sheets are shaded one later than they are finished where gradients need the one behind.
        let mut next = span.first;
        for batch in span.batches.clone() {
            let wanted = picture.wanted(of.has_gradients);
            for (prepared, scratch) in of.volumes.iter().zip(&mut self.scratch.volumes) {
                let splatter = prepared.splatter();
                let VolumeScratch { ring, sheets, queue, .. } = scratch;
                for record in queue.take(prepared, batch, picture.corner) {
                    counts.records += 1;
                    let fragments = ring.splat(simd, &splatter, record, &wanted);
                    counts.fragments += fragments;
                    counts.hidden += u64::from(fragments == 0);
                }
                ring.take_batch(simd, batch, sheets);
            }
            let end =
                if batch + 1 == span.batches.end { (batch + 1) * BATCH - 1 } else { (batch + 1) * BATCH - behind };
            for slab in next..end {
                self.shade_slab(simd, &shader, slab, picture, counts);
            }
            next = end.max(next);
            picture.find_open();
            if picture.open.iter().all(|row| *row == 0) {
                return;
            }
        }
    }

    /// Shades and composites one sheet of every volume.
    #[inline(always)]
    fn shade_slab<S: Simd>(
        &mut self,
        simd: S,
        shader: &Shader<'_>,
        slab: u32,
        picture: &mut Picture,
        counts: &mut SheetCounts,
    ) {
        let of = self.of;
        if let Some(drawn) = self.drawn() {
            counts.splat_fragments += self.scratch.splats.fill(simd, drawn, (&of.slabs, slab), picture);
        }
        for y in 1..=TILE {
            let mut tags = self.scratch.splats.sums.tags[y];
            for scratch in &self.scratch.volumes {
                tags |= scratch.sheets.tags(slab, y);
            }
            tags &= picture.open[y];
            let mut x = 1;
            while x <= TILE {
                if tags >> x & ((1 << Lanes::<S>::COUNT) - 1) != 0 {
                    counts.shaded += Lanes::<S>::COUNT as u64;
                    let fragments = &mut self.scratch.fragments;
                    fragments.any = false;
                    for (prepared, scratch) in of.volumes.iter().zip(&self.scratch.volumes) {
                        let reconstructed = Reconstructed {
                            prepared,
                            crossings: &scratch.crossings,
                            sheets: &scratch.sheets,
                            limits: [&self.scratch.near, &self.scratch.far],
                        };
                        shader.add(simd, &reconstructed, Place { slab, y, x }, picture, fragments);
                    }
                    self.scratch.splats.sums.add(simd, [x - 1, y - 1], of.slabs.origin, picture, fragments);
                    if fragments.any {
                        picture.composite(simd, y - 1, x - 1, fragments, of.slabs.origin);
                    }
                }
                x += Lanes::<S>::COUNT;
            }
        }
    }
}

/// Tiles of an image, columns and rows.
pub(crate) fn tiles(camera: &Camera) -> [usize; 2] {
    camera.size.map(|s| (s as usize).div_ceil(TILE))
}
