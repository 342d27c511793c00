//! Readings of known machines with a fault, as files that the program reads.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use coldplate_base::atomic_file;
use coldplate_base::document::Document;
use coldplate_base::error::Result;
use coldplate_base::random::Random;
use coldplate_base::units::{celsius, express};
use coldplate_describe::machine::{Condition, DescribedVariable};
use coldplate_evidence::identify;
use coldplate_evidence::measurement::{Data, ReadingRow};
use coldplate_explore::simulate::Start;
use coldplate_solve::study::Study;

/// Noise of a reading and own error of a sensor, K.
const NOISE: f64 = 0.05;
/// The same as the file beside a table has it.
const STATED: &str = "kind = \"standard deviations\"\nnoise = \"0.05 K\"\nbias = \"0.05 K\"\n";

/// Readings that are to be made.
pub struct Readings<'a> {
    /// The machine as its file has it.
    pub machine: &'a Document,
    /// Cells of the truth; `None` for a machine without.
    pub cells: Option<usize>,
    /// Lines that make the truth.
    pub lines: &'a [(&'a str, &'a str)],
    /// Test, time (s) and SI values of the variables, row by row.
    pub rows: Vec<(String, Option<f64>, Vec<f64>)>,
    /// Seed of the noise.
    pub seed: u64,
}

impl Readings<'_> {
    /// Writes the table and what is stated of it.
    ///
    /// # Errors
    /// The machine cannot be solved, or a file not written.
    pub fn write(&self, path: &Path) -> Result<PathBuf> {
        let mut truth = self.machine.clone();
        for (key, value) in self.lines {
            truth.apply_set(key, value)?;
        }
        let truth = Study::new(truth, self.cells)?;
        let machine = &truth.model.machine;
        let sensors: Vec<usize> = (0..machine.sensors.len()).collect();
        let row = |(test, time, values): &(String, Option<f64>, Vec<f64>)| ReadingRow {
            test: test.clone(),
            time: *time,
            condition: Condition::from_si(values.clone()),
            readings: vec![Some(300.0); sensors.len()],
            line: None,
        };
        let data = Data {
            source: "made for a benchmark".into(),
            names: machine.sensors.iter().map(|s| s.name.clone()).collect(),
            sensors: sensors.clone(),
            rows: self.rows.iter().map(row).collect(),
            ..Data::default()
        };
        let values = identify::values(&truth, &data, Start::Steady)?;
        let mut random = Random::new(self.seed);
        let own: Vec<f64> = sensors.iter().map(|_| NOISE * random.normal()).collect();
        let is_log = data.is_transient();
        let mut text = if is_log { "test,time [s]".to_string() } else { "test".to_string() };
        machine.variables.iter().for_each(|v| write!(text, ",{} [{}]", v.name, v.unit).unwrap_or(()));
        data.names.iter().for_each(|name| write!(text, ",{name} [degC]").unwrap_or(()));
        text.push('\n');
        for (row, values) in data.rows.iter().zip(values.chunks(sensors.len())) {
            text.push_str(&row.test);
            row.time.iter().for_each(|t| write!(text, ",{t}").unwrap_or(()));
            for (v, value) in machine.variables.iter().zip(row.condition.si()) {
                write!(text, ",{}", express(*value, &v.unit, v.dimension)?).unwrap_or(());
            }
            for (value, own) in values.iter().zip(&own) {
                write!(text, ",{:.3}", celsius(value + own + NOISE * random.normal())).unwrap_or(());
            }
            text.push('\n');
        }
        atomic_file::write(path, text.as_bytes())?;
        atomic_file::write(&path.with_extension("toml"), STATED.as_bytes())?;
        Ok(path.to_path_buf())
    }
}

/// SI values of a machine's variables: of each the share of its range that `share` says, else its default.
pub fn condition(study: &Study, share: &mut dyn FnMut(&str) -> Option<f64>) -> Vec<f64> {
    let mut of = |v: &DescribedVariable| match (v.range, share(&v.name)) {
        (Some((low, high)), Some(share)) => low + share * (high - low),
        _ => v.default.unwrap_or(0.0),
    };
    study.model.machine.variables.iter().map(&mut of).collect()
}
