//! The error type of the program: a sentence about the fault, its place, and a remedy.

use std::borrow::Cow;
use std::fmt;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Kind of a failure; the kind decides the exit status of the program.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Kind {
    /// The user's input cannot be used as it stands (exit status 2).
    Input,
    /// The numerics failed: no convergence, an open heat balance (exit status 4).
    Numerics,
}

/// How a solve stopped short of a solution. A solve that returns a result has converged and is balanced; every other
/// solve ends in an [`Error`] of kind [`Kind::Numerics`] with one of these.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Stop {
    /// A temperature or a heat flow is infinite or not a number.
    NotFinite,
    /// Newton's method reached its limit of steps with a residual heat flow above the tolerance.
    MostNewtonSteps,
    /// The Krylov method reached its limit of iterations on a linear system before its tolerance.
    LinearSolver,
    /// The matrix is not positive definite: some node has no path for its heat.
    Singular,
    /// The temperatures settled, but the heat that enters differs from the heat that leaves.
    HeatBalanceOpen,
    /// No time step is short enough for the tolerance.
    TimeStepTooShort,
}

/// Place of the fault in the user's files. Every part is optional.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Location {
    /// The file that was read.
    pub file: Option<PathBuf>,
    /// Line in that file, counted from 1.
    pub line: Option<usize>,
    /// Dotted key, column name or argument, for example `contact[2].conductance`.
    pub key: Option<String>,
}

/// An error that names its place, the value that was read, and a remedy.
///
/// `source()` gives the error of the operating system if there is one. Two errors are equal if all their other parts
/// are equal.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Error {
    inner: Box<Inner>,
}

#[derive(Debug, Clone)]
struct Inner {
    kind: Kind,
    what: String,
    location: Location,
    value: Option<String>,
    help: Option<String>,
    stop: Option<Stop>,
    source: Option<Arc<std::io::Error>>,
    others: Vec<Error>,
}

/// Every field of an error but its source.
type Told<'a> = (Kind, Option<Stop>, &'a str, &'a Location, Option<&'a String>, Option<&'a String>, &'a [Error]);

impl Inner {
    /// Every field but the source, which cannot be compared; the text of the source is part of `what`.
    fn told(&self) -> Told<'_> {
        (self.kind, self.stop, &self.what, &self.location, self.value.as_ref(), self.help.as_ref(), &self.others)
    }
}

impl PartialEq for Inner {
    fn eq(&self, other: &Self) -> bool {
        self.told() == other.told()
    }
}

impl Eq for Inner {}

/// `Result` with this crate's [`Error`].
pub type Result<T> = std::result::Result<T, Error>;

impl Error {
    /// Bad input: `what` says in one sentence what is wrong.
    pub fn input(what: impl Into<String>) -> Self {
        Self::new(Kind::Input, what)
    }

    /// The numerics failed: `what` says which quantity missed which criterion.
    pub fn numerics(what: impl Into<String>) -> Self {
        Self::new(Kind::Numerics, what)
    }

    /// A solve stopped: `what` says which quantity missed which criterion, `stop` which criterion that was.
    pub fn stopped(stop: Stop, what: impl Into<String>) -> Self {
        let mut error = Self::numerics(what);
        error.inner.stop = Some(stop);
        error
    }

    fn new(kind: Kind, what: impl Into<String>) -> Self {
        let inner = Inner {
            kind,
            what: what.into(),
            location: Location::default(),
            value: None,
            help: None,
            stop: None,
            source: None,
            others: Vec::new(),
        };
        Self { inner: Box::new(inner) }
    }

    /// The operating system refused to `action` (read, write, make, remove) a file.
    pub fn file(action: &str, path: &Path, source: std::io::Error) -> Self {
        let mut error = Self::input(format!("cannot {action} this file: {source}")).in_file(path);
        error.inner.source = Some(Arc::new(source));
        error
    }

    /// Names the file, unless one is named already.
    #[must_use]
    pub fn in_file(mut self, file: impl AsRef<Path>) -> Self {
        self.inner.location.file.get_or_insert_with(|| file.as_ref().to_path_buf());
        self
    }

    /// Names the line (from 1), unless one is named already.
    #[must_use]
    pub fn at_line(mut self, line: usize) -> Self {
        self.inner.location.line.get_or_insert(line);
        self
    }

    /// Names the key, column or argument, unless one is named already.
    #[must_use]
    pub fn at_key(mut self, key: impl Into<String>) -> Self {
        self.inner.location.key.get_or_insert_with(|| key.into());
        self
    }

    /// Puts the holder of the key before it: `conditions[3]` makes `coolant_flow` into `conditions[3].coolant_flow`.
    #[must_use]
    pub fn within(mut self, holder: &str) -> Self {
        let key = &mut self.inner.location.key;
        *key = Some(key.take().map_or_else(|| holder.to_owned(), |key| format!("{holder}.{key}")));
        self
    }

    /// Shows the value that was read.
    #[must_use]
    pub fn read(mut self, value: impl fmt::Display) -> Self {
        self.inner.value.get_or_insert_with(|| value.to_string());
        self
    }

    /// Adds a remedy.
    #[must_use]
    pub fn help(mut self, help: impl Into<String>) -> Self {
        self.inner.help.get_or_insert_with(|| help.into());
        self
    }

    /// Adds faults that were found beside this one, each with its own place; a fault at a place that has one is left out.
    #[must_use]
    pub fn and(mut self, others: impl IntoIterator<Item = Self>) -> Self {
        for mut other in others {
            let further = std::mem::take(&mut other.inner.others);
            for fault in std::iter::once(other).chain(further) {
                if self.inner.others.len() == MOST_OTHERS {
                    return self;
                }
                if fault.location() != self.location() && self.others().iter().all(|known| known.location() != fault.location()) {
                    self.inner.others.push(fault);
                }
            }
        }
        self
    }

    /// Faults that were found beside this one.
    pub fn others(&self) -> &[Self] {
        &self.inner.others
    }

    /// The kind of failure.
    pub fn kind(&self) -> Kind {
        self.inner.kind
    }

    /// How the solve stopped, for an error of a solve.
    pub fn stop(&self) -> Option<Stop> {
        self.inner.stop
    }

    /// The sentence about the fault, without place or remedy.
    pub fn what(&self) -> &str {
        &self.inner.what
    }

    /// Place of the fault.
    pub fn location(&self) -> &Location {
        &self.inner.location
    }

    /// The remedy, if one is known.
    pub fn remedy(&self) -> Option<&str> {
        self.inner.help.as_deref()
    }

    /// The exit status the program ends with: 2 for input, 4 for numerics.
    pub fn exit_status(&self) -> u8 {
        match self.inner.kind {
            Kind::Input => 2,
            Kind::Numerics => 4,
        }
    }
}

/// Longest sentence of a message, in characters. Chosen: long enough for every message of the program, short enough for
/// a terminal.
const LONGEST_TEXT: usize = 2000;
/// Most faults that are kept beside the first, count. Chosen: a file of garbage has one on every line.
const MOST_OTHERS: usize = 1000;
/// Longest text about faults beside the first, in bytes. Chosen: a screen of a terminal.
const LONGEST_OTHERS: usize = 2500;
/// Longest key or value that a message repeats, in characters. Chosen: a whole line of a megabyte would hide the
/// message.
const LONGEST_VALUE: usize = 300;

/// The text; a longer one than `most` characters is cut, and its length is stated.
fn cut(text: &str, most: usize) -> Cow<'_, str> {
    match text.char_indices().nth(most) {
        Some((end, _)) => Cow::Owned(format!("{}... ({} bytes)", &text[..end], text.len())),
        None => Cow::Borrowed(text),
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Inner { what, location, value, help, others, .. } = &*self.inner;
        write!(f, "{}", cut(what, LONGEST_TEXT))?;
        let mut place = Vec::new();
        if let Some(file) = &location.file {
            place.push(match location.line {
                Some(line) => format!("{}:{line}", file.display()),
                None => file.display().to_string(),
            });
        } else if let Some(line) = location.line {
            place.push(format!("line {line}"));
        }
        if let Some(key) = &location.key {
            place.push(cut(key, LONGEST_VALUE).into_owned());
        }
        if !place.is_empty() {
            write!(f, "\n   at: {}", place.join(", "))?;
        }
        if let Some(value) = value {
            write!(f, "\n read: {}", cut(value, LONGEST_VALUE))?;
        }
        if let Some(help) = help {
            write!(f, "\n help: {}", cut(help, LONGEST_TEXT))?;
        }
        let mut room = LONGEST_OTHERS;
        let mut others = others.iter().map(|other| format!("\nerror: {other}")).peekable();
        while let Some(other) = others.next_if(|other| other.len() <= room) {
            room -= other.len();
            write!(f, "{other}")?;
        }
        match others.count() {
            0 => Ok(()),
            more => write!(f, "\nerror: {more} more, shown once these are mended"),
        }
    }
}

/// Faults of steps that do not need each other: all of them are found before the first ends the work.
///
/// ```
/// use coldplate_base::error::{Error, Faults};
/// let mut faults = Faults::default();
/// let read: Option<f64> = faults.take(Err(Error::input("no number").at_key("flow")));
/// assert!(read.is_none() && faults.take(Ok(1.0)) == Some(1.0));
/// faults.take::<()>(Err(Error::input("no text").at_key("name")));
/// assert_eq!(faults.end().unwrap_err().others().len(), 1);
/// ```
#[derive(Debug, Default)]
pub struct Faults {
    found: Option<Error>,
}

impl Faults {
    /// The result of a step, or `None` with its fault noted.
    pub fn take<T>(&mut self, step: Result<T>) -> Option<T> {
        match step {
            Ok(value) => Some(value),
            Err(error) => {
                self.found = Some(match self.found.take() {
                    Some(first) => first.and([error]),
                    None => error,
                });
                None
            }
        }
    }

    /// Ends the work if a step failed.
    ///
    /// # Errors
    /// The fault of the first step that failed, with those of the others.
    pub fn end(self) -> Result<()> {
        self.found.map_or(Ok(()), Err)
    }
}

impl std::error::Error for Error {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        self.inner.source.as_deref().map(|source| source as _)
    }
}

/// The results of steps that do not need each other.
///
/// # Errors
/// The fault of the first step that failed, with those of the others.
pub fn all<T>(steps: impl IntoIterator<Item = Result<T>>) -> Result<Vec<T>> {
    let mut faults = Faults::default();
    let results = steps.into_iter().filter_map(|step| faults.take(step)).collect();
    faults.end().map(|()| results)
}

/// The name among `known` that `name` was most likely meant to be, if any is close enough.
pub fn did_you_mean<'a>(name: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    known
        .into_iter()
        .map(|candidate| (strsim::jaro_winkler(name, candidate), candidate))
        .filter(|(similarity, _)| *similarity > 0.8)
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, candidate)| candidate)
}

/// Words of a panic, as `catch_unwind` returns it.
pub fn panic_text(panic: &(dyn std::any::Any + Send)) -> String {
    let text = panic.downcast_ref::<&str>().map(ToString::to_string).or_else(|| panic.downcast_ref::<String>().cloned());
    text.unwrap_or_else(|| "a panic without words".into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn messages_have_a_length() {
        let long = "ä".repeat(1_000_000);
        let error = Error::input(long.clone()).in_file("a.toml").at_line(3).at_key(long.clone()).read(&long).help(long);
        let shown = error.to_string();
        assert!(shown.len() < 10_000 && shown.contains("a.toml:3") && shown.contains("(2000000 bytes)"), "{}", shown.len());
    }

    #[test]
    fn faults_beside_the_first_are_told_once_each() {
        let at = |line: usize| Error::input(format!("fault {line}")).in_file("a.toml").at_line(line);
        let error = at(1).and([at(2), at(1), at(3).and([at(2), at(4)])]);
        assert_eq!(error.others().iter().map(|e| e.location().line).collect::<Vec<_>>(), [Some(2), Some(3), Some(4)]);
        let shown = error.to_string();
        assert_eq!(shown.matches("error: fault").count(), 3, "{shown}");
        let many = at(1).and((2..=400).map(at)).to_string();
        let shown = many.matches("error: fault").count();
        assert!(many.len() < 3000 && shown > 20 && many.ends_with(&format!("{} more, shown once these are mended", 399 - shown)), "{many}");
    }

    #[test]
    fn the_cause_of_a_refused_file_is_kept() {
        let refused = || Error::file("read", Path::new("a.toml"), std::io::Error::from(std::io::ErrorKind::NotFound));
        let source = std::error::Error::source(&refused()).and_then(|s| s.downcast_ref::<std::io::Error>()).map(std::io::Error::kind);
        assert_eq!(source, Some(std::io::ErrorKind::NotFound));
        assert_eq!(refused(), refused());
        assert_eq!(Error::stopped(Stop::NotFinite, "x").stop(), Some(Stop::NotFinite));
    }
}
