//! What further test would say most about the parameters.

use nalgebra::DMatrix;
use rayon::prelude::*;

use super::estimate::{Estimate, TWO_SIDED_95};
use super::{Problem, states};
use crate::error::Result;
use crate::machine::Condition;
use crate::measure::Whitener;
use crate::sensitivity::Target;

/// Most conditions that are tried.
const MOST: usize = 81;

/// A test and what it would do.
#[derive(Debug, Clone, PartialEq)]
pub struct Advice {
    /// The condition.
    pub condition: Condition,
    /// Sensors to read, as indices into the machine's; those of the data and more where more help.
    pub sensors: Vec<usize>,
    /// Width of each parameter's 95 % interval afterwards over that now.
    pub shrink: Vec<f64>,
    /// Gain of information, in nats: half the logarithm of the ratio of determinants.
    pub gain: f64,
}

/// Steady conditions within the ranges of the machine's variables, ranked by what one reading of `sensors` at each would
/// add at the estimate. Each reading's own sensor error counts as new.
///
/// # Errors
/// As [`Problem::predict`].
pub fn next_tests(problem: &Problem, estimate: &Estimate, sensors: &[usize]) -> Result<Vec<Advice>> {
    let study = problem.machine_at(&estimate.values)?;
    let candidates = candidates(problem);
    let parameters = problem.free.iter().map(|f| study.parameter(&f.parameter.name)).collect::<Result<Vec<_>>>()?;
    let variables = study.model.machine.variables.iter().map(|v| study.parameter(&v.name)).collect::<Result<Vec<_>>>()?;
    let all: Vec<_> = parameters.iter().chain(&variables).cloned().collect();
    let targets: Vec<Target> = sensors.iter().map(|s| Target::Sensor(*s)).collect();
    let p = parameters.len();
    // Without any knowledge a parameter is worth a factor of e, or ten steps.
    let now = &estimate.covariance;
    let solved = states(&study, &candidates)?;
    let of = |at: &crate::sensitivity::Derivatives<'_>| -> Result<Advice> {
        let table = at.jacobian(&targets, &all)?;
        let typical = |k: usize| {
            let known = problem.data.sensors.iter().position(|s| *s == sensors[k]);
            let mean = |v: &[f64]| v.iter().sum::<f64>() / v.len().max(1) as f64;
            match known {
                Some(i) => problem.uncertainty.noise[i].hypot(problem.uncertainty.bias[i]),
                None => mean(&problem.uncertainty.noise).hypot(mean(&problem.uncertainty.bias)),
            }
        };
        let deviation: Vec<f64> = (0..sensors.len()).map(|k| typical(k).hypot(problem.uncertainty.model)).collect();
        let errors = problem.uncertainty.at(&at.condition);
        let common: Vec<Vec<f64>> =
            errors.iter().enumerate().map(|(v, e)| table.slopes.iter().map(|row| row[p + v] * e).collect()).collect();
        let whitener = Whitener::new(&deviation, &common);
        let mut jacobian = DMatrix::zeros(sensors.len(), p);
        for (k, free) in problem.free.iter().enumerate() {
            let counted = if super::estimate::is_factor(free) { 1.0 / estimate.values[k] } else { 1.0 };
            let scale = counted * if free.is_logarithmic { estimate.values[k] } else { 1.0 };
            let column: Vec<f64> = table.slopes.iter().map(|row| row[k] * scale).collect();
            jacobian.set_column(k, &nalgebra::DVector::from_vec(whitener.apply(&column)));
        }
        // Covariance after: (C⁻¹ + JᵀJ)⁻¹ = C - C Jᵀ (I + J C Jᵀ)⁻¹ J C.
        let spread = &jacobian * now * jacobian.transpose() + DMatrix::identity(sensors.len(), sensors.len());
        let inverse = spread.clone().try_inverse().unwrap_or_else(|| DMatrix::zeros(sensors.len(), sensors.len()));
        let after = now - now * jacobian.transpose() * inverse * &jacobian * now;
        let shrink = (0..p).map(|k| (after[(k, k)].max(0.0) / now[(k, k)]).sqrt()).collect();
        let gain = 0.5 * spread.determinant().max(1.0).ln();
        Ok(Advice { condition: at.condition.clone(), sensors: sensors.to_vec(), shrink, gain })
    };
    let mut found: Vec<Advice> = solved.par_iter().map(of).collect::<Result<_>>()?;
    found.sort_by(|a, b| b.gain.total_cmp(&a.gain));
    debug_assert!(TWO_SIDED_95 > 1.0);
    Ok(found)
}

/// Low, middle and high of every variable with a range; fewer places where that would be too many.
fn candidates(problem: &Problem) -> Vec<Condition> {
    let machine = &problem.study.model.machine;
    let base = problem.data.rows[0].condition.si().to_vec();
    let ranged: Vec<(usize, (f64, f64))> =
        machine.variables.iter().enumerate().filter_map(|(v, variable)| variable.range.map(|r| (v, r))).collect();
    let places: &[f64] = if 3usize.pow(ranged.len() as u32) <= MOST { &[0.0, 0.5, 1.0] } else { &[0.0, 1.0] };
    let mut found = vec![base];
    for (v, (low, high)) in ranged {
        if found.len() * places.len() > MOST {
            break;
        }
        found = found
            .into_iter()
            .flat_map(|c| {
                places.iter().map(move |share| {
                    let mut moved = c.clone();
                    moved[v] = low + share * (high - low);
                    moved
                })
            })
            .collect();
    }
    found.into_iter().map(Condition::from_si).collect()
}
