//! The arithmetic of formulas: text to a stack program, its value and its derivative.
//!
//! Grammar, from weak to strong: `+ -`, `* /`, unary `-`, `^` (to the right; `-2^2` is -4), then
//! numbers (`1.5e-4`), names, `pi`, parentheses and calls of the functions in [`FUNCTIONS`].

use crate::error::{Error, Result, did_you_mean};

/// How deep parentheses, signs and powers may nest.
const DEEPEST: usize = 64;
/// Functions of one argument, then those of two or more.
pub(super) const FUNCTIONS: [&str; 11] = ["sqrt", "exp", "ln", "log10", "abs", "sin", "cos", "tan", "tanh", "min", "max"];

#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Function {
    Sqrt,
    Exp,
    Ln,
    Log10,
    Abs,
    Sin,
    Cos,
    Tan,
    Tanh,
}

const ONE_ARGUMENT: [Function; 9] = [
    Function::Sqrt,
    Function::Exp,
    Function::Ln,
    Function::Log10,
    Function::Abs,
    Function::Sin,
    Function::Cos,
    Function::Tan,
    Function::Tanh,
];

#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Op {
    Number(f64),
    Slot(usize),
    Add,
    Subtract,
    Multiply,
    Divide,
    Power,
    Minimum,
    Maximum,
    Negate,
    Call(Function),
}

impl Function {
    /// Value and derivative.
    fn at(self, x: f64) -> (f64, f64) {
        match self {
            Self::Sqrt => (x.sqrt(), 0.5 / x.sqrt()),
            Self::Exp => (x.exp(), x.exp()),
            Self::Ln => (x.ln(), 1.0 / x),
            Self::Log10 => (x.log10(), 1.0 / (x * std::f64::consts::LN_10)),
            Self::Abs => (x.abs(), if x == 0.0 { 0.0 } else { x.signum() }),
            Self::Sin => (x.sin(), x.cos()),
            Self::Cos => (x.cos(), -x.sin()),
            Self::Tan => (x.tan(), 1.0 + x.tan() * x.tan()),
            Self::Tanh => (x.tanh(), 1.0 - x.tanh() * x.tanh()),
        }
    }
}

/// Value and tangent of a program. `tangent` gives the derivative of every slot; without it the
/// second number is zero. The stack is as deep as the program says, which the parser bounds.
pub(super) fn run(program: &[Op], slots: &[f64], tangent: Option<&[f64]>) -> (f64, f64) {
    // A number out of range of `slots` cannot come from the parser; it would show as a NaN.
    let get = |slots: &[f64], at: usize| slots.get(at).copied().unwrap_or(f64::NAN);
    let mut stack: Vec<(f64, f64)> = Vec::with_capacity(16);
    for op in program {
        let out = match *op {
            Op::Number(number) => (number, 0.0),
            Op::Slot(at) => (get(slots, at), tangent.map_or(0.0, |t| get(t, at))),
            Op::Negate | Op::Call(_) => {
                let (x, dx) = stack.pop().unwrap_or((f64::NAN, 0.0));
                match *op {
                    Op::Call(function) => {
                        let (y, slope) = function.at(x);
                        (y, if dx == 0.0 { 0.0 } else { slope * dx })
                    }
                    _ => (-x, -dx),
                }
            }
            _ => {
                let (b, db) = stack.pop().unwrap_or((f64::NAN, 0.0));
                let (a, da) = stack.pop().unwrap_or((f64::NAN, 0.0));
                match *op {
                    Op::Add => (a + b, da + db),
                    Op::Subtract => (a - b, da - db),
                    Op::Multiply => (a * b, da * b + a * db),
                    Op::Divide => (a / b, (da - a / b * db) / b),
                    Op::Minimum if a.is_nan() || b.is_nan() => (f64::NAN, 0.0),
                    Op::Maximum if a.is_nan() || b.is_nan() => (f64::NAN, 0.0),
                    Op::Minimum => {
                        if a <= b {
                            (a, da)
                        } else {
                            (b, db)
                        }
                    }
                    Op::Maximum => {
                        if a >= b {
                            (a, da)
                        } else {
                            (b, db)
                        }
                    }
                    _ => {
                        // Either term is left out where its factor vanishes: ln(0) and 0^-1 are no part of the answer then.
                        let of_base = if da == 0.0 || b == 0.0 { 0.0 } else { b * a.powf(b - 1.0) * da };
                        let of_exponent = if db == 0.0 { 0.0 } else { a.powf(b) * a.ln() * db };
                        (a.powf(b), of_base + of_exponent)
                    }
                }
            }
        };
        stack.push(out);
    }
    stack.pop().unwrap_or((f64::NAN, 0.0))
}

#[derive(Debug, Clone, PartialEq)]
enum Token {
    Number(f64),
    Name(String),
    Sign(char),
}

/// Splits into tokens with their place (in characters, from 1).
fn tokens(text: &str) -> Result<Vec<(usize, Token)>> {
    let chars: Vec<char> = text.chars().collect();
    let mut found = Vec::new();
    let mut at = 0;
    while at < chars.len() {
        let start = at;
        let c = chars[at];
        if c.is_whitespace() {
            at += 1;
            continue;
        }
        let token = if c.is_ascii_digit() || c == '.' {
            while at < chars.len() {
                let exponent = matches!(chars[at], 'e' | 'E')
                    && match (chars.get(at + 1), chars.get(at + 2)) {
                        (Some(d), _) if d.is_ascii_digit() => true,
                        (Some('+' | '-'), Some(d)) => d.is_ascii_digit(),
                        _ => false,
                    };
                if exponent {
                    at += 2;
                } else if chars[at].is_ascii_digit() || chars[at] == '.' {
                    at += 1;
                } else {
                    break;
                }
            }
            let number: String = chars[start..at].iter().collect();
            let value = number.parse::<f64>().ok().filter(|v| v.is_finite());
            Token::Number(value.ok_or_else(|| Error::input(format!("'{number}' in this formula is not a number")))?)
        } else if c.is_alphabetic() || c == '_' {
            while at < chars.len() && (chars[at].is_alphanumeric() || chars[at] == '_') {
                at += 1;
            }
            Token::Name(chars[start..at].iter().collect())
        } else if c == '*' && chars.get(at + 1) == Some(&'*') {
            at += 2;
            Token::Sign('^')
        } else if "+-*/^(),".contains(c) {
            at += 1;
            Token::Sign(c)
        } else {
            return Err(Error::input(format!("'{c}' (character {}) has no place in a formula", at + 1)).help(HELP));
        };
        found.push((start + 1, token));
    }
    Ok(found)
}

const HELP: &str =
    "a formula is made of numbers, names, + - * / ^ ( ), sqrt exp ln log10 abs sin cos tan tanh, min(a, b), max(a, b) and pi";

/// The names in `text` that are not functions or constants; `text` need not be a valid formula.
pub(super) fn names_in(text: &str) -> Vec<&str> {
    let words = text.split(|c: char| !(c.is_alphanumeric() || c == '_'));
    let starts_as_name = |word: &&str| word.starts_with(|c: char| c.is_alphabetic() || c == '_');
    words.filter(starts_as_name).filter(|name| *name != "pi" && !FUNCTIONS.contains(name)).collect()
}

/// Compiles `text`; `slot` finds the slot of a name.
///
/// # Errors
/// Unreadable, an unknown name (with the nearest of `known`), nested too deeply.
pub(super) fn compile(text: &str, known: &[&str], slot: &dyn Fn(&str) -> Option<usize>) -> Result<Vec<Op>> {
    let mut parser = Parser { tokens: tokens(text)?, at: 0, depth: 0, program: Vec::new(), known, slot };
    parser.sum()?;
    match parser.tokens.get(parser.at) {
        None => Ok(fold(&parser.program)),
        Some((place, token)) => {
            Err(Error::input(format!("{} (character {place}) is not expected in this formula", show(token))).help(HELP))
        }
    }
}

/// Replaces a program without names by its value.
fn fold(program: &[Op]) -> Vec<Op> {
    if program.iter().any(|op| matches!(op, Op::Slot(_))) { program.to_vec() } else { vec![Op::Number(run(program, &[], None).0)] }
}

fn show(token: &Token) -> String {
    match token {
        Token::Number(number) => format!("the number {number}"),
        Token::Name(name) => format!("'{name}'"),
        Token::Sign(c) => format!("'{c}'"),
    }
}

struct Parser<'a> {
    tokens: Vec<(usize, Token)>,
    at: usize,
    depth: usize,
    program: Vec<Op>,
    known: &'a [&'a str],
    slot: &'a dyn Fn(&str) -> Option<usize>,
}

impl Parser<'_> {
    fn take(&mut self, wanted: &[char]) -> Option<char> {
        match self.tokens.get(self.at) {
            Some((_, Token::Sign(c))) if wanted.contains(c) => {
                self.at += 1;
                Some(*c)
            }
            _ => None,
        }
    }

    fn expect(&mut self, sign: char) -> Result<()> {
        self.take(&[sign]).map(|_| ()).ok_or_else(|| self.unexpected(&format!("'{sign}' is missing")))
    }

    fn unexpected(&self, what: &str) -> Error {
        let before = match self.tokens.get(self.at) {
            Some((place, token)) => format!("before {} (character {place})", show(token)),
            None => "at the end".to_string(),
        };
        Error::input(format!("{what} {before} of this formula")).help(HELP)
    }

    fn sum(&mut self) -> Result<()> {
        self.product()?;
        while let Some(c) = self.take(&['+', '-']) {
            self.product()?;
            self.program.push(if c == '+' { Op::Add } else { Op::Subtract });
        }
        Ok(())
    }

    fn product(&mut self) -> Result<()> {
        self.signed()?;
        while let Some(c) = self.take(&['*', '/']) {
            self.signed()?;
            self.program.push(if c == '*' { Op::Multiply } else { Op::Divide });
        }
        Ok(())
    }

    fn signed(&mut self) -> Result<()> {
        self.depth += 1;
        if self.depth > DEEPEST {
            return Err(Error::input(format!("this formula nests deeper than {DEEPEST} levels")).help("split it with [define]"));
        }
        match self.take(&['+', '-']) {
            Some(c) => {
                self.signed()?;
                if c == '-' {
                    self.program.push(Op::Negate);
                }
            }
            None => {
                self.atom()?;
                if self.take(&['^']).is_some() {
                    self.signed()?;
                    self.program.push(Op::Power);
                }
            }
        }
        self.depth -= 1;
        Ok(())
    }

    fn atom(&mut self) -> Result<()> {
        if self.take(&['(']).is_some() {
            self.sum()?;
            return self.expect(')');
        }
        match self.tokens.get(self.at).cloned() {
            Some((_, Token::Number(number))) => {
                self.at += 1;
                self.program.push(Op::Number(number));
                Ok(())
            }
            Some((_, Token::Name(name))) => {
                self.at += 1;
                self.name(&name)
            }
            _ => Err(self.unexpected("a number or a name is missing")),
        }
    }

    fn name(&mut self, name: &str) -> Result<()> {
        if name == "pi" {
            self.program.push(Op::Number(std::f64::consts::PI));
            return Ok(());
        }
        if let Some(function) = FUNCTIONS.iter().position(|f| *f == name) {
            return self.call(name, function);
        }
        if let Some(slot) = (self.slot)(name) {
            self.program.push(Op::Slot(slot));
            return Ok(());
        }
        let list = format!("names known here: {}; functions: {}", self.known.join(", "), FUNCTIONS.join(", "));
        let error = Error::input(format!("unknown name '{name}' in this formula"));
        Err(match did_you_mean(name, self.known.iter().copied().chain(FUNCTIONS)) {
            Some(meant) => error.help(format!("did you mean '{meant}'? {list}")),
            None => error.help(list),
        })
    }

    fn call(&mut self, name: &str, function: usize) -> Result<()> {
        self.expect('(')?;
        self.sum()?;
        let mut count = 1;
        while self.take(&[',']).is_some() {
            self.sum()?;
            count += 1;
            match name {
                "min" => self.program.push(Op::Minimum),
                "max" => self.program.push(Op::Maximum),
                _ => return Err(Error::input(format!("'{name}' takes one argument")).help(HELP)),
            }
        }
        self.expect(')')?;
        match ONE_ARGUMENT.get(function) {
            Some(function) => self.program.push(Op::Call(*function)),
            None if count < 2 => return Err(Error::input(format!("'{name}' takes two arguments or more")).help(HELP)),
            None => {}
        }
        Ok(())
    }
}
