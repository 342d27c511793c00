//! The arithmetic of formulas: text to a stack program, its value and its derivative.
//!
//! Grammar, from weak to strong: `+ -`, `* /`, unary `-`, `^` (to the right; `-2^2` is -4), then
//! numbers (`1.5e-4`), names, `pi`, parentheses and calls of the functions in [`FUNCTIONS`].

use super::table::Table;
use crate::error::{Error, Result, did_you_mean};

/// Deepest nesting of parentheses, signs and powers (count). Chosen: bounds the recursion of the parser; formulas in
/// use nest a few levels.
const DEEPEST: usize = 64;
/// Functions of one argument, then the functions of two or more. No variable can have the name of a function, so no
/// function has the name of a part of a machine tool, such as a table.
pub(super) const FUNCTIONS: [&str; 12] = ["sqrt", "exp", "ln", "log10", "abs", "sin", "cos", "tan", "tanh", "min", "max", "interpolate"];

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

/// Functions of one argument, in the order of [`FUNCTIONS`].
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

#[derive(Debug, Clone, PartialEq)]
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
    Table(Table),
}

impl Function {
    /// Value and derivative.
    pub(super) fn at(self, x: f64) -> (f64, f64) {
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
    // A slot beyond `slots` cannot come from the parser; it would show as a NaN.
    let get = |slots: &[f64], at: usize| slots.get(at).copied().unwrap_or(f64::NAN);
    let mut stack: Vec<(f64, f64)> = Vec::with_capacity(16);
    for op in program {
        let out = match op {
            Op::Number(number) => (*number, 0.0),
            Op::Slot(at) => (get(slots, *at), tangent.map_or(0.0, |t| get(t, *at))),
            Op::Negate | Op::Call(_) | Op::Table(_) => {
                let (x, dx) = stack.pop().unwrap_or((f64::NAN, 0.0));
                let (y, slope) = match op {
                    Op::Call(function) => function.at(x),
                    Op::Table(table) => table.at(x),
                    _ => (-x, -1.0),
                };
                (y, if dx == 0.0 { 0.0 } else { slope * dx })
            }
            _ => {
                let (b, db) = stack.pop().unwrap_or((f64::NAN, 0.0));
                let (a, da) = stack.pop().unwrap_or((f64::NAN, 0.0));
                match op {
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
                        // A term is left out if its factor vanishes: ln(0) and 0^-1 do not belong to the answer then.
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

/// Help text on the grammar of formulas.
const HELP: &str = "a formula is made of numbers, names, + - * / ^ ( ), sqrt exp ln log10 abs sin cos tan tanh, min(a, b), max(a, b), \
     interpolate(x, x0, y0, x1, y1, ...) and pi";

/// The names in `text` that are not functions or constants; `text` need not be a valid formula.
pub(super) fn names_in(text: &str) -> Vec<&str> {
    let words = text.split(|c: char| !(c.is_alphanumeric() || c == '_'));
    let starts_as_name = |word: &&str| word.starts_with(|c: char| c.is_alphabetic() || c == '_');
    words.filter(starts_as_name).filter(|name| *name != "pi" && !FUNCTIONS.contains(name)).collect()
}

/// Compiles `text`; `slot` finds the slot of a name.
///
/// # Errors
/// The text cannot be read, has an unknown name (the nearest of `known` is suggested), or is nested too deeply.
pub(super) fn compile(text: &str, known: &[&str], slot: &dyn Fn(&str) -> Option<usize>) -> Result<Vec<Op>> {
    let mut parser = Parser { tokens: tokens(text)?, at: 0, depth: 0, program: Vec::new(), places: Vec::new(), known, slot };
    parser.sum()?;
    match parser.tokens.get(parser.at) {
        None => fold(&parser.program, &parser.places),
        Some((place, token)) => {
            Err(Error::input(format!("{} (character {place}) is not expected in this formula", show(token))).help(HELP))
        }
    }
}

/// Replaces a program without names by its value. `places` are the characters of the operations, from 1.
///
/// # Errors
/// The value is not finite; the first operation without a finite result is named.
fn fold(program: &[Op], places: &[usize]) -> Result<Vec<Op>> {
    if program.iter().any(|op| matches!(op, Op::Slot(_))) {
        return Ok(program.to_vec());
    }
    let value = run(program, &[], None).0;
    if value.is_finite() {
        return Ok(vec![Op::Number(value)]);
    }
    let is_wrong = |length: &usize| !run(&program[..*length], &[], None).0.is_finite();
    let first = (1..=program.len()).find(is_wrong).and_then(|length| places.get(length - 1));
    let place = first.map_or(String::new(), |place| format!(" from character {place} on"));
    Err(Error::input(format!("this formula has no finite value{place}"))
        .help("look for a division by zero, or a root, logarithm or power of a negative number"))
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
    /// The character of each operation in `program`, from 1.
    places: Vec<usize>,
    known: &'a [&'a str],
    slot: &'a dyn Fn(&str) -> Option<usize>,
}

impl Parser<'_> {
    fn push(&mut self, op: Op, place: usize) {
        self.program.push(op);
        self.places.push(place);
    }

    /// The character of the next token, from 1.
    fn place(&self) -> usize {
        self.tokens.get(self.at).or(self.tokens.last()).map_or(1, |(place, _)| *place)
    }

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
        loop {
            let place = self.place();
            let Some(c) = self.take(&['+', '-']) else { return Ok(()) };
            self.product()?;
            self.push(if c == '+' { Op::Add } else { Op::Subtract }, place);
        }
    }

    fn product(&mut self) -> Result<()> {
        self.signed()?;
        loop {
            let place = self.place();
            let Some(c) = self.take(&['*', '/']) else { return Ok(()) };
            self.signed()?;
            self.push(if c == '*' { Op::Multiply } else { Op::Divide }, place);
        }
    }

    fn signed(&mut self) -> Result<()> {
        self.depth += 1;
        if self.depth > DEEPEST {
            return Err(Error::input(format!("this formula nests deeper than {DEEPEST} levels")).help("split it with [define]"));
        }
        let place = self.place();
        match self.take(&['+', '-']) {
            Some(c) => {
                self.signed()?;
                if c == '-' {
                    self.push(Op::Negate, place);
                }
            }
            None => {
                self.atom()?;
                let place = self.place();
                if self.take(&['^']).is_some() {
                    self.signed()?;
                    self.push(Op::Power, place);
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
            Some((place, Token::Number(number))) => {
                self.at += 1;
                self.push(Op::Number(number), place);
                Ok(())
            }
            Some((place, Token::Name(name))) => {
                self.at += 1;
                self.name(&name, place)
            }
            _ => Err(self.unexpected("a number or a name is missing")),
        }
    }

    fn name(&mut self, name: &str, place: usize) -> Result<()> {
        if name == "pi" {
            self.push(Op::Number(std::f64::consts::PI), place);
            return Ok(());
        }
        if let Some(function) = FUNCTIONS.iter().position(|f| *f == name) {
            return self.call(name, function, place);
        }
        if let Some(slot) = (self.slot)(name) {
            self.push(Op::Slot(slot), place);
            return Ok(());
        }
        let list = format!("names known here: {}; functions: {}", self.known.join(", "), FUNCTIONS.join(", "));
        let error = Error::input(format!("unknown name '{name}' (character {place}) in this formula"));
        Err(match did_you_mean(name, self.known.iter().copied().chain(FUNCTIONS)) {
            Some(meant) => error.help(format!("did you mean '{meant}'? {list}")),
            None => error.help(list),
        })
    }

    /// The points of a table, after its argument: numbers, which may be calculated from others.
    fn table(&mut self, place: usize) -> Result<()> {
        let argument = self.program.len();
        let mut numbers = Vec::new();
        while self.take(&[',']).is_some() {
            let at = self.place();
            self.sum()?;
            if self.program[argument..].iter().any(|op| matches!(op, Op::Slot(_))) {
                let error = Error::input(format!("a point of 'interpolate' depends on a name (character {at})"));
                return Err(error.help("the first argument may depend on names; x0, y0, x1, y1, ... are numbers"));
            }
            numbers.push(run(&self.program[argument..], &[], None).0);
            self.program.truncate(argument);
            self.places.truncate(argument);
        }
        self.push(Op::Table(Table::new(&numbers)?), place);
        self.expect(')')
    }

    fn call(&mut self, name: &str, function: usize, place: usize) -> Result<()> {
        self.expect('(')?;
        self.sum()?;
        if name == "interpolate" {
            return self.table(place);
        }
        let mut count = 1;
        while self.take(&[',']).is_some() {
            self.sum()?;
            count += 1;
            match name {
                "min" => self.push(Op::Minimum, place),
                "max" => self.push(Op::Maximum, place),
                _ => return Err(Error::input(format!("'{name}' takes one argument")).help(HELP)),
            }
        }
        self.expect(')')?;
        match ONE_ARGUMENT.get(function) {
            Some(function) => self.push(Op::Call(*function), place),
            None if count < 2 => return Err(Error::input(format!("'{name}' takes two arguments or more")).help(HELP)),
            None => {}
        }
        Ok(())
    }
}
