//! Modules and the modules they use, read from source text: enough of Rust for `use` trees and plain paths. The tests of this
//! crate hold the shape of the workspace.

#![forbid(unsafe_code)]
#![warn(missing_docs)]

use std::collections::BTreeSet;
use std::path::Path;

/// A file of the library.
#[derive(Debug)]
pub struct SourceFile {
    /// Module path without the crate: `solve::steady`.
    pub module: String,
    /// Whether it is the `mod.rs` of a folder.
    pub is_folder: bool,
    /// Paths it uses, from the crate's root: `error::Error`.
    pub uses: BTreeSet<String>,
}

/// All files below `src`, unit tests left out.
pub fn sources(src: &Path) -> Vec<SourceFile> {
    let mut found = Vec::new();
    collect(src, &mut Vec::new(), &mut found);
    found
}

fn collect(folder: &Path, place: &mut Vec<String>, found: &mut Vec<SourceFile>) {
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_stem().unwrap().to_string_lossy().into_owned();
        if path.is_dir() {
            place.push(name);
            collect(&path, place, found);
            place.pop();
        } else if path.extension().is_some_and(|e| e == "rs") {
            let is_folder = name == "mod" || name == "lib" && place.is_empty();
            let mut module = place.clone();
            if !is_folder {
                module.push(name);
            }
            let text = std::fs::read_to_string(&path).unwrap();
            let uses = uses(&text, &module);
            found.push(SourceFile { module: module.join("::"), is_folder, uses });
        }
    }
}

/// Every path that begins with `crate`, `super` or `self`, from the crate's root.
pub fn uses(text: &str, module: &[String]) -> BTreeSet<String> {
    // Unit tests may reach further than the code they test.
    let text = text.split("#[cfg(test)]\nmod").next().unwrap_or("");
    let words = words(text);
    let mut found = BTreeSet::new();
    let mut i = 0;
    while i < words.len() {
        let begins = matches!(words[i].as_str(), "crate" | "super" | "self") && words.get(i + 1).is_some_and(|w| w == "::");
        let continues = i > 0 && words[i - 1] == "::";
        if begins && !continues {
            i = tree(&words, i, &mut Vec::new(), module, &mut found);
        } else {
            i += 1;
        }
    }
    found
}

/// Reads a path or `use` tree from word `i` on; the word after it.
fn tree(words: &[String], mut i: usize, above: &mut Vec<String>, module: &[String], found: &mut BTreeSet<String>) -> usize {
    let depth = above.len();
    while let Some(word) = words.get(i) {
        if word == "{" {
            i += 1;
            while words.get(i).is_some_and(|w| w != "}") {
                i = if words[i] == "," { i + 1 } else { tree(words, i, &mut above.clone(), module, found) };
            }
            above.truncate(depth);
            return i + 1;
        }
        if word == "*" || word.chars().next().is_some_and(|c| c.is_alphabetic() || c == '_') {
            above.push(word.clone());
            i += 1;
        }
        if words.get(i).is_some_and(|w| w == "::") {
            i += 1;
            // A turbofish ends the path.
            if words.get(i).is_some_and(|w| w == "<") {
                break;
            }
        } else {
            break;
        }
    }
    if let Some(path) = absolute(above, module) {
        found.insert(path);
    }
    if words.get(i).is_some_and(|w| w == "as") { i + 2 } else { i.max(1) }
}

fn absolute(path: &[String], module: &[String]) -> Option<String> {
    let mut place: Vec<&str> = module.iter().map(String::as_str).collect();
    let mut rest = path;
    match path.first()?.as_str() {
        "crate" => {
            place.clear();
            rest = &path[1..];
        }
        "self" => rest = &path[1..],
        _ => {
            while rest.first().is_some_and(|w| w == "super") {
                place.pop()?;
                rest = &rest[1..];
            }
        }
    }
    place.extend(rest.iter().map(String::as_str).filter(|w| *w != "self"));
    Some(place.join("::"))
}

/// Names, `::` and single characters; comments, texts and characters left out.
fn words(text: &str) -> Vec<String> {
    let chars: Vec<char> = text.chars().collect();
    let mut words = Vec::new();
    let mut i = 0;
    while i < chars.len() {
        let two = (chars[i], chars.get(i + 1).copied().unwrap_or(' '));
        match two {
            ('/', '/') => i = ahead(&chars, i, |c| c == '\n'),
            ('/', '*') => {
                i += 2;
                while i + 1 < chars.len() && (chars[i], chars[i + 1]) != ('*', '/') {
                    i += 1;
                }
                i += 2;
            }
            ('"', _) => {
                i += 1;
                while i < chars.len() && chars[i] != '"' {
                    i += if chars[i] == '\\' { 2 } else { 1 };
                }
                i += 1;
            }
            ('\'', _) if chars.get(i + 2) == Some(&'\'') => i += 3,
            ('\'', '\\') => i = ahead(&chars, i + 2, |c| c == '\'') + 1,
            (':', ':') => {
                words.push("::".into());
                i += 2;
            }
            (c, _) if c.is_alphanumeric() || c == '_' => {
                let end = ahead(&chars, i, |c| !(c.is_alphanumeric() || c == '_'));
                words.push(chars[i..end].iter().collect());
                i = end;
            }
            (c, _) => {
                if !c.is_whitespace() {
                    words.push(c.into());
                }
                i += 1;
            }
        }
    }
    words
}

fn ahead(chars: &[char], from: usize, stop: impl Fn(char) -> bool) -> usize {
    (from..chars.len()).find(|i| stop(chars[*i])).unwrap_or(chars.len())
}

#[test]
fn use_trees_over_several_lines_are_read() {
    let module = ["a".to_string(), "b".to_string()];
    let text = "use crate::{\n    error::{Error, Result},\n    units as u, // crate::no\n    x::{self, y::*},\n};\nuse super::c;\n\
                fn f() { let s = \"crate::text\"; crate::z::<f64>(); super::super::w::v() }";
    let expected = ["a::c", "error::Error", "error::Result", "units", "w::v", "x", "x::y::*", "z"];
    assert_eq!(uses(text, &module).into_iter().collect::<Vec<_>>(), expected);
}
