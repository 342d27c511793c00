//! Length scales and smoothing of radial functions, by a quasi-Newton search in their logarithms.

use super::model::Kernel;
use super::rbf::{Criterion, RbfSolution, RbfSystem, left_out_score};

/// Range of inverse length scales, in scaled variables. Chosen: from hardly any influence to a tenth of the range.
const SCALES: (f64, f64) = (0.01, 10.0);
/// Range of the smoothing, on a kernel of order one. Chosen: the lower end bounds the weights, and with them the rounding error
/// of a query.
const SMOOTHING: (f64, f64) = (1e-11, 1.0);
/// Least gain of a step in the criterion, below which the search ends (about 0.005 % of the error). Chosen: less does
/// not matter.
const ENOUGH: f64 = 1e-4;
/// Starting points: inverse length scale, smoothing. Chosen: the second supposes noise, which the first may fail to
/// find.
const STARTS: [(f64, f64); 2] = [(0.25, 1e-6), (0.5, 1e-3)];

/// Number of steps from each starting point before the best is chosen. Chosen: enough to rank the starting points.
const FIRST_STEPS: usize = 8;

/// Factor by which smoothing is raised while weights are too large, dimensionless. Chosen: smaller finds less
/// smoothing, larger needs fewer solves.
pub(super) const MORE: f64 = 4.0;
/// Most raises of the smoothing, a count. Chosen: together a factor of four billion.
pub(super) const MOST_RAISES: usize = 16;

/// Tuned parameters of one kernel and tail.
#[derive(Debug, Clone)]
pub struct Tuned {
    /// Logarithms of the inverse length scales of the active variables, then of the smoothing.
    pub parameters: Vec<f64>,
    /// Mean over outputs of ln(mean squared left-out residual).
    pub score: f64,
}

impl Tuned {
    /// Inverse length scales of the active variables.
    pub fn scales(&self) -> Vec<f64> {
        self.parameters.iter().take(self.parameters.len().saturating_sub(1)).map(|p| p.exp()).collect()
    }

    /// Smoothing, added to the kernel matrix' diagonal.
    pub fn smoothing(&self) -> f64 {
        self.parameters.last().map_or(0.0, |p| p.exp())
    }
}

/// A place that the search has come to.
#[derive(Clone)]
struct Reached {
    value: f64,
    parameters: Vec<f64>,
    /// Inverse of the curvature, as far as the steps so far tell it.
    inverse_hessian: Option<Vec<Vec<f64>>>,
}

impl Reached {
    fn start(parameters: Vec<f64>) -> Self {
        Self { value: f64::INFINITY, parameters, inverse_hessian: None }
    }
}

/// Tunes from scratch on systems of more and more rows. On the first, a few steps are taken from each starting point, and the search
/// goes on from the best. On each further one it goes on from the best of all ends so far, as that system judges them. Fewer rows may
/// take a rough function for noise: where the criterion falls by less than the logarithm of the rows grows, as it does of noise, the
/// search goes on from the starting points too.
///
/// The criterion is a mean over rows, so that its minimum and its curvature on some of the rows are nearly those on all, where a step
/// costs the third power of their number.
pub(crate) fn tune(systems: &[RbfSystem], kernel: Kernel, criterion: Criterion, steps: usize) -> Option<Tuned> {
    let last = systems.last()?;
    let mut ends: Vec<Reached> = Vec::new();
    let mut before: Option<(f64, f64)> = None;
    for system in systems {
        let judged = |end: &Reached| system.judge(kernel, &end.parameters, criterion).map_or(f64::INFINITY, |(value, _)| value);
        ends.iter_mut().for_each(|end| end.value = judged(end));
        ends.sort_by(|a, b| a.value.total_cmp(&b.value));
        let mut from: Vec<Reached> = ends.first().cloned().into_iter().collect();
        let log_rows = (system.values().first().map_or(0, Vec::len) as f64).ln();
        let falls = |best: &Reached, (value, rows): (f64, f64)| value - best.value > log_rows - rows;
        if !from.first().zip(before).is_some_and(|(best, before)| falls(best, before)) {
            let start = |(scale, smoothing): &(f64, f64)| {
                let mut p = vec![scale.ln(); system.active().len()];
                p.push(smoothing.ln());
                search(system, kernel, Reached::start(p), criterion, FIRST_STEPS.min(steps))
            };
            from.extend(STARTS.iter().filter_map(start).min_by(|a, b| a.value.total_cmp(&b.value)));
        }
        let further = from.into_iter().filter_map(|end| search(system, kernel, end, criterion, steps));
        ends.insert(0, further.min_by(|a, b| a.value.total_cmp(&b.value))?);
        before = ends.first().map(|end| (end.value, log_rows));
    }
    scored(last, kernel, ends.swap_remove(0).parameters)
}

/// Tunes from parameters that are nearly right.
pub(crate) fn retune(system: &RbfSystem, kernel: Kernel, criterion: Criterion, begin: &[f64], steps: usize) -> Option<Tuned> {
    scored(system, kernel, search(system, kernel, Reached::start(begin.to_vec()), criterion, steps)?.parameters)
}

/// Solves with the tuned parameters. If the weights are so large that they would multiply the rounding of every query, smoothing is
/// raised until they are not: the model loses little by it, and is often still the best by far.
pub fn settle(system: &RbfSystem, kernel: Kernel, mut tuned: Tuned) -> Option<(Tuned, RbfSolution)> {
    for _ in 0..MOST_RAISES {
        let solved = system.solve(kernel, &tuned.scales(), tuned.smoothing());
        if let Some(solved) = solved.filter(|solved| solved.is_well_conditioned(system.values())) {
            tuned.score = left_out_score(&solved.left_out, system.values());
            return Some((tuned, solved));
        }
        *tuned.parameters.last_mut()? += MORE.ln();
    }
    None
}

fn scored(system: &RbfSystem, kernel: Kernel, parameters: Vec<f64>) -> Option<Tuned> {
    let mut tuned = Tuned { parameters, score: f64::INFINITY };
    tuned.score = system.left_out_score(kernel, &tuned.scales(), tuned.smoothing())?;
    Some(tuned)
}

/// BFGS with a backtracking line search, kept in the box by a quadratic penalty outside it.
fn search(system: &RbfSystem, kernel: Kernel, begin: Reached, criterion: Criterion, steps: usize) -> Option<Reached> {
    let n = begin.parameters.len();
    let evaluate = |x: &[f64]| -> Option<(f64, Vec<f64>)> {
        let (mut value, mut gradient) = system.judge(kernel, x, criterion)?;
        for (k, (x, g)) in x.iter().zip(&mut gradient).enumerate() {
            let (low, high) = if k + 1 == n { SMOOTHING } else { SCALES };
            let outside = x - x.clamp(low.ln(), high.ln());
            value += outside * outside;
            *g += 2.0 * outside;
        }
        Some((value, gradient))
    };
    let mut x = begin.parameters;
    let (mut value, mut gradient) = evaluate(&x).or_else(|| {
        // Too smooth for working precision: more smoothing.
        *x.last_mut()? = (1e-4_f64).ln();
        evaluate(&x)
    })?;
    let mut fresh = begin.inverse_hessian.is_none();
    let mut inverse_hessian = begin.inverse_hessian.unwrap_or_else(|| identity(n));
    for _ in 0..steps {
        let mut direction: Vec<f64> = inverse_hessian.iter().map(|row| -dot(row, &gradient)).collect();
        if dot(&direction, &gradient) >= 0.0 {
            inverse_hessian = identity(n);
            direction = gradient.iter().map(|g| -g).collect();
            fresh = true;
        }
        // No parameter moves by more than a factor e^1.5 in one step.
        let longest = direction.iter().fold(0.0_f64, |m, d| m.max(d.abs()));
        let limit = if fresh { 0.5 } else { 1.5 };
        let shrink = if longest > limit { limit / longest } else { 1.0 };
        direction.iter_mut().for_each(|d| *d *= shrink);
        let slope = dot(&direction, &gradient);
        let mut step = 1.0;
        let mut accepted = None;
        for _ in 0..8 {
            let trial: Vec<f64> = x.iter().zip(&direction).map(|(x, d)| x + step * d).collect();
            if let Some((v, g)) = evaluate(&trial)
                && v <= value + 1e-4 * step * slope
            {
                accepted = Some((trial, v, g));
                break;
            }
            step *= 0.35;
        }
        let Some((next, next_value, next_gradient)) = accepted else { break };
        let s: Vec<f64> = next.iter().zip(&x).map(|(a, b)| a - b).collect();
        let y: Vec<f64> = next_gradient.iter().zip(&gradient).map(|(a, b)| a - b).collect();
        update(&mut inverse_hessian, &s, &y, fresh);
        fresh = false;
        let gain = value - next_value;
        (x, value, gradient) = (next, next_value, next_gradient);
        if gain < ENOUGH {
            break;
        }
    }
    Some(Reached { value, parameters: x, inverse_hessian: (!fresh).then_some(inverse_hessian) })
}

/// The BFGS update of the inverse Hessian; left alone where the curvature along the step is not positive.
fn update(h: &mut [Vec<f64>], s: &[f64], y: &[f64], scale_first: bool) {
    let sy = dot(s, y);
    let yy = dot(y, y);
    if sy <= 1e-10 * yy.sqrt() * dot(s, s).sqrt() {
        return;
    }
    if scale_first {
        for (i, row) in h.iter_mut().enumerate() {
            row.iter_mut().enumerate().for_each(|(j, x)| *x = if i == j { sy / yy } else { 0.0 });
        }
    }
    let hy: Vec<f64> = h.iter().map(|row| dot(row, y)).collect();
    let yhy = dot(y, &hy);
    for (i, row) in h.iter_mut().enumerate() {
        for (j, x) in row.iter_mut().enumerate() {
            *x += (1.0 + yhy / sy) * s[i] * s[j] / sy - (hy[i] * s[j] + s[i] * hy[j]) / sy;
        }
    }
}

fn identity(n: usize) -> Vec<Vec<f64>> {
    (0..n).map(|i| (0..n).map(|j| f64::from(u8::from(i == j))).collect()).collect()
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use coldplate_base::random::Random;

    /// A search that begins on a quarter and half of the rows ends where one on all of them ends, or better: of a function that a quarter takes
    /// for noise, and of noise. Of a smooth function both leave less than a ten-thousandth of it.
    #[test]
    fn a_search_that_begins_on_some_of_the_rows_ends_as_well() {
        (1..7).for_each(ends_as_well);
    }

    fn ends_as_well(seed: u64) {
        let mut random = Random::new(seed);
        let rows: Vec<Vec<f64>> = (0..160).map(|_| (0..2).map(|_| 2.0 * random.unit() - 1.0).collect()).collect();
        let noise: Vec<f64> = rows.iter().map(|_| 0.1 * random.normal()).collect();
        let smooth = |u: &[f64]| (2.0 * u[0]).sin() + u[0] * u[1];
        let functions = [
            ("smooth", rows.iter().map(|u| smooth(u)).collect::<Vec<f64>>()),
            ("rough", rows.iter().map(|u| (9.0 * u[0]).sin() + u[1]).collect()),
            ("noisy", rows.iter().zip(&noise).map(|(u, e)| smooth(u) + e).collect()),
        ];
        let system = |count: usize, y: &[f64]| {
            let tail = vec![vec![0, 0], vec![1, 0], vec![0, 1]];
            RbfSystem::new(rows[..count].to_vec(), vec![0, 1], tail, vec![y[..count].to_vec()]).unwrap()
        };
        for criterion in [Criterion::LeaveOneOut, Criterion::Likelihood] {
            for (name, y) in &functions {
                let of = |counts: &[usize]| {
                    let systems: Vec<RbfSystem> = counts.iter().map(|count| system(*count, y)).collect();
                    let found = tune(&systems, Kernel::Gaussian, criterion, 30).unwrap();
                    systems.last().unwrap().judge(Kernel::Gaussian, &found.parameters, criterion).unwrap().0
                };
                let (staged, whole) = (of(&[40, 80, 160]), of(&[160]));
                // A tenth in the criterion is a twentieth of the error.
                let is_small = *name == "smooth" && staged.max(whole) < 2.0 * 1e-4f64.ln();
                assert!(staged < whole + 0.1 || is_small, "seed {seed}, {name}, {criterion:?}: {staged} and {whole}");
            }
        }
    }
}
