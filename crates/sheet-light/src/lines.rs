//! Sums over the splats of one slab, block by block of 4x4 pixels: optical depths add, all else weighs by them.

use splat_core::raster::lanes::{Lanes, MAX_LANES};
use splat_core::raster::pulp::Simd;
use splat_core::raster::source::{Source, TileRays};
use splat_core::raster::tile::{Line, PIXELS, Run};
use splat_core::shade::{ChannelLayout, MAX_CHANNELS};
use splat_core::{Accumulator, Material};

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

/// Optical depths and values that splats are added to, and the share of them that is.
pub(crate) type Blended<'a> =
    (&'a mut [[f32; MAX_LANES]; 3], &'a mut [[f32; MAX_LANES]; MAX_CHANNELS], &'a [f32; MAX_LANES]);

/// One splat, and what it shows.
pub(crate) struct Shown<'a> {
    pub(crate) source: Source<'a>,
    /// A number for each channel.
    pub(crate) values: &'a [f32],
    pub(crate) object: u32,
}

impl Lines {
    /// Nothing yet, of `blocks` blocks in rows of `columns`, for what `into` keeps, and with depths where these are asked for.
    pub(crate) fn resize(&mut self, blocks: usize, columns: usize, (into, depths): (&Accumulator, bool)) {
        (self.planes, self.channels, self.columns) = (into.optical_depth.len(), into.channels.len(), columns);
        self.has_depths = depths || !into.depth.is_empty();
        self.stride = self.planes + self.channels + if self.has_depths { 2 } else { 0 };
        self.lines.clear();
        self.lines.resize(blocks * self.stride, Line([0.0; PIXELS]));
        self.objects.clear();
        self.objects.resize(if into.object.is_empty() { 0 } else { blocks * PIXELS }, u32::MAX);
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
    pub(crate) fn pixel(&self, plane: usize, [x, y]: [usize; 2]) -> f32 {
        let block = y / BLOCK * self.columns + x / BLOCK;
        self.lines.get(block * self.stride + plane).map_or(0.0, |line| line.0[y % BLOCK * BLOCK + x % BLOCK])
    }

    /// Bytes of all sums.
    pub(crate) fn bytes(&self) -> u64 {
        (size_of_val(&*self.lines) + size_of_val(&*self.objects)) as u64
    }

    /// Adds a splat to a run of pixels of the block at column and row `at`.
    #[inline(always)]
    pub(crate) fn add<S: Simd>(
        &mut self,
        simd: S,
        splat: &Shown<'_>,
        materials: &[Material],
        (run, rays): (Run<S>, &TileRays),
        at: [usize; 2],
    ) {
        let Shown { source, values, object } = splat;
        let extinction = materials[source.splat.material as usize].extinction_rgb;
        let block = at[1] * self.columns + at[0];
        let tau = source.optical_depth(simd, run, rays);
        let lines = &mut self.lines[block * self.stride..][..self.stride];
        let mut add = |line: usize, v: Lanes<S>| {
            let to = &mut lines[line].0[run.lane..];
            (Lanes::load(simd, to) + v).store(to);
        };
        let of_plane = |p: usize| tau * Lanes::splat(simd, extinction[p]);
        (0..self.planes).for_each(|p| add(p, of_plane(p)));
        for (c, value) in values.iter().enumerate() {
            let p = ChannelLayout::plane_of(c, self.channels, self.planes);
            add(self.planes + c, of_plane(p) * Lanes::splat(simd, *value));
        }
        if self.has_depths {
            let green = of_plane(self.planes / 2);
            let line = self.planes + self.channels;
            add(line, green * source.view_depth(simd, run, rays));
            add(line + 1, green * Lanes::splat(simd, source.thickness()));
        }
        if !self.objects.is_empty() {
            self.name::<S>(*object, block * PIXELS + run.lane, tau);
        }
    }

    /// Names the pixels that a splat is the first to hide something of.
    #[inline(always)]
    fn name<S: Simd>(&mut self, object: u32, at: usize, tau: Lanes<S>) {
        let mut hidden = [0.0; MAX_LANES];
        tau.store(&mut hidden);
        for (to, tau) in self.objects[at..].iter_mut().zip(&hidden[..Lanes::<S>::COUNT]) {
            if *tau > 0.0 && *to == u32::MAX {
                *to = object;
            }
        }
    }

    /// The pixels from (x, y) on, of one line.
    #[inline(always)]
    fn row<S: Simd>(&self, simd: S, line: usize, [x, y]: [usize; 2]) -> Lanes<S> {
        let mut row = [0.0; MAX_LANES];
        for group in 0..Lanes::<S>::COUNT / BLOCK {
            let block = y / BLOCK * self.columns + x / BLOCK + group;
            let from = &self.lines[block * self.stride + line].0[y % BLOCK * BLOCK..][..BLOCK];
            row[group * BLOCK..][..BLOCK].copy_from_slice(from);
        }
        Lanes::load(simd, &row)
    }

    /// Adds a share of the pixels from (x, y) on to the optical depths and values of what is there already, where anything is. The share that
    /// splats then have of green.
    #[inline(always)]
    pub(crate) fn blend<S: Simd>(
        &self,
        simd: S,
        at: [usize; 2],
        is_any: bool,
        (optical_depth, values, part): Blended<'_>,
    ) -> [f32; MAX_LANES] {
        let zero = Lanes::splat(simd, 0.0);
        let part = Lanes::load(simd, part);
        let mut before = [zero; 3];
        if is_any {
            (0..self.planes).for_each(|p| before[p] = Lanes::load(simd, &optical_depth[p]));
        }
        let least = Lanes::splat(simd, f32::MIN_POSITIVE);
        let mut inverse = [zero; 3];
        for p in 0..self.planes {
            let all = before[p] + self.row(simd, p, at) * part;
            all.store(&mut optical_depth[p]);
            inverse[p] = Lanes::splat(simd, 1.0) / all.max(least);
        }
        for c in 0..self.channels {
            let p = ChannelLayout::plane_of(c, self.channels, self.planes);
            let own = self.row(simd, self.planes + c, at) * part;
            let others = if is_any { before[p] * Lanes::load(simd, &values[c]) } else { zero };
            ((own + others) * inverse[p]).store(&mut values[c]);
        }
        let green = self.planes / 2;
        let mut share = [0.0; MAX_LANES];
        (self.row(simd, green, at) * part * inverse[green]).store(&mut share);
        share
    }

    /// Whether depths or objects are kept.
    pub(crate) fn has_extras(&self) -> bool {
        self.has_depths || !self.objects.is_empty()
    }

    /// Optical depth of green, and mean view depth and thickness, of the pixels from (x, y) on; the latter two only where they are kept.
    #[inline(always)]
    pub(crate) fn depths<S: Simd>(&self, simd: S, at: [usize; 2]) -> [[f32; MAX_LANES]; 3] {
        let green = self.row(simd, self.planes / 2, at);
        let line = self.planes + self.channels;
        let mut out = [[0.0; MAX_LANES]; 3];
        green.store(&mut out[0]);
        if self.has_depths {
            let [_, depth, thickness] = &mut out;
            for (n, to) in [depth, thickness].into_iter().enumerate() {
                (self.row(simd, line + n, at) / green.max(Lanes::splat(simd, f32::MIN_POSITIVE))).store(to);
            }
        }
        out
    }

    /// The object of a pixel, if objects are kept.
    pub(crate) fn object(&self, [x, y]: [usize; 2]) -> Option<u32> {
        let block = y / BLOCK * self.columns + x / BLOCK;
        self.objects.get(block * PIXELS + y % BLOCK * BLOCK + x % BLOCK).copied()
    }
}
