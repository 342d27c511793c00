//! The one way a command speaks: text or a single JSON object on standard output, the rest on
//! standard error.

use std::io::Write;

/// How a command reports.
#[derive(Debug, Clone, Copy)]
pub struct Output {
    /// Print one JSON object and nothing else on standard output.
    pub json: bool,
    /// No progress, no notes.
    pub quiet: bool,
}

impl Output {
    /// The result: `text` for a reader, or `json` where it was asked for. A closed pipe is no error.
    pub fn report(self, text: &str, json: &serde_json::Value) {
        let mut stdout = std::io::stdout().lock();
        let _ = if self.json { writeln!(stdout, "{json:#}") } else { writeln!(stdout, "{}", text.trim_end()) };
    }

    /// A remark on standard error, unless quiet.
    pub fn note(self, text: &str) {
        if !self.quiet {
            eprintln!("{text}");
        }
    }
}
