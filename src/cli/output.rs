//! The one way a command speaks: text or a single JSON object on standard output, the rest on
//! standard error.

use std::io::Write;
use std::path::Path;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use serde::Serialize;

use super::colour::coloured;
use super::text::folded;
use super::window;
use coldplate_base::atomic_file;
use coldplate_base::error::{Error, Result};
use coldplate_base::progress::Progress;

/// Interval at which a spinner turns while a long piece of work says nothing. Chosen.
const TICK: Duration = Duration::from_millis(200);

/// Whether progress was asked for as lines, even if standard error is no terminal: one setting of the process, made
/// before any work begins.
static AS_LINES: AtomicBool = AtomicBool::new(false);

/// How a command reports.
#[derive(Debug, Clone, Copy)]
pub struct Output {
    /// Print one JSON object and nothing else on standard output.
    pub json: bool,
    /// No progress, no notes.
    pub quiet: bool,
}

/// Checks that a report can be written to this path.
///
/// # Errors
/// The name does not end in `.html`, or the place cannot be written.
pub fn check_page(path: &Path) -> Result<()> {
    if !path.extension().is_some_and(|e| e == "html" || e == "htm") {
        return Err(Error::input("a report is an HTML file").in_file(path).at_key("--report").help("end the name in .html"));
    }
    atomic_file::check(path).map_err(|e| e.at_key("--report"))
}

impl Output {
    /// The result: `text` for a reader, in lines that fit the window and with the colours of a terminal, or `record` as JSON
    /// if that was asked for. A closed pipe is no error. If the result cannot be written otherwise, the program ends with
    /// status 2, because 0 would say that all is well.
    pub fn report(self, text: &str, record: &impl Serialize) {
        let fitted = window::stated().map(|width| folded(text, width));
        let text = fitted.as_deref().unwrap_or(text);
        let coloured = window::shows_colours(&std::io::stdout()).then(|| coloured(text));
        self.verbatim(coloured.as_deref().unwrap_or(text), record);
    }

    /// The result as [`Output::report`] gives it, but with `text` for another program: to the letter.
    pub fn verbatim(self, text: &str, record: &impl Serialize) {
        let mut stdout = std::io::stdout().lock();
        let written = match self.json.then(|| serde_json::to_value(record)) {
            Some(Ok(json)) => writeln!(stdout, "{json:#}"),
            // No record has keys that are not text, or anything else that JSON cannot hold.
            Some(Err(error)) => Err(error.into()),
            None => writeln!(stdout, "{}", text.trim_end()),
        };
        is_open(written.and_then(|()| stdout.flush()));
    }

    /// Standard output for a result that comes piece by piece, under the same rule. Once its reader is gone, the pieces go
    /// nowhere, but the exit status is still that of the whole result.
    pub fn pieces(self) -> impl FnMut(&[u8]) {
        let mut open = true;
        move |piece| {
            if open {
                let mut stdout = std::io::stdout().lock();
                open = is_open(stdout.write_all(piece).and_then(|()| stdout.flush()));
            }
        }
    }

    /// A remark on standard error, unless quiet.
    pub fn note(self, text: &str) {
        if !self.quiet {
            say(text);
        }
    }

    /// Switches progress to lines on standard error, even if that is no terminal.
    pub fn progress_as_lines() {
        AS_LINES.store(true, Ordering::Relaxed);
    }

    /// Says that the error of a mesh is not taken off `quantity`; nothing for lumped machines, which have no mesh.
    pub fn note_on_mesh(self, quantity: &str, cells: usize) {
        if cells > 0 {
            self.note(&format!(
                "note: {quantity} do not account for the error of the mesh of {cells} cells: `coldplate solve MACHINE.toml` states it"
            ));
        }
    }

    /// Receives the progress of the library: remarks as lines, counted work as a bar.
    pub fn progress(self) -> TerminalProgress {
        TerminalProgress { output: self, bar: Mutex::new(None), spinner: Mutex::new(None) }
    }

    /// Target of bars: a terminal or nowhere.
    pub fn target(self) -> ProgressDrawTarget {
        if self.quiet || AS_LINES.load(Ordering::Relaxed) { ProgressDrawTarget::hidden() } else { ProgressDrawTarget::stderr() }
    }
}

/// A message on standard error, with the colours of a terminal.
pub fn say(text: &str) {
    let coloured = window::shows_colours(&std::io::stderr()).then(|| coloured(text));
    eprintln!("{}", coloured.as_deref().unwrap_or(text));
}

/// Whether standard output is still open; a closed pipe is not. Any other failure ends the program.
fn is_open(written: std::io::Result<()>) -> bool {
    match written {
        Ok(()) => true,
        Err(error) if error.kind() == std::io::ErrorKind::BrokenPipe => false,
        Err(error) => {
            say(&format!("error: the result cannot be written to standard output: {error}"));
            std::process::exit(2);
        }
    }
}

/// Progress on standard error, unless quiet: bars on a terminal, or lines if they were asked for.
#[derive(Debug)]
pub struct TerminalProgress {
    output: Output,
    bar: Mutex<Option<ProgressBar>>,
    spinner: Mutex<Option<ProgressBar>>,
}

impl TerminalProgress {
    fn line(&self, text: &str) {
        if AS_LINES.load(Ordering::Relaxed) {
            self.output.note(text);
        }
    }

    fn stop_spinning(&self) {
        if let Some(spinner) = self.spinner.lock().unwrap_or_else(|poisoned| poisoned.into_inner()).take() {
            spinner.finish_and_clear();
        }
    }
}

impl Drop for TerminalProgress {
    fn drop(&mut self) {
        self.stop_spinning();
    }
}

impl Progress for TerminalProgress {
    fn say(&self, what: &str) {
        self.stop_spinning();
        self.output.note(what);
    }

    fn at(&self, what: &str) {
        self.line(what);
        let mut held = self.spinner.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
        let spinner = held.get_or_insert_with(|| {
            let spinner = ProgressBar::with_draw_target(None, self.output.target());
            if let Ok(style) = ProgressStyle::with_template("{spinner} {elapsed} {msg}") {
                spinner.set_style(style);
            }
            spinner.enable_steady_tick(TICK);
            spinner
        });
        spinner.set_message(what.to_string());
        spinner.tick();
    }

    fn count(&self, done: usize, total: usize, what: &str) {
        self.stop_spinning();
        // Every tenth as a line.
        if total > 0 && 10 * done / total != 10 * done.saturating_sub(1) / total {
            self.line(&format!("{done}/{total} {what}"));
        }
        let mut held = self.bar.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
        let bar = held.get_or_insert_with(|| {
            let bar = ProgressBar::with_draw_target(Some(total as u64), self.output.target());
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
