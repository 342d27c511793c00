//! One run of a command in a folder, with a time limit.

use std::fs::File;
use std::path::Path;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

use crate::stop;
use coldplate_base::error::{Error, Result};

/// Name of the file with the command's output, in the folder of the run.
pub(super) const STDOUT: &str = "stdout";
/// Name of the file with the command's errors, in the folder of the run.
pub(super) const STDERR: &str = "stderr";

/// First pause between two looks at a process. Chosen: does not hold up runs of milliseconds.
const SHORTEST_PAUSE: Duration = Duration::from_micros(500);
/// Longest pause between two looks at a process. Chosen: looks at long runs cost nothing.
const LONGEST_PAUSE: Duration = Duration::from_millis(20);

/// End of a run.
#[derive(Debug, Clone, Copy)]
pub(super) enum Ended {
    /// The process ended by itself.
    Itself(ExitStatus),
    /// The process was ended at its time limit.
    TimedOut,
}

/// Runs `arguments` in `folder`, which gets the files of the output. The process and all that it starts are ended at the time
/// limit. The process reads from `token`, an empty file: the lock of the file is so held for as long as the process runs, even
/// if this one is killed.
///
/// # Errors
/// The program cannot be started, or this process is told to stop: the result of a run that ended then is not known.
pub(super) fn run(arguments: &[String], folder: &Path, files: &Path, limit: Option<Duration>, token: Option<File>) -> Result<Ended> {
    let Some((program, rest)) = arguments.split_first() else { return Err(Error::input("the command is empty")) };
    let printed = |name: &str| {
        let path = folder.join(name);
        File::create(&path).map_err(|e| Error::file("write", &path, e))
    };
    let mut command = Command::new(located(program, folder, files));
    command.args(rest).current_dir(folder).stdout(printed(STDOUT)?).stderr(printed(STDERR)?);
    command.stdin(token.map_or_else(Stdio::null, Stdio::from));
    // A process group of its own, so that the time limit reaches processes that the command starts.
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

/// Path of a program. One named by a path is looked for in the folder of the run, then beside the sweep file; others are looked
/// for as the shell does.
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
    if let Some(group) = i32::try_from(child.id()).ok().and_then(rustix::process::Pid::from_raw) {
        let _ = rustix::process::kill_process_group(group, rustix::process::Signal::KILL);
    }
    // If the group is gone already there is nothing left to end.
    let _ = child.kill();
    let _ = child.wait();
}
