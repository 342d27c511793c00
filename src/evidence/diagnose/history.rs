//! What each hypothesis would do to logs, to first order.
//!
//! A history of the machine is linearised in the few unknowns that the sensors can see ([`Basis`]); there every hypothesis costs
//! a few small products per step. Where the water stores much of the heat, fronts run through it that no few unknowns follow: there,
//! and for what acts on no node, a signature is the difference of two runs.

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::effects::{EffectDerivatives, Hypothesis, Law, Scales, UserKind};
use super::signature::{Signatures, difference};
use crate::describe::machine::Condition;
use crate::discretise::network::Load;
use crate::error::Result;
use crate::evidence::identify::{self, Prediction, own_key};
use crate::evidence::measurement::{Data, whiten};
use crate::explore::simulate::Start;
use crate::solve::sensitivity::{Basis, Course, Derivatives, Disturbance, Moment, Parameter, Study, Variation};

/// Amplitudes of differences of runs, as a share of the prior's scale: what acts one way only, or moves a front, is followed
/// along a secant about as long as it is likely to be; the rest along a slope.
const SECANT: f64 = 0.5;
const STEP: f64 = 0.1;
/// Error allowed in each time step of a log, K, well below what every model leaves open.
pub const TIME_TOLERANCE: f64 = 0.01;
/// What changes no reading by more than this many of them, for an amplitude of the prior's scale, is the solver's own error.
const VISIBLE: f64 = 3.0;
/// Water that stores more than this share of all heat makes fronts that count.
const FRONTS: f64 = 0.25;
/// Disturbances followed at a time.
const TOGETHER: usize = 32;

/// Signatures of logs.
///
/// # Errors
/// The machine as it is cannot be run through the data's conditions.
pub fn logs(
    study: &Study,
    data: &Data,
    start: Start,
    uncertain: &[Parameter],
    hypotheses: &[Hypothesis],
    scales: &Scales,
    user: &[UserKind],
) -> Result<Signatures> {
    let logs = Logs { study, data, start, scales, user };
    // A state that is steady but for some parts is no state of rest to linearise about.
    let is_rest = start != Start::Steady || !study.model.machine.has_starts();
    if is_rest && !has_fronts(study, data)? {
        let (values, mut histories) = identify::histories(study, data, start, TIME_TOLERANCE)?;
        let turns = scales.turns(hypotheses.iter().map(|h| h.law));
        for moments in &mut histories {
            look_at(&turns, moments, study)?;
        }
        // A machine without a path to any given temperature, or readings of inlets alone, have no such unknowns.
        if let Ok(followed) = logs.follow(&histories, uncertain, hypotheses) {
            let residual = difference(&whiten::readings(data), &values);
            let finish = |(h, column): (&Hypothesis, Option<Vec<f64>>)| column.unwrap_or_else(|| logs.run(h, &values, &residual));
            let columns = hypotheses.par_iter().zip(followed.columns).map(finish).collect();
            let prediction = Prediction { values, slopes: followed.slopes, conditions: followed.conditions };
            return Ok(Signatures { residual, prediction, fields: Vec::new(), columns });
        }
    }
    let prediction = identify::predict_within(study, data, uncertain, start, TIME_TOLERANCE)?;
    let residual = difference(&whiten::readings(data), &prediction.values);
    let columns = hypotheses.par_iter().map(|h| logs.run(h, &prediction.values, &residual)).collect();
    Ok(Signatures { residual, prediction, fields: Vec::new(), columns })
}

/// Whether these are logs in which fronts count: the water of the circuits stores much of all the heat.
///
/// # Errors
/// A condition cannot be evaluated.
pub fn has_fronts(study: &Study, data: &Data) -> Result<bool> {
    let network = &study.model.network;
    let Some(row) = data.rows.first().filter(|_| data.is_transient()) else { return Ok(false) };
    let load = Load::at(&study.model.machine, &row.condition)?;
    let mut water = 0.0;
    for stream in &network.streams {
        let liquid = network.circuits[stream.circuit].circuit.liquid.at(load.inlets[stream.circuit])?;
        water += 0.25 * std::f64::consts::PI * stream.diameter.powi(2) * stream.length * liquid.density * liquid.specific_heat;
    }
    Ok(water > FRONTS * (water + network.capacity.iter().sum::<f64>()))
}

/// Adds moments at given times (s, rising) to those between which a history runs about straight.
fn look_at(times: &[f64], moments: &mut Vec<Moment>, study: &Study) -> Result<()> {
    for time in times {
        let later = moments.partition_point(|m| m.time < *time);
        let (Some(before), Some(after)) = (later.checked_sub(1).and_then(|i| moments.get(i)), moments.get(later)) else { continue };
        if after.time <= *time {
            continue;
        }
        let share = (time - before.time) / (after.time - before.time);
        let between = |a: &[f64], b: &[f64]| -> Vec<f64> { a.iter().zip(b).map(|(a, b)| a + share * (b - a)).collect() };
        let condition = Condition::from_si(between(before.condition.si(), after.condition.si()));
        let load = Load::at(&study.model.machine, &condition)?;
        let temperatures = between(&before.temperatures, &after.temperatures);
        moments.insert(later, Moment { time: *time, condition, load, temperatures });
    }
    Ok(())
}

/// The machine and its logs.
struct Logs<'a> {
    study: &'a Study,
    data: &'a Data,
    start: Start,
    scales: &'a Scales,
    user: &'a [UserKind],
}

impl Logs<'_> {
    /// What a hypothesis does per unit of its amplitude: the difference of a run with it and one of the machine as it is.
    fn run(&self, h: &Hypothesis, values: &[f64], residual: &[f64]) -> Vec<f64> {
        if !h.is_bent() {
            return self.along(h, h.scale * if h.is_signed { STEP } else { SECANT }, values);
        }
        // More and less bend differently: the secant of the sign that the readings ask for.
        let explains = |column: &Vec<f64>, sign: f64| -> f64 {
            let (dot, square) = column.iter().zip(residual).fold((0.0, 0.0), |(d, s), (c, r)| (d + c * r, s + c * c));
            if square > 0.0 { (sign * dot).max(0.0).powi(2) / square } else { 0.0 }
        };
        let (more, less) = (self.along(h, SECANT * h.scale, values), self.along(h, -SECANT * h.scale, values));
        if explains(&less, -1.0) > explains(&more, 1.0) { less } else { more }
    }

    fn along(&self, h: &Hypothesis, step: f64, values: &[f64]) -> Vec<f64> {
        let none = || vec![0.0; values.len()];
        let moved = match h.sets(self.study, self.scales, self.user, step) {
            Ok(Some(sets)) if sets.is_empty() => Ok(values.to_vec()),
            Ok(Some(sets)) => {
                self.study.edited(&sets).and_then(|study| identify::values_within(&study, self.data, self.start, TIME_TOLERANCE))
            }
            _ => return none(),
        };
        let Ok(moved) = moved else { return none() };
        let column: Vec<f64> = h.read(self.data, &moved, step).iter().zip(values).map(|(a, b)| (a - b) / step).collect();
        let shows = h.is_sensor() || column.iter().any(|c| (c * h.scale).abs() > VISIBLE * TIME_TOLERANCE);
        if shows { column } else { none() }
    }

    /// Follows hypotheses and parameters along histories, in few unknowns.
    fn follow(&self, histories: &[Vec<Moment>], uncertain: &[Parameter], hypotheses: &[Hypothesis]) -> Result<Followed> {
        let (study, data) = (self.study, self.data);
        let variables = study.model.machine.variables.iter().map(|v| study.parameter(&v.name)).collect::<Result<Vec<_>>>()?;
        let variations: Vec<Variation> = uncertain.iter().chain(&variables).map(|p| study.variation(p)).collect::<Result<_>>()?;
        let basis = Basis::new(study, &data.sensors, &histories.iter().flatten().collect::<Vec<_>>(), rates(data))?;
        let derivatives = EffectDerivatives::new(study, hypotheses, self.user);
        let linearised = |moment: &Moment| -> Result<At> {
            let at = Derivatives::at(study, &moment.condition, &moment.temperatures)?;
            let screen = at.screen();
            let of_effect = |effect: Option<Disturbance>| -> Option<Projected> {
                let effect = effect?;
                // Through the temperatures it goes later; at once it changes what sensors in inlets read.
                let direct = |s: &usize| effect.direct(study.model.network.sensors[*s].inlet);
                let rows = effect.rows.iter().map(|(n, r)| (*n as usize, *r));
                Some(Projected { residual: basis.project(rows), direct: data.sensors.iter().map(direct).collect() })
            };
            let along = |variation: &Variation| -> Result<Option<Projected>> {
                let partial = at.partial_of(variation)?;
                let rows = partial.residual.iter().copied().enumerate().filter(|(_, r)| *r != 0.0);
                Ok(Some(Projected { residual: basis.project(rows), direct: data.sensors.iter().map(|s| partial.readings[*s]).collect() }))
            };
            let disturbances = derivatives
                .disturbances(&at, &screen)
                .into_iter()
                .map(|effect| Ok(of_effect(effect)))
                .chain(variations.iter().map(along))
                .collect::<Result<_>>()?;
            Ok(At { time: moment.time, condition: moment.condition.clone(), matrix: basis.matrix(&at), disturbances })
        };
        let of_hypothesis = |h: &Hypothesis| (derivatives.position(h).unwrap_or(usize::MAX), h.law);
        let of_parameter = |p: usize| (derivatives.count() + p, Law::Constant);
        let wanted: Vec<(usize, Law)> = hypotheses.iter().map(of_hypothesis).chain((0..variations.len()).map(of_parameter)).collect();
        let count = data.count();
        let mut columns: Vec<Option<Vec<f64>>> = vec![None; wanted.len()];
        for (test, moments) in data.tests().iter().zip(histories) {
            let states: Vec<At> = moments.par_iter().map(linearised).collect::<Result<_>>()?;
            for (column, found) in columns.iter_mut().zip(self.of_test(test, &basis, &states, &wanted)) {
                let Some(found) = found.map(|found| self.shown(found)) else { continue };
                let column = column.get_or_insert_with(|| vec![0.0; count]);
                found.into_iter().for_each(|(i, value)| column[i] = value);
            }
        }
        let mut along = columns.split_off(hypotheses.len());
        for (column, variation) in along.iter_mut().zip(&variations) {
            if own_key(&variation.parameter, data).is_some() {
                *column = Some(self.own(&variation.parameter)?);
            }
        }
        let rows = |which: std::ops::Range<usize>| -> Vec<Vec<f64>> {
            (0..count).map(|i| which.clone().map(|p| along[p].as_ref().map_or(0.0, |column| column[i])).collect()).collect()
        };
        Ok(Followed { columns, slopes: rows(0..uncertain.len()), conditions: rows(uncertain.len()..along.len()) })
    }

    /// What the sensors show of a change of the temperatures of their places in one test; a place among all readings, and K.
    fn shown(&self, mut found: Vec<(usize, f64)>) -> Vec<(usize, f64)> {
        let machine = &self.study.model.machine;
        let places = whiten::places(self.data);
        for (k, sensor) in self.data.sensors.iter().enumerate() {
            let response = machine.sensors[*sensor].shows;
            if response.lag == 0.0 && response.gain == 1.0 {
                continue;
            }
            let own: Vec<usize> = (0..found.len()).filter(|n| places[found[*n].0].1 == k).collect();
            let times: Vec<f64> = own.iter().map(|n| self.data.rows[places[found[*n].0].0].time.unwrap_or(0.0)).collect();
            let changes: Vec<f64> = own.iter().map(|n| found[*n].1).collect();
            own.iter().zip(response.course_of_change(&times, &changes)).for_each(|(n, shown)| found[*n].1 = shown);
        }
        found
    }

    /// The slope of all readings along a number of a sensor's own.
    fn own(&self, parameter: &Parameter) -> Result<Vec<f64>> {
        let found = identify::predict_within(self.study, self.data, std::slice::from_ref(parameter), self.start, TIME_TOLERANCE)?;
        Ok(found.slopes.into_iter().map(|row| row[0]).collect())
    }

    /// What disturbances under their laws do to the readings of one test: where each stands among all readings, and K per unit.
    fn of_test(&self, test: &str, basis: &Basis, states: &[At], wanted: &[(usize, Law)]) -> Vec<Option<Vec<(usize, f64)>>> {
        let data = self.data;
        let matrices: Vec<(f64, DMatrix<f64>)> = states.iter().map(|s| (s.time, s.matrix.clone())).collect();
        let course = Course::new(basis, &matrices, self.start == Start::Steady);
        let rows: Vec<usize> = (0..data.rows.len()).filter(|r| data.rows[*r].test == test).collect();
        let times: Vec<f64> = rows.iter().map(|r| data.rows[*r].time.unwrap_or(0.0)).collect();
        let nearest = |time: &f64| -> usize {
            let apart = |a: &usize, b: &usize| (states[*a].time - time).abs().total_cmp(&(states[*b].time - time).abs());
            (0..states.len()).min_by(apart).unwrap_or(0)
        };
        let nearest: Vec<usize> = times.iter().map(nearest).collect();
        // Row of the test, sensor of the data, place among all readings.
        let mut readings: Vec<(usize, usize, usize)> = Vec::new();
        for (i, (r, k)) in whiten::places(data).into_iter().enumerate() {
            if let Ok(row) = rows.binary_search(&r) {
                readings.push((row, k, i));
            }
        }
        let of = |state: &At, d: usize, law: Law| -> Option<DVector<f64>> {
            Some(&state.disturbances[d].as_ref()?.residual * self.scales.factor(law, &state.condition))
        };
        let is_known = |(d, _): &(usize, Law)| states.iter().all(|s| s.disturbances.get(*d).is_some_and(Option::is_some));
        let forced = |state: &At, known: &[(usize, Law)]| {
            DMatrix::from_columns(&known.iter().filter_map(|(d, law)| of(state, *d, *law)).collect::<Vec<_>>())
        };
        // Forwards with every disturbance, or back from every reading: whichever are fewer.
        let answers = (wanted.len() > times.len() * data.sensors.len()).then(|| course.answers(states.len(), &times));
        let values_of = |known: &[(usize, Law)]| -> Vec<Vec<f64>> {
            let Some(answers) = &answers else {
                return course.readings(&states.iter().map(|state| forced(state, known)).collect::<Vec<_>>(), &times);
            };
            let mut sum = DMatrix::zeros(times.len() * data.sensors.len(), known.len());
            states.iter().zip(answers).for_each(|(state, answer)| sum.gemm(1.0, answer, &forced(state, known), 1.0));
            sum.column_iter().map(|column| column.iter().copied().collect()).collect()
        };
        let followed = |some: &[(usize, Law)]| -> Vec<Option<Vec<(usize, f64)>>> {
            let known: Vec<(usize, Law)> = some.iter().copied().filter(is_known).collect();
            if known.is_empty() {
                return vec![None; some.len()];
            }
            let mut values = values_of(&known).into_iter();
            let read = |wanted: &(usize, Law)| -> Option<Vec<(usize, f64)>> {
                let (d, law) = *wanted;
                let values = if is_known(wanted) { values.next()? } else { return None };
                let value = |(row, k, i): &(usize, usize, usize)| {
                    let state = &states[nearest[*row]];
                    let direct = state.disturbances[d].as_ref().map_or(0.0, |d| d.direct[*k]);
                    (*i, values[row * data.sensors.len() + k] + direct * self.scales.factor(law, &data.rows[rows[*row]].condition))
                };
                Some(readings.iter().map(value).collect())
            };
            some.iter().map(read).collect()
        };
        wanted.par_chunks(TOGETHER).flat_map(followed).collect()
    }
}

/// What was followed in few unknowns, reading by reading.
struct Followed {
    /// Per unit of each hypothesis; `None` for what acts on no node.
    columns: Vec<Option<Vec<f64>>>,
    /// Rows of slopes along the uncertain parameters, and along the condition variables.
    slopes: Vec<Vec<f64>>,
    conditions: Vec<Vec<f64>>,
}

/// The linearised machine at a moment.
struct At {
    time: f64,
    condition: Condition,
    matrix: DMatrix<f64>,
    /// What each act and then each parameter does; `None` for what acts on no node.
    disturbances: Vec<Option<Projected>>,
}

/// A change of the residual, projected, and what reaches the sensors of the data at once, K.
struct Projected {
    residual: DVector<f64>,
    direct: Vec<f64>,
}

/// The rates that logs can show, 1/s: from the longest test's to that of half their usual distance between rows.
fn rates(data: &Data) -> (f64, f64) {
    let (mut longest, mut gaps) = (0.0f64, Vec::new());
    for test in data.tests() {
        let times: Vec<f64> = data.rows.iter().filter(|row| row.test == test).filter_map(|row| row.time).collect();
        longest = longest.max(times.last().copied().unwrap_or(0.0) - times.first().copied().unwrap_or(0.0));
        gaps.extend(times.windows(2).map(|pair| pair[1] - pair[0]).filter(|gap| *gap > 0.0));
    }
    gaps.sort_by(f64::total_cmp);
    let usual = gaps.get(gaps.len() / 2).copied().unwrap_or(longest);
    (1.0 / longest.max(1e-3), 2.0 / usual.clamp(1e-3, longest.max(1e-3)))
}
