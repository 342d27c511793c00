//! Interventions: tests that are no steady state at another condition. A step of the flow or of the speed, a heater that is
//! switched on for a while, another pressure in the chamber; solved with each explanation in force.

use rayon::prelude::*;

use super::outlook::{Outlook, all_sensors, moved, open_causes};
use crate::describe::machine::Condition;
use crate::discretise::network::Load;
use crate::error::{Error, Result};
use crate::evidence::diagnose::history::TIME_TOLERANCE;
use crate::evidence::diagnose::refine::{Extended, Predictor, in_order};
use crate::evidence::diagnose::view::open_factors;
use crate::evidence::diagnose::{Explanation, Hypothesis, Problem, signatures};
use crate::evidence::identify;
use crate::evidence::measurement::Data;
use crate::explore::simulate::Start;
use crate::foundation::document::{Leaf, quoted};
use crate::solve::sensitivity::Study;

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
    let solved = |trial: Trial| {
        let (times, outlook) = outlook(predictor, problem, alive, &trial, base).ok()?;
        Some(Solved { trial, condition: base.clone(), times, outlook })
    };
    candidates(problem, alive, base).into_par_iter().filter_map(solved).collect()
}

/// What can be done with this machine: steps to the farther end of what flow and speed may be, a heater at the parts in question.
fn candidates(problem: &Problem, alive: &[&Explanation], base: &Condition) -> Vec<Trial> {
    let (machine, network) = (&problem.study.model.machine, &problem.study.model.network);
    let mut found = Vec::new();
    for (variable, v) in machine.variables.iter().enumerate().filter(|(_, v)| v.name == "coolant_flow" || v.name == "motor_speed") {
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
) -> Result<(Vec<Option<f64>>, Outlook)> {
    let sets = trial.sets();
    let prepared = |study: &Study| if sets.is_empty() { Ok(study.clone()) } else { study.edited(&sets) };
    let plain = prepared(&problem.study)?;
    let rows = trial.rows(&plain, base)?;
    let (count, times) = (rows.len(), rows.iter().map(|(time, _)| *time).collect());
    let data = all_sensors(problem, rows.into_iter().map(|(time, condition)| ("trial".to_string(), time, condition)));
    let run = |study: &Study| identify::values_within(study, &data, Start::Steady, TIME_TOLERANCE);
    let without = run(&plain)?;
    let with = |members: &[(&Hypothesis, f64)]| -> Result<Vec<f64>> {
        let Some(Extended { study, .. }) = predictor.extended(members)? else {
            return Err(Error::input("the machine file has no words for this cause"));
        };
        let is_of_sensors = members.iter().all(|(h, _)| h.is_sensor());
        let values = if is_of_sensors { without.clone() } else { run(&prepared(&study)?)? };
        Ok(read(&data, values, members, problem))
    };
    let (mut shown, mut open) = (Vec::new(), Vec::new());
    for e in alive {
        let members: Vec<(&Hypothesis, f64)> = e.causes.iter().map(|p| (&p.hypothesis, p.amplitude)).collect();
        let all = with(&members)?;
        // What one part adds grows about in proportion to its amplitude.
        let column = |i: usize| -> Result<Vec<f64>> {
            let share = if members[i].1 == 0.0 { 0.0 } else { e.causes[i].deviation / members[i].1 };
            let mut others = members.clone();
            others.remove(i);
            let rest = if others.is_empty() { without.clone() } else { with(&others)? };
            Ok(all.iter().zip(&rest).map(|(a, b)| share * (a - b)).collect())
        };
        open.push((0..members.len()).map(column).collect::<Result<Vec<_>>>()?);
        shown.push(all);
    }
    let (deviation, common) = errors(predictor, problem, base, count)?;
    Ok((times, Outlook { shown, open, deviation, common }))
}

/// Noise of each reading in `count` rows of a test, and what all rows share: the sensors' own errors, those of the condition, and what
/// every model leaves open, as they are in the steady state the test begins with.
fn errors(predictor: &Predictor<'_>, problem: &Problem, base: &Condition, count: usize) -> Result<(Vec<f64>, Vec<Vec<f64>>)> {
    let once = all_sensors(problem, std::iter::once(("base".to_string(), None, base.clone())));
    let causes = open_causes(problem, &once);
    let found = signatures(&problem.study, &once, Start::Steady, &[], &causes, predictor.scales, &problem.user)?;
    let slopes = &found.prediction.conditions;
    let sensors = slopes.len();
    let of = |own: &[f64], s: usize| problem.data.sensors.iter().position(|k| *k == s).map_or(own[0], |k| own[k]);
    let noise: Vec<f64> = (0..sensors).map(|s| of(&problem.uncertainty.noise, s)).collect();
    let own = (0..sensors).map(|s| {
        let lasting = of(&problem.uncertainty.bias, s).hypot(problem.discrepancy.model);
        (0..sensors * count).map(|i| if i % sensors == s { lasting } else { 0.0 }).collect()
    });
    let of_condition = problem.uncertainty.at(base).into_iter().enumerate();
    let of_condition = of_condition.map(|(v, e)| slopes.iter().map(|row| row[v] * e).collect::<Vec<f64>>().repeat(count));
    let open = open_factors(&problem.discrepancy, &causes, &found.columns, sensors);
    let open = open.into_iter().map(|f| f.repeat(count));
    Ok((noise.repeat(count), own.chain(of_condition).chain(open).collect()))
}

/// Predictions as the sensors of some causes show them.
fn read(data: &Data, values: Vec<f64>, members: &[(&Hypothesis, f64)], problem: &Problem) -> Vec<f64> {
    in_order(members).fold(values, |values, (h, amplitude)| moved(h.clone(), problem).read(data, &values, amplitude))
}
