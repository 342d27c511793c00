//! Settings of the page, in Chromium and Firefox: a link that brings it back, steps back and forth, other units, and a table of it.

use std::net::TcpListener;
use std::path::Path;

use coldplate_export::{Target, export};
use coldplate_runtime::{NINETY_FIVE, Surrogate};

use crate::browser::{browsers, told};
use crate::{assessment, folder};

/// Script that the browser runs. Changes count as made after a rest.
const ACTS: &str = r##"
<script>
(async () => {
  const told = [];
  const tell = (key, value) => told.push(`${key}: ${String(value).replace(/\s+/g, " ").trim()}`);
  const byId = (id) => document.getElementById(id);
  const rest = () => new Promise((done) => setTimeout(done, 600));
  const set = (k, value) => { byId(`slider${k}`).value = value; byId(`slider${k}`).dispatchEvent(new Event("input", { bubbles: true })); };
  const all = () => [0, 1, 2].map((k) => byId(`slider${k}`).value).join(" ");
  const choose = (id, value) => { byId(id).value = value; byId(id).dispatchEvent(new Event("change", { bubbles: true })); };
  try {
    await rest();
    tell("plain", location.hash === "" && byId("undo").disabled && byId("redo").disabled);
    set(0, 4);
    await rest();
    byId("keep").click();
    await rest();
    const link = location.hash;
    tell("link", link);
    set(1, 24);
    choose("units", "us");
    await rest();
    tell("label", byId("variables").querySelector("label").textContent);
    tell("number", document.querySelectorAll(".variable input[type=number]")[1].value);
    tell("motor", [...byId("points").rows[1].cells].map((cell) => cell.textContent).join(" | "));
    tell("limits", [...byId("limits").rows].slice(1).map((row) => row.cells[2].textContent).join(" | "));
    const number = document.querySelectorAll(".variable input[type=number]")[1];
    number.value = "68";
    number.dispatchEvent(new Event("change", { bubbles: true }));
    tell("typed", byId("slider1").value);
    await rest();
    byId("undo").click();
    tell("back", `${all()} ${byId("units").value}`);
    byId("undo").click();
    tell("further back", `${all()} ${byId("units").value} ${byId("kept").textContent}`);
    document.dispatchEvent(new KeyboardEvent("keydown", { key: "z", ctrlKey: true, bubbles: true, cancelable: true }));
    tell("by key", `${all()} ${byId("kept").textContent === ""}`);
    for (let k = 0; k < 5; k += 1) byId("redo").click();
    tell("forth", `${all()} ${byId("units").value} ${byId("redo").disabled}`);
    location.hash = link;
    await rest();
    tell("linked", `${all()} ${byId("units").value} ${byId("compared").rows[0].cells.length}`);
    location.hash = "#at.coolant_flow=nonsense&at.coolant_temperature=21&units=none&kept=1&kept=x+y+z&free=99";
    await rest();
    tell("nonsense", `${all()} ${byId("units").value} ${byId("free").value} ${byId("compared-whole").hidden} ${byId("failed").hidden}`);
    set(1, 20);
    byId("keep").click();
    set(0, 10);
    const made = URL.createObjectURL;
    let table = null;
    URL.createObjectURL = (blob) => { table = blob; return "#"; };
    byId("csv").click();
    URL.createObjectURL = made;
    for (const line of (await table.text()).trim().split("\n")) tell("csv", line);
  } catch (error) { tell("error", `${error} ${error.stack}`); }
  location = `http://ADDRESS/?${encodeURIComponent(told.join("\n"))}`;
})();
</script>
"##;

#[test]
fn what_is_set_is_in_the_link_and_can_be_undone() {
    let folder = folder("linked");
    let bytes = std::fs::read(Path::new(env!("CARGO_MANIFEST_DIR")).join("../runtime/fixtures/uncertain.cps")).expect("it is there");
    let surrogate = Surrogate::open(&bytes).expect("the fixtures are intact");
    let file = export(&surrogate, Target::Html, "linked").expect("the name is one").swap_remove(0);
    let page = String::from_utf8(file.content).expect("a page is text");
    let points = surrogate.point_count();
    for (program, arguments) in browsers(&folder) {
        let listener = TcpListener::bind("127.0.0.1:0").expect("a port is free");
        let address = listener.local_addr().expect("it has one").to_string();
        let path = folder.join(format!("{program}.html"));
        std::fs::write(&path, page.replace("</body>", &format!("{}</body>", ACTS.replace("ADDRESS", &address))))
            .expect("it can be written");
        std::fs::create_dir_all(folder.join("firefox")).expect("the folder can be written to");
        let told = told(program, &arguments, &path, &listener);
        let of = |key: &str| told.iter().filter_map(|line| line.strip_prefix(&format!("{key}: "))).map(String::from).collect::<Vec<_>>();
        let one = |key: &str| of(key).first().cloned().unwrap_or_else(|| panic!("{program}: no {key} in {told:#?}"));
        assert_eq!(of("error"), Vec::<String>::new(), "{program}");
        assert_eq!(one("plain"), "true", "{program}");
        for part in ["at.coolant_flow=4&", "at.coolant_temperature=20&", "confidence=0.95&", "units=file", "kept=4+20+22"] {
            assert!(one("link").contains(part), "{program}: {part}: {}", one("link"));
        }
        // A gallon has 3.785411784 L. 24 degC are 75.2 degF; a limit of 28 degC is 82.4 degF, one of 6 K between is 10.8.
        assert_eq!(one("label"), "coolant flow [gpm], 0.52834 to 3.1701", "{program}");
        assert_eq!(one("number"), "75.2", "{program}");
        assert_eq!(one("limits"), "82.4 | 10.8 | 9 | 9.9", "{program}");
        let found = assessment(&surrogate, &[4.0, 24.0, 22.0]);
        let half = 1.8 * NINETY_FIVE * found[points + 3];
        let digits = (1.0 - half.log10().floor()).clamp(0.0, 3.0) as usize;
        assert!(one("motor").starts_with(&format!("motor | {:.digits$} | ± ", 1.8 * found[0] + 32.0)), "{program}: {}", one("motor"));
        assert!(one("motor").ends_with("| °F"), "{program}: {}", one("motor"));
        assert!((one("typed").parse::<f64>().expect("a number") - 20.0).abs() < 1e-9, "{program}: {}", one("typed"));
        assert_eq!(one("back"), "4 24 22 us", "{program}");
        assert!(one("further back").starts_with("4 20 22 file Kept 1: coolant flow 4 L/min, "), "{program}: {}", one("further back"));
        assert_eq!(one("by key"), "4 20 22 true", "{program}");
        assert_eq!(one("forth"), "4 20 22 us true", "{program}");
        assert_eq!(one("linked"), "4 20 22 file 5", "{program}");
        assert_eq!(one("nonsense"), "4 21 22 file 0 true true", "{program}");
        let csv = of("csv");
        assert!(csv[0].starts_with(
            "test,coolant_flow [L/min],coolant_temperature [degC],ambient_temperature [degC],motor [degC],motor low,motor high,"
        ));
        assert!(csv[0].ends_with(",probability,verdict,binding,in_domain"), "{program}: {}", csv[0]);
        assert_eq!(csv.len(), 3, "{program}: {csv:#?}");
        for (line, name, x) in [(&csv[1], "set now", [10.0, 20.0, 22.0]), (&csv[2], "kept 1", [4.0, 20.0, 22.0])] {
            let cells: Vec<&str> = line.split(',').collect();
            assert_eq!(cells[0], name, "{program}");
            let found = assessment(&surrogate, &x);
            let numbers: Vec<f64> = cells[1..10].iter().map(|cell| cell.parse().expect("a number")).collect();
            let half = NINETY_FIVE * found[points + 3];
            for (a, b) in numbers.iter().zip(x.into_iter().chain([found[0], found[0] - half, found[0] + half, found[1]])) {
                assert!((a - b).abs() < 1e-9 * b.abs(), "{program}: {line}");
            }
        }
    }
    let _ = std::fs::remove_dir_all(&folder);
}
