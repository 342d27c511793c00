//! Causes in force beside the readings: their amplitudes through the solver, the numbers of the file that the readings draw with them, and how
//! well rows are predicted that took no part.

use std::ops::Range;
use std::sync::Arc;

use nalgebra::{Cholesky, DMatrix, DVector};

use super::amplitude::{Beside, Errors, Looseness, Rows};
use super::effects::{Common, CommonFactor, Effect, Hypothesis, Number};
use super::gain::{Folds, Gain};
use super::stated::Stated;
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
    /// Readings that are set aside.
    aside: &'b [usize],
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

/// A number of the file that may be a little off.
struct OpenNumber {
    /// Which, with its standard deviation as its scale.
    hypothesis: Hypothesis,
    /// Places among the columns that rows share: one, or one for each test where each may be off by another amount.
    places: Vec<usize>,
    /// Change of the readings with one standard deviation in all of them, K.
    column: Vec<f64>,
}

/// What some of the rows say.
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
        let mut found =
            Self { beside, rows, aside: &errors.aside, looseness, values: Vec::new(), slopes: Vec::new(), numbers, deviations, causes };
        found.linearise()?;
        for _ in 0..MOST_STEPS {
            let Some(said) = found.said(|_| true) else { return Ok(None) };
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

    /// What the readings of some rows say of the amplitudes and of all that rows share.
    fn said(&self, is_kept: impl Fn(usize) -> bool) -> Option<Said> {
        self.said_about(&self.values, is_kept)
    }

    /// Amplitudes and shared errors that the readings of some rows ask for where the machine predicts these values (K); its slopes still hold
    /// there.
    fn said_about(&self, values: &[f64], is_kept: impl Fn(usize) -> bool) -> Option<Said> {
        let kept: Vec<usize> =
            self.rows.ranges.iter().enumerate().filter(|(row, _)| is_kept(*row)).flat_map(|(_, range)| range.clone()).collect();
        let mut left = self.beside.base.left(values);
        for (cause, slope) in self.causes.iter().zip(&self.slopes) {
            left.iter_mut().zip(slope).for_each(|(l, s)| *l += cause.amplitude * s);
        }
        self.aside.iter().for_each(|i| left[*i] = 0.0);
        let left = self.rows.whiten(&left).select_rows(&kept);
        let (own, shared) = (self.causes.len(), self.deviations.len());
        let mut columns = DMatrix::zeros(kept.len(), own + shared);
        for (k, slope) in self.slopes.iter().enumerate() {
            columns.set_column(k, &self.rows.whiten(slope).select_rows(&kept));
        }
        for k in 0..shared {
            columns.set_column(own + k, &(self.rows.shared.column(k).select_rows(&kept) * self.deviations[k]));
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

    /// Readings that are set aside, which count for nothing.
    pub fn aside(&self) -> &'b [usize] {
        self.aside
    }

    /// What the model leaves open beside the causes.
    pub fn looseness(&self) -> Looseness {
        self.looseness
    }

    /// Misfit that the causes leave, under the covariance beside them.
    pub fn misfit(&self) -> f64 {
        let mut left = self.beside.base.left(&self.values);
        self.aside.iter().for_each(|i| left[*i] = 0.0);
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
        let Some(said) = self.said(|_| true) else { return Vec::new() };
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
        let said = self.said_about(values, |_| true)?;
        let of = |number: &OpenNumber| {
            let (found, deviation) = said.of(number, self.causes.len());
            let scale = number.hypothesis.scale;
            Cause::new(number.hypothesis.clone(), found * scale, deviation * scale)
        };
        Some(self.numbers.iter().map(of).filter(|c| c.amplitude.abs() > STILL * c.hypothesis.scale).collect())
    }

    /// The gain on rows that took no part in fitting amplitudes, with the numbers of the file as these rows draw them or as the file has them,
    /// whichever predicts better, and whether it is with them. `None` of fewer than three rows.
    pub fn gain(&self) -> Option<(Gain, bool)> {
        let folds = Folds::of(&self.beside.problem.data, &self.rows.ranges)?;
        let said: Vec<Option<Said>> = folds.kept().map(|is_kept| self.said(is_kept)).collect();
        let with = |numbers: &[OpenNumber]| -> Gain {
            let changes = said.iter().map(|said| said.as_ref().map(|said| self.changed(said, numbers))).collect::<Vec<_>>();
            folds.gain(self.beside.problem, &self.beside.base, &changes, self.aside)
        };
        let plain = with(&[]);
        if self.numbers.is_empty() {
            return Some((plain, false));
        }
        let drawn = with(&self.numbers);
        Some(if drawn.after < plain.after { (drawn, true) } else { (plain, false) })
    }

    /// Change of all predictions by the amplitudes and numbers that some rows say, K.
    fn changed(&self, said: &Said, numbers: &[OpenNumber]) -> Vec<f64> {
        let predicted = &self.beside.base.found.prediction.values;
        let mut change: Vec<f64> = self.values.iter().zip(predicted).map(|(v, p)| v - p).collect();
        let mut add = |column: &[f64], by: f64| change.iter_mut().zip(column).for_each(|(c, v)| *c += by * v);
        for (k, (cause, slope)) in self.causes.iter().zip(&self.slopes).enumerate() {
            add(slope, said.found[k] - cause.amplitude);
        }
        numbers.iter().for_each(|number| add(&number.column, said.of(number, self.causes.len()).0));
        change
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

/// Numbers of the file beside causes: those that nobody called uncertain where the model's spread is not zero, those that the user did, and what
/// all films, all heats or all emissivities share.
fn open_numbers(beside: &Beside<'_>, causes: &[Cause], (errors, rows, deviations): (&Errors, &Rows, &DVector<f64>)) -> Vec<OpenNumber> {
    let (base, problem) = (&beside.base, beside.problem);
    let column_at = |at: usize| -> &Vec<f64> { errors.stated.get(at).unwrap_or_else(|| &errors.numbers[at - errors.stated.len()]) };
    let open_at = |at: Range<usize>, deviation: f64, hypothesis: Hypothesis| -> Option<OpenNumber> {
        let place = |at: usize| rows.of.iter().position(|own| *own == at).filter(|place| deviations[*place] > 0.0);
        let places = at.clone().map(place).collect::<Option<Vec<usize>>>()?;
        let is_cause = causes.iter().any(|c| c.hypothesis.is_same(&hypothesis));
        let count = column_at(at.start).len();
        let column = (0..count).map(|i| at.clone().map(|at| deviation * column_at(at)[i]).sum()).collect();
        (!is_cause).then_some(OpenNumber { hypothesis, places, column })
    };
    let open = |at: usize, deviation: f64, hypothesis: Hypothesis| open_at(at..at + 1, deviation, hypothesis);
    let stated = errors.stated.len();
    let spread = |k: usize| rows.of.iter().position(|own| *own == stated + k).map_or(0.0, |place| deviations[place]);
    let of_file = base.numbers.iter().enumerate().filter_map(|(k, (h, unit))| {
        let deviation = spread(k);
        open(stated + k, deviation, h.clone().inexact_by(deviation * unit))
    });
    let first = errors.uncertain.start;
    let called = problem.uncertain.iter().enumerate().filter_map(|(k, u)| open(first + k, 1.0, Number::of(u)));
    let measured = Stated::of(problem, &problem.study).measured(problem, &beside.catalogue);
    // Each test has an error of its own; in tables each row, which is no number.
    let first = first + problem.uncertain.len();
    let each = (errors.uncertain.end - first).checked_div(measured.len()).unwrap_or(0);
    let heats = measured.into_iter().enumerate().filter_map(|(k, h)| open_at(first + k * each..first + (k + 1) * each, 1.0, h));
    // About another machine their columns are others, at the same places.
    let shared = base.errors.shared();
    let common = factors(beside).filter_map(|(factor, h)| {
        let at = shared.iter().position(|c| *c == base.factors[factor])?;
        open(at, 1.0, h)
    });
    let mut all: Vec<OpenNumber> = of_file.chain(called).chain(heats).collect();
    // A factor of one member alone is that member's own number.
    let common: Vec<OpenNumber> = common.filter(|new| all.iter().all(|own| !own.hypothesis.is_same(&new.hypothesis))).collect();
    all.extend(common);
    all
}

/// Common factors by their places in [`CommonFactor::ALL`], as hypotheses whose scale is their standard deviation.
fn factors<'b>(beside: &'b Beside<'_>) -> impl Iterator<Item = (usize, Hypothesis)> + 'b {
    let problem = beside.problem;
    let has_measured = Stated::of(problem, &problem.study).has_measured();
    let of = move |(place, factor): (usize, CommonFactor)| {
        let common = Effect::from(match factor {
            CommonFactor::Films => Common::Films,
            CommonFactor::Heats => Common::Heats,
            CommonFactor::Emissivities => Common::Emissivities,
        });
        let members = || beside.catalogue.iter().filter(|h| h.common_factor() == Some(factor));
        // One member alone has no name in common.
        let all = beside.catalogue.iter().find(|h| h.effect == common).or_else(|| members().next().filter(|_| members().count() == 1))?;
        let hypothesis = all.clone().inexact_by(factor.deviation(&problem.discrepancy));
        // The lines of all heats would move those too that are columns of the table.
        let is_meant = factor != CommonFactor::Heats || !has_measured;
        (is_meant && hypothesis.scale > 0.0).then_some((place, hypothesis))
    };
    CommonFactor::ALL.into_iter().enumerate().filter_map(of)
}
