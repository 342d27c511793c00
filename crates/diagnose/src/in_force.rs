//! Causes in force beside the readings: their amplitudes through the solver, and the numbers of the file that the readings draw with them.

use std::ops::Range;
use std::sync::Arc;

use nalgebra::{Cholesky, DMatrix, DVector};

use super::amplitude::{Beside, Errors, Looseness, Rows};
use super::effects::Hypothesis;
use super::open_numbers::{OpenNumber, open_numbers};
use super::{Cause, Explanation};
use coldplate_base::error::Result;
use coldplate_evidence::measurement::whiten;

/// Steps of Gauss and Newton's method at most; the amplitudes of the search are near already.
const MOST_STEPS: usize = 4;
/// Amplitudes rest when none moves by more than this share of its standard deviation.
const RESTS: f64 = 0.05;
/// Least step of a difference, in units of a kind's scale: longer than what a solve leaves open.
const LEAST_STEP: f64 = 0.02;
/// A number that the readings draw by less than this share of its standard deviation stays as the file has it.
const STILL: f64 = 0.1;

/// Causes in force, linearised there.
pub struct InForce<'b> {
    beside: &'b Beside<'b>,
    rows: Arc<Rows>,
    errors: &'b Errors,
    looseness: Looseness,
    /// The causes, with their amplitudes.
    pub causes: Vec<Cause>,
    /// Predictions, K.
    pub values: Vec<f64>,
    /// Change of each reading with each amplitude, K per unit; zeros of what has no amplitude.
    slopes: Vec<Vec<f64>>,
    numbers: Vec<OpenNumber>,
    /// Standard deviation of the coefficient of each column that rows share.
    deviations: DVector<f64>,
}

/// Amplitudes and shared errors that the readings ask for.
struct Said {
    /// Amplitudes of the causes, then coefficients of the shared columns in standard deviations.
    found: DVector<f64>,
    covariance: DMatrix<f64>,
}

impl Said {
    /// A number behind so many causes, in its standard deviations, with what is left of one: the mean of its places.
    fn of(&self, number: &OpenNumber, causes: usize) -> (f64, f64) {
        let count = number.places.len() as f64;
        let places = || number.places.iter().map(|place| causes + place);
        let variance: f64 = places().flat_map(|i| places().map(move |j| self.covariance[(i, j)])).sum();
        (places().map(|k| self.found[k]).sum::<f64>() / count, variance.max(0.0).sqrt() / count)
    }
}

impl<'b> InForce<'b> {
    /// Causes of an explanation fitted through the solver, beside a model that leaves something open. `None` where the covariance is not
    /// positive.
    ///
    /// # Errors
    /// The machine cannot be solved with the causes in force.
    pub fn fitted(beside: &'b Beside<'b>, causes: &[Cause], errors: &'b Errors, looseness: Looseness) -> Result<Option<Self>> {
        let Some(rows) = Rows::under(errors, looseness) else { return Ok(None) };
        let deviations = rows.deviations(looseness);
        let numbers = open_numbers(beside, causes, (errors, &rows, &deviations));
        let causes = causes.to_vec();
        let mut found = Self { beside, rows, errors, looseness, values: Vec::new(), slopes: Vec::new(), numbers, deviations, causes };
        found.linearise()?;
        for _ in 0..MOST_STEPS {
            let Some(said) = found.said() else { return Ok(None) };
            let before = found.causes.clone();
            let moved = found.step(&said);
            if found.linearise().is_err() {
                // Beyond where the machine can be solved, what was known stands.
                found.causes = before;
                break;
            }
            if moved < RESTS {
                break;
            }
        }
        Ok(Some(found))
    }

    /// The causes with their amplitudes.
    fn members(&self) -> Vec<(&Hypothesis, f64)> {
        self.causes.iter().map(|c| (&c.hypothesis, c.amplitude)).collect()
    }

    /// Predictions (K) in which exchanged sensors have the mesh's share of each other's place.
    fn exchanged(&self, mut values: Vec<f64>) -> Vec<f64> {
        let mesh = &self.beside.base.mesh;
        let places = whiten::places(&self.beside.problem.data);
        for from in self.causes.iter().filter_map(|c| c.hypothesis.relabelled(&places)) {
            values.iter_mut().enumerate().for_each(|(i, v)| *v += mesh[from[i]] - mesh[i]);
        }
        values
    }

    fn linearise(&mut self) -> Result<()> {
        let predictor = self.beside.predictor();
        let values = self.exchanged(predictor.predict(&self.members())?);
        let mut slopes = Vec::with_capacity(self.causes.len());
        for (k, cause) in self.causes.iter().enumerate() {
            let h = &cause.hypothesis;
            if h.is_fixed() {
                slopes.push(vec![0.0; values.len()]);
                continue;
            }
            let size = cause.deviation.max(LEAST_STEP * h.scale);
            let step = if cause.amplitude + size > h.range().1 { -size } else { size };
            let mut members = self.members();
            members[k].1 += step;
            let moved = self.exchanged(predictor.predict(&members)?);
            slopes.push(moved.iter().zip(&values).map(|(m, v)| (m - v) / step).collect());
        }
        (self.values, self.slopes) = (values, slopes);
        Ok(())
    }

    /// Amplitudes and shared errors about the machine in force.
    fn said(&self) -> Option<Said> {
        self.said_about(&self.values)
    }

    /// Amplitudes and shared errors that the readings ask for where the machine predicts these values (K); its slopes still hold there.
    fn said_about(&self, values: &[f64]) -> Option<Said> {
        let mut left = self.beside.base.left(values);
        for (cause, slope) in self.causes.iter().zip(&self.slopes) {
            left.iter_mut().zip(slope).for_each(|(l, s)| *l += cause.amplitude * s);
        }
        self.errors.aside.iter().for_each(|i| left[*i] = 0.0);
        let left = self.rows.whiten(&left);
        let (own, shared) = (self.causes.len(), self.deviations.len());
        let mut columns = DMatrix::zeros(left.len(), own + shared);
        for (k, slope) in self.slopes.iter().enumerate() {
            columns.set_column(k, &self.rows.whiten(slope));
        }
        for k in 0..shared {
            columns.set_column(own + k, &(self.rows.shared.column(k) * self.deviations[k]));
        }
        let mut metric = columns.tr_mul(&columns);
        for (k, cause) in self.causes.iter().enumerate() {
            metric[(k, k)] += cause.hypothesis.spread(cause.amplitude).powi(-2);
        }
        (own..own + shared).for_each(|k| metric[(k, k)] += 1.0);
        let factor = Cholesky::new(metric)?;
        Some(Said { found: factor.solve(&columns.tr_mul(&left)), covariance: factor.inverse() })
    }

    /// Moves the amplitudes to where all readings have them; how far that was, in standard deviations.
    fn step(&mut self, said: &Said) -> f64 {
        let mut most = 0.0f64;
        for (k, cause) in self.causes.iter_mut().enumerate().filter(|(_, cause)| !cause.hypothesis.is_fixed()) {
            let (low, high) = cause.hypothesis.range();
            let to = said.found[k].clamp(low, high);
            cause.deviation = said.covariance[(k, k)].max(0.0).sqrt();
            most = most.max((to - cause.amplitude).abs() / cause.deviation.max(f64::MIN_POSITIVE));
            cause.amplitude = to;
        }
        most
    }

    /// Whether a cause that cannot be less than nothing comes to nothing.
    pub fn has_nothing(&self) -> bool {
        self.causes.iter().any(|c| !c.hypothesis.is_signed && !c.hypothesis.is_fixed() && c.amplitude <= STILL * c.deviation)
    }

    /// Readings of each row.
    pub fn ranges(&self) -> &[Range<usize>] {
        &self.rows.ranges
    }

    /// Readings that count for nothing.
    pub fn unpredicted(&self) -> Vec<usize> {
        self.errors.unpredicted()
    }

    /// What the model leaves open beside the causes.
    pub fn looseness(&self) -> Looseness {
        self.looseness
    }

    /// Misfit that the causes leave, under the covariance beside them.
    pub fn misfit(&self) -> f64 {
        let mut left = self.beside.base.left(&self.values);
        self.errors.aside.iter().for_each(|i| left[*i] = 0.0);
        self.rows.metric(self.looseness).square(&left)
    }

    /// Predictions with numbers of the file moved beside the causes, on an endlessly fine mesh, K.
    ///
    /// # Errors
    /// The machine cannot be solved with them.
    pub fn predicted(&self, numbers: &[Cause]) -> Result<Vec<f64>> {
        let mesh = &self.beside.base.mesh;
        let with_mesh = |values: &[f64]| values.iter().zip(mesh).map(|(v, m)| v + m).collect::<Vec<f64>>();
        Ok(with_mesh(&self.predicted_here(numbers)?))
    }

    /// Predictions with numbers moved beside the causes on the machine's own mesh, K.
    fn predicted_here(&self, numbers: &[Cause]) -> Result<Vec<f64>> {
        if numbers.is_empty() {
            return Ok(self.values.clone());
        }
        let members: Vec<(&Hypothesis, f64)> = numbers.iter().map(|c| (&c.hypothesis, c.amplitude)).chain(self.members()).collect();
        Ok(self.exchanged(self.beside.predictor().predict(&members)?))
    }

    /// Predictions with each cause by itself in force, K; none where the machine cannot be solved so.
    pub fn each_alone(&self) -> Vec<Vec<f64>> {
        let (predictor, mesh) = (self.beside.predictor(), &self.beside.base.mesh);
        let with = |cause: &Cause| -> Option<Vec<f64>> {
            let values = predictor.predict(&[(&cause.hypothesis, cause.amplitude)]).ok()?;
            Some(values.iter().zip(mesh).map(|(v, m)| v + m).collect())
        };
        self.causes.iter().map(with).collect::<Option<_>>().unwrap_or_default()
    }

    /// Correlations of the causes and of numbers that were drawn beside them.
    pub fn correlations(&self, numbers: &[Cause]) -> Vec<Vec<f64>> {
        let Some(said) = self.said() else { return Vec::new() };
        let own = self.causes.len();
        let place = |c: &Cause| self.numbers.iter().find(|n| n.hypothesis.is_same(&c.hypothesis)).map(|n| own + n.places[0]);
        let all: Vec<usize> = (0..own).chain(numbers.iter().filter_map(place)).collect();
        let of = |i: usize, j: usize| {
            let both = (said.covariance[(i, i)] * said.covariance[(j, j)]).max(0.0).sqrt();
            if both > 0.0 { said.covariance[(i, j)] / both } else { 0.0 }
        };
        all.iter().map(|i| all.iter().map(|j| of(*i, *j)).collect()).collect()
    }

    /// Numbers of the file as the readings draw them beside the causes, each with its standard deviation. They bend: what the machine with them
    /// in force leaves draws them on.
    pub fn drawn(&self) -> Vec<Cause> {
        let Some(mut drawn) = self.drawn_about(&self.values) else { return Vec::new() };
        for _ in 0..MOST_STEPS {
            let Ok(mut values) = self.predicted_here(&drawn) else { break };
            for cause in &drawn {
                let Some(own) = self.numbers.iter().find(|n| n.hypothesis.is_same(&cause.hypothesis)) else { continue };
                let share = cause.amplitude / own.hypothesis.scale;
                values.iter_mut().zip(&own.column).for_each(|(v, c)| *v -= share * c);
            }
            let Some(next) = self.drawn_about(&values) else { break };
            let is_at_rest = next.len() == drawn.len()
                && next.iter().zip(&drawn).all(|(a, b)| (a.amplitude - b.amplitude).abs() < RESTS * a.deviation.max(f64::MIN_POSITIVE));
            drawn = next;
            if is_at_rest {
                break;
            }
        }
        drawn
    }

    fn drawn_about(&self, values: &[f64]) -> Option<Vec<Cause>> {
        let said = self.said_about(values)?;
        let of = |number: &OpenNumber| {
            let (found, deviation) = said.of(number, self.causes.len());
            let scale = number.hypothesis.scale;
            Cause::new(number.hypothesis.clone(), found * scale, deviation * scale)
        };
        Some(self.numbers.iter().map(of).filter(|c| c.amplitude.abs() > STILL * c.hypothesis.scale).collect())
    }
}

impl Explanation {
    /// Misfit that predictions (K) with it in force leave, under its own covariance.
    pub(super) fn misfit_of(&self, beside: &Beside<'_>, errors: &Errors, values: &[f64]) -> Option<f64> {
        let rows = Rows::under(errors, self.level)?;
        let mut left = beside.base.left(values);
        errors.aside.iter().for_each(|i| left[*i] = 0.0);
        Some(rows.metric(self.level).square(&left))
    }
}
