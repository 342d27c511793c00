//! Text with parts that depend on the surrogate.
//!
//! A line `//? A B` begins a part that is kept if every named flag holds (`!A`: if it does not hold). `//? else`
//! inverts the condition, and `//? end` ends the part; parts nest. A line `//! NAME` is replaced by the block of this
//! name. The words `surrogate_` and `SURROGATE_` stand for the name.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use coldplate_runtime::{Kernel, Transform};

use crate::content::{Content, Point};

/// Flags and blocks for filling a template.
#[derive(Debug, Default)]
pub(crate) struct Filling {
    pub(crate) flags: BTreeMap<&'static str, bool>,
    pub(crate) blocks: BTreeMap<&'static str, String>,
}

impl Filling {
    /// The flags of a surrogate.
    pub(crate) fn of(content: &Content) -> Self {
        let has_transform = |own: Transform| content.scalings.iter().any(|s| s.transform == own);
        let has_kernel = |own: Kernel| content.bases.iter().any(|b| b.kernel == own);
        let has_limits = !content.limits.is_empty();
        let is_uncertain = content.uncertainty.is_some();
        let mut filling = Self::default();
        for (flag, holds) in [
            ("bases", !content.bases.is_empty()),
            ("limits", has_limits),
            ("uncertain", is_uncertain),
            ("moving", content.in_time.is_some()),
            ("displaced", content.points.iter().any(Point::is_displacement)),
            ("known", content.uncertainty.as_ref().is_some_and(|own| own.known.is_some())),
            ("reciprocal", has_transform(Transform::Reciprocal)),
            ("log", has_transform(Transform::Log)),
            ("thin_plate", has_kernel(Kernel::ThinPlate)),
            ("cubic", has_kernel(Kernel::Cubic)),
            ("multiquadric", has_kernel(Kernel::Multiquadric)),
            ("gaussian", has_kernel(Kernel::Gaussian)),
            ("ln", has_kernel(Kernel::ThinPlate) || has_transform(Transform::Log)),
            ("finite", has_limits || content.in_time.is_some() || has_kernel(Kernel::ThinPlate) || has_transform(Transform::Log)),
            ("exp", has_limits || has_kernel(Kernel::Gaussian)),
            ("widths", has_limits || is_uncertain),
        ] {
            filling.flag(flag, holds);
        }
        filling
    }

    pub(crate) fn flag(&mut self, name: &'static str, value: bool) {
        self.flags.insert(name, value);
    }

    pub(crate) fn block(&mut self, name: &'static str, text: String) {
        self.blocks.insert(name, text);
    }

    /// The text of `template` for a surrogate of this name.
    pub(crate) fn fill(&self, template: &str, name: &str) -> String {
        let mut text = String::new();
        // Whether lines are kept, for the whole text and for each open part.
        let mut kept = vec![true];
        for line in template.lines() {
            let line_is = |mark: &str| line.trim_start().strip_prefix(mark).map(str::trim);
            if let Some(condition) = line_is("//?") {
                match condition {
                    "end" => drop(kept.pop()),
                    "else" => {
                        let own = kept.pop().unwrap_or(true);
                        let outer = kept.last().copied().unwrap_or(true);
                        kept.push(outer && !own);
                    }
                    flags => {
                        let outer = kept.last().copied().unwrap_or(true);
                        kept.push(outer && flags.split_whitespace().all(|flag| self.holds(flag)));
                    }
                }
            } else if kept.last().copied().unwrap_or(true) {
                if let Some(block) = line_is("//!") {
                    text.push_str(self.blocks.get(block).map_or("", String::as_str));
                } else {
                    text.push_str(
                        &line.replace("surrogate_", &format!("{name}_")).replace("SURROGATE_", &format!("{}_", name.to_uppercase())),
                    );
                    text.push('\n');
                }
            }
        }
        text
    }

    fn holds(&self, flag: &str) -> bool {
        match flag.strip_prefix('!') {
            Some(flag) => !self.flags.get(flag).copied().unwrap_or(false),
            None => self.flags.get(flag).copied().unwrap_or(false),
        }
    }
}

/// Entries with commas between them, filled into lines.
pub(crate) fn wrapped(entries: &[String], indent: &str) -> String {
    let mut text = String::new();
    let mut line = String::from(indent);
    for (index, entry) in entries.iter().enumerate() {
        let separator = if index + 1 == entries.len() { "" } else { "," };
        if line.len() > indent.len() + 1 && line.len() + entry.len() > 118 {
            let _ = writeln!(text, "{line}");
            line = String::from(indent);
        }
        let _ = write!(line, " {entry}{separator}");
    }
    let _ = writeln!(text, "{line}");
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_are_kept_where_their_flags_hold() {
        let mut filling = Filling::default();
        filling.flag("a", true);
        filling.block("table", "1, 2\n".into());
        let template = "//? a !b\nsurrogate_x SURROGATE_X\n//? b\nno\n//? else\n  //! table\n//? end\n//? else\nno\n//? end\nlast\n";
        assert_eq!(filling.fill(template, "cold"), "cold_x COLD_X\n1, 2\nlast\n");
    }
}
