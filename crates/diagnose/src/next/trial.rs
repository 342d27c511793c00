//! Interventions: tests that are no steady state at another condition. A step of the flow or of the speed, a heater that is
//! switched on for a while, another pressure in the chamber; solved with each cause in force.

use rayon::prelude::*;

use super::outlook::{Outlook, all_sensors, moved, open_causes};
use crate::predictor::{Extended, Predictor};
use crate::stated::Stated;
use crate::view::open_factors;
use crate::{Cause, Explanation, Hypothesis, Problem, signatures};
use coldplate_base::condition::{COOLANT_FLOW, MOTOR_SPEED};
use coldplate_base::document::{Leaf, quoted};
use coldplate_base::error::{Error, Result};
use coldplate_describe::machine::Condition;
use coldplate_evidence::identify;
use coldplate_explore::simulate::Start;
use coldplate_network::Load;
use coldplate_solve::study::Study;

/// Explanations that an intervention is solved with.
const MOST: usize = 4;
/// Parts that get a heater.
const HEATED: usize = 2;
/// Heat of a heater, as a share of all heat, and at least this, W.
const HEATER: (f64, f64) = (0.05, 2.0);
/// How long it is on, s.
const PULSE: f64 = 1800.0;
/// Times at which readings are taken after a step or after switching on, s.
const TIMES: [f64; 7] = [120.0, 300.0, 600.0, 1200.0, PULSE, 3600.0, 7200.0];
/// Pressure let into the chamber, Pa: its gas carries up to 1 W/(m² K), and less to a wall further off than the molecules' free path.
const PRESSURE: f64 = 1.0;
/// Error allowed in each time step, K: tests are ranked, and what is found in one is fitted.
const TOLERANCE: f64 = 0.03;
/// Name of the heater in the machine file.
const NAME: &str = "test_heater";

/// What is done in a test.
#[derive(Debug, Clone, PartialEq)]
pub enum Trial {
    /// A steady state is waited for.
    Steady,
    /// The same with another pressure in the chamber, Pa.
    Pressure(f64),
    /// From the steady state on, a heater is on for a while.
    Heater {
        /// Where it is fixed.
        part: String,
        /// W
        watts: f64,
        /// s
        seconds: f64,
    },
    /// From the steady state on, one condition has another value.
    Step {
        /// Which of the machine's variables.
        variable: usize,
        /// Its new value, SI.
        to: f64,
    },
}

impl Trial {
    /// As outside programs read it.
    pub fn code(&self) -> &'static str {
        match self {
            Self::Steady => "steady",
            Self::Pressure(_) => "chamber_pressure",
            Self::Heater { .. } => "heater_pulse",
            Self::Step { .. } => "step",
        }
    }

    /// Lines of the machine file it needs.
    fn sets(&self) -> Vec<(String, String)> {
        let text = |t: &str| Leaf::Text(t.into()).to_toml();
        match self {
            Self::Steady | Self::Step { .. } => Vec::new(),
            Self::Pressure(pascal) => vec![("chamber.pressure".into(), text(&format!("{pascal:?} Pa")))],
            Self::Heater { part, .. } => vec![
                (format!("variables.{NAME}"), "{ unit = \"W\", default = \"0 W\" }".into()),
                (format!("source.{}", quoted("test heater")), format!("{{ in = {}, power = \"{NAME}_W\" }}", text(part))),
            ],
        }
    }

    /// Times (s; none in a steady test) and conditions of a machine that has what the test needs.
    fn rows(&self, study: &Study, base: &Condition) -> Result<Vec<(Option<f64>, Condition)>> {
        let machine = &study.model.machine;
        let mut values = base.si().to_vec();
        let course = |values: &[f64], variable: usize, at: &dyn Fn(f64) -> f64| {
            let one = |time: f64, value: f64| {
                let mut values = values.to_vec();
                values[variable] = value;
                (Some(time), Condition::from_si(values))
            };
            // A time that stands in two rows is a step.
            let first = [one(0.0, values[variable]), one(0.0, at(0.0))];
            let later = TIMES.iter().flat_map(|t| {
                if at(t - 1.0) == at(t + 1.0) { vec![one(*t, at(*t))] } else { vec![one(*t, at(t - 1.0)), one(*t, at(t + 1.0))] }
            });
            first.into_iter().chain(later).collect()
        };
        Ok(match self {
            Self::Steady | Self::Pressure(_) => vec![(None, base.clone())],
            Self::Step { variable, to } => course(&values, *variable, &|_| *to),
            Self::Heater { watts, seconds, .. } => {
                let variable = machine.variables.iter().position(|v| v.name == NAME);
                let variable = variable.ok_or_else(|| Error::input("this machine has no heater"))?;
                values.insert(variable, 0.0);
                course(&values, variable, &|t| if t < *seconds { *watts } else { 0.0 })
            }
        })
    }
}

/// An intervention as it would go.
pub(super) struct Solved {
    /// What is done.
    pub trial: Trial,
    /// The condition it begins with.
    pub condition: Condition,
    /// Time of each row, s.
    pub times: Vec<Option<f64>>,
    /// What it would show: rows, then all of the machine's sensors.
    pub outlook: Outlook,
}

/// Interventions as they would go; those that cannot be run with an explanation in force are left out.
pub(super) fn trials(predictor: &Predictor<'_>, problem: &Problem, alive: &[&Explanation]) -> Vec<Solved> {
    let alive = &alive[..alive.len().min(MOST)];
    let base = &problem.data.rows[problem.data.rows.len() / 2].condition;
    let Ok(errors) = errors(predictor, problem, base) else { return Vec::new() };
    let solved = |trial: Trial| {
        let (times, outlook) = outlook(predictor, problem, alive, &trial, base, &errors).ok()?;
        Some(Solved { trial, condition: base.clone(), times, outlook })
    };
    candidates(problem, alive, base).into_par_iter().filter_map(solved).collect()
}

/// What can be done with this machine: steps to the farther end of what flow and speed may be, a heater at the parts in question.
fn candidates(problem: &Problem, alive: &[&Explanation], base: &Condition) -> Vec<Trial> {
    let (machine, network) = (&problem.study.model.machine, &problem.study.model.network);
    let mut found = Vec::new();
    for (variable, v) in machine.variables.iter().enumerate().filter(|(_, v)| v.name == COOLANT_FLOW || v.name == MOTOR_SPEED) {
        let Some((low, high)) = v.range else { continue };
        let now = base.si()[variable];
        let to = if high - now > now - low { high } else { low };
        if (to - now).abs() > 0.02 * (high - low) {
            found.push(Trial::Step { variable, to });
        }
    }
    let heat = Load::at(machine, base).map_or(0.0, |load| load.powers.iter().map(|p| p.abs()).sum::<f64>());
    let mut parts: Vec<&String> = Vec::new();
    for part in alive.iter().flat_map(|e| e.causes.iter().flat_map(|p| &p.hypothesis.parts)) {
        if !parts.contains(&part) && machine.parts.iter().any(|p| p.name == *part) {
            parts.push(part);
        }
    }
    // As one would set it: to half a watt.
    let watts = ((HEATER.0 * heat).max(HEATER.1) * 2.0).round() / 2.0;
    found.extend(parts.into_iter().take(HEATED).map(|part| Trial::Heater { part: part.clone(), watts, seconds: PULSE }));
    if network.surfaces.iter().any(|s| s.emissive > 0.0) {
        found.push(Trial::Pressure(PRESSURE));
    }
    found
}

/// Times (s) and readings of an intervention under each explanation.
fn outlook(
    predictor: &Predictor<'_>,
    problem: &Problem,
    alive: &[&Explanation],
    trial: &Trial,
    base: &Condition,
    errors: &Errors,
) -> Result<(Vec<Option<f64>>, Outlook)> {
    let sets = trial.sets();
    let prepared = |study: &Study| if sets.is_empty() { Ok(study.clone()) } else { study.edited(&sets) };
    let plain = prepared(&problem.study)?;
    let rows = trial.rows(&plain, base)?;
    let (count, times) = (rows.len(), rows.iter().map(|(time, _)| *time).collect());
    let data = all_sensors(problem, rows.into_iter().map(|(time, condition)| ("trial".to_string(), time, condition)));
    let run = |study: &Study| identify::values_within(study, &data, Start::Steady, TOLERANCE);
    let without = run(&plain)?;
    // Each cause is run once, at the first amplitude it has: what it adds grows about in proportion to that, beside whatever acts with it.
    let mut slopes: Vec<(&Hypothesis, Vec<f64>)> = Vec::new();
    for cause in alive.iter().flat_map(|e| &e.causes).filter(|c| c.amplitude != 0.0) {
        if slopes.iter().any(|(h, _)| h.is_same(&cause.hypothesis)) {
            continue;
        }
        let values = |h: &Hypothesis| {
            let Some(Extended { study, .. }) = predictor.extended(&[(h, cause.amplitude)])? else {
                return Err(Error::input("the machine file has no words for this cause"));
            };
            if h.is_sensor() { Ok(without.clone()) } else { run(&prepared(&study)?) }
        };
        // A law that no formula says is not known here, and one that heats ever more has no end: the cause acts as causes of its kind do.
        let values = values(&cause.hypothesis).or_else(|_| values(&cause.hypothesis.under_usual_law()))?;
        let with = moved(cause.hypothesis.clone(), problem).read(
            (predictor.scales, &problem.study.model.machine),
            &data,
            &values,
            cause.amplitude,
        );
        slopes.push((&cause.hypothesis, with.iter().zip(&without).map(|(w, o)| (w - o) / cause.amplitude).collect()));
    }
    let slope = |cause: &Cause| slopes.iter().find(|(h, _)| h.is_same(&cause.hypothesis)).map(|(_, slope)| slope.as_slice());
    let (mut shown, mut open) = (Vec::new(), Vec::new());
    for e in alive {
        let (mut sum, mut columns) = (without.clone(), Vec::new());
        for cause in &e.causes {
            let slope = slope(cause).unwrap_or(&[]);
            sum.iter_mut().zip(slope).for_each(|(s, v)| *s += cause.amplitude * v);
            columns.push((0..sum.len()).map(|i| slope.get(i).map_or(0.0, |v| cause.deviation * v)).collect());
        }
        shown.push(sum);
        open.push(columns);
    }
    let common = errors.common.iter().map(|column| column.repeat(count)).collect();
    Ok((times, Outlook { shown, open, deviation: errors.noise.repeat(count), common }))
}

/// Errors of the readings of one row, K: these repeat in every row of a test.
struct Errors {
    /// Noise of each reading.
    noise: Vec<f64>,
    /// What all rows share: the sensors' own errors, those of the condition, and what every model leaves open, as they are in the steady state
    /// a test begins with.
    common: Vec<Vec<f64>>,
}

fn errors(predictor: &Predictor<'_>, problem: &Problem, base: &Condition) -> Result<Errors> {
    let once = all_sensors(problem, std::iter::once(("base".to_string(), None, base.clone())));
    let causes = open_causes(problem, &once);
    let found = signatures(&problem.study, &once, Start::Steady, &[], &causes, predictor.scales, &problem.user)?;
    let slopes = &found.prediction.conditions;
    let sensors = slopes.len();
    let of = |own: &[f64], s: usize| problem.data.sensors.iter().position(|k| *k == s).map_or(own[0], |k| own[k]);
    let noise: Vec<f64> = (0..sensors).map(|s| of(&problem.uncertainty.noise, s)).collect();
    let own = (0..sensors).map(|s| {
        let lasting = of(&problem.uncertainty.bias, s).hypot(problem.discrepancy.model);
        (0..sensors).map(|i| if i == s { lasting } else { 0.0 }).collect()
    });
    let of_condition = problem.uncertainty.at(base).into_iter().enumerate();
    let of_condition = of_condition.map(|(v, e)| slopes.iter().map(|row| row[v] * e).collect::<Vec<f64>>());
    let open = open_factors(&problem.discrepancy, &Stated::of(problem, &problem.study), &causes, &found.columns, sensors);
    Ok(Errors { noise, common: own.chain(of_condition).chain(open).collect() })
}
