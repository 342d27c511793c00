//! Response of readings over time to a small lasting change: the machine linearised along one of its own histories, in few unknowns.
//!
//! C dT/dt + A(t) T = -f(t) holds for the change of temperatures T that a change f of the residual makes; A(t) is the derivative of the
//! residual along the history. The fields (A + s C)⁻ᵀ w of the weights w of every sensor, at rates s from none to the fastest that the
//! readings can show, span a space on which the equations are projected: at each of those rates the projected machine answers *every* f
//! as the whole one does (Grimme, Krylov projection methods for model reduction, 1997), so that any number of candidates is followed
//! for the cost of a few dozen linear solves. Trial and test space are equal, so that decaying solutions stay decaying.

use faer::linalg::solvers::{PartialPivLu, Solve};
use faer::{MatMut, MatRef};
use nalgebra::{DMatrix, DMatrixView, DVector, SymmetricEigen};
use rayon::prelude::*;

use super::point::Derivatives;
use crate::study::Study;
use coldplate_base::error::{Error, Result};
use coldplate_describe::machine::Condition;
use coldplate_network::Load;

/// Least change between two moments that are kept: in kelvin at any node. Chosen: number of moments against the error between them.
const LEAST_APART: f64 = 0.25;
/// A change of a source or a flow by this share of all heat or of the largest flow counts as a kelvin does; dimensionless. Chosen.
const SHARE: f64 = 0.02;
/// Relative difference of flows above which moments have a space of their own, dimensionless. Chosen.
const OTHER_FLOW: f64 = 0.25;
/// Most spaces for different flows, a count. Chosen: linear solves against accuracy.
const MOST_SPACES: usize = 4;
/// Ratio of one rate to the next, dimensionless. Chosen: linear solves against accuracy between the rates.
const RATIO: f64 = 4.0;
/// Relative residual of the fields that span the space, dimensionless. Chosen.
const FIELD: f64 = 1e-8;
/// Directions of less energy than this share of a field's own are left out, dimensionless. Chosen: size of the space against rounding.
const LEAST_ENERGY: f64 = 1e-10;
/// Steps between two moments, a count. Chosen: error in time against cost.
pub const STEPS: usize = 4;
/// Coefficient, dimensionless, of the two-stage, L-stable, second-order Runge-Kutta method of Alexander (SIAM J. Numer. Anal. 14 (1977)
/// 1006).
const GAMMA: f64 = 1.0 - std::f64::consts::FRAC_1_SQRT_2;

/// An instant of a history.
#[derive(Debug, Clone, PartialEq)]
pub struct Moment {
    /// Time, s.
    pub time: f64,
    /// The condition.
    pub condition: Condition,
    /// Load at this condition.
    pub load: Load,
    /// Temperature of every node, K.
    pub temperatures: Vec<f64>,
}

fn farthest(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).fold(0.0, |m: f64, (a, b)| m.max((a - b).abs()))
}

/// The instants of a history between which it runs about straight; never many more than `limit`.
#[derive(Debug, Clone)]
pub struct Moments {
    limit: usize,
    kept: Vec<Moment>,
    last: Option<Moment>,
    apart: f64,
    /// Most heat of all sources, W, and largest flow, m³/s, so far.
    most: (f64, f64),
}

impl Moments {
    /// Keeps as many as `limit`, and the last ones.
    pub fn new(limit: usize) -> Self {
        Self { limit, kept: Vec::new(), last: None, apart: 0.0, most: (0.0, 0.0) }
    }

    /// Looks at the next instant: its time (s), condition, load, and the temperature of every node, K.
    pub fn see(&mut self, time: f64, condition: &Condition, load: &Load, temperatures: &[f64]) {
        let heat = load.powers.iter().map(|p| p.abs()).sum();
        self.most = (self.most.0.max(heat), load.flows.iter().fold(self.most.1, |m, f| m.max(f.abs())));
        self.add(Moment { time, condition: condition.clone(), load: load.clone(), temperatures: temperatures.to_vec() });
        if self.kept.len() > self.limit {
            let apart = 2.0 * self.apart.max(LEAST_APART);
            let mut fewer = Self { apart, most: self.most, ..Self::new(self.limit) };
            std::mem::take(&mut self.kept).into_iter().for_each(|m| fewer.add(m));
            fewer.extend();
            *self = Self { last: self.last.take(), ..fewer };
        }
    }

    /// Distance of two instants, K.
    fn between(&self, a: &Moment, b: &Moment) -> f64 {
        let share = |a: &[f64], b: &[f64], most: f64| if most > 0.0 { farthest(a, b) / (SHARE * most) } else { 0.0 };
        let given = farthest(&a.load.inlets, &b.load.inlets).max(farthest(&a.load.fixed, &b.load.fixed));
        farthest(&a.temperatures, &b.temperatures)
            .max(given)
            .max((a.load.chamber - b.load.chamber).abs())
            .max(share(&a.load.powers, &b.load.powers, self.most.0))
            .max(share(&a.load.flows, &b.load.flows, self.most.1))
    }

    fn add(&mut self, now: Moment) {
        let least = self.apart.max(LEAST_APART);
        if self.kept.last().is_none_or(|kept| self.between(kept, &now) > least) {
            // A change that came mostly at once is not spread over the time since the moment kept before.
            let is_own = |last: &Moment| self.between(last, &now) > 0.5 * least && self.kept.last() != Some(last);
            if let Some(last) = self.last.clone().filter(is_own) {
                self.kept.push(last);
            }
            self.kept.push(now.clone());
        }
        self.last = Some(now);
    }

    fn extend(&mut self) {
        if let Some(last) = self.last.take().filter(|last| self.kept.last() != Some(last)) {
            self.kept.push(last);
        }
    }

    /// The moments kept, the last one seen among them.
    pub fn into_kept(mut self) -> Vec<Moment> {
        self.extend();
        self.kept
    }
}

/// The space of all temperature changes that given sensors can see.
#[derive(Debug, Clone)]
pub struct ObservableSpace {
    size: usize,
    /// `size` components of each node.
    by_node: Vec<f64>,
    /// Heat capacity, projected.
    capacity: DMatrix<f64>,
    /// A row of weights for each sensor.
    readings: DMatrix<f64>,
}

impl ObservableSpace {
    /// A space for sensors (indices of the network's) about `moments` of histories, for rates (1/s) from the slowest to the fastest of
    /// interest.
    ///
    /// # Errors
    /// Errors of [`Derivatives::at`] and [`crate::Tangent::solve_transposed`]; no sensor reads a node that is free to change.
    pub fn new(study: &Study, sensors: &[usize], moments: &[&Moment], slowest: f64, fastest: f64) -> Result<Self> {
        let network = &study.model.network;
        let chosen = by_flow(study, moments)?;
        let Some(first) = chosen.first() else { return Err(Error::numerics("a history without moments")) };
        let capacity = capacities(first);
        let mut rates = vec![0.0];
        let mut rate = slowest;
        while rate < fastest * RATIO.sqrt() {
            rates.push(rate);
            rate *= RATIO;
        }
        let weights = |s: &usize| -> Vec<f64> {
            let mut right = vec![0.0; network.nodes];
            network.sensors[*s].weights.iter().for_each(|(n, w)| right[*n as usize] += w);
            network.fixed.iter().for_each(|(n, _)| right[*n as usize] = 0.0);
            right
        };
        let rights: Vec<Vec<f64>> = sensors.iter().map(weights).collect();
        let seen: Vec<&Vec<f64>> = rights.iter().filter(|r| r.iter().any(|w| *w != 0.0)).collect();
        if seen.is_empty() {
            return Err(Error::numerics("no sensor reads a node that is free to change"));
        }
        let pairs: Vec<(usize, f64)> = (0..chosen.len()).flat_map(|c| rates.iter().map(move |r| (c, *r))).collect();
        let of = |(c, rate): &(usize, f64)| -> Result<Vec<Vec<f64>>> {
            let tangent = chosen[*c].tangent.shifted(*rate, &capacity)?;
            seen.par_iter().map(|right| tangent.solve_transposed_within(right, FIELD)).collect()
        };
        let fields: Vec<Vec<f64>> = pairs.par_iter().map(of).collect::<Result<Vec<_>>>()?.into_iter().flatten().collect();
        // Measure that tells directions apart: capacity, plus conductance over the fastest rate.
        let measure: Vec<f64> = capacity.iter().zip(first.tangent.diagonal()).map(|(c, d)| c + d / fastest).collect();
        let (size, by_node) = orthonormal(&fields, &measure);
        let mut basis = Self { size, by_node, capacity: DMatrix::zeros(size, size), readings: DMatrix::zeros(sensors.len(), size) };
        for (node, c) in capacity.iter().enumerate() {
            let own = basis.of_node(node).to_vec();
            for (j, v) in own.iter().enumerate() {
                basis.capacity.column_mut(j).iter_mut().zip(&own).for_each(|(e, w)| *e += c * v * w);
            }
        }
        for (k, s) in sensors.iter().enumerate() {
            for (node, w) in &network.sensors[*s].weights {
                let own = basis.of_node(*node as usize).to_vec();
                own.iter().enumerate().for_each(|(j, v)| basis.readings[(k, j)] += w * v);
            }
        }
        Ok(basis)
    }

    /// Number of directions.
    pub fn size(&self) -> usize {
        self.size
    }

    fn of_node(&self, node: usize) -> &[f64] {
        &self.by_node[node * self.size..(node + 1) * self.size]
    }

    /// A change of the residual (nodes and W), projected.
    pub fn project(&self, rows: impl IntoIterator<Item = (usize, f64)>) -> DVector<f64> {
        let mut found = DVector::zeros(self.size);
        for (node, r) in rows {
            found.iter_mut().zip(self.of_node(node)).for_each(|(f, v)| *f += r * v);
        }
        found
    }

    /// The derivative of the residual, projected.
    pub fn matrix(&self, at: &Derivatives<'_>) -> DMatrix<f64> {
        let nodes = at.tangent.diagonal().len();
        let by_node = DMatrixView::from_slice(&self.by_node, self.size, nodes);
        let mut product = DMatrix::zeros(nodes, self.size);
        for (direction, mut column) in by_node.row_iter().zip(product.column_iter_mut()) {
            let direction: Vec<f64> = direction.iter().copied().collect();
            at.tangent.multiply(&direction, column.as_mut_slice());
        }
        by_node * product
    }
}

/// A linearised history, ready to be disturbed.
#[derive(Debug)]
pub struct LinearisedHistory<'a> {
    basis: &'a ObservableSpace,
    start: f64,
    /// Decomposition at the first moment, if the history begins with the steady state.
    rest: Option<PartialPivLu<f64>>,
    steps: Vec<Step>,
}

/// A step in time between a moment and the next.
#[derive(Debug)]
struct Step {
    moment: usize,
    /// Places of its stages on the way to the next moment, 0 to 1.
    stages: [f64; 2],
    length: f64,
    end: f64,
    /// Inverses of the matrices of its stages: these are small, and each serves many products.
    inverses: [DMatrix<f64>; 2],
}

impl<'a> LinearisedHistory<'a> {
    /// A history from the projected derivatives at the times of moments, with so many time steps between each and the next, usually
    /// [`STEPS`]; `is_steady` where it begins with the steady state.
    pub fn new(basis: &'a ObservableSpace, moments: &[(f64, DMatrix<f64>)], steps: impl Fn(usize) -> usize, is_steady: bool) -> Self {
        let step = |(i, n, count): (usize, usize, usize)| {
            let ((from, before), (to, after)) = (&moments[i], &moments[i + 1]);
            let length = (to - from) / count as f64;
            let stages = [(n as f64 + GAMMA) / count as f64, (n + 1) as f64 / count as f64];
            let matrix =
                |share: &f64| inverse(&decomposed(&(&basis.capacity + (before * (1.0 - share) + after * *share) * (GAMMA * length))));
            let inverses = stages.each_ref().map(matrix);
            Step { moment: i, stages, length, end: from + stages[1] * (to - from), inverses }
        };
        let stretches = (1..moments.len()).filter(|i| moments[*i].0 > moments[i - 1].0).map(|i| (i - 1, steps(i - 1)));
        let all: Vec<(usize, usize, usize)> = stretches.flat_map(|(i, count)| (0..count).map(move |n| (i, n, count))).collect();
        let steps = all.into_par_iter().map(step).collect();
        let rest = moments.first().filter(|_| is_steady).map(|(_, matrix)| decomposed(matrix));
        Self { basis, start: moments.first().map_or(0.0, |m| m.0), rest, steps }
    }

    /// Change of every sensor (K) by disturbances of the residual, given at each moment as a projected column per disturbance: for each
    /// disturbance the sensors at the first of `times`, which rise, then at the next.
    pub fn readings(&self, disturbances: &[DMatrix<f64>], times: &[f64]) -> Vec<Vec<f64>> {
        let Some(first) = disturbances.first() else { return Vec::new() };
        let state = match &self.rest {
            Some(matrix) => solved(matrix, -first),
            None => DMatrix::zeros(self.basis.size, first.ncols()),
        };
        self.from(state, Some(disturbances), times)
    }

    /// Change of every sensor (K) by other temperatures at the start, given as heat content of the nodes (J), projected, a column for each;
    /// in the order of [`LinearisedHistory::readings`].
    pub fn relaxing(&self, contents: &DMatrix<f64>, times: &[f64]) -> Vec<Vec<f64>> {
        self.from(solved(&decomposed(&self.basis.capacity), contents.clone()), None, times)
    }

    /// Change of every sensor (K) from a state at the start, projected, and by disturbances.
    fn from(&self, mut state: DMatrix<f64>, disturbances: Option<&[DMatrix<f64>]>, times: &[f64]) -> Vec<Vec<f64>> {
        let mut found = vec![Vec::with_capacity(times.len() * self.basis.readings.nrows()); state.ncols()];
        let mut take = |values: &DMatrix<f64>| found.iter_mut().zip(values.column_iter()).for_each(|(f, v)| f.extend(v.iter()));
        let mut next = times.iter().peekable();
        let mut shown = &self.basis.readings * &state;
        while next.next_if(|t| **t <= self.start).is_some() {
            take(&shown);
        }
        let mut begun = self.start;
        let (mut right, mut between, mut now) = (state.clone(), state.clone(), shown.clone());
        for step in &self.steps {
            let less = |right: &mut DMatrix<f64>, share: f64| {
                if let Some(all) = disturbances {
                    let (here, there) = (GAMMA * step.length * (1.0 - share), GAMMA * step.length * share);
                    right.zip_zip_apply(&all[step.moment], &all[step.moment + 1], |r, a, b| *r -= here * a + there * b);
                }
            };
            right.gemm(1.0, &self.basis.capacity, &state, 0.0);
            less(&mut right, step.stages[0]);
            between.gemm(1.0, &step.inverses[0], &right, 0.0);
            state.zip_apply(&between, |s, b| *s += (b - *s) * (1.0 - GAMMA) / GAMMA);
            right.gemm(1.0, &self.basis.capacity, &state, 0.0);
            less(&mut right, step.stages[1]);
            state.gemm(1.0, &step.inverses[1], &right, 0.0);
            now.gemm(1.0, &self.basis.readings, &state, 0.0);
            while let Some(time) = next.next_if(|t| **t <= step.end) {
                let share = (time - begun) / step.length;
                take(&(&shown * (1.0 - share) + &now * share));
            }
            begun = step.end;
            std::mem::swap(&mut shown, &mut now);
        }
        // The last row's time but for rounding.
        next.for_each(|_| take(&shown));
        found
    }
}

impl LinearisedHistory<'_> {
    /// Change of every sensor (K) per unit of every component of the projected disturbance at each of `moments`: a row for each sensor
    /// at the first of `times` (which rise), then at the next. Each reading is followed back in time, once for all disturbances, which
    /// pays for many disturbances of few readings.
    pub fn answers(&self, moments: usize, times: &[f64]) -> Vec<DMatrix<f64>> {
        let (size, sensors) = (self.basis.size, self.basis.readings.nrows());
        let count = times.len() * sensors;
        let mut answers = vec![DMatrix::zeros(count, size); moments];
        let kappa = (1.0 - GAMMA) / GAMMA;
        // Derivatives of each later reading with respect to the state that the way back has come to.
        let mut along = DMatrix::zeros(count, size);
        let mut first = times.len();
        let seed = |along: &mut DMatrix<f64>, time: usize, weight: f64| {
            let mut rows = along.rows_mut(time * sensors, sensors);
            rows += &self.basis.readings * weight;
        };
        let end = self.steps.last().map_or(self.start, |step| step.end);
        while first > 0 && times[first - 1] > end {
            first -= 1;
            seed(&mut along, first, 1.0);
        }
        for (n, step) in self.steps.iter().enumerate().rev() {
            let [early, late] = &step.inverses;
            let begun = if n > 0 { self.steps[n - 1].end } else { self.start };
            let mut before = Vec::new();
            while first > 0 && times[first - 1] > begun {
                first -= 1;
                let share = (times[first] - begun) / step.length;
                seed(&mut along, first, share);
                before.push((first, 1.0 - share));
            }
            let active = (first * sensors, count - first * sensors);
            if active.1 == 0 {
                continue;
            }
            let at_end = along.rows(active.0, active.1) * late;
            let stored = &at_end * &self.basis.capacity;
            let at_stage = &stored * early * kappa;
            let now = &stored * (1.0 - kappa) + &at_stage * &self.basis.capacity;
            along.rows_mut(active.0, active.1).copy_from(&now);
            for (own, share) in [(at_stage, step.stages[0]), (at_end, step.stages[1])] {
                let weight = -GAMMA * step.length;
                for (moment, share) in [(step.moment, 1.0 - share), (step.moment + 1, share)] {
                    let mut rows = answers[moment].rows_mut(active.0, active.1);
                    rows += &own * (weight * share);
                }
            }
            before.into_iter().for_each(|(time, weight)| seed(&mut along, time, weight));
        }
        (0..first).for_each(|time| seed(&mut along, time, 1.0));
        if let (Some(rest), Some(answer)) = (&self.rest, answers.first_mut()) {
            *answer -= along * inverse(rest);
        }
        answers
    }
}

/// The decomposition of a square matrix.
fn decomposed(matrix: &DMatrix<f64>) -> PartialPivLu<f64> {
    MatRef::from_column_major_slice(matrix.as_slice(), matrix.nrows(), matrix.ncols()).partial_piv_lu()
}

fn inverse(matrix: &PartialPivLu<f64>) -> DMatrix<f64> {
    let size = matrix.L().ncols();
    solved(matrix, DMatrix::identity(size, size))
}

/// The solution for each column of `right`.
fn solved(matrix: &PartialPivLu<f64>, mut right: DMatrix<f64>) -> DMatrix<f64> {
    let (rows, columns) = right.shape();
    matrix.solve_in_place(MatMut::from_column_major_slice_mut(right.as_mut_slice(), rows, columns));
    right
}

/// One state of derivatives for each flow that differs from the others.
fn by_flow<'a>(study: &'a Study, moments: &[&Moment]) -> Result<Vec<Derivatives<'a>>> {
    let mut chosen: Vec<Derivatives<'a>> = Vec::new();
    let mut flows: Vec<Vec<f64>> = Vec::new();
    for moment in moments {
        let is_like =
            |other: &Vec<f64>| other.iter().zip(&moment.load.flows).all(|(a, b)| (a - b).abs() <= OTHER_FLOW * a.abs().max(b.abs()));
        if flows.len() < MOST_SPACES && !flows.iter().any(is_like) {
            chosen.push(Derivatives::at(study, &moment.condition, &moment.temperatures)?);
            flows.push(moment.load.flows.clone());
        }
    }
    Ok(chosen)
}

/// Heat capacity of every node, J/K: solids at their temperature; the water of a station at the node at its end.
fn capacities(at: &Derivatives<'_>) -> Vec<f64> {
    let network = &at.study.model.network;
    let temperatures = &at.state.solution.temperatures;
    let mut capacity: Vec<f64> =
        (0..network.nodes).map(|n| if n < network.solids { network.capacity_at(n, temperatures[n]) } else { 0.0 }).collect();
    for (stream, state) in network.streams.iter().zip(at.tangent.streams()) {
        let area = 0.25 * std::f64::consts::PI * stream.diameter * stream.diameter;
        for (k, station) in stream.stations.iter().enumerate() {
            capacity[stream.first_node as usize + k] = state.volumetric_capacity * area * station.length;
        }
    }
    network.fixed.iter().for_each(|(node, _)| capacity[*node as usize] = 0.0);
    capacity
}

/// Directions that span the fields, orthonormal in `measure`: their number, and their components node by node.
fn orthonormal(fields: &[Vec<f64>], measure: &[f64]) -> (usize, Vec<f64>) {
    let dot = |a: &[f64], b: &[f64]| -> f64 { a.iter().zip(b).zip(measure).map(|((a, b), m)| a * b * m).sum() };
    let sizes: Vec<f64> = fields.iter().map(|f| dot(f, f).sqrt().max(1e-300)).collect();
    let k = fields.len();
    let rows: Vec<Vec<f64>> =
        (0..k).into_par_iter().map(|i| (0..=i).map(|j| dot(&fields[i], &fields[j]) / (sizes[i] * sizes[j])).collect()).collect();
    let gram = DMatrix::from_fn(k, k, |i, j| if j <= i { rows[i][j] } else { rows[j][i] });
    let eigen = SymmetricEigen::new(gram);
    let kept: Vec<usize> = (0..k).filter(|i| eigen.eigenvalues[*i] > LEAST_ENERGY).collect();
    let size = kept.len();
    let mut by_node = vec![0.0; measure.len() * size];
    for (i, (field, own)) in fields.iter().zip(&sizes).enumerate() {
        let weights: Vec<f64> = kept.iter().map(|e| eigen.eigenvectors[(i, *e)] / (eigen.eigenvalues[*e].sqrt() * own)).collect();
        by_node.par_chunks_mut(size.max(1)).zip(field).for_each(|(row, v)| row.iter_mut().zip(&weights).for_each(|(r, w)| *r += v * w));
    }
    (size, by_node)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Following readings back agrees with following disturbances forwards: rows before, between and behind the moments, two at one
    /// time.
    #[test]
    fn both_ways() {
        let entry = |k: usize| ((k * 7919 + 31) % 97) as f64 / 97.0;
        let matrix = |seed: usize, own: f64| DMatrix::from_fn(3, 3, |i, j| 0.3 * entry(seed + 3 * i + j) + if i == j { own } else { 0.0 });
        let basis = ObservableSpace { size: 3, by_node: Vec::new(), capacity: matrix(5, 4.0), readings: matrix(50, 0.0).remove_row(2) };
        let moments: Vec<(f64, DMatrix<f64>)> =
            [10.0, 12.0, 12.0, 19.0, 30.0].iter().enumerate().map(|(i, t)| (*t, matrix(100 * i, 1.0))).collect();
        let times = [9.0, 10.0, 11.3, 12.0, 12.0, 18.0, 29.9, 30.0, 31.0];
        let forces: Vec<DMatrix<f64>> = (0..5).map(|i| matrix(1000 + 17 * i, 0.0)).collect();
        for is_steady in [true, false] {
            let course = LinearisedHistory::new(&basis, &moments, |_| STEPS, is_steady);
            let forwards = course.readings(&forces, &times);
            let back = course.answers(forces.len(), &times);
            for (d, column) in forwards.iter().enumerate() {
                for (i, value) in column.iter().enumerate() {
                    let sum: f64 = forces.iter().zip(&back).map(|(f, b)| (b.row(i) * f.column(d))[(0, 0)]).sum();
                    assert!((sum - value).abs() < 1e-10, "{is_steady} {d} {i}: {sum} {value}");
                }
            }
        }
    }
}
