//! Unlit particles: their colours are summed in lanes, without shading.
//!
//! A tile has separate sums, one row of 32 bytes a pixel, for at most [`SETS`] sets. This limit excludes overflow and keeps
//! the sums in the second-level cache. Then they are added to the ensemble, pixel after pixel, because that order uses memory better
//! than hit after hit. The sums are those of [`TileSums::add`] to the bit.

use crate::PackedColor;
use crate::ensemble::{BRIGHTEST, FRACTION, LUMINANCE, TileSums, fixed, fixed_square, raise};
use crate::project::tiles::AREA;

/// Hits that are converted at once.
pub(crate) const BLOCK: usize = 32;

/// Sets after which sums are taken out: a channel of one is at most 2⁴⁰, a square 2⁵⁶.
pub(crate) const SETS: usize = 128;

/// Where the hits begin in the word of blue, whose sum stays below 2⁴⁷.
const HITS: u32 = 56;

/// Red, green, blue with the number of hits in its highest bits, luminance².
#[derive(Debug, Clone, Copy, Default)]
#[repr(align(32))]
struct Row([u64; 4]);

/// Common data of all particles of an unlit object.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Shown {
    pub(crate) emission: [f32; 3],
    /// Times which their colours are.
    pub(crate) color_unit: f32,
}

/// Sums of a tile.
pub(crate) struct Flat {
    rows: Vec<Row>,
    touched: bool,
}

impl Flat {
    pub(crate) fn new() -> Self {
        Self { rows: vec![Row::default(); AREA], touched: false }
    }

    /// Adds a hit to each of the pixels, of a colour of its own and what all have. Whole blocks of colours
    /// are read: there must be [`BLOCK`] more.
    pub(crate) fn add(&mut self, pixels: &[u32], colors: &[PackedColor], shown: Shown, inverse_unit: f32) {
        self.touched |= !pixels.is_empty();
        pulp::Arch::new().dispatch(Add { pixels, colors, shown, inverse_unit, rows: &mut self.rows });
    }

    /// Moves all to the sums of the ensemble.
    pub(crate) fn drain(&mut self, sums: &mut TileSums<'_>) {
        if !std::mem::take(&mut self.touched) {
            return;
        }
        let pixels = sums.hits.iter_mut().zip(sums.sums.chunks_exact_mut(3)).zip(sums.squares.iter_mut());
        for (row, ((hits, sums), squares)) in self.rows.iter_mut().zip(pixels) {
            let [red, green, last, square] = std::mem::take(&mut row.0).map(|word| word as i64);
            // One hit at least makes it other than 0, blue may be negative.
            if last == 0 {
                continue;
            }
            let blue = last << (64 - HITS) >> (64 - HITS);
            *hits = hits.saturating_add((last.wrapping_sub(blue) as u64 >> HITS) as u32);
            sums.iter_mut().zip([red, green, blue]).for_each(|(sum, by)| raise(sum, by));
            *squares = squares.saturating_add(square as u64);
        }
    }
}

/// Conversion and sums, in the form that [`pulp`] compiles once per instruction set.
struct Add<'a> {
    pixels: &'a [u32],
    colors: &'a [PackedColor],
    shown: Shown,
    inverse_unit: f32,
    rows: &'a mut [Row],
}

impl pulp::NullaryFnOnce for Add<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self { pixels, colors, shown, inverse_unit, rows } = self;
        let Shown { emission, color_unit } = shown;
        let mut converted = [[0; 4]; BLOCK];
        for (pixels, colors) in pixels.chunks(BLOCK).zip(colors.as_chunks::<BLOCK>().0) {
            for (to, color) in converted.iter_mut().zip(colors) {
                let color = color.get();
                let mut luminance = 0.0;
                let [r, g, b] = [0, 1, 2].map(|c| {
                    let v = ((color[c] * color_unit + emission[c]) * inverse_unit).clamp(-BRIGHTEST, BRIGHTEST);
                    luminance += v * LUMINANCE[c];
                    fixed(v) as u64
                });
                *to = [r, g, b.wrapping_add(1 << HITS), fixed_square(luminance * luminance * FRACTION)];
            }
            for (pixel, by) in pixels.iter().zip(&converted) {
                let Row(row) = &mut rows[*pixel as usize];
                (0..4).for_each(|c| row[c] = row[c].wrapping_add(by[c]));
            }
        }
    }
}
