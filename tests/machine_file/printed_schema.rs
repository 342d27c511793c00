//! The schema as it is printed: for editors, and in the documentation.

use coldplate::describe::machine::SCHEMA;

use super::schema::PLATE;

/// Every machine that ships satisfies the JSON Schema, as do the files of these tests; wrong ones do not.
#[test]
fn json_schema_accepts_machines_and_refuses_mistakes() {
    let schema = jsonschema::draft202012::new(&SCHEMA.to_json_schema()).unwrap();
    let complaints = |text: &str| -> Vec<String> {
        let file: serde_json::Value = toml::from_str(text).unwrap();
        schema.iter_errors(&file).map(|error| format!("{} at {}", error, error.instance_path())).collect()
    };
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("machines");
    let mut files: Vec<_> = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    files.retain(|path| path.extension().is_some_and(|end| end == "toml"));
    assert!(files.len() >= 8, "{files:?}");
    for path in files {
        let found = complaints(&std::fs::read_to_string(&path).unwrap());
        assert!(found.is_empty(), "{}: {found:#?}", path.display());
    }
    for text in [PLATE, include_str!("full.toml")] {
        assert_eq!(complaints(text), Vec::<String>::new());
    }
    for (right, wrong) in [
        ("conductance =", "conductence ="),
        ("\"500 W/(m2 K)\"", "500"),
        ("\"500 W/(m2 K)\"", "\"500\""),
        ("conductance =", "bonded = true\nconductance ="),
        ("between = [\"motor.-z\", \"plate.+z\"]", "between = [\"motor.-z\"]"),
        ("power = \"10 W\"", ""),
        ("name = \"plate\"", "name = 3"),
        ("on = \"plate.+z\"", "on = \"plate.+z\"\nalign = \"center\""),
        ("box = [\"0.1 m\", \"0.1 m\", \"20 mm\"]", "box = [\"0.1 m\", \"0.1 m\"]"),
        ("[drive.y]", "[mesh]\ncells = 0\n[drive.y]"),
        ("[chamber]", "[chamber]\npressure = \"low\""),
    ] {
        let text = PLATE.replacen(right, wrong, 1);
        assert_ne!(text, PLATE, "{right}");
        assert!(!complaints(&text).is_empty(), "{wrong} is accepted");
    }
}

/// The tables in the documentation are those of the schema.
#[test]
fn documentation_lists_the_keys_of_the_schema() {
    let page = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/machine-file.md");
    let text = std::fs::read_to_string(page).unwrap();
    let fresh = SCHEMA.fill(&text).unwrap();
    assert!(fresh == text, "docs/machine-file.md is stale: run `coldplate schema --update docs/machine-file.md`");
    for table in SCHEMA.tables() {
        let known_elsewhere = ["define.*", "surfaces", "contacts", "part.*.cylinder", "part.*.sphere"];
        let is_repeated = table.starts_with("part.*.blocks") || table.starts_with("contacts.default");
        let is_listed = text.contains(&format!("<!-- keys: {table} -->"));
        assert!(is_listed || is_repeated || known_elsewhere.contains(&table.as_str()), "{table} is not in the documentation");
    }
}
