//! Particles that are shown as they are: their colours become sums in lanes, without shading.
//!
//! The sums are those of [`TileSums::add`] to the bit.

use crate::PackedColor;
use crate::ensemble::{BRIGHTEST, FRACTION, LUMINANCE, TileSums, fixed, fixed_square, raise};

/// Hits that are converted at once.
const BLOCK: usize = 64;

/// Hits of some pixels of a tile, converted.
struct Converted {
    sums: [[i64; BLOCK]; 3],
    /// Luminance² times 2²⁴.
    squares: [f32; BLOCK],
}

/// Adds the hits of pixels of a tile, each of a colour and an emission that all have.
pub(crate) fn add(sums: &mut TileSums<'_>, hits: &[(u32, PackedColor)], emission: [f32; 3]) {
    let mut converted = Converted { sums: [[0; BLOCK]; 3], squares: [0.0; BLOCK] };
    for hits in hits.chunks(BLOCK) {
        let inverse_unit = sums.inverse_unit;
        pulp::Arch::new().dispatch(Convert { hits, emission, inverse_unit, to: &mut converted });
        for (i, (pixel, _)) in hits.iter().enumerate() {
            let k = *pixel as usize;
            sums.hits[k] = sums.hits[k].saturating_add(1);
            let square = &mut sums.squares[k];
            *square = square.saturating_add(fixed_square(converted.squares[i]));
            let [r, g, b] = converted.sums.each_ref().map(|channel| channel[i]);
            let to = &mut sums.sums[3 * k..3 * k + 3];
            to.iter_mut().zip([r, g, b]).for_each(|(to, by)| raise(to, by));
        }
    }
}

/// One block, in the form that [`pulp`] compiles once per instruction set.
struct Convert<'a> {
    hits: &'a [(u32, PackedColor)],
    emission: [f32; 3],
    inverse_unit: f32,
    to: &'a mut Converted,
}

impl pulp::NullaryFnOnce for Convert<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self { hits, emission, inverse_unit, to } = self;
        for (i, (_, color)) in hits.iter().enumerate().take(BLOCK) {
            let color = color.get();
            let mut luminance = 0.0;
            for c in 0..3 {
                let v = ((color[c] + emission[c]) * inverse_unit).clamp(-BRIGHTEST, BRIGHTEST);
                luminance += v * LUMINANCE[c];
                to.sums[c][i] = fixed(v);
            }
            to.squares[i] = luminance * luminance * FRACTION;
        }
    }
}
