//! Rows of an image as another one sees them that lies in it with a shift and another scale: linear between pixels, 0 beyond.

use super::penumbra::Shift;
use splat_core::raster::lanes::{Lanes, MAX_LANES};
use splat_core::raster::pulp::Simd;
use std::ops::Range;

/// Pixels before and behind each stored row, all 0, so that vectors may run over its ends.
pub(crate) const PAD: usize = 2 * MAX_LANES;

/// 0, 1, 2, …
const COUNTING: [f32; MAX_LANES] = {
    let mut out = [0.0; MAX_LANES];
    let mut n = 0;
    while n < MAX_LANES {
        out[n] = n as f32;
        n += 1;
    }
    out
};

/// One row of an image as a shift has it: the two rows that it lies between, padded, and the share of the second.
#[derive(Clone, Copy)]
pub(crate) struct Moved<'a> {
    pub(crate) rows: [&'a [f32]; 2],
    pub(crate) share: f32,
    /// Pixel x lies at x + `scale`·x + `start`.
    pub(crate) scale: f32,
    pub(crate) start: f32,
}

/// The rows that row `y` lies between and the share of the second.
pub(crate) fn between(shift: &Shift, y: usize) -> (i64, f32) {
    let at = y as f64 + shift.scale * y as f64 + shift.start[1];
    (at.floor() as i64, (at - at.floor()) as f32)
}

/// Rows that have `rows` of the other image beside them, of `height`.
pub(crate) fn rows_for(shift: &Shift, rows: &Range<usize>, height: usize) -> Range<usize> {
    ends(shift, 1, rows, height)
}

/// Columns that have `columns` of the other image beside them, whole vectors, of `width`.
pub(crate) fn columns_for(shift: &Shift, columns: &Range<usize>, width: usize) -> Range<usize> {
    let own = ends(shift, 0, columns, width);
    own.start / MAX_LANES * MAX_LANES..own.end.next_multiple_of(MAX_LANES).min(width)
}

fn ends(shift: &Shift, side: usize, other: &Range<usize>, count: usize) -> Range<usize> {
    let at = |v: f64| (v - shift.start[side]) / (1.0 + shift.scale);
    let (from, to) = (at(other.start as f64 - 1.0).floor(), at(other.end as f64).ceil() + 1.0);
    let start = (from.max(0.0) as usize).min(count);
    start..(to.max(0.0) as usize).clamp(start, count)
}

impl Moved<'_> {
    /// Pixels from `x` on. Each has the same bits however many there are in a vector.
    #[inline(always)]
    pub(crate) fn at<S: Simd>(&self, simd: S, x: usize) -> Lanes<S> {
        let of = |v: f32| Lanes::splat(simd, v);
        let count = Lanes::<S>::COUNT;
        let shift = |x: usize| (x as f32).mul_add(self.scale, self.start);
        let ends = [shift(x), shift(x + count - 1)];
        // What is only just beside a pixel has no more than rounding of it.
        let first = (ends[0].min(ends[1])).floor() as i64;
        let last = (ends[0].max(ends[1])).floor() as i64 + 1;
        let move_by = (of(x as f32) + Lanes::load(simd, &COUNTING)).mul_add(of(self.scale), of(self.start));
        let (one, zero, share) = (of(1.0), of(0.0), of(self.share));
        let mut out = zero;
        for step in first..=last {
            let k = (x as i64 + step + PAD as i64).clamp(0, (self.rows[0].len() - count) as i64) as usize;
            let upper = Lanes::load(simd, &self.rows[0][k..]);
            let lower = Lanes::load(simd, &self.rows[1][k..]);
            let weight = (one - (move_by - of(step as f32)).abs()).max(zero);
            out = weight.mul_add((lower - upper).mul_add(share, upper), out);
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use splat_core::raster::pulp;

    struct At<'a>(&'a Moved<'a>, usize);

    impl pulp::WithSimd for At<'_> {
        type Output = Vec<f32>;

        #[inline(always)]
        fn with_simd<S: Simd>(self, simd: S) -> Vec<f32> {
            let mut out = vec![0.0; MAX_LANES];
            for x in (0..MAX_LANES).step_by(Lanes::<S>::COUNT) {
                self.0.at(simd, self.1 + x).store(&mut out[x..]);
            }
            out
        }
    }

    #[test]
    fn a_moved_row_is_linear_between_pixels_and_alike_in_vectors_of_any_length() {
        let width = 64;
        let row: Vec<f32> = (0..width + 2 * PAD)
            .map(|k| if (PAD..PAD + width).contains(&k) { ((k * 37) % 23) as f32 } else { 0.0 })
            .collect();
        for (scale, start) in [(0.0, 0.0), (0.0, -3.25), (0.125, 1.5), (-0.2, 4.0)] {
            let moved = Moved { rows: [&row, &row], share: 0.5, scale, start };
            for x in [0, 16, 32] {
                let found = pulp::Arch::new().dispatch(At(&moved, x));
                assert_eq!(found, pulp::Scalar::new().vectorize(At(&moved, x)));
                for (n, v) in found.iter().enumerate() {
                    let at = (x + n) as f32 + scale * (x + n) as f32 + start + PAD as f32;
                    let (k, u) = (at.floor() as usize, at - at.floor());
                    let expected = row[k] * (1.0 - u) + row[k + 1] * u;
                    assert!((v - expected).abs() < 1e-4, "{scale} {start}, {}: {v}, not {expected}", x + n);
                }
            }
        }
    }

    #[test]
    fn rows_and_columns_hold_all_that_lies_beside_others() {
        let shift = Shift { scale: -0.25, start: [7.3, -2.6] };
        let others = 10..20;
        let (rows, columns) = (rows_for(&shift, &others, 64), columns_for(&shift, &others, 64));
        for at in 0..64 {
            let near = |side: usize| {
                let v = at as f64 * 0.75 + shift.start[side];
                v > 9.0 && v < 20.0
            };
            assert!(!near(1) || rows.contains(&at), "{at}: {rows:?}");
            assert!(!near(0) || columns.contains(&at), "{at}: {columns:?}");
        }
        assert!(rows.len() < 20 && columns.start % MAX_LANES == 0, "{rows:?} {columns:?}");
    }
}
