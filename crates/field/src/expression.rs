//! Scalar fields written as formulas in x, y and z.
//!
//! A formula is parsed once into a postfix program that runs over any number type: f64 gives values, [`jet::Jet`] exact
//! first and second derivatives (forward differentiation, no step size), [`interval::Interval`] bounds over a box. The
//! parser is written here because the crates that parse formulas read −x^2 as (−x)^2 and report no column.

pub(crate) mod interval;
pub(crate) mod jet;
mod parse;
mod program;
mod slope;

use glam::{DMat3, DVec3};
use interval::Interval;
use jet::Jet;
pub use parse::ExpressionError;
use program::Program;
use slope::{LANES, Run, Slopes};
use splat_core::ScalarField;

/// A formula as a scalar field.
///
/// Operators by rising strength: `+ −`, `* /`, unary `−`, `^` (right to left, so −x^2 is −(x^2)). Names: `x y z`,
/// `pi`, `e` and the caller's constants. Functions: `sin cos tan asin acos atan sinh cosh tanh exp ln log10 log2 sqrt
/// abs min max atan2 pow`; `log` is `ln`.
///
/// ```
/// use field::ExpressionField;
/// use splat_core::{ScalarField, glam::DVec3};
/// let ball = ExpressionField::parse("x^2 + y^2 + z^2 - 1").unwrap();
/// assert_eq!(ball.value(DVec3::new(2.0, 0.0, 0.0)), 3.0);
/// assert_eq!(ball.gradient(DVec3::new(2.0, 0.0, 0.0)), DVec3::new(4.0, 0.0, 0.0));
/// assert!(ball.bound(DVec3::new(9.0, 0.0, 0.0), 1.0).unwrap().0 > 0.0);
/// let error = ExpressionField::parse("2*sine(x)").unwrap_err();
/// assert_eq!(error.column, 3);
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct ExpressionField {
    program: Program,
}

impl ExpressionField {
    /// Parses a formula.
    ///
    /// # Errors
    /// [`ExpressionError`] with the column (from 1), what was found, what was expected, and a hint.
    pub fn parse(text: &str) -> Result<Self, ExpressionError> {
        Self::parse_with(text, &[])
    }

    /// Parses a formula that may use named constants; they may not be called like a variable or function.
    ///
    /// # Errors
    /// As [`ExpressionField::parse`].
    pub fn parse_with(text: &str, constants: &[(&str, f64)]) -> Result<Self, ExpressionError> {
        Ok(Self { program: parse::parse(text, constants)? })
    }

    /// Operations that a value takes.
    pub fn operations(&self) -> usize {
        self.program.len()
    }
}

impl ExpressionField {
    /// Value and gradient in one lane; where the gradient is no number, whether it truly is none takes second derivatives
    /// to tell (√ of a constant 0).
    fn checked<const N: usize>(&self, found: &Slopes<N>, i: usize, p: DVec3) -> (f64, DVec3) {
        let (value, gradient) = found.get(i);
        (value, if gradient.is_finite() { gradient } else { self.gradient(p) })
    }
}

impl ScalarField for ExpressionField {
    fn value(&self, p: DVec3) -> f64 {
        self.program.run([p.x, p.y, p.z])
    }

    fn gradient(&self, p: DVec3) -> DVec3 {
        self.program.run(Jet::variables(p)).gradient
    }

    fn value_gradient(&self, p: DVec3) -> (f64, DVec3) {
        let run = Run { program: &self.program, small: Run::is_small(&self.program), at: [p] };
        self.checked(&pulp::NullaryFnOnce::call(run), 0, p)
    }

    fn value_gradients(&self, at: &[DVec3], out: &mut [(f64, DVec3)]) {
        let small = Run::is_small(&self.program);
        for (at, out) in at.chunks(LANES).zip(out.chunks_mut(LANES)) {
            // Lanes without a place of their own take the first.
            let places = std::array::from_fn(|i| at.get(i).copied().unwrap_or(at[0]));
            let found: Slopes<LANES> = pulp::Arch::new().dispatch(Run { program: &self.program, small, at: places });
            out.iter_mut().zip(at).enumerate().for_each(|(i, (out, p))| *out = self.checked(&found, i, *p));
        }
    }

    fn hessian(&self, p: DVec3) -> DMat3 {
        self.program.run(Jet::variables(p)).hessian()
    }

    fn bound(&self, p: DVec3, radius: f64) -> Option<(f64, f64)> {
        let r = radius.abs();
        let i = self.program.run([p.x, p.y, p.z].map(|c| Interval::around(c, r)));
        (i.low.is_finite() && i.high.is_finite()).then_some((i.low, i.high))
    }
}
