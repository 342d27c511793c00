//! `coldplate info`: what is in a file of any kind.

use super::*;

fn info(path: &Path) -> Value {
    json(&coldplate(&["info", path.to_str().unwrap(), "--json"]))
}

fn text(path: &Path) -> String {
    let output = coldplate(&["info", path.to_str().unwrap()]);
    assert_eq!(status(&output), 0, "{}", message(&output));
    String::from_utf8(output.stdout).unwrap()
}

#[test]
fn surrogates_say_what_they_are_for() {
    let path = root().join("crates/runtime/fixtures/held.cps");
    let found = info(&path);
    assert_eq!((&found["kind"], &found["version"]), (&Value::from("surrogate"), &Value::from(2)));
    assert_eq!(found["variables"][0], serde_json::json!({ "name": "coolant_flow", "unit": "L/min", "low": 2.0, "high": 12.0 }));
    assert_eq!(found["held"][0], serde_json::json!({ "name": "motor_speed", "unit": "rpm", "value": 2500.0 }));
    assert_eq!(
        (&found["points"][0]["half_width"], &found["limits"][1]["of"]),
        (&Value::from(0.0625), &Value::from("motor over ambient_temperature"))
    );
    assert_eq!((found["limits"][1]["maximum"].as_f64(), &found["limits"][1]["unit"]), (Some(6.0), &Value::from("K")));
    let shown = text(&path);
    for needle in ["motor_speed  2500  rpm", "polynomial, degree 2", "0.062", "made by: tests/surrogate/examples.rs"] {
        assert!(shown.contains(needle), "{needle}: {shown}");
    }
}

#[test]
fn machines_and_sweeps_say_what_they_have() {
    let machine = root().join("machines/slab.toml");
    let found = info(&machine);
    assert_eq!((&found["kind"], &found["sensors"]), (&Value::from("machine"), &serde_json::json!(["block", "plate", "outlet"])));
    assert_eq!((&found["variables"][2]["name"], &found["variables"][2]["used"]), (&Value::from("motor_speed"), &Value::from(true)));
    assert!(text(&machine).contains("1 circuits: water"));
    let found = info(&root().join("sweeps/five_axis.toml"));
    assert_eq!((&found["kind"], found["groups"].as_array().map(Vec::len)), (&Value::from("sweep"), Some(9)));
    assert_eq!((found["variables"][2]["low"].as_f64(), found["variables"][2]["high"].as_f64()), (Some(250.0), Some(2500.0)));
}

#[test]
fn journals_and_tables_say_how_far_they_are() {
    let folder = scratch("info");
    std::fs::create_dir_all(&folder).unwrap();
    let machine = root().join("machines/slab.toml");
    let sweep = format!(
        "name = \"s\"\nmachine = {machine:?}\ncells = 300\n[design]\nkind = \"sobol\"\nruns = 4\n[range]\nmotor_speed = [\"500 rpm\", \"2000 rpm\"]\n\
         [hold]\ncoolant_flow = \"2 L/min\"\ncoolant_temperature = \"20 degC\"\nambient_temperature = \"23 degC\"\n"
    );
    std::fs::write(folder.join("s.toml"), sweep).unwrap();
    let out = folder.join("out");
    let output = coldplate(&["sweep", folder.join("s.toml").to_str().unwrap(), "--out", out.to_str().unwrap()]);
    assert_eq!(status(&output), 0, "{}", message(&output));
    let journal = info(&out.join("sweep.journal"));
    assert_eq!(
        (&journal["kind"], &journal["conditions"], &journal["solved"], &journal["failed"]),
        (&Value::from("journal"), &4.into(), &4.into(), &0.into())
    );
    assert_eq!(journal["damaged_lines"], serde_json::json!([]));
    for name in ["sweep.csv", "sweep.parquet"] {
        let table = info(&out.join(name));
        assert_eq!(
            (&table["kind"], &table["rows"], table["conditions"].as_array().map(Vec::len)),
            (&Value::from("table"), &4.into(), Some(4))
        );
        assert_eq!((table["conditions"][2]["low"].as_f64(), &table["texts"]), (Some(500.0), &serde_json::json!(["group"])));
    }
    for (wrong, needle) in
        [("README.md", "its name does not say"), ("machines", "this is a folder"), ("charts/slices.toml", "defines a chart")]
    {
        let output = coldplate(&["info", root().join(wrong).to_str().unwrap()]);
        assert_eq!(status(&output), 2);
        assert!(message(&output).contains(needle), "{}", message(&output));
    }
}
