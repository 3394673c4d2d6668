//! Classification after reconstruction: colour and extinction of a sheet's values, many pixels at once.
//!
//! The transfer function is evaluated piece by piece, exactly: no table, so no index runs over and a value at a control point
//! gives that point. Values and control points are both taken relative to the volume's base, which keeps the digits of values that
//! lie on a large offset.

use splat_core::TransferFunction;
use splat_core::raster::lanes::{Lanes, MAX_LANES};
use splat_core::raster::pulp::Simd;

/// Pieces up to which each is tried on all lanes; more are looked up lane by lane.
const FEW: usize = 16;

/// A control point with what follows it: extinction, red, green, blue are `at` + `slope`·(v − value).
#[derive(Debug, Clone, Copy, PartialEq)]
struct Piece {
    value: f32,
    at: [f32; 4],
    slope: [f32; 4],
}

/// A transfer function for values relative to a base.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Classifier {
    /// Below the first control point.
    first: [f32; 4],
    pieces: Vec<Piece>,
}

impl Classifier {
    /// Extinction is multiplied by `scale`.
    pub(crate) fn new(transfer: &TransferFunction, scale: f64, base: f64) -> Self {
        let points = transfer.points();
        let four = |i: usize| {
            let p = points[i];
            [(f64::from(p.extinction) * scale) as f32, p.color[0], p.color[1], p.color[2]]
        };
        let piece = |i: usize| {
            let (at, next) = (four(i), four((i + 1).min(points.len() - 1)));
            let width = points.get(i + 1).map_or(1.0, |next| f64::from(next.value) - f64::from(points[i].value));
            let slope = |c: usize| ((f64::from(next[c]) - f64::from(at[c])) / width) as f32;
            Piece { value: relative(points[i].value, base), at, slope: std::array::from_fn(slope) }
        };
        Self { first: four(0), pieces: (0..points.len()).map(piece).collect() }
    }

    /// Extinction, red, green and blue.
    #[inline(always)]
    pub(crate) fn at<S: Simd>(&self, simd: S, value: Lanes<S>) -> [Lanes<S>; 4] {
        if self.pieces.len() > FEW {
            return self.look_up(simd, value);
        }
        let of = |v: f32| Lanes::splat(simd, v);
        let mut out = [of(self.first[0]), of(self.first[1]), of(self.first[2]), of(self.first[3])];
        for piece in &self.pieces {
            let knot = of(piece.value);
            let beyond = value - knot;
            for c in 0..4 {
                let here = of(piece.slope[c]).mul_add(beyond, of(piece.at[c])).max(of(0.0));
                out[c] = out[c].where_less_or(value, knot, here);
            }
        }
        out
    }

    #[inline(always)]
    fn look_up<S: Simd>(&self, simd: S, value: Lanes<S>) -> [Lanes<S>; 4] {
        let (mut values, mut out) = ([0.0; MAX_LANES], [[0.0; MAX_LANES]; 4]);
        value.store(&mut values);
        for lane in 0..Lanes::<S>::COUNT {
            let class = self.one(values[lane]);
            (0..4).for_each(|c| out[c][lane] = class[c]);
        }
        let load = |c: usize| Lanes::load(simd, &out[c]);
        // Not `map`, which is not compiled into code for vectors.
        [load(0), load(1), load(2), load(3)]
    }

    /// Extinction, red, green and blue of one value.
    #[inline(always)]
    pub(crate) fn one(&self, value: f32) -> [f32; 4] {
        let upper = self.pieces.partition_point(|p| p.value <= value);
        let Some(i) = upper.checked_sub(1) else { return self.first };
        let piece = &self.pieces[i];
        std::array::from_fn(|c| piece.slope[c].mul_add(value - piece.value, piece.at[c]).max(0.0))
    }
}

/// A value less the base.
pub(crate) fn relative(value: f32, base: f64) -> f32 {
    (f64::from(value) - base) as f32
}

#[cfg(test)]
mod tests {
    use super::*;
    use splat_core::TransferPoint;
    use splat_core::raster::pulp;

    struct At<'a>(&'a Classifier, f32);

    impl pulp::WithSimd for At<'_> {
        type Output = [f32; 4];

        fn with_simd<S: Simd>(self, simd: S) -> [f32; 4] {
            self.0.at(simd, Lanes::splat(simd, self.1)).map(|lanes| {
                let mut out = [0.0; MAX_LANES];
                lanes.store(&mut out);
                out[0]
            })
        }
    }

    #[test]
    fn ia08_control_points_are_hit_exactly_and_nothing_lies_outside() {
        for count in [5u16, 256] {
            let point = |k: u16| {
                let value = f32::from(k) / f32::from(count - 1);
                TransferPoint { value, color: [0.1 * value, 1.0 - value, 0.3], extinction: f32::from(k * 37 % 11) }
            };
            let tf = TransferFunction::new((0..count).map(point).collect()).unwrap();
            for base in [0.0, 0.5, 0.123] {
                let classifier = Classifier::new(&tf, 1.0, base);
                let at = |v: f32| pulp::Arch::new().dispatch(At(&classifier, relative(v, base)));
                for p in tf.points() {
                    assert_eq!(at(p.value), [p.extinction, p.color[0], p.color[1], p.color[2]], "{p:?}");
                }
                let (first, last) = (tf.at(-1.0), tf.at(2.0));
                assert_eq!((at(-1e30)[0], at(1e30)[0]), (first.extinction, last.extinction));
                for v in (0..1000).map(|i| i as f32 / 999.0) {
                    let (found, expected) = (at(v), tf.at(v));
                    assert!((found[0] - expected.extinction).abs() < 2e-3, "{v}: {found:?}, {expected:?}");
                    assert!((found[2] - expected.color[1]).abs() < 1e-5, "{v}: {found:?}, {expected:?}");
                }
            }
        }
    }
}
