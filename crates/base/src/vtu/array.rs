//! The numbers of an array, from each of the three forms of storage.

use std::io::Read;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use flate2::read::ZlibDecoder;

use crate::error::{Error, Result};

/// Largest size of one array, bytes (4 GiB). Chosen: bounds the memory that a damaged file can ask for.
const MOST: usize = 4 << 30;

/// Type of the numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum NumberType {
    Integer {
        bytes: usize,
        is_signed: bool,
    },
    Float32,
    Float64,
    /// Texts and bits, which are not read.
    Other,
}

impl NumberType {
    pub(super) fn named(name: &str) -> NumberType {
        let (is_signed, width) = match (name.strip_prefix("Int"), name.strip_prefix("UInt")) {
            (Some(width), _) => (true, width),
            (_, Some(width)) => (false, width),
            _ => (false, name),
        };
        match (name, width) {
            ("Float32", _) => NumberType::Float32,
            ("Float64", _) => NumberType::Float64,
            (_, "8" | "16" | "32" | "64") => NumberType::Integer { bytes: width.parse::<usize>().map_or(1, |bits| bits / 8), is_signed },
            _ => NumberType::Other,
        }
    }

    fn bytes(self) -> usize {
        match self {
            NumberType::Integer { bytes, .. } => bytes,
            NumberType::Float32 => 4,
            NumberType::Float64 | NumberType::Other => 8,
        }
    }

    /// The number with these bytes, least significant byte first.
    fn number(self, bytes: &[u8]) -> f64 {
        let bits = bytes.iter().rev().fold(0_u64, |bits, byte| bits << 8 | u64::from(*byte));
        match self {
            NumberType::Float32 => f64::from(f32::from_bits(bits as u32)),
            NumberType::Integer { bytes, is_signed: true } => {
                let unused = 64 - 8 * bytes as u32;
                (((bits << unused) as i64) >> unused) as f64
            }
            NumberType::Integer { .. } => bits as f64,
            NumberType::Float64 | NumberType::Other => f64::from_bits(bits),
        }
    }
}

/// Storage place of the numbers.
#[derive(Debug, Clone, Copy)]
pub(super) enum Stored {
    /// Within the element: these bytes of the file, as numbers in text or as base64.
    Here { from: usize, to: usize, is_text: bool },
    /// In the appended data, this many bytes behind the underscore.
    Behind(usize),
}

/// One array of the file.
#[derive(Debug)]
pub(super) struct Array {
    pub(super) name: String,
    pub(super) kind: NumberType,
    pub(super) components: usize,
    pub(super) stored: Stored,
}

impl Array {
    pub(super) fn is_numbers(&self) -> bool {
        self.kind != NumberType::Other
    }
}

/// Coding common to all arrays of the file.
#[derive(Debug, Default)]
pub(super) struct Coding {
    pub(super) is_big_endian: bool,
    pub(super) has_long_headers: bool,
    pub(super) is_compressed: bool,
    /// Whether appended data are base64.
    pub(super) appended_as_text: bool,
    /// Bytes of the file at which appended data begin and end.
    pub(super) appended: usize,
    pub(super) appended_end: usize,
    /// Offsets of the appended arrays from the beginning of the appended data, ascending.
    pub(super) starts: Vec<usize>,
}

impl Coding {
    /// The numbers of `array` in the file's `bytes`, for `count` points or cells.
    pub(super) fn decode(&self, array: &Array, count: usize, bytes: &[u8]) -> Result<Vec<f64>> {
        let size = array.kind.bytes();
        if !array.is_numbers() {
            return Err(Error::input("this array holds no numbers"));
        }
        let wanted = count.checked_mul(array.components).filter(|n| *n <= MOST / size).ok_or_else(too_large)?;
        let (stored, is_base64) = match array.stored {
            Stored::Here { from, to, is_text: true } => return in_text(&bytes[from..to], wanted, array.kind),
            Stored::Here { from, to, .. } => (&bytes[from..to], true),
            Stored::Behind(at) => (self.behind(at, bytes)?, self.appended_as_text),
        };
        let decoded;
        let stored = if is_base64 {
            decoded = of_base64(stored)?;
            &decoded[..]
        } else {
            stored
        };
        let found = if self.is_compressed { self.inflated(stored, wanted * size)? } else { self.plain(stored)?.to_vec() };
        if found.len() != wanted * size {
            return Err(miscounted(&format!("{} bytes", found.len()), wanted * size));
        }
        let number = |bytes: &[u8]| {
            let mut own = [0; 8];
            own[..size].copy_from_slice(bytes);
            if self.is_big_endian {
                own[..size].reverse();
            }
            array.kind.number(&own[..size])
        };
        Ok(found.chunks_exact(size).map(number).collect())
    }

    /// The appended bytes of the array that begins at `at`, up to the next one.
    fn behind<'a>(&self, at: usize, bytes: &'a [u8]) -> Result<&'a [u8]> {
        let next = self.starts.get(self.starts.partition_point(|start| *start <= at));
        let end = next.map_or(self.appended_end, |next| self.appended.saturating_add(*next)).min(self.appended_end);
        bytes.get(self.appended.saturating_add(at)..end).filter(|_| self.appended > 0).ok_or_else(cut)
    }

    /// Word number `index` of a header.
    fn word(&self, stored: &[u8], index: usize) -> Result<usize> {
        let size = if self.has_long_headers { 8 } else { 4 };
        let bytes = index.checked_mul(size).and_then(|at| stored.get(at..at.checked_add(size)?)).ok_or_else(cut)?;
        let mut own = [0; 8];
        own[..size].copy_from_slice(bytes);
        if self.is_big_endian {
            own[..size].reverse();
        }
        usize::try_from(u64::from_le_bytes(own)).map_err(|_| too_large())
    }

    fn header(&self) -> usize {
        if self.has_long_headers { 8 } else { 4 }
    }

    /// The bytes of an uncompressed array, which follow their own length.
    fn plain<'a>(&self, stored: &'a [u8]) -> Result<&'a [u8]> {
        let length = self.word(stored, 0)?;
        stored[self.header()..].get(..length).ok_or_else(cut)
    }

    /// The bytes of a compressed array. A header states the number of blocks, the size of a block, the size of the last
    /// block, and the compressed size of each block.
    fn inflated(&self, stored: &[u8], wanted: usize) -> Result<Vec<u8>> {
        let blocks = self.word(stored, 0)?;
        let words = blocks.checked_add(3).and_then(|words| words.checked_mul(self.header())).filter(|end| *end <= stored.len());
        let mut from = words.ok_or_else(cut)?;
        let mut out = Vec::new();
        for block in 0..blocks {
            let length = self.word(stored, 3 + block)?;
            let packed = from.checked_add(length).and_then(|end| stored.get(from..end)).ok_or_else(cut)?;
            // Room for one byte more than allowed: a longer block shows.
            let room = (wanted - out.len()) as u64 + 1;
            ZlibDecoder::new(packed)
                .take(room)
                .read_to_end(&mut out)
                .map_err(|e| Error::input(format!("block {} of this array cannot be unpacked: {e}", block + 1)).help(AGAIN))?;
            if out.len() > wanted {
                return Err(miscounted("more bytes", wanted));
            }
            from += length;
        }
        Ok(out)
    }
}

/// Help text for a damaged file.
const AGAIN: &str = "copy or save the file again";

fn cut() -> Error {
    Error::input("the file ends before this array does").help(AGAIN)
}

fn too_large() -> Error {
    Error::input("this array is announced with more than 4 GiB").help("save a coarser mesh, or the part of it that is asked for")
}

fn miscounted(found: &str, wanted: usize) -> Error {
    Error::input(format!("this array has {found}, and its mesh asks for {wanted}")).help(AGAIN)
}

fn in_text(bytes: &[u8], wanted: usize, kind: NumberType) -> Result<Vec<f64>> {
    let text = std::str::from_utf8(bytes).map_err(|_| Error::input("these numbers are no text").help(AGAIN))?;
    let mut values = Vec::new();
    for word in text.split_ascii_whitespace() {
        if values.len() == wanted {
            return Err(miscounted("more numbers", wanted));
        }
        let value: f64 = word.parse().map_err(|_| Error::input("no number can be read here").read(word).help(AGAIN))?;
        // The shortest digits that distinguish a single-precision number are kept exactly in double precision.
        values.push(if kind == NumberType::Float32 { f64::from(value as f32) } else { value });
    }
    if values.len() == wanted { Ok(values) } else { Err(miscounted(&format!("{} numbers", values.len()), wanted)) }
}

/// Decodes base64. Pieces with their own padding may follow each other, as headers and data do.
fn of_base64(text: &[u8]) -> Result<Vec<u8>> {
    let signs: Vec<u8> = text.iter().copied().filter(|b| !b.is_ascii_whitespace()).collect();
    let mut out = Vec::with_capacity(signs.len() / 4 * 3);
    let mut rest = &signs[..];
    while !rest.is_empty() {
        let plain = rest.iter().position(|b| *b == b'=').unwrap_or(rest.len());
        let end = plain + rest[plain..].iter().take_while(|b| **b == b'=').count();
        STANDARD.decode_vec(&rest[..end], &mut out).map_err(|e| Error::input(format!("this array is no base64: {e}")).help(AGAIN))?;
        rest = &rest[end..];
    }
    Ok(out)
}
