//! A report as PDF, printed by an installed Chromium: tagged, with text that can be selected.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use coldplate_base::atomic_file;
use coldplate_base::error::{Error, Result};

/// Environment variable that names the browser, if it is not found by itself.
pub const NAMED_BY: &str = "COLDPLATE_CHROMIUM";
/// Names under which Chromium and its kin are installed, in the order tried.
const NAMES: [&str; 7] = ["chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome", "microsoft-edge", "msedge"];
/// Places of an installation that is in no PATH.
const PLACES: [&str; 4] = [
    "/Applications/Google Chrome.app/Contents/MacOS/Google Chrome",
    "/Applications/Chromium.app/Contents/MacOS/Chromium",
    r"C:\Program Files\Google\Chrome\Application\chrome.exe",
    r"C:\Program Files (x86)\Microsoft\Edge\Application\msedge.exe",
];
/// Time after which printing is given up, s. Chosen: thirty times what the largest report takes.
const MOST_SECONDS: u64 = 120;

/// A browser that prints pages.
#[derive(Debug, Clone)]
pub struct Printer {
    program: PathBuf,
}

impl Printer {
    /// The browser that [`NAMED_BY`] names, or the first of the usual ones that is installed.
    ///
    /// # Errors
    /// There is none.
    pub fn find() -> Result<Self> {
        let help =
            format!("install Chromium or Google Chrome, name one in {NAMED_BY}, or open report.html in a browser and print it there");
        if let Some(named) = std::env::var_os(NAMED_BY).filter(|named| !named.is_empty()) {
            let program = PathBuf::from(&named);
            let found = if program.components().count() > 1 { program.is_file().then_some(program) } else { in_path(&program) };
            let error = || Error::input(format!("{NAMED_BY} names a browser that is not there")).read(named.to_string_lossy()).help(&help);
            return found.map(|program| Self { program }).ok_or_else(error);
        }
        let usual = NAMES.iter().find_map(|name| in_path(Path::new(name)));
        let program = usual.or_else(|| PLACES.iter().map(PathBuf::from).find(|place| place.is_file()));
        program
            .map(|program| Self { program })
            .ok_or_else(|| Error::input("no Chromium is installed that could print the report as PDF").help(help))
    }

    /// Prints a page.
    ///
    /// # Errors
    /// The browser does not start, takes too long or writes no PDF; the file cannot be put in place.
    pub fn print(&self, page: &Path, pdf: &Path) -> Result<()> {
        let page = page.canonicalize().map_err(|e| Error::file("read", page, e))?;
        let profile = std::env::temp_dir().join(format!("coldplate-print-{}", std::process::id()));
        let printed = atomic_file::replace(pdf, |temporary| self.run(&page, (temporary, pdf), &profile));
        // A profile that is left behind harms nobody.
        let _ = std::fs::remove_dir_all(&profile);
        printed
    }

    /// Prints a page into a file that will have another name, by which errors call it.
    fn run(&self, page: &Path, (printed, pdf): (&Path, &Path), profile: &Path) -> Result<()> {
        let failed = |what: String| Error::numerics(what).in_file(pdf).help("open report.html in a browser and print it there");
        let with = |flag: &str, path: &Path| {
            let mut argument = std::ffi::OsString::from(flag);
            argument.push(path);
            argument
        };
        let mut child = Command::new(&self.program)
            // The sandbox does not start for root or in most containers. The page is our own, and may neither run scripts nor load anything.
            .args(["--headless", "--disable-gpu", "--no-sandbox", "--no-first-run", "--disable-background-networking"])
            .args(["--no-pdf-header-footer", "--export-tagged-pdf", "--generate-pdf-document-outline"])
            .arg(with("--user-data-dir=", profile))
            .arg(with("--print-to-pdf=", printed))
            .arg(address(page))
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .map_err(|e| failed(format!("{} does not start: {e}", self.program.display())))?;
        let start = Instant::now();
        let ended = loop {
            if let Some(status) = child.try_wait().map_err(|e| failed(e.to_string()))? {
                break status;
            }
            if start.elapsed() > Duration::from_secs(MOST_SECONDS) {
                let _ = child.kill();
                let _ = child.wait();
                return Err(failed(format!("{} did not print within {MOST_SECONDS} s", self.program.display())));
            }
            std::thread::sleep(Duration::from_millis(20));
        };
        let is_pdf = std::fs::read(printed).is_ok_and(|bytes| bytes.starts_with(b"%PDF"));
        if is_pdf { Ok(()) } else { Err(failed(format!("{} wrote no PDF ({ended})", self.program.display()))) }
    }
}

/// The program of this name in the folders of PATH.
fn in_path(name: &Path) -> Option<PathBuf> {
    let folders = std::env::var_os("PATH")?;
    let with_ending = |folder: PathBuf| [folder.join(name), folder.join(name).with_extension("exe")];
    std::env::split_paths(&folders).flat_map(with_ending).find(|program| program.is_file())
}

/// The address of a file, with all signs escaped that an address cannot have.
fn address(file: &Path) -> String {
    let text = file.to_string_lossy().replace('\\', "/");
    let escaped = text.bytes().map(|byte| match byte {
        b'a'..=b'z' | b'A'..=b'Z' | b'0'..=b'9' | b'/' | b'-' | b'_' | b'.' | b'~' | b':' => char::from(byte).to_string(),
        other => format!("%{other:02X}"),
    });
    let path: String = escaped.collect();
    format!("file://{}{path}", if path.starts_with('/') { "" } else { "/" })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_address_keeps_every_name() {
        assert_eq!(address(Path::new("/tmp/a b/100 %#?.html")), "file:///tmp/a%20b/100%20%25%23%3F.html");
        assert_eq!(address(Path::new("C:\\out\\ü.html")), "file:///C:/out/%C3%BC.html");
    }
}
