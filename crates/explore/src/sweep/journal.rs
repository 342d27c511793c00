//! The journal: the finished conditions of a sweep, on disk before they count.
//!
//! A text file. Every line is a payload, a tab, the CRC-32 (IEEE) of the payload in eight hexadecimal digits, and a line end.
//! The first payload is `coldplate-journal 1 ` and a JSON object that identifies the sweep. Every other payload is one finished
//! condition, `INDEX⇥ok⇥VALUE⇥VALUE...` or `INDEX⇥failed⇥"REASON"`, or a batch of conditions that a growing design has added,
//! `added⇥FIRST⇥COUNT⇥VALUE⇥VALUE...`: the index of the first, their number, and per condition one value per variable in its
//! unit, before any of them is run. Values take as many digits as they need to come back bit for bit. Lines are appended and
//! synced one by one and never changed.
//!
//! The program may be killed, and the power may fail, at any byte:
//! - bytes after the last sound line are cut off when the journal is opened again;
//! - an unsound line before that is left alone and its condition is run again (it gives the same result);
//! - a first line that was never finished holds nothing, so it is written anew;
//! - a journal of another sweep is refused, never overwritten;
//! - the file is locked while it is open, and the lock goes with the process.

use std::fs::{File, OpenOptions, TryLockError};
use std::io::{Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::time::Duration;

use serde::{Deserialize, Serialize};

use coldplate_base::error::{Error, Result};

/// The first word of the file.
pub const MAGIC: &str = "coldplate-journal ";
/// Version of the format.
const VERSION: u32 = 1;
/// First word of a line that adds conditions.
const ADDED: &str = "added";

/// Identity of the sweep that a journal belongs to.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Header {
    /// Everything the results depend on: program version, machine, mesh, design. Key and value.
    pub identity: Vec<(String, String)>,
    /// Outputs of one condition, `name [unit]`.
    pub outputs: Vec<String>,
    /// Number of conditions.
    pub conditions: usize,
}

/// Outcome of one condition.
#[derive(Debug, Clone, PartialEq)]
pub enum ConditionOutcome {
    /// One value per output.
    Values(Vec<f64>),
    /// Reason of a failure.
    Failed(String),
}

/// Content of a journal, without opening it for work.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct JournalContent {
    /// Identity of the sweep.
    pub header: Header,
    /// Number of conditions, added ones included.
    pub conditions: usize,
    /// Conditions with a result.
    pub solved: usize,
    /// Conditions that failed.
    pub failed: usize,
    /// Numbers of damaged lines, from 1.
    pub damaged: Vec<usize>,
}

/// Looks into the journal at `path`, whose content is `bytes`; it may be in use meanwhile.
///
/// # Errors
/// The first line is damaged, or of another version of the format.
pub fn seen(path: &Path, bytes: &[u8]) -> Result<JournalContent> {
    let wrong = |what: &str| Error::input(what).in_file(path).at_line(1).help("the sweep that resumes it says more");
    let mut lines = bytes.split(|b| *b == b'\n');
    let first = lines.next().and_then(sound).ok_or_else(|| wrong("the first line of the journal is damaged"))?;
    let (version, json) = first.strip_prefix(MAGIC).and_then(|rest| rest.split_once(' ')).unwrap_or_default();
    if version != VERSION.to_string() {
        return Err(wrong("the journal has another version of the format").read(version));
    }
    let header: Header = serde_json::from_str(json).map_err(|e| wrong(&format!("the first line of the journal cannot be read: {e}")))?;
    let mut last = vec![None; header.conditions.min(bytes.len())];
    let mut damaged = Vec::new();
    let mut conditions = header.conditions;
    for (i, line) in lines.enumerate().filter(|(_, line)| !line.is_empty()) {
        if let Some(batch) = sound(line).and_then(|payload| batch_of(payload, conditions)) {
            conditions += batch.len();
            last.resize(conditions.min(bytes.len()), None);
            continue;
        }
        let fields = sound(line).map(|payload| payload.split('\t'));
        let found = fields.and_then(|mut f| Some((f.next()?.parse::<usize>().ok()?, f.next()? == "ok")));
        match found.and_then(|(index, is_solved)| Some((last.get_mut(index)?, is_solved))) {
            Some((slot, is_solved)) => *slot = Some(is_solved),
            None => damaged.push(i + 2),
        }
    }
    let count = |what: bool| last.iter().filter(|state| **state == Some(what)).count();
    Ok(JournalContent { conditions, solved: count(true), failed: count(false), header, damaged })
}

/// The outcomes in a journal of the sweep that `header` describes, and its damaged lines. The journal may be in use meanwhile,
/// and nothing is changed. Bytes after the last sound line do not count. A file that is not there, or whose first line is not
/// finished, holds nothing.
///
/// # Errors
/// The file cannot be read, is no journal, or is that of another sweep.
pub fn held(path: &Path, header: &Header) -> Result<(Vec<Option<ConditionOutcome>>, Vec<usize>)> {
    let mut outcomes = vec![None; header.conditions];
    let bytes = match std::fs::read(path) {
        Ok(bytes) => bytes,
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => return Ok((outcomes, Vec::new())),
        Err(e) => return Err(Error::file("read", path, e)),
    };
    let Some(first) = bytes.iter().position(|b| *b == b'\n') else {
        let is_begun = bytes.starts_with(MAGIC.as_bytes()) || MAGIC.as_bytes().starts_with(&bytes);
        return if is_begun { Ok((outcomes, Vec::new())) } else { Err(foreign(path)) };
    };
    check_header(path, &bytes[..first], header)?;
    // A line that is being written has no end yet.
    let end = bytes.iter().rposition(|b| *b == b'\n').map_or(first + 1, |last| last + 1);
    let mut damaged = Vec::new();
    for (i, line) in bytes[first + 1..end].split(|b| *b == b'\n').enumerate().filter(|(_, line)| !line.is_empty()) {
        match sound(line).and_then(|payload| record(payload, outcomes.len())) {
            Some((index, outcome)) => outcomes[index] = Some(outcome),
            None => damaged.push(i + 2),
        }
    }
    Ok((outcomes, damaged))
}

/// An open, locked journal.
#[derive(Debug)]
pub struct Journal {
    file: File,
    path: PathBuf,
    outcomes: Vec<Option<ConditionOutcome>>,
    /// Added conditions, batch by batch.
    added: Vec<Vec<Vec<f64>>>,
    damaged: Vec<usize>,
    /// Length of the sound part; `None` after a write failed.
    end: Option<u64>,
}

impl Journal {
    /// Opens the journal at `path`, or begins it, for the sweep that `header` describes.
    ///
    /// # Errors
    /// The file cannot be read or written, another process has it open, it is no journal, or it is that of another sweep.
    pub fn open(path: &Path, header: &Header) -> Result<Self> {
        let failed = |action: &str, e: std::io::Error| Error::file(action, path, e);
        let file = OpenOptions::new()
            .read(true)
            .write(true)
            .create(true)
            .truncate(false)
            .open(path)
            .map_err(|e| failed("open", e).help("check that the folder exists and may be written to"))?;
        match lock(&file) {
            Ok(()) => {}
            Err(TryLockError::WouldBlock) => {
                return Err(Error::input("another process is writing this journal")
                    .in_file(path)
                    .help("wait until it ends, or choose another --out"));
            }
            // A file system without locks is no reason not to work.
            Err(TryLockError::Error(e)) if e.kind() == std::io::ErrorKind::Unsupported => {}
            Err(TryLockError::Error(e)) => return Err(failed("lock", e)),
        }
        let mut journal = Self {
            file,
            path: path.to_path_buf(),
            outcomes: vec![None; header.conditions],
            added: Vec::new(),
            damaged: Vec::new(),
            end: Some(0),
        };
        let mut bytes = Vec::new();
        journal.file.read_to_end(&mut bytes).map_err(|e| failed("read", e))?;
        match bytes.iter().position(|b| *b == b'\n') {
            None if bytes.starts_with(MAGIC.as_bytes()) || MAGIC.as_bytes().starts_with(&bytes) => journal.begin(header)?,
            None => return Err(foreign(path)),
            Some(first) => {
                check_header(path, &bytes[..first], header)?;
                journal.recover(&bytes, first + 1)?;
            }
        }
        Ok(journal)
    }

    /// Outcome of each condition, if it is known.
    pub fn outcomes(&self) -> &[Option<ConditionOutcome>] {
        &self.outcomes
    }

    /// Outcomes of the first `count` conditions.
    ///
    /// # Errors
    /// One of them was not run.
    pub fn held(&self, count: usize) -> Result<Vec<ConditionOutcome>> {
        let missing = || Error::numerics("a condition was not run");
        self.outcomes.iter().take(count).map(|outcome| outcome.clone().ok_or_else(missing)).collect()
    }

    /// Lines (from 1) that were found damaged; their conditions are not finished unless another line holds them.
    pub fn damaged_lines(&self) -> &[usize] {
        &self.damaged
    }

    /// Records a finished condition; when this returns, it is on the disk. A later record replaces an earlier one.
    ///
    /// # Errors
    /// The file cannot be written, for example because the disk is full; nothing can be recorded after that.
    pub fn append(&mut self, index: usize, outcome: ConditionOutcome) -> Result<()> {
        self.write_line(&payload_of(index, &outcome))?;
        if let Some(slot) = self.outcomes.get_mut(index) {
            *slot = Some(outcome);
        }
        Ok(())
    }

    /// Records outcomes of other journals; when this returns, all of them are on the disk.
    ///
    /// # Errors
    /// Errors of [`Journal::append`].
    pub(crate) fn absorb(&mut self, outcomes: Vec<(usize, ConditionOutcome)>) -> Result<()> {
        let payloads: Vec<String> = outcomes.iter().map(|(index, outcome)| payload_of(*index, outcome)).collect();
        self.write_lines(&payloads)?;
        for (index, outcome) in outcomes {
            if let Some(slot) = self.outcomes.get_mut(index) {
                *slot = Some(outcome);
            }
        }
        Ok(())
    }

    /// A batch of added conditions, counted from 0, if the journal holds it.
    pub fn added(&self, batch: usize) -> Option<Vec<Vec<f64>>> {
        self.added.get(batch).cloned()
    }

    /// Records that conditions are added; when this returns, the record is on the disk.
    ///
    /// # Errors
    /// Errors of [`Journal::append`].
    pub fn add(&mut self, conditions: &[Vec<f64>]) -> Result<()> {
        let values: Vec<String> = conditions.iter().flatten().map(|v| format!("{v:e}")).collect();
        self.write_line(&format!("{ADDED}\t{}\t{}\t{}", self.outcomes.len(), conditions.len(), values.join("\t")))?;
        self.enlarge(conditions.to_vec());
        Ok(())
    }

    fn enlarge(&mut self, batch: Vec<Vec<f64>>) {
        self.outcomes.resize(self.outcomes.len() + batch.len(), None);
        self.added.push(batch);
    }

    fn begin(&mut self, header: &Header) -> Result<()> {
        let failed = |e: std::io::Error| Error::file("write", &self.path, e);
        self.file.set_len(0).and_then(|()| self.file.rewind()).map_err(failed)?;
        let json = serde_json::to_string(header).map_err(|e| Error::input(format!("the journal's first line cannot be written: {e}")))?;
        self.write_line(&format!("{MAGIC}{VERSION} {json}"))?;
        // The name of a new file is on the disk only once its folder is.
        #[cfg(unix)]
        if let Some(folder) = self.path.parent() {
            let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
            File::open(folder).and_then(|f| f.sync_all()).map_err(|e| Error::file("write", folder, e))?;
        }
        Ok(())
    }

    fn write_line(&mut self, payload: &str) -> Result<()> {
        self.write_lines(&[payload])
    }

    fn write_lines(&mut self, payloads: &[impl AsRef<str>]) -> Result<()> {
        let Some(end) = self.end.take() else {
            return Err(Error::input("the journal could not be written before").in_file(&self.path));
        };
        let line = |payload: &str| format!("{payload}\t{:08x}\n", crc32fast::hash(payload.as_bytes()));
        let lines: String = payloads.iter().map(|payload| line(payload.as_ref())).collect();
        match self.file.write_all(lines.as_bytes()).and_then(|()| self.file.sync_data()) {
            Ok(()) => {
                self.end = Some(end + lines.len() as u64);
                Ok(())
            }
            Err(e) => {
                // Half a line would be cut off on resuming anyway; it is cut off now if the disk allows it.
                let _ = self.file.set_len(end);
                Err(Error::file("write", &self.path, e)
                    .help("make room or check the disk, then start again: results in the journal are kept"))
            }
        }
    }

    /// Reads the lines from byte `start` on and cuts off the bytes after the last sound one.
    fn recover(&mut self, bytes: &[u8], start: usize) -> Result<()> {
        let (mut end, mut at, mut line, mut unsound) = (start, start, 1, Vec::new());
        while let Some(length) = bytes[at..].iter().position(|b| *b == b'\n') {
            line += 1;
            match sound(&bytes[at..at + length]) {
                None => unsound.push(line),
                Some(payload) => {
                    match batch_of(payload, self.outcomes.len()) {
                        Some(batch) => self.enlarge(batch),
                        None => match record(payload, self.outcomes.len()) {
                            Some((index, outcome)) => self.outcomes[index] = Some(outcome),
                            // The condition of this line was added by a line that is damaged.
                            None if !(unsound.is_empty() && self.damaged.is_empty()) => unsound.push(line),
                            None => {
                                let what = "this line of the journal is sound but makes no sense";
                                let error = Error::input(what).in_file(&self.path).at_line(line).read(abbreviated(payload));
                                return Err(error.help("delete the line; its condition is then run again"));
                            }
                        },
                    }
                    self.damaged.append(&mut unsound);
                    end = at + length + 1;
                }
            }
            at += length + 1;
        }
        let failed = |e: std::io::Error| Error::file("write", &self.path, e);
        if end < bytes.len() {
            self.file.set_len(end as u64).and_then(|()| self.file.sync_all()).map_err(failed)?;
        }
        self.file.seek(SeekFrom::Start(end as u64)).map_err(failed)?;
        self.end = Some(end as u64);
        Ok(())
    }
}

/// Error for a file that is not a journal.
fn foreign(path: &Path) -> Error {
    Error::input("this file is not a journal of this program").in_file(path).at_line(1).help("choose another --out, or move the file away")
}

/// Checks that the first line of the journal at `path` is that of the wanted sweep.
///
/// # Errors
/// The first line is another one; the differences are named.
fn check_header(path: &Path, line: &[u8], wanted: &Header) -> Result<()> {
    if !line.starts_with(MAGIC.as_bytes()) {
        return Err(foreign(path));
    }
    let refuse = |what: String| {
        let error = Error::input(what).in_file(path).at_line(1);
        error.help("choose another --out to keep both, or delete the journal to run everything again")
    };
    let payload = sound(line).ok_or_else(|| refuse("the first line of the journal is damaged".into()))?;
    let (version, json) = payload[MAGIC.len()..].split_once(' ').unwrap_or_default();
    if version != VERSION.to_string() {
        return Err(refuse(format!("the journal has format version {version}, this program writes {VERSION}")));
    }
    let found: Header = serde_json::from_str(json).map_err(|e| refuse(format!("the first line of the journal cannot be read: {e}")))?;
    if found == *wanted {
        return Ok(());
    }
    let value =
        |header: &Header, key: &str| header.identity.iter().find(|(k, _)| k == key).map_or("nothing".to_string(), |(_, v)| abbreviated(v));
    let mut differences: Vec<String> = Vec::new();
    for (key, _) in wanted.identity.iter().chain(&found.identity) {
        let (now, then) = (value(wanted, key), value(&found, key));
        if now != then && !differences.iter().any(|d| d.starts_with(&format!("{key}:"))) {
            differences.push(format!("{key}: {then} then, {now} now"));
        }
    }
    if found.conditions != wanted.conditions {
        differences.push(format!("conditions: {} then, {} now", found.conditions, wanted.conditions));
    }
    if found.outputs != wanted.outputs {
        differences.push("the outputs differ".to_string());
    }
    Err(refuse("the journal belongs to another sweep".into()).read(differences.join("; ")))
}

/// Index and outcome of a line, in a journal of `conditions` conditions.
fn record(payload: &str, conditions: usize) -> Option<(usize, ConditionOutcome)> {
    let (index, rest) = payload.split_once('\t')?;
    let index: usize = index.parse().ok().filter(|i| *i < conditions)?;
    if let Some(reason) = rest.strip_prefix("failed\t") {
        return Some((index, ConditionOutcome::Failed(serde_json::from_str(reason).ok()?)));
    }
    let values: Vec<f64> = rest.strip_prefix("ok\t")?.split('\t').map(|v| v.parse().ok()).collect::<Option<_>>()?;
    Some((index, ConditionOutcome::Values(values)))
}

fn payload_of(index: usize, outcome: &ConditionOutcome) -> String {
    match outcome {
        ConditionOutcome::Values(values) => {
            let values: Vec<String> = values.iter().map(|v| format!("{v:e}")).collect();
            format!("{index}\tok\t{}", values.join("\t"))
        }
        ConditionOutcome::Failed(reason) => format!("{index}\tfailed\t{}", serde_json::Value::from(reason.as_str())),
    }
}

/// Conditions that a line adds to `known` others.
fn batch_of(payload: &str, known: usize) -> Option<Vec<Vec<f64>>> {
    let mut fields = payload.strip_prefix(ADDED)?.strip_prefix('\t')?.split('\t');
    fields.next()?.parse().ok().filter(|first: &usize| *first == known)?;
    let count: usize = fields.next()?.parse().ok().filter(|count| *count > 0)?;
    let values: Vec<f64> = fields.map(|v| v.parse().ok()).collect::<Option<_>>()?;
    (!values.is_empty() && values.len().is_multiple_of(count)).then(|| values.chunks(values.len() / count).map(<[f64]>::to_vec).collect())
}

/// Locks the file, waiting a moment for a process that is just ending, or one that was just started by this
/// one and holds every open file until its own program begins.
fn lock(file: &File) -> std::result::Result<(), TryLockError> {
    for _ in 0..20 {
        match file.try_lock() {
            Err(TryLockError::WouldBlock) => std::thread::sleep(Duration::from_millis(25)),
            settled => return settled,
        }
    }
    file.try_lock()
}

/// The payload of a line whose checksum is right.
fn sound(line: &[u8]) -> Option<&str> {
    let (payload, checksum) = std::str::from_utf8(line).ok()?.rsplit_once('\t')?;
    (checksum == format!("{:08x}", crc32fast::hash(payload.as_bytes()))).then_some(payload)
}

/// Hashes and long lines, shortened to their first characters.
fn abbreviated(text: &str) -> String {
    if text.chars().count() > 40 { text.chars().take(16).chain("...".chars()).collect() } else { text.to_string() }
}
