//! Plain-text tables for readers.

/// Widest rule under a heading, in characters. Chosen: a page, however long the sentences in the table are.
const WIDEST_RULE: usize = 118;

/// A table with a heading row; columns are as wide as their widest cell, numbers stand to the right.
pub fn table(heading: &[&str], rows: &[Vec<String>]) -> String {
    let columns = heading.len();
    let width =
        |i: usize| rows.iter().filter_map(|r| r.get(i)).map(|c| c.chars().count()).chain([heading[i].chars().count()]).max().unwrap_or(0);
    let widths: Vec<usize> = (0..columns).map(width).collect();
    let is_number = |i: usize| {
        rows.iter()
            .filter_map(|r| r.get(i))
            .all(|c| c.is_empty() || c.starts_with(['-', '+', '0', '1', '2', '3', '4', '5', '6', '7', '8', '9', '<']))
    };
    let right: Vec<bool> = (0..columns).map(is_number).collect();
    let line = |cells: &mut dyn Iterator<Item = &str>| {
        let mut text = String::from(" ");
        for (i, cell) in cells.enumerate() {
            let pad = " ".repeat(widths[i].saturating_sub(cell.chars().count()));
            text.push(' ');
            if right[i] {
                text.push_str(&pad);
            }
            text.push_str(cell);
            if !right[i] {
                text.push_str(&pad);
            }
            text.push(' ');
        }
        text.trim_end().to_string() + "\n"
    };
    let mut text = line(&mut heading.iter().copied());
    text += &format!("  {}\n", "-".repeat((widths.iter().sum::<usize>() + 2 * (columns - 1)).min(WIDEST_RULE)));
    for row in rows {
        text += &line(&mut row.iter().map(String::as_str));
    }
    text
}

/// A table behind a blank line; nothing without rows.
pub fn block(heading: &[&str], rows: &[Vec<String>]) -> String {
    if rows.is_empty() { String::new() } else { format!("\n{}", table(heading, rows)) }
}
