//! Heat without a way out has no steady state: an error that names it, never a temperature.

use crate::bench::{CONDITION, model, solve};

const TWO: &str = r#"
    [material.metal]
    conductivity = "10 W/(m K)"
    [part.base]
    material = "metal"
    box = ["40 mm", "10 mm", "30 mm"]
    surface = "none"
    [part.motor]
    material = "metal"
    box = ["40 mm", "10 mm", "30 mm"]
    at = ["0 mm", "50 mm", "0 mm"]
    surface = "none"
    [source.motor]
    in = "motor"
    power = "2 W"
    [sensor.motor]
    part = "motor"
"#;
const COLD: &str = "[boundary.cold]\nfaces = [\"base.-z\"]\ntemperature = \"20 degC\"\n";
const LINK: &str = "[contact.link]\nbetween = [\"motor.-y\", \"base.+y\"]\ntotal_conductance = \"0.5 W/K\"\n";

#[track_caller]
fn refused(tables: &str, what: &[&str]) {
    let model = model(&format!("{TWO}{tables}"), 10e-3);
    let condition = model.machine.condition(&CONDITION).unwrap();
    let error = model.steady(&condition).unwrap_err();
    assert_eq!(error.exit_status(), 4, "{error}");
    let text = format!("{error}");
    what.iter().for_each(|w| assert!(text.contains(w), "{w}: {text}"));
    assert!(error.remedy().is_some(), "{text}");
}

#[test]
fn heat_without_a_way_out() {
    refused("", &["2.0000 W", "'motor'", "no steady state"]);
    // A sink elsewhere does not help, nor does a contact that conducts nothing, nor a flux.
    refused(COLD, &["'motor'"]);
    refused(&format!("{COLD}{}", LINK.replace("total_conductance = \"0.5 W/K\"", "insulated = true\narea = \"1 cm2\"")), &["'motor'"]);
    refused("[boundary.lamp]\nfaces = [\"base.+z\"]\nheat_flux = \"100 W/m2\"\n", &["W have no way out"]);
    refused(LINK, &["'base', 'motor'"]);
    // Water that stands takes nothing along.
    let water = "[channel.hole]\nin = \"motor\"\ndiameter = \"4 mm\"\npath = [[\"0 mm\", \"5 mm\", \"15 mm\"], [\"40 mm\", \"5 mm\", \"15 mm\"]]\n\
                 [circuit.water]\nlayout = [\"hole\"]\nflow = \"0 L/min\"\n";
    refused(water, &["'motor'"]);
    solve(&format!("{TWO}{COLD}{LINK}"), 10e-3);
    solve(&format!("{TWO}{COLD}{}", water.replace("flow = \"0 L/min\"", "")), 10e-3);
}

/// A part that nothing joins and nothing heats could have any temperature.
#[test]
fn a_piece_without_heat_that_nothing_joins() {
    let alone = COLD.replace("base.-z", "motor.-z");
    refused(&alone, &["'base'", "could be any"]);
    refused(
        &alone.replace("temperature = \"20 degC\"", "film = \"50 W/(m2 K)\"\nfluid_temperature = \"20 degC\""),
        &["'base'", "could be any"],
    );
    solve(&format!("{TWO}{alone}{LINK}"), 10e-3);
}
