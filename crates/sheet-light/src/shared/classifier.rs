//! Classification after reconstruction: colour and extinction of a sheet's values, many pixels at once.
//!
//! The transfer function is evaluated piece by piece, exactly: no table, so no index runs over and a value at a control point
//! gives that point. Values and control points are both taken relative to the volume's base, which keeps the digits of values that
//! lie on a large offset.

use super::value_range::ValueRange;
use splat_core::TransferFunction;
use splat_core::raster::lanes::{Broadcast, Lanes, MAX_LANES};
use splat_core::raster::pulp::Simd;

/// Pieces up to which each is tried on all lanes; more are looked up lane by lane.
const FEW: usize = 16;

/// A control point with what follows it: extinction, red, green, blue are `at` + `slope`·(v − value).
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Piece {
    pub(crate) value: f32,
    pub(crate) start: [f32; 4],
    pub(crate) slope: [f32; 4],
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
    pub(crate) fn new(transfer: &TransferFunction, scale: f64, base: Base) -> Self {
        let points = transfer.points();
        let four = |i: usize| {
            let p = points[i];
            [(f64::from(p.extinction) * scale) as f32, p.color[0], p.color[1], p.color[2]]
        };
        let piece = |i: usize| {
            let start = four(i);
            let next = four((i + 1).min(points.len() - 1));
            let width = points.get(i + 1).map_or(1.0, |next| f64::from(next.value) - f64::from(points[i].value));
            // A jump steeper than single precision has it stays a number: times no step at all it is nothing.
            let steepest = f64::from(f32::MAX);
            let slope = |c: usize| {
                let rise = (f64::from(next[c]) - f64::from(start[c])) / (width * base.factor);
                rise.clamp(-steepest, steepest) as f32
            };
            Piece { value: base.relative(points[i].value), start, slope: std::array::from_fn(slope) }
        };
        Self { first: four(0), pieces: (0..points.len()).map(piece).collect() }
    }

    /// The control points, values rising.
    pub(crate) fn pieces(&self) -> &[Piece] {
        &self.pieces
    }

    /// Extinction, red, green and blue.
    #[inline(always)]
    pub(crate) fn classify<S: Simd>(&self, simd: S, value: Lanes<S>) -> [Lanes<S>; 4] {
        if self.pieces.len() > FEW { self.look_up(simd, value) } else { self.some(simd, value, [0, 1, 2, 3]) }
    }

    /// The same, where none of the lanes has extinction any colours.
    #[inline(always)]
    pub(crate) fn classify_seen<S: Simd>(&self, simd: S, value: Lanes<S>) -> [Lanes<S>; 4] {
        if self.pieces.len() > FEW {
            return self.look_up(simd, value);
        }
        let [extinction] = self.some(simd, value, [0]);
        if !simd.lanes(0.0).any_less(extinction) {
            return [extinction; 4];
        }
        let [red, green, blue] = self.some(simd, value, [1, 2, 3]);
        [extinction, red, green, blue]
    }

    /// Those of the four numbers that `numbers` lists, summed piece by piece.
    #[inline(always)]
    fn some<S: Simd, const N: usize>(&self, simd: S, value: Lanes<S>, numbers: [usize; N]) -> [Lanes<S>; N] {
        let zero = simd.lanes(0.0);
        let mut out = [zero; N];
        for n in 0..N {
            out[n] = simd.lanes(self.first[numbers[n]]);
        }
        for piece in &self.pieces {
            let knot = simd.lanes(piece.value);
            let beyond = value - knot;
            for n in 0..N {
                let c = numbers[n];
                let start = simd.lanes(piece.start[c]);
                let here = simd.lanes(piece.slope[c]).mul_add(beyond, start).max(zero);
                out[n] = out[n].where_less_or(value, knot, here);
            }
        }
        out
    }

    #[inline(always)]
    fn look_up<S: Simd>(&self, simd: S, value: Lanes<S>) -> [Lanes<S>; 4] {
        let mut values = [0.0; MAX_LANES];
        let mut out = [[0.0; MAX_LANES]; 4];
        value.store(&mut values);
        for lane in 0..Lanes::<S>::COUNT {
            let class = self.class_of(values[lane]);
            (0..4).for_each(|c| out[c][lane] = class[c]);
        }
        // Neither a closure nor `map`, which are not compiled into code for vectors.
        [Lanes::load(simd, &out[0]), Lanes::load(simd, &out[1]), Lanes::load(simd, &out[2]), Lanes::load(simd, &out[3])]
    }

    /// Extinction, red, green and blue of one value.
    #[inline(always)]
    pub(crate) fn class_of(&self, value: f32) -> [f32; 4] {
        let upper = self.pieces.partition_point(|p| p.value <= value);
        let Some(i) = upper.checked_sub(1) else {
            return self.first;
        };
        let piece = &self.pieces[i];
        std::array::from_fn(|c| piece.slope[c].mul_add(value - piece.value, piece.start[c]).max(0.0))
    }
}

/// What values are taken relative to: the middle of a volume's values, and a power of two by which they are multiplied, so that neither they
/// nor slopes between them leave single precision.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Base {
    middle: f64,
    factor: f64,
}

/// Differences of values from 2⁻⁹⁰ to 2⁹⁰ are taken as they are: colours and extinctions over them are single-precision numbers.
const MOST_EXPONENT: i32 = 90;

impl Base {
    /// For values in a range and the control points of their transfer function.
    ///
    /// The middle is that of the values between the first and the last control point, where there are such: beyond these all values look alike, and a
    /// single voxel of a million would take the digits of all others.
    pub(crate) fn new(values: ValueRange, transfer: &TransferFunction) -> Self {
        let ValueRange { least: low, greatest: high } = values;
        let points = transfer.points();
        let least = points.first().map_or(low, |point| low.max(point.value));
        let most = points.last().map_or(high, |point| high.min(point.value));
        let ends = if least <= most { [least, most] } else { [low, high] };
        let middle = 0.5 * (f64::from(ends[0]) + f64::from(ends[1]));
        let widths = transfer.points().windows(2).map(|pair| f64::from(pair[1].value) - f64::from(pair[0].value));
        let least = widths.fold(f64::INFINITY, f64::min);
        let ends =
            transfer.points().iter().map(|point| f64::from(point.value)).chain([f64::from(low), f64::from(high)]);
        let most = ends.map(|end| (end - middle).abs()).fold(0.0, f64::max);
        let exponent = |x: f64| {
            if x > 0.0 && x.is_finite() { libm::ilogb(x) } else { 0 }
        };
        // Widened for the least step, as far as the largest value allows it.
        let wider = (-MOST_EXPONENT - exponent(least)).max(0);
        let factor = wider.min(MOST_EXPONENT - exponent(most));
        Self { middle, factor: libm::exp2(factor.into()) }
    }

    /// The middle, and the factor behind it.
    pub(crate) fn parts(self) -> [f64; 2] {
        [self.middle, self.factor]
    }

    /// A value less the middle, in the unit of the base.
    #[inline(always)]
    pub(crate) fn relative(self, value: f32) -> f32 {
        ((f64::from(value) - self.middle) * self.factor) as f32
    }

    /// A base of which values keep their unit.
    #[cfg(test)]
    pub(crate) fn about(middle: f64) -> Self {
        Self { middle, factor: 1.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use splat_core::TransferPoint;
    use splat_core::raster::pulp;

    struct At<'a>(&'a Classifier, f32);

    fn range(least: f32, greatest: f32) -> ValueRange {
        ValueRange { least, greatest }
    }

    impl pulp::WithSimd for At<'_> {
        type Output = [f32; 4];

        fn with_simd<S: Simd>(self, simd: S) -> [f32; 4] {
            self.0.classify(simd, simd.lanes(self.1)).map(|lanes| {
                let mut out = [0.0; MAX_LANES];
                lanes.store(&mut out);
                out[0]
            })
        }
    }

    /// Found by attack: values below 1e-36 have slopes beyond single precision, and infinity times nothing is no number.
    #[test]
    fn values_of_any_size_are_classified() {
        for exponent in [-140, -100, 0, 100, 127] {
            let unit = libm::exp2(f64::from(exponent));
            let point = |share: f64, extinction: f32| {
                let color = [0.25, 1.0, extinction];
                TransferPoint { value: (share * unit) as f32, color, extinction }
            };
            let tf = TransferFunction::new(vec![point(-0.5, 0.0), point(0.0, 1.0), point(1.0, 3.0)]).unwrap();
            let base = Base::new(range(point(-1.0, 0.0).value, point(1.5, 0.0).value), &tf);
            let classifier = Classifier::new(&tf, 1.0, base);
            for (share, expected) in
                [(-1.0, 0.0), (-0.5, 0.0), (-0.25, 0.5), (0.0, 1.0), (0.5, 2.0), (1.0, 3.0), (1.25, 3.0)]
            {
                let found = pulp::Arch::new().dispatch(At(&classifier, base.relative((share * unit) as f32)));
                let what = format!("{share} times 2^{exponent}: {found:?}");
                assert!((found[0] - expected).abs() < 1e-3 && (found[3] - expected).abs() < 1e-3, "{what}");
                assert_eq!(found[1], 0.25, "{what}");
            }
        }
        // A jump between neighbours, far below the range of the values.
        let point = |value: f32, extinction: f32| TransferPoint { value, color: [1.0; 3], extinction };
        let tf = TransferFunction::new(vec![point(0.0, 0.0), point(1e-43, 1.0)]).unwrap();
        for high in [1e-43, 1.0, f32::MAX] {
            let base = Base::new(range(0.0, high), &tf);
            let classifier = Classifier::new(&tf, 1.0, base);
            for value in [0.0, 1e-43, 0.5 * high, high] {
                let found = classifier.class_of(base.relative(value));
                assert!(found.iter().all(|v| v.is_finite()), "{value} of {high}: {found:?}");
                assert!(value <= 1e-43 || found[0] == 1.0, "{value} of {high}: {found:?}");
            }
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
                let base = Base::about(base);
                let classifier = Classifier::new(&tf, 1.0, base);
                let classified = |v: f32| pulp::Arch::new().dispatch(At(&classifier, base.relative(v)));
                for p in tf.points() {
                    assert_eq!(classified(p.value), [p.extinction, p.color[0], p.color[1], p.color[2]], "{p:?}");
                }
                let first = tf.at(-1.0);
                let last = tf.at(2.0);
                assert_eq!((classified(-1e30)[0], classified(1e30)[0]), (first.extinction, last.extinction));
                for v in (0..1000).map(|i| i as f32 / 999.0) {
                    let found = classified(v);
                    let expected = tf.at(v);
                    assert!((found[0] - expected.extinction).abs() < 2e-3, "{v}: {found:?}, {expected:?}");
                    assert!((found[2] - expected.color[1]).abs() < 1e-5, "{v}: {found:?}, {expected:?}");
                }
            }
        }
    }
}
