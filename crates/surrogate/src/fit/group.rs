//! Outputs that are present on the same rows, and their treatment in every fold.
//!
//! Rows at one condition are one condition with several readings. Fitted are the means; conditions, not rows, are held out and counted.
//! The scatter of the readings about their mean counts in the band alone.

use rayon::prelude::*;

use super::evaluate::scaled;
use super::model::Transform;
use super::polynomial::{FittedPolynomial, PolynomialSearch};
use super::validation::{Remoteness, conditions, folds, remoteness, share};
use super::{FitOptions, FitSamples};
use coldplate_base::random::Random;

/// Number of rows below which residuals are scaled by remoteness. Chosen: with few rows, a held-out row lies much farther
/// from the others than a condition that will be asked about.
const FEW_ROWS: usize = 60;
/// Number of conditions, spread over the range, that stand for those that will be asked about. Chosen: their quantile
/// decides the band, each costs a row of products.
const ASKED: usize = 500;

/// Most rows on which transforms and terms of a polynomial are chosen, a count. Chosen: time is rows × terms × terms, and the
/// largest dictionaries have less than half as many terms.
const CHOICE_ROWS: usize = 1500;

/// Outputs that are present on the same rows.
pub(super) struct OutputGroup<'a> {
    pub(super) samples: &'a FitSamples,
    pub(super) options: &'a FitOptions,
    pub(super) search: PolynomialSearch<'a>,
    /// Conditions, no two alike.
    pub(super) rows: Vec<&'a [f64]>,
    pub(super) outputs: Vec<usize>,
    /// Means of the outputs' readings at each condition.
    pub(super) y: Vec<Vec<f64>>,
    pub(super) readings: Readings,
    pub(super) folds: Vec<usize>,
    pub(super) fold_count: usize,
}

/// The rows of a table behind its conditions.
pub(super) struct Readings {
    /// Condition of each row.
    pub(super) condition: Vec<usize>,
    /// Share of its condition that each row has.
    pub(super) share: Vec<f64>,
    /// Differences of the rows' readings from the means at their conditions, by output.
    pub(super) scatter: ResidualRows,
}

/// Residuals by row, one list per output treated.
pub(super) type ResidualRows = Vec<Vec<f64>>;

/// Combinations of transforms, each with an error per output.
pub(super) type Scores = [(Vec<Transform>, Vec<f64>)];

/// Polynomials whose terms are from one dictionary.
pub(super) struct Dictionary {
    /// One per output.
    pub(super) fitted: Vec<FittedPolynomial>,
    /// Held-out residuals, by output.
    pub(super) held_out: ResidualRows,
}

impl<'a> OutputGroup<'a> {
    pub(super) fn new(samples: &'a FitSamples, options: &'a FitOptions, active: &'a [bool], rows: Vec<usize>, outputs: Vec<usize>) -> Self {
        let all: Vec<&[f64]> = rows.iter().map(|i| samples.rows[*i].as_slice()).collect();
        let members = conditions(&all);
        let (mut condition, mut share) = (vec![0; all.len()], vec![0.0; all.len()]);
        for (c, members) in members.iter().enumerate() {
            members.iter().for_each(|row| (condition[*row], share[*row]) = (c, 1.0 / members.len() as f64));
        }
        let (mut y, mut scatter) = (Vec::new(), Vec::new());
        for output in &outputs {
            let value = |row: usize| samples.outputs[*output].values[rows[row]];
            let mean = |members: &Vec<usize>| match members.as_slice() {
                [one] => value(*one),
                some => some.iter().map(|row| value(*row)).sum::<f64>() / some.len() as f64,
            };
            let means: Vec<f64> = members.iter().map(mean).collect();
            scatter.push((0..all.len()).map(|row| value(row) - means[condition[row]]).collect());
            y.push(means);
        }
        let rows: Vec<&[f64]> = members.iter().map(|members| all[members[0]]).collect();
        let readings = Readings { condition, share, scatter };
        let search = PolynomialSearch { variables: &samples.variables, active, max_degree: options.max_degree };
        let fold_count = options.folds.min(rows.len());
        let folds = folds(&rows, fold_count, options.seed);
        Self { samples, options, search, rows, outputs, y, readings, folds, fold_count }
    }

    /// Polynomials of every dictionary that is worth trying, the smallest first. Held out is the whole procedure, transforms and
    /// terms chosen in each fold.
    pub(super) fn polynomials(&self, scores: &Scores) -> Vec<Dictionary> {
        let degrees = self.search.degrees(self.rows.len().min(CHOICE_ROWS));
        let count = self.y.len();
        // Every output once for each dictionary, so that a fold serves them all.
        let repeated: Vec<Vec<f64>> = degrees.iter().flat_map(|_| self.y.iter().cloned()).collect();
        let held_out = self.by_fold(&repeated, |train, test, y| {
            let y = &y[..count];
            let fitted = self.of_degrees(&degrees, train, y, &self.transform_scores(train, y));
            fitted.iter().flatten().map(|f| test.iter().map(|x| f.value(&self.samples.variables, x)).collect()).collect()
        });
        let fitted = self.of_degrees(&degrees, &self.rows, &self.y, scores);
        fitted
            .into_iter()
            .zip(held_out.chunks(count))
            .map(|(fitted, held_out)| Dictionary { fitted, held_out: held_out.to_vec() })
            .collect()
    }

    /// Scores of the combinations of transforms, on no more rows than the choice needs.
    pub(super) fn transform_scores(&self, rows: &[&[f64]], y: &[Vec<f64>]) -> Vec<(Vec<Transform>, Vec<f64>)> {
        let (rows, y) = self.for_choice(rows, y);
        self.search.transform_scores(&rows, &y)
    }

    /// The rows on which transforms and terms are chosen, and the outputs on them.
    fn for_choice<'r>(&self, rows: &[&'r [f64]], y: &[Vec<f64>]) -> (Vec<&'r [f64]>, ResidualRows) {
        let chosen = share(rows, CHOICE_ROWS, self.options.seed);
        (chosen.iter().map(|i| rows[*i]).collect(), y.iter().map(|y| chosen.iter().map(|i| y[*i]).collect()).collect())
    }

    /// Transforms and terms are chosen on some rows if there are many; coefficients are of all. `fitted[degree][output]`.
    fn of_degrees(&self, degrees: &[usize], rows: &[&[f64]], y: &[Vec<f64>], scores: &Scores) -> Vec<Vec<FittedPolynomial>> {
        let (few, y_on_few) = self.for_choice(rows, y);
        let chosen = self.search.fit(&few, &y_on_few, scores, degrees);
        if few.len() == rows.len() {
            return chosen;
        }
        let with_all =
            |fitted: Vec<FittedPolynomial>| fitted.into_par_iter().zip(y).map(|(one, y)| self.search.with_all(rows, y, one)).collect();
        chosen.into_iter().map(with_all).collect()
    }

    /// Remoteness of the held-out conditions, and of conditions all over the range; `None` if there are so many rows
    /// that it does not matter.
    pub(super) fn remoteness(&self) -> Option<Remoteness> {
        if self.rows.len() >= FEW_ROWS {
            return None;
        }
        let active: Vec<usize> = (0..self.search.active.len()).filter(|k| self.search.active[*k]).collect();
        let place =
            |x: &&[f64]| -> Vec<f64> { active.iter().map(|k| scaled(&self.samples.variables[*k], Transform::Identity, x[*k])).collect() };
        let rows: Vec<Vec<f64>> = self.rows.iter().map(place).collect();
        let mut held_out = vec![0.0; rows.len()];
        for fold in 0..self.fold_count {
            let (test, train): (Vec<usize>, Vec<usize>) = (0..rows.len()).partition(|i| self.folds[*i] == fold);
            let take = |index: &[usize]| index.iter().map(|i| rows[*i].clone()).collect::<Vec<_>>();
            let found = remoteness(&take(&train), &take(&test))?;
            test.iter().zip(found).for_each(|(i, d)| held_out[*i] = d);
        }
        let mut random = Random::new(self.options.seed);
        let asked: Vec<Vec<f64>> = (0..ASKED).map(|_| active.iter().map(|_| 2.0 * random.unit() - 1.0).collect()).collect();
        Some(Remoteness { held_out, asked: remoteness(&rows, &asked)? })
    }

    /// Residuals of predictions of each fold made from the other folds: `predict(train, test, outputs on train)`.
    pub(super) fn by_fold(
        &self,
        y: &[Vec<f64>],
        predict: impl Fn(&[&[f64]], &[&[f64]], &[Vec<f64>]) -> ResidualRows + Sync,
    ) -> ResidualRows {
        let parts: Vec<(Vec<usize>, ResidualRows)> = (0..self.fold_count)
            .into_par_iter()
            .map(|fold| {
                let (test, train): (Vec<usize>, Vec<usize>) = (0..self.rows.len()).partition(|i| self.folds[*i] == fold);
                let take = |index: &[usize]| index.iter().map(|i| self.rows[*i]).collect::<Vec<_>>();
                let known: Vec<Vec<f64>> = y.iter().map(|y| train.iter().map(|i| y[*i]).collect()).collect();
                let predicted = predict(&take(&train), &take(&test), &known);
                (test, predicted)
            })
            .collect();
        let mut residuals: ResidualRows = y.iter().map(|y| vec![f64::INFINITY; y.len()]).collect();
        for (test, predicted) in &parts {
            for ((residuals, y), predicted) in residuals.iter_mut().zip(y).zip(predicted) {
                test.iter().zip(predicted).for_each(|(i, p)| residuals[*i] = y[*i] - p);
            }
        }
        residuals
    }
}
