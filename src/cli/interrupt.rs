//! Ctrl-C and the terminate signal: the program says what is kept, and ends as the signal demands.

use std::sync::{Mutex, PoisonError};

use super::output::Output;

/// Words on the results that are kept if the command ends now; `None` where the command hears signals by itself.
static KEPT: Mutex<Option<String>> = Mutex::new(None);

/// Says from now on what is kept when a signal ends the process.
#[cfg(unix)]
pub fn listen(out: Output) {
    use signal_hook::consts::{SIGINT, SIGTERM};
    keeps("no result was written: files are written once all of them are made, each whole");
    // Without a thread or a handler, signals end the process as usual, without a word.
    let Ok(mut signals) = signal_hook::iterator::Signals::new([SIGINT, SIGTERM]) else { return };
    std::thread::spawn(move || {
        for signal in signals.forever() {
            let kept = KEPT.lock().unwrap_or_else(PoisonError::into_inner).clone();
            if let Some(kept) = kept {
                out.note(&format!("stopped by a signal: {kept}"));
                let _ = signal_hook::low_level::emulate_default_handler(signal);
            }
        }
    });
}

/// On other systems signals end the process as usual.
#[cfg(not(unix))]
pub fn listen(_: Output) {}

/// States what is kept if the command ends from now on.
pub fn keeps(kept: impl Into<String>) {
    *KEPT.lock().unwrap_or_else(PoisonError::into_inner) = Some(kept.into());
}

/// Leaves signals to the command from now on.
pub fn leave() {
    *KEPT.lock().unwrap_or_else(PoisonError::into_inner) = None;
}
