//! The further test that adds most information about the parameters.

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::IdentifyProblem;
use super::estimate::Estimate;
use crate::measurement::Whitener;
use coldplate_base::error::{Error, Result};
use coldplate_describe::machine::Condition;
use coldplate_solve::sensitivity::{DerivativeTarget, Derivatives, Variation};
use coldplate_solve::study::ParameterKind;

/// Most corners of the ranges that are tried, count. Chosen: each costs a steady solve with derivatives.
const MOST: usize = 32;

/// A test and its effect on the intervals.
#[derive(Debug, Clone, PartialEq)]
pub struct Advice {
    /// The condition of the test.
    pub condition: Condition,
    /// Sensors to read, as indices into the machine's sensors. Others than those of the data may be among them if they help
    /// more.
    pub sensors: Vec<usize>,
    /// Width of each parameter's 95 % interval after the test, over the width now.
    pub shrink: Vec<f64>,
    /// Gain of information, in nats: half the logarithm of the ratio of determinants.
    pub gain: f64,
}

/// Steady conditions within the ranges of the machine's variables, ranked by the information that one reading of `sensors` at
/// each would add at the estimate. The own error of the sensor counts as new in each reading.
///
/// The first condition of the data, the middle and the corners of the ranges are tried (information grows towards the ends of
/// the ranges). Then, from the best corner, each variable is moved to the middle of its range in turn. Conditions without a
/// steady state are left out.
///
/// # Errors
/// Errors of [`IdentifyProblem::predict`].
pub fn next_tests(problem: &IdentifyProblem, estimate: &Estimate, sensors: &[usize]) -> Result<Vec<Advice>> {
    let study = problem.machine_at(&estimate.values)?;
    let machine = &study.model.machine;
    let names = problem.free.iter().map(|f| &f.parameter.name).chain(machine.variables.iter().map(|v| &v.name));
    let variations = names.map(|name| study.variation(&study.parameter(name)?)).collect::<Result<Vec<Variation>>>()?;
    let targets: Vec<DerivativeTarget> = sensors.iter().map(|s| DerivativeTarget::Sensor(*s)).collect();
    let deviation: Vec<f64> = sensors.iter().map(|s| own_error(problem, *s)).collect();
    let base = problem.data.rows.first().map(|row| row.condition.clone()).ok_or_else(|| Error::input("there is no reading"))?;
    let solver = study.model.solver(&base)?;
    let of = |condition: &Condition| -> Result<Advice> {
        let point = Derivatives::new(&study, condition, &study.model.solve(&solver, condition)?)?;
        let slopes = point.jacobian_of(&targets, &variations)?.slopes;
        let (shrink, gain) = gain(problem, estimate, &slopes, &deviation, condition);
        Ok(Advice { condition: condition.clone(), sensors: sensors.to_vec(), shrink, gain })
    };
    let tried = |conditions: Vec<Condition>| -> Vec<Advice> {
        let found: Vec<Result<Advice>> = conditions.par_iter().map(of).collect();
        found.into_iter().filter_map(Result::ok).collect()
    };
    let ranges: Vec<(usize, (f64, f64))> =
        machine.variables.iter().enumerate().filter_map(|(v, variable)| variable.range.map(|r| (v, r))).collect();
    let mut found = tried(candidates(&base, &ranges));
    let better = |a: &Advice, b: &Advice| a.gain.total_cmp(&b.gain);
    if let Some(best) = found.iter().max_by(|a, b| better(a, b)) {
        let halfway = |(v, (low, high)): &(usize, (f64, f64))| {
            let mut moved = best.condition.si().to_vec();
            moved[*v] = 0.5 * (low + high);
            Condition::from_si(moved)
        };
        let more: Vec<Condition> = ranges.iter().map(halfway).filter(|c| found.iter().all(|a| a.condition != *c)).collect();
        found.extend(tried(more));
    }
    found.sort_by(|a, b| better(b, a));
    Ok(found)
}

/// Error of a sensor in one reading, K: as stated, or the mean of the other sensors' if it is not in the data.
fn own_error(problem: &IdentifyProblem, sensor: usize) -> f64 {
    let known = problem.data.sensors.iter().position(|s| *s == sensor);
    let mean = |v: &[f64]| v.iter().sum::<f64>() / v.len().max(1) as f64;
    let u = &problem.uncertainty;
    let own = match known {
        Some(i) => u.noise[i].hypot(u.bias[i]),
        None => mean(&u.noise).hypot(mean(&u.bias)),
    };
    own.hypot(u.model)
}

/// Effect of readings with these slopes (parameters, then conditions) on every interval, and the information they add.
fn gain(problem: &IdentifyProblem, estimate: &Estimate, slopes: &[Vec<f64>], deviation: &[f64], condition: &Condition) -> (Vec<f64>, f64) {
    let (p, n) = (problem.free.len(), slopes.len());
    let errors = problem.uncertainty.at(condition);
    let common: Vec<Vec<f64>> = errors.iter().enumerate().map(|(v, error)| slopes.iter().map(|row| row[p + v] * error).collect()).collect();
    let whitener = Whitener::new(deviation, &common);
    let mut jacobian = DMatrix::zeros(n, p);
    for (k, free) in estimate.free.iter().enumerate() {
        // In the changed file a factor counts from the value found.
        let counted = if free.parameter.kind == ParameterKind::Factor { 1.0 / estimate.values[k] } else { 1.0 };
        let scale = counted * if free.is_logarithmic { estimate.values[k] } else { 1.0 };
        // A further test does not inform about a parameter of another test.
        let scale = if free.test.is_none() { scale } else { 0.0 };
        let column: Vec<f64> = slopes.iter().map(|row| row[k] * scale).collect();
        jacobian.set_column(k, &DVector::from_vec(whitener.apply(&column)));
    }
    // Covariance after: (C⁻¹ + JᵀJ)⁻¹ = C - C Jᵀ (I + J C Jᵀ)⁻¹ J C.
    let now = &estimate.covariance;
    let spread = &jacobian * now * jacobian.transpose() + DMatrix::identity(n, n);
    let inverse = spread.clone().try_inverse().unwrap_or_else(|| DMatrix::zeros(n, n));
    let after = now - now * jacobian.transpose() * inverse * &jacobian * now;
    let shrink = (0..p).map(|k| (after[(k, k)].max(0.0) / now[(k, k)]).sqrt()).collect();
    (shrink, 0.5 * spread.determinant().max(1.0).ln())
}

/// `base`, the middle of the ranges and their corners. If all corners would be too many, only the first variables are varied.
fn candidates(base: &Condition, ranges: &[(usize, (f64, f64))]) -> Vec<Condition> {
    let mut middle = base.si().to_vec();
    ranges.iter().for_each(|(v, (low, high))| middle[*v] = 0.5 * (low + high));
    let mut corners = vec![base.si().to_vec()];
    for (v, (low, high)) in ranges {
        if 2 * corners.len() > MOST {
            break;
        }
        let moved = |c: &Vec<f64>, to: f64| {
            let mut c = c.clone();
            c[*v] = to;
            c
        };
        corners = corners.iter().flat_map(|c| [moved(c, *low), moved(c, *high)]).collect();
    }
    let mut found: Vec<Vec<f64>> = Vec::new();
    for c in [base.si().to_vec(), middle].into_iter().chain(corners) {
        if !found.contains(&c) {
            found.push(c);
        }
    }
    found.into_iter().map(Condition::from_si).collect()
}
