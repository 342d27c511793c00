//! What the service asks of those who know the answers.

use serde_json::{Map, Value};

/// Surrogates under names, and what is said of them. Bodies and answers are JSON unless said otherwise.
pub trait Answers: Send + Sync + 'static {
    /// The names, in the order in which they are listed: letters, digits, `-`, `_` and `.`, no two alike.
    fn names(&self) -> &[String];

    /// What is in a surrogate; `None` where there is none of this name.
    fn info(&self, name: &str) -> Option<Vec<u8>>;

    /// The page of a surrogate, HTML that asks for nothing.
    fn page(&self, name: &str) -> Option<Vec<u8>>;

    /// Reads a question, and answers it at once where that takes microseconds.
    ///
    /// # Errors
    /// What is wrong with it.
    fn ask(&self, name: &str, ask: Ask) -> Result<Work, Refusal>;

    /// Reads anew what can be read anew: the process was told to (SIGHUP). Questions are answered meanwhile, by what is there.
    fn reread(&self) {}

    /// JSON Schemas of `Question`, `Answer`, `Batch`, `Answers` and `Info`, and of what they refer to, for
    /// `#/components/schemas/` of the OpenAPI description.
    fn schemas(&self) -> Map<String, Value>;
}

/// What is asked of a surrogate.
#[derive(Debug, Clone)]
pub enum Ask {
    /// One question.
    Query(Vec<u8>),
    /// The same question at many conditions.
    Batch(Vec<u8>),
    /// Rows of conditions as CSV, which are answered as CSV.
    Table {
        /// The CSV text.
        rows: Vec<u8>,
        /// The parameters of the address, in order.
        options: Vec<(String, String)>,
    },
}

/// An answer, or the work that leads to it.
pub enum Work {
    /// It is there.
    Done(Reply),
    /// It takes a while, on a thread of its own.
    Long(Box<dyn FnOnce() -> Result<Reply, Refusal> + Send>),
}

/// An answer.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Reply {
    /// JSON, or CSV.
    pub content: Vec<u8>,
    /// How many conditions were answered, for the metrics.
    pub conditions: usize,
}

/// Why there is no answer: an HTTP status, and an object that says so.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Refusal {
    /// The HTTP status.
    pub status: u16,
    /// What is wrong, with place and remedy, as the program says it.
    pub message: String,
    /// The key, column or variable that is wrong, where one is.
    pub key: Option<String>,
    /// What to do about it, where that is known.
    pub help: Option<String>,
}

impl Refusal {
    /// With nothing but a sentence.
    pub fn new(status: u16, message: impl Into<String>) -> Self {
        Self { status, message: message.into(), key: None, help: None }
    }

    /// What to do about it.
    #[must_use]
    pub fn help(mut self, help: impl Into<String>) -> Self {
        self.help = Some(help.into());
        self
    }
}
