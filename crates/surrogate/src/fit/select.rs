//! From samples to a surrogate: candidates, cross-validation of each whole procedure, choice, band.

use std::collections::BTreeMap;

use rayon::prelude::*;

use super::corners;
use super::evaluate::evaluate;
use super::group::{Dictionary, OutputGroup};
use super::least_squares::max_abs;
use super::model::{PointModel, PointSpec, RbfBasis, SurrogateSpec};
use super::polynomial::FittedPolynomial;
use super::radial::{Radial, RadialResult};
use super::validation::{conditions, half_width_of_few, half_width_of_readings};
use super::{CandidateModel, FitOptions, FitSamples, ModelFamily, PointReport, ResidualSizes, SurrogateFit};
use coldplate_base::error::{Error, Result};
use coldplate_base::numbers::root_mean_square;
use coldplate_base::progress::Progress;

/// Ratio of held-out errors below which radial functions beat a polynomial. Chosen: they cost a query more than a
/// polynomial.
const RADIAL_MUST_BEAT: f64 = 0.95;
/// Ratio of held-out errors below which a larger dictionary of polynomials beats a smaller one. Chosen: smaller gains
/// may be chance.
const CLEARLY: f64 = 0.95;
/// Factor by which the polynomial's held-out error must be smaller, if another output needs the shared basis anyway. Chosen: between
/// rows, and above all in corners without one, a polynomial errs further.
const POLYNOMIAL_MUST_BEAT: f64 = 1.5;

/// Fits every output of `samples`, saying how it comes along.
///
/// The result depends only on the samples and options, not on the number of threads.
///
/// # Errors
/// Bad input: rows and values that do not match, a missing condition, too few rows for an output (three more than varying
/// variables are needed), nothing to choose from in `options`. Numerics: no candidate could be fitted to an output.
pub fn fit_heard(samples: &FitSamples, options: &FitOptions, progress: &dyn Progress) -> Result<SurrogateFit> {
    let samples = samples.checked()?;
    if options.folds < 2 || !(options.coverage > 0.0 && options.coverage < 1.0) || options.max_degree > 12 {
        return Err(Error::input("options of the fit: at least 2 folds, coverage between 0 and 1, degree at most 12"));
    }
    if !options.polynomials && options.kernels.is_empty() {
        return Err(Error::input("options of the fit leave neither polynomials nor radial functions to choose from"));
    }
    let mut notes = Vec::new();
    let active: Vec<bool> = samples.variables.iter().map(|v| v.high > v.low).collect();
    for (variable, _) in samples.variables.iter().zip(&active).filter(|(_, active)| !**active) {
        notes.push(format!("{} does not vary (always {} {}): the fit leaves it out", variable.name, variable.low, variable.unit));
    }
    let empty_corners = corners::empty(&samples.variables, &samples.rows);
    if !empty_corners.is_empty() {
        notes.push(corners::sentence(&samples.variables, &empty_corners));
    }
    // Outputs present on the same rows share their length scales and are treated together.
    let mut groups: BTreeMap<Vec<usize>, Vec<usize>> = BTreeMap::new();
    for (o, output) in samples.outputs.iter().enumerate() {
        let rows: Vec<usize> = (0..samples.rows.len()).filter(|i| !output.values[*i].is_nan()).collect();
        let need = active.iter().filter(|a| **a).count() + 3;
        let known = conditions(&rows.iter().map(|i| samples.rows[*i].as_slice()).collect::<Vec<_>>()).len();
        if known < need {
            let at = if known < rows.len() { format!(", at {known} different conditions") } else { String::new() };
            return Err(Error::input(format!("too few rows to fit: {} of {} have a value{at}", rows.len(), samples.rows.len()))
                .at_key(output.name.clone())
                .help(format!("at least {need} conditions are needed, ten times the number of variables is a good start")));
        }
        if rows.len() < samples.rows.len() {
            let missing = samples.rows.len() - rows.len();
            notes.push(format!("{}: {missing} of {} rows have no value and are left out", output.name, samples.rows.len()));
        }
        if known < rows.len() {
            let what = "readings at one condition are fitted by their mean, and their scatter counts in the band";
            notes.push(format!("{}: {} rows at {known} conditions; {what}", output.name, rows.len()));
        }
        groups.entry(rows).or_default().push(o);
    }
    let mut surrogate = SurrogateSpec { variables: samples.variables.clone(), empty_corners, ..SurrogateSpec::default() };
    let mut found: Vec<Option<(PointModel, PointReport)>> = vec![None; samples.outputs.len()];
    let many = groups.len();
    for (rows, outputs) in groups {
        let group = OutputGroup::new(&samples, options, &active, rows, outputs);
        progress.at(&format!("fit of {} outputs on {} rows: polynomials", group.outputs.len(), group.rows.len()));
        let bases = if many == 1 { options.max_bases } else { options.max_bases.min(1) };
        for (o, model, report) in group.fit(bases, &mut surrogate.bases, progress)? {
            found[o] = Some((model, report));
        }
    }
    let mut points = Vec::new();
    for (model, report) in found.into_iter().flatten() {
        let half_width = report.half_width;
        surrogate.points.push(PointSpec { name: report.name.clone(), unit: report.unit.clone(), model, half_width });
        points.push(report);
    }
    let is_bad = |(o, i): &(usize, usize)| !evaluate(&surrogate, *o, &samples.rows[*i]).is_ok_and(f64::is_finite);
    let asked = (0..points.len()).into_par_iter().flat_map_iter(|o| (0..samples.rows.len()).map(move |i| (o, i)));
    if let Some((o, i)) = asked.find_first(is_bad) {
        return Err(Error::numerics(format!("the fit of {} has no finite value at row {}", points[o].name, i + 1)));
    }
    Ok(SurrogateFit { surrogate, points, notes })
}

/// A candidate that may be chosen.
struct Choice<'r> {
    /// Index among the candidates.
    candidate: usize,
    /// Held-out residuals of the means, condition by condition.
    held_out: &'r [f64],
    /// Share of the least error of the choices before it that its error must be below.
    share: f64,
}

impl OutputGroup<'_> {
    fn fit(&self, most_bases: usize, bases: &mut Vec<RbfBasis>, progress: &dyn Progress) -> Result<Vec<(usize, PointModel, PointReport)>> {
        let scores = self.transform_scores(&self.rows, &self.y);
        let dictionaries = if self.options.polynomials { self.polynomials(&scores) } else { Vec::new() };
        // A larger dictionary must win clearly.
        let best_of = |k: usize| {
            let numbered = dictionaries.iter().enumerate();
            let choices: Vec<Choice<'_>> =
                numbered.map(|(candidate, one)| Choice { candidate, held_out: &one.held_out[k], share: CLEARLY }).collect();
            choose(&choices, |_| true).map(|d| root_mean_square(&dictionaries[d].held_out[k]))
        };
        let rival: Vec<f64> = (0..self.y.len()).map(|k| best_of(k).unwrap_or(f64::INFINITY)).collect();
        let usable = !self.options.kernels.is_empty() && most_bases > 0 && self.search.active.contains(&true);
        if usable {
            progress.at(&format!("fit of {} outputs on {} rows: radial functions", self.outputs.len(), self.rows.len()));
        }
        let radial = if usable { self.radial(&scores, &rival, most_bases) } else { None };
        let wins = |(radial, polynomial): (&Vec<f64>, &f64)| root_mean_square(radial) < RADIAL_MUST_BEAT * polynomial;
        let is_needed = radial.as_ref().is_some_and(|radial| radial.held_out.iter().zip(&rival).any(wins));
        let shared_share = if is_needed { POLYNOMIAL_MUST_BEAT } else { RADIAL_MUST_BEAT };
        let shared_basis = bases.len();
        let mut further_used: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
        let mut shared_used = false;
        let remoteness = self.remoteness();
        let coverage = self.options.coverage;
        // Remoteness tells how far interpolation errs. Readings that scatter do so next to a known condition as well.
        let width = |k: usize, held_out: &[f64]| match &remoteness {
            Some(remoteness) if max_abs(&self.readings.scatter[k]) <= least_half_width(&self.y[k]) => {
                half_width_of_few(held_out, &self.readings.share, &self.readings.condition, remoteness, coverage)
            }
            _ => half_width_of_readings(held_out, &self.readings.share, coverage),
        };
        let mut result = Vec::new();
        for (k, o) in self.outputs.iter().enumerate() {
            let (candidates, choices) = self.candidates(k, &dictionaries, radial.as_ref(), shared_share);
            let chosen = choose(&choices, |_| true).map(|index| (index, self.held_out_of_choice(&choices)));
            let output = &self.samples.outputs[*o];
            let none = || Error::numerics("no model could be fitted").at_key(output.name.clone());
            let (index, of_means) = chosen.ok_or_else(none)?;
            let rows = self.readings.condition.iter().zip(&self.readings.scatter[k]);
            let held_out: Vec<f64> = rows.map(|(condition, scatter)| of_means[*condition] + scatter).collect();
            let model = match (&candidates[index].family, dictionaries.get(index), &radial) {
                (ModelFamily::Polynomial { .. }, Some(one), _) => PointModel::Polynomial(one.fitted[k].expanded()),
                (ModelFamily::Rbf { own: false, .. }, _, Some(radial)) => {
                    shared_used = true;
                    self.model(&radial.considered[0], &radial.solved, k, shared_basis)
                }
                (ModelFamily::Rbf { own: true, .. }, _, Some(radial)) => {
                    let (at, further, m) = radial.further_of(k).ok_or_else(none)?;
                    further_used.entry(at).or_default().push(k);
                    self.model(&further.radial, &further.solved, m, usize::MAX)
                }
                _ => return Err(none()),
            };
            let report = PointReport {
                name: output.name.clone(),
                unit: output.unit.clone(),
                rows: held_out.len(),
                chosen: candidates[index].clone(),
                half_width: width(k, &held_out).max(least_half_width(&self.y[k])),
                held_out,
                candidates,
            };
            result.push((*o, model, report));
        }
        if let Some(radial) = &radial {
            if shared_used {
                bases.push(self.basis(&radial.considered[0], &radial.solved));
            }
            for (at, outputs) in further_used {
                for k in outputs {
                    if let PointModel::Rbf { basis, .. } = &mut result[k].1 {
                        *basis = bases.len();
                    }
                }
                let further = &radial.further[at];
                bases.push(self.basis(&further.radial, &further.solved));
            }
        }
        Ok(result)
    }

    /// Candidates for an output, and those of them that may be chosen. `shared_share` is the share of the error of the polynomials
    /// that the shared basis must reach.
    fn candidates<'r>(
        &self,
        k: usize,
        dictionaries: &'r [Dictionary],
        radial: Option<&'r RadialResult>,
        shared_share: f64,
    ) -> (Vec<CandidateModel>, Vec<Choice<'r>>) {
        let mut candidates = Vec::new();
        let mut choices = Vec::new();
        for one in dictionaries {
            choices.push(Choice { candidate: candidates.len(), held_out: &one.held_out[k], share: CLEARLY });
            candidates.push(polynomial_candidate(&one.fitted[k], &one.held_out[k]));
        }
        let Some(radial) = radial else { return (candidates, choices) };
        for (index, one) in radial.considered.iter().enumerate() {
            let held_out = (index == 0).then_some(radial.held_out[k].as_slice());
            choices.extend(held_out.map(|held_out| Choice { candidate: candidates.len(), held_out, share: shared_share }));
            candidates.push(self.radial_candidate(one, false, &radial.left_out[index][k], held_out));
        }
        if let Some((_, further, m)) = radial.further_of(k) {
            let held_out = further.held_out[m].as_slice();
            choices.push(Choice { candidate: candidates.len(), held_out, share: RADIAL_MUST_BEAT });
            candidates.push(self.radial_candidate(&further.radial, true, &further.solved.left_out[m], Some(held_out)));
        }
        (candidates, choices)
    }

    /// Held-out residuals with the choice included: residuals of a fold come from the model that the other folds
    /// would choose.
    fn held_out_of_choice(&self, choices: &[Choice<'_>]) -> Vec<f64> {
        let by_fold: Vec<Option<usize>> = (0..self.fold_count).map(|fold| choose(choices, |row| self.folds[row] != fold)).collect();
        let residual = |row: usize| {
            let index = by_fold.get(self.folds[row]).copied().flatten()?;
            choices.iter().find(|choice| choice.candidate == index)?.held_out.get(row).copied()
        };
        (0..self.rows.len()).map(|row| residual(row).unwrap_or(f64::INFINITY)).collect()
    }

    fn radial_candidate(&self, one: &Radial, own: bool, left_out: &[f64], held_out: Option<&[f64]>) -> CandidateModel {
        let family = ModelFamily::Rbf {
            kernel: one.shape.kernel,
            tail: one.shape.tail,
            scales: self.all_scales(one),
            smoothing: one.tuned.smoothing(),
            own,
        };
        CandidateModel {
            family,
            transforms: one.shape.transforms.clone(),
            leave_one_out: residuals(left_out),
            k_fold: held_out.map(residuals),
        }
    }
}

/// Least half width of a band: rounding alone gives errors of a few units in the last place.
pub(super) fn least_half_width(values: &[f64]) -> f64 {
    64.0 * f64::EPSILON * max_abs(values)
}

/// Index of the candidate to take, judged by its held-out residuals on the rows that `counts` admits.
fn choose(choices: &[Choice<'_>], counts: impl Fn(usize) -> bool) -> Option<usize> {
    let error = |residuals: &[f64]| {
        root_mean_square(&residuals.iter().enumerate().filter(|(i, _)| counts(*i)).map(|(_, e)| *e).collect::<Vec<_>>())
    };
    let mut best: Option<(usize, f64)> = None;
    for Choice { candidate, held_out, share } in choices {
        let error = error(held_out);
        if best.is_none_or(|(_, least)| error < share * least) {
            best = Some((*candidate, error));
        }
    }
    best.map(|(index, _)| index)
}

fn polynomial_candidate(fitted: &FittedPolynomial, held_out: &[f64]) -> CandidateModel {
    CandidateModel {
        family: ModelFamily::Polynomial { degree: fitted.degree(), terms: fitted.expanded().terms.len() },
        transforms: fitted.transforms.clone(),
        leave_one_out: residuals(&fitted.left_out),
        k_fold: Some(residuals(held_out)),
    }
}

fn residuals(values: &[f64]) -> ResidualSizes {
    ResidualSizes { rms: root_mean_square(values), max: max_abs(values) }
}
