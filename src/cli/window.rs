//! The window that a reader looks at: its width, and whether it shows colours.

use std::io::IsTerminal;
use std::sync::OnceLock;

/// Width of tables where standard output is no terminal, in characters. Chosen: a page of the manual.
const PAGE: usize = 120;
/// Least width that a window is taken to have, in characters. Chosen: words have no room in less.
const LEAST: usize = 40;

/// Width of tables, in characters.
pub fn width() -> usize {
    stated().unwrap_or(PAGE)
}

/// Width of the window, in characters: as COLUMNS states it, or that of the terminal behind standard output. `None` where
/// there is neither, so that lines reach another program whole.
pub fn stated() -> Option<usize> {
    static WIDTH: OnceLock<Option<usize>> = OnceLock::new();
    *WIDTH.get_or_init(|| {
        let said = std::env::var("COLUMNS").ok().and_then(|columns| columns.trim().parse().ok()).filter(|columns| *columns > 0);
        said.or_else(of_terminal).map(|columns: usize| columns.max(LEAST))
    })
}

/// Width of the terminal behind standard output, as `stty` knows it.
#[cfg(unix)]
fn of_terminal() -> Option<usize> {
    use std::os::fd::AsFd;
    let stdout = std::io::stdout();
    if !stdout.is_terminal() {
        return None;
    }
    let terminal = stdout.as_fd().try_clone_to_owned().ok()?;
    let asked = std::process::Command::new("stty").arg("size").stdin(terminal).stderr(std::process::Stdio::null()).output().ok()?;
    // "ROWS COLUMNS"; a terminal that does not know its size states zeros.
    String::from_utf8(asked.stdout).ok()?.split_whitespace().nth(1)?.parse().ok().filter(|columns| *columns > 0)
}

/// Other systems have no such program.
#[cfg(not(unix))]
fn of_terminal() -> Option<usize> {
    None
}

/// Whether text on this stream may have colours: a terminal that shows them, of a user who has not refused them
/// (<https://no-color.org>).
pub fn shows_colours(stream: &impl IsTerminal) -> bool {
    let refused = std::env::var_os("NO_COLOR").is_some_and(|value| !value.is_empty());
    stream.is_terminal() && !refused && std::env::var_os("TERM").is_none_or(|term| term != "dumb")
}
