//! Splats slab by slab, and what those of one slab bring to squares of an image.

use crate::lines::{BLOCK, Lines, Shown};
use rayon::prelude::*;
use splat_core::raster::Projected;
use splat_core::raster::bins::{self, TILE};
use splat_core::raster::lanes::Lanes;
use splat_core::raster::pulp::{self, Simd};
use splat_core::raster::source::{Source, TileRays};
use splat_core::raster::tile::{BLOCKS, Runs};
use splat_core::{Accumulator, Material};
use std::ops::Range;

/// Blocks in a row of a square.
const COLUMNS: usize = TILE / BLOCK;

/// Ids slab by slab, ascending within one.
pub(crate) struct BySlab {
    pub(crate) ids: Vec<u32>,
    starts: Vec<u32>,
}

impl BySlab {
    /// Of each splat's slab, below `count`.
    pub(crate) fn new(slabs: &[u32], count: u32) -> Self {
        // starts[s + 1] first counts, then is the running end of slab s.
        let mut starts = vec![0u32; count as usize + 2];
        slabs.iter().for_each(|s| starts[*s as usize + 2] += 1);
        (2..starts.len()).for_each(|s| starts[s] += starts[s - 1]);
        let mut ids = vec![0; slabs.len()];
        for (id, slab) in (0..).zip(slabs) {
            let place = &mut starts[*slab as usize + 1];
            ids[*place as usize] = id;
            *place += 1;
        }
        starts.pop();
        Self { ids, starts }
    }

    fn range(&self, slab: u32) -> Range<usize> {
        self.starts[slab as usize] as usize..self.starts[slab as usize + 1] as usize
    }

    /// The ids of a slab.
    pub(crate) fn of(&self, slab: u32) -> &[u32] {
        &self.ids[self.range(slab)]
    }
}

/// A square of an image, with the splats that reach it.
struct Square {
    corner: [usize; 2],
    rays: TileRays,
    /// From slab to slab.
    ids: Vec<u32>,
    /// Of the present slab.
    lines: Lines,
    /// Blocks that hold any.
    tags: u64,
}

/// The squares of an image, row by row; those that no splat reaches hold nothing.
pub(crate) struct Squares {
    all: Vec<Option<Square>>,
    columns: usize,
    /// What their lines are for.
    form: Accumulator,
}

/// One slab of splats.
#[derive(Clone, Copy)]
pub(crate) struct Slab<'a> {
    pub(crate) projected: &'a Projected,
    pub(crate) materials: &'a [Material],
    /// Slab of each splat, by id.
    pub(crate) slabs: &'a [u32],
    pub(crate) slab: u32,
    /// Its splats.
    pub(crate) ids: &'a [u32],
    /// Numbers for each channel, one splat after the other.
    pub(crate) values: &'a [f32],
}

impl Squares {
    /// Those that splats reach, given slab by slab; `opaque` has depths of what hides them, or nothing.
    pub(crate) fn new(projected: &Projected, order: &[u32], opaque: &[f32], of: &Accumulator) -> Self {
        let bins = bins::bin(projected, order);
        let square = |t: usize| {
            let ids: Vec<u32> = bins.tile(t).flatten().copied().collect();
            let corner = bins.corner(t);
            let rays = || TileRays::new(projected, opaque, corner);
            (!ids.is_empty()).then(|| Square { corner, rays: rays(), ids, lines: Lines::default(), tags: 0 })
        };
        let planes = of.optical_depth.len();
        let depth = !of.depth.is_empty();
        let object = !of.object.is_empty();
        Self {
            all: (0..bins.tiles()).into_par_iter().map(square).collect(),
            columns: (projected.size[0] as usize).div_ceil(TILE),
            form: Accumulator::new([1, 1], planes, of.channels.len(), depth, object),
        }
    }

    /// Bytes of lists and sums.
    pub(crate) fn bytes(&self) -> u64 {
        let one = |square: &Square| 4 * square.ids.len() as u64 + square.lines.bytes();
        self.all.iter().flatten().map(one).sum()
    }

    /// Puts the splats of a slab in the place of those before. Fragments.
    pub(crate) fn fill(&mut self, of: Slab<'_>) -> u64 {
        let form = &self.form;
        let one = |square: &mut Square| pulp::Arch::new().dispatch(OneSquare { of, form, square });
        self.all.par_iter_mut().flatten().map(one).sum()
    }

    /// The sums about a pixel, with its place there; `None` where the slab has no splat in any of the `count` pixels from it on, which lie
    /// in one square.
    #[inline(always)]
    pub(crate) fn at(&self, [x, y]: [usize; 2], count: usize) -> Option<(&Lines, [usize; 2])> {
        let square = self.all.get(y / TILE * self.columns + x / TILE)?.as_ref()?;
        let at = [x % TILE, y % TILE];
        let bits = ((1u64 << count.div_ceil(BLOCK)) - 1) << (at[1] / BLOCK * COLUMNS + at[0] / BLOCK);
        (square.tags & bits != 0).then_some((&square.lines, at))
    }

    /// Columns of a row of pixels between which any splat of the slab lies.
    pub(crate) fn span(&self, y: usize) -> Option<Range<usize>> {
        let row = &self.all[y / TILE * self.columns..][..self.columns];
        let columns = row.iter().flatten().filter_map(|square| {
            let bits = (square.tags >> (y % TILE / BLOCK * COLUMNS)) as u8;
            let [first, last] = [bits.trailing_zeros(), u8::BITS - bits.leading_zeros()].map(|b| b as usize * BLOCK);
            (bits != 0).then(|| square.corner[0] + first..square.corner[0] + last)
        });
        columns.reduce(|all, own| all.start..own.end)
    }

    /// The sums of the present slab, by square.
    pub(crate) fn lines(&self) -> impl Iterator<Item = Option<&Lines>> {
        self.all.iter().map(|square| square.as_ref().filter(|square| square.tags != 0).map(|square| &square.lines))
    }
}

/// One square's work on one slab, in the form that [`pulp`] compiles once per instruction set.
struct OneSquare<'a> {
    of: Slab<'a>,
    form: &'a Accumulator,
    square: &'a mut Square,
}

impl pulp::WithSimd for OneSquare<'_> {
    type Output = u64;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> u64 {
        let Self { of, form, square } = self;
        if square.tags != 0 {
            square.lines.clear();
            square.tags = 0;
        }
        let first = square.ids.partition_point(|id| of.slabs[*id as usize] < of.slab);
        let own = square.ids[first..].iter().copied().take_while(|id| of.slabs[*id as usize] == of.slab);
        let channels = form.channels.len();
        let mut fragments = 0;
        for id in own {
            if square.lines.is_empty() {
                square.lines.resize(BLOCKS, COLUMNS, (form, false));
            }
            let rank = of.ids.partition_point(|other| *other < id);
            let object = of.projected.objects.get(id as usize).copied().unwrap_or_default();
            let values = &of.values[rank * channels..][..channels];
            let shown = Shown { source: Source::new(of.projected, id), values, object };
            for run in Runs::new(simd, shown.source.splat, of.projected.size, square.corner) {
                square.tags |= 1 << run.block;
                fragments += Lanes::<S>::COUNT as u64;
                let at = [run.block % COLUMNS, run.block / COLUMNS];
                square.lines.add(simd, &shown, of.materials, (run, &square.rays), at);
            }
        }
        fragments
    }
}
