//! The command's input as it should not be, and data with little in them.

use coldplate_testing::machines::SMALL;

use super::command::{HEADER, files, shape, stands_alone};
use super::scratch;
use crate::common::{coldplate, json, message, write};

/// Name, machine, table, further arguments, what the message must say.
type Refused<'a> = (&'a str, &'a str, String, Vec<&'a str>, Vec<&'a str>);

/// Input as it should not be: exit status 2, the place, and what to do.
#[test]
fn bad_input_is_refused_with_its_place() {
    let folder = scratch("bad");
    let machine = write(&folder, "small.toml", SMALL);
    let bare: String = SMALL.split("[sensor.").next().unwrap().to_string();
    let sensorless = write(&folder, "sensorless.toml", bare);
    let row = "a,4,20,2500,23,40,35";
    let good = format!("{HEADER},motor [degC],gear [degC]\n{row}\n");
    let good = write(&folder, "good.csv", good);
    let table = |name: &str, text: String| write(&folder, name, text);
    let with = |name: &str, rows: &str| table(name, format!("{HEADER},motor [degC],gear [degC]\n{rows}\n"));
    let log = |name: &str, rows: &str| table(name, format!("time [s],{HEADER},motor [degC]\n{rows}\n"));
    let beside = |name: &str, toml: &str| {
        write(&folder, &format!("{name}.toml"), toml);
        with(&format!("{name}.csv"), row)
    };
    let file_below = folder.join("good.csv").join("report.html");
    let missing = folder.join("missing.csv").to_str().unwrap().to_string();
    let kinds = |name: &str, text: &str| write(&folder, name, text);
    let (unreadable, nowhere, negative) = (
        kinds("k1.toml", "[kind.a]\nheat_into = [\"bracket\"]\nper_unit = \"1 +\"\n"),
        kinds("k2.toml", "[kind.a]\nheat_into = [\"braket\"]\nper_unit = \"1\"\n"),
        kinds("k3.toml", "[kind.a]\nheat_into = [\"bracket\"]\nper_unit = \"1\"\nscale = -1.0\n"),
    );
    let (no_picture, picture_below) = (folder.join("ladder.pdf"), folder.join("good.csv").join("ladder.svg"));
    let costs = |name: &str, text: &str| write(&folder, name, text);
    let (dear, unknown) = (costs("c1.toml", "[test]\nsteady = -4\n"), costs("c2.toml", "[test]\nsteddy = 4\n"));
    let below = file_below.to_str().unwrap();
    let cases: Vec<Refused<'_>> = vec![
        ("no such machine", "nowhere.toml", good.clone(), vec![], vec!["nowhere.toml", "check the path"]),
        ("no picture", &machine, good.clone(), vec!["--chart", no_picture.to_str().unwrap()], vec!["ladder.pdf", ".svg"]),
        ("no folder", &machine, good.clone(), vec!["--chart", picture_below.to_str().unwrap()], vec!["--chart"]),
        ("no such table", &machine, missing, vec![], vec!["missing.csv"]),
        ("empty file", &machine, table("empty.csv", String::new()), vec![], vec!["empty.csv"]),
        ("header only", &machine, table("header.csv", format!("{HEADER},motor [degC]\n")), vec![], vec!["header.csv"]),
        ("no reading", &machine, with("none.csv", "a,4,20,2500,23,,\nb,5,20,2500,23,,"), vec![], vec!["none.csv", "not one reading"]),
        ("not a number", &machine, with("word.csv", "a,4,20,2500,23,warm,35"), vec![], vec!["word.csv:2", "motor"]),
        ("nan condition", &machine, with("nan.csv", "a,NaN,20,2500,23,40,35"), vec![], vec!["nan.csv:2", "coolant_flow"]),
        ("infinite reading", &machine, with("inf.csv", "a,4,20,2500,23,inf,35"), vec![], vec!["inf.csv:2", "motor"]),
        (
            "unknown sensor",
            &machine,
            table("unknown.csv", format!("{HEADER},mottor [degC]\na,4,20,2500,23,40\n")),
            vec![],
            vec!["did you mean 'motor'?"],
        ),
        ("wrong unit", &machine, table("unit.csv", format!("{HEADER},motor [W]\na,4,20,2500,23,40\n")), vec![], vec!["unit.csv", "motor"]),
        ("no unit", &machine, table("bare.csv", format!("{HEADER},motor\na,4,20,2500,23,40\n")), vec![], vec!["bare.csv", "motor"]),
        ("negative flow", &machine, with("flow.csv", "a,-4,20,2500,23,40,35"), vec![], vec!["flow.csv:2", "negative"]),
        (
            "kelvin as degC",
            &machine,
            with("kelvin.csv", "a,4,20,2500,23,313.2,308.1\nb,5,20,1500,23,306.2,303.1"),
            vec![],
            vec!["kelvin.csv", "kelvin", "motor"],
        ),
        ("water in kelvin", &machine, with("water.csv", "a,4,293.15,2500,23,40,35"), vec![], vec!["water.csv:2", "coolant_temperature"]),
        (
            "degC as kelvin",
            &machine,
            table("cold.csv", format!("{HEADER},motor [K]\na,4,20,2500,23,40\n")),
            vec![],
            vec!["cold.csv:2", "unit"],
        ),
        ("same time twice", &machine, log("twice.csv", "0,a,4,20,2500,23,40\n0,a,4,20,2500,23,41"), vec![], vec!["twice.csv:3", "0 s"]),
        ("one row of a log", &machine, log("alone.csv", "0,a,4,20,2500,23,40"), vec![], vec!["alone.csv", "one row"]),
        ("no sensors", &sensorless, good.clone(), vec![], vec!["good.csv", "motor"]),
        ("not TOML", &machine, beside("nonsense", "noise = = 3"), vec![], vec!["nonsense.toml:1"]),
        ("no kind", &machine, beside("unsaid", "noise = \"0.1 K\""), vec![], vec!["unsaid.toml", "standard deviations"]),
        ("unknown key", &machine, beside("key", "kind = \"limits\"\nnoize = \"0.1 K\""), vec![], vec!["key.toml:2", "noise"]),
        ("no noise at all", &machine, beside("zero", "kind = \"limits\"\nnoise = \"0 K\""), vec![], vec!["zero.toml", "noise"]),
        ("negative noise", &machine, beside("minus", "kind = \"limits\"\nnoise = \"-1 K\""), vec![], vec!["minus.toml:2"]),
        ("report nowhere", &machine, good.clone(), vec!["--report", below], vec!["report.html", "folder"]),
        ("report as a machine", &machine, good.clone(), vec!["--report", &machine], vec!["is an input", "another name"]),
        ("out nowhere", &machine, good.clone(), vec!["--out", below], vec!["report.html", "--out"]),
        ("surrogate nowhere", &machine, good.clone(), vec!["--surrogate", below], vec!["report.html", "--surrogate"]),
        ("uncertain nothing", &machine, good.clone(), vec!["--uncertain", "contact.seat.conductance"], vec!["--uncertain", "10%"]),
        ("uncertain unknown", &machine, good.clone(), vec!["--uncertain", "contact.set.conductance=10%"], vec!["contact.set.conductance"]),
        (
            "uncertain negative",
            &machine,
            good.clone(),
            vec!["--uncertain", "contact.seat.conductance=-10%"],
            vec!["--uncertain", "positive"],
        ),
        ("unknown kind", &machine, good.clone(), vec!["--without", "gremlins"], vec!["--without", "heat source"]),
        ("kinds formula", &machine, good.clone(), vec!["--kinds", &unreadable], vec!["k1.toml", "kind.a"]),
        ("kinds place", &machine, good.clone(), vec!["--kinds", &nowhere], vec!["k2.toml", "kind.a", "bracket"]),
        ("kinds scale", &machine, good.clone(), vec!["--kinds", &negative], vec!["k3.toml", "kind.a.scale"]),
        ("negative cost", &machine, good.clone(), vec!["--costs", &dear], vec!["c1.toml:2", "test.steady", "positive"]),
        ("unknown cost", &machine, good.clone(), vec!["--costs", &unknown], vec!["c2.toml:2", "steddy", "steady"]),
        ("start", &machine, good.clone(), vec!["--from", "warm"], vec!["--from"]),
    ];
    let before = files(&folder);
    let mut wrong = Vec::new();
    for (name, machine, table, more, said) in &cases {
        let output = coldplate(&[&["diagnose", machine, table, "--cells", "600", "--quiet"][..], more].concat());
        let text = message(&output);
        if output.status.code() != Some(2) || text.contains("panicked") || !said.iter().all(|s| text.contains(s)) {
            wrong.push(format!("{name}: {:?} {}{text}", output.status.code(), String::from_utf8_lossy(&output.stdout)));
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
    assert_eq!(files(&folder), before, "nothing is left behind");
}

/// Little data are no error, only little to say.
#[test]
fn one_reading_is_judged_with_reserve() {
    let folder = scratch("one");
    let machine = write(&folder, "small.toml", SMALL);
    let report = folder.join("report.html");
    for (name, reading) in [("far", "70"), ("near", "NaN,29")] {
        let columns = if name == "far" { "motor [degC]" } else { "motor [degC],second plate [degC]" };
        let table = write(&folder, &format!("{name}.csv"), format!("{HEADER},{columns}\na,4,20,2500,23,{reading}\n"));
        let found =
            json(&coldplate(&["diagnose", &machine, &table, "--cells", "600", "--json", "--quiet", "--report", report.to_str().unwrap()]));
        shape(&found);
        assert_eq!(found["misfit"]["dof"], 1);
        assert!(found["gain"].is_null());
        // One number cannot say which of hundreds of causes it is.
        assert_ne!(found["verdict"], "explained", "{}", found["headline"]);
        stands_alone(&std::fs::read_to_string(&report).unwrap());
    }
}
