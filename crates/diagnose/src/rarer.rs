//! Laws that are looked for only where something is wrong: causes that set in or grow in the course of a log, that act in some tests only,
//! or on the way down, and heats with a power of a variable that has no name.
//!
//! Such a law has a number that the data choose: an instant, a test, or an exponent. It is sought on a grid of signatures, with parabolas
//! between its points, for every cause by itself; what is found joins the catalogue as one law, and pays for its number by the share of
//! all values that the data leave open. Data in which nothing is wrong are never asked.

use std::collections::HashMap;

use rayon::prelude::*;

use super::effects::{Hypothesis, Law, LawForm, Scales, under_rarer_laws};
use super::view::Comparison;
use super::{Problem, history};
use coldplate_base::error::Result;
use coldplate_evidence::measurement::{Whitener, whiten};

/// Causes by each kind of rarer law that join the catalogue: those that take away most misfit.
const MOST: usize = 12;
/// What takes away less misfit than this is not looked at.
const LEAST_GAIN: f64 = 10.0;
/// Steps between two points of the grid.
const BETWEEN: usize = 20;

/// A cause under one law of a grid, with its signature.
struct Tried<'a> {
    hypothesis: &'a Hypothesis,
    column: Vec<f64>,
}

/// Adds the causes by rarer laws that could act to a catalogue and its signatures.
///
/// # Errors
/// The machine cannot be linearised along the logs.
pub fn add(problem: &Problem, base: &mut Comparison, catalogue: &mut Vec<Hypothesis>, scales: &Scales) -> Result<()> {
    let (study, data) = (&problem.study, &problem.data);
    // Where fronts run every cause under every law would be a run.
    if data.is_transient() && history::has_fronts(study, data)? {
        return Ok(());
    }
    let all = under_rarer_laws(catalogue, &study.model.machine, scales);
    if all.is_empty() {
        return Ok(());
    }
    let columns = if data.is_transient() {
        let logs = history::Logs { study, data, runs: problem.runs(), scales, user: &problem.user };
        logs.signatures(&[], &all, base.found.linear.as_ref())?.columns
    } else {
        steady(base, catalogue, &all, scales, problem)
    };
    let residual = base.whitener.apply(&base.found.residual);
    let mut families: Vec<Vec<Tried<'_>>> = Vec::new();
    let mut known: HashMap<_, usize> = HashMap::new();
    for (hypothesis, column) in all.iter().zip(columns) {
        let Law::Of(variable, form) = hypothesis.law else { continue };
        let key = (hypothesis.effect, &hypothesis.place, variable, std::mem::discriminant(&form));
        let at = *known.entry(key).or_insert(families.len());
        if at == families.len() {
            families.push(Vec::new());
        }
        families[at].push(Tried { hypothesis, column });
    }
    let best = |family: &Vec<Tried<'_>>| best_of(family, &base.whitener, &residual, scales);
    let mut found: Vec<Best> = families.par_iter().filter_map(best).collect();
    found.sort_by(|a, b| b.gain.total_cmp(&a.gain));
    let mut kinds: HashMap<_, usize> = HashMap::new();
    for Best { hypothesis, column, .. } in found {
        let Law::Of(_, form) = hypothesis.law else { continue };
        let count = kinds.entry(std::mem::discriminant(&form)).or_default();
        *count += 1;
        if *count <= MOST {
            catalogue.push(hypothesis);
            base.found.columns.push(column);
        }
    }
    Ok(())
}

/// In steady state a law is a factor at each row.
fn steady(base: &Comparison, catalogue: &[Hypothesis], all: &[Hypothesis], scales: &Scales, problem: &Problem) -> Vec<Vec<f64>> {
    let places = whiten::places(&problem.data);
    let of = |h: &Hypothesis| -> Vec<f64> {
        let constant = catalogue.iter().position(|c| c.effect == h.effect && c.place == h.place && c.law == h.effect.usual_law());
        let factor = |row: usize| scales.factor(h.law, &problem.data.rows[row].condition);
        let Some(column) = constant.map(|c| &base.found.columns[c]) else { return vec![0.0; places.len()] };
        column.iter().zip(&places).map(|(v, (row, _))| v * factor(*row)).collect()
    };
    all.par_iter().map(of).collect()
}

/// The best law of a family.
struct Best {
    hypothesis: Hypothesis,
    column: Vec<f64>,
    gain: f64,
}

/// Misfit that a signature of this square and product with the residual takes away.
fn gain(h: &Hypothesis, square: f64, along: f64) -> f64 {
    if square <= 0.0 || (along < 0.0 && !h.is_signed) { 0.0 } else { along * along / square }
}

fn best_of(family: &[Tried<'_>], whitener: &Whitener, residual: &[f64], scales: &Scales) -> Option<Best> {
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let whitened = whitener.apply_all(&family.iter().map(|tried| tried.column.clone()).collect::<Vec<_>>());
    let whitened: Vec<Vec<f64>> = whitened.column_iter().map(|column| column.iter().copied().collect()).collect();
    let gains: Vec<f64> = family.iter().zip(&whitened).map(|(tried, c)| gain(tried.hypothesis, dot(c, c), dot(c, residual))).collect();
    let best = (0..family.len()).max_by(|a, b| gains[*a].total_cmp(&gains[*b]))?;
    let h = family[best].hypothesis;
    if gains[best] < LEAST_GAIN {
        return None;
    }
    let Law::Of(variable, form) = h.law else { return None };
    if form.number().is_none() {
        return Some(Best { hypothesis: h.clone(), column: family[best].column.clone(), gain: gains[best] });
    }
    // A parabola through the best one and its neighbours, in every reading.
    let middle = best.clamp(1, family.len().checked_sub(2)?);
    let number = |k: usize| if let Law::Of(_, form) = family[k].hypothesis.law { form.number() } else { None };
    let (centre, step) = (number(middle)?, number(middle + 1)? - number(middle)?);
    let weights = |f: f64| [0.5 * f * (f - 1.0), 1.0 - f * f, 0.5 * f * (f + 1.0)];
    let three = &whitened[middle - 1..=middle + 1];
    let along: Vec<f64> = three.iter().map(|c| dot(c, residual)).collect();
    let gram: Vec<Vec<f64>> = three.iter().map(|a| three.iter().map(|b| dot(a, b)).collect()).collect();
    let gain_at = |f: f64| {
        let w = weights(f);
        let square = (0..3).map(|i| (0..3).map(|j| w[i] * w[j] * gram[i][j]).sum::<f64>()).sum();
        gain(h, square, w.iter().zip(&along).map(|(w, a)| w * a).sum())
    };
    let at = |i: usize| i as f64 / BETWEEN as f64 - 1.0;
    let top = (0..=2 * BETWEEN).max_by(|a, b| gain_at(at(*a)).total_cmp(&gain_at(at(*b))))?;
    let (f, near) = (at(top), 1.0 / BETWEEN as f64);
    let curvature = (2.0 * gain_at(f) - gain_at(f - near) - gain_at(f + near)) / (near * near);
    let deviation = if curvature > 0.0 { step * (2.0 / curvature).sqrt() } else { f64::INFINITY };
    let form: LawForm = form.with_number(centre + f * step);
    let law = Law::Of(variable, form);
    let number = scales.number(law, deviation)?;
    let w = weights(f);
    let column = (0..residual.len()).map(|i| (0..3).map(|k| w[k] * family[middle - 1 + k].column[i]).sum()).collect();
    Some(Best { hypothesis: h.under_found(law, number, scales), column, gain: gain_at(f) })
}
