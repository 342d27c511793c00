//! Sweeps that go on until their fit is as accurate as asked.
//!
//! After every round a fit is made to all solved conditions. The conditions of the next round are placed where this fit is least
//! sure, predicted by it, and only then solved. The errors of these predictions are therefore errors at conditions that no fit has
//! seen, at the worst places there are. The sweep ends when the stated bands and these errors are both within the accuracy.

use std::path::Path;

use serde::Serialize;

use super::designs::{fit_options, is_one_factor};
use super::fitting::{self, unit_of_errors};
use coldplate_base::error::Result;
use coldplate_base::numbers::significant;
use coldplate_base::progress::Progress;
use coldplate_explore::sweep::sweep_file::Sweep;
use coldplate_explore::sweep::{DesignGrowth, Purpose, SweepOptions, SweepRound, Swept};
use coldplate_surrogate::fit::placement::{KnownRow, most_telling};
use coldplate_surrogate::fit::{SurrogateFit, evaluate};

/// How a sweep came to its accuracy; each field is a key under `adaptive` of `coldplate run --json` and `sweep --json`.
#[derive(Debug, Clone, Serialize)]
#[non_exhaustive]
#[allow(missing_docs)]
pub struct Adaptation {
    /// Largest half width of the band asked for.
    #[serde(rename = "accuracy_K")]
    pub accuracy: f64,
    pub max_runs: usize,
    /// Whether bands and predictions are within the accuracy.
    pub reached: bool,
    pub rounds: Vec<RoundRecord>,
}

/// A round: the fit to the conditions solved until then.
#[derive(Debug, Clone, Serialize)]
#[allow(missing_docs)]
pub struct RoundRecord {
    /// Conditions of the design until then.
    pub runs: usize,
    /// Failed conditions among them.
    pub failed: usize,
    /// Largest half width of the band of any point.
    #[serde(rename = "band_K")]
    pub band: f64,
    /// The point with this value.
    pub point: String,
    /// Unit of the band, if it is not K.
    #[serde(skip_serializing_if = "is_kelvin")]
    pub unit: String,
    /// Predictions of the fit of the round before at the conditions that this round added.
    pub predicted: Option<Predicted>,
}

/// Conditions that were predicted before they were solved.
#[derive(Debug, Clone, Serialize)]
#[allow(missing_docs)]
pub struct Predicted {
    pub conditions: usize,
    /// Largest error of any point.
    #[serde(rename = "error_K")]
    pub error: f64,
    /// The point with this value.
    pub point: String,
    /// Unit of the error, if it is not K.
    #[serde(skip_serializing_if = "is_kelvin")]
    pub unit: String,
    /// Share of all values inside the band stated before.
    pub share_in_band: f64,
}

/// Whether a unit is K, which is not written.
fn is_kelvin(unit: &String) -> bool {
    unit == "K"
}

impl Adaptation {
    /// Conditions of the design.
    pub fn runs(&self) -> usize {
        self.rounds.last().map_or(0, |r| r.runs)
    }

    /// Result of the sweep, in a sentence.
    pub fn sentence(&self) -> String {
        let Some(last) = self.rounds.last() else { return String::new() };
        let (asked, band) = (self.accuracy, significant(last.band, 2));
        let error = last.predicted.as_ref().map(|p| significant(p.error, 2) + " " + &p.unit);
        let error = error.map_or_else(String::new, |e| format!("; the last conditions added were predicted within {e}"));
        let runs = last.runs;
        if self.reached {
            return format!(
                "accuracy of {asked} K reached with {runs} of at most {} runs: band {band} {}{error}",
                self.max_runs, last.unit
            );
        }
        format!("the accuracy of {asked} K was NOT reached with {runs} runs (max_runs): band {band} {} ({}){error}", last.unit, last.point)
    }
}

impl RoundRecord {
    /// The round in a line.
    pub fn line(&self) -> String {
        let failed = if self.failed > 0 { format!(" ({} failed)", self.failed) } else { String::new() };
        let predicted = self.predicted.as_ref().map_or_else(String::new, |p| {
            format!(
                "; {} conditions predicted before they were solved, largest error {} {} ({})",
                p.conditions,
                significant(p.error, 2),
                p.unit,
                p.point
            )
        });
        format!("{} runs{failed}: band {} {} ({}){predicted}", self.runs, significant(self.band, 2), self.unit, self.point)
    }
}

/// A sweep that was run.
#[derive(Debug)]
pub struct FinishedSweep {
    /// Tables of the sweep.
    pub swept: Swept,
    /// How the sweep came to its accuracy, if the sweep file states one.
    pub adaptation: Option<Adaptation>,
    /// The fit that was found accurate enough, or the last one, without the uncertainty of the machine.
    pub fit: Option<SurrogateFit>,
}

/// Runs a sweep, to its accuracy if it states one.
///
/// # Errors
/// Errors of [`Sweep::run`]; no fit can be made to the solved conditions.
pub fn run(sweep: &Sweep, folder: &Path, options: SweepOptions<'_>, progress: &dyn Progress) -> Result<FinishedSweep> {
    let Some(growth) = &sweep.plan.growth else {
        return Ok(FinishedSweep { swept: sweep.run(folder, options)?, adaptation: None, fit: None });
    };
    let mut found = Adaptation { accuracy: growth.accuracy, max_runs: growth.most, reached: false, rounds: Vec::new() };
    let mut before: Option<State> = None;
    // Errors of the batches that were predicted, by batch and point.
    let mut batches: Vec<Vec<Vec<f64>>> = Vec::new();
    let swept = sweep.run_growing(folder, options, &mut |round| {
        let mut state = State::of(sweep, round)?;
        let errors = before.as_ref().map(|before| before.errors_at(&state));
        let predicted = before.as_ref().zip(errors.as_ref()).and_then(|(before, errors)| before.predicted(errors));
        batches.extend(errors);
        state.fit.state_bands(&state.values, &batches, fit_options(sweep.definition.fit).coverage);
        let record = state.record(predicted);
        progress.say(&record.line());
        found.reached = record.band <= found.accuracy && record.predicted.as_ref().is_some_and(|p| p.error <= found.accuracy);
        let room = found.max_runs.saturating_sub(record.runs);
        found.rounds.push(record);
        let added = if found.reached || room == 0 { None } else { Some(state.next(growth, found.rounds.len(), room, round)) };
        before = Some(state);
        Ok(added)
    })?;
    Ok(FinishedSweep { swept, adaptation: Some(found), fit: before.map(|state| state.fit) })
}

/// A round with its fit.
struct State {
    fit: SurrogateFit,
    /// Rows of the plan that were fitted.
    rows: Vec<usize>,
    /// Conditions of these rows, in the variables of the fit.
    conditions: Vec<Vec<f64>>,
    /// Values of these rows, by point.
    values: Vec<Vec<f64>>,
    /// Rows of the plan that belong to the design, failed ones among them.
    design: Vec<usize>,
    /// Conditions of the whole plan.
    end: usize,
}

impl State {
    fn of(sweep: &Sweep, round: &SweepRound<'_>) -> Result<Self> {
        let is_of_design = |row: &usize| round.plan.group_of(*row).is_some_and(|g| !is_one_factor(g));
        let table = round.table.select(|row| is_of_design(&round.rows[row]));
        let rows: Vec<usize> = round.rows.iter().copied().filter(is_of_design).collect();
        let fit = fitting::fit_table(&table, Some(&sweep.scope), &fit_options(sweep.definition.fit))?;
        let columns = fit.surrogate.variables.iter().map(|v| table.column(&v.name)).collect::<Result<Vec<_>>>()?;
        let conditions = (0..rows.len()).map(|row| columns.iter().map(|c| c.values[row]).collect()).collect();
        let values = table.outputs().iter().map(|c| c.values.clone()).collect();
        let fitted = round.plan.groups.iter().filter(|g| g.purpose == Purpose::Fit && !is_one_factor(g));
        Ok(Self { fit, rows, conditions, values, design: fitted.flat_map(|g| g.rows.clone()).collect(), end: round.plan.conditions.len() })
    }

    fn record(&self, predicted: Option<Predicted>) -> RoundRecord {
        let widest = self.fit.points.iter().max_by(|a, b| a.half_width.total_cmp(&b.half_width));
        RoundRecord {
            runs: self.design.len(),
            failed: self.design.len() - self.rows.len(),
            band: widest.map_or(f64::INFINITY, |p| p.half_width),
            point: widest.map_or(String::new(), |p| p.name.clone()),
            unit: widest.map_or("K", |p| unit_of_errors(&p.unit)).into(),
            predicted,
        }
    }

    /// Errors of this fit at the conditions that are new in `later`, by point.
    fn errors_at(&self, later: &Self) -> Vec<Vec<f64>> {
        let new: Vec<usize> = (0..later.rows.len()).filter(|i| later.rows[*i] >= self.end).collect();
        let error = |p: usize, i: usize| {
            let said = evaluate(&self.fit.surrogate, p, &later.conditions[i]).unwrap_or(f64::INFINITY);
            (said - later.values[p][i]).abs()
        };
        (0..self.fit.points.len()).map(|p| new.iter().map(|i| error(p, *i)).collect()).collect()
    }

    /// Summary of these errors beside the bands of this fit; `None` if no condition was added that could be solved.
    fn predicted(&self, errors: &[Vec<f64>]) -> Option<Predicted> {
        let conditions = errors.first().map_or(0, Vec::len);
        let of = |(p, errors): (usize, &Vec<f64>)| (p, errors.iter().copied().fold(0.0, f64::max));
        let (worst, error) = errors.iter().enumerate().map(of).reduce(|a, b| if b.1 > a.1 { b } else { a })?;
        let inside: usize = (errors.iter().zip(&self.fit.points)).map(|(e, p)| e.iter().filter(|e| **e <= p.half_width).count()).sum();
        (conditions > 0).then(|| Predicted {
            conditions,
            error,
            point: self.fit.points[worst].name.clone(),
            unit: unit_of_errors(&self.fit.points[worst].unit).into(),
            share_in_band: inside as f64 / (conditions * errors.len()) as f64,
        })
    }

    /// The conditions to be added: where the points that miss the accuracy are least sure, or all points if none
    /// misses it.
    fn next(&self, growth: &DesignGrowth, round: usize, room: usize, so_far: &SweepRound<'_>) -> Vec<Vec<f64>> {
        let scaled = |place: Vec<f64>| -> Vec<f64> { place.iter().map(|u| 2.0 * u - 1.0).collect() };
        let points = &self.fit.points;
        let is_missed = |p: &usize| points[*p].half_width > growth.accuracy;
        let some_miss = (0..points.len()).any(|p| is_missed(&p));
        let counted: Vec<usize> = (0..points.len()).filter(|p| is_missed(p) || !some_miss).collect();
        let known = |row: &usize| {
            let solved = self.rows.iter().position(|r| r == row);
            KnownRow {
                place: scaled(growth.place(&so_far.plan.conditions[*row])),
                errors: solved.map(|i| counted.iter().map(|p| points[*p].held_out[i].abs()).collect()),
            }
        };
        let known: Vec<KnownRow> = self.design.iter().map(known).collect();
        let candidates = growth.candidates(round);
        let places: Vec<Vec<f64>> = candidates.iter().cloned().map(scaled).collect();
        let taken = most_telling(&known, &places, growth.batch().min(room));
        taken.into_iter().map(|i| growth.condition(&candidates[i], &so_far.plan.variables)).collect()
    }
}
