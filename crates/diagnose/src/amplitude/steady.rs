//! Steady tables about the machine with a set in force: each row has its own amplitudes, and its readings answer to these alone.

use std::borrow::Cow;
use std::sync::{Arc, OnceLock};

use super::force::{self, Acting, Courses};
use super::logs::rows_that_count;
use super::response::Slope;
use super::rows::{Errors, Recent};
use super::search::{Exchange, Reference};
use super::sizing::Sizing;
use crate::Problem;
use crate::attached::Attached;
use crate::effects::{Effect, Hypothesis, Scales, hypotheses};
use crate::predictor::Predictor;
use crate::signature;
use crate::view::Comparison;
use coldplate_evidence::identify;
use coldplate_evidence::measurement::{Data, whiten};

/// Step of the amplitudes by which slopes are found, as a share of the kind's scale.
const STEP: f64 = 0.05;
/// Machines with sets in force that are kept: each thread solves one set again and again. Chosen; it decides memory and time alone.
pub const KEPT_MACHINES: usize = 8;
/// Amplitudes that differ by less, in units of their scale, are one.
const ALIKE: f64 = 1e-3;

/// A table with what its search needs.
pub struct Table<'a> {
    /// The table.
    pub problem: &'a Problem,
    /// Predictions.
    pub predictor: &'a Predictor<'a>,
    /// The machine as it is beside it.
    pub base: &'a Comparison,
    /// Its errors beside the machine as it is.
    pub errors: &'a Errors,
    /// Causes that show.
    pub visible: &'a [(&'a Hypothesis, &'a Vec<f64>)],
    /// Their amplitudes in units of scales.
    pub sizes: &'a [Sizing],
    /// Machines in which sets follow courses, with their members: those that were asked for last.
    pub machines: Recent<(Vec<usize>, Courses)>,
    /// Paths that may be attached anywhere, with the rise of every sensor per watt put into each node.
    pub attached: OnceLock<Option<(Attached<'a>, Vec<Vec<f64>>)>>,
}

/// The machine with members in force, solved.
struct Solved<'a> {
    /// The members, and the machine.
    courses: Arc<(Vec<usize>, Courses)>,
    /// The data, with the courses.
    data: Data,
    /// Scales at which laws are one in that machine.
    scales: Scales,
    /// Change of the readings, K.
    change: Vec<f64>,
    /// Temperatures of all nodes at each distinct condition, K.
    fields: Cow<'a, [Vec<f64>]>,
}

impl Table<'_> {
    /// The machine with members in force at amplitudes in each row with readings, in units of their scales; `None` where it cannot be solved.
    pub fn about(&self, members: &[usize], amplitudes: &[Vec<f64>], known: Option<&Errors>) -> Option<(Reference, Errors)> {
        // A key that takes no formula is one number in all rows.
        let varies = |own: &Vec<f64>| own.iter().any(|a| (a - own[0]).abs() > ALIKE);
        let is_said = |(m, own): (&usize, &Vec<f64>)| !varies(own) || force::runs(self.predictor, self.visible[*m].0);
        if !members.iter().zip(amplitudes).all(is_said) {
            return None;
        }
        let amplitudes = &self.within(members, amplitudes)[..];
        let solved = self.with(members, amplitudes)?;
        let change = &solved.change;
        let slope = |k: usize| -> Option<Slope> {
            if self.visible[members[k]].0.is_fixed() {
                // An exchange is straight.
                let mut without = amplitudes.to_vec();
                without[k].fill(0.0);
                let mut whole = amplitudes.to_vec();
                whole[k].fill(1.0);
                let (without, whole) = (self.with(members, &without)?.change, self.with(members, &whole)?.change);
                return Some(Slope::OfRow(whole.iter().zip(&without).map(|(w, o)| w - o).collect()));
            }
            // At the upper end of its range an amplitude goes down.
            let most = self.range(members[k]).1;
            let steps: Vec<f64> = amplitudes[k].iter().map(|a| if a + STEP > most { -STEP } else { STEP }).collect();
            let mut more = amplitudes.to_vec();
            more[k].iter_mut().zip(&steps).for_each(|(a, step)| *a += step);
            let more = self.with(members, &more)?.change;
            let of = |(i, (m, c)): (usize, (&f64, &f64))| (m - c) / steps[self.errors.row_of[i]];
            Some(Slope::OfRow(more.iter().zip(change).enumerate().map(of).collect()))
        };
        let slopes = (0..members.len()).map(slope).collect::<Option<Vec<_>>>()?;
        let exchanges: Vec<Exchange> = members.iter().zip(amplitudes).filter_map(|(m, own)| self.exchange(*m, own)).collect();
        let errors = match known {
            Some(known) => known.clone(),
            None => {
                let places = members.iter().zip(amplitudes).flat_map(|(m, own)| self.of_place(*m, own));
                let stated = self.errors.stated.iter().cloned().chain(places).collect();
                let own = Errors { numbers: self.numbers(&solved)?, stated, ..self.errors.clone() };
                exchanges.iter().fold(own, |own, exchange| own.map(|column| exchange.shown(column)))
            }
        };
        let change = solved.change;
        Some((Reference { amplitudes: amplitudes.to_vec(), change, slopes, others: Vec::new(), exchanges }, errors))
    }

    /// The range of the amplitude of a member, in units of its scale.
    fn range(&self, member: usize) -> (f64, f64) {
        let (h, size) = (self.visible[member].0, self.sizes[member]);
        let (least, most) = if h.is_fixed() { (0.0, 1.0) } else { h.range() };
        (size.position(least), size.position(most))
    }

    /// Amplitudes within their ranges.
    fn within(&self, members: &[usize], amplitudes: &[Vec<f64>]) -> Vec<Vec<f64>> {
        let of = |(m, own): (&usize, &Vec<f64>)| {
            let (least, most) = self.range(*m);
            own.iter().map(|a| a.clamp(least, most)).collect()
        };
        members.iter().zip(amplitudes).map(of).collect()
    }

    /// The machine with members in force.
    fn with(&self, members: &[usize], amplitudes: &[Vec<f64>]) -> Option<Solved<'_>> {
        let data = &self.problem.data;
        let read = rows_that_count(data);
        let course = |(m, own): (&usize, &Vec<f64>)| {
            let (h, size) = (self.visible[*m].0, self.sizes[*m]);
            let mut values = vec![0.0; data.rows.len()];
            read.iter().zip(own).for_each(|(row, a)| values[*row] = size.amplitude(*a));
            Acting { hypothesis: h, values, is_held: false }
        };
        let acting: Vec<Acting<'_>> = members.iter().zip(amplitudes).map(course).collect();
        let given = &self.problem.study.model.machine.variables;
        let places = whiten::places(data);
        let known = self.courses(members, &acting)?;
        let courses = &known.1;
        let data = courses.data(given, data, &acting);
        let scales = Scales::of(&data, &courses.study.model.machine);
        let acts = acting.iter().any(|own| !own.hypothesis.is_sensor());
        let near = self.predictor.fields;
        let (values, fields) = match acts {
            true => identify::steady_near(&courses.study, &data, near).map(|(values, fields)| (values, Cow::Owned(fields))).ok()?,
            false => (self.predictor.predicted.to_vec(), Cow::Borrowed(near)),
        };
        let mut values = force::shown((&scales, &courses.study.model.machine, &data), &values, &courses.laws, None);
        for Acting { hypothesis: h, values: course, .. } in &acting {
            // Exchanged sensors read with the mesh's share at the other one's place.
            for (i, from) in h.relabelled(&places).into_iter().flatten().enumerate() {
                values[i] += course[places[i].0] * (self.base.mesh[from] - self.base.mesh[i]);
            }
        }
        let change = values.iter().zip(self.predictor.predicted).map(|(v, p)| v - p).collect();
        Some(Solved { courses: known, data, scales, change, fields })
    }

    /// The machine in which members follow courses. One that cannot has a number of its own, and the machine is made anew for it.
    fn courses(&self, members: &[usize], acting: &[Acting<'_>]) -> Option<Arc<(Vec<usize>, Courses)>> {
        let make = || Some((members.to_vec(), Courses::new(self.predictor, (&self.problem.study, &self.problem.data), acting)?));
        if acting.iter().all(|own| force::runs(self.predictor, own.hypothesis)) {
            self.machines.get(|(own, _)| own == members, make)
        } else {
            make().map(Arc::new)
        }
    }

    /// What hangs on where in its part a path is attached: columns of unit variance, K.
    fn of_place(&self, member: usize, amplitudes: &[f64]) -> Vec<Vec<f64>> {
        let (h, size) = (self.visible[member].0, self.sizes[member]);
        let (Effect::Leak(_), Some((attached, rises))) = (h.effect, self.attached()) else { return Vec::new() };
        let by = |i: usize| size.amplitude(amplitudes[self.errors.row_of[i]]);
        let scaled = |column: Vec<f64>| column.iter().enumerate().map(|(i, c)| by(i) * c).collect();
        attached.columns(h.effect, rises).into_iter().map(scaled).collect()
    }

    /// Readings that a member exchanges; `None` of a cause that is no exchange.
    fn exchange(&self, member: usize, amplitudes: &[f64]) -> Option<Exchange> {
        let from = self.visible[member].0.relabelled(&whiten::places(&self.problem.data))?;
        Some(Exchange { from, shares: self.errors.row_of.iter().map(|row| amplitudes[*row]).collect() })
    }

    fn attached(&self) -> Option<&(Attached<'_>, Vec<Vec<f64>>)> {
        let of = || {
            let attached = Attached::new(&self.problem.study, &self.problem.data, &self.base.found.fields).ok()?;
            let rises = attached.rises().ok()?;
            Some((attached, rises))
        };
        self.attached.get_or_init(of).as_ref()
    }

    /// Change of the readings with the logarithm of each number of the machine with causes in force, K.
    fn numbers(&self, Solved { courses, data, scales, fields, .. }: &Solved<'_>) -> Option<Vec<Vec<f64>>> {
        let (study, user) = (&courses.1.study, self.problem.user.as_slice());
        // An effect is numbered anew in another file.
        let own = hypotheses(study, data, user);
        let same = |(number, _): &(Hypothesis, f64)| {
            let is = |other: &&Hypothesis| (other.kind(), &other.place, other.law) == (number.kind(), &number.place, number.law);
            own.iter().find(is).cloned()
        };
        let numbers = self.base.numbers.iter().map(same).collect::<Option<Vec<Hypothesis>>>()?;
        let found = signature::steady(study, data, None, &numbers, (scales, user), Some(fields)).ok()?;
        let scaled = |(column, (_, unit)): (&Vec<f64>, &(Hypothesis, f64))| column.iter().map(|c| unit * c).collect();
        Some(found.columns.iter().zip(&self.base.numbers).map(scaled).collect())
    }
}
