//! An identification from its first prediction to the estimate: starts, renewals of the covariance, a wider search, the model's own
//! error, and parameters that the data leave open.

use super::descent::MOST_STEPS;
use super::ended::{Ended, chi_square_tail, fit_of};
use super::estimate::{Estimate, Outcome, summary};
use super::free::Free;
use super::learnt::{ALLOWED, CERTAIN, learnt};
use super::search::{Point, Search};
use super::search_end::SearchEnd;
use super::settle;
use super::wider;
use super::{IdentifyProblem, Pace};
use crate::measurement::{Whitener, whiten};
use coldplate_base::error::{Error, Result};
use coldplate_base::progress::Progress;
use coldplate_base::random::Random;
use coldplate_solve::study::StateTables;

/// The covariance is renewed until the estimate moves by less than this share of its standard deviation. Chosen: a smaller one
/// costs further rounds.
const RENEWED: f64 = 1e-2;
/// Most renewals of the covariance, count. Chosen: each costs a search.
const MOST_RENEWALS: usize = 5;
/// Error allowed in each time step of a log while other starts are tried, over that of the estimate; dimensionless. Chosen: a
/// larger one is faster and hides shallow minima.
const EXPLORED: f64 = 10.0;
/// Largest error of predictions on the reduced model at the values found, K. Chosen: far below the noise of thermometers; a
/// larger one saves full solves.
const ACCURACY: f64 = 1e-3;
/// Misfit per degree of freedom above which the machine file's values are far from the data, dimensionless. Chosen: residuals of thirty
/// deviations; a smaller one renews the covariance of searches that begin near.
const FAR_OFF: f64 = 1e3;

/// Options of the search.
#[derive(Debug, Clone, PartialEq)]
pub struct IdentifyOptions {
    /// Number of starting points: the machine file's values and others around them.
    pub starts: usize,
    /// Seed of the other starting points.
    pub seed: u64,
}

impl Default for IdentifyOptions {
    fn default() -> Self {
        Self { starts: 3, seed: 1 }
    }
}

/// Finds the free parameters under the stated errors.
///
/// Every start descends under the covariance at the machine file's values; from the best end the covariance is renewed
/// until the estimate rests.
///
/// # Errors
/// A controller in the machine; no free parameter, one named twice, or no data; the machine cannot be solved at the start of the search.
pub fn identify(problem: &IdentifyProblem, options: &IdentifyOptions, progress: &dyn Progress) -> Result<Estimate> {
    found(problem, options, false, progress)
}

/// Finds the free parameters as [`identify`] does, with two further errors: that of the mesh, and a model error that is learnt
/// if the stated errors do not explain the residual. Parameters that the data do not determine keep the file's values.
///
/// # Errors
/// Errors of [`identify`].
pub fn identify_and_learn(problem: &IdentifyProblem, options: &IdentifyOptions, progress: &dyn Progress) -> Result<Estimate> {
    found(problem, options, true, progress)
}

/// Estimate by [`searched`]. Tables are solved on the reduced model, and the end result once in full. If the two differ by more
/// than [`ACCURACY`], everything is solved in full.
fn found(problem: &IdentifyProblem, options: &IdentifyOptions, learns: bool, progress: &dyn Progress) -> Result<Estimate> {
    problem.study.model.machine.without_controllers("identification")?;
    let found = searched(problem, options, learns, progress)?;
    if problem.study.tables == StateTables::InFull || problem.data.is_transient() {
        return Ok(found);
    }
    let study = problem.study.clone().with_tables(StateTables::InFull);
    let in_full = IdentifyProblem { study, ..problem.clone() };
    let own = found.predictions.1.iter().zip(&found.mesh.correction).map(|(p, m)| p - m);
    let off = in_full
        .predict_free(&found.values, false, Pace::own(problem.accuracy()))
        .map_or(f64::INFINITY, |full| full.values.iter().zip(own).fold(0.0, |m: f64, (f, v)| m.max((f - v).abs())));
    if off <= ACCURACY {
        return Ok(Estimate { off_in_full: Some(off), ..found });
    }
    progress.say(&format!("the reduced model is off by {off:.1e} K: everything again in full"));
    searched(&in_full, options, learns, progress)
}

fn searched(problem: &IdentifyProblem, options: &IdentifyOptions, learns: bool, progress: &dyn Progress) -> Result<Estimate> {
    check(problem)?;
    let mut search = Search::new(problem, progress);
    let Begun { nominal, whitener, continues } = begun(&mut search, learns)?;
    let mut noise = Random::new(options.seed);
    let ends = starts(&mut search, options, &nominal, &whitener, &mut noise);
    let costs: Vec<f64> = ends.iter().map(|end| end.cost).collect();
    let Some(best) = ends.into_iter().min_by(|a, b| a.cost.total_cmp(&b.cost)) else {
        return Err(Error::numerics("no start led anywhere"));
    };
    let (mut best, mut whitener) = renewed(&mut search, best, continues)?;
    let mut looked = None;
    let fit = fit_of(&search, &best, &whitener);
    if fit.probability < CERTAIN && fit.freedom > 0 {
        progress.say(&format!("a misfit of {:.1}: a wider search", best.cost));
        let (better, account) = wider::wider(&mut search, &nominal.coordinates, &best, &whitener, &mut noise);
        if let Some(better) = better {
            (best, whitener) = renewed(&mut search, better, continues)?;
        }
        looked = Some(account);
    }
    let settled = settle::into_ranges(&mut search, best.clone(), &whitener);
    if settled.coordinates != best.coordinates {
        (best, whitener) = renewed(&mut search, settled, continues)?;
    }
    if best.prediction.conditions.iter().any(Vec::is_empty) {
        (best, whitener) = search.whole(best.coordinates)?;
    }
    let mut ended = None;
    if learns {
        let probability = explained(&search, &best, &whitener);
        // No more readings than parameters do not inform about the model.
        if probability < ALLOWED && search.readings.len() > problem.free.len() {
            progress.say("the model's own error");
            ended = learnt(&mut search, &nominal, &best, probability)?.map(|learnt| Ended::learnt(&search, learnt));
        }
    }
    let ended = ended.unwrap_or_else(|| Ended::stated(&search, best, whitener));
    let end = settle::end_of(&mut search, &ended.point, &ended.weights, &[]);
    // Nothing can be said of numbers that are still on their way.
    let (ended, kept) = match (learns, end) {
        (true, SearchEnd::AtRest) => {
            let ended = settle::on_linear_scale(&mut search, ended)?;
            settle::keep(&mut search, ended)?
        }
        _ => (ended, Vec::new()),
    };
    Ok(summary(&search, &nominal, ended, Outcome { kept, widens: learns, ends: costs, wider: looked, end }))
}

/// Beginning of a search.
struct Begun {
    /// The machine file's values.
    nominal: Point,
    /// Whitening of the first descents.
    whitener: Whitener,
    /// Whether predictions are continued to a finer mesh.
    continues: bool,
}

fn begun(search: &mut Search<'_>, learns: bool) -> Result<Begun> {
    let start: Vec<f64> = search.free.iter().map(|f| f.coordinate(f.parameter.value.clamp(f.limits.0, f.limits.1))).collect();
    let (mut nominal, mut whitener) = search.whole(start)?;
    // If no finer mesh can be had, predictions stay those of the model's own mesh.
    let mut continues = learns;
    if continues {
        search.say("the mesh's share");
        continues = search.continue_from(&nominal).unwrap_or_else(|e| {
            search.say(&format!("predictions are not continued to a finer mesh: {e}"));
            false
        });
        whitener = search.stated(&nominal.prediction);
        nominal = search.under(nominal, &whitener);
    }
    // Far from the data, derivatives with respect to the conditions say nothing of the errors there.
    let fit = fit_of(search, &nominal, &whitener);
    if fit.misfit > FAR_OFF * fit.freedom.max(1) as f64 {
        whitener = search.apart();
        nominal = search.under(nominal, &whitener);
    }
    Ok(Begun { nominal, whitener, continues })
}

/// Ends of descents from the machine file's values and from points around them.
fn starts(search: &mut Search<'_>, options: &IdentifyOptions, nominal: &Point, whitener: &Whitener, noise: &mut Random) -> Vec<Point> {
    let count = options.starts.max(1);
    search.say(&format!("start 1 of {count}"));
    let mut ends = vec![search.descend(nominal.clone(), whitener)];
    for s in 1..count {
        search.say(&format!("start {} of {count}", s + 1));
        // Further starts only look for a better end. One that is better is refined to the full accuracy.
        search.tolerance = EXPLORED * search.accuracy;
        let from = wider::around(search, &nominal.coordinates, whitener, noise);
        let end = search.descend_unless(from.unwrap_or(nominal.clone()), whitener, &ends, MOST_STEPS);
        search.tolerance = search.accuracy;
        let least = ends.iter().map(|end| end.cost).fold(f64::INFINITY, f64::min);
        let is_better = search.problem.data.is_transient() && end.cost < least;
        let begun = if is_better { search.point(end.coordinates.clone(), whitener).ok() } else { None };
        ends.push(begun.map_or(end, |begun| search.descend_unless(begun, whitener, &ends, MOST_STEPS)));
    }
    ends
}

/// A point with the covariance there, renewed until the point rests under it.
fn renewed(search: &mut Search<'_>, mut best: Point, continues: bool) -> Result<(Point, Whitener)> {
    let mut whitener = None;
    for round in 0..MOST_RENEWALS {
        let (point, mut own) = search.whole(best.coordinates)?;
        best = point;
        if round == 0 && continues {
            if let Err(e) = search.continue_from(&best) {
                search.say(&format!("the mesh's share stays that of the machine file: {e}"));
            }
            own = search.stated(&best.prediction);
            best = search.under(best, &own);
        }
        let rests = search.rests(&best, &own, RENEWED);
        if !rests {
            best = search.descend(best, &own);
        }
        whitener = Some(own);
        if rests {
            break;
        }
    }
    match whitener {
        Some(whitener) => Ok((best, whitener)),
        None => search.whole(best.coordinates),
    }
}

/// Probability that the stated errors explain the residual: the smaller one of the whole misfit and of the common errors of
/// sensors and conditions that the residual asks for. If the noise of many readings is stated too large, the misfit alone would
/// hide that these common errors take the place of parameters.
fn explained(search: &Search<'_>, at: &Point, whitener: &Whitener) -> f64 {
    let problem = search.problem;
    let left = search.residual(&at.prediction, whitener);
    let common = whiten::common_errors(&problem.data, &problem.uncertainty, &at.prediction.conditions);
    let common: Vec<Vec<f64>> = common.into_iter().filter(|c| c.iter().any(|v| *v != 0.0)).collect();
    let pull = |column: &Vec<f64>| whitener.apply(column).iter().zip(&left).map(|(c, l)| c * l).sum::<f64>().powi(2);
    fit_of(search, at, whitener).probability.min(chi_square_tail(common.iter().map(pull).sum(), common.len()))
}

fn check(problem: &IdentifyProblem) -> Result<()> {
    if problem.free.is_empty() {
        return Err(Error::input("no parameter is free")
            .at_key("--free")
            .help("name at least one, for example --free contact.motor.conductance"));
    }
    let names: Vec<String> = problem.free.iter().map(Free::name).collect();
    if let Some(k) = (1..names.len()).find(|k| names[..*k].contains(&names[*k])) {
        return Err(Error::input("this parameter is named twice").at_key(&names[k]).help("name it once"));
    }
    let tests = problem.data.tests();
    if let Some(free) = problem.free.iter().find(|f| f.test.as_ref().is_some_and(|test| !tests.contains(test))) {
        return Err(Error::input("no test of this name is used").at_key(free.name()).help(format!("the tests are: {}", tests.join(", "))));
    }
    if problem.data.count() == 0 {
        return Err(Error::input("there is no reading"));
    }
    Ok(())
}
