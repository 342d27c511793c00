//! Pulses and kinks between the rows of a schedule: against the heat that they bring, and against enthalpy curves.

use super::{coldplate, json, numbers, scratch, write};

const USUAL: [&str; 6] = ["--coolant-flow", "2 L/min", "--coolant-temperature", "20 degC", "--motor-speed", "0 rpm"];
/// Two rows, an hour apart.
const HOUR: &str = "time [s],ambient_temperature [degC]\n0,20\n3600,20\n";

/// A node of 100 J/K and a block of as much, alone in the vacuum, heated by formulas of the time.
fn heated(power: &str) -> [String; 2] {
    let variables = "name = \"pulse\"\n[variables]\ntime = { unit = \"s\", default = \"0 s\" }\n";
    let source = |place: &str| format!("[source.heater]\nin = \"{place}\"\npower = \"{power}\"\n");
    let node = format!("{variables}[node.body]\ncapacity = \"100 J/K\"\n{}[sensor.body]\nnode = \"body\"\n", source("body"));
    let block = format!(
        "{variables}[material.metal]\nconductivity = \"1000 W/(m K)\"\ndensity = \"1000 kg/m3\"\nspecific_heat = \"1000 J/(kg K)\"\n\
         [part.body]\nmaterial = \"metal\"\nbox = [\"50 mm\", \"50 mm\", \"40 mm\"]\nsurface = \"none\"\ncells = [3, 3, 3]\n{}\
         [sensor.body]\npart = \"body\"\n",
        source("body")
    );
    [node, block]
}

/// A second's pulse in an hour without a row: a trapezium of 90 J, a bell of 40 sqrt(pi) J; two slopes, and sixty waves of a mean
/// of one watt. Smooth courses may be off by the tolerance of a step: 0.01 K of 100 J/K, 1 J.
#[test]
fn pulses_between_rows_bring_their_heat() {
    let folder = scratch("pulses");
    let cases = [
        ("100 * max(0, min(1, 10 * min(time_s - 1800.3, 1801.3 - time_s)))", 90.0, 0.01),
        ("100 * exp(-((time_s - 1234.5) / 0.4)^2)", 40.0 * std::f64::consts::PI.sqrt(), 1.0),
        ("abs(0.1 * (time_s - 1000))", 0.05 * (1000.0f64.powi(2) + 2600.0f64.powi(2)), 0.05),
        ("1 + sin(time_s * 2 * pi / 60)", 3600.0, 1.0),
    ];
    for (power, energy, near) in cases {
        for (i, text) in heated(power).iter().enumerate() {
            let machine = write(&folder, &format!("pulse{i}.toml"), text);
            let schedule = write(&folder, "hour.csv", HOUR);
            for outputs in ["3600 s", "60 s"] {
                let args = ["simulate", &machine, &schedule, "--from", "20 degC", "--every", outputs, "--json"];
                let found = json(&coldplate(&[&args[..], &USUAL].concat()));
                let end = *numbers(&found["series"]["body"]).last().unwrap();
                assert!(((end - 20.0) * 100.0 - energy).abs() < near, "{power}, {i}, {outputs}: {} J, {energy} J", (end - 20.0) * 100.0);
            }
        }
    }
}

/// 90 kg/m² of wax with a heater of 50 W, whose capacity rises a hundredfold at its melting point: its enthalpy grows straight in time,
/// so that readings between the steps follow from the curve, and so do the times at which it passes temperatures.
#[test]
fn a_block_that_melts_follows_its_enthalpy_between_steps() {
    let folder = scratch("melting");
    let block = "name = \"wax\"\n[variables]\nheater = { unit = \"W\", default = \"50 W\" }\n[material.wax]\nconductivity = \"200 W/(m K)\"\n\
                 density = \"900 kg/m3\"\n\
                 specific_heat = [[\"58 degC\", \"2000 J/(kg K)\"], [\"59 degC\", \"182000 J/(kg K)\"], [\"60 degC\", \"2000 J/(kg K)\"]]\n\
                 [part.block]\nmaterial = \"wax\"\nbox = [\"100 mm\", \"100 mm\", \"10 mm\"]\nsurface = \"none\"\ncells = [2, 2, 1]\n\
                 [source.heater]\nin = \"block\"\npower = \"heater_W\"\n[sensor.block]\npart = \"block\"\n";
    let machine = write(&folder, "wax.toml", block);
    let schedule = write(&folder, "heat.csv", "time [s],heater [W],ambient_temperature [degC]\n0,50,20\n600,50,20\n");
    // Enthalpy over 20 degC of 0.09 kg, J: 2000 J/(kg K), and a triangle of 180 kJ/kg from 58 to 60 degC.
    let enthalpy = |t: f64| {
        let x = (t - 58.0).clamp(0.0, 2.0);
        let melted = if x <= 1.0 { x * x / 2.0 } else { 1.0 - (2.0 - x) * (2.0 - x) / 2.0 };
        0.09 * (2000.0 * (t - 20.0) + 180e3 * melted)
    };
    let temperature = |joules: f64| {
        let (mut low, mut high) = (0.0, 400.0);
        for _ in 0..100 {
            let middle = 0.5 * (low + high);
            if enthalpy(middle) < joules { low = middle } else { high = middle }
        }
        low
    };
    let args = ["simulate", &machine, &schedule, "--from", "20 degC", "--every", "7 s", "--json", "--passes", "block=57.9 degC"];
    let args = [&args[..], &USUAL, &["--passes", "block=59.3 degC", "--passes", "block=70 degC"]].concat();
    let found = json(&coldplate(&args));
    let (times, shown) = (numbers(&found["series"]["time_s"]), numbers(&found["series"]["block"]));
    assert!(times.len() > 80);
    for (time, shown) in times.iter().zip(&shown) {
        assert!((shown - temperature(50.0 * time)).abs() < 0.01, "{time} s: {shown}, {}", temperature(50.0 * time));
    }
    for (i, value) in [57.9, 59.3, 70.0].into_iter().enumerate() {
        let at = found["passes"][i]["rising_s"].as_f64().unwrap();
        assert!((at - enthalpy(value) / 50.0).abs() < 0.01, "{value} degC: {at} s, {} s", enthalpy(value) / 50.0);
    }
}

/// Passings come from the course within a step, not from outputs an hour apart: 1000 J/K behind 2 W/K, warmed by 30 W.
#[test]
fn passings_do_not_wait_for_outputs() {
    let folder = scratch("rare-outputs");
    let machine = write(&folder, "node.toml", super::passes::NODE);
    let schedule = write(&folder, "s.csv", "time [s],motor_speed [rpm],ambient_temperature [degC]\n0,1000,22\n3600,1000,22\n");
    let args = ["simulate", &machine, &schedule, "--from", "22 degC", "--every", "3600 s", "--json", "--passes", "motor=30 degC"];
    let found = json(&coldplate(&[&args[..], &USUAL[..4]].concat()));
    let at = found["passes"][0]["rising_s"].as_f64().unwrap();
    let exact = -500.0 * (1.0f64 - 8.0 / 15.0).ln();
    // 0.014 K/s there; a step may be 0.01 K off.
    assert!((at - exact).abs() < 0.7, "{at} s, {exact} s");
}

/// Nodes that radiate and store nothing find their balance however far from it a run begins.
#[test]
fn surfaces_without_capacity_settle_from_far_below() {
    let folder = scratch("far-below");
    let shield = "name = \"shield\"\n[node.hot]\ncapacity = \"50 J/K\"\nstart = \"900 degC\"\n[node.shield]\n[node.wall]\n\
                  temperature = \"ambient_temperature\"\n[radiation_link.inner]\nbetween = [\"hot\", \"shield\"]\narea = \"0.01 m2\"\n\
                  emissivity = [1.0, 1.0]\nview_factor = 1.0\n[radiation_link.outer]\nbetween = [\"shield\", \"wall\"]\narea = \"0.01 m2\"\n\
                  emissivity = [1.0, 1.0]\nview_factor = 1.0\n[sensor.shield]\nnode = \"shield\"\n[sensor.hot]\nnode = \"hot\"\n";
    let machine = write(&folder, "shield.toml", shield);
    let schedule = write(&folder, "s.csv", "time [s],ambient_temperature [degC]\n0,20\n60,20\n");
    for from in ["-250 degC", "20 degC", "2500 degC"] {
        let args = ["simulate", &machine, &schedule, &format!("--from={from}"), "--every", "60 s", "--json"];
        let found = json(&coldplate(&[&args[..], &USUAL].concat()));
        let last = |sensor: &str| *numbers(&found["series"][sensor]).last().unwrap();
        // Between two equal links T⁴ is the mean of both ends, at every instant.
        let exact = (0.5 * ((last("hot") + 273.15).powi(4) + 293.15f64.powi(4))).powf(0.25) - 273.15;
        assert!(last("hot") < 890.0 && (last("shield") - exact).abs() < 1e-3, "{from}: {}, {exact}", last("shield"));
    }
}

/// A motor of three nodes by a reduced model: no mode but those of its two free nodes, whatever conditions it was made of, and the
/// course of the full model within the bound.
#[test]
fn lumped_machines_are_reduced_over_time() {
    let folder = scratch("lumped-reduced");
    let motor = "name = \"motor\"\n[variables]\ncurrent = { unit = \"A\", default = \"5 A\", range = [\"0 A\", \"10 A\"] }\n\
                 ambient_temperature = { default = \"25 degC\", range = [\"15 degC\", \"40 degC\"] }\n\
                 [node.winding]\ncapacity = \"40 J/K\"\n[node.stator]\ncapacity = \"300 J/K\"\n\
                 [node.housing]\ntemperature = \"ambient_temperature\"\n[contact.slot]\nbetween = [\"winding\", \"stator\"]\n\
                 total_conductance = \"1.2 W/K\"\n[contact.housing]\nbetween = [\"stator\", \"housing\"]\n\
                 total_conductance = \"0.9 W/K\"\n[source.copper]\nin = \"winding\"\npower = \"0.5 * current_A^2\"\n\
                 temperature_coefficient = \"0.393 %/K\"\nreference_temperature = \"20 degC\"\n\
                 [sensor.winding]\nnode = \"winding\"\n[sensor.stator]\nnode = \"stator\"\n";
    let machine = write(&folder, "motor.toml", motor);
    let cycle = "time [s],current [A],ambient_temperature [degC]\n0,8,25\n900,8,25\n900,2,25\n1800,2,25\n";
    let cycle = write(&folder, "cycle.csv", cycle);
    let file = folder.join("motor.cpr").to_str().unwrap().to_string();
    for seed in ["1", "2", "3"] {
        let args = ["reduce", &machine, "--histories", "4", "--seed", seed, "--range", "current=0 A .. 10 A", "--out", &file, "--json"];
        let made = json(&coldplate(&args));
        assert!(made["modes_of_the_bound"] == 2 && made["in_time"]["largest_error_K"].as_f64().unwrap() < 0.01, "{seed}: {made}");
        let run = json(&coldplate(&["simulate", &file, &cycle, "--from", "25 degC", "--every", "900 s", "--json"]));
        // By an independent integration of the two equations, to 1e-4 K.
        let exact = [("winding", [99.909, 33.510]), ("stator", [65.516, 31.367])];
        for (sensor, [hot, cool]) in exact {
            let shown = numbers(&run["series"][sensor]);
            let at = |time: f64| shown[numbers(&run["series"]["time_s"]).iter().position(|t| *t == time).unwrap()];
            assert!((at(900.0) - hot).abs() < 0.02 && (at(1800.0) - cool).abs() < 0.02, "{seed}, {sensor}: {shown:?}");
        }
    }
}
