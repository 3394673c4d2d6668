//! Adaptive integration with an error estimate: Gauss-Kronrod (7, 15), the interval of the largest error is halved until
//! the sum of all errors is small enough (the strategy of QUADPACK, Piessens et al. 1983).
//!
//! The error of an interval is |K₁₅ − G₇|, which for smooth integrands exceeds the true error of K₁₅ by far; it is never
//! taken below the rounding of the sum.

/// How exact an integral must be, and how long to try.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MarchParams {
    /// Largest accepted error over the value, per channel of the largest value.
    pub relative_tolerance: f64,
    /// Intervals of one integral at most; the error that is left then is returned.
    pub max_intervals: u32,
}

impl Default for MarchParams {
    fn default() -> Self {
        Self { relative_tolerance: 1e-6, max_intervals: 400 }
    }
}

/// An integral per channel with the bound of its error.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Integral {
    /// Value per channel.
    pub value: [f64; 3],
    /// Estimated error per channel, ≥ 0.
    pub error: [f64; 3],
    /// Evaluations of the integrand.
    pub evaluations: u64,
}

impl Integral {
    pub(crate) fn add(&mut self, other: &Self) {
        for c in 0..3 {
            self.value[c] += other.value[c];
            self.error[c] += other.error[c];
        }
        self.evaluations += other.evaluations;
    }
}

/// Nodes of the 15-point rule on [0, 1] of the half interval, outermost first, with its weights.
const NODES: [f64; 8] = [
    0.991_455_371_120_812_6,
    0.949_107_912_342_758_5,
    0.864_864_423_359_769_1,
    0.741_531_185_599_394_4,
    0.586_087_235_467_691_1,
    0.405_845_151_377_397_2,
    0.207_784_955_007_898_47,
    0.0,
];
const KRONROD: [f64; 8] = [
    0.022_935_322_010_529_224,
    0.063_092_092_629_978_56,
    0.104_790_010_322_250_18,
    0.140_653_259_715_525_92,
    0.169_004_726_639_267_9,
    0.190_350_578_064_785_4,
    0.204_432_940_075_298_9,
    0.209_482_141_084_727_82,
];
/// Weights of the 7-point rule at the odd nodes.
const GAUSS: [f64; 4] =
    [0.129_484_966_168_869_7, 0.279_705_391_489_276_64, 0.381_830_050_505_118_9, 0.417_959_183_673_469_4];

#[derive(Clone, Copy)]
struct Piece {
    a: f64,
    b: f64,
    integral: Integral,
    worst: f64,
}

fn rule(f: &mut impl FnMut(f64) -> [f64; 3], a: f64, b: f64) -> Piece {
    let middle = a + 0.5 * (b - a);
    let half = 0.5 * (b - a);
    let mut kronrod = [0.0; 3];
    let mut gauss = [0.0; 3];
    let mut size = [0.0; 3];
    for (i, (node, weight)) in NODES.iter().zip(KRONROD).enumerate() {
        let sides = if *node == 0.0 { 1 } else { 2 };
        for side in 0..sides {
            let at = if side == 0 { middle + half * node } else { middle - half * node };
            let value = f(at);
            for c in 0..3 {
                kronrod[c] += weight * value[c];
                size[c] += weight * value[c].abs();
                if i % 2 == 1 {
                    gauss[c] += GAUSS[i / 2] * value[c];
                }
            }
        }
    }
    let error = |c: usize| half.abs() * ((kronrod[c] - gauss[c]).abs()).max(4.0 * f64::EPSILON * size[c]);
    let error = [error(0), error(1), error(2)];
    let worst = error.iter().fold(0.0, |m: f64, e| m.max(*e));
    Piece { a, b, integral: Integral { value: kronrod.map(|k| k * half), error, evaluations: 15 }, worst }
}

/// ∫f over the intervals between neighbouring `ends` (rising).
pub(crate) fn integrate(mut f: impl FnMut(f64) -> [f64; 3], ends: &[f64], params: &MarchParams) -> Integral {
    let mut pieces: Vec<Piece> = ends.windows(2).filter(|w| w[0] < w[1]).map(|w| rule(&mut f, w[0], w[1])).collect();
    let mut spent = pieces.len() as u64 * 15;
    loop {
        let mut sum = Integral::default();
        pieces.iter().for_each(|p| sum.add(&p.integral));
        sum.evaluations = spent;
        let error: f64 = pieces.iter().map(|p| p.worst).sum();
        let largest = sum.value.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
        let Some(at) = (0..pieces.len()).max_by(|i, j| pieces[*i].worst.total_cmp(&pieces[*j].worst)) else {
            return sum;
        };
        let Piece { a, b, .. } = pieces[at];
        let middle = a + 0.5 * (b - a);
        let enough = error <= params.relative_tolerance * largest || error == 0.0;
        if enough || pieces.len() >= params.max_intervals as usize || middle <= a || middle >= b {
            return sum;
        }
        pieces[at] = rule(&mut f, a, middle);
        pieces.push(rule(&mut f, middle, b));
        spent += 30;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(f: impl Fn(f64) -> f64, ends: &[f64], exact: f64, tolerance: f64) -> Integral {
        let params = MarchParams { relative_tolerance: tolerance, ..MarchParams::default() };
        let found = integrate(|x| [f(x); 3], ends, &params);
        assert!((found.value[0] - exact).abs() <= found.error[0].max(1e-15), "{found:?}, exactly {exact}");
        assert!(found.error[0] <= tolerance * exact.abs() * 1.0001, "{found:?}");
        found
    }

    #[test]
    fn the_error_bound_holds() {
        check(|x| x.powi(20), &[0.0, 1.0], 1.0 / 21.0, 1e-12);
        check(f64::exp, &[0.0, 0.5, 1.0], std::f64::consts::E - 1.0, 1e-13);
        check(f64::sqrt, &[0.0, 1.0], 2.0 / 3.0, 1e-9);
        check(|x| f64::from(x > 1.0 / 3.0), &[0.0, 1.0], 2.0 / 3.0, 1e-6);
        let peak = check(|x| 1e-3 / (1e-6 + (x - 0.3) * (x - 0.3)), &[0.0, 1.0], peak_exact(), 1e-10);
        assert!(peak.evaluations < 2000, "{peak:?}");
    }

    fn peak_exact() -> f64 {
        (0.7e3_f64).atan() + (0.3e3_f64).atan()
    }

    #[test]
    fn a_limit_too_low_is_said_in_the_error() {
        let params = MarchParams { relative_tolerance: 1e-12, max_intervals: 3 };
        let found = integrate(|x| [f64::from(x > 1.0 / 3.0); 3], &[0.0, 1.0], &params);
        assert!(found.error[0] > 1e-3);
    }
}
