//! An image as another one sees it that lies in it with a shift and another scale: cubic between pixels, 0 beyond.

use super::penumbra::Shift;
use crate::half_vector::slicing::band::ROWS;
use crate::shared::vectors::COUNTING;
use splat_core::raster::lanes::{Broadcast, Lanes, MAX_LANES};
use splat_core::raster::pulp::Simd;
use std::ops::Range;

/// Pixels before and behind each stored row, all 0, so that vectors may run over its ends.
pub(crate) const PAD: usize = 2 * MAX_LANES;

/// Most pixels of a row that a vector lies between, and most rows that [`ROWS`] rows do.
const TAPS: usize = MAX_LANES + 4;
const HELD: usize = 2 * ROWS + 4;

/// Rows that have `rows` of the other image beside them, of `height`.
pub(crate) fn rows_for(shift: &Shift, rows: &Range<usize>, height: usize) -> Range<usize> {
    ends(shift, 1, rows, height)
}

/// Columns that have `columns` of the other image beside them, whole vectors, of `width`.
pub(crate) fn columns_for(shift: &Shift, columns: &Range<usize>, width: usize) -> Range<usize> {
    let range = ends(shift, 0, columns, width);
    range.start / MAX_LANES * MAX_LANES..range.end.next_multiple_of(MAX_LANES).min(width)
}

fn ends(shift: &Shift, side: usize, other: &Range<usize>, count: usize) -> Range<usize> {
    let other_at = |v: f64| (v - shift.start[side]) / (1.0 + shift.scale);
    let from = other_at(other.start as f64 - 2.0).floor();
    let to = other_at(other.end as f64 + 1.0).ceil() + 1.0;
    let start = (from.max(0.0) as usize).min(count);
    start..(to.max(0.0) as usize).clamp(start, count)
}

/// Pixels `x`.. of some rows of an image, at most [`ROWS`], from the rows of another that it lies in. Each has the same bits however many
/// there are in a vector.
#[inline(always)]
pub(crate) fn moved<'a, S: Simd>(
    simd: S,
    row: impl Fn(i64) -> &'a [f32],
    shift: &Shift,
    x: usize,
    rows: Range<usize>,
    to: &mut [Lanes<S>; ROWS],
) {
    let row_at = |y: usize| y as f64 + shift.scale * y as f64 + shift.start[1];
    let (taps, weights) = taps(simd, shift, x);
    let from = row_at(rows.start).floor() as i64 - 1;
    let held_rows = ((row_at(rows.end - 1).floor() as i64 + 3 - from) as usize).min(HELD);
    let mut held = [simd.lanes(0.0); HELD];
    for (r, held) in held[..held_rows].iter_mut().enumerate() {
        let row = row(from + r as i64);
        for (k, weight) in taps.clone().zip(&weights) {
            let k = k.clamp(0, (row.len() - Lanes::<S>::COUNT) as i64) as usize;
            *held = weight.mul_add(Lanes::load(simd, &row[k..]), *held);
        }
    }
    for (y, to) in rows.zip(to) {
        let low = row_at(y).floor();
        let share = (row_at(y) - row_at(y).floor()) as f32;
        let first = ((low as i64 - 1 - from) as usize).min(HELD - 4);
        *to = simd.lanes(0.0);
        for n in 0..4 {
            let weight = simd.lanes(cubic(share + 1.0 - n as f32));
            *to = weight.mul_add(held[first + n], *to);
        }
    }
}

/// Which pixels of a padded row those from `x` on lie between, and how each weighs.
#[inline(always)]
fn taps<S: Simd>(simd: S, shift: &Shift, x: usize) -> (Range<i64>, [Lanes<S>; TAPS]) {
    let scale = shift.scale as f32;
    let start = shift.start[0] as f32;
    let by = |x: usize| (x as f32).mul_add(scale, start);
    let ends = [by(x), by(x + Lanes::<S>::COUNT - 1)];
    let first = ends[0].min(ends[1]).floor() as i64 - 1;
    let last = ends[0].max(ends[1]).floor() as i64 + 2;
    let by = (simd.lanes(x as f32) + Lanes::load(simd, &COUNTING)).mul_add(simd.lanes(scale), simd.lanes(start));
    let mut weights = [simd.lanes(0.0); TAPS];
    let count = ((last - first + 1) as usize).min(TAPS);
    for (n, weight) in weights[..count].iter_mut().enumerate() {
        let a = (by - simd.lanes((first + n as i64) as f32)).abs();
        let inner = (simd.lanes(1.5).mul_add(a, simd.lanes(-2.5)) * a).mul_add(a, simd.lanes(1.0));
        let outer =
            (simd.lanes(-0.5).mul_add(a, simd.lanes(2.5)).mul_add(a, simd.lanes(-4.0))).mul_add(a, simd.lanes(2.0));
        *weight = inner.where_less_or(a, simd.lanes(1.0), outer.where_less(a, simd.lanes(2.0)));
    }
    let start = x as i64 + PAD as i64 + first;
    (start..start + count as i64, weights)
}

/// The cubic through four neighbours by Catmull and Rom, as the weight of one at a distance: it keeps what is straight, and blurs what is
/// curved in the third order.
fn cubic(distance: f32) -> f32 {
    let a = distance.abs();
    if a < 1.0 {
        (1.5 * a - 2.5) * a * a + 1.0
    } else if a < 2.0 {
        ((-0.5 * a + 2.5) * a - 4.0) * a + 2.0
    } else {
        0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use splat_core::raster::pulp::{self, WithSimd};

    struct At<'a>(&'a [Vec<f32>], &'a Shift, usize, usize);

    impl WithSimd for At<'_> {
        type Output = Vec<f32>;

        #[inline(always)]
        fn with_simd<S: Simd>(self, simd: S) -> Vec<f32> {
            let Self(image, shift, x, y) = self;
            let mut out = vec![0.0; MAX_LANES];
            for n in (0..MAX_LANES).step_by(Lanes::<S>::COUNT) {
                let mut to = [simd.lanes(0.0); ROWS];
                let row = |y: i64| &image[y.clamp(0, image.len() as i64 - 1) as usize][..];
                moved(simd, row, shift, x + n, y..y + 3, &mut to);
                to[2].store(&mut out[n..]);
            }
            out
        }
    }

    #[test]
    fn a_moved_image_keeps_planes_and_is_alike_in_vectors_of_any_length() {
        let value = |x: f64, y: f64| 3.0 + 0.5 * x - 0.25 * y;
        let image: Vec<Vec<f32>> = (0..64)
            .map(|y| (0..64 + 2 * PAD).map(|k| value(k as f64 - PAD as f64, f64::from(y)) as f32).collect())
            .collect();
        for (scale, start) in [(0.0, [0.0, 0.0]), (0.0, [-3.25, 1.5]), (0.125, [1.5, -2.3]), (-0.2, [4.0, 9.7])] {
            let shift = Shift { scale, start };
            for (x, y) in [(0, 20), (16, 30), (32, 24)] {
                let found = pulp::Arch::new().dispatch(At(&image, &shift, x, y));
                assert_eq!(found, At(&image, &shift, x, y).with_simd(pulp::Scalar));
                for (n, v) in found.iter().enumerate() {
                    let [at, down] = [(x + n) as f64, (y + 2) as f64];
                    let expected = value(at + scale * at + start[0], down + scale * down + start[1]);
                    assert!((f64::from(*v) - expected).abs() < 1e-4, "{shift:?}, {}: {v}, not {expected}", x + n);
                }
            }
        }
        assert!(((0..4).map(|n| cubic(0.3 + 1.0 - n as f32)).sum::<f32>() - 1.0).abs() < 1e-6);
    }

    #[test]
    fn rows_and_columns_hold_all_that_lies_beside_others() {
        let shift = Shift { scale: -0.25, start: [7.3, -2.6] };
        let others = 10..20;
        let rows = rows_for(&shift, &others, 64);
        let columns = columns_for(&shift, &others, 64);
        for k in 0..64 {
            let near = |side: usize| {
                let v = k as f64 * 0.75 + shift.start[side];
                v > 8.0 && v < 21.0
            };
            assert!(!near(1) || rows.contains(&k), "{k}: {rows:?}");
            assert!(!near(0) || columns.contains(&k), "{k}: {columns:?}");
        }
        assert!(rows.len() < 24 && columns.start.is_multiple_of(MAX_LANES), "{rows:?} {columns:?}");
    }
}
