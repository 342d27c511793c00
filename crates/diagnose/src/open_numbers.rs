//! Numbers of the machine file that may be a little off, with the columns in which the readings answer to them.

use std::ops::Range;

use nalgebra::DVector;

use super::Cause;
use super::amplitude::{Beside, Errors, Rows};
use super::effects::{Common, CommonFactor, Effect, Hypothesis, Number};
use super::stated::Stated;

/// A number of the file that may be a little off.
pub(crate) struct OpenNumber {
    /// Which, with its standard deviation as its scale.
    pub hypothesis: Hypothesis,
    /// Places among the columns that rows share: one, or one for each test where each may be off by another amount.
    pub places: Vec<usize>,
    /// Change of the readings with one standard deviation in all of them, K.
    pub column: Vec<f64>,
}

/// Numbers of the file beside causes: those that nobody called uncertain where the model's spread is not zero, those that the user did, and what
/// all films, all heats or all emissivities share.
pub(crate) fn open_numbers(
    beside: &Beside<'_>,
    causes: &[Cause],
    (errors, rows, deviations): (&Errors, &Rows, &DVector<f64>),
) -> Vec<OpenNumber> {
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
