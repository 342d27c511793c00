//! Shipped files, changed at random: each is read or refused with a place, and none causes a panic.

use std::path::Path;

use coldplate_base::random::Random;
use coldplate_describe::machine::Machine;
use coldplate_evidence::measurement::{Data, ReadingSettings};
use coldplate_tables::{Ledger, Table};

/// What a mistaken hand puts in the place of a number.
const NUMBERS: [&str; 12] = ["0", "-1", "1e400", "nan", "inf", "-0.0", "1e-320", "99999999999999999999", "1,5", "", "1/0", "2 *"];

fn pieces(text: &str, is_piece: impl Fn(char) -> bool) -> Vec<(usize, usize)> {
    let mut found = Vec::new();
    let mut start = None;
    for (at, letter) in text.char_indices().chain([(text.len(), '\n')]) {
        match (start, is_piece(letter)) {
            (None, true) => start = Some(at),
            (Some(from), false) => {
                found.push((from, at));
                start = None;
            }
            _ => {}
        }
    }
    found
}

fn pick<'a, T>(items: &'a [T], random: &mut Random) -> Option<&'a T> {
    (!items.is_empty()).then(|| &items[random.below(items.len())])
}

/// One change: a number, a word, a line, or a letter.
fn mutate(text: &str, random: &mut Random) -> String {
    let replaced = |(from, to): (usize, usize), with: &str| [&text[..from], with, &text[to..]].concat();
    let lines: Vec<&str> = text.lines().collect();
    match random.below(6) {
        0 => match pick(&pieces(text, |c| c.is_ascii_digit() || c == '.'), random) {
            Some(place) => replaced(*place, NUMBERS[random.below(NUMBERS.len())]),
            None => String::new(),
        },
        1 => {
            let words = pieces(text, |c| c.is_alphanumeric() || c == '_');
            match (pick(&words, random), pick(&words, random)) {
                (Some(place), Some(other)) => replaced(*place, &text[other.0..other.1]),
                _ => String::new(),
            }
        }
        2 => {
            let skipped = random.below(lines.len().max(1));
            lines.iter().enumerate().filter(|(n, _)| *n != skipped).map(|(_, l)| format!("{l}\n")).collect()
        }
        3 => {
            let (from, to) = (random.below(lines.len().max(1)), random.below(lines.len().max(1)));
            let mut moved = lines.clone();
            if let Some(line) = lines.get(from) {
                moved.insert(to, line);
            }
            moved.join("\n")
        }
        4 => {
            let letters: Vec<(usize, char)> = text.char_indices().collect();
            match pick(&letters, random) {
                Some((at, letter)) => replaced((*at, at + letter.len_utf8()), ["", "é", "\"", "=", "[", "\0"][random.below(6)]),
                None => String::new(),
            }
        }
        _ => {
            let ends: Vec<usize> = text.char_indices().map(|(at, _)| at).collect();
            pick(&ends, random).map_or(String::new(), |end| text[..*end].to_string())
        }
    }
}

#[test]
fn ten_thousand_changed_machines() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR"));
    let files: Vec<(std::path::PathBuf, String)> =
        ["machines/rig.toml", "machines/five_axis.toml", "tests/library/machine_file/full.toml", "examples/tutorial/machine.toml"]
            .iter()
            .map(|name| (folder.join(name), std::fs::read_to_string(folder.join(name)).unwrap()))
            .collect();
    let mut random = Random::new(20_261_122);
    let (mut read, mut refused) = (0, 0);
    for round in 0..10_000 {
        let (path, text) = &files[round % files.len()];
        let mut text = text.clone();
        for _ in 0..=random.below(2) {
            text = mutate(&text, &mut random);
        }
        match Machine::from_text(&text, path, &[]) {
            Ok(machine) => {
                read += 1;
                if let Ok(condition) = machine.condition(&[]) {
                    assert!(condition.si().iter().all(|v| v.is_finite()), "{text}");
                }
            }
            Err(error) => {
                refused += 1;
                let message = error.to_string();
                assert!(message.len() < 4000 && message.contains(".toml"), "{message}");
            }
        }
    }
    assert!(read > 500 && refused > 2000, "{read} read, {refused} refused");
}

#[test]
fn ten_thousand_changed_tables() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/tutorial");
    let machine = Machine::read(folder.join("machine.toml"), &[]).unwrap();
    let good = std::fs::read_to_string(folder.join("readings.csv")).unwrap();
    let mut random = Random::new(7);
    let (mut read, mut refused) = (0, 0);
    for _ in 0..10_000 {
        let mut text = good.clone();
        for _ in 0..=random.below(2) {
            text = mutate(&text, &mut random);
        }
        let outcome = Table::from_text(&text, "readings.csv".as_ref(), Ledger::default())
            .and_then(|(table, ledger)| Data::from_table(table, ledger, &ReadingSettings::default(), &machine, "readings.csv"));
        match outcome {
            Ok(data) => {
                read += 1;
                assert!(data.count() > 0);
            }
            Err(_) => refused += 1,
        }
    }
    assert!(read > 500 && refused > 2000, "{read} read, {refused} refused");
}
