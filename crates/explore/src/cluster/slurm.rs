//! Slurm's commands: `sbatch` submits, `squeue` reports the state of tasks, `scancel` cancels.

use std::path::Path;
use std::process::Command;

use coldplate_base::error::{Error, Result};

/// States of a task that has ended, in Slurm's words.
const ENDS: [&str; 9] = ["BOOT_FAIL", "CANCELLED", "COMPLETED", "DEADLINE", "FAILED", "NODE_FAIL", "OUT_OF_MEMORY", "PREEMPTED", "TIMEOUT"];
/// Reasons, in Slurm's words, of a task that waits and will not begin until somebody releases it.
const HELD: [&str; 2] = ["launch failed requeued held", "JobHoldMaxRequeue"];

/// A task of a job array.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Task {
    /// Number of the task in the array.
    pub(super) number: usize,
    /// State in Slurm's words: `RUNNING`, `NODE_FAIL`.
    pub(super) state: String,
    /// Reason of the state in Slurm's words, or `None`.
    pub(super) reason: String,
    /// Node on which the task runs or ran; empty if there is none.
    pub(super) node: String,
}

impl Task {
    /// Whether the task has ended, or waits for ever.
    pub(super) fn is_over(&self) -> bool {
        ENDS.contains(&self.state.as_str()) || self.is_held()
    }

    pub(super) fn is_held(&self) -> bool {
        HELD.contains(&self.reason.as_str())
    }

    /// Whether the task ended with an error of its own.
    pub(super) fn has_failed(&self) -> bool {
        self.state == "FAILED"
    }

    /// Whether the error was one of the command that the task ran, not of its node.
    pub(super) fn has_exited_with_an_error(&self) -> bool {
        self.has_failed() && self.reason == "NonZeroExitCode"
    }

    pub(super) fn is_running(&self) -> bool {
        self.state == "RUNNING"
    }

    /// State of the task in words.
    pub(super) fn words(&self) -> String {
        let state = self.state.to_lowercase().replace('_', " ");
        let on = if self.node.is_empty() { String::new() } else { format!(" on {}", self.node) };
        let why = if matches!(self.reason.as_str(), "" | "None") { String::new() } else { format!(" ({})", self.reason) };
        format!("{state}{on}{why}")
    }
}

/// Slurm's answer about a job.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Seen {
    /// Tasks of the job.
    Tasks(Vec<Task>),
    /// The job ended so long ago that Slurm has forgotten it.
    Forgotten,
    /// Slurm does not answer.
    Silent(String),
}

/// Submits an array of these tasks and returns the number of the job.
///
/// # Errors
/// Slurm is not there, or refuses the job.
pub(super) fn submit(script: &Path, log: &Path, tasks: &[usize], options: &[String]) -> Result<String> {
    let mut command = Command::new("sbatch");
    command.args(["--parsable", "--requeue", "--open-mode=append"]);
    command.arg(format!("--array={}", array(tasks))).arg(format!("--output={}", log.display()));
    let output = command.args(options).arg(script).output().map_err(|e| {
        Error::file("run", Path::new("sbatch"), e)
            .at_key("--slurm")
            .help("run this where jobs are submitted, with Slurm's commands on the path")
    })?;
    let said = String::from_utf8_lossy(&output.stdout);
    // `NUMBER` or `NUMBER;CLUSTER`.
    let number = said.trim().split(';').next().unwrap_or_default().to_string();
    if output.status.success() && !number.is_empty() && number.chars().all(|c| c.is_ascii_digit()) {
        return Ok(number);
    }
    let why = String::from_utf8_lossy(&output.stderr).trim().to_string();
    Err(Error::input(format!("Slurm refuses the job: {why}"))
        .at_key("--slurm")
        .help("--sbatch OPTION passes options of sbatch on; fewer parts fit where arrays are short (MaxArraySize)"))
}

/// State of the tasks of a job.
pub(super) fn look(job: &str) -> Seen {
    let asked = Command::new("squeue").args(["--states=all", "--noheader", "--array", "--format=%K|%T|%r|%N", "--jobs", job]).output();
    match asked {
        Err(e) => Seen::Silent(e.to_string()),
        Ok(output) if output.status.success() => {
            let tasks: Vec<Task> = String::from_utf8_lossy(&output.stdout).lines().filter_map(task).collect();
            if tasks.is_empty() { Seen::Forgotten } else { Seen::Tasks(tasks) }
        }
        Ok(output) => {
            let why = String::from_utf8_lossy(&output.stderr).trim().to_string();
            if why.contains("Invalid job id") { Seen::Forgotten } else { Seen::Silent(why) }
        }
    }
}

/// Cancels tasks that would wait for ever. If that fails they are looked at again.
pub(super) fn cancel(job: &str, tasks: &[usize]) {
    let named = tasks.iter().map(|task| format!("{job}_{task}"));
    let _ = Command::new("scancel").args(named).output();
}

fn task(line: &str) -> Option<Task> {
    let mut fields = line.trim().split('|');
    let (number, state) = (fields.next()?.parse().ok()?, fields.next()?.to_string());
    let (reason, node) = (fields.next()?.to_string(), fields.next().unwrap_or_default().to_string());
    Some(Task { number, state, reason, node })
}

/// Ascending numbers as `sbatch --array` takes them: `1-4,7`.
fn array(tasks: &[usize]) -> String {
    let mut runs: Vec<(usize, usize)> = Vec::new();
    for task in tasks {
        match runs.last_mut().filter(|run| run.1 + 1 == *task) {
            Some(run) => run.1 = *task,
            None => runs.push((*task, *task)),
        }
    }
    runs.iter().map(|(a, b)| if a == b { a.to_string() } else { format!("{a}-{b}") }).collect::<Vec<_>>().join(",")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_slurm_prints_is_read() {
        assert_eq!(array(&[1, 2, 3, 7, 9, 10]), "1-3,7,9-10");
        let found = task("8|COMPLETING|JobLaunchFailure|node2").unwrap();
        assert!(found.number == 8 && !found.is_over());
        assert_eq!(found.words(), "completing on node2 (JobLaunchFailure)");
        assert!(task("3|NODE_FAIL|None|node1").unwrap().is_over());
        assert!(task("3|PENDING|launch failed requeued held|").unwrap().is_over());
        assert!(!task("3|PENDING|Resources|").unwrap().is_over());
        assert_eq!(task("N/A|PENDING|None|"), None);
    }
}
