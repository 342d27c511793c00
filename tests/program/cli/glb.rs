//! `coldplate export MACHINE --to glb`: judged by the validator of those who made the format, and read beside the solver's answers.

use super::*;

/// A file taken apart: its JSON, and its buffer.
struct Read {
    json: Value,
    buffer: Vec<u8>,
}

impl Read {
    fn file(path: &Path) -> Self {
        let bytes = std::fs::read(path).unwrap();
        let word = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap()) as usize;
        assert_eq!((&bytes[..4], word(4), word(8)), (&b"glTF"[..], 2, bytes.len()));
        let text = 20..20 + word(12);
        assert_eq!((&bytes[16..20], &bytes[text.end + 4..text.end + 8]), (&b"JSON"[..], &b"BIN\0"[..]));
        let buffer = bytes[text.end + 8..].to_vec();
        assert_eq!(word(text.end), buffer.len());
        Self { json: serde_json::from_slice(&bytes[text]).unwrap(), buffer }
    }

    /// A node of this name below another: a part has the machine above it, a channel or a sensor its list.
    fn node(&self, above: &str, name: &str) -> &Value {
        let nodes = self.json["nodes"].as_array().unwrap();
        let parent = nodes.iter().find(|node| node["name"] == above && node["children"].is_array()).unwrap();
        let mut children = parent["children"].as_array().unwrap().iter().map(|child| &nodes[child.as_u64().unwrap() as usize]);
        children.find(|node| node["name"] == name).unwrap_or_else(|| panic!("no '{name}' below '{above}'"))
    }

    /// Numbers of an attribute of the mesh of a node, element by element.
    fn attribute(&self, node: &Value, name: &str) -> Vec<Vec<f64>> {
        let index = |value: &Value| value.as_u64().unwrap() as usize;
        let mesh = &self.json["meshes"][index(&node["mesh"])];
        let accessor = &self.json["accessors"][index(&mesh["primitives"][0]["attributes"][name])];
        let view = &self.json["bufferViews"][index(&accessor["bufferView"])];
        let bytes = &self.buffer[index(&view["byteOffset"])..][..index(&view["byteLength"])];
        let numbers: Vec<f64> = match index(&accessor["componentType"]) {
            5126 => bytes.chunks(4).map(|b| f64::from(f32::from_le_bytes(b.try_into().unwrap()))).collect(),
            5123 => bytes.chunks(2).map(|b| f64::from(u16::from_le_bytes(b.try_into().unwrap())) / 65535.0).collect(),
            other => panic!("{other}"),
        };
        let size = match accessor["type"].as_str().unwrap() {
            "SCALAR" => 1,
            "VEC3" => 3,
            "VEC4" => 4,
            other => panic!("{other}"),
        };
        assert_eq!(numbers.len(), size * index(&accessor["count"]));
        numbers.chunks(size).map(<[f64]>::to_vec).collect()
    }
}

fn export(machine: &str, folder: &Path, more: &[&str]) -> Value {
    let output = coldplate(&[&["export", machine, "--to", "glb", "--out", folder.to_str().unwrap(), "--json"], more].concat());
    assert_eq!(status(&output), 0, "{machine}: {}", message(&output));
    json(&output)
}

/// Prints what the validator says of every file it is given, one JSON object a line.
const JUDGE: &str = r#"
const validator = require("gltf-validator");
(async () => {
  for (const path of process.argv.slice(2)) {
    const found = await validator.validateBytes(new Uint8Array(require("fs").readFileSync(path)));
    console.log(JSON.stringify({ issues: found.issues, info: found.info }));
  }
})();
"#;

#[test]
fn the_validator_of_the_format_finds_nothing() {
    let folder = scratch("glb");
    let machines = ["rig", "five_axis", "bracket", "column", "spindle"];
    for name in machines {
        export(&format!("machines/{name}.toml"), &folder, &[&["--cells", "2000"], &CONDITION[..]].concat());
    }
    let package =
        crate::common::cache().map(|cache| cache.join("coldplate/gltf-validator")).filter(|own| own.join("node_modules").is_dir());
    let Some(package) = package else {
        println!("skipped: gltf-validator is not there: scripts/clients installs it");
        return;
    };
    let judge = folder.join("judge.js");
    std::fs::write(&judge, JUDGE).unwrap();
    let files = machines.map(|name| folder.join(format!("{name}.glb")));
    let output = Command::new("node").env("NODE_PATH", package.join("node_modules")).arg(&judge).args(&files).output().unwrap();
    assert!(output.status.success(), "{}", message(&output));
    let text = String::from_utf8(output.stdout).unwrap();
    assert_eq!(text.lines().count(), machines.len(), "{text}");
    for (name, line) in machines.iter().zip(text.lines()) {
        let found: Value = serde_json::from_str(line).unwrap();
        let issues = &found["issues"];
        assert_eq!((&issues["numErrors"], &issues["numWarnings"]), (&0.into(), &0.into()), "{name}: {issues:#}");
        assert!(found["info"]["totalTriangleCount"].as_u64().unwrap() > 100, "{name}: {found:#}");
    }
}

/// A bar whose temperature rises evenly upwards, from 20 to 80 degC over 30 cm.
const BAR: &str = "name = \"bar\"\n[material.metal]\nconductivity = \"20 W/(m K)\"\ndensity = \"8000 kg/m3\"\nspecific_heat = \"500 J/(kg K)\"\n\
    [part.bar]\nmaterial = \"metal\"\nbox = [\"100 mm\", \"200 mm\", \"300 mm\"]\nat = [\"1 m\", \"2 m\", \"100 mm\"]\n\
    [boundary.cold]\nfaces = [\"bar.-z\"]\ntemperature = \"20 degC\"\n[boundary.hot]\nfaces = [\"bar.+z\"]\ntemperature = \"80 degC\"\n\
    [sensor.middle]\npoint = [\"50 mm\", \"100 mm\", \"150 mm\"]\nin = \"bar\"\n";

#[test]
fn places_temperatures_and_colours_are_those_of_a_bar() {
    let folder = scratch("glb-bar");
    std::fs::create_dir_all(&folder).unwrap();
    let file = folder.join("bar.toml");
    std::fs::write(&file, BAR).unwrap();
    let told = export(file.to_str().unwrap(), &folder, &[&["--cells", "4000"], &CONDITION[..]].concat());
    assert_eq!(told["target"], "glb");
    assert!(told["written"][0]["remark"].as_str().unwrap().starts_with("1 parts, "), "{told}");
    let read = Read::file(&folder.join("bar.glb"));
    let scene = &read.json["scenes"][0]["extras"];
    let [low, high] = ["temperature_low_degC", "temperature_high_degC"].map(|key| scene[key].as_f64().unwrap());
    assert!(low > 20.0 && high < 80.0, "{scene}");
    assert_eq!(scene["condition"]["motor_speed"], "1000.00 rpm");
    let [places, degrees, colours] = ["POSITION", "_TEMPERATURE", "COLOR_0"].map(|name| read.attribute(read.node("bar", "bar"), name));
    let bounds = [0, 1, 2].map(|d| {
        let all = places.iter().map(|at| at[d]);
        all.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)))
    });
    // Metres, y upwards: (x, y, z) of the machine is (x, z, -y).
    for ((low, high), (from, to)) in bounds.into_iter().zip([(1.0, 1.1), (0.1, 0.4), (-2.2, -2.0)]) {
        assert!((low - from).abs() < 1e-6 && (high - to).abs() < 1e-6, "{bounds:?}");
    }
    // The end faces show the outermost cells, half a cell inside. A facet of a side has the mean of its cells, at the ends up to half of a
    // seventh of the height away; between them a vertex has the mean of the facets above and below, which differ by one cell at most.
    let half_cell = low - 20.0;
    assert!((80.0 - high - half_cell).abs() < 1e-4, "{low} {high}");
    for (at, t) in places.iter().zip(&degrees) {
        let exact = 20.0 + 60.0 * (at[1] - 0.1) / 0.3;
        let is_between = at[1] > 0.1 + 1e-6 && at[1] < 0.4 - 1e-6;
        let off = if is_between { half_cell } else { 60.0 / 7.0 / 2.0 + half_cell };
        assert!((t[0] - exact).abs() < off, "{at:?}: {} and not {exact}", t[0]);
    }
    // The ends of the colours, as shares of light: sRGB (66, 62, 172) and (242, 245, 82).
    let light = |byte: f64| (byte / 255.0 / 1.055 + 0.055 / 1.055).powf(2.4);
    let of = |wanted: f64| colours[degrees.iter().position(|t| (t[0] - wanted).abs() < 1e-4).unwrap()].clone();
    for (found, own) in [(of(low), [66.0, 62.0, 172.0].map(light)), (of(high), [242.0, 245.0, 82.0].map(light))] {
        assert!(found.iter().zip(own).all(|(a, b)| (a - b).abs() < 2e-5) && found[3] == 1.0, "{found:?} {own:?}");
    }
    let sensor = read.node("sensors", "middle");
    assert!((sensor["extras"]["reading"].as_f64().unwrap() - 50.0).abs() < 1e-3, "{sensor}");
    let place: Vec<f64> = sensor["translation"].as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect();
    assert!(place.iter().zip([1.05, 0.25, -2.1]).all(|(a, b)| (a - b).abs() < 1e-6), "{sensor}");
}

#[test]
fn water_and_sensors_have_the_temperatures_of_a_solve() {
    let folder = scratch("glb-rig");
    let cells = ["--cells", "3000", "--set", "contact.motor.conductance=560 W/(m2 K)"];
    export("machines/rig.toml", &folder, &[&cells[..], &CONDITION[..]].concat());
    let solved = json(&coldplate(&[&["solve", "machines/rig.toml", "--json"], &cells[..], &CONDITION[..]].concat()));
    let read = Read::file(&folder.join("rig.glb"));
    for (name, reading) in solved["sensors"].as_object().unwrap() {
        let found = read.node("sensors", name)["extras"]["reading"].as_f64().unwrap();
        assert!((found - reading.as_f64().unwrap()).abs() < 1e-6, "{name}: {found} and not {reading}");
    }
    for (name, channel) in solved["coolant"].as_object().unwrap() {
        let water = read.attribute(read.node("channels", name), "_TEMPERATURE");
        let outlet = channel["outlet_degC"].as_f64().unwrap();
        assert!((water[water.len() - 1][0] - outlet).abs() < 1e-3, "{name}: {:?} and not {outlet}", water[water.len() - 1]);
        assert_eq!(
            read.node("channels", name)["extras"]["temperature_high_degC"].as_f64().map(|t| (1e3 * t).round()),
            Some((1e3 * outlet).round())
        );
    }
}

#[test]
fn what_it_cannot_draw_is_said() {
    let surrogate = root().join("crates/runtime/fixtures/uncertain.cps");
    for (file, more, needles) in [
        ("machines/heater.toml", vec![], ["no part that could be drawn", "heater.toml"]),
        (surrogate.to_str().unwrap(), vec![], ["this is a surrogate", "takes a machine file here"]),
        ("machines/rig.toml", vec!["--machine", "machines/rig.toml"], ["--machine", "written of the machine file alone"]),
        ("machines/rig.toml", vec!["--single"], ["--single", "leave it out"]),
    ] {
        let output = coldplate(&[&["export", file, "--to", "glb"], &more[..], &CONDITION[..]].concat());
        assert_eq!(status(&output), 2, "{file}: {}", message(&output));
        assert!(needles.iter().all(|needle| message(&output).contains(needle)), "{file}: {}", message(&output));
    }
}
