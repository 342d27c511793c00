//! An effect is written twice: as a derivative of the network for the screen, and as lines of the machine file for the
//! fit. Here every candidate of every shipped machine has its derivative compared with the program run on its own lines,
//! written out and read again as text; of the largest machine some places of each kind and law.

use std::collections::{BTreeMap, BTreeSet};

use coldplate_base::document::Document;
use coldplate_base::error::Result;
use coldplate_describe::machine::Condition;
use coldplate_diagnose::{Effect, Hypothesis, Law, Scales, UserKind, hypotheses, signatures};
use coldplate_evidence::identify;
use coldplate_evidence::measurement::{Data, ReadingRow};
use coldplate_explore::simulate::Start;
use coldplate_physics::gas;
use coldplate_solve::study::Study;
use rayon::prelude::*;

/// Steps of the differences, as shares of the prior's scale; differences over one and over two of them are extrapolated.
const STEP: f64 = 1e-3;
/// Relative deviation allowed beside the curvature that the two differences show: linear solves and the residual of the
/// adjoint fields (1e-9) stay far below it, and so do the nine digits that formulas of the file are written with.
const RELATIVE: f64 = 1e-3;
/// The extrapolated difference is off by less than the two it is made of are apart, unless they are further apart than this.
const MOST_CURVED: f64 = 0.05;
/// Joints of a contact of an imported mesh are laid out anew where the file makes its conductance a table of temperatures,
/// which a derivative does not follow: on few cells that is this much.
const OTHER_JOINTS: f64 = 0.03;
/// Effects of one kind and law that are compared on one machine at most, evenly among all.
const OF_ONE_LAW: usize = 9;
/// What is smaller than this for an amplitude of the prior's scale is rounding, K.
const FLOOR: f64 = 1e-6;

/// A machine with a table of conditions, nothing measured at them yet.
struct Case {
    name: String,
    study: Study,
    cells: usize,
    data: Data,
    user: Vec<UserKind>,
    /// Readings of the machine as it is, K.
    base: Vec<f64>,
}

impl Case {
    fn new(name: &str, sets: &[(&str, &str)], cells: usize, shares: &[f64]) -> Self {
        let mut document = Document::read(coldplate_testing::root().join(format!("machines/{name}.toml"))).unwrap();
        sets.iter().for_each(|(key, value)| document.apply_set(key, value).unwrap());
        let study = Study::new(document, Some(cells)).unwrap_or_else(|e| panic!("{name}: {e}"));
        let machine = &study.model.machine;
        let at = |share: f64| {
            let of = |v: &coldplate_describe::machine::DescribedVariable| match (v.name.as_str(), v.range) {
                // Within what the water's properties are known for, whatever the range.
                ("coolant_temperature", _) => 288.15 + 15.0 * share,
                (_, Some((low, high))) => low + share * (high - low),
                ("coolant_flow", None) => (2.0 + 4.0 * share) / 60_000.0,
                ("motor_speed", None) => 100.0 + 150.0 * share,
                ("ambient_temperature", None) => 290.15 + 8.0 * share,
                (name, None) => v.default.unwrap_or_else(|| panic!("{name} has no value")),
            };
            Condition::from_si(machine.variables.iter().map(of).collect())
        };
        let row = |share: &f64| ReadingRow {
            test: format!("at {share}"),
            time: None,
            condition: at(*share),
            readings: vec![Some(300.0); machine.sensors.len()],
            line: None,
        };
        let data = Data {
            source: "conditions of this test".into(),
            names: machine.sensors.iter().map(|s| s.name.clone()).collect(),
            sensors: (0..machine.sensors.len()).collect(),
            rows: shares.iter().map(row).collect(),
            ..Data::default()
        };
        let heated = machine.parts.first().map(|p| &p.name).or(machine.nodes.first().map(|n| &n.name)).unwrap().clone();
        let expression = "2 + 0.01 * ambient_temperature_degC".to_string();
        let user = vec![UserKind { name: "own".into(), places: vec![heated], expression, scale: 1.0, is_signed: true }];
        let name = sets.iter().fold(name.to_string(), |name, (key, value)| format!("{name} with {key} = {value}"));
        let mut case = Self { name, study, cells, data, user, base: Vec::new() };
        case.base = case.run(&[]).unwrap_or_else(|e| panic!("{}: {e}", case.name));
        case
    }

    /// Readings of the machine with lines changed, rows and then sensors, K.
    fn run(&self, sets: &[(String, String)]) -> Result<Vec<f64>> {
        let own = self.study.document();
        let changed = Document::parse(&own.rewritten(sets, &[])?, own.file())?;
        let study = Study::new(changed, Some(self.cells))?;
        let of = |row: &ReadingRow| -> Result<Vec<f64>> {
            let at = study.at(&row.condition)?;
            let (network, state) = (&study.model.network, &at.state);
            let places = network.sensors.iter().map(|s| s.read(&state.solution.temperatures, &state.load));
            let shown = places.zip(&study.model.machine.sensors).map(|(place, s)| s.shows.settled(place, state.load.chamber));
            Ok(shown.collect())
        };
        Ok(self.data.rows.iter().map(of).collect::<Result<Vec<_>>>()?.concat())
    }

    /// The difference of the program along an effect, per unit of its amplitude, and how far two steps of it are apart.
    fn difference(&self, h: &Hypothesis, scales: &Scales) -> Result<Option<(Vec<f64>, f64)>> {
        let step = STEP * h.scale;
        let lines = |amplitude: f64| h.sets(&self.study, scales, &self.user, amplitude);
        if lines(step)?.is_none() {
            return Ok(None);
        }
        let machine = &self.study.model.machine;
        let at = |amplitude: f64| -> Result<Vec<f64>> {
            Ok(h.read((scales, machine), &self.data, &self.run(&lines(amplitude)?.unwrap_or_default())?, amplitude))
        };
        let slope = |(more, less): (&Vec<f64>, &Vec<f64>), width: f64| -> Vec<f64> {
            more.iter().zip(less).map(|(a, b)| (a - b) / width).collect()
        };
        let (near, far, weight) = if h.is_signed {
            let (f, g) = ([at(step)?, at(-step)?], [at(2.0 * step)?, at(-2.0 * step)?]);
            (slope((&f[0], &f[1]), 2.0 * step), slope((&g[0], &g[1]), 4.0 * step), 3.0)
        } else {
            let none = &self.base;
            (slope((&at(step)?, none), step), slope((&at(2.0 * step)?, none), 2.0 * step), 1.0)
        };
        let apart: Vec<f64> = near.iter().zip(&far).map(|(n, f)| n - f).collect();
        let best = near.iter().zip(&apart).map(|(n, a)| n + a / weight).collect();
        Ok(Some((best, norm(&apart))))
    }

    /// What the column of an effect counts from: the screen follows the film of the gas along its secant over a pascal.
    fn local(&self, h: &Hypothesis, r: usize) -> f64 {
        if h.kind() != "residual gas" {
            return 1.0;
        }
        let chamber = &self.study.model.machine.chamber;
        let load = coldplate_network::Load::at(&self.study.model.machine, &self.data.rows[r].condition).unwrap();
        let film = |more: f64| gas::film(chamber.pressure + more, load.chamber, chamber.accommodation, chamber.gap);
        let short = 1e-4;
        (film(short) - film(0.0)) / short / (film(1.0) - film(0.0))
    }

    /// Effects whose two writings differ, and how many were compared.
    fn check(&self) -> (Vec<String>, usize) {
        let scales = Scales::of(&self.data, &self.study.model.machine);
        let all = some_of_each(hypotheses(&self.study, &self.data, &self.user));
        let found = signatures(&self.study, &self.data, Start::Steady, &[], &all, &scales, &self.user).unwrap();
        let sensors = self.data.sensors.len();
        let one = |(h, column): (&Hypothesis, &Vec<f64>)| -> Option<Option<String>> {
            let (difference, apart) = match self.difference(h, &scales) {
                Ok(found) => found?,
                Err(e) => return Some(Some(format!("{}: {} at {}: {e}", self.name, h.kind(), h.place))),
            };
            let column: Vec<f64> = column.iter().enumerate().map(|(i, c)| c * self.local(h, i / sensors)).collect();
            let off = norm(&column.iter().zip(&difference).map(|(a, b)| a - b).collect::<Vec<_>>());
            let size = norm(&difference);
            let machine = &self.study.model.machine;
            let is_relaid =
                matches!(h.effect, Effect::Contact(_)) && h.law == Law::Temperature && machine.parts.iter().any(|p| p.import.is_some());
            let relative = if is_relaid { OTHER_JOINTS } else { RELATIVE };
            let allowed = relative * size + 2.0 * apart.min(MOST_CURVED * size) + FLOOR / h.scale;
            let words = || {
                format!(
                    "{}: {} at {}, {}: {:.1e} of {:.2e} K (derivative {:.2e} K, curvature {:.1e} K)",
                    self.name,
                    h.kind(),
                    h.place,
                    h.law.words(),
                    off * h.scale,
                    size * h.scale,
                    norm(&column) * h.scale,
                    apart * h.scale
                )
            };
            Some((off > allowed).then(words))
        };
        let results: Vec<Option<String>> = all.par_iter().zip(&found.columns).filter_map(one).collect();
        let checked = results.len();
        println!("{}: {checked} of {} effects compared", self.name, all.len());
        (results.into_iter().flatten().collect(), checked)
    }
}

/// Effects of every kind and law, [`OF_ONE_LAW`] of each at most.
fn some_of_each(all: Vec<Hypothesis>) -> Vec<Hypothesis> {
    let mut by_law: BTreeMap<(&str, &str), Vec<&Hypothesis>> = BTreeMap::new();
    all.iter().for_each(|h| by_law.entry((h.kind(), h.law.words())).or_default().push(h));
    let evenly = |own: &Vec<&Hypothesis>| {
        let count = own.len().min(OF_ONE_LAW);
        (0..count).map(|k| own[k * own.len() / count].clone()).collect::<Vec<_>>()
    };
    by_law.values().flat_map(evenly).collect()
}

/// The surroundings follow both temperatures of the table, and a sensor takes part of theirs on.
fn badly_attached() -> Case {
    let mixed = ("chamber.temperature", "\"0.5 * ambient_temperature_degC + 0.5 * coolant_temperature_degC\"");
    Case::new("slab", &[mixed, ("sensor.block.surroundings_share", "0.3"), ("sensor.block.gain", "0.9")], 300, &[0.4, 0.8])
}

/// Slopes of the readings in a sensor's share of the surroundings and in the conditions, beside differences.
#[test]
fn what_a_sensor_takes_on_of_its_surroundings_has_its_slopes() {
    let Case { study, data, .. } = badly_attached();
    let share = study.parameter("sensor.block.surroundings_share").unwrap();
    let found = identify::predict(&study, &data, std::slice::from_ref(&share), Start::Steady).unwrap();
    let near = |name: &str, slopes: &[f64], (more, less): (Vec<f64>, Vec<f64>), step: f64| {
        for (slope, (m, l)) in slopes.iter().zip(more.iter().zip(&less)) {
            let difference = (m - l) / (2.0 * step);
            assert!((slope - difference).abs() < 1e-3 * difference.abs() + 1e-4, "{name}: {slope} for {difference}");
        }
    };
    let values = |study: &Study, data: &Data| identify::values(study, data, Start::Steady).unwrap();
    let with = |value: f64| values(&study.with(&[(&share, value)]).unwrap(), &data);
    let column = |slopes: &[Vec<f64>], p: usize| slopes.iter().map(|row| row[p]).collect::<Vec<f64>>();
    near("share", &column(&found.slopes, 0), (with(0.31), with(0.29)), 0.01);
    let scales = Scales::of(&data, &study.model.machine);
    let signatures = signatures(&study, &data, Start::Steady, std::slice::from_ref(&share), &[], &scales, &[]).unwrap();
    near("share", &column(&signatures.prediction.slopes, 0), (with(0.31), with(0.29)), 0.01);
    for (v, variable) in study.model.machine.variables.iter().enumerate().filter(|(_, own)| own.dimension.is_absolute()) {
        let moved = |by: f64| {
            let mut data = data.clone();
            for row in &mut data.rows {
                let mut values = row.condition.si().to_vec();
                values[v] += by;
                row.condition = Condition::from_si(values);
            }
            values(&study, &data)
        };
        for slopes in [&found.conditions, &signatures.prediction.conditions] {
            near(&variable.name, &column(slopes, v), (moved(0.05), moved(-0.05)), 0.05);
        }
    }
}

fn norm(v: &[f64]) -> f64 {
    v.iter().map(|x| x * x).sum::<f64>().sqrt()
}

#[test]
fn derivatives_are_those_of_the_edits() {
    let folder = coldplate_testing::root().join("machines");
    let mut names: Vec<String> = std::fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.extension().is_some_and(|e| e == "toml"))
        .map(|path| path.file_stem().unwrap().to_string_lossy().into_owned())
        .collect();
    // Derivatives do not follow controllers.
    names.retain(|name| name != "heater");
    names.sort();
    assert!(names.len() >= 8, "{names:?}");
    let of = |name: &String| match name.as_str() {
        "five_axis" => Case::new(name, &[], 300, &[0.6]),
        name if name.starts_with("hot_water") => Case::new(name, &[], 60, &[0.4, 0.8]),
        _ => Case::new(name, &[], 300, &[0.4, 0.8]),
    };
    let mut cases: Vec<Case> = names.iter().map(of).collect();
    // The surroundings are the chamber, at a temperature of its own; one face radiates nothing and feels the gas alone.
    let hot = ("chamber.temperature", "\"36 degC\"");
    cases.push(Case::new("slab", &[hot], 300, &[0.4, 0.8]));
    cases.push(Case::new("hot_water_pipe_bare", &[hot], 60, &[0.4, 0.8]));
    cases.push(Case::new("slab", &[("chamber.pressure", "\"0 Pa\""), ("part.plate.surface", "\"none\"")], 300, &[0.4, 0.8]));
    cases.push(Case::new("spindle", &[("chamber.pressure", "\"0 Pa\""), hot], 300, &[0.4, 0.8]));
    cases.push(badly_attached());
    let of_case = |case: &Case| hypotheses(&case.study, &case.data, &case.user).iter().map(Hypothesis::kind).collect::<Vec<_>>();
    let kinds: BTreeSet<&str> = cases.iter().flat_map(of_case).collect();
    for kind in ["condition offset", "all flows", "badly attached sensor", "thermal conductivity", "uneven split"] {
        assert!(kinds.contains(kind), "no {kind} among {kinds:?}");
    }
    let (mut wrong, mut checked) = (Vec::new(), 0);
    for case in &cases {
        let (found, count) = case.check();
        wrong.extend(found);
        checked += count;
    }
    assert!(checked > 900, "{checked}");
    assert!(wrong.is_empty(), "{} of {checked} effects are not what their lines do: {wrong:#?}", wrong.len());
}
