//! One run of a command in a folder, with a time limit.

use std::fs::File;
use std::path::Path;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

use super::stop;
use crate::error::{Error, Result};

/// Names of what the command printed, in its folder.
pub(super) const STDOUT: &str = "stdout";
pub(super) const STDERR: &str = "stderr";

/// Between two looks at a process, at first and at most: runs of milliseconds are not held up, long ones cost nothing.
const SHORTEST_PAUSE: Duration = Duration::from_micros(500);
const LONGEST_PAUSE: Duration = Duration::from_millis(20);

/// How a run ended.
#[derive(Debug, Clone, Copy)]
pub(super) enum Ended {
    /// By itself.
    Itself(ExitStatus),
    /// After its time.
    TimedOut,
}

/// Runs `arguments` in `folder`, which gets the files of what is printed. The process and all that it starts end with the time
/// limit. It reads from `token`, an empty file whose lock it so holds for as long as it runs, even if we are killed.
///
/// # Errors
/// The program cannot be started, or we are told to stop: what a run did that ended then is not known.
pub(super) fn run(arguments: &[String], folder: &Path, files: &Path, limit: Option<Duration>, token: Option<File>) -> Result<Ended> {
    let Some((program, rest)) = arguments.split_first() else { return Err(Error::input("the command is empty")) };
    let printed = |name: &str| {
        let path = folder.join(name);
        File::create(&path).map_err(|e| Error::file("write", &path, e))
    };
    let mut command = Command::new(located(program, folder, files));
    command.args(rest).current_dir(folder).stdout(printed(STDOUT)?).stderr(printed(STDERR)?);
    command.stdin(token.map_or_else(Stdio::null, Stdio::from));
    // A group of its own, so that the time limit reaches what the command starts in its turn.
    #[cfg(unix)]
    std::os::unix::process::CommandExt::process_group(&mut command, 0);
    let mut child = command.spawn().map_err(|e| {
        Error::file("run", Path::new(program), e).at_key("solver.command").help("check that the program is installed and found from here")
    })?;
    let begin = Instant::now();
    let mut pause = SHORTEST_PAUSE;
    loop {
        match child.try_wait() {
            Ok(Some(status)) => {
                stop::may_come(status);
                return if stop::is_asked() { Err(stop::stopped(folder)) } else { Ok(Ended::Itself(status)) };
            }
            Ok(None) => {}
            Err(e) => {
                end(&mut child);
                return Err(Error::file("wait for", Path::new(program), e));
            }
        }
        let is_late = limit.is_some_and(|limit| begin.elapsed() >= limit);
        if is_late || stop::is_asked() {
            end(&mut child);
            return if is_late { Ok(Ended::TimedOut) } else { Err(stop::stopped(folder)) };
        }
        std::thread::sleep(pause);
        pause = (pause * 2).min(LONGEST_PAUSE);
    }
}

/// A program named by a path is looked for in the folder of the run, then beside the sweep file; others as the shell does.
fn located(program: &str, folder: &Path, files: &Path) -> std::path::PathBuf {
    let given = Path::new(program);
    if given.is_absolute() || given.components().count() < 2 {
        return given.to_path_buf();
    }
    let absolute = |path: std::path::PathBuf| std::path::absolute(&path).unwrap_or(path);
    let own = folder.join(given);
    if own.exists() { absolute(own) } else { absolute(files.join(given)) }
}

/// Ends a process with all that it has started.
fn end(child: &mut Child) {
    #[cfg(unix)]
    if let Ok(id) = i32::try_from(child.id()) {
        let _ = nix::sys::signal::killpg(nix::unistd::Pid::from_raw(id), nix::sys::signal::Signal::SIGKILL);
    }
    // Where the group is gone already there is nothing left to end.
    let _ = child.kill();
    let _ = child.wait();
}
