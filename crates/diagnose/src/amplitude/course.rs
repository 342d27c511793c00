//! The course of an amplitude through a log as a law, in the words that a machine file has for it.

use super::PlaceAndKind;
use super::logs::{ONSETS, rows_that_count};
use super::profiles::{Function, Profiles};
use super::ways::{coefficients, largest, mean, not_nothing};
use crate::effects::{Axis, Course, FoundLaw, Hypothesis, Law, LawForm, LawNumber, Scales, Sequence};
use crate::{Cause, Problem};
use coldplate_describe::machine::Condition;
use coldplate_evidence::measurement::TIME;

/// Points of a curve that are written, at most.
const MOST_POINTS: usize = 24;

/// Share of half the distance between rows, dimensionless, by which an onset at a row is written before it. Chosen: small beside that distance,
/// so that the row itself is behind the onset.
const BEFORE_ROW: f64 = 1e-3;

/// What courses of a log are told by.
pub struct Courses<'a> {
    /// The log.
    pub problem: &'a Problem,
    /// Functions that amplitudes follow.
    pub profiles: &'a Profiles,
    /// Variables over which they may run.
    pub names: &'a [String],
    /// Laws of the time, which are counted behind the variables.
    pub when: &'a [FoundLaw],
}

impl Courses<'_> {
    /// A member of a log's set under the law of its course, by the coefficients of the functions that it follows.
    pub fn told(&self, member: &PlaceAndKind, own: &[f64], scales: &mut Scales) -> Cause {
        let h = &member.hypothesis;
        let most = largest(&member.amplitudes);
        let (whole, mut deviation) = (member.amplitudes[most], member.deviations[most]);
        if own.iter().skip(1).all(|a| *a == 0.0) {
            return Cause::new(h.clone(), whole, deviation);
        }
        let mut whole = not_nothing(whole);
        let read = rows_that_count(&self.problem.data);
        let rows: Vec<&Condition> = read.iter().map(|row| &self.problem.data.rows[*row].condition).collect();
        let (law, number) = match self.parts(h, own, scales) {
            Some((parts, number)) => {
                let factors: Vec<Vec<f64>> = parts.iter().map(|part| part.factors(&rows)).collect();
                let shares = coefficients(&factors.iter().map(Vec::as_slice).collect::<Vec<_>>(), &member.amplitudes);
                let mut all: Vec<(f64, FoundLaw)> = parts.into_iter().zip(shares).map(|(part, share)| (share / whole, part)).collect();
                match all.pop() {
                    Some((share, only)) if all.is_empty() => {
                        (whole, deviation) = (whole * share, deviation * share.abs());
                        (only, number)
                    }
                    last => {
                        all.extend(last);
                        (FoundLaw::Sum(all), None)
                    }
                }
            }
            None => {
                let mut all = vec![0.0; self.problem.data.rows.len()];
                read.iter().zip(&member.amplitudes).for_each(|(row, a)| all[*row] = a / whole);
                (FoundLaw::Rows(Sequence::Free(all, mean(&member.amplitudes) / whole)), None)
            }
        };
        let law = match law {
            FoundLaw::Over(axis, Course::Only(n)) if axis.is_count() => Law::Of(axis.variable, LawForm::At(n as u16)),
            FoundLaw::Over(axis, Course::Above(n)) if axis.is_count() => Law::Of(axis.variable, LawForm::From(n.ceil() as u16)),
            law => scales.named(law),
        };
        let under = number.map_or_else(|| h.clone().under_of(law, scales), |number| h.under_found(law, number, scales));
        Cause::new(under, whole, deviation)
    }

    /// The laws that an amplitude is a sum of, with the instant at which it sets in where there is one; `None` where no formula says one of them.
    fn parts(&self, h: &Hypothesis, own: &[f64], scales: &Scales) -> Option<(Vec<FoundLaw>, Option<LawNumber>)> {
        let variables = &self.problem.study.model.machine.variables;
        let axis = |name: &str| variables.iter().position(|v| v.name == name).map(|v| scales.axis(v).0);
        let (mut parts, mut onsets) = (Vec::new(), Vec::new());
        let mut curve: Option<(usize, Vec<f64>)> = None;
        let acting = self.profiles.of.iter().zip(own).zip(self.profiles.functions.column_iter()).filter(|((_, a), _)| **a != 0.0);
        for ((function, a), values) in acting {
            match function {
                Function::Constant => parts.push(FoundLaw::One),
                Function::Linear(v) => parts.push(FoundLaw::over(&axis(&self.names[*v])?, Course::Straight)),
                Function::When(law) => match self.when.get(law - self.names.len())? {
                    FoundLaw::Over(axis, Course::Above(instant)) if axis.is_time() => onsets.push((*instant, *a)),
                    law => parts.push(law.clone()),
                },
                Function::Smooth((v, _)) => {
                    let (_, sum) = curve.get_or_insert_with(|| (*v, vec![0.0; values.len()]));
                    sum.iter_mut().zip(values.iter()).for_each(|(sum, value)| *sum += a * value);
                }
            }
        }
        if let Some((v, values)) = curve {
            parts.push(self.curve(&axis(&self.names[v])?, &values));
        }
        let mut number = None;
        if let Some(axis) = axis(TIME).filter(|_| !onsets.is_empty()) {
            let (instants, half) = self.instants(h, &axis, onsets);
            number = Some(instants[0]).map(|at| onset((at, half), &axis));
            parts.extend(instants.iter().map(|at| FoundLaw::over(&axis, Course::Above(*at))));
        }
        Some((parts, number))
    }

    /// Instants with what sets in there: those that are neighbours are one, at their mean weighted by that. With them half of what lies between
    /// two that were tried. What a sensor does sets in between two rows, and what acts on nodes at the later one.
    fn instants(&self, h: &Hypothesis, axis: &Axis, mut onsets: Vec<(f64, f64)>) -> (Vec<f64>, f64) {
        let instant = |law: &FoundLaw| match law {
            FoundLaw::Over(axis, Course::Above(instant)) if axis.is_time() => Some(*instant),
            _ => None,
        };
        let mut all: Vec<f64> = self.when.iter().filter_map(instant).collect();
        all.sort_by(f64::total_cmp);
        let near = all.last().zip(all.first()).map_or(0.0, |(last, first)| (last - first) / ONSETS as f64);
        onsets.sort_by(|a, b| a.0.total_cmp(&b.0));
        let apart = |at: f64| all.windows(2).find(|pair| pair[0] == at).map_or(0.0, |pair| pair[1] - pair[0]);
        let most = onsets.iter().map(|(at, _)| apart(*at)).fold(0.0, f64::max);
        if !h.is_sensor() {
            let times: Vec<f64> = self.problem.data.rows.iter().map(|row| axis.at(&row.condition)).collect();
            let later = |at: f64| times.iter().copied().filter(|time| *time > at).min_by(f64::total_cmp).unwrap_or(at);
            // The row itself is behind the instant.
            onsets.iter_mut().for_each(|(at, _)| *at += (1.0 - BEFORE_ROW) * (later(*at) - *at));
        }
        let mut found: Vec<f64> = Vec::new();
        for group in onsets.chunk_by(|a, b| b.0 - a.0 <= near) {
            let sum: f64 = group.iter().map(|(_, a)| a).sum();
            let mean = group.iter().map(|(at, a)| at * a).sum::<f64>() / sum;
            let (from, to) = (group[0].0 - near, group[group.len() - 1].0 + near);
            // A cause that sets in and stops again has no instant.
            match (from..=to).contains(&mean) {
                true => found.push(mean),
                false => found.extend(group.iter().map(|(at, _)| *at)),
            }
        }
        (found, 0.5 * most)
    }

    /// A curve over a variable, or over the time in each test, as points.
    fn curve(&self, axis: &Axis, values: &[f64]) -> FoundLaw {
        let rows = self.problem.data.rows.iter().map(|row| axis.at(&row.condition));
        let mut points: Vec<(f64, f64)> = rows.zip(values.iter().copied()).collect();
        points.sort_by(|a, b| a.0.total_cmp(&b.0));
        points.dedup_by(|next, last| next.0 <= last.0);
        let count = points.len().min(MOST_POINTS);
        let chosen = (0..count).map(|k| points[k * (points.len() - 1) / (count - 1).max(1)]).collect();
        FoundLaw::over(axis, Course::Curve(chosen))
    }
}

/// The instant from which a cause acts, in the unit of its axis, known to a half of what lies between two instants that were tried.
fn onset((at, half): (f64, f64), axis: &Axis) -> LawNumber {
    let si = |t: f64| t * axis.per_unit;
    let share = (2.0 * half / (axis.most - axis.least)).min(1.0);
    LawNumber { name: "time", value: si(at), low: si(at - half), high: si(at + half), unit: "s", share, deviation: 0.0 }
}
