//! Numbers and lines from the bytes of a file, text or binary alike.

use coldplate_base::error::{Error, Result};

/// A place in the bytes of a file.
pub(super) struct Source<'a> {
    bytes: &'a [u8],
    at: usize,
    /// Whether numbers are binary (little endian).
    pub(super) binary: bool,
    /// The section being read, for errors.
    pub(super) section: String,
}

impl<'a> Source<'a> {
    pub(super) fn new(bytes: &'a [u8]) -> Self {
        Self { bytes, at: 0, binary: false, section: String::new() }
    }

    /// An error at this place: the line of a text file, the byte of a binary one.
    pub(super) fn error(&self, what: impl Into<String>) -> Error {
        let error = Error::input(what);
        let key = format!("${}", self.section);
        if self.binary {
            error.at_key(format!("{key}, byte {}", self.at))
        } else {
            let before = &self.bytes[..self.at.min(self.bytes.len())];
            let error = error.at_line(1 + before.iter().filter(|b| **b == b'\n').count());
            if self.section.is_empty() { error } else { error.at_key(key) }
        }
    }

    /// The error for a file that stops too early.
    fn ended(&self) -> Error {
        self.error(format!("the file ends in the middle of ${}", self.section)).help("it was cut off; save or copy it again")
    }

    /// Bytes that are left.
    pub(super) fn left(&self) -> usize {
        self.bytes.len() - self.at
    }

    /// Checks that `count` items of at least `text` or `binary` bytes can follow.
    pub(super) fn expect(&self, count: u64, text: u64, binary: u64, what: &str) -> Result<usize> {
        let least = count.checked_mul(if self.binary { binary } else { text });
        match least {
            Some(bytes) if bytes <= self.left() as u64 => Ok(count as usize),
            _ => Err(self
                .error(format!("the file says that {count} {what} follow, but it has {} bytes left", self.left()))
                .help("it was cut off or is damaged; save or copy it again")),
        }
    }

    fn skip_space(&mut self) {
        while self.bytes.get(self.at).is_some_and(u8::is_ascii_whitespace) {
            self.at += 1;
        }
    }

    /// The rest of the current line, without white space around it.
    pub(super) fn line(&mut self) -> Option<String> {
        if self.at >= self.bytes.len() {
            return None;
        }
        let rest = &self.bytes[self.at..];
        let end = rest.iter().position(|b| *b == b'\n').unwrap_or(rest.len());
        // No line in the header of a section is longer.
        let shown = &rest[..end.min(4096)];
        self.at = (self.at + end + 1).min(self.bytes.len());
        Some(String::from_utf8_lossy(shown).trim().to_string())
    }

    /// The next line that is not empty.
    pub(super) fn filled_line(&mut self) -> Option<String> {
        self.skip_space();
        self.line()
    }

    /// Skips the rest of a section that is not needed.
    pub(super) fn skip_section(&mut self) -> Result<()> {
        let mark = format!("$End{}", self.section);
        match self.bytes[self.at..].windows(mark.len()).position(|w| w == mark.as_bytes()) {
            Some(at) => {
                self.at += at + mark.len();
                Ok(())
            }
            None => Err(self.ended()),
        }
    }

    /// The mark that ends a section.
    pub(super) fn end_section(&mut self) -> Result<()> {
        let mark = format!("$End{}", self.section);
        self.skip_space();
        if self.bytes[self.at..].starts_with(mark.as_bytes()) {
            self.at += mark.len();
            return Ok(());
        }
        if self.left() < mark.len() {
            return Err(self.ended());
        }
        Err(self
            .error(format!("{mark} is wanted here: the section does not have the length that it states"))
            .help("the file is damaged; save the mesh again"))
    }

    fn word(&mut self) -> Result<&'a str> {
        self.skip_space();
        let rest = &self.bytes[self.at..];
        let end = rest.iter().position(u8::is_ascii_whitespace).unwrap_or(rest.len());
        if end == 0 {
            return Err(self.ended());
        }
        let word =
            std::str::from_utf8(&rest[..end.min(64)]).map_err(|_| self.error("a number is wanted here").help("is this a text file?"))?;
        self.at += end;
        Ok(word)
    }

    fn number<T: std::str::FromStr>(&mut self, what: &str) -> Result<T> {
        self.skip_space();
        let before = self.at;
        let word = self.word()?;
        word.parse().map_err(|_| {
            self.at = before;
            self.error(format!("{what} is wanted here")).read(word).help("the file is damaged or was cut off; save the mesh again")
        })
    }

    pub(super) fn take<const N: usize>(&mut self) -> Result<[u8; N]> {
        match self.bytes.get(self.at..self.at + N).and_then(|slice| slice.try_into().ok()) {
            Some(array) => {
                self.at += N;
                Ok(array)
            }
            None => Err(self.ended()),
        }
    }

    /// A C int.
    pub(super) fn int(&mut self) -> Result<i64> {
        if self.binary { Ok(i64::from(i32::from_le_bytes(self.take()?))) } else { self.number("a whole number") }
    }

    /// A C size_t of eight bytes.
    pub(super) fn size(&mut self) -> Result<u64> {
        if self.binary { Ok(u64::from_le_bytes(self.take()?)) } else { self.number("a whole number") }
    }

    /// A finite number.
    pub(super) fn double(&mut self) -> Result<f64> {
        let value: f64 = if self.binary { f64::from_le_bytes(self.take()?) } else { self.number("a number")? };
        if value.is_finite() {
            Ok(value)
        } else {
            Err(self.error("a coordinate is not a finite number").read(value).help("the mesh is damaged; mesh again"))
        }
    }
}
