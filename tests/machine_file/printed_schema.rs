//! The schema as it is printed in the documentation; `scripts/check-schema` tries what editors read.

use coldplate_describe::machine::SCHEMA;

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
