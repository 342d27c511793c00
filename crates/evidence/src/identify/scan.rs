//! The misfit over a grid of two parameters: the published way to find them, and the shape of the valley.

use std::sync::atomic::{AtomicUsize, Ordering};

use rayon::prelude::*;

use super::{IdentifyProblem, values};
use crate::measurement::{Whitener, whiten};
use coldplate_base::error::{Error, Result};
use coldplate_base::numbers::sum_of_squares;
use coldplate_base::progress::Progress;
use coldplate_solve::study::MachineParameter;

/// Most points of a grid, count. Chosen: each costs a prediction of all readings.
const MOST: usize = 250_000;

/// A misfit over a grid of two parameters.
#[derive(Debug, Clone, PartialEq)]
pub struct MisfitScan {
    /// The two parameters' names.
    pub names: [String; 2],
    /// Values of each along its axis, SI.
    pub axes: [Vec<f64>; 2],
    /// Mean absolute difference from the readings, K: the published criterion. `[first][second]`.
    pub mean: Vec<Vec<f64>>,
    /// Whitened misfit; `[first][second]`.
    pub misfit: Vec<Vec<f64>>,
    /// Predictions of every reading, K; `[first][second][reading]`.
    pub predictions: Vec<Vec<Vec<f64>>>,
}

impl MisfitScan {
    /// Indices of the least value of a table, along both axes.
    pub fn least(table: &[Vec<f64>]) -> (usize, usize) {
        let all = table.iter().enumerate().flat_map(|(i, row)| row.iter().enumerate().map(move |(j, v)| (i, j, *v)));
        all.filter(|p| p.2.is_finite()).min_by(|a, b| a.2.total_cmp(&b.2)).map_or((0, 0), |(i, j, _)| (i, j))
    }
}

/// Solves the data's conditions at every pair of values; free parameters play no part. A pair at which the machine has no
/// steady state (a contact that conducts nothing may cut a source off) is NaN.
///
/// # Errors
/// Too many points, or the machine cannot be solved at all.
pub fn scan(problem: &IdentifyProblem, pair: [(&MachineParameter, Vec<f64>); 2], progress: &dyn Progress) -> Result<MisfitScan> {
    let [(first, along), (second, across)] = pair;
    if along.is_empty() || across.is_empty() || along.len() * across.len() > MOST {
        return Err(Error::input(format!("a grid of {} by {} points", along.len(), across.len()))
            .at_key("--scan")
            .help(format!("at least one and at most {MOST} points")));
    }
    if first.name == second.name {
        return Err(Error::input("both axes are the same parameter").at_key(&first.name).help("scan two different parameters"));
    }
    let start = super::predict(&problem.study, &problem.data, &[], problem.start)?;
    let whitener = Whitener::of(&problem.data, &problem.uncertainty, &start.conditions);
    let readings = whiten::readings(&problem.data);
    let (done, total) = (AtomicUsize::new(0), along.len() * across.len());
    let at = |a: &f64, b: &f64| -> Vec<f64> {
        let found = problem.study.with(&[(first, *a), (second, *b)]).and_then(|study| values(&study, &problem.data, problem.start));
        progress.count(done.fetch_add(1, Ordering::Relaxed) + 1, total, "pairs");
        found.unwrap_or_else(|_| vec![f64::NAN; readings.len()])
    };
    let predictions: Vec<Vec<Vec<f64>>> = along.par_iter().map(|a| across.par_iter().map(|b| at(a, b)).collect()).collect();
    let difference = |p: &[f64]| -> Vec<f64> { readings.iter().zip(p).map(|(r, p)| r - p).collect() };
    let table = |of: &dyn Fn(&Vec<f64>) -> f64| predictions.iter().map(|row| row.iter().map(of).collect()).collect();
    let mean = table(&|p| difference(p).iter().map(|d| d.abs()).sum::<f64>() / readings.len() as f64);
    let misfit = table(&|p| sum_of_squares(&whitener.apply(&difference(p))));
    Ok(MisfitScan { names: [first.name.clone(), second.name.clone()], axes: [along, across], mean, misfit, predictions })
}
