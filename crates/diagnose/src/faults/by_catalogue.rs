//! Readings and rows of a table that stand out by themselves, judged by the catalogue.
//!
//! At the end of a range a reading may be off because a cause acts at that condition alone, so that faults which are looked for
//! without the catalogue leave it. It is wrong where two causes together leave far more of the misfit than its absence does,
//! with one cause beside it at most, and where nothing is left then that needs explaining. A single reading stays, too, where its
//! row shows what some cause would make of it, were it to act in that row alone: heat warms the neighbours as well.

use std::collections::HashMap;

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use crate::effects::{Hypothesis, Scales, hypotheses};
use crate::screen::Screened;
use crate::view::Comparison;
use crate::{NOISE, Problem, WRONG, rarer};
use coldplate_base::error::Result;
use coldplate_evidence::faulty_readings::{Cleared, Fault, blanked, is_at_edge, rest};
use coldplate_evidence::identify::chi_square_tail;
use coldplate_evidence::measurement::{Data, whiten};

/// Suspects of which all combinations are tried.
const MOST: usize = 4;
/// What two causes leave more than the absence of the suspects, at least, and more than that for each of their readings.
const BETTER: f64 = 12.0;
const EACH: f64 = 2.0;
/// Rows from which on two of them at the same end of a range are no chance: of fewer, most pairs are at some end.
const RANGES: usize = 8;
/// Share of a signature's square that must lie outside the suspects for its cause to count beside them.
const OUTSIDE: f64 = 1e-6;

/// Leaves out the suspects that are wrong.
///
/// # Errors
/// The machine cannot be solved at the data's conditions.
pub fn judged(problem: &Problem, found: Cleared) -> Result<Cleared> {
    // Rows keep their places.
    let data = blanked(&problem.data, found.faults.iter().filter(|fault| fault.is_left_out));
    let now = Problem { data, ..problem.clone() }.timed()?;
    let mut wrong: Vec<Fault> = wrong(&now, &found.suspects)?.into_iter().cloned().collect();
    wrong.iter_mut().for_each(|fault| fault.is_left_out = true);
    let mut faults = [found.faults, wrong].concat();
    faults.sort_by_key(|fault| *fault.rows.start());
    Ok(Cleared { data: rest(&problem.data, &faults), faults, suspects: Vec::new() })
}

/// The fewest suspects without which nothing is left to explain, or one cause explains it.
fn wrong<'s>(problem: &Problem, suspects: &'s [Fault]) -> Result<Vec<&'s Fault>> {
    let (study, data) = (&problem.study, &problem.data);
    let scales = Scales::of(data, &study.model.machine);
    let mut catalogue = hypotheses(study, data, &problem.user);
    catalogue.retain(|h| !problem.without.iter().any(|kind| kind == h.kind()));
    let mut base = Comparison::of(problem, study, &catalogue, &scales)?;
    let misfit: f64 = base.whitener.apply(&base.found.residual).iter().map(|v| v * v).sum();
    if chi_square_tail(misfit, data.count()) > NOISE {
        return Ok(Vec::new());
    }
    rarer::add(problem, &mut base, &mut catalogue, &scales)?;
    let screened = base.screen(&catalogue, data);
    let causes_leave = screened.misfit() - best_gain(&screened);

    let places = whiten::places(data);
    let screen = Screen { base: &base, screened: &screened, catalogue: &catalogue, places: &places };
    let place: HashMap<(usize, usize), usize> = places.iter().enumerate().map(|(i, place)| (*place, i)).collect();
    let readings = |fault: &Fault| -> Vec<usize> { fault.readings().iter().filter_map(|at| place.get(at).copied()).collect() };
    let off = |fault: &Fault| readings(fault).first().map_or(0.0, |i| base.found.residual[*i]);
    let suspects = &suspects[..suspects.len().min(MOST)];
    let mut best: Option<(usize, f64, Vec<&Fault>)> = None;
    for chosen in 1..1usize << suspects.len() {
        let chosen: Vec<&Fault> = suspects.iter().enumerate().filter(|(s, _)| chosen >> s & 1 == 1).map(|(_, fault)| fault).collect();
        let out: Vec<usize> = chosen.iter().flat_map(|fault| readings(fault)).collect();
        if !are_apart(&chosen, data, off) || out.len() as f64 > WRONG * data.count() as f64 {
            continue;
        }
        let freedom = data.count().saturating_sub(out.len());
        let explains = |left: &Left| {
            let freedom = freedom.saturating_sub(left.beside.iter().len());
            freedom > 0 && chi_square_tail(left.misfit, freedom) > NOISE
        };
        let Some(left) = screen.without(&out).into_iter().find(explains) else { continue };
        let is_better = best.as_ref().is_none_or(|(count, other, _)| (out.len(), left.misfit) < (*count, *other));
        if is_better
            && causes_leave - left.misfit > BETTER + EACH * out.len() as f64
            && !chosen.iter().any(|fault| fault.sensor.is_some() && screen.shows_one_row(&readings(fault), &out, left.beside))
        {
            best = Some((out.len(), left.misfit, chosen));
        }
    }
    Ok(best.map_or(Vec::new(), |(_, _, chosen)| chosen))
}

/// Whether no two suspects have a reading in common. What one sensor shows twice in the same sense at the end of a range may be the
/// machine.
fn are_apart(chosen: &[&Fault], data: &Data, off: impl Fn(&Fault) -> f64) -> bool {
    let all: Vec<usize> = (0..data.rows.len()).collect();
    let is_one = |a: &Fault, b: &Fault| {
        let is_one_sense = a.sensor.is_some() && a.sensor == b.sensor && off(a) * off(b) > 0.0;
        let is_machine = || is_one_sense && all.len() >= RANGES && is_at_edge(data, &[*a.rows.start(), *b.rows.start()], &all);
        a.readings().iter().any(|at| b.readings().contains(at)) || is_machine()
    };
    chosen.iter().enumerate().all(|(i, a)| chosen[..i].iter().all(|b| !is_one(a, b)))
}

/// The misfit that the best two causes together take away.
fn best_gain(screened: &Screened) -> f64 {
    let count = screened.visible.len();
    let of = |i: usize| (0..i).map(|j| screened.pair(i, j).1).fold(screened.single(i).1, f64::max);
    (0..count).into_par_iter().map(of).reduce(|| 0.0, f64::max)
}

/// What is left without some readings.
struct Left {
    /// Whitened.
    misfit: f64,
    /// The cause beside, in the screen.
    beside: Option<usize>,
}

/// Data and catalogue.
struct Screen<'a> {
    base: &'a Comparison,
    screened: &'a Screened,
    catalogue: &'a [Hypothesis],
    /// Row and sensor of every reading.
    places: &'a [(usize, usize)],
}

impl Screen<'_> {
    /// Whitened changes of single readings, one column each.
    fn units(&self, of: &[usize]) -> DMatrix<f64> {
        let readings = self.screened.residual.len();
        let unit = |i: &usize| (0..readings).map(|j| if j == *i { 1.0 } else { 0.0 }).collect::<Vec<f64>>();
        self.base.whitener.apply_all(&of.iter().map(unit).collect::<Vec<_>>())
    }

    /// What is left without some readings: with nothing beside, and with the best cause.
    fn without(&self, out: &[usize]) -> [Left; 2] {
        let screened = self.screened;
        let basis = self.units(out).qr().q();
        let rest = outside(&basis, &DVector::from_column_slice(&screened.residual));
        let inside = basis.tr_mul(&screened.columns);
        let along = screened.columns.tr_mul(&rest);
        let gain = |j: usize| -> f64 {
            let g = screened.square(j) - inside.column(j).norm_squared();
            if screened.is_fixed(j) || g < OUTSIDE * screened.square(j) { 0.0 } else { screened.taken_away(j, g, along[j]) }
        };
        let misfit = rest.norm_squared();
        let best = (0..screened.visible.len()).map(|j| (j, gain(j))).max_by(|a, b| a.1.total_cmp(&b.1));
        let beside = Left { misfit: misfit - best.map_or(0.0, |(_, gain)| gain), beside: best.map(|(j, _)| j) };
        [Left { misfit, beside: None }, beside]
    }

    /// Whether a suspect shows what some cause of the machine would, were it to act in that row alone; of `out` the others are left
    /// out, and another cause may act beside.
    fn shows_one_row(&self, suspect: &[usize], out: &[usize], beside: Option<usize>) -> bool {
        let [own, ..] = suspect else { return false };
        let others: Vec<usize> = out.iter().filter(|i| !suspect.contains(i)).copied().collect();
        let mut taken = self.units(&others);
        if let Some(j) = beside {
            taken = taken.insert_column(others.len(), 0.0);
            taken.set_column(others.len(), &self.screened.columns.column(j));
        }
        let basis = taken.qr().q();
        let residual = outside(&basis, &DVector::from_column_slice(&self.screened.residual));
        let gain = |column: &DVector<f64>| -> f64 {
            let left = outside(&basis, column);
            let square = left.norm_squared();
            if square < OUTSIDE * column.norm_squared() { 0.0 } else { left.dot(&residual).powi(2) / square }
        };
        let without: f64 = self.units(suspect).column_iter().map(|column| gain(&column.into_owned())).sum();
        let row = self.places[*own].0;
        let in_row = |column: &Vec<f64>| -> Vec<f64> {
            column.iter().zip(self.places).map(|(c, (r, _))| if *r == row { *c } else { 0.0 }).collect()
        };
        let causes = self.catalogue.iter().zip(&self.base.found.columns).filter(|(h, _)| !h.is_sensor() && !h.is_fixed());
        let columns: Vec<Vec<f64>> = causes.map(|(_, column)| in_row(column)).collect();
        let whitened = self.base.whitener.apply_all(&columns);
        let best = whitened.column_iter().map(|column| gain(&column.into_owned())).fold(0.0, f64::max);
        best > without - BETTER
    }
}

/// The part of a vector outside the span of orthonormal columns.
fn outside(basis: &DMatrix<f64>, vector: &DVector<f64>) -> DVector<f64> {
    vector - basis * basis.tr_mul(vector)
}
