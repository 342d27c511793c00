//! What each hypothesis would do to logs, to first order.
//!
//! A history of the machine is linearised in the few unknowns that the sensors can see ([`Basis`]); there every hypothesis costs
//! a few small products per step. Where the water stores much of the heat, fronts run through it that no few unknowns follow: there,
//! and for what acts on no node, a signature is the difference of two runs.

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::catalogue::{Act, Hypothesis, Scales, UserKind};
use super::effect::Acting;
use super::signature::{Signatures, acts, difference, position};
use crate::error::Result;
use crate::identify::{self, Prediction};
use crate::measure::{Data, whiten};
use crate::network::Load;
use crate::sensitivity::{Basis, Course, Derivatives, Effect, Moment, Parameter, Study, Variation};
use crate::simulate::Start;

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
    let runs = Runs { study, data, start, scales, user };
    if has_fronts(study, data)? {
        let prediction = identify::predict_within(study, data, uncertain, start, TIME_TOLERANCE)?;
        let residual = difference(&whiten::readings(data), &prediction.values);
        let columns = hypotheses.par_iter().map(|h| runs.column(h, &prediction.values, &residual)).collect();
        return Ok(Signatures { residual, prediction, fields: Vec::new(), columns });
    }
    let (values, histories) = identify::histories(study, data, start, TIME_TOLERANCE)?;
    let residual = difference(&whiten::readings(data), &values);
    let followed = follow(study, data, &histories, start == Start::Steady, uncertain, hypotheses, scales, user)?;
    let finish = |(h, column): (&Hypothesis, Option<Vec<f64>>)| column.unwrap_or_else(|| runs.column(h, &values, &residual));
    let columns = hypotheses.par_iter().zip(followed.columns).map(finish).collect();
    let prediction = Prediction { values, slopes: followed.slopes, conditions: followed.conditions };
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

/// Differences of whole runs.
struct Runs<'a> {
    study: &'a Study,
    data: &'a Data,
    start: Start,
    scales: &'a Scales,
    user: &'a [UserKind],
}

impl Runs<'_> {
    /// Per unit of the amplitude, beside the predictions of the machine as it is.
    fn column(&self, h: &Hypothesis, values: &[f64], residual: &[f64]) -> Vec<f64> {
        if !matches!(h.act, Act::Capacity(_)) {
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
    matrix: DMatrix<f64>,
    /// Of each act: what it does to the residual, projected, and to inlets.
    acts: Vec<Option<(DVector<f64>, Vec<(usize, f64)>)>>,
    /// Along each parameter: the residual, projected, and the sensors directly.
    along: Vec<(DVector<f64>, Vec<f64>)>,
}

#[expect(clippy::too_many_arguments, reason = "what a signature needs, with the histories that were run for it")]
fn follow(
    study: &Study,
    data: &Data,
    histories: &[Vec<Moment>],
    is_steady: bool,
    uncertain: &[Parameter],
    hypotheses: &[Hypothesis],
    scales: &Scales,
    user: &[UserKind],
) -> Result<Followed> {
    let variables = study.model.machine.variables.iter().map(|v| study.parameter(&v.name)).collect::<Result<Vec<_>>>()?;
    let variations: Vec<Variation> = uncertain.iter().chain(&variables).map(|p| study.variation(p)).collect::<Result<_>>()?;
    let basis = Basis::new(study, &data.sensors, &histories.iter().flatten().collect::<Vec<_>>(), rates(data))?;
    let acts = acts(hypotheses);
    let acting = Acting::new(study, hypotheses, user);
    let linearised = |moment: &Moment| -> Result<At> {
        let at = Derivatives::at(study, &moment.condition, &moment.temperatures)?;
        let screen = at.screen();
        let project = |effect: Effect| (basis.project(effect.rows.iter().map(|(n, r)| (*n as usize, *r))), effect.inlets);
        let acts = acts.iter().map(|(act, drifts)| acting.effect(&at, &screen, *act, *drifts).map(project)).collect();
        let along = variations.iter().map(|variation| {
            let partial = at.partial_of(variation)?;
            let direct = data.sensors.iter().map(|s| partial.readings[*s]).collect();
            Ok((basis.project(partial.residual.iter().copied().enumerate().filter(|(_, r)| *r != 0.0)), direct))
        });
        Ok(At { time: moment.time, matrix: basis.matrix(&at), along: along.collect::<Result<_>>()?, acts })
    };
    let places = whiten::places(data);
    let positions: Vec<Option<usize>> = hypotheses.iter().map(|h| position(&acts, h)).collect();
    let mut columns: Vec<Option<Vec<f64>>> = vec![None; hypotheses.len()];
    let (mut slopes, mut conditions) = (vec![vec![0.0; uncertain.len()]; places.len()], vec![vec![0.0; variables.len()]; places.len()]);
    for (test, moments) in data.tests().iter().zip(histories) {
        let states: Vec<At> = moments.par_iter().map(linearised).collect::<Result<_>>()?;
        let matrices: Vec<(f64, DMatrix<f64>)> = states.iter().map(|s| (s.time, s.matrix.clone())).collect();
        let course = Course::new(&basis, &matrices, is_steady);
        let rows: Vec<usize> = (0..data.rows.len()).filter(|r| data.rows[*r].test == *test).collect();
        let times: Vec<f64> = rows.iter().map(|r| data.rows[*r].time.unwrap_or(0.0)).collect();
        let width = data.sensors.len();
        // Row of this test and sensor of each of its readings, and where it stands among all.
        let own: Vec<(usize, usize, usize)> =
            places.iter().enumerate().filter_map(|(i, (r, k))| rows.iter().position(|row| row == r).map(|row| (row, *k, i))).collect();
        let shown: Vec<usize> = (0..hypotheses.len())
            .filter(|h| !hypotheses[*h].is_sensor() && positions[*h].is_some_and(|a| states.iter().all(|s| s.acts[a].is_some())))
            .collect();
        let of_some = |some: &[usize]| -> Vec<Vec<f64>> {
            let disturbance = |(state, moment): (&At, &Moment)| -> DMatrix<f64> {
                let column = |h: &usize| {
                    let act = positions[*h].and_then(|a| state.acts[a].as_ref());
                    act.map_or_else(|| DVector::zeros(0), |(rows, _)| rows * scales.factor(hypotheses[*h].law, &moment.condition))
                };
                DMatrix::from_columns(&some.iter().map(column).collect::<Vec<_>>())
            };
            course.readings(&states.iter().zip(moments).map(disturbance).collect::<Vec<_>>(), &times)
        };
        let found: Vec<Vec<f64>> = shown.par_chunks(TOGETHER).flat_map(of_some).collect();
        for (h, values) in shown.iter().zip(found) {
            let inlets = positions[*h].and_then(|a| states[0].acts[a].as_ref()).map_or(&[][..], |(_, inlets)| inlets.as_slice());
            let column = columns[*h].get_or_insert_with(|| vec![0.0; places.len()]);
            for (row, k, i) in &own {
                let inlet = study.model.network.sensors[data.sensors[*k]].inlet;
                let direct: f64 =
                    inlets.iter().map(|(c, d)| inlet.map_or(0.0, |(circuit, w)| if circuit == *c { w * d } else { 0.0 })).sum();
                column[*i] = values[row * width + k] + direct * scales.factor(hypotheses[*h].law, &data.rows[rows[*row]].condition);
            }
        }
        let disturbances: Vec<DMatrix<f64>> =
            states.iter().map(|s| DMatrix::from_columns(&s.along.iter().map(|(rows, _)| rows.clone()).collect::<Vec<_>>())).collect();
        for (p, values) in course.readings(&disturbances, &times).into_iter().enumerate() {
            for (row, k, i) in &own {
                let nearest = |a: &&At, b: &&At| (a.time - times[*row]).abs().total_cmp(&(b.time - times[*row]).abs());
                let direct = states.iter().min_by(nearest).map_or(0.0, |s| s.along[p].1[*k]);
                let slope = values[row * width + k] + direct;
                match p.checked_sub(uncertain.len()) {
                    None => slopes[*i][p] = slope,
                    Some(v) => conditions[*i][v] = slope,
                }
            }
        }
    }
    Ok(Followed { columns, slopes, conditions })
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
