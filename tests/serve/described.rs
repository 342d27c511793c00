//! The description and the metrics, read by programs of others.

use std::path::PathBuf;
use std::process::Command;

use crate::{HELD, LARGE, Service, UNCERTAIN, root};

/// The Python that `scripts/clients` installs, where it has the packages.
fn python() -> Option<PathBuf> {
    let cache = std::env::var_os("XDG_CACHE_HOME").map(PathBuf::from);
    let cache = cache.or_else(|| Some(PathBuf::from(std::env::var_os("HOME")?).join(".cache")))?;
    let python = cache.join("coldplate/clients/bin/python3");
    let has = Command::new(&python).args(["-c", "import jsonschema, openapi_spec_validator, prometheus_client"]).output();
    has.is_ok_and(|output| output.status.success()).then_some(python)
}

#[test]
fn the_description_is_valid_and_true() {
    let Some(python) = python() else {
        println!("skipped: openapi-spec-validator or prometheus-client is not there: scripts/clients installs them");
        return;
    };
    let service = Service::start(&[UNCERTAIN, HELD, LARGE]);
    let checked = Command::new(python).arg(root().join("tests/serve/described.py")).arg(&service.address).output().unwrap();
    let text = String::from_utf8_lossy(&checked.stdout);
    assert!(checked.status.success(), "{text}{}", String::from_utf8_lossy(&checked.stderr));
    assert!(text.ends_with("valid\n"), "{text}");
}
