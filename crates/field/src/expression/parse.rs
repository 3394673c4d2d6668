//! Text → program: recursive descent, errors with a column and a hint.
//!
//! ```text
//! sum     = product (('+' | '-') product)*
//! product = sign (('*' | '/') sign)*
//! sign    = ('-' | '+') sign | power
//! power   = atom ('^' sign)?
//! atom    = number | name | name '(' sum (',' sum)* ')' | '(' sum ')'
//! ```

use super::program::{Binary, MAX_STACK, Op, Program, Unary};

/// Why a formula was refused.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("expression, column {column}: found {found}, expected {expected}{hint}")]
pub struct ExpressionError {
    /// Column of the offending character, counted from 1.
    pub column: usize,
    /// The text at that place.
    pub found: String,
    /// The accepted text at that place.
    pub expected: String,
    /// The remedy, beginning with "; ", or empty.
    pub hint: String,
}

const MAX_CHARS: usize = 1 << 16;
const MAX_NESTING: usize = 64;

const UNARY: [(&str, Unary); 16] = [
    ("sin", Unary::Sin),
    ("cos", Unary::Cos),
    ("tan", Unary::Tan),
    ("asin", Unary::Asin),
    ("acos", Unary::Acos),
    ("atan", Unary::Atan),
    ("sinh", Unary::Sinh),
    ("cosh", Unary::Cosh),
    ("tanh", Unary::Tanh),
    ("exp", Unary::Exp),
    ("ln", Unary::Ln),
    ("log", Unary::Ln),
    ("log10", Unary::Log10),
    ("log2", Unary::Log2),
    ("sqrt", Unary::Sqrt),
    ("abs", Unary::Abs),
];

const BINARY: [(&str, Binary); 4] =
    [("min", Binary::Min), ("max", Binary::Max), ("atan2", Binary::Atan2), ("pow", Binary::Pow)];

const VARIABLES: [&str; 3] = ["x", "y", "z"];

const NUMBERS: [(&str, f64); 2] = [("pi", std::f64::consts::PI), ("e", std::f64::consts::E)];

/// Parses a formula.
pub(crate) fn parse(text: &str, constants: &[(&str, f64)]) -> Result<Program, ExpressionError> {
    let chars: Vec<char> = text.chars().take(MAX_CHARS + 1).collect();
    let mut parser = Parser { chars: &chars, at: 0, nesting: 0, constants, program: Program::default() };
    if chars.len() > MAX_CHARS {
        parser.at = MAX_CHARS;
        return Err(parser.error("at most 65536 characters", ""));
    }
    if let Some((name, _)) = constants.iter().find(|(name, value)| is_taken(name) || !value.is_finite()) {
        let mut error = parser.error("constants with a finite value and a name that is not a variable or function", "");
        error.found = format!("the constant '{name}'");
        return Err(error);
    }
    parser.sum()?;
    if parser.peek().is_some() {
        return Err(parser.after_operand());
    }
    if parser.program.depth() > MAX_STACK {
        parser.at = 0;
        return Err(parser.error("fewer operands that wait for each other", "; put the deepest bracket first"));
    }
    Ok(parser.program)
}

fn is_taken(name: &str) -> bool {
    names().any(|n| n == name)
}

fn names<'a>() -> impl Iterator<Item = &'a str> {
    let functions = UNARY.iter().map(|f| f.0).chain(BINARY.iter().map(|f| f.0));
    functions.chain(VARIABLES).chain(NUMBERS.iter().map(|n| n.0))
}

struct Parser<'a> {
    chars: &'a [char],
    at: usize,
    nesting: usize,
    constants: &'a [(&'a str, f64)],
    program: Program,
}

impl Parser<'_> {
    /// The next character that is not a space.
    fn peek(&mut self) -> Option<char> {
        while self.chars.get(self.at).is_some_and(|c| c.is_whitespace()) {
            self.at += 1;
        }
        self.chars.get(self.at).copied()
    }

    fn take(&mut self, accepted: &[char]) -> Option<char> {
        let c = self.peek().filter(|c| accepted.contains(c))?;
        self.at += 1;
        Some(c)
    }

    fn error(&self, expected: &str, hint: &str) -> ExpressionError {
        let found = self.chars.get(self.at).map_or("the end".to_owned(), |c| format!("'{c}'"));
        ExpressionError { column: self.at + 1, found, expected: expected.to_owned(), hint: hint.to_owned() }
    }

    /// Something follows a complete operand that cannot.
    fn after_operand(&self) -> ExpressionError {
        let hint = match self.chars.get(self.at) {
            Some(c) if c.is_alphanumeric() || *c == '(' || *c == '_' => "; products need their sign: 2*x",
            Some(')') => "; there is no bracket to close",
            Some('<' | '>' | '=' | '!') => "; comparisons are not available: use min, max or abs",
            _ => "",
        };
        self.error("an operator or the end", hint)
    }

    fn sum(&mut self) -> Result<(), ExpressionError> {
        self.product()?;
        while let Some(c) = self.take(&['+', '-', '−']) {
            self.product()?;
            self.program.push(Op::Binary(if c == '+' { Binary::Add } else { Binary::Sub }));
        }
        Ok(())
    }

    fn product(&mut self) -> Result<(), ExpressionError> {
        self.sign()?;
        while let Some(c) = self.take(&['*', '/']) {
            if c == '*' && self.chars.get(self.at) == Some(&'*') {
                return Err(self.error("an operand", "; a power is written ^"));
            }
            self.sign()?;
            self.program.push(Op::Binary(if c == '*' { Binary::Mul } else { Binary::Div }));
        }
        Ok(())
    }

    fn sign(&mut self) -> Result<(), ExpressionError> {
        self.nested(|parser| match parser.take(&['+', '-', '−']) {
            Some('+') => parser.sign(),
            Some(_) => {
                parser.sign()?;
                parser.program.push(Op::Unary(Unary::Neg));
                Ok(())
            }
            None => parser.power(),
        })
    }

    /// Guards the call stack against text like ((((….
    fn nested(&mut self, inner: impl FnOnce(&mut Self) -> Result<(), ExpressionError>) -> Result<(), ExpressionError> {
        if self.nesting == 4 * MAX_NESTING {
            return Err(self.error("at most 256 nested signs, powers and brackets", "; split the formula"));
        }
        self.nesting += 1;
        inner(self)?;
        self.nesting -= 1;
        Ok(())
    }

    fn power(&mut self) -> Result<(), ExpressionError> {
        self.atom()?;
        if self.take(&['^']).is_some() {
            self.sign()?;
            self.program.push(Op::Binary(Binary::Pow));
        }
        Ok(())
    }

    fn atom(&mut self) -> Result<(), ExpressionError> {
        match self.peek() {
            Some('(') => {
                self.at += 1;
                self.sum()?;
                self.close()
            }
            Some(c) if c.is_ascii_digit() || c == '.' => self.number(),
            Some(c) if c.is_alphabetic() || c == '_' => self.name(),
            _ => Err(self.error("a number, a name or a bracket", "")),
        }
    }

    fn close(&mut self) -> Result<(), ExpressionError> {
        match self.take(&[')']) {
            Some(_) => Ok(()),
            None if self.peek().is_none() => Err(self.error("')'", "; a bracket is not closed")),
            None => Err(self.after_operand()),
        }
    }

    fn number(&mut self) -> Result<(), ExpressionError> {
        let start = self.at;
        let digits = |parser: &mut Self| {
            while parser.chars.get(parser.at).is_some_and(|c| c.is_ascii_digit() || *c == '.') {
                parser.at += 1;
            }
        };
        digits(self);
        if matches!(self.chars.get(self.at), Some('e' | 'E')) {
            let sign = usize::from(matches!(self.chars.get(self.at + 1), Some('+' | '-')));
            if self.chars.get(self.at + 1 + sign).is_some_and(char::is_ascii_digit) {
                self.at += 1 + sign;
                digits(self);
            }
        }
        let text: String = self.chars[start..self.at].iter().collect();
        match text.parse::<f64>() {
            Ok(value) if value.is_finite() => {
                self.program.push(Op::Constant(value));
                Ok(())
            }
            _ => {
                self.at = start;
                let mut error = self.error("a finite number such as 1.5e-3", "");
                error.found = format!("'{text}'");
                Err(error)
            }
        }
    }

    fn name(&mut self) -> Result<(), ExpressionError> {
        let start = self.at;
        while self.chars.get(self.at).is_some_and(|c| c.is_alphanumeric() || *c == '_') {
            self.at += 1;
        }
        let name: String = self.chars[start..self.at].iter().collect();
        if let Some(v) = VARIABLES.iter().position(|v| *v == name) {
            self.program.push(Op::Variable(v as u8));
            return Ok(());
        }
        if let Some((_, value)) = NUMBERS.iter().chain(self.constants).find(|(n, _)| *n == name) {
            self.program.push(Op::Constant(*value));
            return Ok(());
        }
        if let Some((_, f)) = UNARY.iter().find(|(n, _)| *n == name) {
            return self.arguments(1, &name).map(|()| self.program.push(Op::Unary(*f)));
        }
        if let Some((_, f)) = BINARY.iter().find(|(n, _)| *n == name) {
            return self.arguments(2, &name).map(|()| self.program.push(Op::Binary(*f)));
        }
        self.at = start;
        Err(self.unknown(&name))
    }

    fn arguments(&mut self, count: usize, name: &str) -> Result<(), ExpressionError> {
        if self.take(&['(']).is_none() {
            return Err(self.error(&format!("'(' after {name}"), ""));
        }
        for i in 0..count {
            if i > 0 && self.take(&[',']).is_none() {
                return Err(self.error("','", &format!("; {name} takes {count} arguments")));
            }
            self.sum()?;
        }
        if self.peek() == Some(',') {
            return Err(self.error("')'", &format!("; {name} takes {count} arguments, nest it for more")));
        }
        self.close()
    }

    fn unknown(&self, name: &str) -> ExpressionError {
        let known = names().chain(self.constants.iter().map(|c| c.0));
        let near = known.map(|n| (strsim::damerau_levenshtein(n, name), n)).min();
        let near = near.filter(|(d, _)| *d <= 2 && *d < name.chars().count());
        let hint = near.map_or("; variables are x, y and z".to_owned(), |(_, n)| format!("; did you mean '{n}'?"));
        let mut error = self.error("a variable, a constant or a function", &hint);
        error.found = format!("'{name}'");
        error
    }
}
