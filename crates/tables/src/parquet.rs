//! Tables as Parquet: columns under the headers of the CSV format, provenance and units as key-value metadata.
//!
//! Keys begin with `coldplate.`: `coldplate.inputs`, `coldplate.unit.NAME`, `coldplate.provenance.KEY`,
//! `coldplate.digest`.
//!
//! The decoder does not verify checksums of pages. The file as a whole therefore carries a digest: SHA-256 of its
//! bytes, with zeros in place of the digest itself. A file with a digest must agree with it; files of other programs
//! have none.

use std::path::Path;

use sha2::{Digest, Sha256};

use super::{Column, Ledger, Table, TextColumn};
use coldplate_base::error::{Error, Result};

/// Metadata key of the number of condition variables.
const INPUTS: &str = "coldplate.inputs";
/// Metadata key of a unit, without the column's name at its end.
const UNIT: &str = "coldplate.unit.";
/// Metadata key of a provenance entry, without the entry's own key at its end.
const PROVENANCE: &str = "coldplate.provenance.";
/// Metadata key of the digest.
const DIGEST: &str = "coldplate.digest";
/// Text before the digits of the digest. No other text of a file begins with it: the digest is found without its key.
const SUM: &str = "coldplate-sha256:";
/// Number of hexadecimal digits of the digest: 256 bits of four per digit.
const DIGITS: usize = 64;

impl Table {
    /// The table as the bytes of a Parquet file.
    ///
    /// # Errors
    /// Errors of [`Table::check`].
    pub fn to_parquet(&self) -> Result<Vec<u8>> {
        self.check()?;
        let mut metadata = vec![(INPUTS.to_string(), self.inputs.to_string())];
        metadata.extend(self.columns.iter().map(|c| (format!("{UNIT}{}", c.name), c.unit.clone())));
        metadata.extend(self.provenance.iter().map(|(key, value)| (format!("{PROVENANCE}{key}"), value.clone())));
        metadata.push((DIGEST.to_string(), format!("{SUM}{}", "0".repeat(DIGITS))));
        let headers: Vec<String> = self.columns.iter().map(Column::header).collect();
        let texts: Vec<(&str, &[String])> = self.texts.iter().map(|t| (t.name.as_str(), t.values.as_slice())).collect();
        let numbers: Vec<(&str, &[f64])> = headers.iter().zip(&self.columns).map(|(h, c)| (h.as_str(), c.values.as_slice())).collect();
        let mut bytes = Vec::new();
        crate::frame::write_parquet(&mut bytes, &texts, &numbers, &metadata)
            .map_err(|e| Error::input(format!("the table cannot be written as Parquet: {e}")))?;
        if let Some(place) = place_of_digest(&bytes) {
            let sum = digest(&bytes);
            bytes[place..place + DIGITS].copy_from_slice(sum.as_bytes());
        }
        Ok(bytes)
    }

    /// Reads the bytes of a Parquet file; `file` is the name used in errors. Units come from the headers
    /// `name [unit]` or the metadata `coldplate.unit.NAME`.
    ///
    /// # Errors
    /// The file is not Parquet, does not agree with its digest, has a column without unit, or lacks condition columns
    /// that it announces.
    pub fn from_parquet(bytes: Vec<u8>, file: impl AsRef<Path>) -> Result<Table> {
        let (table, ledger) = Self::from_parquet_with_ledger(bytes, file.as_ref())?;
        table.plain(&ledger, file.as_ref())
    }

    /// Reads the bytes of a Parquet file that another program may have written, with what was assumed.
    ///
    /// # Errors
    /// Errors of [`Table::from_parquet`].
    pub fn from_parquet_with_ledger(mut bytes: Vec<u8>, file: &Path) -> Result<(Table, Ledger)> {
        let mut ledger = Ledger::default();
        check_digest(&mut bytes).map_err(|e| e.in_file(file))?;
        let frame =
            crate::frame::read_parquet(bytes).map_err(|e| Error::input(format!("this Parquet file cannot be read: {e}")).in_file(file))?;
        let entry = |key: &str| frame.metadata.iter().find(|(k, _)| k == key).map(|(_, value)| value.as_str());
        let mut table = Table {
            texts: frame.texts.into_iter().map(|(name, values)| TextColumn { name, values }).collect(),
            provenance: (frame.metadata.iter())
                .filter_map(|(key, value)| Some((key.strip_prefix(PROVENANCE)?.to_string(), value.clone())))
                .collect(),
            ..Table::default()
        };
        for (header, values) in frame.numbers {
            // The numbers that pandas gives to rows.
            if header.starts_with("__index_level_") {
                ledger.assumed.push(format!("column '{header}' numbers the rows and was left out"));
                continue;
            }
            let split = header.strip_suffix(']').and_then(|h| h.rsplit_once('[')).map(|(name, unit)| (name.trim(), unit.trim()));
            let (name, unit) = match (split, entry(&format!("{UNIT}{header}"))) {
                (Some((name, unit)), _) if !name.is_empty() && !unit.is_empty() => (name, unit),
                (_, Some(unit)) => (header.as_str(), unit),
                _ => {
                    let error = Error::input("a column of numbers has no unit").in_file(file).at_key(header.clone());
                    return Err(error.help(format!("call it '{header} [unit]', with [1] for a pure number")));
                }
            };
            // A null is a missing reading; an infinity is an error, as in CSV.
            if let Some(row) = values.iter().position(|v| v.is_infinite()) {
                return Err(Error::input(format!("the number in row {} is not finite", row + 1)).in_file(file).at_key(header.clone()));
            }
            table.columns.push(Column { name: name.to_string(), unit: unit.to_string(), values });
        }
        table.check().map_err(|e| e.in_file(file))?;
        match entry(INPUTS).map(str::parse::<usize>) {
            Some(Ok(count)) if count <= table.columns.len() => table.inputs = count,
            Some(_) => {
                return Err(Error::input("the number of condition columns cannot be used")
                    .in_file(file)
                    .at_key(INPUTS)
                    .read(entry(INPUTS).unwrap_or_default()));
            }
            None => {
                table.usual_inputs();
            }
        }
        Ok((table, ledger))
    }
}

/// Byte at which the digits of the digest begin: in the footer, at the end of the file.
fn place_of_digest(bytes: &[u8]) -> Option<usize> {
    let place = last(bytes, SUM)? + SUM.len();
    (place + DIGITS <= bytes.len()).then_some(place)
}

/// Byte at which `text` occurs for the last time.
fn last(bytes: &[u8], text: &str) -> Option<usize> {
    bytes.windows(text.len()).rposition(|window| window == text.as_bytes())
}

fn digest(bytes: &[u8]) -> String {
    Sha256::digest(bytes).iter().map(|byte| format!("{byte:02x}")).collect()
}

/// Checks the bytes against their digest, if there is one; its digits are zeros afterwards.
fn check_digest(bytes: &mut [u8]) -> Result<()> {
    let damaged =
        || Error::input("this Parquet file is damaged: it does not agree with its digest").help("write it anew, or take the CSV beside it");
    let Some(place) = place_of_digest(bytes) else {
        return if last(bytes, DIGEST).is_some() { Err(damaged()) } else { Ok(()) };
    };
    let stated = bytes[place..place + DIGITS].to_vec();
    bytes[place..place + DIGITS].fill(b'0');
    if digest(bytes).as_bytes() == stated { Ok(()) } else { Err(damaged()) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parquet_gives_back_the_table() {
        let text = "# machine: rig\n# inputs: 1\ntest,coolant_flow [L/min],\"motor, front [degC]\",ratio [1]\na,0.30000000000000004,,1e-300\n,9.42,-0.1,2\n";
        let table = Table::from_csv(text, "x.csv").unwrap();
        let back = Table::from_parquet(table.to_parquet().unwrap(), "x.parquet").unwrap();
        // Missing values (NaN) are unequal to themselves; their written forms are equal.
        assert_eq!(back.to_csv().unwrap(), table.to_csv().unwrap());
        assert_eq!(back.to_csv().unwrap(), text);
    }

    #[test]
    fn columns_of_other_programs_need_a_unit() {
        let file = |metadata: &[(String, String)]| {
            let mut bytes = Vec::new();
            crate::frame::write_parquet(&mut bytes, &[], &[("motor", &[1.0]), ("coolant_flow [L/min]", &[2.0])], metadata).unwrap();
            Table::from_parquet(bytes, "x.parquet")
        };
        let message = file(&[]).unwrap_err().to_string();
        assert!(message.contains("x.parquet") && message.contains("motor [unit]"), "{message}");
        let table = file(&[("coldplate.unit.motor".into(), "degC".into())]).unwrap();
        assert_eq!((table.inputs, table.columns[0].name.as_str(), table.columns[1].header().as_str()), (1, "coolant_flow", "motor [degC]"));
    }

    #[test]
    fn every_changed_byte_is_noticed() {
        let text = "# machine: rig\n# inputs: 1\ntest,coolant_flow [L/min],motor [degC]\na,0.3,21\nb,9.42,\nc,1,22.5\n";
        let good = Table::from_csv(text, "x.csv").unwrap().to_parquet().unwrap();
        let read = |bytes: &[u8]| Table::from_parquet(bytes.to_vec(), "x.parquet");
        assert_eq!(read(&good).unwrap().to_csv().unwrap(), text);
        for at in 0..good.len() {
            for change in [1, 0x20, 0x80, 0xff] {
                let mut bytes = good.clone();
                bytes[at] ^= change;
                assert!(read(&bytes).is_err(), "byte {at} of {}", good.len());
            }
        }
        for length in 0..good.len() {
            assert!(read(&good[..length]).is_err(), "cut at {length}");
        }
    }
}
