//! Figures as they are drawn: files in one folder, and their SVG text for the report.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use coldplate_base::atomic_file;
use coldplate_base::error::{Error, Result};
use coldplate_figures::chart::{Figure, draw, to_svg_string};

/// Figures drawn so far: files on disk, and the SVG text for the report.
#[derive(Debug)]
pub struct Gallery {
    folder: PathBuf,
    entries: Vec<GalleryEntry>,
    /// Files that are no pictures.
    others: Vec<PathBuf>,
    names: BTreeSet<String>,
}

/// A figure in the gallery.
#[derive(Debug)]
pub struct GalleryEntry {
    /// Topic that the figure belongs to.
    pub topic: &'static str,
    /// The SVG document.
    pub svg: String,
    files: Vec<PathBuf>,
}

impl Gallery {
    /// An empty gallery in `folder`, which is made where it is missing.
    ///
    /// # Errors
    /// The folder cannot be made.
    pub fn new(folder: &Path) -> Result<Self> {
        std::fs::create_dir_all(folder).map_err(|e| Error::file("make", folder, e))?;
        Ok(Self { folder: folder.to_path_buf(), entries: Vec::new(), others: Vec::new(), names: BTreeSet::new() })
    }

    /// Draws a figure as SVG and PNG under `name`, with a number behind it where the name is taken already.
    ///
    /// # Errors
    /// The figure has nothing to show, or cannot be written.
    pub fn add(&mut self, name: &str, topic: &'static str, figure: &dyn Figure) -> Result<()> {
        let name = self.free_name(name);
        let written = draw(self.folder.join(name), figure)?;
        let svg = to_svg_string(figure)?;
        self.entries.push(GalleryEntry { topic, svg, files: vec![written.svg, written.png] });
        Ok(())
    }

    /// Writes a file that is no picture, named as in [`Gallery::add`].
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn add_file(&mut self, name: &str, ending: &str, content: &[u8]) -> Result<()> {
        let name = self.free_name(name);
        let path = self.folder.join(format!("{name}.{ending}"));
        atomic_file::write(&path, content)?;
        self.others.push(path);
        Ok(())
    }

    /// Names that differ only in signs a file name does not keep must not overwrite each other.
    fn free_name(&mut self, name: &str) -> String {
        let numbered = (2..).map(|n| format!("{name}_{n}"));
        let free = std::iter::once(name.to_string()).chain(numbered).find(|n| !self.names.contains(n));
        let free = free.unwrap_or_else(|| name.to_string());
        self.names.insert(free.clone());
        free
    }

    /// Whether there is a figure of this topic.
    pub fn has(&self, topic: &str) -> bool {
        self.entries.iter().any(|e| e.topic == topic)
    }

    /// Figures of a topic.
    pub fn of<'a>(&'a self, topic: &'a str) -> impl Iterator<Item = &'a GalleryEntry> {
        self.entries.iter().filter(move |e| e.topic == topic)
    }

    /// All files.
    pub fn files(&self) -> Vec<PathBuf> {
        self.entries.iter().flat_map(|e| &e.files).chain(&self.others).cloned().collect()
    }
}

/// A name as part of a file name.
pub fn file_name(name: &str) -> String {
    name.chars().map(|c| if c.is_ascii_alphanumeric() { c.to_ascii_lowercase() } else { '_' }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_alike_as_files_are_numbered() {
        let mut gallery = Gallery { folder: PathBuf::new(), entries: Vec::new(), others: Vec::new(), names: BTreeSet::new() };
        let names: Vec<String> = ["a/b", "a b", "A_B"].iter().map(|n| gallery.free_name(&file_name(n))).collect();
        assert_eq!(names, ["a_b", "a_b_2", "a_b_3"]);
    }
}
