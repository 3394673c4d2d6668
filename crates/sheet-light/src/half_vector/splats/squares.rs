//! Splats slab by slab, and what those of one slab bring to squares of an image.

use crate::shared::lines::{BLOCK, Lines, Shown};
use crate::shared::pixel::{Pixel, PixelForm};
use rayon::prelude::*;
use splat_core::Material;
use splat_core::raster::Projected;
use splat_core::raster::bins::{self, TILE};
use splat_core::raster::lanes::Lanes;
use splat_core::raster::pulp::{self, Simd};
use splat_core::raster::source::{Source, TileRays};
use splat_core::raster::tile::{BLOCKS, Runs};
use std::ops::Range;

/// Blocks in a row of a square.
const COLUMNS: usize = TILE / BLOCK;

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
    squares: Vec<Option<Square>>,
    columns: usize,
    /// What their lines are for.
    form: PixelForm,
}

/// A pixel of a square.
#[derive(Clone, Copy)]
pub(crate) struct SquarePixel<'a> {
    pub(crate) lines: &'a Lines,
    /// Counted from the square's corner.
    pub(crate) pixel: Pixel,
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
    pub(crate) fn new(projected: &Projected, order: &[u32], opaque: &[f32], form: PixelForm) -> Self {
        let bins = bins::bin(projected, order);
        let square = |t: usize| {
            let ids: Vec<u32> = bins.tile(t).flatten().copied().collect();
            let corner = bins.corner(t);
            let rays = || TileRays::new(projected, opaque, corner);
            (!ids.is_empty()).then(|| Square { corner, rays: rays(), ids, lines: Lines::default(), tags: 0 })
        };
        Self {
            squares: (0..bins.tiles()).into_par_iter().map(square).collect(),
            columns: (projected.size[0] as usize).div_ceil(TILE),
            form,
        }
    }

    /// Bytes of lists and sums.
    pub(crate) fn bytes(&self) -> u64 {
        let square_bytes = |square: &Square| 4 * square.ids.len() as u64 + square.lines.bytes();
        self.squares.iter().flatten().map(square_bytes).sum()
    }

    /// Puts the splats of a slab in the place of those before. Fragments.
    pub(crate) fn fill(&mut self, slab: Slab<'_>) -> u64 {
        let form = self.form;
        let fragments = |square: &mut Square| pulp::Arch::new().dispatch(OneSquare { slab, form, square });
        self.squares.par_iter_mut().flatten().map(fragments).sum()
    }

    /// The sums about a pixel; `None` where the slab has no splat in any of the `count` pixels from it on, which lie
    /// in one square.
    #[inline(always)]
    pub(crate) fn find(&self, pixel: Pixel, count: usize) -> Option<SquarePixel<'_>> {
        let Pixel { x, y } = pixel;
        let square = self.squares.get(y / TILE * self.columns + x / TILE)?.as_ref()?;
        let within = Pixel { x: x % TILE, y: y % TILE };
        let bits = ((1u64 << count.div_ceil(BLOCK)) - 1) << (within.y / BLOCK * COLUMNS + within.x / BLOCK);
        (square.tags & bits != 0).then_some(SquarePixel { lines: &square.lines, pixel: within })
    }

    /// Columns of a row of pixels between which any splat of the slab lies.
    pub(crate) fn span(&self, y: usize) -> Option<Range<usize>> {
        let row = &self.squares[y / TILE * self.columns..][..self.columns];
        let columns = row.iter().flatten().filter_map(|square| {
            let bits = (square.tags >> (y % TILE / BLOCK * COLUMNS)) as u8;
            let [first, last] = [bits.trailing_zeros(), u8::BITS - bits.leading_zeros()].map(|b| b as usize * BLOCK);
            (bits != 0).then(|| square.corner[0] + first..square.corner[0] + last)
        });
        columns.reduce(|first, last| first.start..last.end)
    }

    /// The sums of the present slab, by square.
    pub(crate) fn lines(&self) -> impl Iterator<Item = Option<&Lines>> {
        self.squares.iter().map(|square| square.as_ref().filter(|square| square.tags != 0).map(|square| &square.lines))
    }
}

/// One square's work on one slab, in the form that [`pulp`] compiles once per instruction set.
struct OneSquare<'a> {
    slab: Slab<'a>,
    form: PixelForm,
    square: &'a mut Square,
}

impl pulp::WithSimd for OneSquare<'_> {
    type Output = u64;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> u64 {
        let Self { slab, form, square } = self;
        if square.tags != 0 {
            square.lines.clear();
            square.tags = 0;
        }
        let first = square.ids.partition_point(|id| slab.slabs[*id as usize] < slab.slab);
        let ids = square.ids[first..].iter().copied().take_while(|id| slab.slabs[*id as usize] == slab.slab);
        let channels = form.channels;
        let mut fragments = 0;
        for id in ids {
            if square.lines.is_empty() {
                square.lines.resize(BLOCKS, COLUMNS, form);
            }
            let rank = slab.ids.partition_point(|other| *other < id);
            let object = slab.projected.objects.get(id as usize).copied().unwrap_or_default();
            let values = &slab.values[rank * channels..][..channels];
            let shown = Shown { source: Source::new(slab.projected, id), values, object };
            for run in Runs::new(simd, shown.source.splat, slab.projected.size, square.corner) {
                square.tags |= 1 << run.block;
                fragments += Lanes::<S>::COUNT as u64;
                let block = Pixel { x: run.block % COLUMNS, y: run.block / COLUMNS };
                square.lines.add(simd, &shown, slab.materials, run, &square.rays, block);
            }
        }
        fragments
    }
}
