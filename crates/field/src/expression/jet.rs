//! Numbers that carry their gradient and Hessian: forward differentiation, exact to rounding.
//!
//! Chain rule for u = f(a): ∇u = f′∇a, Hu = f′Ha + f″∇a∇aᵀ; for u = f(a, b) with subscripts for partial derivatives:
//! ∇u = f_a∇a + f_b∇b, Hu = f_a Ha + f_b Hb + f_aa ∇a∇aᵀ + f_ab(∇a∇bᵀ + ∇b∇aᵀ) + f_bb ∇b∇bᵀ.

use super::program::{Binary, Number, Unary};
use glam::{DMat3, DVec3};
use std::f64::consts::{LN_2, LN_10};

/// Value, gradient and Hessian.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Jet {
    pub(crate) value: f64,
    pub(crate) gradient: DVec3,
    /// xx, yy, zz.
    diagonal: DVec3,
    /// yz, zx, xy.
    mixed: DVec3,
}

/// f and its partial derivatives a, b, aa, ab, bb.
type Partials = [f64; 6];

impl Jet {
    /// The coordinates at `p`.
    pub(crate) fn variables(p: DVec3) -> [Self; 3] {
        [0, 1, 2].map(|a| Self { gradient: DVec3::AXES[a], ..Self::constant(p[a]) })
    }

    /// The symmetric Hessian.
    pub(crate) fn hessian(&self) -> DMat3 {
        let d = self.diagonal;
        let m = self.mixed;
        DMat3::from_cols(DVec3::new(d.x, m.z, m.y), DVec3::new(m.z, d.y, m.x), DVec3::new(m.y, m.x, d.z))
    }

    fn is_constant(&self) -> bool {
        self.gradient == DVec3::ZERO && self.diagonal == DVec3::ZERO && self.mixed == DVec3::ZERO
    }

    fn chain(self, jet: [f64; 3]) -> Self {
        let [f, d, dd] = jet;
        if self.is_constant() {
            return Self::constant(f);
        }
        let g = self.gradient;
        Self {
            value: f,
            gradient: g * d,
            diagonal: self.diagonal * d + g * g * dd,
            mixed: self.mixed * d + off_diagonal(g, g) * (0.5 * dd),
        }
    }

    fn combine(self, other: Self, partials: Partials) -> Self {
        let [f, a, b, aa, ab, bb] = partials;
        let g = self.gradient;
        let h = other.gradient;
        Self {
            value: f,
            gradient: g * a + h * b,
            diagonal: self.diagonal * a + other.diagonal * b + g * g * aa + g * h * (2.0 * ab) + h * h * bb,
            mixed: self.mixed * a
                + other.mixed * b
                + off_diagonal(g, g) * (0.5 * aa)
                + off_diagonal(g, h) * ab
                + off_diagonal(h, h) * (0.5 * bb),
        }
    }
}

/// yz, zx and xy of g·hᵀ + h·gᵀ.
fn off_diagonal(g: DVec3, h: DVec3) -> DVec3 {
    DVec3::new(g.y * h.z + g.z * h.y, g.z * h.x + g.x * h.z, g.x * h.y + g.y * h.x)
}

/// f, f′ and f″ at x.
fn derivatives(f: Unary, x: f64) -> [f64; 3] {
    let u = x.unary(f);
    match f {
        Unary::Neg => [u, -1.0, 0.0],
        Unary::Sin => [u, libm::cos(x), -u],
        Unary::Cos => [u, -libm::sin(x), -u],
        Unary::Tan => [u, 1.0 + u * u, 2.0 * u * (1.0 + u * u)],
        Unary::Asin => {
            let c = 1.0 - x * x;
            [u, 1.0 / c.sqrt(), x / (c * c.sqrt())]
        }
        Unary::Acos => {
            let c = 1.0 - x * x;
            [u, -1.0 / c.sqrt(), -x / (c * c.sqrt())]
        }
        Unary::Atan => {
            let d = 1.0 / (1.0 + x * x);
            [u, d, -2.0 * x * d * d]
        }
        Unary::Sinh => [u, libm::cosh(x), u],
        Unary::Cosh => [u, libm::sinh(x), u],
        Unary::Tanh => [u, 1.0 - u * u, -2.0 * u * (1.0 - u * u)],
        Unary::Exp => [u, u, u],
        Unary::Ln => [u, 1.0 / x, -1.0 / (x * x)],
        Unary::Log10 => [u, 1.0 / (x * LN_10), -1.0 / (x * x * LN_10)],
        Unary::Log2 => [u, 1.0 / (x * LN_2), -1.0 / (x * x * LN_2)],
        Unary::Sqrt => [u, 0.5 / u, -0.25 / (x * u)],
        Unary::Abs => [u, if x == 0.0 { 0.0 } else { x.signum() }, 0.0],
        Unary::Powi(n) => {
            let m = f64::from(n);
            // The factors come first: 0·(1/0) must stay 0.
            let d = if n == 0 { 0.0 } else { m * x.powi(n - 1) };
            [u, d, if n == 0 || n == 1 { 0.0 } else { m * (m - 1.0) * x.powi(n - 2) }]
        }
    }
}

impl Number for Jet {
    fn constant(value: f64) -> Self {
        Self { value, gradient: DVec3::ZERO, diagonal: DVec3::ZERO, mixed: DVec3::ZERO }
    }

    fn unary(self, f: Unary) -> Self {
        self.chain(derivatives(f, self.value))
    }

    fn binary(self, f: Binary, other: Self) -> Self {
        let a = self.value;
        let b = other.value;
        let u = a.binary(f, b);
        match f {
            Binary::Add => self.combine(other, [u, 1.0, 1.0, 0.0, 0.0, 0.0]),
            Binary::Sub => self.combine(other, [u, 1.0, -1.0, 0.0, 0.0, 0.0]),
            Binary::Mul => self.combine(other, [u, b, a, 0.0, 1.0, 0.0]),
            Binary::Div => {
                let r = 1.0 / b;
                self.combine(other, [u, r, -u * r, 0.0, -r * r, 2.0 * u * r * r])
            }
            // ln a is not wanted where the exponent is constant: a may be negative or 0.
            Binary::Pow if other.is_constant() => {
                self.chain([u, b * libm::pow(a, b - 1.0), b * (b - 1.0) * libm::pow(a, b - 2.0)])
            }
            Binary::Pow => {
                let l = libm::log(a);
                let w = libm::pow(a, b - 1.0);
                let aa = b * (b - 1.0) * libm::pow(a, b - 2.0);
                self.combine(other, [u, b * w, u * l, aa, w * (1.0 + b * l), u * l * l])
            }
            Binary::Min => {
                if a <= b {
                    self
                } else {
                    other
                }
            }
            Binary::Max => {
                if a >= b {
                    self
                } else {
                    other
                }
            }
            Binary::Atan2 => {
                let q = 1.0 / (a * a + b * b);
                let da = b * q;
                let db = -a * q;
                self.combine(other, [u, da, db, 2.0 * da * db, (a * a - b * b) * q * q, -2.0 * da * db])
            }
        }
    }
}
