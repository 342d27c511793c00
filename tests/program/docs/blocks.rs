//! Blocks of a page with the commands that printed them.

/// What a page says a command prints.
#[derive(Debug, PartialEq)]
pub struct Block {
    /// Line of the page, from 1.
    pub line: usize,
    /// The command.
    pub command: String,
    /// What the page shows.
    pub shown: String,
    /// Whether this is a part of what is printed.
    pub is_part: bool,
}

/// Says of a page that all its commands are run, in their order: later ones need what earlier ones wrote.
const EVERY: &str = "<!-- every command is run -->";

/// All of them.
pub fn of(page: &str) -> Vec<Block> {
    let every = page.contains(EVERY);
    let mut found = Vec::new();
    let mut named: Option<(String, bool)> = None;
    let mut fence: Option<(usize, String, Vec<&str>)> = None;
    for (at, line) in page.lines().enumerate() {
        if let Some((start, language, mut inside)) = fence.take() {
            if !line.starts_with("```") {
                inside.push(line);
                fence = Some((start, language, inside));
            } else if let Some((command, is_part)) = named.take() {
                found.push(Block { line: start, command, shown: inside.join("\n"), is_part });
            } else if language == "console" {
                console(start, &inside, every, &mut found);
            }
        } else if let Some(language) = line.strip_prefix("```") {
            fence = Some((at + 1, language.trim().to_string(), Vec::new()));
        } else if let Some(comment) = line.trim().strip_prefix("<!-- prints") {
            let comment = comment.trim_end_matches("-->").trim();
            let (rest, is_part) = comment.strip_prefix("part of").map_or((comment, false), |rest| (rest, true));
            named = Some((rest.trim_start_matches(':').trim().to_string(), is_part));
        }
    }
    found
}

/// Commands behind `$ `, continued behind a `\`, each with the lines below it.
fn console(start: usize, lines: &[&str], every: bool, found: &mut Vec<Block>) {
    let mut i = 0;
    while i < lines.len() {
        let Some(first) = lines[i].strip_prefix("$ ") else {
            i += 1;
            continue;
        };
        let (line, mut command) = (start + i + 1, first.to_string());
        while command.ends_with('\\') && i + 1 < lines.len() {
            i += 1;
            command = format!("{} {}", command.trim_end_matches('\\').trim_end(), lines[i].trim());
        }
        let below: Vec<&str> = lines[i + 1..].iter().take_while(|l| !l.starts_with("$ ")).copied().collect();
        i += 1 + below.len();
        let cheap = ["coldplate solve ", "coldplate check "].iter().any(|c| command.starts_with(c));
        if every || cheap && below.iter().any(|l| !l.trim().is_empty()) {
            found.push(Block { line, command, shown: below.join("\n"), is_part: false });
        }
    }
}

/// The words of a command; quotation marks keep spaces.
pub fn words(command: &str) -> Vec<String> {
    let (mut words, mut word, mut quote) = (Vec::new(), None::<String>, None);
    for c in command.chars() {
        match (quote, c) {
            (None, '"' | '\'') => {
                quote = Some(c);
                word.get_or_insert_default();
            }
            (Some(q), c) if c == q => quote = None,
            (None, c) if c.is_whitespace() => words.extend(word.take()),
            (_, c) => word.get_or_insert_default().push(c),
        }
    }
    words.extend(word);
    words
}

#[test]
fn words_keep_what_is_quoted() {
    assert_eq!(words("a --b \"c d\" 'e f'=g"), ["a", "--b", "c d", "e f=g"]);
}

#[test]
fn blocks_are_found_with_their_commands() {
    let page = "<!-- prints: coldplate solve a -->\n\n```text\nx\n```\n```console\n$ coldplate check b \\\n   c\n1\n```\n";
    let found = of(page);
    assert_eq!((found[0].command.as_str(), found[0].shown.as_str()), ("coldplate solve a", "x"));
    assert_eq!((found[1].command.as_str(), found[1].shown.as_str()), ("coldplate check b c", "1"));
}
