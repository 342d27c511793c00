//! Writing a file whole or not at all.
//!
//! A symbolic link stays a link: the file behind it is replaced. A pipe or device stays a pipe or device: the bytes are
//! written into it once they are complete.

use std::collections::BTreeSet;
use std::ffi::OsString;
use std::fs::{self, File};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::time::Duration;

use crate::error::{Error, Result};
use crate::roles;

/// Writes `bytes` as the whole content of `path`; see [`replace`].
///
/// # Errors
/// Errors of [`replace`].
pub fn write(path: &Path, bytes: &[u8]) -> Result<()> {
    replace(path, |temporary| fs::write(temporary, bytes).map_err(|e| Error::file("write", path, e)))
}

/// Writes `bytes` into a file that was read in this run because its content is to be changed; see [`write()`].
///
/// # Errors
/// Errors of [`replace`].
pub fn renew(path: &Path, bytes: &[u8]) -> Result<()> {
    roles::release(path);
    write(path, bytes)
}

/// Largest number of symbolic links that are followed one after another (count). Chosen equal to the limit that Linux
/// itself sets on one path.
const MOST_LINKS: usize = 40;

/// Replaces `path` by a file that `write` makes under a temporary name in the same folder, with the same extension. The
/// temporary file is renamed once its content is on the disk. A reader sees the old file or the new one, also after a
/// crash. A missing folder is made.
///
/// # Errors
/// The file was read in this run of the program; the error of `write`; the file cannot be put in place. The old file is then still there and nothing else is left
/// behind.
pub fn replace(path: &Path, write: impl FnOnce(&Path) -> Result<()>) -> Result<()> {
    let failed =
        |action: &str, e: std::io::Error| Error::file(action, path, e).help("check that the folder may be written to and has space left");
    if path.file_name().is_none() {
        return Err(Error::input("this is no file name").in_file(path).help("name a file to write"));
    }
    roles::may_write(path)?;
    let target = behind_links(path)?;
    let existing = fs::metadata(&target).ok();
    let is_stream = existing.as_ref().is_some_and(|m| !m.is_file() && !m.is_dir());
    let beside = target.parent().filter(|f| !f.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let folder = if is_stream { std::env::temp_dir() } else { beside.to_path_buf() };
    fs::create_dir_all(&folder).map_err(|e| failed("make the folder of", e))?;
    sweep_up(&folder);
    // Hidden, and of this process alone: two runs that write the same file do not meet.
    let mut hidden = OsString::from(format!(".{}.", std::process::id()));
    hidden.push(target.file_name().unwrap_or_default());
    let temporary = folder.join(hidden);
    let put = || -> std::io::Result<()> {
        if is_stream {
            let mut stream = File::options().write(true).open(&target)?;
            stream.write_all(&fs::read(&temporary)?)?;
            stream.flush()?;
            return fs::remove_file(&temporary);
        }
        // Windows puts on the disk only what is open for writing, so this comes before permissions that may forbid it.
        File::options().write(true).open(&temporary)?.sync_all()?;
        if let Some(existing) = &existing {
            fs::set_permissions(&temporary, existing.permissions())?;
        }
        fs::rename(&temporary, &target)
    };
    let outcome = write(&temporary).and_then(|()| put().map_err(|e| failed("write", e)));
    if outcome.is_err() {
        // The reason is in `outcome`; a temporary file that cannot be removed adds nothing to it.
        let _ = fs::remove_file(&temporary);
    }
    outcome
}

/// Folders that this process has looked through for files left behind.
static SWEPT: Mutex<BTreeSet<PathBuf>> = Mutex::new(BTreeSet::new());
/// Age from which a temporary file counts as left behind. Chosen: no file takes as long to write, also on another machine
/// that shares the folder.
const LEFT_BEHIND: Duration = Duration::from_secs(3600);

/// Removes temporary files of earlier processes that were killed, once for every folder. A failure to do so takes nothing
/// from the file that is to be written.
fn sweep_up(folder: &Path) {
    if !SWEPT.lock().unwrap_or_else(|poisoned| poisoned.into_inner()).insert(folder.to_path_buf()) {
        return;
    }
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        let age = entry.metadata().ok().filter(fs::Metadata::is_file).and_then(|about| about.modified().ok()?.elapsed().ok());
        if is_temporary(&entry.file_name().to_string_lossy()) && age.is_some_and(|age| age > LEFT_BEHIND) {
            let _ = fs::remove_file(entry.path());
        }
    }
}

/// Whether a name is one of this program's temporary files: `.PROCESS.NAME`.
fn is_temporary(name: &str) -> bool {
    let parts = name.strip_prefix('.').and_then(|rest| rest.split_once('.'));
    parts.is_some_and(|(process, rest)| !rest.is_empty() && !process.is_empty() && process.bytes().all(|b| b.is_ascii_digit()))
}

/// The path behind `path` once every symbolic link at the end is followed; no file need exist there.
fn behind_links(path: &Path) -> Result<PathBuf> {
    let mut target = path.to_path_buf();
    for _ in 0..MOST_LINKS {
        let Ok(next) = fs::read_link(&target) else { return Ok(target) };
        target = target.parent().unwrap_or(Path::new("")).join(next);
    }
    Err(Error::input("this link leads to itself").in_file(path).help("name the file itself"))
}

/// Checks that a file can be written at `path`, before the work whose result it is to hold. Nothing is left behind.
///
/// # Errors
/// The nearest existing parent is no folder, or refuses a new file; `path` is a folder, or a file that was read in this
/// run of the program.
pub fn check(path: &Path) -> Result<()> {
    let failed = |e: std::io::Error| Error::file("write", path, e).help("check that the folder may be written to");
    if path.file_name().is_none() || path.is_dir() {
        return Err(Error::input("this is no file name").in_file(path).help("name a file to write"));
    }
    roles::will_write(path)?;
    let target = behind_links(path)?;
    // Opening a pipe as a test would end the pipe for its reader.
    if fs::metadata(&target).is_ok_and(|m| !m.is_file()) {
        return Ok(());
    }
    let path = target.as_path();
    let above = path.ancestors().skip(1).map(|a| if a.as_os_str().is_empty() { Path::new(".") } else { a });
    let Some(folder) = above.into_iter().find(|a| a.exists()) else { return Ok(()) };
    if !folder.is_dir() {
        return Err(Error::input("this lies below something that is no folder")
            .in_file(path)
            .read(folder.display())
            .help("name another folder"));
    }
    let probe = folder.join(format!(".{}.probe", std::process::id()));
    File::create(&probe).map_err(failed)?;
    fs::remove_file(&probe).map_err(failed)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[cfg(unix)]
    #[test]
    fn links_pipes_and_devices_stay_what_they_are() {
        use std::os::unix::fs::{FileTypeExt, PermissionsExt, symlink};
        let folder = std::env::temp_dir().join(format!("coldplate-links-{}", std::process::id()));
        fs::create_dir_all(folder.join("far")).unwrap();
        let (file, link) = (folder.join("far").join("file.csv"), folder.join("link.csv"));
        symlink("middle.csv", &link).unwrap();
        symlink("far/file.csv", folder.join("middle.csv")).unwrap();
        // First a link to a file that does not exist yet, then a link to a file.
        for text in [b"one", b"two"] {
            check(&link).unwrap();
            write(&link, text).unwrap();
            assert_eq!(fs::read(&file).unwrap(), text);
            assert!(link.is_symlink() && folder.join("middle.csv").is_symlink());
        }
        fs::set_permissions(&file, fs::Permissions::from_mode(0o640)).unwrap();
        write(&link, b"three").unwrap();
        assert_eq!(fs::metadata(&file).unwrap().permissions().mode() & 0o777, 0o640);
        symlink("round.csv", folder.join("round.csv")).unwrap();
        assert!(write(&folder.join("round.csv"), b"").unwrap_err().to_string().contains("leads to itself"));
        // A pipe is written into, and stays a pipe.
        let pipe = folder.join("pipe");
        assert!(std::process::Command::new("mkfifo").arg(&pipe).status().unwrap().success());
        let reader = std::thread::spawn({
            let pipe = pipe.clone();
            move || fs::read(pipe).unwrap()
        });
        write(&pipe, b"through").unwrap();
        assert_eq!(reader.join().unwrap(), b"through");
        assert!(fs::metadata(&pipe).unwrap().file_type().is_fifo());
        write(Path::new("/dev/null"), b"gone").unwrap();
        assert!(fs::metadata("/dev/null").unwrap().file_type().is_char_device());
        assert!(write(Path::new("/dev/full"), b"refused").is_err());
        let _ = fs::remove_dir_all(&folder);
    }

    #[test]
    fn temporary_files_of_killed_processes_are_removed() {
        let folder = std::env::temp_dir().join(format!("coldplate-left-{}", std::process::id()));
        fs::create_dir_all(&folder).unwrap();
        let old = std::time::SystemTime::now() - 2 * LEFT_BEHIND;
        for name in [".4242.a.csv", ".4242.young.csv", ".hidden.csv", ".12", "4242.a.csv"] {
            let file = File::create(folder.join(name)).unwrap();
            if !name.contains("young") {
                file.set_modified(old).unwrap();
            }
        }
        write(&folder.join("b.csv"), b"new").unwrap();
        let mut left: Vec<String> = fs::read_dir(&folder).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
        left.sort();
        assert_eq!(left, [".12", ".4242.young.csv", ".hidden.csv", "4242.a.csv", "b.csv"]);
        let _ = fs::remove_dir_all(&folder);
    }

    #[test]
    fn a_failed_write_leaves_the_old_file_and_nothing_else() {
        let folder = std::env::temp_dir().join(format!("coldplate-files-{}", std::process::id()));
        let path = folder.join("made").join("a.csv");
        write(&path, b"old").unwrap();
        let error = replace(&path, |temporary| {
            assert_eq!(temporary.extension(), path.extension());
            fs::write(temporary, b"half").map_err(|e| Error::file("write", temporary, e))?;
            Err(Error::numerics("stopped"))
        });
        assert_eq!(error.unwrap_err().what(), "stopped");
        assert_eq!(fs::read(&path).unwrap(), b"old");
        assert_eq!(fs::read_dir(path.parent().unwrap()).unwrap().count(), 1);
        write(&path, b"new").unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"new");
        assert!(write(&folder, b"a folder is there").is_err());
        assert_eq!(fs::read_dir(&folder).unwrap().count(), 1);
        assert!(write(Path::new(".."), b"").is_err());
        check(&folder.join("not").join("yet").join("there.csv")).unwrap();
        assert!(check(&path.join("below a file.csv")).is_err() && check(&folder).is_err());
        assert_eq!(fs::read_dir(&folder).unwrap().count(), 1);
        let _ = fs::remove_dir_all(&folder);
    }
}
