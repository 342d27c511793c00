//! Places and kinds of truths whose laws stand in no list: a milling head of lumped nodes with two water circuits.

use coldplate_base::document::Document;
use coldplate_base::progress::Silent;
use coldplate_base::random::Random;
use coldplate_describe::machine::Condition;
use coldplate_diagnose::{AmplitudeSettings, PlaceAndKind, PlaceSet, Problem, diagnose, places};
use coldplate_evidence::identify;
use coldplate_evidence::measurement::{Data, MeasurementUncertainty, ReadingRow, VariableUncertainty};
use coldplate_explore::simulate::Start;
use coldplate_solve::study::Study;
use coldplate_testing::twin::{Family, case};

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
pub struct Row {
    pub rpm: f64,
    pub hours: f64,
    pub position: f64,
    pub number: usize,
}

/// Makes a table of 16 rows from a machine whose file is edited row by row, with numbers off by 1 %, and readings that are changed at last.
pub fn table(seed: u64, edits: impl Fn(&Row) -> Vec<(String, String)>, read: impl Fn(&Row, &mut Vec<f64>, f64)) -> (Problem, Vec<Row>) {
    table_of((16, 0.01), seed, edits, read)
}

/// The same with another number of rows, and numbers that are off by another share.
pub fn table_of(
    (count, spread): (usize, f64),
    seed: u64,
    edits: impl Fn(&Row) -> Vec<(String, String)>,
    read: impl Fn(&Row, &mut Vec<f64>, f64),
) -> (Problem, Vec<Row>) {
    let machine = Document::parse(HEAD, "head.toml").unwrap();
    let study = Study::new(machine.clone(), None).unwrap();
    let mut random = Random::new(seed);
    let mut truth = machine.clone();
    for key in machine.keys().into_iter().filter(|key| key.ends_with(".total_conductance")) {
        let now = study.parameter(&key).unwrap().value;
        truth.apply_set(&key, &format!("\"{} W/K\"", now * (spread * random.normal()).exp())).unwrap();
    }
    let variables = &study.model.machine.variables;
    let sensors: Vec<usize> = (0..study.model.machine.sensors.len()).collect();
    let own: Vec<f64> = sensors.iter().map(|_| 0.06 * random.normal()).collect();
    let (mut rows, mut known) = (Vec::new(), Vec::new());
    for number in 0..count {
        let row = Row {
            rpm: 300.0 + 5700.0 * random.unit(),
            hours: 1500.0 * random.unit(),
            position: 50.0 + 400.0 * random.unit().round(),
            number,
        };
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
        known.push(row);
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
    (problem, known)
}

/// The set in front, told for who reads a failure.
pub(super) fn front(name: &str, problem: &Problem) -> PlaceSet {
    let found = places(problem, &AmplitudeSettings::default(), &Silent).unwrap();
    for set in found.sets.iter().take(3) {
        let of = |own: &PlaceAndKind| {
            format!("{} over {:?}, free {}: {:.2?}", own.hypothesis.kind_and_place(), own.over, own.is_free, own.amplitudes)
        };
        let members: Vec<String> = set.members.iter().map(of).collect();
        println!("{name}: {:.3} lead {:.1}; {members:?}; aside {:?}", set.probability, set.lead, set.aside);
    }
    found.sets[0].clone()
}

/// Whether a set has one cause of a kind at a place, and nothing else.
pub fn only<'a>(set: &'a PlaceSet, kind: &str, place: &str) -> &'a PlaceAndKind {
    let [own] = &set.members[..] else { panic!("{} causes", set.members.len()) };
    assert_eq!((own.hypothesis.kind(), own.hypothesis.place.as_str()), (kind, place));
    own
}

pub fn line(key: &str, value: String) -> Vec<(String, String)> {
    vec![(key.into(), format!("\"{value}\""))]
}

pub fn stribeck(row: &Row) -> f64 {
    60.0 * (-row.rpm / 900.0).exp()
}

pub fn friction(row: &Row) -> Vec<(String, String)> {
    line("source.front.power", format!("{} W", 0.025 * row.rpm + stribeck(row)))
}

/// Turned out of its place beyond 200 mm, the nut conducts a third.
fn jammed(row: &Row) -> Vec<(String, String)> {
    line("contact.screw_nut.total_conductance", format!("{} W/K", if row.position > 200.0 { 1.5 } else { 5.0 }))
}

pub const AS_IT_IS: fn(&Row, &mut Vec<f64>, f64) = |_, _, _| {};

/// Numbers that are off by 1 % are no cause.
#[test]
fn nothing_is_named_where_nothing_is_wrong() {
    for seed in [1, 11, 21] {
        let (problem, _) = table(seed, |_| Vec::new(), AS_IT_IS);
        assert!(front("clean", &problem).members.is_empty(), "seed {seed}");
    }
}

/// Friction that falls with the speed, by a law that no list has: the curve itself.
#[test]
fn boundary_friction() {
    let (problem, rows) = table(2, friction, AS_IT_IS);
    let set = front("friction", &problem);
    let own = only(&set, "heat source", "front_bearing");
    assert_eq!(own.over.as_deref(), Some("motor_speed"));
    for ((row, a), d) in rows.iter().zip(&own.amplitudes).zip(&own.deviations) {
        assert!((a - stribeck(row)).abs() < 4.0 * d && *d < 3.0, "{a} +- {d} for {} W", stribeck(row));
    }
    // The machine as it is calls the rows of largest friction wrong, and loses nothing by these.
    assert!(set.kept_out.0 > 4.0 * set.kept_out.1, "{:?}", set.kept_out);
}

/// A water jacket that silts up by the hour.
#[test]
fn ageing_by_the_hour() {
    let less = |row: &Row| 1.0 - 0.6 * row.hours / 1500.0;
    let (problem, rows) = table(3, |row| line("contact.jacket.total_conductance", format!("{} W/K", 45.0 * less(row))), AS_IT_IS);
    let set = front("ageing", &problem);
    let own = only(&set, "contact conductance", "jacket");
    assert_eq!(own.over.as_deref(), Some("hours"));
    assert!(rows.iter().zip(&own.amplitudes).all(|(row, a)| (a - less(row).ln()).abs() < 0.05), "{:?}", own.amplitudes);
}

/// All heats are some per cent more or less from test to test: no cause, and no reason to find another one beside that which is there.
#[test]
fn heats_of_another_level_in_every_test() {
    let level = |row: &Row| 1.0 + 0.05 * [1.0, -0.4, -1.3, 0.6, 1.5, -0.9, 0.2, -1.1][row.number * 5 % 8];
    let heats = |row: &Row| {
        let powers = [("stator", 40.0, 0.06), ("rotor", 0.0, 0.02), ("front", 0.0, 0.025), ("rear", 0.0, 0.015), ("gear", 0.0, 0.02)];
        let of = |(name, standing, per_rpm): (&str, f64, f64)| {
            line(&format!("source.{name}.power"), format!("{} W", level(row) * (standing + per_rpm * row.rpm)))
        };
        let drive = line("source.drive.power", format!("{} W", 25.0 * level(row)));
        powers.into_iter().flat_map(of).chain(drive).collect::<Vec<_>>()
    };
    let set = front("another level", &table(6, heats, AS_IT_IS).0);
    assert!(set.members.is_empty() && set.looseness.level >= 0.03, "{:?}", set.looseness);
    let half = |row: &Row| [heats(row), line("contact.jacket.total_conductance", "22.5 W/K".into())].concat();
    let set = front("another level beside a cause", &table(7, half, AS_IT_IS).0);
    let own = only(&set, "contact conductance", "jacket");
    assert!(own.amplitudes.iter().all(|a| (a - 0.5f64.ln()).abs() < 0.1), "{:?}", own.amplitudes);
    assert!(set.looseness.level >= 0.03, "{:?}", set.looseness);
}

/// A valve that sticks in one of two places, which nothing in the table tells.
#[test]
fn two_branches() {
    let open = |row: &Row| if row.number * 7 % 16 < 8 { 0.7f64 } else { 1.4 };
    let (problem, rows) = table(4, |row| line("contact.head_plate.total_conductance", format!("{} W/K", 30.0 * open(row))), AS_IT_IS);
    let set = front("valve", &problem);
    let own = only(&set, "contact conductance", "head_plate");
    assert!(own.is_free);
    assert!(rows.iter().zip(&own.amplitudes).all(|(row, a)| (a - open(row).ln()).abs() < 0.08), "{:?}", own.amplitudes);
}

/// A heater that is on at one position alone.
#[test]
fn a_heater_at_one_position() {
    let power = |row: &Row| if row.position > 200.0 { 30.0 } else { 0.0 };
    let lines = |row: &Row| vec![("source.heater".to_string(), format!("{{ in = \"nut\", power = \"{} W\" }}", power(row)))];
    let (problem, rows) = table(5, lines, AS_IT_IS);
    let set = front("heater", &problem);
    let own = only(&set, "heat source", "nut");
    assert_eq!(own.over.as_deref(), Some("position"));
    assert!(rows.iter().zip(&own.amplitudes).all(|(row, a)| (a - power(row)).abs() < 1.5), "{:?}", own.amplitudes);
}

/// Two sensors exchanged from the tenth row on.
#[test]
fn sensors_exchanged_from_a_row_on() {
    let swap = |row: &Row, values: &mut Vec<f64>, _: f64| {
        if row.number >= 9 {
            values.swap(2, 5);
        }
    };
    let problem = table(7, |_| Vec::new(), swap).0;
    let set = front("exchanged", &problem);
    let own = only(&set, "swapped sensors", "front_bearing - gear");
    assert!(own.amplitudes[..9].iter().all(|a| a.abs() < 0.1) && own.amplitudes[9..].iter().all(|a| (a - 1.0).abs() < 0.2));
    // They stay so: the entries have changed places in the machine that is written.
    assert!(set.ways[0].is_writable);
    let found = diagnose(&problem, &Silent).unwrap();
    assert!(found.sets.as_ref().is_some_and(|lines| lines.iter().any(|(key, _)| key == "sensor.gear")), "{:?}", found.sets);
    assert!(found.gain.as_ref().is_some_and(|gain| gain.after < 0.5 * gain.before), "{:?}", found.gain);
}

/// A contact that opens and friction at once: both, each over its own variable.
#[test]
fn two_at_once() {
    let (problem, rows) = table(9, |row| [jammed(row), friction(row)].concat(), AS_IT_IS);
    let set = front("both", &problem);
    let find = |kind: &str, place: &str| {
        let own = set.members.iter().find(|own| own.hypothesis.kind() == kind && own.hypothesis.place == place);
        own.unwrap_or_else(|| panic!("no {kind} at {place}"))
    };
    assert_eq!(set.members.len(), 2);
    let (heat, contact) = (find("heat source", "front_bearing"), find("contact conductance", "screw_nut"));
    assert_eq!((heat.over.as_deref(), contact.over.as_deref()), (Some("motor_speed"), Some("position")));
    assert!(rows.iter().zip(&heat.amplitudes).all(|(row, a)| (a - stribeck(row)).abs() < 5.0), "{:?}", heat.amplitudes);
}

/// Twins of another mesh, films and emissivities on a machine of cells: silent where they are clean, the hidden cause in front where it shows.
#[test]
fn twins() {
    for seed in [2, 3, 9] {
        assert!(front("clean twin", &case(seed, Family::Clean).problem).members.is_empty(), "seed {seed}");
    }
    for seed in [203, 205, 209] {
        let case = case(seed, Family::One);
        let set = front("twin", &case.problem);
        only(&set, &case.hidden[0].kind, &case.hidden[0].place);
    }
}
