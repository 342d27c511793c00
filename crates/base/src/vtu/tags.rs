//! The elements of the file: its arrays, and where their numbers are stored.

use quick_xml::XmlVersion;
use quick_xml::events::{BytesStart, Event};
use quick_xml::reader::Reader;

use super::Piece;
use super::array::{Array, Coding, NumberType, Stored};
use crate::error::{Error, Result};

/// Tag after which bytes that are no text may follow.
const APPENDED: &[u8] = b"<AppendedData";

/// Coding of the file, and its pieces.
pub(super) fn read(bytes: &[u8]) -> Result<(Coding, Vec<Piece>)> {
    let appended = find(bytes, APPENDED);
    let head = &bytes[..appended.unwrap_or(bytes.len())];
    let head = std::str::from_utf8(head).map_err(|e| no_grid(&bytes[..e.valid_up_to()]).read("bytes that are no text"))?;
    let mut coding = Coding::default();
    let mut pieces: Vec<Piece> = Vec::new();
    // The open elements, outermost first, and the array whose text comes next.
    let (mut open, mut array): (Vec<String>, Option<Array>) = (Vec::new(), None);
    let mut closed = false;
    let mut reader = Reader::from_str(head);
    let line = |at: u64| 1 + head.as_bytes().iter().take(at as usize).filter(|b| **b == b'\n').count();
    loop {
        let before = reader.buffer_position();
        let placed = |error: Error| error.at_line(line(before));
        let event = reader.read_event().map_err(|e| placed(Error::input(format!("this is no XML: {e}")).help(AGAIN)))?;
        match event {
            Event::Start(tag) | Event::Empty(tag) if open.is_empty() && tag.name().as_ref() != "VTKFile" => {
                return Err(placed(no_grid(tag.name().as_ref().as_bytes())));
            }
            Event::Start(tag) => {
                opened(&tag, &open, &mut coding, &mut pieces, &mut array).map_err(placed)?;
                open.push(tag.name().as_ref().to_string());
            }
            Event::Empty(tag) => {
                opened(&tag, &open, &mut coding, &mut pieces, &mut array).map_err(placed)?;
                if let Some(array) = array.take() {
                    keep(array, &open, &mut pieces);
                }
            }
            Event::Text(text) if open.last().is_some_and(|tag| tag == "DataArray") && !text.as_ref().trim().is_empty() => {
                if let Some(Array { stored: Stored::Here { from, to, .. }, .. }) = &mut array {
                    (*from, *to) = (before as usize, reader.buffer_position() as usize);
                }
            }
            Event::End(_) => {
                let name = open.pop();
                if name.as_deref() == Some("DataArray")
                    && let Some(array) = array.take()
                {
                    keep(array, &open, &mut pieces);
                }
                closed |= open.is_empty();
            }
            Event::Eof => break,
            _ => {}
        }
    }
    if !closed && appended.is_none() {
        let error =
            if open.is_empty() { no_grid(bytes) } else { Error::input("the file ends in the middle").at_line(line(head.len() as u64)) };
        return Err(error.help(AGAIN));
    }
    if let Some(at) = appended {
        append(bytes, at, &mut coding)?;
    }
    coding.starts =
        (pieces.iter().flat_map(Piece::arrays)).filter_map(|a| if let Stored::Behind(at) = a.stored { Some(at) } else { None }).collect();
    coding.starts.sort_unstable();
    if pieces.is_empty() {
        return Err(Error::input("there is no mesh in this file").help(AGAIN));
    }
    Ok((coding, pieces))
}

/// Help text for a file of another kind.
const AGAIN: &str = "save it again as an unstructured grid (.vtu)";

fn no_grid(begin: &[u8]) -> Error {
    let begin: String = String::from_utf8_lossy(&begin[..begin.len().min(40)]).lines().next().unwrap_or_default().into();
    Error::input("this is no VTK file in XML").read(begin).help(AGAIN)
}

fn find(bytes: &[u8], word: &[u8]) -> Option<usize> {
    let mut from = 0;
    while let Some(at) = bytes.get(from..)?.iter().position(|b| *b == word[0]) {
        if bytes[from + at..].starts_with(word) {
            return Some(from + at);
        }
        from += at + 1;
    }
    None
}

/// Appended data behind their tag: everything from the underscore to the end.
fn append(bytes: &[u8], at: usize, coding: &mut Coding) -> Result<()> {
    let cut = || Error::input("the file ends in the middle of its appended data").help(AGAIN);
    let end = find(&bytes[at..], b">").map(|end| at + end + 1).ok_or_else(cut)?;
    let tag = std::str::from_utf8(&bytes[at..end]).map_err(|_| cut())?;
    coding.appended_as_text = !tag.contains("raw");
    coding.appended = find(&bytes[end..], b"_").map(|underscore| end + underscore + 1).ok_or_else(cut)?;
    // Text ends with the closing tag. In raw bytes no array reads beyond its stated length.
    coding.appended_end = if coding.appended_as_text {
        find(&bytes[coding.appended..], b"<").map(|end| coding.appended + end).ok_or_else(cut)?
    } else {
        bytes.len()
    };
    Ok(())
}

/// Handles an opening tag.
fn opened(tag: &BytesStart<'_>, open: &[String], coding: &mut Coding, pieces: &mut Vec<Piece>, array: &mut Option<Array>) -> Result<()> {
    match tag.name().as_ref() {
        "VTKFile" if open.is_empty() => file(tag, coding),
        "Piece" => {
            let count = |key: &str| whole(tag, key)?.ok_or_else(|| missing(key));
            pieces.push(Piece { points: count("NumberOfPoints")?, cells: count("NumberOfCells")?, ..Piece::default() });
            Ok(())
        }
        // Arrays outside the pieces describe the whole file; they are not read.
        "DataArray" | "Array" if open.iter().any(|tag| tag == "Piece") => {
            *array = Some(array_of(tag)?);
            Ok(())
        }
        _ => Ok(()),
    }
}

fn file(tag: &BytesStart<'_>, coding: &mut Coding) -> Result<()> {
    let kind = text(tag, "type")?.unwrap_or_default();
    if kind != "UnstructuredGrid" {
        let help = match kind.as_str() {
            "PUnstructuredGrid" | "Collection" => "name the .vtu files that it lists",
            _ => AGAIN,
        };
        return Err(Error::input("the file holds no unstructured grid").at_key("type").read(kind).help(help));
    }
    coding.is_big_endian = text(tag, "byte_order")?.is_some_and(|order| order == "BigEndian");
    coding.has_long_headers = match text(tag, "header_type")?.as_deref() {
        None | Some("UInt32") => false,
        Some("UInt64") => true,
        Some(other) => return Err(Error::input("headers of this type are not known").at_key("header_type").read(other).help(AGAIN)),
    };
    coding.is_compressed = match text(tag, "compressor")?.as_deref() {
        None | Some("") => false,
        Some("vtkZLibDataCompressor") => true,
        Some(other) => {
            let error = Error::input("arrays that are compressed in this way are not read").at_key("compressor").read(other);
            return Err(error.help("save it with zlib or without compression (ParaView: Compressor Type)"));
        }
    };
    Ok(())
}

fn array_of(tag: &BytesStart<'_>) -> Result<Array> {
    let name = text(tag, "Name")?.unwrap_or_default();
    let kind = text(tag, "type")?.unwrap_or_default();
    let stored = match text(tag, "format")?.as_deref() {
        None | Some("ascii") => Stored::Here { from: 0, to: 0, is_text: true },
        Some("binary") => Stored::Here { from: 0, to: 0, is_text: false },
        Some("appended") => Stored::Behind(whole(tag, "offset")?.ok_or_else(|| missing("offset").at_key(name.clone()))?),
        Some(other) => return Err(Error::input("this form of an array is not known").at_key(name).read(other).help(AGAIN)),
    };
    let components = whole(tag, "NumberOfComponents")?.unwrap_or(1).max(1);
    Ok(Array { name, kind: NumberType::named(&kind), components, stored })
}

/// Stores an array according to the elements around it, `open`.
fn keep(array: Array, open: &[String], pieces: &mut [Piece]) {
    let Some(piece) = pieces.last_mut() else { return };
    match open.last().map(String::as_str) {
        Some("PointData") => piece.at_points.push(array),
        Some("CellData") => piece.at_cells.push(array),
        Some("Points") => piece.places = Some(array),
        Some("Cells") => piece.topology.push(array),
        _ => {}
    }
}

fn missing(key: &str) -> Error {
    Error::input("this attribute is missing").at_key(key).help(AGAIN)
}

fn text(tag: &BytesStart<'_>, key: &str) -> Result<Option<String>> {
    let wrong = |e: &dyn std::fmt::Display| Error::input(format!("an attribute cannot be read: {e}")).at_key(key).help(AGAIN);
    let found = tag.try_get_attribute(key).map_err(|e| wrong(&e))?;
    found.map(|a| a.normalized_value(XmlVersion::Implicit1_0).map(|v| v.trim().to_string()).map_err(|e| wrong(&e))).transpose()
}

fn whole(tag: &BytesStart<'_>, key: &str) -> Result<Option<usize>> {
    let read =
        |value: String| value.parse().map_err(|_| Error::input("no whole number can be read here").at_key(key).read(value).help(AGAIN));
    text(tag, key)?.map(read).transpose()
}

impl Piece {
    fn arrays(&self) -> impl Iterator<Item = &Array> {
        self.places.iter().chain(&self.at_points).chain(&self.at_cells).chain(&self.topology)
    }
}
