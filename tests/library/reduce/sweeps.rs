//! Sweeps that are solved in full only where the bound asks for it, against the same sweeps solved in full.

use std::path::{Path, PathBuf};

use coldplate_base::document::Document;
use coldplate_base::units;
use coldplate_explore::sweep::sweep_file::Sweep;
use coldplate_explore::sweep::{JOURNAL, SweepDefinition, SweepOptions, Swept};
use coldplate_tables::Table;

use super::{settings, study};

/// Every shipped machine, cells of its test, and the accuracy asked for.
const MACHINES: [(&str, usize, &str); 9] = [
    ("rig", 1500, "0.005 K"),
    ("five_axis", 2500, "0.01 K"),
    ("spindle", 1200, "0.01 K"),
    ("column", 1500, "0.01 K"),
    ("enclosure", 1200, "0.05 K"),
    ("bracket", 1000, "0.01 K"),
    ("hot_water_pipe", 800, "0.01 K"),
    ("slab", 500, "0.01 K"),
    ("two_heaters_bare", 800, "0.01 K"),
];

fn folder(name: &str) -> PathBuf {
    let folder = std::env::temp_dir().join(format!("coldplate-reduce-{}-{name}", std::process::id()));
    let _ = std::fs::remove_dir_all(&folder);
    folder
}

/// A sweep of a machine over what varies in the tests of reduced models.
fn sweep(machine: &str, cells: usize, head: &str, runs: usize) -> Sweep {
    let study = study(machine, cells);
    let settings = settings(&study, false);
    let (mut range, mut hold) = (String::new(), String::new());
    for (variable, (low, high)) in study.model.machine.variables.iter().zip(&settings.ranges) {
        let [low, high] = [low, high].map(|si| units::express(*si, &variable.unit, variable.dimension).expect("a unit"));
        let (name, unit) = (&variable.name, &variable.unit);
        if high > low {
            range += &format!("{name} = ['{low} {unit}', '{high} {unit}']\n")
        } else {
            hold += &format!("{name} = '{low} {unit}'\n")
        }
    }
    let text = format!(
        "name = '{machine}'\nmachine = 'm.toml'\n{head}\n[design]\nkind = 'latin_hypercube'\nruns = {runs}\n[validation]\nruns = 30\n[range]\n{range}[hold]\n{hold}"
    );
    let definition = SweepDefinition::new(Document::parse(&text, "s.toml").expect("a document")).expect("a sweep file");
    let plan = definition.plan(&study.model.machine.variables).expect("a plan");
    Sweep::of(definition, plan, study).expect("a sweep")
}

fn run(sweep: &Sweep, folder: &Path) -> Swept {
    sweep.run(folder, SweepOptions::default()).expect("it runs")
}

/// What two full solves of one condition may differ by, K.
const SOLVED: f64 = 1e-7;

#[test]
fn no_row_of_any_shipped_machine_is_outside_its_bound() {
    for (machine, cells, accuracy) in MACHINES {
        let mut asked = sweep(machine, cells, &format!("uncertainty = 'none'\naccuracy = '{accuracy}'"), 120);
        let places = [folder(machine), folder(&format!("{machine}-full"))];
        let swept = run(&asked, &places[0]);
        asked.solve_in_full();
        let full = run(&asked, &places[1]);
        let answered = swept.answered.as_ref().expect("a sweep with an accuracy");
        let bounds = swept.bounds.as_ref().expect("bounds");
        let tables = |swept: &Swept| [Some(swept.table.clone()), swept.validation.clone()].map(|t| t.expect("a table"));
        let (mut row, mut outside, mut largest) = (0, 0, 0.0);
        for (own, truth) in tables(&swept).iter().zip(&tables(&full)) {
            assert_eq!(own.conditions(), truth.conditions());
            for r in 0..own.rows() {
                for ((a, b), bound) in own.outputs().iter().zip(truth.outputs()).zip(bounds.outputs()) {
                    let error = (a.values[r] - b.values[r]).abs();
                    // What is solved in full begins elsewhere in the two sweeps, and ends at the same state but for what the solver leaves.
                    outside += usize::from(error > bound.values[row] + SOLVED);
                    largest = f64::max(largest, error);
                    assert!(bound.values[row] <= answered.accuracy);
                }
                row += 1;
            }
        }
        println!("{machine}: {}; largest error {largest:.1e} K", answered.sentence());
        assert_eq!((row, outside), (answered.in_full + answered.by_reduced_model, 0), "{machine}");
        places.iter().for_each(|place| std::fs::remove_dir_all(place).expect("removed"));
    }
}

fn results(folder: &Path) -> Vec<(String, Vec<u8>)> {
    let paths = std::fs::read_dir(folder).expect("a folder").map(|e| e.expect("an entry").path());
    let named = paths.map(|p| (p.file_name().expect("a name").to_string_lossy().into_owned(), std::fs::read(&p).expect("a file")));
    let mut files: Vec<_> = named.filter(|(name, _)| name != JOURNAL).collect();
    files.sort();
    files
}

/// Slopes along what is open are found at rows that are solved in full; the sweep is stopped anywhere and goes on.
#[test]
fn a_sweep_that_was_stopped_ends_in_the_same_files() {
    let sweep = sweep("rig", 400, "accuracy = '0.01 K'", 120);
    let place = folder("stopped");
    let swept = run(&sweep, &place);
    let answered = swept.answered.clone().expect("a sweep with an accuracy");
    assert!(answered.by_reduced_model > 20 && answered.in_full > 20, "{answered:?}");
    let slopes = swept.slopes.as_ref().expect("slopes");
    let bounds = swept.bounds.as_ref().expect("bounds");
    for row in (0..swept.plan.conditions.len()).filter(|row| swept.plan.is_sloped(*row)) {
        assert!(bounds.outputs().iter().all(|c| c.values[row] == 0.0), "row {row} has slopes and is not solved in full");
    }
    assert!(slopes.rows() > 20 && (0..slopes.rows()).all(|row| slopes.outputs().iter().any(|c| c.values[row] != 0.0)));
    let table = Table::read(place.join("sweep.csv")).expect("the table");
    let of = |name: &str| table.text(name).expect("a column").values.clone();
    for ((how, within), row) in of("answered").iter().zip(of("within")).zip(0..) {
        let largest = bounds.outputs().iter().map(|c| c.values[row]).fold(0.0, f64::max);
        assert_eq!(within, format!("{largest} K"));
        assert_eq!(how == "in full", largest == 0.0);
    }
    let (expected, journal) = (results(&place), std::fs::read(place.join(JOURNAL)).expect("a journal"));
    for share in [0.0, 0.12, 0.3, 0.55, 0.8, 0.97, 1.0] {
        std::fs::remove_dir_all(&place).expect("removed");
        std::fs::create_dir_all(&place).expect("made");
        let length = (share * journal.len() as f64) as usize;
        std::fs::write(place.join(JOURNAL), &journal[..length]).expect("written");
        run(&sweep, &place);
        assert!(results(&place) == expected, "stopped after {length} of {} bytes", journal.len());
    }
    std::fs::remove_dir_all(&place).expect("removed");
}

/// The band of a fit to such rows is wider by what they leave open.
#[test]
fn the_bound_goes_into_the_band() {
    let asked = sweep("rig", 400, "uncertainty = 'none'\naccuracy = '0.01 K'", 120);
    let place = folder("band");
    let swept = run(&asked, &place);
    let options = coldplate::FitOptions::default();
    let fit = coldplate::fit_table(&swept.table, None, &options).expect("a fit");
    let mut bare = swept.table.clone();
    bare.provenance.retain(|(key, _)| key != coldplate_explore::sweep::BOUNDS);
    let without = coldplate::fit_table(&bare, None, &options).expect("a fit");
    let bounds = swept.bounds.as_ref().expect("bounds");
    let fitted = swept.table.rows();
    for ((own, bare), column) in fit.points.iter().zip(&without.points).zip(bounds.outputs()) {
        let largest = column.values[..fitted].iter().copied().fold(0.0, f64::max);
        assert!(largest > 0.0);
        assert_eq!(own.half_width, bare.half_width + largest);
    }
    assert!(fit.notes.iter().any(|note| note.contains("reduced model")), "{:?}", fit.notes);
    std::fs::remove_dir_all(&place).expect("removed");
}

#[test]
fn what_cannot_be_answered_so_is_said_where_it_stands() {
    let said = |text: &str| {
        let definition = SweepDefinition::new(Document::parse(text, "s.toml").expect("a document"));
        definition.and_then(|d| d.plan(&study("rig", 300).model.machine.variables)).expect_err("it is refused").to_string()
    };
    let head = "name = 'a'\nmachine = 'm.toml'\n";
    for (text, parts) in [
        (format!("{head}accuracy = '0.01 L/min'\n"), ["accuracy", "0.01 L/min"]),
        (format!("{head}accuracy = '-0.01 K'\n"), ["accuracy", "larger than zero"]),
        (
            format!(
                "{head}accuracy = '0.01 K'\n[design]\nkind = 'adaptive'\naccuracy = '0.1 K'\n[range]\ncoolant_flow = ['3 L/min', '18 L/min']\nmotor_speed = ['100 rpm', '200 rpm']\n"
            ),
            ["accuracy", "adaptive"],
        ),
    ] {
        let text = said(&text);
        assert!(parts.iter().all(|part| text.contains(part)) && text.contains("s.toml"), "{text}");
    }
    let asked = sweep("rig", 300, "accuracy = '0.01 K'", 50);
    let part = "1/2".parse().expect("a part");
    let text = asked.run_shard(&folder("part"), part, SweepOptions::default()).expect_err("it is refused").to_string();
    assert!(text.contains("shared out") && text.contains("--full"), "{text}");
}
