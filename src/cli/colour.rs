//! Colours of verdicts and messages: lines that begin with certain words.

use clap::builder::styling::{AnsiColor, Style};

const GOOD: Style = AnsiColor::Green.on_default().bold();
const BAD: Style = AnsiColor::Red.on_default().bold();
const DOUBT: Style = AnsiColor::Yellow.on_default().bold();
const PLACE: Style = AnsiColor::Cyan.on_default();

/// Words at the beginning of a line, with their style.
const WORDS: &[(&str, Style)] = &[
    ("error:", BAD),
    ("warning:", DOUBT),
    ("note:", PLACE),
    ("FAILED:", BAD),
    ("Acceptable", GOOD),
    ("Not acceptable", BAD),
    ("Uncertain", DOUBT),
    ("   at:", PLACE),
    (" read:", PLACE),
    (" help:", GOOD),
];

/// Text with colours on the words that begin its lines.
pub fn coloured(text: &str) -> String {
    let line = |line: &str| match WORDS.iter().find(|(word, _)| line.starts_with(word)) {
        Some((word, style)) => format!("{style}{word}{style:#}{}", &line[word.len()..]),
        None => line.to_string(),
    };
    text.split('\n').map(line).collect::<Vec<_>>().join("\n")
}

#[cfg(test)]
mod tests {
    use super::coloured;

    #[test]
    fn verdicts_and_messages_are_coloured_and_nothing_else() {
        let text = "Not acceptable: a limit\n  Acceptable inside a line\n help: try";
        let shown = coloured(text);
        assert!(shown.starts_with("\u{1b}[") && shown.contains("Not acceptable\u{1b}[0m: a limit"), "{shown:?}");
        assert_eq!(shown.lines().nth(1), text.lines().nth(1));
        // Without the codes, the text is as it was.
        let mut plain = String::new();
        for (at, part) in shown.split('\u{1b}').enumerate() {
            plain += if at == 0 { part } else { part.split_once('m').unwrap().1 };
        }
        assert_eq!(plain, text);
    }
}
