//! The description and the metrics, read by programs of others.

use std::process::Command;

use crate::common::python;
use crate::serve::{HELD, LARGE, Service, UNCERTAIN, root};

#[test]
fn the_description_is_valid_and_true() {
    let Some(python) = python("jsonschema, openapi_spec_validator, prometheus_client") else {
        println!("skipped: openapi-spec-validator or prometheus-client is not there: scripts/clients installs them");
        return;
    };
    let service = Service::start(&[UNCERTAIN, HELD, LARGE]);
    let checked = Command::new(python).arg(root().join("tests/program/serve/described.py")).arg(&service.address).output().unwrap();
    let text = String::from_utf8_lossy(&checked.stdout);
    assert!(checked.status.success(), "{text}{}", String::from_utf8_lossy(&checked.stderr));
    assert!(text.ends_with("valid\n"), "{text}");
}
