//! What the mesh leaves open stands beside every reading, and a warning where that is more than is asked for.

use super::{CONDITION, coldplate, json, message, status};

#[test]
fn the_mesh_is_part_of_the_answer() {
    let solve = [&["solve", "machines/slab.toml", "--cells", "3000"], &CONDITION[..]].concat();
    let shown = coldplate(&solve);
    let text = String::from_utf8_lossy(&shown.stdout).into_owned();
    assert!(status(&shown) == 0 && text.contains("mesh K"), "{text}{}", message(&shown));

    let found = json(&coldplate(&[&solve[..], &["--json"]].concat()));
    let (sensors, mesh) = (found["sensors"].as_object().unwrap(), &found["mesh"]);
    for name in sensors.keys() {
        assert!(mesh["errors_K"][name].as_f64().unwrap() >= 0.0, "{name}: {mesh}");
    }
    assert!(mesh["cells"][0].as_u64().unwrap() < 600 && mesh["tolerance_K"] == 0.1, "{mesh}");

    let strict = coldplate(&[&solve[..], &["--mesh-tolerance", "0.0001 K"]].concat());
    assert!(status(&strict) == 0 && message(&strict).contains("--cells"), "{}", message(&strict));
    let lax = coldplate(&[&solve[..], &["--mesh-tolerance", "50 K"]].concat());
    assert!(!message(&lax).contains("mesh leaves"), "{}", message(&lax));

    let without = coldplate(&[&solve[..], &["--no-mesh-error", "--json"]].concat());
    assert!(json(&without)["mesh"].is_null(), "{}", json(&without));
    let imported = coldplate(&[&["solve", "machines/bracket.toml"], &CONDITION[..]].concat());
    assert!(message(&imported).contains("imported parts keep their elements"), "{}", message(&imported));
}
