//! Ctrl-C, the terminate signal and a closed terminal while long work runs that has something to say or to end first: a search
//! tells how far it came, other programs are ended with this process and nothing is recorded of them.

use std::io;
use std::path::Path;
use std::process::ExitStatus;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, OnceLock};
use std::time::{Duration, Instant};

use coldplate_base::error::{Error, Result};

/// Time within which all processes of a job are told to stop. Chosen: longer ones delay the report of a crash.
const GRACE: Duration = Duration::from_millis(500);

static STOP: OnceLock<Arc<AtomicBool>> = OnceLock::new();

/// Notes the first signal to end from now on; the second ends the process at once.
#[cfg(unix)]
pub fn listen() {
    use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
    STOP.get_or_init(|| {
        let flag = Arc::new(AtomicBool::new(false));
        // A closed terminal ends this process too, unless it was told to outlive the terminal (nohup).
        let hangup = hears_hangup().then_some(SIGHUP);
        for signal in [SIGINT, SIGTERM].into_iter().chain(hangup) {
            // In this order: the flag of the first signal arms the second. A signal that cannot be caught ends the process as
            // usual.
            let _ = signal_hook::flag::register_conditional_default(signal, Arc::clone(&flag));
            let _ = signal_hook::flag::register(signal, Arc::clone(&flag));
        }
        flag
    });
}

/// Whether a closed terminal is known to end this process, and is not ignored: the first bit of the system's mask of ignored
/// signals.
#[cfg(unix)]
fn hears_hangup() -> bool {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let ignored = status.lines().find_map(|line| line.strip_prefix("SigIgn:")).and_then(|bits| u64::from_str_radix(bits.trim(), 16).ok());
    ignored.is_some_and(|bits| bits & 1 == 0)
}

/// On other systems signals end the process as usual.
#[cfg(not(unix))]
pub fn listen() {}

/// Whether this process was told to stop.
pub fn is_asked() -> bool {
    STOP.get().is_some_and(|flag| flag.load(Ordering::Relaxed))
}

/// Waits whether this process is told to stop too. Schedulers tell all processes of a job to stop, and programs may hear it
/// first: a program that was killed, or reports a signal, has not crashed until then.
pub(crate) fn may_come(status: ExitStatus) {
    /// The shell's status of a program that a signal ended is above this. POSIX convention.
    const BY_SIGNAL: i32 = 128;
    if status.code().is_some_and(|code| code < BY_SIGNAL) {
        return;
    }
    let begin = Instant::now();
    while !is_asked() && begin.elapsed() < GRACE {
        std::thread::sleep(GRACE / 50);
    }
}

/// Checks that this process was not told to stop.
///
/// # Errors
/// This process was told to stop.
pub(crate) fn check() -> Result<()> {
    if is_asked() { Err(stopped(Path::new("."))) } else { Ok(()) }
}

/// Error that ends a sweep that is told to stop.
pub(crate) fn stopped(folder: &Path) -> Error {
    Error::file("go on in", folder, io::Error::from(io::ErrorKind::Interrupted))
        .help("start it again: conditions in the journal are not run again")
}
