//! The strict reader: places, remedies, `--set`, assumptions.

use coldplate_base::document::Document;
use coldplate_base::units::Dimension;

fn parse(text: &str) -> Document {
    Document::parse(text, "rig.toml").unwrap()
}

#[test]
fn errors_name_file_line_key_value_and_remedy() {
    let file = parse("[contact.motor]\nbetween = ['a', 'b']\nconductance = '560 W/m2'\n");
    let root = file.root();
    let contact = root.sections("contact").unwrap().remove(0).1;
    let message = contact.quantity("conductance", Dimension::FILM).unwrap_err().to_string();
    for needle in ["rig.toml:3", "contact.motor.conductance", "560 W/m2", "W/(m2 K)"] {
        assert!(message.contains(needle), "{message}");
    }
}

#[test]
fn unknown_keys_are_errors_with_a_suggestion() {
    let file = parse("[contact.motor]\n\nconductanse = '560 W/(m2 K)'\n");
    let root = file.root();
    let contact = root.sections("contact").unwrap().remove(0).1;
    assert_eq!(contact.opt_quantity("conductance", Dimension::FILM).unwrap(), None);
    let message = contact.finish().unwrap_err().to_string();
    for needle in ["unknown key 'conductanse'", "rig.toml:3", "did you mean 'conductance'"] {
        assert!(message.contains(needle), "{message}");
    }
    root.finish().unwrap();
}

#[test]
fn wrong_kinds_are_named() {
    let file = parse("a = 1\nb = 'x'\nc = [1, 2]\nd = nan\ne = inf\nf = 1e999999\ng = 2020-01-01\nh = -3\n");
    let root = file.root();
    let message = |result: coldplate_base::error::Result<f64>| result.unwrap_err().to_string();
    assert!(message(root.quantity("a", Dimension::LENGTH)).contains("bare number"));
    assert!(message(root.quantity("c", Dimension::LENGTH)).contains("this is a list"));
    for key in ["b", "d", "e", "f", "g"] {
        let message = message(root.number(key));
        assert!(message.contains("rig.toml:") && message.contains("help"), "{message}");
    }
    assert!(root.positive("h", Dimension::NUMBER).unwrap_err().to_string().contains("larger than zero"));
    assert!(root.integer("h", 1).is_err() && root.integer("b", 1).is_err() && root.flag("a").is_err() && root.text("a").is_err());
    assert!(root.triple("c", Dimension::NUMBER).unwrap_err().to_string().contains("3 entries are wanted here, not 2"));
    assert!(root.section("a").unwrap_err().to_string().contains("a table is wanted here"));
}

#[test]
fn broken_toml_has_a_line_and_a_remedy() {
    for (text, line, needle) in
        [("a = 1\na = 2\n", 2, "once only"), ("x = 1\ny = 9 L/min\n", 2, "quotes"), ("[a]\n\n[a]\n", 3, "once only")]
    {
        let message = Document::parse(text, "bad.toml").unwrap_err().to_string();
        assert!(message.contains(&format!("bad.toml:{line}")) && message.contains(needle), "{message}");
    }
}

#[test]
fn tables_keep_the_order_of_the_file() {
    let file = parse("[part.z]\n[part.a]\n[part.m]\nx = { q = 1, b = 2 }\n");
    let names: Vec<String> = file.root().sections("part").unwrap().into_iter().map(|(name, _)| name).collect();
    assert_eq!(names, ["z", "a", "m"]);
}

#[test]
fn set_changes_adds_and_refuses() {
    let text = "[part.'motor plate']\nat = ['0 m', '1 m', '2 m']\nblocks = [{ x = 1 }, { x = 2 }]\n";
    let mut file = parse(text);
    let before = file.hash();
    file.apply_set("part.motor plate.at[2]", "5 mm").unwrap();
    file.apply_set("part.'motor plate'.blocks[2].x", "7").unwrap();
    file.apply_set("part.motor plate.extra", "true").unwrap();
    file.apply_set("mesh.cells", "100").unwrap();
    file.apply_set("name", "2").unwrap();
    assert_ne!(file.hash(), before);
    {
        let root = file.root();
        let part = root.sections("part").unwrap().remove(0).1;
        assert_eq!(part.triple("at", Dimension::LENGTH).unwrap(), [0.0, 5e-3, 2.0]);
        assert_eq!(part.tables("blocks").unwrap()[1].integer("x", 1).unwrap(), 7);
        assert_eq!(root.text("name").unwrap(), "2");
        assert_eq!(root.section("mesh").unwrap().integer("cells", 1).unwrap(), 100);
        let message = part.finish().unwrap_err().to_string();
        assert!(message.contains("--set part.\"motor plate\".extra"), "{message}");
    }
    for (key, needle) in [
        ("part.motor plte.at", "did you mean 'motor plate'"),
        ("prt.motor plate.at", "did you mean 'part'"),
        ("part.motor plate.at[4]", "it has 3"),
        ("part.motor plate.at[0]", "it has 3"),
        ("part.motor plate.at.x", "is a list"),
        ("part..at", "not a key"),
        ("", "not a key"),
        ("part.\"é", "not a key"),
    ] {
        let message = file.apply_set(key, "1").unwrap_err().to_string();
        assert!(message.contains(needle), "{key}: {message}");
    }
    // A value cannot smuggle further keys in: it stays one text.
    file.apply_set("name", "1\nother = 2").unwrap();
    assert_eq!(file.root().text("name").unwrap(), "1\nother = 2");
}

/// The digest is the one GNU `sha256sum` prints for these six bytes.
#[test]
fn the_hash_is_sha256_of_the_text() {
    assert_eq!(parse("a = 1\n").hash(), "cb78bd8a17f7b751fe0d4663366dcbc257204033ef7ddd64b1f2969573b5b2e2");
}

#[test]
fn assumptions_are_collected_with_value_and_reason() {
    let file = parse(
        "[part.bed]\nk = '16 W/(m K)'\nsurface = { emissivity = 0.5 }\nassumed = { k = 'catalogue', 'surface.emissivity' = 'guess' }\n\
         [contact.a]\nh = 1\nassumed = 'all of it'\n",
    );
    let found: Vec<_> = file.assumptions().unwrap().into_iter().map(|a| (a.key, a.value, a.reason)).collect();
    let own = |a: &str, b: &str, c: &str| (a.to_string(), b.to_string(), c.to_string());
    assert_eq!(
        found,
        [
            own("part.bed.k", "\"16 W/(m K)\"", "catalogue"),
            own("part.bed.surface.emissivity", "0.5", "guess"),
            own("contact.a", "{ h = 1 }", "all of it")
        ]
    );
    for (text, needle) in [("[a]\nx = 1\nassumed = { xx = 'why' }", "Known here: x"), ("assumed = 3", "reason")] {
        let message = parse(text).assumptions().unwrap_err().to_string();
        assert!(message.contains(needle), "{message}");
    }
}
