//! The journal of a run: a line for every case that is done, on the disk before the next one begins.

use std::fs::{File, OpenOptions};
use std::io::{Read, Seek, SeekFrom, Write};
use std::path::PathBuf;

use serde::Serialize;
use serde::de::DeserializeOwned;

/// A line of a journal: one case.
pub trait Entry: Serialize + DeserializeOwned {
    /// Whether it is of the case of a seed.
    fn is_of(&self, seed: u64) -> bool;
}

/// Cases that are done.
pub struct Journal<E> {
    file: File,
    /// What the file holds.
    pub records: Vec<E>,
}

impl<E: Entry> Journal<E> {
    /// Opens or begins one. A last line that a killed run left half written is cut off.
    pub fn open(path: PathBuf) -> Self {
        let opened = OpenOptions::new().read(true).append(true).create(true).open(&path);
        let mut file = opened.unwrap_or_else(|e| panic!("{}: {e}", path.display()));
        let mut text = String::new();
        file.read_to_string(&mut text).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
        let whole = text.rfind('\n').map_or(0, |end| end + 1);
        if whole < text.len() {
            file.set_len(whole as u64).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
            file.seek(SeekFrom::End(0)).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
        }
        let read =
            |(i, line): (usize, &str)| serde_json::from_str(line).unwrap_or_else(|e| panic!("{}, line {}: {e}", path.display(), i + 1));
        let records = text[..whole].lines().enumerate().map(read).collect();
        Self { file, records }
    }

    /// Whether a case is done.
    pub fn holds(&self, seed: u64) -> bool {
        self.records.iter().any(|record| record.is_of(seed))
    }

    /// Writes a case down.
    pub fn add(&mut self, record: E) {
        let line = serde_json::to_string(&record).expect("a record is plain data") + "\n";
        self.file.write_all(line.as_bytes()).and_then(|()| self.file.sync_data()).expect("the journal can be written");
        self.records.push(record);
    }
}
