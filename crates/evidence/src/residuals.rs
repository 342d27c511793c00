//! Measured data beside a machine as its file has it: prediction and residual of every reading, and their root mean square.
//! Nothing is fitted and nothing is judged.

use std::collections::BTreeMap;

use serde::Serialize;

use crate::faulty_readings::FaultRecord;
use crate::identify;
use crate::measurement::{AccountRecord, Data, DividedData, TEST, TIME, whiten};
use crate::record::{PredictedRecord, ReadingRecord};
use coldplate_base::error::Result;
use coldplate_base::units::{Measurand, express};
use coldplate_explore::simulate::Start;
use coldplate_solve::study::Study;
use coldplate_tables::{Column, Table, TextColumn};

/// Readings with the machine's predictions of them. Residuals are measured less predicted.
#[derive(Debug, Clone)]
pub struct PredictedReadings {
    /// The readings.
    pub data: Data,
    /// Row and sensor (a column of the data) of every reading.
    pub places: Vec<(usize, usize)>,
    /// The readings, K: rows, then sensors, missing ones left out.
    pub measured: Vec<f64>,
    /// The predictions in this order, K.
    pub predicted: Vec<f64>,
    /// Measurand of each sensor of the data.
    pub measurands: Vec<Measurand>,
}

/// Root mean square, mean and largest of some residuals: of temperatures, and of displacements.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ResidualSpread {
    /// Number of readings.
    pub readings: usize,
    /// Residuals of temperatures; `None` if all readings are displacements.
    #[serde(flatten)]
    pub temperatures: Option<InKelvin>,
    /// Residuals of displacements; `None` if there is none.
    #[serde(flatten)]
    pub displacements: Option<InMicrometres>,
}

/// Residuals of temperatures.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[allow(non_snake_case)]
pub struct InKelvin {
    /// Root mean square, K.
    pub rmse_K: f64,
    /// Mean, K.
    pub mean_K: f64,
    /// Residual farthest from zero, K.
    pub largest_K: f64,
}

/// Residuals of displacements.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct InMicrometres {
    /// Root mean square, um.
    pub rmse_um: f64,
    /// Mean, um.
    pub mean_um: f64,
    /// Residual farthest from zero, um.
    pub largest_um: f64,
}

impl ResidualSpread {
    /// Spread of residuals, each with its measurand.
    fn of(residuals: &[(Measurand, f64)]) -> Self {
        let one = |measurand: Measurand| {
            let own: Vec<f64> = residuals.iter().filter(|(of, _)| *of == measurand).map(|(_, r)| *r).collect();
            let count = own.len().max(1) as f64;
            let rmse = (own.iter().map(|r| r * r).sum::<f64>() / count).sqrt();
            let largest = own.iter().copied().fold(0.0, |most: f64, r| if r.abs() > most.abs() { r } else { most });
            (own.len(), rmse, own.iter().sum::<f64>() / count, largest)
        };
        let (kelvins, micrometres) = (one(Measurand::Temperature), one(Measurand::Displacement));
        let in_kelvin = |(_, rmse, mean, largest)| InKelvin { rmse_K: rmse, mean_K: mean, largest_K: largest };
        let in_micrometres = |(_, rmse, mean, largest)| InMicrometres { rmse_um: rmse, mean_um: mean, largest_um: largest };
        Self {
            readings: residuals.len(),
            temperatures: (kelvins.0 > 0 || micrometres.0 == 0).then(|| in_kelvin(kelvins)),
            displacements: (micrometres.0 > 0).then(|| in_micrometres(micrometres)),
        }
    }
}

impl PredictedReadings {
    /// Predicts every reading; logs begin with the state `start`.
    ///
    /// # Errors
    /// The machine cannot be solved at a condition, or a log cannot be run.
    pub fn of(study: &Study, data: Data, start: Start) -> Result<Self> {
        let predicted = identify::values(study, &data, start)?;
        Ok(Self::with(study, data, predicted))
    }

    /// Predicts the readings that are held out of a fit, and compares these alone.
    ///
    /// # Errors
    /// Errors of [`PredictedReadings::of`].
    pub fn held_out(study: &Study, divided: &DividedData, start: Start) -> Result<Self> {
        let predicted = divided.predicted(|data| identify::values(study, data, start))?;
        Ok(Self::with(study, divided.data(), predicted))
    }

    fn with(study: &Study, data: Data, predicted: Vec<f64>) -> Self {
        let measurands = data.measurands(&study.model.machine);
        Self { places: whiten::places(&data), measured: whiten::readings(&data), predicted, measurands, data }
    }

    /// Measured less predicted, K.
    pub fn residual(&self, reading: usize) -> f64 {
        self.measured[reading] - self.predicted[reading]
    }

    fn spread(&self, keep: impl Fn(usize, usize) -> bool) -> ResidualSpread {
        let kept = self.places.iter().enumerate().filter(|(_, (r, k))| keep(*r, *k));
        ResidualSpread::of(&kept.map(|(i, (_, k))| (self.measurands[*k], self.residual(i))).collect::<Vec<_>>())
    }

    /// Spread of all readings.
    pub fn overall(&self) -> ResidualSpread {
        self.spread(|_, _| true)
    }

    /// Spread of every test, in the order of the data.
    pub fn by_test(&self) -> Vec<(String, ResidualSpread)> {
        let of = |test: String| {
            let spread = self.spread(|r, _| self.data.rows[r].test == test);
            (test, spread)
        };
        self.data.tests().into_iter().map(of).collect()
    }

    /// Spread of every sensor that has a reading.
    pub fn by_sensor(&self) -> Vec<(String, ResidualSpread)> {
        let of = |(k, name): (usize, &String)| (name.clone(), self.spread(|_, sensor| sensor == k));
        self.data.names.iter().enumerate().map(of).filter(|(_, spread)| spread.readings > 0).collect()
    }

    /// The table of the data with two more columns for each sensor, `NAME predicted` and `NAME residual`.
    ///
    /// # Errors
    /// A variable's unit cannot be expressed.
    pub fn table(&self, study: &Study) -> Result<Table> {
        let (machine, rows) = (&study.model.machine, &self.data.rows);
        let column = |name: &str, unit: &str, values: Vec<f64>| Column { name: name.into(), unit: unit.into(), values };
        let mut columns = Vec::new();
        if self.data.is_transient() {
            columns.push(column(TIME, "s", rows.iter().map(|row| row.time.unwrap_or(f64::NAN)).collect()));
        }
        for (v, variable) in machine.variables.iter().enumerate().filter(|(_, v)| v.name != TIME) {
            let values = rows.iter().map(|row| express(row.condition.si()[v], &variable.unit, variable.dimension));
            columns.push(column(&variable.name, &variable.unit, values.collect::<Result<_>>()?));
        }
        let inputs = columns.len();
        for (k, name) in self.data.names.iter().enumerate() {
            let of = |value: &dyn Fn(usize) -> f64| {
                let mut values = vec![f64::NAN; rows.len()];
                self.places.iter().enumerate().filter(|(_, (_, s))| *s == k).for_each(|(i, (r, _))| values[*r] = value(i));
                values
            };
            let own = machine.sensors[self.data.sensors[k]].measurand();
            columns.push(column(name, own.unit(), of(&|i| own.shown(self.measured[i]))));
            columns.push(column(&format!("{name} predicted"), own.unit(), of(&|i| own.shown(self.predicted[i]))));
            columns.push(column(&format!("{name} residual"), own.unit_of_differences(), of(&|i| self.residual(i))));
        }
        let provenance = vec![
            ("machine".to_string(), machine.name.clone()),
            ("machine_hash".to_string(), machine.hash.clone()),
            ("cells".to_string(), study.model.mesh.cells.to_string()),
            ("data".to_string(), self.data.source.clone()),
            ("program".to_string(), concat!("coldplate ", env!("CARGO_PKG_VERSION")).to_string()),
        ];
        let tests = TextColumn { name: TEST.into(), values: rows.iter().map(|row| row.test.clone()).collect() };
        Ok(Table { texts: vec![tests], columns, inputs, provenance })
    }

    /// The comparison for other programs.
    pub fn record(&self, study: &Study) -> PredictRecord {
        let compared = |i: usize, own: Measurand| PredictedRecord::of(own, self.measured[i], self.predicted[i]);
        PredictRecord {
            cells: study.model.mesh.cells,
            machine: study.model.machine.name.clone(),
            data: self.data.source.clone(),
            account: self.data.account(),
            all: self.overall(),
            tests: self.by_test().into_iter().collect(),
            sensors: self.by_sensor().into_iter().collect(),
            readings: ReadingRecord::all(&study.model.machine, &self.data, compared),
            faults: Vec::new(),
        }
    }
}

/// The comparison as outside programs read it: each field is a key of `coldplate predict --json`.
#[derive(Debug, Clone, Serialize)]
#[allow(missing_docs)]
pub struct PredictRecord {
    pub machine: String,
    pub data: String,
    /// Cells of the mesh that predicted; predictions hold the error of that mesh, and no band states it.
    pub cells: usize,
    /// Account of the data: lines and readings that count, and those that do not.
    pub account: AccountRecord,
    /// Spread of all readings.
    pub all: ResidualSpread,
    pub tests: BTreeMap<String, ResidualSpread>,
    pub sensors: BTreeMap<String, ResidualSpread>,
    pub readings: Vec<ReadingRecord<PredictedRecord>>,
    /// Faulty readings that were found.
    pub faults: Vec<FaultRecord>,
}
