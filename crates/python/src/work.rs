//! Long work that can be observed and stopped. The work runs on a thread of its own; the thread that Python called from
//! handles its progress and Ctrl-C.

use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, Sender, channel};
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

use coldplate::Progress;
use pyo3::prelude::*;

use crate::errors::raised;

/// Interval between checks for Ctrl-C, 50 ms. Chosen: a stop feels immediate, and waiting costs no time.
const LOOK: Duration = Duration::from_millis(50);
/// Stack of the working thread, bytes (8 MiB): the usual size for a main thread.
const STACK: usize = 8 << 20;

/// A report of the work: a stage, or the number of finished pieces and their total.
type Word = (String, Option<(usize, usize)>);

/// Passes reports on, and stops work that nobody wants any more.
pub struct Heard {
    words: Mutex<Sender<Word>>,
    stopped: AtomicBool,
}

/// Payload with which stopped work unwinds; it is no panic, and prints no message.
struct Stopped;

impl Heard {
    fn pass(&self, word: Word) {
        self.stop();
        // Nobody receives reports once the work is given up.
        let _ = self.words.lock().unwrap_or_else(PoisonError::into_inner).send(word);
    }

    /// Stops the work here if it has been given up.
    pub fn stop(&self) {
        if self.stopped.load(Ordering::Relaxed) {
            resume_unwind(Box::new(Stopped));
        }
    }
}

impl Progress for Heard {
    fn say(&self, what: &str) {
        self.pass((what.to_owned(), None));
    }

    fn count(&self, done: usize, total: usize, what: &str) {
        self.pass((what.to_owned(), Some((done, total))));
    }

    fn at(&self, what: &str) {
        self.pass((what.to_owned(), None));
    }
}

/// Does `work` without holding Python's lock. `progress`, if given, is called with a text, the number of finished
/// pieces and their total, or `None` for both numbers. An exception raised by it, and Ctrl-C, stop the work at its next
/// report.
pub fn run<T: Send>(
    py: Python<'_>,
    progress: Option<&Bound<'_, PyAny>>,
    work: impl FnOnce(&Heard) -> coldplate::Result<T> + Send,
) -> PyResult<T> {
    let progress: Option<Py<PyAny>> = progress.filter(|own| !own.is_none()).map(|own| own.clone().unbind());
    let (sender, receiver) = channel();
    let heard = Heard { words: Mutex::new(sender), stopped: AtomicBool::new(false) };
    let look = |word: Option<Word>| {
        Python::attach(|py| {
            py.check_signals()?;
            if let (Some(call), Some((what, pieces))) = (&progress, word) {
                let (done, total) = pieces.unzip();
                call.call1(py, (what, done, total))?;
            }
            Ok(())
        })
    };
    let (ended, interrupted) = py.detach(move || {
        let heard = &heard;
        std::thread::scope(|scope| {
            let ready = || catch_unwind(AssertUnwindSafe(|| work(heard)));
            let worker = match std::thread::Builder::new().stack_size(STACK).spawn_scoped(scope, ready) {
                Ok(worker) => worker,
                Err(error) => return (Ok(Err(coldplate::Error::input(format!("no thread can be started: {error}")))), Ok(())),
            };
            let mut interrupted: PyResult<()> = Ok(());
            loop {
                // Reports sent before the end are still passed on.
                let over = worker.is_finished();
                let word = match receiver.recv_timeout(if over { Duration::ZERO } else { LOOK }) {
                    Ok(word) => Some(word),
                    Err(RecvTimeoutError::Timeout | RecvTimeoutError::Disconnected) if over => break,
                    Err(_) => None,
                };
                if interrupted.is_ok() {
                    interrupted = look(word);
                    heard.stopped.store(interrupted.is_err(), Ordering::Relaxed);
                }
            }
            (worker.join().unwrap_or_else(Err), interrupted)
        })
    });
    interrupted?;
    match ended {
        Ok(result) => result.map_err(|error| raised(py, &error)),
        Err(panic) => resume_unwind(panic),
    }
}
