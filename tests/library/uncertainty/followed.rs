//! Variables that a sweep holds and follows: another value of one is stated when the surrogate is asked, and the full solver agrees.

use coldplate_base::document::Document;
use coldplate_base::random::Random;
use coldplate_describe::machine::Condition;
use coldplate_explore::sweep::{SweepDefinition, SweepOptions, sweep_file::Sweep};
use coldplate_jobs::fitting::{fit_table, with_followed, with_uncertainty};
use coldplate_solve::study::Study;
use coldplate_surrogate::fit::file::{decode, encode, open};
use coldplate_surrogate::fit::{FitOptions, SurrogateFit};
use coldplate_surrogate::verdict::{Acceptability, condition, query, stated};

use crate::uncertainty::{folder, machine, readings};

const DESIGN: &str = "name = \"followed\"\nmachine = \"\"\nuncertainty = \"all\"\n\
    [range]\ncoolant_flow = [\"2 L/min\", \"8 L/min\"]\nmotor_speed = [\"500 rpm\", \"3000 rpm\"]\n\
    [design]\nkind = \"latin_hypercube\"\nruns = 60\nseed = 1\n";

fn fitted(name: &str, follow: &str) -> (Study, SurrogateFit) {
    let folder = folder(name);
    std::fs::create_dir_all(&folder).unwrap();
    let mut document = machine();
    // A heat that two of the held variables make together.
    document.apply_set("variables.preload", "{ unit = \"N\", default = \"300 N\", range = [\"100 N\", \"900 N\"] }").unwrap();
    document.apply_set("variables.second_speed", "{ unit = \"rpm\", default = \"200 rpm\", range = [\"0 rpm\", \"2000 rpm\"] }").unwrap();
    document.apply_set("source.second", "{ in = \"pedestal\", power = \"5e-5 * preload_N * second_speed_rpm\" }").unwrap();
    let definition = SweepDefinition::new(Document::parse(&format!("{DESIGN}{follow}"), "sweep.toml").unwrap()).unwrap();
    let study = Study::new(document, Some(400)).unwrap();
    let plan = definition.plan(&study.model.machine.variables).unwrap();
    let sweep = Sweep::of(definition, plan, study).unwrap();
    let swept = sweep.run(&folder, SweepOptions::default()).unwrap();
    let mut fit = fit_table(&swept.table, Some(&sweep.scope), &FitOptions::default()).unwrap();
    with_uncertainty(&mut fit, swept.slopes.as_ref()).unwrap();
    with_followed(&mut fit, Some(&sweep.scope), swept.followed.as_ref()).unwrap();
    (sweep.study().unwrap().clone(), fit)
}

#[test]
fn held_variables_may_be_stated() {
    let (study, fit) = fitted("followed", "[follow]\nvariables = \"all\"\n");
    let bytes = encode(&fit.surrogate).unwrap();
    assert!(decode(&bytes).unwrap().followed == fit.surrogate.followed);
    let machine = &study.model.machine;
    let mut random = Random::new(11);
    let sensors: Vec<usize> =
        open(&bytes).unwrap().points().map(|p| machine.sensors.iter().position(|s| s.name == p.name).unwrap()).collect();
    for moved in [1, 2, 4] {
        let (mut inside, mut readings_seen, mut largest, mut largest_change) = (0, 0, 0.0f64, 0.0f64);
        for _ in 0..40 {
            let held = ["coolant_temperature", "ambient_temperature", "preload", "second_speed"];
            let first = (4.0 * random.unit()) as usize;
            let names: Vec<&str> = (0..moved).map(|k| held[(first + k) % 4]).collect();
            let mut given = Vec::new();
            let mut si = Vec::new();
            for v in &machine.variables {
                let (low, high) = v.range.unwrap();
                let is_stated = matches!(v.name.as_str(), "coolant_flow" | "motor_speed") || names.contains(&v.name.as_str());
                let value = if is_stated { low + (high - low) * random.unit() } else { v.default.unwrap() };
                let shown = coldplate_base::units::express(value, &v.unit, v.dimension).unwrap();
                if is_stated {
                    given.push((v.name.clone(), format!("{shown} {}", v.unit)));
                }
                si.push(value);
            }
            let (there, rest) = stated::with_moved(&bytes, &given).unwrap();
            assert_eq!(rest.len(), 2, "{rest:?}");
            let file = open(&there).unwrap();
            let answer = query(&file, &condition(&file, &rest).unwrap()).unwrap();
            assert!(answer.in_domain);
            let base = open(&bytes).unwrap();
            let before = query(&base, &condition(&base, &rest).unwrap()).unwrap();
            let truth = readings(&study, &Condition::from_si(si));
            for ((own, at), before) in answer.temperatures.iter().zip(&sensors).zip(&before.temperatures) {
                let error = own.value - truth[*at];
                // What following adds to the band; the machine's own 0.05 K would hide it.
                let misses = own.parts.unwrap().misses.powi(2) - before.parts.unwrap().misses.powi(2);
                inside += usize::from(error.abs() <= misses.max(0.0).sqrt() + 1e-3);
                readings_seen += 1;
                largest = largest.max(error.abs());
                largest_change = largest_change.max((own.value - before.value).abs());
            }
        }
        println!(
            "{moved} moved: largest change {largest_change:.1} K, largest error {largest:.3} K, {inside} of {readings_seen} in what following adds to their bands"
        );
        assert!(largest < 0.02 * largest_change, "{largest} of {largest_change}");
        assert!(inside as f64 > 0.93 * f64::from(readings_seen), "{inside} of {readings_seen}");
    }
}

#[test]
fn a_moved_file_says_so_and_moves_no_further() {
    let (_, fit) = fitted("moved", "[follow]\nvariables = [\"ambient_temperature\", \"preload\"]\nruns = 8\n");
    let bytes = encode(&fit.surrogate).unwrap();
    let pairs = |list: &[(&str, &str)]| list.iter().map(|(n, v)| (n.to_string(), v.to_string())).collect::<Vec<_>>();
    let given = pairs(&[("coolant-flow", "4 L/min"), ("motor-speed", "1500 rpm"), ("ambient-temperature", "25 degC")]);
    let (there, rest) = stated::with_moved(&bytes, &given).unwrap();
    let file = open(&there).unwrap();
    let ambient = file.held().find(|h| h.name == "ambient_temperature").unwrap();
    assert_eq!(ambient.value, 25.0);
    assert!(file.provenance().any(|(key, text)| key == "moved ambient_temperature" && text.contains("22 degC")), "it says from where");
    // A limit over the ambient temperature, which was held, moves with it.
    let maximum = |bytes: &[u8]| open(bytes).unwrap().limits().map(|l| (l.name.to_string(), l.maximum)).collect::<Vec<_>>();
    let rises = fit.surrogate.followed.as_ref().unwrap().limits.len();
    let moved = maximum(&there).into_iter().zip(maximum(&bytes)).filter(|(a, b)| (a.1 - b.1 - 3.0).abs() < 1e-12).count();
    assert_eq!(moved, rises);
    // The way back is not known any more, and what was never followed stays outside.
    let (same, left) = stated::with_moved(&there, &pairs(&[("preload", "500 N")])).unwrap();
    assert_eq!((same == there, left.len()), (true, 1));
    let speed = [rest, pairs(&[("second_speed", "900 rpm")])].concat();
    let (still, left) = stated::with_moved(&there, &speed).unwrap();
    let still = open(&still).unwrap();
    let answer = query(&still, &condition(&still, &left).unwrap()).unwrap();
    assert_eq!((answer.verdict, answer.in_domain), (Acceptability::Uncertain, false));
    // Beyond its range a followed one is outside, too.
    let (far, left) = stated::with_moved(&bytes, &pairs(&[("ambient_temperature", "40 degC")])).unwrap();
    assert_eq!((far == bytes, left.len()), (true, 1));
}
