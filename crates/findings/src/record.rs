//! A diagnosis as outside programs read it: each field is a key of `coldplate diagnose --json`. Numbers that are not finite
//! become `null`.

use std::collections::BTreeMap;

use serde::Serialize;

use super::energy::ConditionBalance;
pub use super::estimate::EstimateRecord;
use super::extended::KeyChange;
use super::next::{NextRecord, by_name};
use super::places::{self, PlacesRecord};
use super::refit::{AgainstReadings, RefittedSurrogate};
use super::{Findings, ladder, name};
use coldplate_base::units::Measurand;
use coldplate_diagnose::{Cause, Explanation, Gain, Looseness, Problem, Rung, sentence};
use coldplate_evidence::faulty_readings::{Fault, FaultRecord};
use coldplate_evidence::measurement::AccountRecord;
use coldplate_evidence::measurement::whiten;
use coldplate_evidence::record::{HeldOutRecord, PredictedRecord, ReadingRecord, RmseRecord};
use coldplate_solve::meshed::Flows;

/// The whole answer.
#[derive(Debug, Clone, Serialize)]
#[non_exhaustive]
#[allow(missing_docs, non_snake_case)]
pub struct DiagnosisRecord {
    pub misfit: MisfitRecord,
    pub verdict: &'static str,
    pub headline: String,
    pub level: LevelRecord,
    /// Probabilities of the best explanation: of its place, of its kind there, and of its law.
    pub certainty: Vec<LevelRecord>,
    pub probabilities: OtherwiseRecord,
    /// The parts of the best explanation; empty where no cause is named.
    pub causes: Vec<CauseRecord>,
    /// The machine that is written: its causes, and the numbers that the readings draw beside them.
    pub rungs: Vec<RungRecord>,
    /// Every explanation that the data cannot refute.
    pub set: Vec<Vec<CauseRecord>>,
    pub next_measurement: Option<NextRecord>,
    pub gain: Option<GainRecord>,
    /// Path of the extended machine.
    pub extended_machine: Option<String>,
    pub changes: Option<Vec<KeyChange>>,
    pub surrogate: Option<SurrogateRecord>,
    /// Causes that were composed.
    pub tried: usize,
    /// Causes that could show in these data.
    pub visible: usize,
    pub missing_heat: Vec<MissingHeatRecord>,
    pub heat_balance: Vec<HeatBalanceRecord>,
    pub readings: Vec<ExplainedReadingRecord>,
    /// Readings that were held out of everything.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub held_out: Option<HeldOutRecord>,
    /// Places and kinds by their amplitudes in every row.
    pub amplitudes: PlacesRecord,
    /// Faulty readings that were found.
    pub faults: Vec<FaultRecord>,
    /// Account of the data: lines and readings that count, and those that do not.
    pub account: AccountRecord,
    /// Steps behind the diagnosis that failed, with the reason.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub failed: Vec<String>,
    /// Share of the stated noise that the readings of a table show, if the stated noise is far too large; 1
    /// otherwise.
    pub noise_share: f64,
    /// Largest difference, K, between the end result's predictions on the reduced model and those of full solves; null with `--full`
    /// and for logs.
    pub off_in_full_K: Option<f64>,
    pub seconds: f64,
}

/// Agreement of the machine as it is with the readings.
#[derive(Debug, Clone, Serialize)]
#[allow(missing_docs)]
pub struct MisfitRecord {
    pub chi2: f64,
    /// Degrees of freedom.
    pub dof: usize,
    /// Probability of a misfit as large by noise alone.
    pub p: f64,
    /// Posterior probability that no cause acts.
    pub p_look_elsewhere: f64,
}

/// Probability of one level of the best explanation.
#[derive(Debug, Clone, Serialize)]
#[allow(missing_docs)]
pub struct LevelRecord {
    pub name: String,
    pub what: String,
    pub probability: f64,
}

/// Probabilities beside those of causes.
#[derive(Debug, Clone, Serialize)]
#[allow(missing_docs)]
pub struct OtherwiseRecord {
    pub nothing: f64,
    pub something_else: f64,
}

/// One part of an explanation.
#[derive(Debug, Clone, Serialize)]
#[allow(missing_docs)]
pub struct CauseRecord {
    pub kind: String,
    pub place: String,
    pub law: String,
    pub parameters: BTreeMap<String, EstimateRecord>,
    pub amplitude: EstimateRecord,
    pub probability: f64,
    pub misfit_left: f64,
    pub text: String,
    /// Other explanations that the data cannot refute.
    pub ambiguous_with: Vec<String>,
}

/// A step of the ladder.
#[derive(Debug, Clone, Serialize)]
#[allow(missing_docs, non_snake_case)]
pub struct RungRecord {
    pub causes: Vec<RungCauseRecord>,
    /// Numbers of the machine file that were fitted beside it.
    pub refitted: Vec<RungCauseRecord>,
    /// Share of the given machine's squared misfit that is explained up to here.
    pub share: f64,
    /// Share explained by each cause alone, if there are two.
    pub share_alone: Vec<f64>,
    /// Remaining root mean square residual, K.
    pub left_K: f64,
    /// Sensor with the largest share of the remaining residual.
    pub where_left: Option<String>,
    /// Share of that sensor.
    pub where_left_share: Option<f64>,
    pub discrepancy: DiscrepancyRecord,
    pub gain: Option<GainRecord>,
    /// Causes that the extended machine leaves out, for a machine file has no words for them.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub not_in_extended_machine: Vec<String>,
    pub text: String,
}

/// A cause of a rung, or a number fitted beside it.
#[derive(Debug, Clone, Serialize)]
#[allow(missing_docs)]
pub struct RungCauseRecord {
    pub kind: String,
    pub place: String,
    pub law: String,
    pub amplitude: EstimateRecord,
    /// Distance from zero, in standard deviations of its prior.
    pub pulled_sigma: f64,
    pub text: String,
}

/// Looseness of the model beside the causes.
#[derive(Debug, Clone, Serialize)]
#[allow(missing_docs, non_snake_case)]
pub struct DiscrepancyRecord {
    /// Spread of the numbers of the machine file, standard deviation of their logarithms.
    pub numbers: f64,
    /// Heat in every part, new in every row: standard deviation as a share of the machine's mean heat.
    pub disturbance: f64,
    /// Level of all heats, new in every row of a table and in every test of a log: standard deviation as a share of them.
    pub level: f64,
    /// Further error of each condition, new in every row of a table: standard deviation as a multiple of what is stated.
    pub conditions: f64,
    /// Error of each sensor of a log that wanders with the time: standard deviation, K.
    pub wandering_K: f64,
    /// Noise of readings and biases of sensors, as multiples of what is stated.
    pub noise: f64,
}

/// Gain on conditions that the search did not see.
#[derive(Debug, Clone, Serialize)]
#[allow(missing_docs, non_snake_case)]
pub struct GainRecord {
    #[serde(flatten)]
    pub rmse: RmseRecord,
    /// Lower end of the 90 % interval of the gain, K.
    pub low: f64,
    /// Upper end, K.
    pub high: f64,
    pub noise_floor_K: f64,
    pub held_out: Vec<String>,
}

/// The surrogate of the extended machine.
#[derive(Debug, Clone, Serialize)]
#[allow(missing_docs, non_snake_case)]
pub struct SurrogateRecord {
    pub file: String,
    pub conditions: usize,
    pub failed: usize,
    pub held_out_max_K: Option<f64>,
    pub error_before_K: Option<f64>,
    pub error_after_K: Option<f64>,
    pub readings: Option<usize>,
    pub readings_outside: Option<usize>,
}

/// Heat that is missing in a part.
#[derive(Debug, Clone, Serialize)]
#[allow(missing_docs, non_snake_case)]
pub struct MissingHeatRecord {
    pub part: String,
    /// Alike at all conditions; negative where the model has too much.
    pub W: f64,
    pub standard_deviation_W: f64,
    pub misfit_explained: f64,
}

/// The heat balance of one condition.
#[derive(Debug, Clone, Serialize)]
#[allow(missing_docs)]
pub struct HeatBalanceRecord {
    pub test: String,
    pub condition: BTreeMap<String, String>,
    pub before: FlowsRecord,
    pub after: Option<FlowsRecord>,
    pub water: Vec<WaterRecord>,
}

/// Heat in and out by name.
#[derive(Debug, Clone, Serialize)]
#[allow(missing_docs, non_snake_case)]
pub struct FlowsRecord {
    pub in_W: BTreeMap<String, f64>,
    pub out_W: BTreeMap<String, f64>,
}

/// Heat that the water of a circuit takes.
#[derive(Debug, Clone, Serialize)]
#[allow(missing_docs, non_snake_case)]
pub struct WaterRecord {
    pub circuit: String,
    pub measured_W: f64,
    pub standard_deviation_W: f64,
    pub before_W: f64,
    pub after_W: Option<f64>,
}

/// One reading, its predictions and residual.
#[derive(Debug, Clone, Serialize)]
#[allow(missing_docs, non_snake_case)]
pub struct ExplainedReadingRecord {
    #[serde(flatten)]
    pub reading: ReadingRecord<PredictedRecord>,
    /// The whitened residual, in standard deviations.
    pub whitened: f64,
    /// Prediction of the best explanation.
    pub explained_degC: Option<f64>,
    /// Prediction of the best explanation for a displacement.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub explained_um: Option<f64>,
}

impl Findings<'_> {
    /// The whole answer for other programs.
    pub fn record(&self) -> DiagnosisRecord {
        let diagnosis = &self.diagnosis;
        let misfit = &diagnosis.misfit;
        DiagnosisRecord {
            misfit: MisfitRecord { chi2: misfit.chi2, dof: misfit.freedom, p: misfit.probability, p_look_elsewhere: misfit.look_elsewhere },
            verdict: diagnosis.verdict.code(),
            headline: self.headline(),
            level: LevelRecord::of(&diagnosis.level),
            certainty: diagnosis.certainties.iter().map(LevelRecord::of).collect(),
            probabilities: OtherwiseRecord { nothing: diagnosis.others.nothing, something_else: diagnosis.others.something_else },
            causes: diagnosis
                .explanations
                .first()
                .filter(|_| diagnosis.verdict.names_causes())
                .map(|e| causes(self, e))
                .unwrap_or_default(),
            rungs: diagnosis.rungs.iter().map(|rung| RungRecord::of(self, rung)).collect(),
            set: self.open().into_iter().map(|e| causes(self, e)).collect(),
            next_measurement: diagnosis.next.split_first().map(|(best, others)| NextRecord {
                others: Some(others.iter().map(|n| NextRecord::of(self.problem, n)).collect()),
                ..NextRecord::of(self.problem, best)
            }),
            gain: diagnosis.gain.as_ref().map(|gain| GainRecord::of(self, gain)),
            extended_machine: self.extended.as_ref().map(|e| e.path.display().to_string()),
            changes: self.extended.as_ref().map(|e| e.changes.clone()),
            surrogate: self.refitted.as_ref().and_then(|r| r.fit.as_ref()).map(SurrogateRecord::of),
            tried: diagnosis.tried.all,
            visible: diagnosis.tried.visible,
            held_out: None,
            amplitudes: places::record(self),
            missing_heat: (diagnosis.missing.iter())
                .map(|m| MissingHeatRecord {
                    part: m.part.clone(),
                    W: m.watts,
                    standard_deviation_W: m.deviation,
                    misfit_explained: m.explained,
                })
                .collect(),
            heat_balance: self.energy.balances.iter().map(|b| HeatBalanceRecord::of(self.problem, b)).collect(),
            readings: readings(self),
            faults: self.problem.faults.iter().map(Fault::record).collect(),
            account: self.problem.data.account(),
            failed: self.failed.clone(),
            noise_share: diagnosis.noise_share,
            off_in_full_K: diagnosis.off_in_full,
            seconds: diagnosis.seconds,
        }
    }
}

impl GainRecord {
    fn of(found: &Findings<'_>, g: &Gain) -> Self {
        let (data, residuals) = (&found.problem.data, &found.diagnosis.residuals);
        let (measured, measurands) = (whiten::readings(data), data.measurands(&found.problem.study.model.machine));
        let has_displacements = measurands.contains(&Measurand::Displacement);
        let rmse = |of: Measurand, is_after: bool| {
            if !has_displacements {
                return (of == Measurand::Temperature).then_some(if is_after { g.after } else { g.before });
            }
            let share = if is_after { 1.0 } else { 0.0 };
            let own = whiten::places(data).into_iter().enumerate().filter(|(_, (_, k))| measurands[*k] == of);
            let left = own.map(|(i, _)| measured[i] - residuals.predicted[i] - share * g.readings[i].change);
            let (sum, count) = left.fold((0.0, 0_usize), |(sum, count), r| (sum + r * r, count + 1));
            (count > 0).then(|| (sum / count as f64).sqrt())
        };
        Self { rmse: RmseRecord::of(rmse), low: g.low, high: g.high, noise_floor_K: g.noise_floor, held_out: g.conditions.clone() }
    }
}

impl RungRecord {
    fn of(found: &Findings<'_>, rung: &Rung) -> Self {
        let Looseness { spread, disturbance, level, conditions, wandering, noise } = rung.left;
        Self {
            causes: rung.causes.iter().map(RungCauseRecord::of).collect(),
            refitted: rung.refitted.iter().map(RungCauseRecord::of).collect(),
            share: rung.share,
            share_alone: rung.alone.clone(),
            left_K: rung.rms,
            where_left: rung.where_left.as_ref().map(|left| left.sensor.clone()),
            where_left_share: rung.where_left.as_ref().map(|left| left.share),
            discrepancy: DiscrepancyRecord { numbers: spread, disturbance, level, conditions, wandering_K: wandering, noise },
            gain: rung.gain.as_ref().map(|gain| GainRecord::of(found, gain)),
            not_in_extended_machine: rung.left_out.as_ref().map_or_else(Vec::new, |own| own.causes.clone()),
            text: format!("{}; {}", ladder::words(rung), ladder::left(rung)),
        }
    }
}

impl LevelRecord {
    fn of(level: &coldplate_diagnose::Level) -> Self {
        Self { name: level.certainty.code().into(), what: level.what.clone(), probability: level.probability }
    }
}

impl RungCauseRecord {
    fn of(cause: &Cause) -> Self {
        let (low, high) = cause.interval();
        Self {
            kind: cause.hypothesis.kind().into(),
            place: cause.hypothesis.place.clone(),
            law: cause.hypothesis.law_words(),
            amplitude: EstimateRecord { value: cause.amplitude, low, high, unit: cause.hypothesis.unit.into() },
            pulled_sigma: cause.amplitude / cause.hypothesis.scale,
            text: sentence(cause),
        }
    }
}

fn causes(found: &Findings<'_>, explanation: &Explanation) -> Vec<CauseRecord> {
    let others: Vec<String> = found.open().into_iter().filter(|o| *o != explanation).map(name).collect();
    let mut records = Vec::new();
    for p in &explanation.causes {
        let shown = p.shown();
        let (low, high) = p.interval();
        let own = EstimateRecord { value: shown.value, low: shown.low, high: shown.high, unit: shown.unit.into() };
        let of_law = p.hypothesis.number.as_ref().map(|n| {
            let estimate = EstimateRecord { value: n.value, low: n.low, high: n.high, unit: n.unit.into() };
            (n.name.to_string(), estimate)
        });
        records.push(CauseRecord {
            kind: p.hypothesis.kind().into(),
            place: p.hypothesis.place.clone(),
            law: p.hypothesis.law_words(),
            parameters: [(shown.name.into(), own)].into_iter().chain(of_law).collect(),
            amplitude: EstimateRecord { value: p.amplitude, low, high, unit: p.hypothesis.unit.into() },
            probability: explanation.probability,
            misfit_left: explanation.misfit,
            text: sentence(p),
            ambiguous_with: others.clone(),
        });
    }
    records
}

impl SurrogateRecord {
    fn of(fit: &RefittedSurrogate) -> Self {
        let of = |value: fn(&AgainstReadings) -> f64| fit.readings.as_ref().map(value);
        Self {
            file: fit.path.display().to_string(),
            conditions: fit.conditions,
            failed: fit.failed,
            held_out_max_K: fit.largest,
            error_before_K: of(|r| r.before),
            error_after_K: of(|r| r.after),
            readings: fit.readings.map(|r| r.counted),
            readings_outside: fit.readings.map(|r| r.outside),
        }
    }
}

impl HeatBalanceRecord {
    fn of(problem: &Problem, balance: &ConditionBalance) -> Self {
        let water = |w: &super::energy::WaterHeat| WaterRecord {
            circuit: w.circuit.clone(),
            measured_W: w.measured,
            standard_deviation_W: w.deviation,
            before_W: w.before,
            after_W: w.after,
        };
        Self {
            test: balance.test.clone(),
            condition: by_name(problem, &balance.condition),
            before: FlowsRecord::of(&balance.before),
            after: balance.after.as_ref().map(FlowsRecord::of),
            water: balance.water.iter().map(water).collect(),
        }
    }
}

impl FlowsRecord {
    fn of(flows: &Flows) -> Self {
        Self { in_W: flows.sources.iter().cloned().collect(), out_W: flows.sinks.iter().cloned().collect() }
    }
}

fn readings(found: &Findings<'_>) -> Vec<ExplainedReadingRecord> {
    let (machine, data, diagnosis) = (&found.problem.study.model.machine, &found.problem.data, &found.diagnosis);
    let (measured, measurands) = (whiten::readings(data), data.measurands(machine));
    let compared = |i: usize, own: Measurand| PredictedRecord::of(own, measured[i], diagnosis.residuals.predicted[i]);
    let records = ReadingRecord::all(machine, data, compared).into_iter().zip(whiten::places(data)).enumerate();
    let of = |(i, (reading, (_, k)))| {
        let explained = |of: Measurand| diagnosis.explained.as_ref().filter(|_| measurands[k] == of).map(|e| of.shown(e[i]));
        ExplainedReadingRecord {
            reading,
            whitened: diagnosis.residuals.whitened[i],
            explained_degC: explained(Measurand::Temperature),
            explained_um: explained(Measurand::Displacement),
        }
    };
    records.map(of).collect()
}
