//! Sums over the splats of one slab, block by block of 4x4 pixels: optical depths add, all else weighs by them.

use super::pixel::{Pixel, PixelForm};
use splat_core::Material;
use splat_core::raster::lanes::{Broadcast, Lanes, MAX_LANES};
use splat_core::raster::pulp::Simd;
use splat_core::raster::source::{Source, TileRays};
use splat_core::raster::tile::{Line, PIXELS, Run};
use splat_core::shade::{ChannelLayout, MAX_CHANNELS};

/// Side of a block of pixels.
pub(crate) const BLOCK: usize = 4;

/// The sums of some blocks.
#[derive(Debug, Clone, Default)]
pub(crate) struct Lines {
    /// For each block, by line: optical depths and the channels times them; then, where depths are asked for, view depth and
    /// thickness times the optical depth.
    lines: Vec<Line>,
    /// The first object of each pixel, block by block.
    objects: Vec<u32>,
    /// Blocks in a row.
    columns: usize,
    stride: usize,
    planes: usize,
    channels: usize,
    has_depths: bool,
}

/// What neighbouring pixels have, which splats are blended into.
pub(crate) struct Backdrop<'a> {
    /// By plane.
    pub(crate) optical_depth: &'a mut [[f32; MAX_LANES]; 3],
    /// By channel.
    pub(crate) values: &'a mut [[f32; MAX_LANES]; MAX_CHANNELS],
    /// Whether anything is there; what the arrays hold has no meaning otherwise.
    pub(crate) is_any: bool,
}

/// Splats that lie in neighbouring pixels, green.
#[derive(Default)]
pub(crate) struct PixelDepths {
    pub(crate) optical_depth: [f32; MAX_LANES],
    /// Mean view depth, and mean thickness; 0 where depths are not kept.
    pub(crate) depth: [f32; MAX_LANES],
    pub(crate) thickness: [f32; MAX_LANES],
}

/// One splat, and what it shows.
pub(crate) struct Shown<'a> {
    pub(crate) source: Source<'a>,
    /// A number for each channel.
    pub(crate) values: &'a [f32],
    pub(crate) object: u32,
}

impl Lines {
    /// Nothing yet, of `blocks` blocks in rows of `columns`.
    pub(crate) fn resize(&mut self, blocks: usize, columns: usize, form: PixelForm) {
        self.planes = form.planes;
        self.channels = form.channels;
        self.columns = columns;
        self.has_depths = form.has_depths;
        self.stride = self.planes + self.channels + if self.has_depths { 2 } else { 0 };
        self.lines.clear();
        self.lines.resize(blocks * self.stride, Line([0.0; PIXELS]));
        self.objects.clear();
        self.objects.resize(if form.has_objects { blocks * PIXELS } else { 0 }, u32::MAX);
    }

    /// Forgets everything.
    pub(crate) fn clear(&mut self) {
        self.lines.fill(Line([0.0; PIXELS]));
        self.objects.fill(u32::MAX);
    }

    /// Whether there is no block.
    pub(crate) fn is_empty(&self) -> bool {
        self.lines.is_empty()
    }

    /// Adds the optical depths of others, which keep nothing else.
    pub(crate) fn join(&mut self, other: &Self) {
        if self.is_empty() {
            self.clone_from(other);
            return;
        }
        for (to, from) in self.lines.iter_mut().zip(&other.lines) {
            to.0.iter_mut().zip(from.0).for_each(|(to, from)| *to += from);
        }
    }

    /// Optical depth of a pixel by plane, 0 where there is no block.
    #[inline]
    pub(crate) fn optical_depth(&self, plane: usize, pixel: Pixel) -> f32 {
        let Pixel { x, y } = pixel;
        let block = y / BLOCK * self.columns + x / BLOCK;
        self.lines.get(block * self.stride + plane).map_or(0.0, |line| line.0[y % BLOCK * BLOCK + x % BLOCK])
    }

    /// Bytes of all sums.
    pub(crate) fn bytes(&self) -> u64 {
        (size_of_val(&*self.lines) + size_of_val(&*self.objects)) as u64
    }

    /// Adds a splat to a run of pixels of a block.
    #[inline(always)]
    pub(crate) fn add<S: Simd>(
        &mut self,
        simd: S,
        splat: &Shown<'_>,
        materials: &[Material],
        run: Run<S>,
        rays: &TileRays,
        block: Pixel,
    ) {
        let Shown { source, values, object } = splat;
        let extinction = materials[source.splat.material as usize].extinction_rgb;
        let block = block.y * self.columns + block.x;
        let tau = source.optical_depth(simd, run, rays);
        let lines = &mut self.lines[block * self.stride..][..self.stride];
        let mut add = |line: usize, v: Lanes<S>| {
            let to = &mut lines[line].0[run.lane..];
            (Lanes::load(simd, to) + v).store(to);
        };
        let of_plane = |p: usize| tau * simd.lanes(extinction[p]);
        (0..self.planes).for_each(|p| add(p, of_plane(p)));
        for (c, value) in values.iter().enumerate() {
            let p = ChannelLayout::plane_of(c, self.channels, self.planes);
            add(self.planes + c, of_plane(p) * simd.lanes(*value));
        }
        if self.has_depths {
            let green = of_plane(self.planes / 2);
            let line = self.planes + self.channels;
            add(line, green * source.view_depth(simd, run, rays));
            add(line + 1, green * simd.lanes(source.thickness()));
        }
        if !self.objects.is_empty() {
            self.name::<S>(*object, block * PIXELS + run.lane, tau);
        }
    }

    /// Names the pixels that a splat is the first to hide something of.
    #[inline(always)]
    fn name<S: Simd>(&mut self, object: u32, index: usize, tau: Lanes<S>) {
        let mut hidden = [0.0; MAX_LANES];
        tau.store(&mut hidden);
        for (to, tau) in self.objects[index..].iter_mut().zip(&hidden[..Lanes::<S>::COUNT]) {
            if *tau > 0.0 && *to == u32::MAX {
                *to = object;
            }
        }
    }

    /// The pixels from `first` on, of one line.
    #[inline(always)]
    fn row<S: Simd>(&self, simd: S, line: usize, first: Pixel) -> Lanes<S> {
        let Pixel { x, y } = first;
        let mut row = [0.0; MAX_LANES];
        for group in 0..Lanes::<S>::COUNT / BLOCK {
            let block = y / BLOCK * self.columns + x / BLOCK + group;
            let from = &self.lines[block * self.stride + line].0[y % BLOCK * BLOCK..][..BLOCK];
            row[group * BLOCK..][..BLOCK].copy_from_slice(from);
        }
        Lanes::load(simd, &row)
    }

    /// Adds a share of the pixels from `first` on to what is there already. Returns the share that splats then have of green.
    #[inline(always)]
    pub(crate) fn blend<S: Simd>(
        &self,
        simd: S,
        first: Pixel,
        share: &[f32; MAX_LANES],
        backdrop: Backdrop<'_>,
    ) -> [f32; MAX_LANES] {
        let Backdrop { optical_depth, values, is_any } = backdrop;
        let zero = simd.lanes(0.0);
        let part = Lanes::load(simd, share);
        let mut before = [zero; 3];
        if is_any {
            (0..self.planes).for_each(|p| before[p] = Lanes::load(simd, &optical_depth[p]));
        }
        let least = simd.lanes(f32::MIN_POSITIVE);
        let mut inverse = [zero; 3];
        for p in 0..self.planes {
            let optical_depth_of_both = before[p] + self.row(simd, p, first) * part;
            optical_depth_of_both.store(&mut optical_depth[p]);
            inverse[p] = simd.lanes(1.0) / optical_depth_of_both.max(least);
        }
        for c in 0..self.channels {
            let p = ChannelLayout::plane_of(c, self.channels, self.planes);
            let of_splats = self.row(simd, self.planes + c, first) * part;
            let others = if is_any { before[p] * Lanes::load(simd, &values[c]) } else { zero };
            ((of_splats + others) * inverse[p]).store(&mut values[c]);
        }
        let green = self.planes / 2;
        let mut share_of_green = [0.0; MAX_LANES];
        (self.row(simd, green, first) * part * inverse[green]).store(&mut share_of_green);
        share_of_green
    }

    /// Whether depths or objects are kept.
    pub(crate) fn has_extras(&self) -> bool {
        self.has_depths || !self.objects.is_empty()
    }

    /// Where the splats of the pixels from `first` on lie.
    #[inline(always)]
    pub(crate) fn depths<S: Simd>(&self, simd: S, first: Pixel) -> PixelDepths {
        let green = self.row(simd, self.planes / 2, first);
        let line = self.planes + self.channels;
        let zero = [0.0; MAX_LANES];
        let mut out = PixelDepths { optical_depth: zero, depth: zero, thickness: zero };
        green.store(&mut out.optical_depth);
        if self.has_depths {
            let weight = green.max(simd.lanes(f32::MIN_POSITIVE));
            (self.row(simd, line, first) / weight).store(&mut out.depth);
            (self.row(simd, line + 1, first) / weight).store(&mut out.thickness);
        }
        out
    }

    /// The object of a pixel, if objects are kept.
    pub(crate) fn object(&self, pixel: Pixel) -> Option<u32> {
        let Pixel { x, y } = pixel;
        let block = y / BLOCK * self.columns + x / BLOCK;
        self.objects.get(block * PIXELS + y % BLOCK * BLOCK + x % BLOCK).copied()
    }
}
