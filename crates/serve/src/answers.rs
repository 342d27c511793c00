//! Interface between the service and the owner of the answers.

use serde_json::{Map, Value};

/// Surrogates under names, and answers about them. Bodies and answers are JSON unless stated otherwise.
pub trait Answers: Send + Sync + 'static {
    /// The names, in the order of the list: letters, digits, `-`, `_` and `.`, all different.
    fn names(&self) -> &[String];

    /// Description of a surrogate; `None` if the name is unknown.
    fn info(&self, name: &str) -> Option<Vec<u8>>;

    /// The page of a surrogate, in HTML that loads nothing else.
    fn page(&self, name: &str) -> Option<Vec<u8>>;

    /// Reads a question, and answers it at once if that takes microseconds only.
    ///
    /// # Errors
    /// The fault in the question.
    fn ask(&self, name: &str, ask: Ask) -> Result<Work, Refusal>;

    /// Reads changed files again; called when the process receives SIGHUP. Questions are answered meanwhile from the
    /// old content.
    fn reread(&self) {}

    /// JSON Schemas of `Question`, `Answer`, `Batch`, `Answers` and `Info`, and of the types they refer to, for
    /// `#/components/schemas/` of the OpenAPI description.
    fn schemas(&self) -> Map<String, Value>;
}

/// A request about a surrogate.
#[derive(Debug, Clone)]
pub enum Ask {
    /// One question.
    Query(Vec<u8>),
    /// One question at many conditions.
    Batch(Vec<u8>),
    /// Rows of conditions as CSV, which are answered as CSV.
    Table {
        /// The CSV text.
        rows: Vec<u8>,
        /// The parameters of the address, in order.
        options: Vec<(String, String)>,
    },
}

/// An answer, or the work that leads to one.
pub enum Work {
    /// The answer is ready.
    Done(Reply),
    /// The answer takes a while, on a thread of its own.
    Long(Box<dyn FnOnce() -> Result<Reply, Refusal> + Send>),
}

/// An answer.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Reply {
    /// Content: JSON, or CSV.
    pub content: Vec<u8>,
    /// Number of answered conditions, for the metrics.
    pub conditions: usize,
}

/// Reason why there is no answer: an HTTP status, and a message.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Refusal {
    /// The HTTP status.
    pub status: u16,
    /// The fault with place and remedy, in the words of the program.
    pub message: String,
    /// The wrong key, column or variable, if there is one.
    pub key: Option<String>,
    /// The remedy, if one is known.
    pub help: Option<String>,
}

impl Refusal {
    /// A refusal with a sentence alone.
    pub fn new(status: u16, message: impl Into<String>) -> Self {
        Self { status, message: message.into(), key: None, help: None }
    }

    /// Adds a remedy.
    #[must_use]
    pub fn help(mut self, help: impl Into<String>) -> Self {
        self.help = Some(help.into());
        self
    }
}
