//! Kinds that the twins do not draw: an uneven split of parallel channels, another conductivity of a material, losses that follow the temperature, and surfaces that see
//! each other.

use coldplate_base::document::Document;
use coldplate_base::progress::Silent;
use coldplate_diagnose::{Cause, Diagnosis, Law, Verdict, diagnose, hypotheses};
use coldplate_evidence::identify;
use coldplate_evidence::measurement::Data;
use coldplate_explore::simulate::Start;
use coldplate_solve::study::Study;
use coldplate_testing::machines::SMALL;

use super::hidden::Hidden;

/// Cells of what is measured: a mesh as coarse as the model's would be off by more than the intervals that a finer one allows.
const NATURE: usize = 10_000;

fn in_set(found: &Diagnosis, kind: &str, place: &str) -> bool {
    found.set.iter().any(|i| found.explanations[*i].causes.iter().any(|p| p.hypothesis.kind() == kind && p.hypothesis.place == place))
}

/// Whether the extended machine has a line for a key.
fn is_written(found: &Diagnosis, key: &str) -> bool {
    found.sets.as_ref().is_some_and(|sets| sets.iter().any(|(own, _)| own == key))
}

fn machine_with(changes: &[(&str, &str)], base: Document) -> Document {
    let mut machine = base;
    for (key, value) in changes {
        machine.apply_set(key, value).unwrap();
    }
    machine
}

/// What a machine file states of sensors and contacts takes the place of what they usually are; the rest stays.
#[test]
fn a_machine_file_states_how_large_causes_are() {
    let usual = Document::parse(SMALL, "small.toml").unwrap();
    let lines = [("prior.sensor_offset", "0.05 K"), ("prior.contact", "20 %"), ("prior.leak", "30 mW/K")];
    let stated = machine_with(&lines, usual.clone());
    let scales = |machine: &Document| -> Vec<(String, f64)> {
        let study = Study::new(machine.clone(), Some(300)).unwrap();
        let conditions = Hidden::conditions(machine, 4, 5, &[]);
        let data = Hidden { machine, cells: (300, 300), lines: &[], conditions, seed: 1 }.problem().data;
        hypotheses(&study, &data, &[]).iter().map(|h| (h.kind().to_string(), h.scale)).collect()
    };
    let (before, after) = (scales(&usual), scales(&stated));
    assert_eq!(before.len(), after.len());
    for ((kind, before), (_, after)) in before.iter().zip(&after) {
        let expected = match (kind.as_str(), before) {
            ("sensor offset" | "all sensors", 0.3) => 0.05,
            ("contact conductance", 0.7) => 0.2,
            ("leak to the surroundings", 0.1) => 0.03,
            (_, before) => *before,
        };
        assert!((after - expected).abs() < 1e-12, "{kind}: {after} for {expected}");
    }
    assert!(after.iter().any(|(_, scale)| *scale == 0.2) && after.iter().any(|(kind, _)| kind == "leak to the surroundings"));
}

/// A narrowed channel beside another: its loss coefficient is found, and stands in the extended machine's file.
#[test]
fn an_uneven_split() {
    let small = Document::parse(SMALL, "small.toml").unwrap();
    let machine = machine_with(&[("circuit.water.layout", "[[\"first\", \"second\"]]")], small);
    let hidden = Hidden {
        machine: &machine,
        cells: (300, 500),
        lines: &[("channel.second.minor_loss", "20.0")],
        conditions: Hidden::conditions(&machine, 10, 5, &[]),
        seed: 6,
    };
    let found = diagnose(&hidden.problem(), &Silent).unwrap();
    let best = &found.explanations[0];
    println!("{:?} {:?} {:?}", found.verdict, found.level, best);
    assert!(matches!(found.verdict, Verdict::Explained | Verdict::CannotTell));
    assert!(in_set(&found, "uneven split", "second"));
    assert_eq!((best.causes[0].hypothesis.kind(), best.causes[0].hypothesis.place.as_str()), ("uneven split", "second"));
    let (low, high) = best.causes[0].interval();
    assert!(low < 20.0 && 20.0 < high && low > 10.0, "{low} {high}");
    assert!(is_written(&found, "channel.second.minor_loss"));
}

/// Steel that conducts less than its handbook says: one material, four parts. The same where a library states it.
#[test]
fn a_conductivity_of_a_material() {
    let own = Document::parse(SMALL, "small.toml").unwrap();
    let table = "[material.steel]\nconductivity = \"45 W/(m K)\"\ndensity = \"7800 kg/m3\"\nspecific_heat = \"470 J/(kg K)\"\n";
    assert!(SMALL.contains(table));
    let of_library = Document::parse(&SMALL.replace(table, "").replace("\"steel\"", "\"alloy steel\""), "small.toml").unwrap();
    let made = "{ base = \"alloy steel\", conductivity = \"16 W/(m K)\" }";
    let other: Vec<(String, String)> =
        ["motor", "gear", "bracket", "bearing"].map(|p| (format!("part.{p}.material"), "other".into())).into();
    let mut lines = vec![("material.other", made)];
    lines.extend(other.iter().map(|(key, value)| (key.as_str(), value.as_str())));
    let plain = [("material.steel.conductivity", "\"16 W/(m K)\"")];
    for (machine, lines, place, key) in [
        (&own, &plain[..], "steel", "material.steel.conductivity"),
        (&of_library, &lines[..], "alloy steel", "material.\"alloy steel as diagnosed\""),
    ] {
        let hidden = Hidden { machine, cells: (300, NATURE), lines, conditions: Hidden::conditions(machine, 10, 5, &[]), seed: 6 };
        let problem = hidden.problem();
        let stated = problem.study.model.machine.materials.iter().find(|m| m.name == place).unwrap().conductivity[0].at(300.0);
        let found = diagnose(&problem, &Silent).unwrap();
        let best = &found.explanations[0];
        println!("{:?} {:?} {:?} {stated}", found.verdict, found.level, best);
        assert_eq!((best.causes[0].hypothesis.kind(), best.causes[0].hypothesis.place.as_str()), ("thermal conductivity", place));
        let shown = best.causes[0].shown();
        assert!(shown.low * stated < 16.0 && 16.0 < shown.high * stated && shown.value * stated < 0.6 * stated, "{shown:?}");
        assert!(is_written(&found, key) && found.gain.unwrap().after < 0.1);
    }
}

/// Scale on one channel, at several flows: in series with the film it counts most where the film is best, which neither a factor
/// on the film nor warmer water does.
#[test]
fn scale_on_a_channel() {
    let machine = Document::parse(SMALL, "small.toml").unwrap();
    let hidden = Hidden {
        machine: &machine,
        cells: (300, NATURE),
        lines: &[("channel.first.fouling_resistance", "\"3e-4 m2 K/W\"")],
        conditions: Hidden::conditions(&machine, 16, 11, &[]),
        seed: 12,
    };
    let found = diagnose(&hidden.problem(), &Silent).unwrap();
    for e in &found.explanations[..4] {
        println!("{:.3} {:.1} {} at {}", e.probability, e.misfit, e.causes[0].hypothesis.kind(), e.causes[0].hypothesis.place);
    }
    let best = &found.explanations[0].causes[0];
    assert!(matches!(found.verdict, Verdict::Explained | Verdict::CannotTell), "{:?}", found.verdict);
    assert_eq!((best.hypothesis.kind(), best.hypothesis.place.as_str()), ("scale", "first"));
    let (low, high) = best.interval();
    assert!(low < 3e-4 && 3e-4 < high && low > 1e-4, "{low} {high}");
    let refuted = |kind: &str| !in_set(&found, kind, "first") && !in_set(&found, kind, "water");
    assert!(refuted("film coefficient") && refuted("coolant inlet offset"));
    assert!(is_written(&found, "channel.first.fouling_resistance"));
}

/// A motor's copper: its loss grows by 0.39 % per kelvin, which is neither more heat nor heat that grows with the speed.
#[test]
fn a_loss_that_grows_with_the_temperature() {
    let hot = [("contact.motor.conductance", "\"100 W/(m2 K)\"")];
    let machine = machine_with(&hot, Document::parse(SMALL, "small.toml").unwrap());
    let hidden = Hidden {
        machine: &machine,
        cells: (300, NATURE),
        lines: &[("source.motor.temperature_coefficient", "\"0.39 %/K\"")],
        conditions: Hidden::conditions(&machine, 16, 9, &[]),
        seed: 10,
    };
    let found = diagnose(&hidden.problem(), &Silent).unwrap();
    // What 300 cells leave of the truth may show as a small place beside it.
    let is_this =
        |c: &&Cause| (c.hypothesis.kind(), c.hypothesis.place.as_str(), c.hypothesis.law) == ("source factor", "motor", Law::Temperature);
    let all = found.set.iter().map(|i| found.explanations[*i].causes.iter().find(is_this));
    let all: Vec<&Cause> = all.collect::<Option<_>>().unwrap_or_else(|| panic!("{:?}", found.explanations[0]));
    assert!((all[0].amplitude / 0.039 - 1.0).abs() < 0.15, "{}", all[0].amplitude);
    assert!(is_written(&found, "source.motor.temperature_coefficient"));
}

/// Two faces that see each other, which the file under test does not say: by conduction's means it is a contact between them whose
/// conductance grows with the cube of the temperature.
#[test]
fn a_missing_radiative_link() {
    let hot = [("source.motor.power", "\"0.012 * motor_speed_rpm\""), ("contact.motor.conductance", "\"20 W/(m2 K)\"")];
    let machine = machine_with(&hot, Document::parse(SMALL, "small.toml").unwrap());
    let link = "{ between = [\"motor.+x\", \"bearing.-x\"], view_factor = 0.25, emissivity = [0.9, 0.9] }";
    let hidden = Hidden {
        machine: &machine,
        cells: (300, 500),
        lines: &[("radiation_link.seen", link)],
        conditions: Hidden::conditions(&machine, 14, 7, &[]),
        seed: 8,
    };
    let found = diagnose(&hidden.problem(), &Silent).unwrap();
    for i in &found.set {
        let e = &found.explanations[*i];
        println!("{:.3} {:.1} {} at {}", e.probability, e.misfit, e.causes[0].hypothesis.kind(), e.causes[0].hypothesis.place);
    }
    println!("{:?} {:?}", found.verdict, found.level);
    assert!(in_set(&found, "radiative link", "motor - bearing") || in_set(&found, "conductive link", "motor - bearing"));
    let link = found.explanations.iter().find(|e| e.causes[0].hypothesis.kind() == "radiative link" && e.causes.len() == 1).unwrap();
    assert!(link.causes[0].hypothesis.place == "motor - bearing", "{link:?}");
    // The area of the motor's face that radiates to the bearing, times the view factor and both emissivities: about 0.016 x 0.25 x 0.8.
    let area = link.causes[0].amplitude;
    assert!((0.002..0.006).contains(&area), "{area}");
}

/// The entries of exchanged sensors change places in the machine file: they are named once, and what acts beside them is found.
#[test]
fn exchanged_sensors_are_named_once_beside_three_causes() {
    let limit = [("limit.hot", "{ sensor = \"bearing\", maximum = \"60 degC\" }")];
    let machine = machine_with(&limit, Document::parse(SMALL, "small.toml").unwrap());
    let lines = [
        ("chamber.temperature", "\"ambient_temperature_degC + 2\""),
        ("circuit.water.flow", "\"0.5 * coolant_flow_m3_s\""),
        ("contact.foot.conductance", "\"100 W/(m2 K)\""),
    ];
    let hidden =
        Hidden { machine: &machine, cells: (300, 500), lines: &lines, conditions: Hidden::conditions(&machine, 8, 22, &[]), seed: 22 };
    let mut problem = hidden.problem();
    let at = |name: &str| problem.data.names.iter().position(|n| n == name).unwrap();
    let (a, b) = (at("bearing"), at("outlet"));
    let truth = Study::new(machine_with(&lines, machine.clone()), Some(hidden.cells.0)).unwrap();
    let floor = rms(&problem.data, &identify::values(&truth, &problem.data, Start::Steady).unwrap());
    problem.data.rows.iter_mut().for_each(|row| row.readings.swap(a, b));
    let found = diagnose(&problem, &Silent).unwrap();
    let mut named: Vec<String> = found.rungs.iter().flat_map(|r| &r.causes).map(|c| c.hypothesis.kind_and_place()).collect();
    named.sort();
    let all =
        ["chamber temperature at chamber", "contact conductance at foot", "coolant flow at water", "swapped sensors at bearing - outlet"];
    assert_eq!(named, all);
    // Predictions stand in the order of the data as they were given.
    for rung in &found.rungs {
        let rms = rms(&problem.data, &rung.predicted);
        assert!((rms - rung.rms).abs() < 1e-9, "{rms} {}", rung.rms);
    }
    // Not far from what the truth itself leaves on this mesh.
    let last = found.rungs.last().unwrap();
    assert!(last.rms < 2.0 * floor, "{} {floor}", last.rms);
    // The machine that is written predicts them by itself, and its limit is about the same place as before.
    let lines = found.sets.unwrap();
    assert!(lines.contains(&("limit.hot.sensor".into(), "\"outlet\"".into())), "{lines:?}");
    let written = problem.study.edited(&lines).unwrap();
    let own = rms(&problem.data, &identify::values(&written, &problem.data, Start::Steady).unwrap());
    assert!(own < 2.0 * floor, "{own} {floor}");
}

/// Root mean square of readings minus predictions, K.
fn rms(data: &Data, predicted: &[f64]) -> f64 {
    let readings = data.rows.iter().flat_map(|row| row.readings.iter().flatten());
    let squares: f64 = readings.zip(predicted).map(|(r, p)| (r - p).powi(2)).sum();
    (squares / predicted.len() as f64).sqrt()
}
