//! Readings of a machine with lines of its file changed, on another mesh, with noise: what is to be found is written in the test.

use coldplate_base::document::Document;
use coldplate_base::random::Random;
use coldplate_describe::machine::Condition;
use coldplate_diagnose::Problem;
use coldplate_evidence::identify;
use coldplate_evidence::measurement::{Data, MeasurementUncertainty, ReadingRow, VariableUncertainty};
use coldplate_explore::simulate::Start;
use coldplate_solve::study::Study;

/// Noise of a reading and a sensor's own error, K.
const NOISE: f64 = 0.03;

/// Everything a table of readings is made with.
pub struct Hidden<'a> {
    /// The machine as its file has it.
    pub machine: &'a Document,
    /// Cells of the model and of the truth.
    pub cells: (usize, usize),
    /// Lines that make the truth.
    pub lines: &'a [(&'a str, &'a str)],
    /// SI values of the variables, test by test.
    pub conditions: Vec<Vec<f64>>,
    /// Seed of the noise.
    pub seed: u64,
}

impl Hidden<'_> {
    /// Conditions anywhere in the machine's ranges; variables in `held` keep these values.
    pub fn conditions(machine: &Document, count: usize, seed: u64, held: &[(&str, f64)]) -> Vec<Vec<f64>> {
        let study = Study::new(machine.clone(), Some(200)).unwrap();
        let mut random = Random::new(seed);
        let mut one = || -> Vec<f64> {
            let of = |v: &coldplate_describe::machine::DescribedVariable| {
                let share = random.unit();
                let free = v.range.map_or(v.default.unwrap_or(0.0), |(low, high)| low + share * (high - low));
                held.iter().find(|(name, _)| *name == v.name).map_or(free, |(_, value)| *value)
            };
            study.model.machine.variables.iter().map(of).collect()
        };
        (0..count).map(|_| one()).collect()
    }

    /// What the program under test sees.
    pub fn problem(&self) -> Problem {
        let study = Study::new(self.machine.clone(), Some(self.cells.0)).unwrap();
        let mut truth = self.machine.clone();
        for (key, value) in self.lines {
            truth.apply_set(key, value).unwrap();
        }
        let truth = Study::new(truth, Some(self.cells.1)).unwrap();
        let machine = &study.model.machine;
        let sensors: Vec<usize> = (0..machine.sensors.len()).collect();
        let row = |(i, values): (usize, &Vec<f64>)| ReadingRow {
            test: format!("test {}", i + 1),
            time: None,
            condition: Condition::from_si(values.clone()),
            readings: vec![Some(300.0); sensors.len()],
            line: None,
        };
        let mut data = Data {
            source: "a table made for this test".into(),
            names: machine.sensors.iter().map(|s| s.name.clone()).collect(),
            sensors: sensors.clone(),
            rows: self.conditions.iter().enumerate().map(row).collect(),
            ..Data::default()
        };
        let values = identify::values(&truth, &data, Start::Steady).unwrap();
        let mut random = Random::new(self.seed);
        let own: Vec<f64> = sensors.iter().map(|_| NOISE * random.normal()).collect();
        for (row, values) in data.rows.iter_mut().zip(values.chunks(sensors.len())) {
            for ((reading, value), own) in row.readings.iter_mut().zip(values).zip(&own) {
                *reading = Some(value + own + NOISE * random.normal());
            }
        }
        let uncertainty = MeasurementUncertainty {
            noise: vec![NOISE; sensors.len()],
            bias: vec![NOISE; sensors.len()],
            variables: vec![VariableUncertainty::default(); machine.variables.len()],
            model: 0.0,
            timing: 0.0,
            file: None,
        };
        let mut problem = Problem::new(study, data);
        (problem.uncertainty, problem.seed) = (uncertainty, self.seed);
        problem
    }
}
