//! Logs: taken up again around the cause that explains most.
//!
//! A model that sends a front through a machine too early is wrong in a way that slopes around it cannot tell: a front's
//! delay is no multiple of its derivative once it is longer than the front, and the errors of flow and clock stand where
//! the model has the front, not where it was. So the most probable single causes are fitted first, their secants take the
//! place of slopes, and the errors of conditions are those around the best of them.

use rayon::prelude::*;

use super::catalogue::Hypothesis;
use super::refine::{Bench, Fitted, fit};
use super::signature::{Signatures, TIME_TOLERANCE};
use super::{Errors, decide, misfit, probability, screened};
use crate::error::Result;
use crate::identify::{Prediction, predict_within};
use crate::measure::whiten;
use crate::sensitivity::Parameter;

/// Single causes that are fitted.
const SINGLES: usize = 4;
/// Amplitudes, as a share of the prior's scale, below which a secant is no better than a slope.
const SHORT: f64 = 1e-3;

/// Puts secants in place of the slopes of the most probable causes in `found`, and gives predictions and slopes around the
/// best; `None` where nothing is wrong, or no cause can be fitted.
///
/// # Errors
/// The machine with the best cause cannot be run.
pub fn taken_up(
    bench: &Bench<'_>,
    catalogue: &[Hypothesis],
    found: &mut Signatures,
    errors: &Errors,
    uncertain: &[Parameter],
    seed: u64,
) -> Result<Option<Prediction>> {
    let all: Vec<usize> = (0..found.residual.len()).collect();
    let whitener = errors.whitener(&all);
    let screened = screened(&found.residual, &found.columns, &whitener, catalogue);
    if !decide::is_wrong(&misfit(&screened, seed)) {
        return Ok(None);
    }
    let prior = probability::prior(&screened, catalogue);
    let posterior = probability::posterior(&screened, &prior);
    let singles: Vec<(usize, usize, f64)> = posterior
        .candidates
        .iter()
        .filter(|c| c.members.len() == 1)
        .take(SINGLES)
        .map(|c| (c.members[0], screened.visible[c.members[0]], c.amplitudes[0]))
        .collect();
    let readings = whiten::readings(bench.data);
    let attempt = |(j, h, amplitude): &(usize, usize, f64)| -> Option<(f64, usize, Fitted)> {
        let guess = amplitude * catalogue[*h].scale;
        let fitted = fit(bench, &[&catalogue[*h]], &[guess], &readings, &whitener).ok()?;
        Some((fitted.evidence + prior[*j].ln(), *h, fitted))
    };
    let fitted: Vec<(f64, usize, Fitted)> = singles.par_iter().filter_map(attempt).collect();
    for (_, h, f) in &fitted {
        let amplitude = f.amplitudes[0];
        if amplitude.abs() > SHORT * catalogue[*h].scale {
            found.columns[*h] = f.values.iter().zip(&found.prediction.values).map(|(a, b)| (a - b) / amplitude).collect();
        }
    }
    let Some((_, h, best)) = fitted.iter().max_by(|a, b| a.0.total_cmp(&b.0)) else { return Ok(None) };
    let Some(sets) = bench.sets(&[(&catalogue[*h], best.amplitudes[0])])? else { return Ok(None) };
    let around = if sets.is_empty() {
        Prediction { values: best.values.clone(), ..found.prediction.clone() }
    } else {
        predict_within(&bench.study.edited(&sets)?, bench.data, uncertain, bench.start, TIME_TOLERANCE)?
    };
    Ok(Some(around))
}
