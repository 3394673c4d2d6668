//! Numbers that carry their gradient, for several places at once: the arithmetic of [`super::jet`] without Hessians, in lanes.
//!
//! ∇f(a) = f′(a)·∇a; ∇f(a, b) = f_a·∇a + f_b·∇b.

use super::program::{Binary, MAX_STACK, Number, Program, Unary};
use glam::DVec3;
use std::f64::consts::{LN_2, LN_10};

/// Places that are worked on at once.
pub(super) const LANES: usize = 8;

/// Operands for which a small stack is enough, which is cheaper to clear.
const SMALL_STACK: usize = 6;

/// Value and gradient at `N` places.
#[derive(Debug, Clone, Copy)]
pub(super) struct Slopes<const N: usize> {
    pub(super) value: [f64; N],
    pub(super) gradient: [[f64; N]; 3],
}

/// A formula at some places, in the form that [`pulp`] compiles once per instruction set.
pub(super) struct Run<'a, const N: usize> {
    pub(super) program: &'a Program,
    /// Whether the program needs no more than the small stack.
    pub(super) small: bool,
    pub(super) at: [DVec3; N],
}

impl Run<'_, 0> {
    /// Whether a program needs no more than the small stack.
    pub(super) fn is_small(program: &Program) -> bool {
        program.depth() <= SMALL_STACK
    }
}

impl<const N: usize> pulp::NullaryFnOnce for Run<'_, N> {
    type Output = Slopes<N>;

    #[inline(always)]
    fn call(self) -> Slopes<N> {
        let variable = |a: usize| {
            let mut gradient = [[0.0; N]; 3];
            gradient[a] = [1.0; N];
            Slopes { value: self.at.map(|p| p[a]), gradient }
        };
        let variables = [variable(0), variable(1), variable(2)];
        if self.small {
            self.program.run_on::<_, SMALL_STACK>(variables)
        } else {
            self.program.run_on::<_, MAX_STACK>(variables)
        }
    }
}

impl<const N: usize> Slopes<N> {
    /// Value and gradient at place `i`.
    pub(super) fn get(&self, i: usize) -> (f64, DVec3) {
        (self.value[i], DVec3::from_array([0, 1, 2].map(|a| self.gradient[a][i])))
    }

    #[inline(always)]
    fn chain(self, f: impl Fn(f64) -> [f64; 2]) -> Self {
        let mut slope = [0.0; N];
        let mut value = [0.0; N];
        for i in 0..N {
            [value[i], slope[i]] = f(self.value[i]);
        }
        let mut gradient = self.gradient;
        for part in &mut gradient {
            (0..N).for_each(|i| part[i] *= slope[i]);
        }
        Self { value, gradient }
    }

    /// `f` gives the value and its derivatives by both operands.
    #[inline(always)]
    fn combine(self, other: Self, f: impl Fn(f64, f64) -> [f64; 3]) -> Self {
        let mut found = Self { value: [0.0; N], gradient: [[0.0; N]; 3] };
        let mut slopes = [[0.0; N]; 2];
        for i in 0..N {
            [found.value[i], slopes[0][i], slopes[1][i]] = f(self.value[i], other.value[i]);
        }
        for a in 0..3 {
            for i in 0..N {
                found.gradient[a][i] = self.gradient[a][i] * slopes[0][i] + other.gradient[a][i] * slopes[1][i];
            }
        }
        found
    }

    /// This one or, where `other_wins`, the other.
    #[inline(always)]
    fn select(self, other: Self, f: Binary, other_wins: impl Fn(f64, f64) -> bool) -> Self {
        let mut found = self;
        for i in 0..N {
            found.value[i] = self.value[i].binary(f, other.value[i]);
            if other_wins(self.value[i], other.value[i]) {
                (0..3).for_each(|a| found.gradient[a][i] = other.gradient[a][i]);
            }
        }
        found
    }

    /// aᵇ. ln a is not wanted where the exponent is constant: a may be negative or 0.
    fn power(self, other: Self) -> Self {
        let mut found = self;
        for i in 0..N {
            let a = self.value[i];
            let b = other.value[i];
            let u = libm::pow(a, b);
            let by_base = b * libm::pow(a, b - 1.0);
            let constant = (0..3).all(|axis| other.gradient[axis][i] == 0.0);
            let by_exponent = if constant { 0.0 } else { u * libm::log(a) };
            found.value[i] = u;
            for axis in 0..3 {
                found.gradient[axis][i] = self.gradient[axis][i] * by_base + other.gradient[axis][i] * by_exponent;
            }
        }
        found
    }
}

impl<const N: usize> Number for Slopes<N> {
    #[inline(always)]
    fn constant(value: f64) -> Self {
        Self { value: [value; N], gradient: [[0.0; N]; 3] }
    }

    #[inline(always)]
    fn unary(self, f: Unary) -> Self {
        match f {
            Unary::Neg => self.chain(|x| [-x, -1.0]),
            Unary::Sqrt => self.chain(|x| [x.sqrt(), 0.5 / x.sqrt()]),
            Unary::Powi(2) => self.chain(|x| [x * x, 2.0 * x]),
            Unary::Powi(3) => self.chain(|x| [x * x * x, 3.0 * (x * x)]),
            Unary::Abs => self.chain(|x| [x.abs(), if x == 0.0 { 0.0 } else { x.signum() }]),
            _ => self.chain(|x| slope(f, x)),
        }
    }

    #[inline(always)]
    fn binary(self, f: Binary, other: Self) -> Self {
        match f {
            Binary::Add => self.combine(other, |a, b| [a + b, 1.0, 1.0]),
            Binary::Sub => self.combine(other, |a, b| [a - b, 1.0, -1.0]),
            Binary::Mul => self.combine(other, |a, b| [a * b, b, a]),
            Binary::Div => self.combine(other, |a, b| [a / b, 1.0 / b, -(a / b) * (1.0 / b)]),
            Binary::Min => self.select(other, f, |a, b| a > b || b.is_nan()),
            Binary::Max => self.select(other, f, |a, b| a < b || b.is_nan()),
            Binary::Pow => self.power(other),
            Binary::Atan2 => self.combine(other, |a, b| {
                let q = 1.0 / (a * a + b * b);
                [libm::atan2(a, b), b * q, -a * q]
            }),
        }
    }
}

/// f and f′ at x.
fn slope(f: Unary, x: f64) -> [f64; 2] {
    let u = |f: Unary| x.unary(f);
    match f {
        Unary::Neg => [-x, -1.0],
        Unary::Sin => {
            let (sin, cos) = libm::sincos(x);
            [sin, cos]
        }
        Unary::Cos => {
            let (sin, cos) = libm::sincos(x);
            [cos, -sin]
        }
        Unary::Tan => [u(f), 1.0 + u(f) * u(f)],
        Unary::Asin => [u(f), 1.0 / (1.0 - x * x).sqrt()],
        Unary::Acos => [u(f), -1.0 / (1.0 - x * x).sqrt()],
        Unary::Atan => [u(f), 1.0 / (1.0 + x * x)],
        Unary::Sinh => [u(f), libm::cosh(x)],
        Unary::Cosh => [u(f), libm::sinh(x)],
        Unary::Tanh => [u(f), 1.0 - u(f) * u(f)],
        Unary::Exp => [u(f), u(f)],
        Unary::Ln => [u(f), 1.0 / x],
        Unary::Log10 => [u(f), 1.0 / (x * LN_10)],
        Unary::Log2 => [u(f), 1.0 / (x * LN_2)],
        Unary::Sqrt => [u(f), 0.5 / u(f)],
        Unary::Abs => [x.abs(), if x == 0.0 { 0.0 } else { x.signum() }],
        // The factor comes first: 0·(1/0) must stay 0.
        Unary::Powi(n) => [x.powi(n), if n == 0 { 0.0 } else { f64::from(n) * x.powi(n - 1) }],
    }
}
