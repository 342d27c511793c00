//! Tables whose columns are aligned by blanks, or framed by '|'.

use std::borrow::Cow;

use crate::layout::DELIMITERS;
use crate::ledger::Ledger;
use crate::records::remark;

/// The text with a delimiter between the columns, if blanks alone align them or '|' frames every line; lines stay as many. Nothing
/// is changed unless every line has as many cells: a cell that is empty cannot be seen between blanks.
pub(crate) fn delimited<'a>(text: &'a str, ledger: &mut Ledger) -> Cow<'a, str> {
    let rows = || text.lines().filter(|line| !line.trim().is_empty() && remark(line).is_none());
    if rows().count() < 2 || text.contains('"') {
        return Cow::Borrowed(text);
    }
    let of_row = |change: &dyn Fn(&str) -> String| -> String {
        text.lines().map(|line| if remark(line).is_some() { line.to_string() } else { change(line.trim()) } + "\n").collect()
    };
    if rows().all(|line| line.trim().len() > 1 && line.trim().starts_with('|') && line.trim().ends_with('|')) {
        ledger.assumed.push("a '|' frames every line".into());
        return Cow::Owned(of_row(&|line| line.strip_prefix('|').and_then(|l| l.strip_suffix('|')).unwrap_or(line).to_string()));
    }
    let has_one_count = |count: &dyn Fn(&str) -> usize| {
        let mut counts = rows().map(count);
        counts.next().is_some_and(|first| first > 1 && counts.all(|own| own == first))
    };
    let is_delimited = DELIMITERS.into_iter().any(|delimiter| has_one_count(&|line| line.matches(delimiter).count() + 1));
    if is_delimited || !has_one_count(&|line| cells(line).count()) {
        return Cow::Borrowed(text);
    }
    ledger.assumed.push("columns are aligned by two or more blanks".into());
    Cow::Owned(of_row(&|line| cells(line).collect::<Vec<_>>().join("\t")))
}

/// Cells between two or more blanks.
fn cells(line: &str) -> impl Iterator<Item = &str> {
    line.split("  ").map(str::trim).filter(|cell| !cell.is_empty())
}
