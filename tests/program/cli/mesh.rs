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

/// Cells that follow an accuracy stand with what they leave open, and exclude a number of cells.
#[test]
fn cells_follow_an_accuracy() {
    let solve = [&["solve", "machines/slab.toml", "--accuracy", "0.05 K"], &CONDITION[..]].concat();
    let shown = coldplate(&solve);
    let text = String::from_utf8_lossy(&shown.stdout).into_owned();
    assert!(status(&shown) == 0 && text.contains("chosen to leave less than 0.0500 K open"), "{text}{}", message(&shown));
    let found = json(&coldplate(&[&solve[..], &["--json"]].concat()));
    let chosen = &found["chosen_cells"];
    for name in found["sensors"].as_object().unwrap().keys() {
        assert!(chosen["errors_K"][name].as_f64().unwrap() <= 0.05, "{name}: {chosen}");
    }
    assert!(
        chosen["accuracy_K"] == 0.05 && chosen["checked_on"].as_u64() > chosen["cells"].as_u64() && found["mesh"].is_null(),
        "{chosen}"
    );

    // The key of the file is the same, and a number of cells by the caller comes before it.
    let set = ["--set", "mesh.accuracy=0.05 K"];
    let by_key = json(&coldplate(&[&["solve", "machines/slab.toml", "--json"], &set[..], &CONDITION[..]].concat()));
    assert!(by_key["sensors"] == found["sensors"] && by_key["chosen_cells"] == *chosen, "{by_key}");
    let stated = json(&coldplate(&[&["solve", "machines/slab.toml", "--json", "--cells", "500"], &set[..], &CONDITION[..]].concat()));
    assert!(stated["chosen_cells"].is_null() && stated["mesh"].is_object(), "{stated}");

    let check = coldplate(&[&["check", "machines/slab.toml", "--accuracy", "0.05 K"], &CONDITION[..]].concat());
    let text = String::from_utf8_lossy(&check.stdout).into_owned();
    assert!(status(&check) == 0 && text.contains("what the mesh leaves open"), "{text}{}", message(&check));
    let both = coldplate(&[&solve[..], &["--cells", "300"]].concat());
    assert!(status(&both) == 2 && message(&both).contains("--cells") && message(&both).contains("--accuracy"), "{}", message(&both));
    let imported = coldplate(&[&["solve", "machines/bracket.toml", "--accuracy", "0.05 K"], &CONDITION[..]].concat());
    assert!(status(&imported) == 2 && message(&imported).contains("brings its own elements"), "{}", message(&imported));
}
