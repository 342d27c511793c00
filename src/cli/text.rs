//! Plain-text tables and paragraphs for readers, as wide as the window.

use super::window;

/// Longest number that stays on one line in a narrowed table, in characters. Chosen: "26.9 to 34.8" and its like.
const UNBROKEN: usize = 20;
/// Least width that a column of words is narrowed to, in characters. Chosen: a short word.
const NARROWEST: usize = 12;
/// Space between two columns, in characters; the table is indented by as much.
const GAP: usize = 2;

/// A table with a heading row that fits the window; columns are as wide as their widest cell, numbers stand to the right.
///
/// A table that is too wide has its widest columns go on in further lines; where even this is too wide, the later columns
/// follow below, each time behind the first.
pub fn table(heading: &[&str], rows: &[Vec<String>]) -> String {
    fitted(heading, rows, window::width())
}

/// A table behind a blank line; nothing without rows.
pub fn block(heading: &[&str], rows: &[Vec<String>]) -> String {
    if rows.is_empty() { String::new() } else { format!("\n{}", table(heading, rows)) }
}

/// Text whose lines go on below where they are wider than the window; rows of tables stay as they are.
pub fn folded(text: &str, width: usize) -> String {
    let fold = |line: &str| {
        let words = line.trim_start();
        let indent = &line[..line.len() - words.len()];
        if line.chars().count() <= width || words.contains("  ") {
            return format!("{line}\n");
        }
        lines(words, width.saturating_sub(indent.len())).iter().map(|line| format!("{indent}{line}\n")).collect()
    };
    text.lines().map(fold).collect()
}

/// A column: its cells without the heading, and what its width may be.
struct Column<'a> {
    heading: &'a str,
    cells: Vec<&'a str>,
    is_number: bool,
}

impl Column<'_> {
    /// Width at which nothing is broken.
    fn natural(&self) -> usize {
        self.cells.iter().chain([&self.heading]).map(|cell| cell.chars().count()).max().unwrap_or(0)
    }

    /// Width below which a word would be broken, or a short number.
    fn least(&self) -> usize {
        let longest_word = |cell: &&str| cell.split(' ').map(|word| word.chars().count()).max().unwrap_or(0);
        let least = |cell: &&str| match cell.chars().count() {
            whole if self.is_number && whole <= UNBROKEN => whole,
            _ => longest_word(cell),
        };
        self.cells.iter().map(least).chain([longest_word(&self.heading)]).max().unwrap_or(0)
    }
}

fn fitted(heading: &[&str], rows: &[Vec<String>], width: usize) -> String {
    let is_number = |cell: &&str| cell.is_empty() || cell.starts_with(['-', '+', '0', '1', '2', '3', '4', '5', '6', '7', '8', '9', '<']);
    let columns: Vec<Column<'_>> = (heading.iter().enumerate())
        .map(|(i, heading)| {
            let cells: Vec<&str> = rows.iter().map(|row| row.get(i).map_or("", String::as_str)).collect();
            Column { heading, is_number: cells.iter().all(is_number), cells }
        })
        .collect();
    let natural: Vec<usize> = columns.iter().map(Column::natural).collect();
    let least: Vec<usize> = columns.iter().map(Column::least).collect();
    let broken: Vec<usize> = columns.iter().zip(&least).map(|(c, l)| if c.is_number { *l } else { *l.min(&NARROWEST) }).collect();
    let room = |count: usize| width.saturating_sub(GAP * count);
    let all: Vec<&Column<'_>> = columns.iter().collect();
    if let Some(widths) = [&least, &broken].into_iter().find_map(|least| narrowed(&natural, least, room(columns.len()))) {
        return drawn(&all, &widths);
    }
    if columns.len() == 1 {
        return drawn(&all, &broken);
    }
    // The first column again before as many of the others as fit.
    let mut tables = Vec::new();
    let mut next = 1;
    while next < columns.len() {
        let fits = |end: &usize| broken[0] + broken[next..*end].iter().sum::<usize>() <= room(1 + end - next);
        let end = (next + 1..=columns.len()).take_while(fits).last().unwrap_or(next + 1);
        let of = |values: &[usize]| [&values[..1], &values[next..end]].concat();
        let widths = narrowed(&of(&natural), &of(&broken), room(1 + end - next)).unwrap_or_else(|| of(&broken));
        tables.push(drawn(&[&all[..1], &all[next..end]].concat(), &widths));
        next = end;
    }
    tables.join("\n")
}

/// Widths that fit into `room`, the widest columns narrowed first; `None` if the least widths do not fit.
fn narrowed(natural: &[usize], least: &[usize], room: usize) -> Option<Vec<usize>> {
    let at = |most: usize| -> Vec<usize> { natural.iter().zip(least).map(|(natural, least)| (*natural).min(most.max(*least))).collect() };
    let widest = natural.iter().copied().max().unwrap_or(0);
    (0..=widest).rev().map(at).find(|widths| widths.iter().sum::<usize>() <= room)
}

fn drawn(columns: &[&Column<'_>], widths: &[usize]) -> String {
    let row = |cells: Vec<&str>, from_below: bool| {
        let cells: Vec<Vec<String>> = cells.iter().zip(widths).map(|(cell, width)| cell_lines(cell, *width)).collect();
        let height = cells.iter().map(Vec::len).max().unwrap_or(1);
        let line = |at: usize| {
            let mut text = String::new();
            for ((cell, column), width) in cells.iter().zip(columns).zip(widths) {
                let missing = if from_below { height - cell.len() } else { 0 };
                let own = at.checked_sub(missing).and_then(|at| cell.get(at)).map_or("", String::as_str);
                let pad = " ".repeat(width.saturating_sub(own.chars().count()));
                text += &" ".repeat(GAP);
                text += &if column.is_number { pad + own } else { own.to_string() + &pad };
            }
            text.trim_end().to_string() + "\n"
        };
        (0..height).map(line).collect::<String>()
    };
    let mut text = row(columns.iter().map(|column| column.heading).collect(), true);
    text += &format!("{}{}\n", " ".repeat(GAP), "-".repeat(widths.iter().sum::<usize>() + GAP * (widths.len() - 1)));
    let rows = columns.first().map_or(0, |column| column.cells.len());
    for at in 0..rows {
        text += &row(columns.iter().map(|column| column.cells[at]).collect(), false);
    }
    text
}

/// A cell in lines of at most this width; a longer word is broken, behind a mark where it has one.
fn cell_lines(cell: &str, width: usize) -> Vec<String> {
    if cell.chars().count() <= width {
        return vec![cell.to_string()];
    }
    lines(cell, width).iter().flat_map(|line| pieces(line, width)).collect()
}

/// Words in lines of at most this width, but for a word that is longer.
fn lines(text: &str, width: usize) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in text.split(' ') {
        match lines.last_mut() {
            Some(line) if line.chars().count() + 1 + word.chars().count() <= width => {
                line.push(' ');
                line.push_str(word);
            }
            _ => lines.push(word.to_string()),
        }
    }
    lines
}

/// A line in pieces of at most this width.
fn pieces(line: &str, width: usize) -> Vec<String> {
    let mut rest: Vec<char> = line.chars().collect();
    let mut pieces = Vec::new();
    while rest.len() > width.max(1) {
        let mark =
            rest[..width.max(1)].iter().rposition(|c| matches!(c, '.' | ',' | '/' | '_' | '-' | '=')).map_or(width.max(1), |at| at + 1);
        pieces.push(rest.drain(..mark).collect());
    }
    pieces.push(rest.into_iter().collect());
    pieces
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rows(rows: &[&[&str]]) -> Vec<Vec<String>> {
        rows.iter().map(|row| row.iter().map(ToString::to_string).collect()).collect()
    }

    fn widest(text: &str) -> usize {
        text.lines().map(|line| line.chars().count()).max().unwrap_or(0)
    }

    #[test]
    fn a_table_that_fits_has_a_line_for_every_row() {
        let text = fitted(&["part", "mass kg"], &rows(&[&["bed", "2666"], &["z ram", "68.26"]]), 40);
        assert_eq!(text, "  part   mass kg\n  --------------\n  bed       2666\n  z ram    68.26\n");
    }

    #[test]
    fn the_widest_columns_go_on_below() {
        let long = "the area leaves out all faces towards the bench";
        let text = fitted(&["assumed", "value", "because"], &rows(&[&["part.motor.surface", "0.055", long]]), 50);
        let expected = "  assumed             value  because\n  ------------------------------------------------\n  \
                        part.motor.surface  0.055  the area leaves out\n                             all faces towards the\n                             \
                        bench\n";
        assert_eq!(text, expected);
        // Nothing is lost, whatever the width.
        for width in 24..120 {
            let text = fitted(&["assumed", "value", "because"], &rows(&[&["part.motor.surface", "0.055", long]]), width);
            assert!(widest(&text) <= width, "{width}:\n{text}");
            for word in long.split(' ') {
                assert!(text.contains(word), "{width}: {word}\n{text}");
            }
        }
    }

    #[test]
    fn headings_of_numbers_break_before_numbers_do() {
        let text = fitted(&["point", "band of values"], &rows(&[&["motor", "26.9 to 34.8"]]), 21);
        assert_eq!(text, "              band of\n  point        values\n  -------------------\n  motor  26.9 to 34.8\n");
    }

    #[test]
    fn columns_that_have_no_room_follow_below() {
        let cells: Vec<String> = std::iter::once("surface".to_string()).chain((1..=9).map(|i| format!("0.0000{i}"))).collect();
        let heading: Vec<&str> = ["enclosure", "to 1", "to 2", "to 3", "to 4", "to 5", "to 6", "to 7", "to 8", "to 9"].into();
        let text = fitted(&heading, &[cells], 40);
        assert!(widest(&text) <= 40, "{text}");
        assert_eq!(text.matches("surface").count(), text.matches("enclosure").count());
        assert!((1..=9).all(|i| text.contains(&format!("0.0000{i}"))) && text.matches("surface").count() > 1, "{text}");
    }

    #[test]
    fn long_keys_break_behind_a_mark() {
        assert_eq!(cell_lines("channel.reducer_plate.serpentine", 24), ["channel.reducer_plate.", "serpentine"]);
        assert_eq!(cell_lines("abcdefgh", 3), ["abc", "def", "gh"]);
    }

    #[test]
    fn paragraphs_keep_their_indent_and_rows_of_tables_their_line() {
        assert_eq!(folded("  one two three\n  a   b   c   d\n", 9), "  one two\n  three\n  a   b   c   d\n");
        assert_eq!(folded("wrote /a/long/path/without/spaces", 10), "wrote\n/a/long/path/without/spaces\n");
    }
}
