//! A formula as a postfix program over any number type.

/// Deepest stack of operands.
pub(crate) const MAX_STACK: usize = 32;

/// Functions of one number.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Unary {
    Neg,
    Sin,
    Cos,
    Tan,
    Asin,
    Acos,
    Atan,
    Sinh,
    Cosh,
    Tanh,
    Exp,
    Ln,
    Log10,
    Log2,
    Sqrt,
    Abs,
    /// A whole power.
    Powi(i32),
}

/// Functions of two numbers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Binary {
    Add,
    Sub,
    Mul,
    Div,
    Pow,
    Min,
    Max,
    Atan2,
}

/// One step of a program.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Op {
    Constant(f64),
    Variable(u8),
    Unary(Unary),
    Binary(Binary),
}

/// What a program computes with.
pub(crate) trait Number: Copy {
    fn constant(value: f64) -> Self;
    fn unary(self, f: Unary) -> Self;
    fn binary(self, f: Binary, other: Self) -> Self;
}

/// A formula in postfix order; its stack never exceeds [`MAX_STACK`].
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Program {
    ops: Vec<Op>,
}

impl Program {
    /// Appends one step; constants are folded.
    pub(crate) fn push(&mut self, op: Op) {
        match (op, self.ops.as_slice()) {
            (Op::Unary(f), [.., Op::Constant(a)]) => {
                let folded = Op::Constant(a.unary(f));
                self.ops.pop();
                self.ops.push(folded);
            }
            (Op::Binary(f), [.., Op::Constant(a), Op::Constant(b)]) => {
                let folded = Op::Constant(a.binary(f, *b));
                self.ops.truncate(self.ops.len() - 2);
                self.ops.push(folded);
            }
            (Op::Binary(Binary::Pow), [.., Op::Constant(n)]) if n.fract() == 0.0 && n.abs() <= 1024.0 => {
                let n = *n as i32;
                self.ops.pop();
                self.ops.push(Op::Unary(Unary::Powi(n)));
            }
            _ => self.ops.push(op),
        }
    }

    /// Steps.
    pub(crate) fn len(&self) -> usize {
        self.ops.len()
    }

    /// Operands that wait at the deepest point.
    pub(crate) fn depth(&self) -> usize {
        let mut depth = 0usize;
        let mut deepest = 0;
        for op in &self.ops {
            match op {
                Op::Constant(_) | Op::Variable(_) => depth += 1,
                Op::Unary(_) => {}
                Op::Binary(_) => depth -= 1,
            }
            deepest = deepest.max(depth);
        }
        deepest
    }

    /// Runs with these values of x, y and z.
    pub(crate) fn run<T: Number>(&self, variables: [T; 3]) -> T {
        self.run_on::<T, MAX_STACK>(variables)
    }

    /// Runs on a stack of `STACK` operands, no fewer than [`Program::depth`].
    #[inline(always)]
    pub(crate) fn run_on<T: Number, const STACK: usize>(&self, variables: [T; 3]) -> T {
        let mut stack = [T::constant(0.0); STACK];
        let mut top = 0;
        for op in &self.ops {
            match *op {
                Op::Constant(c) => {
                    stack[top] = T::constant(c);
                    top += 1;
                }
                Op::Variable(v) => {
                    stack[top] = variables[usize::from(v)];
                    top += 1;
                }
                Op::Unary(f) => stack[top - 1] = stack[top - 1].unary(f),
                Op::Binary(f) => {
                    top -= 1;
                    stack[top - 1] = stack[top - 1].binary(f, stack[top]);
                }
            }
        }
        stack[0]
    }
}

impl Number for f64 {
    fn constant(value: f64) -> Self {
        value
    }

    fn unary(self, f: Unary) -> Self {
        match f {
            Unary::Neg => -self,
            Unary::Sin => libm::sin(self),
            Unary::Cos => libm::cos(self),
            Unary::Tan => libm::tan(self),
            Unary::Asin => libm::asin(self),
            Unary::Acos => libm::acos(self),
            Unary::Atan => libm::atan(self),
            Unary::Sinh => libm::sinh(self),
            Unary::Cosh => libm::cosh(self),
            Unary::Tanh => libm::tanh(self),
            Unary::Exp => libm::exp(self),
            Unary::Ln => libm::log(self),
            Unary::Log10 => libm::log10(self),
            Unary::Log2 => libm::log2(self),
            Unary::Sqrt => self.sqrt(),
            Unary::Abs => self.abs(),
            Unary::Powi(n) => self.powi(n),
        }
    }

    fn binary(self, f: Binary, other: Self) -> Self {
        match f {
            Binary::Add => self + other,
            Binary::Sub => self - other,
            Binary::Mul => self * other,
            Binary::Div => self / other,
            Binary::Pow => libm::pow(self, other),
            // f64::min and max hide NaN; a field must not.
            Binary::Min => {
                if self <= other || self.is_nan() {
                    self
                } else {
                    other
                }
            }
            Binary::Max => {
                if self >= other || self.is_nan() {
                    self
                } else {
                    other
                }
            }
            Binary::Atan2 => libm::atan2(self, other),
        }
    }
}
