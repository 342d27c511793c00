//! Parquet files for coldplate's tables: plain slices in, plain vectors out.
//!
//! This crate is the only place that knows polars. A table is text columns, then number columns
//! (`f64`, NaN for a missing value, which is stored as null), and key-value metadata at file level,
//! which pyarrow shows as `pyarrow.parquet.read_metadata(path).metadata`.
//!
//! ```
//! let mut file = Vec::new();
//! let metadata = [("unit.flow".to_string(), "L/min".to_string())];
//! coldplate_tables::write_parquet(&mut file, &[("set", &["a".into(), "b".into()])], &[("flow", &[1.5, f64::NAN])], &metadata).unwrap();
//! let frame = coldplate_tables::read_parquet(file).unwrap();
//! assert_eq!(frame.numbers[0].1[0], 1.5);
//! assert!(frame.numbers[0].1[1].is_nan());
//! assert_eq!(frame.texts[0].1, ["a", "b"]);
//! assert_eq!(frame.metadata, metadata);
//! ```
#![forbid(unsafe_code)]
#![warn(missing_docs)]

use std::fmt;
use std::io::{Cursor, Write};

use polars_core::error::PolarsError;
use polars_core::prelude::{Column, DataFrame, DataType, IntoColumn, NamedFrom, Series};
use polars_io::SerReader;

use polars_io::parquet::read::ParquetReader;
use polars_io::parquet::write::{KeyValueMetadata, ParquetWriter};

/// Content of a file.
#[derive(Debug, Clone, Default)]
pub struct Frame {
    /// Text columns in the order of the file; a null is an empty text.
    pub texts: Vec<(String, Vec<String>)>,
    /// Number columns in the order of the file; a null is NaN.
    pub numbers: Vec<(String, Vec<f64>)>,
    /// Key-value metadata of the file, without the serialised Arrow schema.
    pub metadata: Vec<(String, String)>,
}

/// Why a file could not be written or read.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Failure(String);

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for Failure {}

impl From<PolarsError> for Failure {
    fn from(error: PolarsError) -> Self {
        Self(error.to_string())
    }
}

/// The key under which Arrow writers keep their own schema.
const ARROW_SCHEMA: &str = "ARROW:schema";

/// Writes text columns, then number columns, all of one length, with zstd compression.
///
/// # Errors
/// Columns of different lengths or of the same name, or the writer fails.
pub fn write_parquet(
    out: impl Write,
    texts: &[(&str, &[String])],
    numbers: &[(&str, &[f64])],
    metadata: &[(String, String)],
) -> Result<(), Failure> {
    let mut columns: Vec<Column> = Vec::with_capacity(texts.len() + numbers.len());
    columns.extend(texts.iter().map(|(name, values)| Series::new((*name).into(), *values).into_column()));
    for (name, values) in numbers {
        let values: Vec<Option<f64>> = values.iter().map(|v| (!v.is_nan()).then_some(*v)).collect();
        columns.push(Series::new((*name).into(), values).into_column());
    }
    let mut frame = DataFrame::new_infer_height(columns)?;
    ParquetWriter::new(out)
        .set_parallel(false)
        .with_key_value_metadata(Some(KeyValueMetadata::from_static(metadata.to_vec())))
        .finish(&mut frame)?;
    Ok(())
}

/// Reads a Parquet file of numbers, flags and texts from its bytes.
///
/// # Errors
/// Not a Parquet file, a damaged one, or one with a column of another kind.
pub fn read_parquet(bytes: Vec<u8>) -> Result<Frame, Failure> {
    // The decoder is not proof against damaged files: a panic inside it is a damaged file too.
    std::panic::catch_unwind(|| decode(bytes)).unwrap_or_else(|_| Err(Failure("the file is damaged".into())))
}

fn decode(bytes: Vec<u8>) -> Result<Frame, Failure> {
    let mut reader = ParquetReader::new(Cursor::new(bytes));
    let metadata = reader.get_metadata()?.key_value_metadata().clone().unwrap_or_default();
    let data = reader.finish()?;
    let mut frame = Frame {
        metadata: metadata.into_iter().filter(|e| e.key != ARROW_SCHEMA).map(|e| (e.key, e.value.unwrap_or_default())).collect(),
        ..Frame::default()
    };
    for column in data.columns() {
        let name = column.name().to_string();
        match column.dtype() {
            DataType::String => {
                frame.texts.push((name, column.str()?.iter().map(|text| text.unwrap_or_default().to_string()).collect()));
            }
            kind if kind.is_primitive_numeric() || *kind == DataType::Boolean => {
                let values = column.cast(&DataType::Float64)?;
                frame.numbers.push((name, values.f64()?.iter().map(|value| value.unwrap_or(f64::NAN)).collect()));
            }
            kind => return Err(Failure(format!("column '{name}' holds {kind}, which is neither number nor text"))),
        }
    }
    Ok(frame)
}
