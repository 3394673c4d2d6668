//! Intervals: bounds of a formula over a box, widened by two ulps a step so that rounding cannot lose a value.
//!
//! If a function is not defined on the whole interval, the result is unknown (NaN), and stays unknown to the end:
//! tanh of a value that may be undefined must not look bounded.

use super::program::{Binary, Number, Unary};
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// All numbers from `low` to `high`.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Interval {
    pub(crate) low: f64,
    pub(crate) high: f64,
}

/// No bound is known.
const UNKNOWN: Interval = Interval { low: f64::NAN, high: f64::NAN };

impl Interval {
    /// From `center` − `radius` to `center` + `radius`.
    pub(crate) fn around(center: f64, radius: f64) -> Self {
        Self::widened(center - radius, center + radius)
    }

    fn widened(low: f64, high: f64) -> Self {
        if low.is_nan() || high.is_nan() {
            return UNKNOWN;
        }
        Self { low: low.next_down().next_down(), high: high.next_up().next_up() }
    }

    /// The hull of some values.
    fn hull(values: &[f64]) -> Self {
        if values.iter().any(|v| v.is_nan()) {
            return UNKNOWN;
        }
        let low = values.iter().copied().fold(f64::INFINITY, f64::min);
        Self::widened(low, values.iter().copied().fold(f64::NEG_INFINITY, f64::max))
    }

    fn contains(self, v: f64) -> bool {
        self.low <= v && v <= self.high
    }

    /// A function that rises everywhere.
    fn rising(self, f: Unary) -> Self {
        Self::widened(self.low.unary(f), self.high.unary(f))
    }

    /// A rising function that is defined from `low` to `high` only.
    fn rising_within(self, f: Unary, low: f64, high: f64) -> Self {
        if self.low < low || self.high > high { UNKNOWN } else { self.rising(f) }
    }

    /// sin, moved by `shift`: 0 for sin, π/2 for cos.
    fn wave(self, shift: f64) -> Self {
        // The slack covers the rounding of the shift and of the multiples of 2π.
        let slack = 1e-15 * (self.low.abs().max(self.high.abs()) + TAU);
        let low = self.low + shift - slack;
        let high = self.high + shift + slack;
        let width = high - low;
        if width.is_nan() || width >= TAU {
            return Self { low: -1.0, high: 1.0 };
        }
        let passes = |v: f64| ((low - v) / TAU).ceil() * TAU + v <= high;
        let a = libm::sin(low);
        let b = libm::sin(high);
        Self {
            low: if passes(-FRAC_PI_2) { -1.0 } else { (a.min(b) - slack).max(-1.0) },
            high: if passes(FRAC_PI_2) { 1.0 } else { (a.max(b) + slack).min(1.0) },
        }
    }

    fn tangent(self) -> Self {
        let slack = 1e-15 * (self.low.abs().max(self.high.abs()) + PI);
        let pole = ((self.low - slack - FRAC_PI_2) / PI).ceil() * PI + FRAC_PI_2;
        let width = self.high - self.low;
        if width < PI && pole > self.high + slack { self.rising(Unary::Tan) } else { UNKNOWN }
    }

    fn powi(self, n: i32) -> Self {
        if n < 0 && self.contains(0.0) {
            return UNKNOWN;
        }
        let mut hull = [self.low.powi(n), self.high.powi(n), 0.0];
        if n > 0 && n % 2 == 0 && self.contains(0.0) {
            return Self { low: 0.0, ..Self::hull(&hull) };
        }
        hull[2] = hull[0];
        Self::hull(&hull).grown(n)
    }

    /// Repeated multiplication rounds at each step.
    fn grown(self, n: i32) -> Self {
        let relative = f64::EPSILON * f64::from(n.unsigned_abs());
        Self { low: self.low - self.low.abs() * relative, high: self.high + self.high.abs() * relative }
    }

    fn products(self, other: Self) -> Self {
        let product = |a: f64, b: f64| if a == 0.0 || b == 0.0 { 0.0 } else { a * b };
        Self::hull(&[
            product(self.low, other.low),
            product(self.low, other.high),
            product(self.high, other.low),
            product(self.high, other.high),
        ])
    }
}

impl Number for Interval {
    fn constant(value: f64) -> Self {
        Self { low: value, high: value }
    }

    fn unary(self, f: Unary) -> Self {
        if self.low.is_nan() {
            return UNKNOWN;
        }
        match f {
            Unary::Neg => Self { low: -self.high, high: -self.low },
            Unary::Sin => self.wave(0.0),
            Unary::Cos => self.wave(FRAC_PI_2),
            Unary::Tan => self.tangent(),
            Unary::Asin => self.rising_within(f, -1.0, 1.0),
            Unary::Acos if self.low < -1.0 || self.high > 1.0 => UNKNOWN,
            Unary::Acos => Self::widened(libm::acos(self.high), libm::acos(self.low)),
            Unary::Atan | Unary::Sinh | Unary::Tanh | Unary::Exp => self.rising(f),
            Unary::Cosh => {
                let low = if self.contains(0.0) { 1.0 } else { libm::cosh(self.low).min(libm::cosh(self.high)) };
                Self::widened(low, libm::cosh(self.low).max(libm::cosh(self.high)))
            }
            Unary::Ln | Unary::Log10 | Unary::Log2 => self.rising_within(f, f64::MIN_POSITIVE, f64::INFINITY),
            Unary::Sqrt => self.rising_within(f, 0.0, f64::INFINITY),
            Unary::Abs if self.contains(0.0) => Self { low: 0.0, high: self.high.max(-self.low) },
            Unary::Abs => Self { low: self.low.abs().min(self.high.abs()), high: self.low.abs().max(self.high.abs()) },
            Unary::Powi(n) => self.powi(n),
        }
    }

    fn binary(self, f: Binary, other: Self) -> Self {
        if self.low.is_nan() || other.low.is_nan() {
            return UNKNOWN;
        }
        match f {
            Binary::Add => Self::widened(self.low + other.low, self.high + other.high),
            Binary::Sub => Self::widened(self.low - other.high, self.high - other.low),
            Binary::Mul => self.products(other),
            Binary::Div if other.contains(0.0) => UNKNOWN,
            Binary::Div => self.products(Self::widened(1.0 / other.high, 1.0 / other.low)),
            Binary::Pow if self.low > 0.0 => self.unary(Unary::Ln).products(other).unary(Unary::Exp).grown(64),
            Binary::Pow => UNKNOWN,
            Binary::Min => Self { low: self.low.min(other.low), high: self.high.min(other.high) },
            Binary::Max => Self { low: self.low.max(other.low), high: self.high.max(other.high) },
            Binary::Atan2 if other.low > 0.0 => self.binary(Binary::Div, other).unary(Unary::Atan),
            Binary::Atan2 => Self::widened(-PI, PI),
        }
    }
}
