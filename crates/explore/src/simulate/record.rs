//! A simulation as outside programs read it: each field is a key of `coldplate simulate --json`.

use std::collections::BTreeMap;

use serde::Serialize;

use super::drift::{Drift, Tilt};
use super::{FirstPassings, History, LimitCourse, Passed, SimulatedMachine};
use coldplate_base::units::Measurand;

/// Temperatures over time.
#[derive(Debug, Clone, Serialize)]
#[non_exhaustive]
#[allow(missing_docs, non_snake_case)]
pub struct HistoryRecord {
    pub sensors: BTreeMap<String, CourseRecord>,
    /// Largest distance from the steady state of the last condition that counts as settled.
    pub within_K: f64,
    /// Largest such distance for displacements; left out if there is none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub within_um: Option<f64>,
    /// Time after the start at which all sensors have settled.
    pub within_s: Option<f64>,
    /// `time_s`, and readings by sensor, degC.
    pub series: BTreeMap<String, Vec<f64>>,
    /// Bound on the distance of each temperature from that of the full model; of reduced models alone.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub bounds_K: Option<BTreeMap<String, Vec<f64>>>,
    /// Bound on the distance of each displacement from that of the full model; left out if there is none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub bounds_um: Option<BTreeMap<String, Vec<f64>>>,
    /// Heat by heat-flow sensor, W, at the times of the series; left out if there is none.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub heat_flows: BTreeMap<String, Vec<f64>>,
    /// Drift of the displacements; left out if there is none.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub drifts: Vec<Drift>,
    /// Drift of the angles that two displacements tell; left out if there is none.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub tilts: Vec<Tilt>,
    /// First passings of the watched temperatures.
    pub passes: Vec<PassRecord>,
    /// Largest values of the machine's limits, in its order.
    pub limits: Vec<LimitCourseRecord>,
    pub steps: usize,
    pub rejected: usize,
    pub energy: EnergyRecord,
    pub unknowns: usize,
    pub resumed_at_s: Option<f64>,
    /// Doubts about the run.
    pub notes: Vec<String>,
    pub seconds: f64,
}

/// Course of one sensor.
#[derive(Debug, Clone, Serialize)]
#[allow(missing_docs, non_snake_case)]
#[serde(untagged)]
pub enum CourseRecord {
    /// Course of a temperature.
    Temperature { start_degC: Option<f64>, end_degC: Option<f64>, steady_degC: Option<f64>, within_s: Option<f64> },
    /// Course of a displacement.
    Displacement { start_um: Option<f64>, end_um: Option<f64>, steady_um: Option<f64>, within_s: Option<f64> },
}

/// A watched temperature; times on the schedule's clock.
#[derive(Debug, Clone, Serialize)]
#[allow(missing_docs, non_snake_case)]
pub struct PassRecord {
    pub sensor: String,
    /// Value of a temperature.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub value_degC: Option<f64>,
    /// Value of a displacement.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub value_um: Option<f64>,
    /// First time from below.
    pub rising_s: Option<f64>,
    /// First time from above.
    pub falling_s: Option<f64>,
    /// Bounds on the error of these times; of models with a bound alone.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rising_within_s: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub falling_within_s: Option<f64>,
}

/// A limit over the run; values in its unit, times on the schedule's clock.
#[derive(Debug, Clone, Serialize)]
#[allow(missing_docs)]
pub struct LimitCourseRecord {
    pub name: String,
    pub unit: &'static str,
    /// Largest value seen.
    pub largest: f64,
    /// Largest value allowed.
    pub limit: f64,
    /// Distance of the largest value from the limit, K or um; negative if the limit was broken.
    pub margin: f64,
    /// Time of the largest value.
    pub at_s: f64,
    /// Time at which the limit was broken first.
    pub first_broken_s: Option<f64>,
    /// Bounds on the error of the largest value, K or um, and of the time of breaking; of models with a bound alone.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub bound: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub first_broken_within_s: Option<f64>,
}

impl From<&LimitCourse> for LimitCourseRecord {
    fn from(own: &LimitCourse) -> Self {
        Self {
            name: own.largest.name.clone(),
            unit: own.largest.unit(),
            largest: own.largest.shown(own.largest.value),
            limit: own.largest.shown(own.largest.maximum),
            margin: own.largest.margin(),
            at_s: own.at,
            first_broken_s: own.first_broken.map(|passed| passed.at),
            bound: own.bound,
            first_broken_within_s: own.first_broken.and_then(|passed| passed.within),
        }
    }
}

/// Heat since the beginning.
#[derive(Debug, Clone, Serialize)]
#[allow(missing_docs, non_snake_case)]
pub struct EnergyRecord {
    pub entered_J: f64,
    pub left_J: f64,
    pub stored_J: f64,
    pub relative: f64,
}

impl History {
    /// The history of `model` for other programs; `seconds` is the time that the run took.
    pub fn record(&self, model: &SimulatedMachine<'_>, seconds: f64) -> HistoryRecord {
        let names = || model.sensors.iter().enumerate();
        let course = |(s, name): (usize, &String)| {
            let own = model.measurands[s];
            let of = |readings: Option<&Vec<f64>>| readings.map(|r| own.shown(r[s]));
            let (start, end, steady) = (of(self.readings.first()), of(self.readings.last()), of(self.steady.as_ref().ok()));
            let within_s = self.settled[s];
            let record = match own {
                Measurand::Temperature => CourseRecord::Temperature { start_degC: start, end_degC: end, steady_degC: steady, within_s },
                Measurand::Displacement => CourseRecord::Displacement { start_um: start, end_um: end, steady_um: steady, within_s },
            };
            (name.clone(), record)
        };
        let shown = |s: usize| self.readings.iter().map(|r| model.measurands[s].shown(r[s])).collect();
        let mut series: BTreeMap<String, Vec<f64>> = names().map(|(s, name)| (name.clone(), shown(s))).collect();
        series.entry("time_s".into()).or_insert_with(|| self.times.clone());
        let watched = |c: &FirstPassings, of: Measurand| (model.measurands[c.watch.sensor] == of).then(|| of.shown(c.watch.value));
        let has_displacements = model.measurands.contains(&Measurand::Displacement);
        let bounds = |of: Measurand| {
            let all = self.bounds.as_ref()?;
            let own = names().filter(|(s, _)| model.measurands[*s] == of);
            Some(own.map(|(s, name)| (name.clone(), all.iter().map(|row| row[s]).collect())).collect())
        };
        let within = |passed: Option<Passed>| passed.and_then(|passed| passed.within);
        let pass = |c: &FirstPassings| PassRecord {
            sensor: model.sensors[c.watch.sensor].clone(),
            value_degC: watched(c, Measurand::Temperature),
            value_um: watched(c, Measurand::Displacement),
            rising_s: c.rising.map(|passed| passed.at),
            falling_s: c.falling.map(|passed| passed.at),
            rising_within_s: within(c.rising),
            falling_within_s: within(c.falling),
        };
        HistoryRecord {
            sensors: names().map(course).collect(),
            within_K: self.within,
            within_um: has_displacements.then_some(self.within),
            within_s: self.settled_overall(),
            series,
            bounds_K: bounds(Measurand::Temperature),
            bounds_um: bounds(Measurand::Displacement).filter(|_| has_displacements),
            heat_flows: (model.meters.iter().enumerate())
                .map(|(m, meter)| (meter.name.clone(), self.heat_flows.iter().map(|heats| heats[m]).collect()))
                .collect(),
            drifts: self.drifts(model),
            tilts: self.tilts(model),
            passes: self.passes.iter().map(pass).collect(),
            limits: self.limits.iter().map(LimitCourseRecord::from).collect(),
            steps: self.steps,
            rejected: self.rejected,
            energy: EnergyRecord {
                entered_J: self.energy.entered,
                left_J: self.energy.left,
                stored_J: self.energy.stored,
                relative: self.energy.relative(),
            },
            unknowns: model.nodes,
            resumed_at_s: self.resumed_at,
            notes: self.notes.clone(),
            seconds,
        }
    }
}
