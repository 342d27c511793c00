//! The one way a command speaks: text or a single JSON object on standard output, the rest on
//! standard error.

use std::io::Write;
use std::sync::Mutex;

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use serde::Serialize;

use crate::foundation::progress::Progress;

/// How a command reports.
#[derive(Debug, Clone, Copy)]
pub struct Output {
    /// Print one JSON object and nothing else on standard output.
    pub json: bool,
    /// No progress, no notes.
    pub quiet: bool,
}

impl Output {
    /// The result: `text` for a reader, or `record` as JSON where that was asked for. A closed pipe is no error; where
    /// the result cannot be written otherwise, the program ends with status 2, because 0 would say that all is well.
    pub fn report(self, text: &str, record: &impl Serialize) {
        let mut stdout = std::io::stdout().lock();
        let written = match self.json.then(|| serde_json::to_value(record)) {
            Some(Ok(json)) => writeln!(stdout, "{json:#}"),
            // No record has keys that are not text, or anything else that JSON cannot hold.
            Some(Err(error)) => Err(error.into()),
            None => writeln!(stdout, "{}", text.trim_end()),
        };
        if let Err(error) = written.and_then(|()| stdout.flush())
            && error.kind() != std::io::ErrorKind::BrokenPipe
        {
            eprintln!("error: the result cannot be written to standard output: {error}");
            std::process::exit(2);
        }
    }

    /// A remark on standard error, unless quiet.
    pub fn note(self, text: &str) {
        if !self.quiet {
            eprintln!("{text}");
        }
    }

    /// Hears of the progress of the library: remarks as lines, counted work as a bar.
    pub fn progress(self) -> Terminal {
        Terminal { output: self, bar: Mutex::new(None) }
    }
}

/// Progress on standard error, unless quiet; the bar shows only if that is a terminal.
#[derive(Debug)]
pub struct Terminal {
    output: Output,
    bar: Mutex<Option<ProgressBar>>,
}

impl Progress for Terminal {
    fn say(&self, what: &str) {
        self.output.note(what);
    }

    fn count(&self, done: usize, total: usize, what: &str) {
        let mut held = self.bar.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
        let bar = held.get_or_insert_with(|| {
            let target = if self.output.quiet { ProgressDrawTarget::hidden() } else { ProgressDrawTarget::stderr() };
            let bar = ProgressBar::with_draw_target(Some(total as u64), target);
            if let Ok(style) = ProgressStyle::with_template(&format!("{{bar:40}} {{pos}}/{{len}} {what}, {{elapsed}} passed, {{eta}} left"))
            {
                bar.set_style(style);
            }
            bar.set_position(done as u64);
            bar.reset_eta();
            bar
        });
        bar.set_position(bar.position().max(done as u64));
        if done >= total {
            bar.finish_and_clear();
            *held = None;
        }
    }
}
