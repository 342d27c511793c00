//! Parquet files for coldplate's tables: plain slices in, plain vectors out.
//!
//! This crate is the only place that knows polars. A table is text columns, then number columns
//! (`f64`, NaN for a missing value, which is stored as null), and key-value metadata at file level,
//! which pyarrow shows as `pyarrow.parquet.read_metadata(path).metadata`.

use std::fmt;
use std::io::{Cursor, Write};

use polars_core::error::PolarsError;
use polars_core::prelude::{ArrowDataType, Column, DataFrame, DataType, IntoColumn, NamedFrom, Series};
use polars_io::SerReader;

use polars_io::parquet::read::ParquetReader;
use polars_io::parquet::write::{KeyValueMetadata, ParquetWriter};

/// Content of a file.
#[derive(Debug, Clone, Default)]
pub(crate) struct ParquetContent {
    /// Text columns in the order of the file; a null is an empty text.
    pub texts: Vec<(String, Vec<String>)>,
    /// Number columns in the order of the file; a null is NaN.
    pub numbers: Vec<(String, Vec<f64>)>,
    /// Key-value metadata of the file, without the serialised Arrow schema.
    pub metadata: Vec<(String, String)>,
}

/// Reason why a file could not be written or read.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct ParquetFailure(String);

impl fmt::Display for ParquetFailure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for ParquetFailure {}

impl From<PolarsError> for ParquetFailure {
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
) -> Result<(), ParquetFailure> {
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
/// The file is not Parquet, is damaged, or has a column of another kind.
pub(crate) fn read_parquet(bytes: Vec<u8>) -> Result<ParquetContent, ParquetFailure> {
    // The decoder may panic on a damaged file: a panic inside it is reported as a damaged file.
    std::panic::catch_unwind(|| decode(bytes)).unwrap_or_else(|_| Err(ParquetFailure("the file is damaged".into())))
}

fn decode(bytes: Vec<u8>) -> Result<ParquetContent, ParquetFailure> {
    let mut reader = ParquetReader::new(Cursor::new(bytes));
    let metadata = reader.get_metadata()?.key_value_metadata().clone().unwrap_or_default();
    // Asked for before anything is decoded: the decoder panics at kinds that were not compiled in.
    for (name, field) in reader.schema()?.iter() {
        if !is_readable(field.dtype()) {
            let kind = kind_of(field.dtype());
            return Err(ParquetFailure(format!("column '{name}' holds {kind}: write it as float64 or as text")));
        }
    }
    let data = reader.finish()?;
    let mut frame = ParquetContent {
        metadata: metadata.into_iter().filter(|e| e.key != ARROW_SCHEMA).map(|e| (e.key, e.value.unwrap_or_default())).collect(),
        ..ParquetContent::default()
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
            kind => return Err(ParquetFailure(format!("column '{name}' holds {kind}, which is neither number nor text"))),
        }
    }
    Ok(frame)
}

/// Whether a column can be read: whole numbers of 32 and 64 bits, floating point, flags and text.
fn is_readable(kind: &ArrowDataType) -> bool {
    use ArrowDataType as Kind;
    matches!(
        kind,
        Kind::Null
            | Kind::Boolean
            | Kind::Int32
            | Kind::Int64
            | Kind::UInt32
            | Kind::UInt64
            | Kind::Float32
            | Kind::Float64
            | Kind::Utf8
            | Kind::LargeUtf8
            | Kind::Utf8View
    )
}

/// Kind of a column as the programs that write such files call it.
fn kind_of(kind: &ArrowDataType) -> String {
    match kind {
        ArrowDataType::Dictionary(..) => "categories".into(),
        ArrowDataType::Timestamp(..) | ArrowDataType::Date32 | ArrowDataType::Date64 => "dates".into(),
        ArrowDataType::Decimal(..) => "decimals".into(),
        ArrowDataType::Float16 => "half floats (float16)".into(),
        other => format!("{other:?}").to_lowercase(),
    }
}

#[cfg(test)]
mod tests {
    use super::{read_parquet, write_parquet};

    fn sample() -> Vec<u8> {
        let mut file = Vec::new();
        let texts = ["table 7".to_string(), "ü, \"x\"".to_string(), String::new()];
        let flow = [0.1 + 0.2, f64::MIN_POSITIVE, -1.0e308];
        let temperature = [20.5, f64::NAN, 1.0 / 3.0];
        let metadata = [("coldplate.machine".to_string(), "rig".to_string()), ("coldplate.unit.flow".to_string(), "L/min".to_string())];
        write_parquet(&mut file, &[("group", &texts)], &[("flow", &flow), ("motor [degC]", &temperature)], &metadata).unwrap();
        file
    }

    #[test]
    fn every_bit_comes_back() {
        let frame = read_parquet(sample()).unwrap();
        assert_eq!(frame.texts.len(), 1);
        assert_eq!(frame.texts[0].1, ["table 7", "ü, \"x\"", ""]);
        assert_eq!(frame.numbers[0].0, "flow");
        let bits = |values: &[f64]| values.iter().map(|v| v.to_bits()).collect::<Vec<_>>();
        assert_eq!(bits(&frame.numbers[0].1), bits(&[0.1 + 0.2, f64::MIN_POSITIVE, -1.0e308]));
        assert_eq!(frame.numbers[1].0, "motor [degC]");
        assert_eq!((frame.numbers[1].1[0], frame.numbers[1].1[2]), (20.5, 1.0 / 3.0));
        assert!(frame.numbers[1].1[1].is_nan());
        assert_eq!(frame.metadata[1], ("coldplate.unit.flow".to_string(), "L/min".to_string()));
    }

    #[test]
    fn the_same_table_gives_the_same_bytes() {
        assert_eq!(sample(), sample());
    }

    #[test]
    fn an_empty_table_comes_back_empty() {
        let mut file = Vec::new();
        write_parquet(&mut file, &[], &[("flow", &[])], &[]).unwrap();
        let frame = read_parquet(file).unwrap();
        assert_eq!((frame.numbers.len(), frame.numbers[0].1.len()), (1, 0));
    }

    #[test]
    fn a_file_cut_anywhere_is_an_error() {
        let file = sample();
        for length in 0..file.len() {
            assert!(read_parquet(file[..length].to_vec()).is_err(), "cut to {length} bytes");
        }
    }

    #[test]
    fn columns_that_do_not_fit_are_refused() {
        let mut file = Vec::new();
        assert!(write_parquet(&mut file, &[], &[("a", &[1.0]), ("b", &[1.0, 2.0])], &[]).is_err());
        assert!(write_parquet(&mut file, &[], &[("a", &[1.0]), ("a", &[2.0])], &[]).is_err());
    }
}
