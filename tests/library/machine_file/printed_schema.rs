//! The schema as it is printed in the documentation; `scripts/check-schema` tries what editors read.

use coldplate_describe::machine::SCHEMA;

/// The tables in the documentation are those of the schema.
#[test]
fn documentation_lists_the_keys_of_the_schema() {
    let reference = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/reference");
    let mut text = String::new();
    for entry in std::fs::read_dir(reference).unwrap() {
        let page = entry.unwrap().path();
        if page.file_name().is_some_and(|name| name.to_string_lossy().starts_with("machine-file")) {
            let shown = std::fs::read_to_string(&page).unwrap();
            let fresh = SCHEMA.fill(&shown).unwrap();
            assert!(fresh == shown, "{0} is stale: run `coldplate schema --update {0}`", page.display());
            text += &shown;
        }
    }
    for table in SCHEMA.tables() {
        let known_elsewhere = ["define.*", "surfaces", "contacts", "part.*.cylinder", "part.*.sphere"];
        let is_repeated = table.starts_with("part.*.blocks") || table.starts_with("contacts.default");
        let is_listed = text.contains(&format!("<!-- keys: {table} -->"));
        assert!(is_listed || is_repeated || known_elsewhere.contains(&table.as_str()), "{table} is not in the documentation");
    }
}
