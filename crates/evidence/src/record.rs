//! Readings and identifications as outside programs read them: each field of [`IdentifyRecord`] is a key of `coldplate identify
//! --json`, and readings look alike under `predict`, `identify` and `diagnose`. Numbers are in the parameters' own units; numbers
//! that are not finite become `null`.

use std::collections::BTreeMap;

use serde::Serialize;

use crate::faulty_readings::FaultRecord;
use crate::identify::{self, Advice, Estimate, Free, IdentifyProblem, ParameterProfile, SearchEnd};
use crate::measurement::{AccountRecord, Data, DividedData, whiten};
use coldplate_base::error::Result;
use coldplate_base::units::Measurand;
use coldplate_describe::machine::Machine;
use coldplate_solve::study::Study;

/// Result of an identification.
#[derive(Debug, Clone, Serialize)]
#[non_exhaustive]
#[allow(missing_docs, non_snake_case)]
pub struct IdentifyRecord {
    pub parameters: BTreeMap<String, ParameterRecord>,
    pub correlation: CorrelationRecord,
    /// Under the stated errors.
    pub misfit: ChiSquareRecord,
    /// Model error learnt if the stated errors do not explain the residual.
    pub model_error: Option<ModelErrorRecord>,
    /// Factor by which the intervals were widened if the misfit is too large even with the model error; 1 otherwise.
    pub widened: f64,
    /// Largest change of a prediction on an endlessly fine mesh.
    pub mesh_K: f64,
    /// Estimate of each sensor's own error.
    pub sensor_errors: BTreeMap<String, SensorErrorRecord>,
    /// Combinations that the readings do not determine.
    pub undetermined: Vec<UndeterminedRecord>,
    pub readings: Vec<ReadingRecord<BeforeAfterRecord>>,
    pub held_out: Option<HeldOutRecord>,
    pub next_tests: Vec<NextTestRecord>,
    /// Misfit that each start of the search ended with.
    pub starts: Vec<f64>,
    pub search: SearchRecord,
    /// Path of the identified machine, if one was asked for.
    pub machine: Option<String>,
    pub evaluations: usize,
    /// Largest difference of the predictions at the values found on the reduced model from those of full solves; null with
    /// `--full` and for logs.
    pub off_in_full_K: Option<f64>,
    /// Faulty readings that were found.
    pub faults: Vec<FaultRecord>,
    /// Account of the data: lines and readings that count, and those that do not.
    pub account: AccountRecord,
    pub seconds: f64,
}

/// How the search ended.
#[derive(Debug, Clone, Serialize)]
#[allow(missing_docs)]
pub struct SearchRecord {
    /// `at_rest`, `no_step` (no step led down) or `step_limit` (the most steps were made). If it is not `at_rest`, values are the
    /// best so far, and none is said to be undetermined.
    pub ended: &'static str,
    /// Wider search that a misfit asked for which the stated errors do not explain.
    pub wider: Option<WiderRecord>,
}

/// Account of a wider search.
#[derive(Debug, Clone, Serialize)]
#[allow(missing_docs)]
pub struct WiderRecord {
    /// Points that were looked at.
    pub points: usize,
    /// Misfit of the search before it.
    pub before: f64,
    pub after: f64,
}

/// One parameter with its 95 % interval.
#[derive(Debug, Clone, Serialize)]
#[allow(missing_docs)]
pub struct ParameterRecord {
    pub unit: String,
    pub before: f64,
    pub value: f64,
    pub low: f64,
    pub high: f64,
    pub at_bound: bool,
    /// Not determined by these data: the file's value.
    pub kept: bool,
    /// `found`, `like_zero` (not told from zero by the data), `at_bound`, `not_determined` or `not_at_rest`.
    pub status: &'static str,
    pub profile: Option<ProfileRecord>,
}

/// The profile of the misfit along one parameter.
#[derive(Debug, Clone, Serialize)]
#[allow(missing_docs)]
pub struct ProfileRecord {
    pub low: Option<f64>,
    pub high: Option<f64>,
    /// Values, and the misfit above the least one there.
    pub points: Vec<[f64; 2]>,
}

/// Correlations of all parameters.
#[derive(Debug, Clone, Serialize)]
#[allow(missing_docs)]
pub struct CorrelationRecord {
    pub names: Vec<String>,
    pub matrix: Vec<Vec<f64>>,
}

/// Chi-square before and after.
#[derive(Debug, Clone, Serialize)]
#[allow(missing_docs)]
pub struct ChiSquareRecord {
    pub before: f64,
    pub after: f64,
    /// Degrees of freedom.
    pub dof: usize,
    pub p: f64,
}

/// Size of the model error beside its parameters, and the misfit with it.
#[derive(Debug, Clone, Serialize)]
#[allow(missing_docs, non_snake_case)]
pub struct ModelErrorRecord {
    /// The size in words; empty if the stated errors of a log's clock explain the residual.
    pub text: String,
    /// Standard deviation of an error of each sensor; it wanders in logs.
    pub wandering_K: f64,
    /// Correlation time of the wandering error over the length of a test.
    pub memory: f64,
    /// Standard deviation of a factor on all heats between tests.
    pub between_tests: f64,
    /// Chi-square with this model error.
    pub misfit: f64,
    pub dof: usize,
    pub p: f64,
}

/// The own error of a sensor.
#[derive(Debug, Clone, Serialize)]
#[allow(missing_docs, non_snake_case)]
pub struct SensorErrorRecord {
    /// Amount by which the sensor reads too high.
    pub value_K: f64,
    /// Stated standard deviation of the sensor's own error.
    pub stated_K: f64,
    /// Noise from reading to reading: as stated, or the scatter of the readings if it is larger and a model error was learnt.
    pub noise_K: f64,
}

/// A combination of parameters that the readings do not determine.
#[derive(Debug, Clone, Serialize)]
#[allow(missing_docs)]
pub struct UndeterminedRecord {
    pub text: String,
    pub weights: Vec<f64>,
    pub deviation: f64,
}

/// One reading, and what it is compared with.
#[derive(Debug, Clone, Serialize)]
#[allow(missing_docs)]
pub struct ReadingRecord<C> {
    pub test: String,
    pub time_s: Option<f64>,
    pub sensor: String,
    #[serde(flatten)]
    pub compared: C,
}

/// A reading beside its prediction, and measured less predicted.
#[derive(Debug, Clone, Serialize)]
#[allow(missing_docs, non_snake_case)]
#[serde(untagged)]
pub enum PredictedRecord {
    /// A temperature.
    Temperature { measured_degC: f64, predicted_degC: f64, residual_K: f64 },
    /// A displacement.
    Displacement { measured_um: f64, predicted_um: f64, residual_um: f64 },
}

/// A reading beside its predictions, before and after; the residual is measured less predicted after.
#[derive(Debug, Clone, Serialize)]
#[allow(missing_docs, non_snake_case)]
#[serde(untagged)]
pub enum BeforeAfterRecord {
    /// A temperature.
    Temperature { measured_degC: f64, before_degC: f64, after_degC: f64, residual_K: f64 },
    /// A displacement.
    Displacement { measured_um: f64, before_um: f64, after_um: f64, residual_um: f64 },
}

/// Root mean square of residuals before and after a change; left out for temperatures or displacements if there are none.
#[derive(Debug, Clone, Serialize)]
#[allow(missing_docs, non_snake_case)]
pub struct RmseRecord {
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rmse_before_K: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rmse_after_K: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rmse_before_um: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rmse_after_um: Option<f64>,
}

/// Readings that took no part.
#[derive(Debug, Clone, Serialize)]
#[allow(missing_docs)]
pub struct HeldOutRecord {
    /// Sentence on the choice.
    pub text: String,
    #[serde(flatten)]
    pub rmse: RmseRecord,
    pub tests: BTreeMap<String, RmseRecord>,
    pub sensors: BTreeMap<String, RmseRecord>,
    pub readings: Vec<ReadingRecord<BeforeAfterRecord>>,
}

/// A further test that would add information.
#[derive(Debug, Clone, Serialize)]
#[allow(missing_docs)]
pub struct NextTestRecord {
    pub condition: BTreeMap<String, String>,
    pub gain_nats: f64,
    pub shrink: Vec<f64>,
}

/// Readings that took no part, with predictions before and after, K.
#[derive(Debug, Clone)]
pub struct HeldOut {
    /// The readings.
    pub data: Data,
    /// Predictions of the machine file as it is.
    pub before: Vec<f64>,
    /// Predictions of the machine that was found.
    pub after: Vec<f64>,
    /// Sentence on the choice.
    pub words: String,
}

impl HeldOut {
    /// Readings held out of a fit, with predictions by `predict` of the machine before and of the one found.
    ///
    /// # Errors
    /// Errors of `predict`.
    pub fn of(divided: &DividedData, [before, after]: [&Study; 2], predict: impl Fn(&Study, &Data) -> Result<Vec<f64>>) -> Result<Self> {
        let predicted = |study: &Study| divided.predicted(|data| predict(study, data));
        Ok(Self { data: divided.data(), before: predicted(before)?, after: predicted(after)?, words: divided.words.clone() })
    }

    /// Readings held out of an identification, with predictions of the machine before and of the one found: on an endlessly fine
    /// mesh, if the numbers were found so.
    ///
    /// # Errors
    /// Errors of the predictions, and of the machine with the numbers found.
    pub fn identified(divided: &DividedData, problem: &IdentifyProblem, estimate: &Estimate) -> Result<Self> {
        let predict = |study: &Study, data: &Data| match estimate.mesh.is_none() {
            true => identify::values(study, data, problem.start),
            false => identify::continued(study, data, problem.start),
        };
        Self::of(divided, [&problem.study, &problem.machine_at(&estimate.values)?], predict)
    }

    /// Root mean squares of the readings for which `keep` holds, by row and sensor.
    fn rmse_of(&self, machine: &Machine, keep: impl Fn(usize, usize) -> bool) -> RmseRecord {
        let places = whiten::places(&self.data);
        let mut own = self.data.clone();
        places.iter().filter(|(r, k)| !keep(*r, *k)).for_each(|(r, k)| own.rows[*r].readings[*k] = None);
        let kept = |all: &[f64]| -> Vec<f64> { places.iter().zip(all).filter(|((r, k), _)| keep(*r, *k)).map(|(_, told)| *told).collect() };
        let (before, after) = (kept(&self.before), kept(&self.after));
        RmseRecord::of(|of, is_after| whiten::rmse(machine, &own, if is_after { &after } else { &before }, of))
    }

    /// Root mean squares of all readings.
    pub fn rmse(&self, machine: &Machine) -> RmseRecord {
        self.rmse_of(machine, |_, _| true)
    }

    /// Root mean squares of each sensor with a reading, in the order of the data.
    pub fn by_sensor(&self, machine: &Machine) -> Vec<(String, RmseRecord)> {
        let is_read = |k: &usize| self.data.rows.iter().any(|row| row.readings[*k].is_some());
        let of = |k: usize| (self.data.names[k].clone(), self.rmse_of(machine, |_, sensor| sensor == k));
        (0..self.data.names.len()).filter(is_read).map(of).collect()
    }

    /// Root mean squares of each test with a reading, in the order of the data.
    pub fn by_test(&self, machine: &Machine) -> Vec<(String, RmseRecord)> {
        let is_read = |test: &String| self.data.rows.iter().any(|row| row.test == *test && row.readings.iter().any(Option::is_some));
        let of = |test: String| {
            let rmse = self.rmse_of(machine, |r, _| self.data.rows[r].test == test);
            (test, rmse)
        };
        self.data.tests().into_iter().filter(is_read).map(of).collect()
    }

    /// The readings for other programs.
    pub fn record(&self, machine: &Machine) -> HeldOutRecord {
        HeldOutRecord {
            text: self.words.clone(),
            rmse: self.rmse(machine),
            tests: self.by_test(machine).into_iter().collect(),
            sensors: self.by_sensor(machine).into_iter().collect(),
            readings: readings(machine, &self.data, &self.before, &self.after),
        }
    }
}

impl Estimate {
    /// The estimate for other programs, with the profiles and tests that were computed for it.
    pub fn record(
        &self,
        problem: &IdentifyProblem,
        profiles: &[ParameterProfile],
        advice: &[Advice],
        held_out: Option<&HeldOut>,
    ) -> IdentifyRecord {
        let machine = &problem.study.model.machine;
        let parameter = |k: usize| {
            let p = &problem.free[k].parameter;
            let profile = profiles.iter().find(|f| f.parameter == k).map(|f| ProfileRecord {
                low: f.interval.0.map(|v| p.shown(v)),
                high: f.interval.1.map(|v| p.shown(v)),
                points: f.points.iter().map(|(v, rise)| [p.shown(*v), *rise]).collect(),
            });
            let record = ParameterRecord {
                unit: p.unit.clone(),
                before: p.shown(p.value),
                value: p.shown(self.values[k]),
                low: p.shown(self.intervals[k].0),
                high: p.shown(self.intervals[k].1),
                at_bound: self.at_bound[k],
                kept: self.kept[k],
                status: match (self.search_end, self.kept[k], self.at_bound[k]) {
                    (SearchEnd::NoStep | SearchEnd::StepLimit, ..) => "not_at_rest",
                    (SearchEnd::AtRest, true, _) => "not_determined",
                    (SearchEnd::AtRest, ..) if self.free[k].is_like_zero => "like_zero",
                    (SearchEnd::AtRest, false, true) => "at_bound",
                    (SearchEnd::AtRest, false, false) => "found",
                },
                profile,
            };
            (problem.free[k].name(), record)
        };
        let n = problem.free.len();
        let next = |a: &Advice| NextTestRecord {
            condition: a.condition.by_name(&problem.study.model.machine),
            gain_nats: a.gain,
            shrink: a.shrink.clone(),
        };
        let open = self.undetermined.iter();
        IdentifyRecord {
            parameters: (0..n).map(parameter).collect(),
            correlation: CorrelationRecord {
                names: problem.free.iter().map(Free::name).collect(),
                matrix: (0..n).map(|i| (0..n).map(|j| self.correlation[(i, j)]).collect()).collect(),
            },
            misfit: ChiSquareRecord { before: self.misfit.0, after: self.misfit.1, dof: self.freedom, p: self.probability },
            model_error: self.model_error.as_ref().map(|m| ModelErrorRecord {
                text: m.level.in_words(problem.data.is_transient()),
                wandering_K: m.level.wandering,
                memory: m.level.memory,
                between_tests: m.level.between_tests,
                misfit: m.misfit,
                dof: m.freedom,
                p: m.probability,
            }),
            widened: self.widened,
            mesh_K: self.mesh.largest(),
            sensor_errors: (self.sensor_errors.iter())
                .map(|e| {
                    let record = SensorErrorRecord { value_K: e.value, stated_K: e.stated, noise_K: e.noise };
                    (problem.data.names[e.sensor].clone(), record)
                })
                .collect(),
            undetermined: open
                .map(|u| UndeterminedRecord { text: u.text.clone(), weights: u.weights.clone(), deviation: u.deviation })
                .collect(),
            readings: readings(machine, &problem.data, &self.predictions.0, &self.predictions.1),
            held_out: held_out.map(|own| own.record(machine)),
            next_tests: advice.iter().take(5).map(next).collect(),
            starts: self.ends.clone(),
            search: SearchRecord {
                ended: self.search_end.key(),
                wider: self.wider.map(|w| WiderRecord { points: w.points, before: w.before, after: w.after }),
            },
            machine: None,
            evaluations: self.evaluations,
            off_in_full_K: self.off_in_full,
            faults: Vec::new(),
            account: problem.data.account(),
            seconds: 0.0,
        }
    }
}

impl RmseRecord {
    /// Record of the root mean squares (K or um) that `rmse` gives by the measurand, and whether after the change.
    pub fn of(rmse: impl Fn(Measurand, bool) -> Option<f64>) -> Self {
        Self {
            rmse_before_K: rmse(Measurand::Temperature, false),
            rmse_after_K: rmse(Measurand::Temperature, true),
            rmse_before_um: rmse(Measurand::Displacement, false),
            rmse_after_um: rmse(Measurand::Displacement, true),
        }
    }
}

impl<C> ReadingRecord<C> {
    /// Records of all readings of some data: rows, then sensors, missing ones left out. `compared` gets the index of a reading
    /// and its measurand.
    pub fn all(machine: &Machine, data: &Data, compared: impl Fn(usize, Measurand) -> C) -> Vec<Self> {
        let measurands = data.measurands(machine);
        let of = |(i, (r, k)): (usize, &(usize, usize))| Self {
            test: data.rows[*r].test.clone(),
            time_s: data.rows[*r].time,
            sensor: data.names[*k].clone(),
            compared: compared(i, measurands[*k]),
        };
        whiten::places(data).iter().enumerate().map(of).collect()
    }
}

impl PredictedRecord {
    /// Comparison of two readings, K or um.
    pub fn of(measurand: Measurand, measured: f64, predicted: f64) -> Self {
        let residual = measured - predicted;
        let [measured, predicted] = [measured, predicted].map(|reading| measurand.shown(reading));
        match measurand {
            Measurand::Temperature => Self::Temperature { measured_degC: measured, predicted_degC: predicted, residual_K: residual },
            Measurand::Displacement => Self::Displacement { measured_um: measured, predicted_um: predicted, residual_um: residual },
        }
    }
}

fn readings(machine: &Machine, data: &Data, before: &[f64], after: &[f64]) -> Vec<ReadingRecord<BeforeAfterRecord>> {
    let measured = whiten::readings(data);
    ReadingRecord::all(machine, data, |i, own| {
        let residual = measured[i] - after[i];
        let [measured, before, after] = [measured[i], before[i], after[i]].map(|reading| own.shown(reading));
        match own {
            Measurand::Temperature => {
                BeforeAfterRecord::Temperature { measured_degC: measured, before_degC: before, after_degC: after, residual_K: residual }
            }
            Measurand::Displacement => {
                BeforeAfterRecord::Displacement { measured_um: measured, before_um: before, after_um: after, residual_um: residual }
            }
        }
    })
}
