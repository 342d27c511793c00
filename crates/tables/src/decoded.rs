//! Text of a file in the encodings that loggers and spreadsheets write.

use std::borrow::Cow;
use std::path::Path;

use encoding_rs::{Encoding, UTF_16BE, UTF_16LE, WINDOWS_1252};

use crate::ledger::Ledger;
use coldplate_base::error::{Error, Result};

/// Bytes of the beginning that tell UTF-16 without its mark, a count. Chosen: a header of three columns is longer.
const BEGINNING: usize = 32;

/// The text of `bytes`, with `\n` as line end.
///
/// # Errors
/// The file is no text.
pub(crate) fn decoded<'a>(mut bytes: &'a [u8], file: &Path, ledger: &mut Ledger) -> Result<Cow<'a, str>> {
    let utf_16 = utf_16(bytes);
    if utf_16.is_none() {
        bytes = without_end(bytes, ledger);
    }
    let text = match (utf_16, std::str::from_utf8(bytes)) {
        (Some(encoding), _) => {
            ledger.assumed.push("the file is UTF-16".into());
            decode(encoding, bytes, file)?
        }
        (None, Ok(text)) => Cow::Borrowed(text),
        (None, Err(e)) => {
            let line = 1 + bytes[..e.valid_up_to()].iter().filter(|b| **b == b'\n').count();
            ledger.assumed.push(format!("the file is not UTF-8 (line {line}): read as Windows-1252 (Latin-1)"));
            decode(WINDOWS_1252, bytes, file)?
        }
    };
    if let Some(at) = text.bytes().position(|b| b < b' ' && !matches!(b, b'\t' | b'\n' | b'\r' | 0x0c)) {
        let line = 1 + text[..at].matches('\n').count();
        let error = Error::input(format!("a control character (number {}) stands in the text", text.as_bytes()[at]));
        return Err(error
            .in_file(file)
            .at_line(line)
            .help("export the table as CSV, .xlsx, .xls or .ods; other binary files are not read"));
    }
    Ok(if text.contains('\r') && !text.contains('\n') { Cow::Owned(text.replace('\r', "\n")) } else { text })
}

/// UTF-16 by its mark, or by letters with a zero byte each.
fn utf_16(bytes: &[u8]) -> Option<&'static Encoding> {
    let marked = Encoding::for_bom(bytes).map(|(encoding, _)| encoding);
    let zeros = |first: usize| bytes.len() >= BEGINNING && bytes[..BEGINNING].iter().skip(first).step_by(2).all(|b| *b == 0);
    match marked {
        Some(encoding) => Some(encoding).filter(|e| *e == UTF_16LE || *e == UTF_16BE),
        None if zeros(1) => Some(UTF_16LE),
        None if zeros(0) => Some(UTF_16BE),
        None => None,
    }
}

fn decode<'a>(encoding: &'static Encoding, bytes: &'a [u8], file: &Path) -> Result<Cow<'a, str>> {
    let (text, _, is_damaged) = encoding.decode(bytes);
    if is_damaged {
        return Err(Error::input(format!("the file is damaged: it is not {} throughout", encoding.name())).in_file(file));
    }
    Ok(text)
}

/// Bytes without the end marks of old systems and without zeros, which loggers write where they reserved space.
fn without_end<'a>(bytes: &'a [u8], ledger: &mut Ledger) -> &'a [u8] {
    let end = bytes.iter().rposition(|b| !matches!(b, 0 | 0x1a | b'\n' | b'\r')).map_or(0, |last| last + 1);
    let rest = &bytes[end..];
    let Some(first) = rest.iter().position(|b| matches!(b, 0 | 0x1a)) else { return bytes };
    let zeros = rest.iter().filter(|b| **b == 0).count();
    if zeros > 0 {
        ledger.noted.push(format!("{zeros} zero bytes at the end of the file were left out: the logger may have been cut off"));
    }
    &bytes[..end + first]
}
