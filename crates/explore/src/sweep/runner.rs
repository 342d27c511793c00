//! Runs the conditions that a journal does not hold yet, on every core, and brings them into the order of the design.

use std::ops::Range;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use super::journal::{ConditionOutcome, Journal};
use coldplate_base::error::{Error, Result, panic_text};
use coldplate_base::progress::Progress;

/// Options of a run.
#[derive(Clone, Copy, Default)]
pub struct SweepOptions<'a> {
    /// Worker threads; `None` takes rayon's pool as it is. The results do not depend on it.
    pub threads: Option<usize>,
    /// Receiver of the number of finished conditions.
    pub progress: Option<&'a dyn Progress>,
    /// Whether conditions that failed by the journal are run again.
    pub retry_failed: bool,
}

/// Solves every one of `conditions`, by their indices in the design, that `journal` does not hold, and records each as it is
/// finished. Returns the outcomes of all up to the last of them in the order of the design.
///
/// `solve` gets the index of a condition. The result must not depend on other conditions solved before, so that neither the
/// order nor the number of threads shows in the results. The function is called from several threads at once; rayon calls
/// inside it are served by workers that wait or have nothing left to do. An error, a panic or a value that is not finite is
/// recorded as the reason of a failure and does not stop the rest. An error that the operating system gave (a full disk, a
/// program that is not there) is none of the condition: it is not recorded, and ends the sweep.
///
/// # Errors
/// The journal is not that of these conditions or cannot be written, the threads cannot be started, or `solve` met an error of
/// the operating system.
pub fn run(
    conditions: Range<usize>,
    outputs: usize,
    journal: &mut Journal,
    options: SweepOptions<'_>,
    solve: impl Fn(usize) -> Result<Vec<f64>> + Sync,
) -> Result<Vec<ConditionOutcome>> {
    let end = conditions.end;
    run_rows(&conditions.collect::<Vec<_>>(), Pieces { total: end, name: "conditions" }, outputs, journal, options, solve)?;
    journal.held(end)
}

/// Pieces of work that the progress of a run counts.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Pieces<'a> {
    /// Number of all pieces.
    pub total: usize,
    /// Name of the pieces, in the plural.
    pub name: &'a str,
}

/// Solves the `rows` (indices in the design, ascending) that `journal` does not hold, as [`run`] does. Progress is counted
/// in `pieces`, which are all held at the end.
///
/// # Errors
/// Errors of [`run`].
pub(crate) fn run_rows(
    rows: &[usize],
    pieces: Pieces<'_>,
    outputs: usize,
    journal: &mut Journal,
    options: SweepOptions<'_>,
    solve: impl Fn(usize) -> Result<Vec<f64>> + Sync,
) -> Result<()> {
    let held = journal.outcomes();
    if let Some(beyond) = rows.last().filter(|last| held.len() <= **last) {
        return Err(Error::input(format!("the journal is of {} conditions, the design has at least {}", held.len(), beyond + 1)));
    }
    let wanted = |outcome: &Option<ConditionOutcome>| match outcome {
        None => true,
        Some(ConditionOutcome::Failed(_)) => options.retry_failed,
        Some(ConditionOutcome::Values(values)) => values.len() != outputs,
    };
    let pending: Vec<usize> = rows.iter().copied().filter(|row| wanted(&held[*row])).collect();
    let known = pieces.total - pending.len();
    let count = |now: usize| options.progress.iter().for_each(|p| p.count(known + now, pieces.total, pieces.name));
    count(0);
    let shared = Mutex::new((&mut *journal, None::<Error>));
    let (next, done, stop) = (AtomicUsize::new(0), AtomicUsize::new(0), AtomicBool::new(false));
    // One loop per thread rather than one task per condition: a thread that waits for another inside `solve` could
    // otherwise begin a second condition on top of the first and hold both in memory.
    let worker = || {
        while !stop.load(Ordering::Relaxed) {
            let Some(&index) = pending.get(next.fetch_add(1, Ordering::Relaxed)) else { break };
            let outcome = outcome_of(index, outputs, &solve);
            let mut guard = shared.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
            let (journal, error) = &mut *guard;
            if error.is_none()
                && let Err(e) = outcome.and_then(|outcome| journal.append(index, outcome))
            {
                *error = Some(e);
                stop.store(true, Ordering::Relaxed);
            }
            count(done.fetch_add(1, Ordering::Relaxed) + 1);
        }
    };
    match options.threads {
        None => drop(rayon::broadcast(|_| worker())),
        Some(threads) => {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads.max(1)).build();
            pool.map_err(|e| Error::input(format!("the worker threads cannot be started: {e}")).at_key("--threads"))?
                .broadcast(|_| worker());
        }
    }
    let (_, error) = shared.into_inner().unwrap_or_else(|poisoned| poisoned.into_inner());
    error.map_or(Ok(()), Err)
}

fn outcome_of(index: usize, outputs: usize, solve: &(impl Fn(usize) -> Result<Vec<f64>> + Sync)) -> Result<ConditionOutcome> {
    Ok(match catch_unwind(AssertUnwindSafe(|| solve(index))) {
        Ok(Ok(values)) if values.len() != outputs => {
            ConditionOutcome::Failed(format!("the solver gave {} values where {outputs} were expected", values.len()))
        }
        Ok(Ok(values)) => match values.iter().position(|v| !v.is_finite()) {
            None => ConditionOutcome::Values(values),
            Some(at) => ConditionOutcome::Failed(format!("output {} is not finite: {}", at + 1, values[at])),
        },
        Ok(Err(error)) if std::error::Error::source(&error).is_some() => return Err(error),
        Ok(Err(error)) => {
            ConditionOutcome::Failed(error.to_string().lines().map(str::trim).filter(|l| !l.is_empty()).collect::<Vec<_>>().join("; "))
        }
        Err(panic) => ConditionOutcome::Failed(format!("the solver broke down: {}", panic_text(&*panic))),
    })
}
