//! Pre-integrated classification: means of the transfer function over all values that a ray meets in a slab, in the place of the class of the value in the middle.
//!
//! A ray's part in a slab has two halves, before and behind the middle, and values change linearly in each. Over a half from value a to value b extinction has the mean
//! ∫σ dv/(b − a), colour the mean ∫σ·c dv/∫σ dv, and the place of the medium is (∫σ·v dv/∫σ dv − a)/(b − a) of the way, all integrals from a to b (K. Engel, M. Kraus, T. Ertl, *High-Quality
//! Pre-Integrated Volume Rendering Using Hardware-Accelerated Pixel Shading*, 2001, accelerated pre-integration).
//!
//! Deviations: the paper reads these integrals from a table over both values. A transfer function is linear between control points, so it has them in closed form, span by span: no
//! edge is blurred by a table, and lengths need none of their own. The paper neglects that a slab hides itself; here the front half hides the back half.

use super::classifier::{Base, Classifier};
use splat_core::TransferFunction;
use splat_core::raster::lanes::{Broadcast, Lanes, MAX_LANES};
use splat_core::raster::pulp::Simd;

/// Spans with extinction up to which each is tried on all lanes; more are looked up lane by lane.
const FEW: usize = 16;

/// What is integrated over values: extinction, and times it red, green, blue and the value.
const SUMS: usize = 5;

/// Values between which extinction and colours are linear.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Span {
    low: f32,
    high: f32,
    /// A finite value of the span: extinction, red, green, blue are `start` + `slope`·(v − `knot`).
    knot: f32,
    start: [f32; 4],
    slope: [f32; 4],
}

/// The integrals of a transfer function over values relative to a base.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Preintegrated {
    classifier: Classifier,
    /// From −∞ to ∞, each beginning where the one before ends.
    spans: Vec<Span>,
    /// Places among these of the ones that have extinction.
    seen: Vec<usize>,
    /// ∫σ dv, ∫σ·c dv and ∫σ·v dv over all finite spans before each.
    before: Vec<[f64; SUMS]>,
}

/// The values that neighbouring rays meet: at the near end of their part, where its halves meet, and at the far end. Between these they are linear.
#[derive(Clone, Copy)]
pub(crate) struct Values<S: Simd> {
    pub(crate) near: Lanes<S>,
    pub(crate) middle: Lanes<S>,
    pub(crate) far: Lanes<S>,
}

/// What one half of neighbouring rays' parts shows.
#[derive(Clone, Copy)]
pub(crate) struct Half<S: Simd> {
    /// The mean over the half.
    pub(crate) extinction: Lanes<S>,
    /// The mean, weighed by extinction; finite, but arbitrary where there is none.
    pub(crate) color: [Lanes<S>; 3],
    /// Where it lies on the way through the half, weighed by extinction: 0 at the near end, 1 at the far one.
    pub(crate) place: Lanes<S>,
}

impl Preintegrated {
    /// Extinction is multiplied by `scale`.
    pub(crate) fn new(transfer: &TransferFunction, scale: f64, base: Base) -> Self {
        let classifier = Classifier::new(transfer, scale, base);
        let pieces = classifier.pieces();
        let knots: Vec<f32> = pieces.iter().map(|piece| piece.value).collect();
        let below = Span {
            low: f32::NEG_INFINITY,
            high: knots[0],
            knot: knots[0],
            start: classifier.class_of(f32::NEG_INFINITY),
            slope: [0.0; 4],
        };
        let span = |i: usize| Span {
            low: knots[i],
            high: knots.get(i + 1).copied().unwrap_or(f32::INFINITY),
            knot: knots[i],
            start: pieces[i].start,
            slope: pieces[i].slope,
        };
        let spans: Vec<Span> = std::iter::once(below).chain((0..pieces.len()).map(span)).collect();
        let seen = (0..spans.len()).filter(|i| spans[*i].start[0] > 0.0 || spans[*i].slope[0] > 0.0).collect();
        let mut before = vec![[0.0; SUMS]; 2];
        for span in &spans[1..pieces.len()] {
            let whole = span.integrals(span.low, span.high);
            let sum = before[before.len() - 1];
            before.push(std::array::from_fn(|n| sum[n] + whole[n]));
        }
        Self { classifier, spans, seen, before }
    }

    /// What the halves of neighbouring rays' parts show, the near half first.
    #[inline(always)]
    pub(crate) fn halves<S: Simd>(&self, simd: S, values: &Values<S>) -> [Half<S>; 2] {
        let Values { near, middle, far } = *values;
        let steps = [middle - near, far - middle];
        let [first, second] = if self.seen.len() > FEW { self.look_up(simd, values) } else { self.sums(simd, values) };
        let mut halves = [half_of(simd, &first, steps[0]), half_of(simd, &second, steps[1])];
        let least = simd.lanes(f32::MIN_POSITIVE);
        if steps[0].abs().min(steps[1].abs()).any_less(least) {
            // Of one value there is no integral, but its class.
            let [extinction, red, green, blue] = self.classifier.classify_seen(simd, middle);
            let color = [red, green, blue];
            for h in 0..2 {
                let step = steps[h].abs();
                halves[h].extinction = extinction.where_less_or(step, least, halves[h].extinction);
                halves[h].place = simd.lanes(0.5).where_less_or(step, least, halves[h].place);
                for c in 0..3 {
                    halves[h].color[c] = color[c].where_less_or(step, least, halves[h].color[c]);
                }
            }
        }
        halves
    }

    /// ∫σ dv, ∫σ·c dv and ∫σ·v dv, v from the near end on, from there to the middle, and the same from the middle to the far end; span by span.
    #[inline(always)]
    fn sums<S: Simd>(&self, simd: S, values: &Values<S>) -> [[Lanes<S>; SUMS]; 2] {
        let Values { near, middle, far } = *values;
        let begins = [near, middle];
        let zero = simd.lanes(0.0);
        let half = simd.lanes(0.5);
        let twelfth = simd.lanes(1.0 / 12.0);
        let least = near.min(middle).min(far);
        let greatest = near.max(middle).max(far);
        let mut sums = [[zero; SUMS]; 2];
        for seen in &self.seen {
            let span = &self.spans[*seen];
            let low = simd.lanes(span.low);
            let high = simd.lanes(span.high);
            if !low.any_less(greatest) || !least.any_less(high) {
                continue;
            }
            let knot = simd.lanes(span.knot);
            let ends = [near.max(low).min(high), middle.max(low).min(high), far.max(low).min(high)];
            for h in 0..2 {
                // Not of differences to the knot: the steps of all spans add up to the whole step, by which their sum is divided.
                let step = ends[h + 1] - ends[h];
                let center = ((ends[h] - knot) + (ends[h + 1] - knot)) * half;
                let slope = simd.lanes(span.slope[0]);
                let extinction = slope.mul_add(center, simd.lanes(span.start[0])).max(zero);
                sums[h][0] = step.mul_add(extinction, sums[h][0]);
                // Of a product of linear functions: that of their middles, and a twelfth of that of their rises.
                let rise = slope * step * twelfth;
                for c in 1..4 {
                    let slope = simd.lanes(span.slope[c]);
                    let color = slope.mul_add(center, simd.lanes(span.start[c])).max(zero);
                    let mean = rise.mul_add(slope * step, extinction * color);
                    sums[h][c] = step.mul_add(mean, sums[h][c]);
                }
                let way = ((ends[h] - begins[h]) + (ends[h + 1] - begins[h])) * half;
                sums[h][4] = step.mul_add(rise.mul_add(step, extinction * way), sums[h][4]);
            }
        }
        sums
    }

    /// The integrals of [`Preintegrated::sums`], lane by lane.
    #[inline(always)]
    fn look_up<S: Simd>(&self, simd: S, values: &Values<S>) -> [[Lanes<S>; SUMS]; 2] {
        let mut ends = [[0.0; MAX_LANES]; 3];
        values.near.store(&mut ends[0]);
        values.middle.store(&mut ends[1]);
        values.far.store(&mut ends[2]);
        let mut found = [[[0.0; MAX_LANES]; SUMS]; 2];
        for lane in 0..Lanes::<S>::COUNT {
            for h in 0..2 {
                let integrals = self.integrals(ends[h][lane], ends[h + 1][lane]);
                for n in 0..SUMS {
                    found[h][n][lane] = integrals[n];
                }
            }
        }
        let mut sums = [[simd.lanes(0.0); SUMS]; 2];
        for h in 0..2 {
            for n in 0..SUMS {
                sums[h][n] = Lanes::load(simd, &found[h][n]);
            }
        }
        sums
    }

    /// ∫σ dv, ∫σ·c dv and ∫σ·v dv, v from the first value on, from one value to another.
    fn integrals(&self, from: f32, to: f32) -> [f32; SUMS] {
        let low = from.min(to);
        let high = from.max(to);
        let first = self.span_of(low);
        let last = self.span_of(high);
        let mut sums = self.spans[first].integrals(low, high.min(self.spans[first].high));
        if last > first {
            let end = self.spans[last].integrals(self.spans[last].low, high);
            for n in 0..SUMS {
                sums[n] += (self.before[last][n] - self.before[first + 1][n]) + end[n];
            }
        }
        sums[4] -= f64::from(from) * sums[0];
        let sign = if from > to { -1.0 } else { 1.0 };
        sums.map(|sum| (sign * sum) as f32)
    }

    /// The span of a value.
    fn span_of(&self, value: f32) -> usize {
        self.spans[1..].partition_point(|span| span.low <= value)
    }
}

impl Span {
    /// ∫σ dv, ∫σ·c dv and ∫σ·v dv between two values of the span.
    fn integrals(&self, low: f32, high: f32) -> [f64; SUMS] {
        let step = f64::from(high) - f64::from(low);
        let value = 0.5 * (f64::from(high) + f64::from(low));
        let center = value - f64::from(self.knot);
        let [extinction, red, green, blue] =
            [0, 1, 2, 3].map(|c| (f64::from(self.slope[c]) * center + f64::from(self.start[c])).max(0.0));
        let rise = [0, 1, 2, 3].map(|c| f64::from(self.slope[c]) * step);
        let product = |middle: f64, rise_of_other: f64| step * (extinction * middle + rise[0] * rise_of_other / 12.0);
        let colors = [product(red, rise[1]), product(green, rise[2]), product(blue, rise[3])];
        [step * extinction, colors[0], colors[1], colors[2], product(value, step)]
    }
}

/// What a half shows that values rise by `step` in.
#[inline(always)]
fn half_of<S: Simd>(simd: S, sums: &[Lanes<S>; SUMS], step: Lanes<S>) -> Half<S> {
    let least = simd.lanes(f32::MIN_POSITIVE);
    let zero = simd.lanes(0.0);
    let one = simd.lanes(1.0);
    let size = sums[0].abs();
    let weight = one.where_less_or(size, least, sums[0]);
    let mut color = [zero; 3];
    for c in 0..3 {
        color[c] = (sums[c + 1] / weight).where_less_or(least, size, zero).max(zero);
    }
    let step = one.where_less_or(step.abs(), least, step);
    let place = (sums[4] / (weight * step)).where_less_or(least, size, simd.lanes(0.5)).max(zero).min(one);
    // Rounding may leave a trace of the other sign.
    Half { extinction: (sums[0] / step).max(zero), color, place }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shared::value_range::ValueRange;
    use splat_core::TransferPoint;
    use splat_core::raster::pulp;

    struct Ways<'a>(&'a Preintegrated, [f32; 3]);

    impl pulp::WithSimd for Ways<'_> {
        type Output = [[f32; 4]; 2];

        fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
            let [near, middle, far] = self.1;
            let values = Values { near: simd.lanes(near), middle: simd.lanes(middle), far: simd.lanes(far) };
            self.0.halves(simd, &values).map(|half| {
                let [red, green, blue] = half.color;
                [half.extinction, red, green, blue].map(|lanes| {
                    let mut out = [0.0; MAX_LANES];
                    lanes.store(&mut out);
                    out[0]
                })
            })
        }
    }

    /// Control points at `count` values from 0 to `range`, about which extinction and colours rise and fall.
    fn saw(count: u16, range: f32) -> TransferFunction {
        let point = |k: u16| {
            let share = f32::from(k) / f32::from(count - 1);
            let color = [share, 1.0 - share, f32::from(k % 3) * 0.4];
            TransferPoint { value: share * range, color, extinction: f32::from(k * 37 % 11) }
        };
        TransferFunction::new((0..count).map(point).collect()).unwrap()
    }

    /// Means over values from one to another, by as many samples as tell them to a thousandth of a thousandth.
    fn quadrature(tf: &TransferFunction, from: f64, to: f64) -> [f64; 4] {
        const STEPS: usize = 20_000;
        let mut sums = [0.0; 4];
        for k in 0..STEPS {
            let value = from + (to - from) * (k as f64 + 0.5) / STEPS as f64;
            let class = tf.at(value as f32);
            let extinction = f64::from(class.extinction);
            sums[0] += extinction;
            (0..3).for_each(|c| sums[c + 1] += extinction * f64::from(class.color[c]));
        }
        let [extinction, colors @ ..] = sums;
        let [red, green, blue] = colors.map(|sum| if extinction > 0.0 { sum / extinction } else { 0.0 });
        [extinction / STEPS as f64, red, green, blue]
    }

    #[test]
    fn means_are_those_of_a_quadrature() {
        let range = 50.0f32;
        let part = |place: f64| (place * f64::from(range)) as f32;
        for count in [2u16, 6, 12, 40, 256] {
            let tf = saw(count, range);
            let base = Base::new(ValueRange { least: 0.0, greatest: range }, &tf);
            let preintegrated = Preintegrated::new(&tf, 1.0, base);
            let ways = [
                [0.1, 0.4, 0.9],
                [0.9, 0.35, 0.36],
                [0.5, 0.2, 0.5],
                [-0.5, 0.05, -0.1],
                [0.8, 1.4, 1.7],
                [-1.0, 2.0, 0.3],
                [0.6, 0.600_01, 0.600_011],
            ];
            for way in ways {
                let values = way.map(part);
                let relative = values.map(|value| base.relative(value));
                let found = pulp::Arch::new().dispatch(Ways(&preintegrated, relative));
                for h in 0..2 {
                    let expected = quadrature(&tf, f64::from(values[h]), f64::from(values[h + 1]));
                    for c in 0..4 {
                        let apart = (f64::from(found[h][c]) - expected[c]).abs();
                        let what = format!("{count} points, {way:?}, half {h}: {:?}, {expected:?}", found[h]);
                        assert!(apart < 1e-3 * expected[0].max(1.0), "{what}");
                    }
                }
            }
        }
    }

    #[test]
    fn one_value_has_its_class() {
        for count in [6u16, 64] {
            let tf = saw(count, 1.0);
            let base = Base::new(ValueRange { least: 0.0, greatest: 1.0 }, &tf);
            let preintegrated = Preintegrated::new(&tf, 1.0, base);
            let classifier = Classifier::new(&tf, 1.0, base);
            for share in [-0.5, 0.0, 0.2, 0.371, 1.0, 1.5] {
                let value = base.relative(share);
                let expected = classifier.class_of(value);
                for half in pulp::Arch::new().dispatch(Ways(&preintegrated, [value; 3])) {
                    assert_eq!(half[0], expected[0], "{count}, {share}");
                    assert!(expected[0] == 0.0 || half == expected, "{count}, {share}: {half:?}, {expected:?}");
                }
            }
        }
    }
}
