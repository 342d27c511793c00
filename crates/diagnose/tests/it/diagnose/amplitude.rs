//! Places and kinds of truths whose laws stand in no list: a milling head of lumped nodes with two water circuits.

use coldplate_base::document::Document;
use coldplate_base::progress::Silent;
use coldplate_base::random::Random;
use coldplate_describe::machine::Condition;
use coldplate_diagnose::{AmplitudeSettings, Places, Problem, places};
use coldplate_evidence::identify;
use coldplate_evidence::measurement::{Data, MeasurementUncertainty, ReadingRow, VariableUncertainty};
use coldplate_explore::simulate::Start;
use coldplate_solve::study::Study;

const HEAD: &str = r#"
name = "A milling head"
[variables]
hours = { unit = "h", default = "100 h" }
position = { unit = "mm", default = "100 mm" }
[node.room]
temperature = "ambient_temperature"
[node.water_motor]
temperature = "coolant_temperature"
[node.water_head]
temperature = "coolant_temperature"
[node.stator]
capacity = "9 kJ/K"
[node.rotor]
capacity = "5 kJ/K"
[node.housing]
capacity = "30 kJ/K"
[node.front_bearing]
capacity = "1 kJ/K"
[node.rear_bearing]
capacity = "0.8 kJ/K"
[node.spindle]
capacity = "8 kJ/K"
[node.nose]
capacity = "3 kJ/K"
[node.gear]
capacity = "6 kJ/K"
[node.screw]
capacity = "4 kJ/K"
[node.nut]
capacity = "2 kJ/K"
[node.ram]
capacity = "60 kJ/K"
[node.column]
capacity = "200 kJ/K"
[node.drive]
capacity = "7 kJ/K"
[contact.jacket]
between = ["stator", "water_motor"]
total_conductance = "45 W/K"
[contact.head_plate]
between = ["housing", "water_head"]
total_conductance = "30 W/K"
[contact.air_gap]
between = ["rotor", "stator"]
total_conductance = "4 W/K"
[contact.stator_housing]
between = ["stator", "housing"]
total_conductance = "12 W/K"
[contact.rotor_spindle]
between = ["rotor", "spindle"]
total_conductance = "9 W/K"
[contact.front_inner]
between = ["front_bearing", "spindle"]
total_conductance = "6 W/K"
[contact.front_outer]
between = ["front_bearing", "housing"]
total_conductance = "8 W/K"
[contact.rear_inner]
between = ["rear_bearing", "spindle"]
total_conductance = "5 W/K"
[contact.rear_outer]
between = ["rear_bearing", "housing"]
total_conductance = "6 W/K"
[contact.nose]
between = ["spindle", "nose"]
total_conductance = "7 W/K"
[contact.gear_housing]
between = ["gear", "housing"]
total_conductance = "10 W/K"
[contact.housing_ram]
between = ["housing", "ram"]
total_conductance = "14 W/K"
[contact.nut_ram]
between = ["nut", "ram"]
total_conductance = "8 W/K"
[contact.screw_nut]
between = ["screw", "nut"]
total_conductance = "5 W/K"
[contact.drive_screw]
between = ["drive", "screw"]
total_conductance = "4 W/K"
[contact.drive_column]
between = ["drive", "column"]
total_conductance = "9 W/K"
[contact.ram_column]
between = ["ram", "column"]
total_conductance = "11 W/K"
[contact.column_room]
between = ["column", "room"]
total_conductance = "8 W/K"
[contact.ram_room]
between = ["ram", "room"]
total_conductance = "3 W/K"
[contact.nose_room]
between = ["nose", "room"]
total_conductance = "1 W/K"
[contact.drive_room]
between = ["drive", "room"]
total_conductance = "1.5 W/K"
[source.stator]
in = "stator"
power = "40 + 0.06 * motor_speed_rpm"
[source.rotor]
in = "rotor"
power = "0.02 * motor_speed_rpm"
[source.front]
in = "front_bearing"
power = "0.025 * motor_speed_rpm"
[source.rear]
in = "rear_bearing"
power = "0.015 * motor_speed_rpm"
[source.gear]
in = "gear"
power = "0.02 * motor_speed_rpm"
[source.drive]
in = "drive"
power = "25 W"
[sensor.stator]
node = "stator"
[sensor.housing]
node = "housing"
[sensor.front_bearing]
node = "front_bearing"
[sensor.rear_bearing]
node = "rear_bearing"
[sensor.nose]
node = "nose"
[sensor.gear]
node = "gear"
[sensor.screw]
node = "screw"
[sensor.nut]
node = "nut"
[sensor.ram]
node = "ram"
[sensor.column]
node = "column"
[sensor.drive]
node = "drive"
"#;

const NOISE: f64 = 0.05;
const RPM: f64 = std::f64::consts::TAU / 60.0;

/// What is at hand in one row: motor speed in rpm, hours, position in mm, the number of the row.
struct Row {
    rpm: f64,
    hours: f64,
    position: f64,
    number: usize,
}

/// Makes a table of 16 rows from a machine whose file is edited row by row, with numbers off by 1 %, and readings that are changed at last.
fn table(seed: u64, edits: impl Fn(&Row) -> Vec<(String, String)>, read: impl Fn(&Row, &mut Vec<f64>, f64)) -> Problem {
    let machine = Document::parse(HEAD, "head.toml").unwrap();
    let study = Study::new(machine.clone(), None).unwrap();
    let mut random = Random::new(seed);
    let mut truth = machine.clone();
    for key in machine.keys().into_iter().filter(|key| key.ends_with(".total_conductance")) {
        let now = study.parameter(&key).unwrap().value;
        truth.apply_set(&key, &format!("\"{} W/K\"", now * (0.01 * random.normal()).exp())).unwrap();
    }
    let variables = &study.model.machine.variables;
    let sensors: Vec<usize> = (0..study.model.machine.sensors.len()).collect();
    let own: Vec<f64> = sensors.iter().map(|_| 0.06 * random.normal()).collect();
    let mut rows = Vec::new();
    for number in 0..16 {
        let row = Row {
            rpm: 300.0 + 5700.0 * random.unit(),
            hours: 1500.0 * random.unit(),
            position: 50.0 + 400.0 * random.unit().round(),
            number,
        };
        println!("rpm {:.0} stribeck {:.2}", row.rpm, 60.0 * (-row.rpm / 900.0).exp());
        let room = 290.15 + 8.0 * random.unit();
        let si = |name: &str, default: Option<f64>| match name {
            "motor_speed" => row.rpm * RPM,
            "hours" => row.hours * 3600.0,
            "position" => row.position * 1e-3,
            "ambient_temperature" => room,
            "coolant_temperature" => 293.15,
            _ => default.unwrap_or(0.0),
        };
        let condition = Condition::from_si(variables.iter().map(|v| si(&v.name, v.default)).collect());
        let mut own_truth = truth.clone();
        for (key, value) in edits(&row) {
            own_truth.apply_set(&key, &value).unwrap();
        }
        let mut one = ReadingRow {
            test: format!("test {}", number + 1),
            time: None,
            condition,
            readings: vec![Some(300.0); sensors.len()],
            line: None,
        };
        let alone = Data {
            source: "a row".into(),
            names: study.model.machine.sensors.iter().map(|s| s.name.clone()).collect(),
            sensors: sensors.clone(),
            rows: vec![one.clone()],
            ..Data::default()
        };
        let mut values = identify::values(&Study::new(own_truth, None).unwrap(), &alone, Start::Steady).unwrap();
        read(&row, &mut values, room);
        one.readings = values.iter().zip(&own).map(|(v, own)| Some(v + own + NOISE * random.normal())).collect();
        rows.push(one);
    }
    let data = Data {
        source: "a table made for this test".into(),
        names: study.model.machine.sensors.iter().map(|s| s.name.clone()).collect(),
        sensors: sensors.clone(),
        rows,
        ..Data::default()
    };
    let uncertainty = MeasurementUncertainty {
        noise: vec![NOISE; sensors.len()],
        bias: vec![0.06; sensors.len()],
        variables: vec![VariableUncertainty::default(); variables.len()],
        model: 0.0,
        timing: 0.0,
        file: None,
    };
    let mut problem = Problem::new(study, data);
    problem.uncertainty = uncertainty;
    problem
}

fn shown(name: &str, found: &Places) {
    println!("== {name}: {} tried", found.tried);
    for set in found.sets.iter().take(8) {
        println!(
            "  {:.3} lead {:.1} kept out {:.1} +- {:.1} spread {} disturbance {}",
            set.probability, set.lead, set.kept_out.0, set.kept_out.1, set.spread, set.disturbance
        );
        for member in &set.members {
            let amplitudes: Vec<String> = member.amplitudes.iter().map(|a| format!("{a:.2}")).collect();
            println!(
                "      {} {} [{}]",
                member.hypothesis.kind_and_place(),
                format!("{} {:?} {}", member.hypothesis.unit, member.over, member.is_free),
                amplitudes.join(" ")
            );
        }
    }
}

/// The sets of kind and place that are in front.
fn first(found: &Places) -> Vec<(String, String)> {
    let mut all: Vec<(String, String)> =
        found.sets[0].members.iter().map(|m| (m.hypothesis.kind().into(), m.hypothesis.place.clone())).collect();
    all.sort();
    all
}

fn line(key: &str, value: String) -> Vec<(String, String)> {
    vec![(key.into(), format!("\"{value}\""))]
}

const AS_IT_IS: fn(&Row, &mut Vec<f64>, f64) = |_, _, _| {};

#[test]
fn places_and_kinds_of_truths_that_no_list_has() {
    let clock = std::time::Instant::now();
    let stribeck = |row: &Row| line("source.front.power", format!("{} W", 0.025 * row.rpm + 60.0 * (-row.rpm / 900.0).exp()));
    let ageing = |row: &Row| line("contact.jacket.total_conductance", format!("{} W/K", 45.0 * (1.0 - 0.6 * row.hours / 1500.0)));
    let valve = |row: &Row| {
        let open = if row.number * 7 % 16 < 8 { 0.7 } else { 1.4 };
        line("contact.head_plate.total_conductance", format!("{} W/K", 30.0 * open))
    };
    let heater = |row: &Row| {
        let power = if row.position > 200.0 { 30.0 } else { 0.0 };
        line("source.heater", String::new()).into_iter().map(|(k, _)| (k, format!("{{ in = \"nut\", power = \"{power} W\" }}"))).collect()
    };
    let nothing = |_: &Row| Vec::new();
    let glued = |_: &Row, values: &mut Vec<f64>, room: f64| values[5] += 0.2 * (room - values[5]);
    let swapped = |row: &Row, values: &mut Vec<f64>, _: f64| {
        if row.number >= 9 {
            values.swap(2, 5);
        }
    };
    let jammed = |row: &Row| line("contact.screw_nut.total_conductance", format!("{} W/K", if row.position > 200.0 { 1.5 } else { 5.0 }));
    let clean = places(&table(1, nothing, AS_IT_IS), &AmplitudeSettings::default(), &Silent).unwrap();
    shown("clean", &clean);
    assert!(first(&clean).is_empty());
    let is = |name: &str, problem: Problem, expected: &[(&str, &str)]| {
        let found = places(&problem, &AmplitudeSettings::default(), &Silent).unwrap();
        shown(name, &found);
        println!(
            "{:?} {}",
            clock.elapsed(),
            if first(&found) == expected.iter().map(|(k, p)| (k.to_string(), p.to_string())).collect::<Vec<_>>() {
                "RIGHT"
            } else {
                "WRONG"
            }
        );
    };
    is("stribeck", table(2, stribeck, AS_IT_IS), &[("heat source", "front_bearing")]);
    if std::env::var("SHORT").is_ok() {
        return;
    }
    is("ageing", table(3, ageing, AS_IT_IS), &[("contact conductance", "jacket")]);
    is("valve", table(4, valve, AS_IT_IS), &[("contact conductance", "head_plate")]);
    is("heater", table(5, heater, AS_IT_IS), &[("heat source", "nut")]);
    is("glued", table(6, nothing, glued), &[("sensor gain", "gear")]);
    is("swapped", table(7, nothing, swapped), &[("swapped sensors", "front_bearing - gear")]);
    is("jammed", table(8, jammed, AS_IT_IS), &[("contact conductance", "screw_nut")]);
    let both = |row: &Row| [jammed(row), stribeck(row)].concat();
    is("both", table(9, both, AS_IT_IS), &[("contact conductance", "screw_nut"), ("heat source", "front_bearing")]);
}

#[test]
fn twins_tmp() {
    use coldplate_testing::twin::{Family, case};
    let mut alarms = 0;
    let clock = std::time::Instant::now();
    for seed in 1..=30 {
        let case = case(seed, Family::Clean);
        let found = places(&case.problem, &AmplitudeSettings::default(), &Silent).unwrap();
        let nothing = found.sets.iter().find(|s| s.members.is_empty()).map_or(0.0, |s| s.probability);
        let best = &found.sets[0];
        println!(
            "clean {seed} rows {} nothing {nothing:.3} best {:?} lead {:.1} {:?}",
            case.problem.data.rows.len(),
            first(&found),
            best.lead,
            clock.elapsed()
        );
        alarms += usize::from(nothing < 0.5);
    }
    println!("alarms {alarms}");
    for seed in 201..=240 {
        let case = case(seed, Family::One);
        let found = places(&case.problem, &AmplitudeSettings::default(), &Silent).unwrap();
        let nothing = found.sets.iter().find(|s| s.members.is_empty()).map_or(0.0, |s| s.probability);
        let h = &case.hidden[0];
        let is = |set: &coldplate_diagnose::PlaceSet| {
            set.members.len() == 1 && set.members[0].hypothesis.kind() == h.kind && set.members[0].hypothesis.place == h.place
        };
        let rank = found.sets.iter().position(is);
        let own = rank.map_or(0.0, |r| found.sets[r].probability);
        let size = case.shifts[0].iter().map(|s| s * s).sum::<f64>().sqrt();
        println!(
            "one {seed} rows {} shift {size:.1} K: {} at {} {:?} rank {rank:?} p {own:.3}; first {:?} p {:.3} nothing {nothing:.3} {:?}",
            case.problem.data.rows.len(),
            h.kind,
            h.place,
            h.law,
            first(&found),
            found.sets[0].probability,
            clock.elapsed()
        );
    }
}
