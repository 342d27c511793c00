//! The tables as measurements, and the machine that gives them.

use coldplate_base::error::Result;
use coldplate_evidence::identify::{self, Estimate, Free, IdentifyOptions, IdentifyProblem};
use coldplate_evidence::measurement::{Data, MeasurementUncertainty, whiten};
use coldplate_explore::simulate::Start;
use coldplate_solve::study::Study;

use super::numbers::{self, CHANGES};
use crate::validation::common::{owned, project, study};
use crate::validation::fits::{Difference, Published, Sweep, published, sweeps, value};

pub const DATA: &str = "data/paper/tables.csv";
/// File of data/paper that records the numbers found.
pub const FOUND: &str = "tables_found.csv";
const CONDITIONS: [&str; 4] = ["coolant_flow", "coolant_temperature", "motor_speed", "ambient_temperature"];
const UNITS: [&str; 4] = ["m3/s", "degC", "rpm", "degC"];

/// One curve beside a machine.
#[derive(Debug, Clone)]
pub struct Compared {
    pub test: String,
    pub sensor: String,
    pub difference: Difference,
}

/// Result of an identification.
pub struct Found {
    pub problem: IdentifyProblem,
    pub estimate: Estimate,
    /// All curves beside the machine found.
    pub curves: Vec<Compared>,
}

/// The measurements: each curve at seven conditions of its range, corrected where it cannot be as printed.
pub fn table() -> Result<String> {
    let (all, sweeps): (Vec<Published>, Vec<Sweep>) = (published()?, sweeps()?);
    let mut sensors: Vec<&str> = Vec::new();
    for p in &all {
        if !sensors.contains(&p.sensor.as_str()) {
            sensors.push(&p.sensor);
        }
    }
    let conditions = CONDITIONS.iter().zip(UNITS).map(|(c, u)| format!("{c} [{u}]"));
    let header: Vec<String> =
        std::iter::once("test".to_string()).chain(conditions).chain(sensors.iter().map(|s| format!("{s} [degC]"))).collect();
    let mut text = String::from(
        "# Tables 7 to 10 of the study as measurements: its polynomials at seven conditions each, those of corrections.csv corrected.\n\
         # Written by: cargo bench --bench validation -- tables\n",
    );
    text += &format!("{}\n", header.join(","));
    for sweep in &sweeps {
        for x in &sweep.x {
            let scale = if sweep.unit.starts_with("1e-5") { 1e-5 } else { 1.0 };
            let held = |name: &str| {
                let own = sweep.held.iter().find(|(k, _)| k == name).and_then(|(_, v)| v.split_whitespace().next());
                own.map_or_else(|| shown(x * scale), String::from)
            };
            let of = |sensor: &&str| {
                let curve = all.iter().find(|p| p.table == sweep.table && p.sensor == **sensor);
                curve.map_or(String::new(), |p| format!("{:.4}", value(p.curve(), *x)))
            };
            let cells = CONDITIONS.iter().map(|c| held(c)).chain(sensors.iter().map(of));
            text += &format!("{},{}\n", numbers::test(sweep.table), cells.collect::<Vec<_>>().join(","));
        }
    }
    Ok(text)
}

/// Seven digits.
fn shown(x: f64) -> String {
    if x.abs() < 1e-2 { format!("{x:.6e}") } else { format!("{:.7}", x).trim_end_matches('0').trim_end_matches('.').to_string() }
}

/// The machine the search begins with.
pub fn beginning(cells: Option<usize>) -> Result<Study> {
    study("five_axis.toml", &owned(&CHANGES), cells)
}

fn rows_of(data: &Data, test: &str) -> Data {
    Data { rows: data.rows.iter().filter(|row| row.test == test).cloned().collect(), ..data.clone() }
}

/// The problem that is solved: one table alone, or all together.
pub fn problem(table: Option<usize>, cells: Option<usize>) -> Result<IdentifyProblem> {
    let study = beginning(cells)?;
    let mut data = Data::read(&project(DATA), &study.model.machine)?;
    let uncertainty = MeasurementUncertainty::read(&project(DATA).with_extension("toml"), &data, &study.model.machine)?;
    if let Some(table) = table {
        data = rows_of(&data, &numbers::test(table));
    }
    let free = numbers::free(table).iter().map(|text| Free::parse(text, &study)).collect::<Result<Vec<_>>>()?;
    Ok(IdentifyProblem { study, data, uncertainty, free, start: Start::Steady })
}

/// Curves of data beside predictions by test.
pub fn compared(data: &Data, machine: &dyn Fn(&str) -> Result<Study>) -> Result<Vec<Compared>> {
    let mut found = Vec::new();
    for test in data.tests() {
        let own = rows_of(data, &test);
        let predicted = identify::values(&machine(&test)?, &own, Start::Steady)?;
        let (readings, places) = (whiten::readings(&own), whiten::places(&own));
        for (k, sensor) in own.names.iter().enumerate() {
            let at: Vec<usize> = (0..places.len()).filter(|i| places[*i].1 == k).collect();
            if at.is_empty() {
                continue;
            }
            let of = |v: &[f64]| at.iter().map(|i| v[*i]).collect::<Vec<f64>>();
            found.push(Compared {
                test: test.clone(),
                sensor: sensor.clone(),
                difference: Difference::of(&of(&predicted), &of(&readings)),
            });
        }
    }
    Ok(found)
}

/// Finds the numbers.
pub fn found(problem: IdentifyProblem) -> Result<Found> {
    let estimate = identify::identify(&problem, &IdentifyOptions { starts: 1, seed: 1 }, &coldplate_base::progress::Silent)?;
    let curves = compared(&problem.data, &|test| problem.machine_in(test, &estimate.values))?;
    Ok(Found { problem, estimate, curves })
}

/// The numbers found, as a table.
pub fn record(found: &Found) -> String {
    let mut text = String::from(
        "# What gives the most curves of tables.csv, with 95 % intervals; SI, heats as factors. Written with docs/record/paper-tables.md\nnumber,value [1],low [1],high [1]\n",
    );
    for (k, free) in found.problem.free.iter().enumerate() {
        let (value, (low, high)) = (found.estimate.values[k], found.estimate.intervals[k]);
        text += &format!("{},{value:.4e},{low:.3e},{high:.3e}\n", free.name());
    }
    text
}

impl Found {
    /// The machine as it was in a table.
    pub fn machine(&self, table: usize) -> Result<Study> {
        self.problem.machine_in(&numbers::test(table), &self.estimate.values)
    }

    /// Value and interval of a number, in a table where it has its own.
    pub fn number(&self, key: &str, table: Option<usize>) -> Option<usize> {
        let test = table.map(numbers::test);
        self.problem.free.iter().position(|f| f.parameter.name == key && f.test == test)
    }

    /// The curve of a sensor in a table.
    pub fn curve(&self, test: &str, sensor: &str) -> Option<&Compared> {
        self.curves.iter().find(|c| c.test == test && c.sensor == sensor)
    }

    /// Curves that agree.
    pub fn agreeing(&self) -> usize {
        self.curves.iter().filter(|c| c.difference.agrees()).count()
    }
}
