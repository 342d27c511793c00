//! View factors by rays, kept in a small file so that the next run need not send the rays again.
//!
//! Text: a header, the key (a hash of the geometry and of how many rays were sent), one line per surface, a
//! checksum. A file of another key is out of date and replaced; a damaged one too, with a note. Nothing depends
//! on the file: results are the same with and without it.

use std::fmt::Write as _;
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};

use sha2::{Digest, Sha256};

use crate::mesh::Mesh;
use crate::mesh::sight::{BATCHES, SidePiece, SurfaceView};
use coldplate_describe::machine::Machine;

/// First line of the file, with the version of its format.
const HEADER: &str = "coldplate view factors 1";

/// A hash of everything the rays depend on.
pub(super) fn key(machine: &Machine, mesh: &Mesh, surfaces: &[Vec<SidePiece>], wanted: &[bool], rays: usize) -> String {
    let mut text = format!("{HEADER} {rays} {BATCHES} {wanted:?}");
    for grid in &mesh.grids {
        let _ = write!(text, "\n{:?}", machine.parts[grid.part].blocks[grid.block].shape);
    }
    for import in mesh.tetra.iter().filter_map(|t| machine.parts[t.part].import.as_ref()) {
        let _ = write!(text, "\n{} {} {:?}", import.body.mesh_hash, import.body.name, import.at);
        // The unit of the mesh shows in the box around it.
        let _ = write!(text, " {:?}", import.body.bounds());
    }
    let _ = write!(text, "\n{surfaces:?}");
    Sha256::digest(text.as_bytes()).iter().map(|byte| format!("{byte:02x}")).collect()
}

/// View factors in the file for this key; `None` where there is no file, or it is out of date or damaged (with a note).
pub(super) fn read(path: &Path, key: &str, wanted: &[bool], notes: &mut Vec<String>) -> Option<Vec<Option<SurfaceView>>> {
    let bytes = std::fs::read(path).ok()?;
    let parsed = std::str::from_utf8(&bytes).ok().and_then(|text| parse(text, key, wanted));
    match parsed {
        Some(Kept::Same(seen)) => Some(seen),
        Some(Kept::Other) => None,
        None => {
            notes.push(format!("{} was damaged and has been made anew", path.display()));
            None
        }
    }
}

enum Kept {
    /// View factors of this key.
    Same(Vec<Option<SurfaceView>>),
    /// Sound, but of another geometry.
    Other,
}

fn parse(text: &str, key: &str, wanted: &[bool]) -> Option<Kept> {
    let (body, sum) = text.trim_end().rsplit_once("\nchecksum ")?;
    if u32::from_str_radix(sum, 16).ok()? != crc32fast::hash(body.as_bytes()) {
        return None;
    }
    let mut lines = body.lines();
    if lines.next()? != HEADER {
        return Some(Kept::Other);
    }
    if lines.next()?.strip_prefix("key ")? != key {
        return Some(Kept::Other);
    }
    let mut seen = Vec::new();
    for wanted in wanted {
        if !wanted {
            seen.push(None);
            continue;
        }
        let numbers: Vec<f64> = lines.next()?.split(' ').map(|n| n.parse().ok()).collect::<Option<_>>()?;
        let (head, tail) = numbers.split_at_checked(3)?;
        if tail.len() % 2 != 0 || numbers.iter().any(|x| !x.is_finite()) {
            return None;
        }
        let (share, error) = tail.split_at(tail.len() / 2);
        seen.push(Some(SurfaceView { share: share.to_vec(), error: error.to_vec(), escaped: head[0], strayed: head[1], open: head[2] }));
    }
    let n = wanted.len();
    seen.iter().flatten().all(|s| s.share.len() == n).then_some(Kept::Same(seen))
}

/// Writes the file; if it cannot be written, the next run sends its rays again, with a note.
pub(super) fn write(path: &Path, key: &str, seen: &[Option<SurfaceView>], notes: &mut Vec<String>) {
    static COUNT: AtomicUsize = AtomicUsize::new(0);
    let mut body = format!("{HEADER}\nkey {key}");
    for seen in seen.iter().flatten() {
        let numbers =
            [seen.escaped, seen.strayed, seen.open].into_iter().chain(seen.share.iter().copied()).chain(seen.error.iter().copied());
        // The shortest text that reads back as the same number.
        let line: Vec<String> = numbers.map(|x| format!("{x:?}")).collect();
        let _ = write!(body, "\n{}", line.join(" "));
    }
    let text = format!("{body}\nchecksum {:08x}\n", crc32fast::hash(body.as_bytes()));
    let unique = format!("views.{}.{}.tmp", std::process::id(), COUNT.fetch_add(1, Ordering::Relaxed));
    let partial = path.with_extension(unique);
    if let Err(error) = std::fs::write(&partial, text).and_then(|()| std::fs::rename(&partial, path)) {
        let _ = std::fs::remove_file(&partial);
        notes.push(format!("the view factors could not be kept in {}: {error}", path.display()));
    }
}
