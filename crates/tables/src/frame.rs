//! Parquet files for coldplate's tables: plain slices in, plain vectors out.
//!
//! This crate is the only place that knows the library for Parquet. A table is text columns, then number columns
//! (`f64`, NaN for a missing value, which is stored as null), and key-value metadata at file level,
//! which pyarrow shows as `pyarrow.parquet.read_metadata(path).metadata`.

use std::collections::HashSet;
use std::fmt;
use std::io::Write;
use std::sync::Arc;

use parquet::basic::{Compression, ConvertedType as Old, LogicalType as Logical, Repetition, Type as Physical, ZstdLevel};
use parquet::column::reader::{ColumnReader, ColumnReaderImpl};
use parquet::data_type::{ByteArray, ByteArrayType, DataType, DoubleType};
use parquet::errors::ParquetError;
use parquet::file::metadata::KeyValue;
use parquet::file::properties::WriterProperties;
use parquet::file::reader::{FileReader, SerializedFileReader};
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::types::{ColumnDescriptor, Type, TypePtr};

/// Values of a column that are decoded at a time: a damaged file may state any number of rows.
const AT_ONCE: usize = 1 << 16;

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

impl From<ParquetError> for ParquetFailure {
    fn from(error: ParquetError) -> Self {
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
    out: impl Write + Send,
    texts: &[(&str, &[String])],
    numbers: &[(&str, &[f64])],
    metadata: &[(String, String)],
) -> Result<(), ParquetFailure> {
    let all = texts.iter().map(|(name, own)| (*name, own.len())).chain(numbers.iter().map(|(name, own)| (*name, own.len())));
    let (mut names, mut rows) = (HashSet::new(), None);
    for (name, length) in all {
        if !names.insert(name) {
            return Err(ParquetFailure(format!("two columns are called '{name}'")));
        }
        if *rows.get_or_insert(length) != length {
            return Err(ParquetFailure(format!("column '{name}' has {length} rows, others have {}", rows.unwrap_or(0))));
        }
    }
    let field = |name: &str, physical: Physical, logical: Option<Logical>| {
        let column = Type::primitive_type_builder(name, physical).with_logical_type(logical);
        column.with_repetition(Repetition::OPTIONAL).build().map(Arc::new)
    };
    let of_texts = texts.iter().map(|(name, _)| field(name, Physical::BYTE_ARRAY, Some(Logical::String)));
    let of_numbers = numbers.iter().map(|(name, _)| field(name, Physical::DOUBLE, None));
    let fields: Vec<TypePtr> = of_texts.chain(of_numbers).collect::<Result<_, ParquetError>>()?;
    let schema = Arc::new(Type::group_type_builder("table").with_fields(fields).build()?);
    let entries = metadata.iter().map(|(key, value)| KeyValue::new(key.clone(), value.clone())).collect();
    let properties =
        WriterProperties::builder().set_compression(Compression::ZSTD(ZstdLevel::default())).set_key_value_metadata(Some(entries)).build();
    let mut file = SerializedFileWriter::new(out, schema, Arc::new(properties))?;
    let mut group = file.next_row_group()?;
    for (_, own) in texts {
        let values: Vec<ByteArray> = own.iter().map(|text| text.as_str().into()).collect();
        let mut column = group.next_column()?.ok_or_else(no_column)?;
        column.typed::<ByteArrayType>().write_batch(&values, Some(&vec![1; own.len()]), None)?;
        column.close()?;
    }
    for (_, own) in numbers {
        let values: Vec<f64> = own.iter().copied().filter(|value| !value.is_nan()).collect();
        let present: Vec<i16> = own.iter().map(|value| i16::from(!value.is_nan())).collect();
        let mut column = group.next_column()?.ok_or_else(no_column)?;
        column.typed::<DoubleType>().write_batch(&values, Some(&present), None)?;
        column.close()?;
    }
    group.close()?;
    file.close()?;
    Ok(())
}

fn no_column() -> ParquetFailure {
    ParquetFailure("the writer has no further column".into())
}

/// Reads a Parquet file of numbers, flags and texts from its bytes.
///
/// # Errors
/// The file is not Parquet, is damaged, or has a column of another kind.
pub(crate) fn read_parquet(bytes: Vec<u8>) -> Result<ParquetContent, ParquetFailure> {
    // The decoder may panic on a damaged file: a panic inside it is reported as a damaged file.
    std::panic::catch_unwind(|| decode(bytes)).unwrap_or_else(|_| Err(ParquetFailure("the file is damaged".into())))
}

/// Values of one column in the order of the rows.
enum Values {
    Texts(Vec<String>),
    Numbers(Vec<f64>),
}

fn decode(bytes: Vec<u8>) -> Result<ParquetContent, ParquetFailure> {
    let file = SerializedFileReader::new(bytes::Bytes::from(bytes))?;
    let metadata = file.metadata().file_metadata();
    let entries = metadata.key_value_metadata().cloned().unwrap_or_default();
    let mut content = ParquetContent {
        metadata: entries.into_iter().filter(|e| e.key != ARROW_SCHEMA).map(|e| (e.key, e.value.unwrap_or_default())).collect(),
        ..ParquetContent::default()
    };
    for (at, column) in metadata.schema_descr().columns().iter().enumerate() {
        let name = column.path().string();
        let kind = kind(column).map_err(|kind| ParquetFailure(format!("column '{name}' holds {kind}: write it as float64 or as text")))?;
        let mut values = match kind {
            Kind::Text => Values::Texts(Vec::new()),
            _ => Values::Numbers(Vec::new()),
        };
        for group in 0..file.metadata().num_row_groups() {
            append(file.get_row_group(group)?.get_column_reader(at)?, kind, column.max_def_level(), &mut values)?;
        }
        match values {
            Values::Texts(own) => content.texts.push((name, own)),
            Values::Numbers(own) => content.numbers.push((name, own)),
        }
    }
    Ok(content)
}

/// Appends a row group's values of a column.
fn append(column: ColumnReader, kind: Kind, most: i16, values: &mut Values) -> Result<(), ParquetFailure> {
    match (values, column) {
        (Values::Texts(own), ColumnReader::ByteArrayColumnReader(column)) => {
            let text = |bytes: ByteArray| {
                let text = bytes.as_utf8().map(String::from);
                text.map_err(|_| ParquetFailure("a text is not in UTF-8".into()))
            };
            read(column, most, String::new, text, own)
        }
        (Values::Numbers(own), column) => {
            let none = || f64::NAN;
            match column {
                ColumnReader::BoolColumnReader(column) => read(column, most, none, |v| Ok(f64::from(u8::from(v))), own),
                ColumnReader::Int32ColumnReader(column) if kind == Kind::Unsigned => {
                    read(column, most, none, |v| Ok(f64::from(v.cast_unsigned())), own)
                }
                ColumnReader::Int32ColumnReader(column) => read(column, most, none, |v| Ok(f64::from(v)), own),
                ColumnReader::Int64ColumnReader(column) if kind == Kind::Unsigned => {
                    read(column, most, none, |v| Ok(v.cast_unsigned() as f64), own)
                }
                ColumnReader::Int64ColumnReader(column) => read(column, most, none, |v| Ok(v as f64), own),
                ColumnReader::FloatColumnReader(column) => read(column, most, none, |v| Ok(f64::from(v)), own),
                ColumnReader::DoubleColumnReader(column) => read(column, most, none, Ok, own),
                _ => Err(damaged()),
            }
        }
        _ => Err(damaged()),
    }
}

fn damaged() -> ParquetFailure {
    ParquetFailure("a column has values of another kind than the file says".into())
}

/// Appends the values of a column, with something for each null.
fn read<T: DataType, V>(
    mut column: ColumnReaderImpl<T>,
    most: i16,
    none: impl Fn() -> V,
    value: impl Fn(T::T) -> Result<V, ParquetFailure>,
    own: &mut Vec<V>,
) -> Result<(), ParquetFailure> {
    loop {
        let (mut levels, mut values) = (Vec::new(), Vec::new());
        let (rows, ..) = column.read_records(AT_ONCE, Some(&mut levels), None, &mut values)?;
        if rows == 0 {
            return Ok(());
        }
        if most == 0 {
            // A column that has no nulls.
            levels = vec![0; rows];
        }
        let mut values = values.into_iter();
        for level in levels {
            own.push(if level == most { value(values.next().ok_or_else(damaged)?)? } else { none() });
        }
    }
}

/// Kind of a column's values, as they are read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    Text,
    /// Flags, whole numbers of a sign, and floating point.
    Number,
    /// Whole numbers without sign, which are stored as if they had one.
    Unsigned,
}

/// Kind of a column: whole numbers, floating point, flags or text. Where it cannot be read, its kind as the programs that write such files
/// call it.
fn kind(column: &ColumnDescriptor) -> Result<Kind, String> {
    if column.path().parts().len() > 1 || column.max_rep_level() > 0 {
        return Err("lists or structures".into());
    }
    match (column.physical_type(), column.logical_type_ref(), column.converted_type()) {
        (Physical::INT96, ..)
        | (_, Some(Logical::Date | Logical::Time(_) | Logical::Timestamp(_)), _)
        | (_, _, Old::DATE | Old::TIME_MILLIS | Old::TIME_MICROS | Old::TIMESTAMP_MILLIS | Old::TIMESTAMP_MICROS) => Err("dates".into()),
        (_, Some(Logical::Decimal(_)), _) | (_, _, Old::DECIMAL) => Err("decimals".into()),
        (_, Some(Logical::Float16), _) => Err("half floats (float16)".into()),
        (Physical::BYTE_ARRAY, Some(Logical::String | Logical::Enum | Logical::Json), _)
        | (Physical::BYTE_ARRAY, None, Old::UTF8 | Old::ENUM | Old::JSON) => Ok(Kind::Text),
        (Physical::BYTE_ARRAY | Physical::FIXED_LEN_BYTE_ARRAY, ..) => Err("bytes".into()),
        (_, Some(Logical::Integer(own)), _) if !own.is_signed => Ok(Kind::Unsigned),
        (_, None, Old::UINT_8 | Old::UINT_16 | Old::UINT_32 | Old::UINT_64) => Ok(Kind::Unsigned),
        (_, None | Some(Logical::Integer(_) | Logical::Unknown), _) => Ok(Kind::Number),
        (_, Some(other), _) => Err(format!("{other:?}").to_lowercase()),
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
