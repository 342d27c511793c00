//! Surrogates that answer for as long as the process lives: opened once, queried from many threads.

use std::path::Path;

use coldplate_export::{Beside, page};
use rayon::prelude::*;
use self_cell::self_cell;
use serde::Serialize;
use serde::de::DeserializeOwned;

use super::followed::followed;
use super::info::Info;
use coldplate_base::error::{Error, Result};
use coldplate_base::input;
use coldplate_base::progress::Silent;
use coldplate_surrogate::fit::file;
use coldplate_surrogate::verdict::Surrogate;
use coldplate_surrogate::verdict::question::{BatchCondition, BatchQuestion, BatchRecord, Question, ReplyRecord};
use coldplate_surrogate::verdict::stated;
use coldplate_surrogate::verdict::stream::{self, AnswerForm};

self_cell! {
    /// The bytes of a file, and the surrogate that is read in them.
    struct Opened {
        owner: Vec<u8>,
        #[covariant]
        dependent: Surrogate,
    }
}

/// A surrogate under a name.
pub struct Book {
    name: String,
    opened: Opened,
    info: Vec<u8>,
    page: Vec<u8>,
}

impl Book {
    /// Reads a surrogate file; the name of the book is that of the file without its ending, with `_` for signs that an
    /// address cannot carry.
    ///
    /// # Errors
    /// A file that cannot be read or is damaged, or whose name has no letter or digit.
    pub fn read(path: &Path) -> Result<Self> {
        let opened = Opened::try_new(input::read(path)?, |bytes| file::open(bytes)).map_err(|e| e.in_file(path))?;
        let stem = path.file_stem().unwrap_or_default().to_string_lossy();
        let plain = |c: char| if c.is_ascii_alphanumeric() || matches!(c, '-' | '_' | '.') { c } else { '_' };
        let name: String = stem.chars().map(plain).collect();
        let followed = followed(opened.borrow_owner()).map_err(|e| e.in_file(path))?;
        let beside = Beside { scene: None, followed: followed.as_deref() };
        let pages = page(opened.borrow_dependent(), &beside, &name)
            .map_err(|e| Error::input(e.to_string()).in_file(path).help("rename the file"))?;
        let page = pages.into_iter().next().map(|file| file.content).unwrap_or_default();
        let info = json(&Info::of_surrogate(opened.borrow_owner()).map_err(|e| e.in_file(path))?)?;
        Ok(Self { name, opened, info, page })
    }

    fn surrogate(&self) -> &Surrogate<'_> {
        self.opened.borrow_dependent()
    }

    /// Whether the surrogate was read from a file of this content.
    pub fn is_of(&self, bytes: &[u8]) -> bool {
        self.opened.borrow_owner() == bytes
    }

    /// Name of the surrogate: letters, digits, `-`, `_` and `.`.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Output of `coldplate info --json` for the surrogate.
    pub fn info(&self) -> &[u8] {
        &self.info
    }

    /// The page that `coldplate export --to html` makes of the surrogate.
    pub fn page(&self) -> &[u8] {
        &self.page
    }

    /// Whether a question is answered in microseconds.
    pub fn is_quick(&self, question: &Question) -> bool {
        question.is_plain(self.surrogate())
    }

    /// The answer as JSON, like that of `coldplate query --json`.
    ///
    /// # Errors
    /// Errors of [`Question::ask`].
    pub fn answer(&self, question: &Question) -> Result<Vec<u8>> {
        json(&self.reply(question)?)
    }

    fn reply(&self, question: &Question) -> Result<ReplyRecord> {
        if !stated::changes(self.surrogate(), &question.condition) {
            return Ok(question.ask(self.surrogate())?.record(self.surrogate()));
        }
        let (bytes, condition) = stated::with_known(self.opened.borrow_owner(), &question.condition)?;
        let known = file::open(&bytes)?;
        Ok(Question { condition, ..question.clone() }.ask(&known)?.record(&known))
    }

    /// The answers to many conditions as JSON, in their order.
    ///
    /// # Errors
    /// There is no condition; errors of [`BatchQuestion::columns_of`]; otherwise the error of the first condition with one.
    pub fn answers(&self, batch: &BatchQuestion) -> Result<Vec<u8>> {
        if batch.conditions.is_empty() {
            return Err(Error::input("there are no conditions here").at_key("conditions").help("give one object for each"));
        }
        if !batch.columns.is_empty() {
            return batch.columns_of(self.surrogate());
        }
        let one = |(place, condition): (usize, &BatchCondition)| {
            let question = Question { condition: condition.0.clone(), confidence: batch.confidence, ..Question::default() };
            self.reply(&question).map_err(|e| e.within(&format!("conditions[{place}]")))
        };
        let found: Vec<Result<ReplyRecord>> = batch.conditions.par_iter().enumerate().map(one).collect();
        json(&BatchRecord { conditions: found.into_iter().collect::<Result<_>>()? })
    }

    /// The answers to rows of CSV as CSV, like those of `coldplate query --csv`, and the number of rows.
    ///
    /// # Errors
    /// Errors of [`stream::answer`].
    pub fn table(&self, rows: &[u8], form: &AnswerForm) -> Result<(Vec<u8>, usize)> {
        let mut text = Vec::new();
        let tally = stream::answer(self.surrogate(), rows, &[], form, None, &Silent, |piece| text.extend_from_slice(piece))?;
        Ok((text, tally.rows))
    }
}

/// Reads a question, or many, from JSON.
///
/// # Errors
/// The text is no JSON object, or has unknown keys or wrong values.
pub fn read<T: DeserializeOwned>(json: &[u8]) -> Result<T> {
    // An array would be taken for the fields in their order.
    if json.trim_ascii_start().first() == Some(&b'[') {
        return Err(Error::input("a question is a JSON object, not an array").help("the OpenAPI description says what may stand here"));
    }
    serde_json::from_slice(json).map_err(|e| {
        let error = Error::input(format!("this JSON cannot be read: {e}"));
        if e.is_data() { error.help("the OpenAPI description says what may stand here") } else { error }
    })
}

fn json(record: &impl Serialize) -> Result<Vec<u8>> {
    // Memory for the answer of a machine with some twenty points.
    let mut text = Vec::with_capacity(8192);
    serde_json::to_writer(&mut text, record).map_err(|e| Error::input(format!("this answer cannot be written as JSON: {e}")))?;
    Ok(text)
}
