//! The header is written by hand, for its order and its words; what it declares must be what the library has.

use std::collections::BTreeSet;

use super::own;

/// Names in the header of types that the library has under others.
const NAMES: [(&str, &str); 7] = [
    ("Handle", "coldplate_surrogate"),
    ("Text", "coldplate_text"),
    ("Entry", "coldplate_entry"),
    ("BandRecord", "coldplate_band"),
    ("LimitRecord", "coldplate_limit_value"),
    ("VerdictRecord", "coldplate_verdict"),
    ("StateRecord", "coldplate_state"),
];

/// Functions and structures of a header, without comments and without names of parameters.
fn declared(header: &str) -> BTreeSet<String> {
    let mut text = String::new();
    let mut rest = header;
    while let Some((before, comment)) = rest.split_once("/*") {
        text += before;
        rest = comment.split_once("*/").map_or("", |(_, after)| after);
    }
    text += rest;
    let lines: Vec<&str> = text.lines().filter(|line| !line.trim_start().starts_with(['#', '}']) || line.contains(';')).collect();
    let flat =
        lines.join(" ").replace("extern \"C\" {", "").replace('*', " * ").replace("struct coldplate_surrogate ", "coldplate_surrogate ");
    let words = |text: &str| text.split_whitespace().collect::<Vec<_>>().join(" ");
    let mut found = BTreeSet::new();
    let mut open = flat.as_str();
    while let Some((head, after)) = open.split_once(';') {
        if let Some((_, fields)) = head.split_once('{') {
            // A structure goes on to the bracket that closes it.
            let whole = format!("{fields};{after}");
            let (fields, tail) = whole.split_once('}').expect("every structure ends");
            let (name, _) = tail.split_once(';').expect("every structure has a name");
            found.insert(words(&format!("{name} {{ {fields} }}")));
            open = &open[open.find('}').expect("every structure ends")..];
            open = open.split_once(';').map_or("", |(_, after)| after);
            continue;
        }
        if let Some((what, parameters)) = head.split_once('(') {
            let kind = |parameter: &str| {
                let parameter = words(parameter);
                parameter.rsplit_once(' ').filter(|(_, last)| *last != "*").map_or(parameter.clone(), |(kind, _)| kind.to_string())
            };
            let kinds: Vec<String> = parameters.trim_end().trim_end_matches(')').split(',').map(kind).collect();
            found.insert(words(&format!("{what} ({})", kinds.join(", "))));
        }
        open = after;
    }
    found
}

#[test]
fn it_declares_what_the_library_has() {
    let mut config = cbindgen::Config { language: cbindgen::Language::C, usize_is_size_t: true, ..cbindgen::Config::default() };
    config.style = cbindgen::Style::Type;
    config.export.rename = NAMES.iter().map(|(own, name)| (own.to_string(), name.to_string())).collect();
    let mut generated = Vec::new();
    let bindings = cbindgen::Builder::new().with_crate(own()).with_config(config).generate().expect("the crate can be read");
    bindings.write(&mut generated);
    let generated = String::from_utf8(generated).expect("text").replace("[NUMBERS]", "[33]");
    let written = std::fs::read_to_string(own().join("include/coldplate.h")).expect("the header is there");
    let (ours, theirs) = (declared(&written), declared(&generated));
    assert!(ours.len() > 20, "{ours:#?}");
    let (missing, gone): (Vec<_>, Vec<_>) = (theirs.difference(&ours).collect(), ours.difference(&theirs).collect());
    assert!(missing.is_empty() && gone.is_empty(), "in the library, not in the header: {missing:#?}\nin the header alone: {gone:#?}");
}
