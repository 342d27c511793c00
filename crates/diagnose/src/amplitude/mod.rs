//! The amplitude first: causes as places and kinds whose size is free in every condition.
//!
//! A hypothesis says where and of which kind a cause is, not by which law it acts. All readings of a condition together decide whether a place
//! and a kind fit, whatever law governs them; the amplitudes that come out are the law, as a curve.

mod evidence;
mod profiles;
mod response;
mod rows;
mod search;
mod settings;

use rayon::prelude::*;

use super::Problem;
use super::effects::{Effect, Heat, Hypothesis, Law, Scales, hypotheses};
use super::predictor::{KnownSlopes, Predictor};
use super::view::Comparison;
use super::{history, signature};
use coldplate_base::error::{Error, Result};
use coldplate_base::progress::Progress;
use coldplate_evidence::measurement::{ReadingRow, whiten};
use coldplate_network::Load;
use evidence::Explained;
use response::{Answer, Response};
use rows::Errors;
use search::{Candidate, Fit, Search};
pub use settings::AmplitudeSettings;

/// Amplitudes at which the machine is solved for each cause that bends, in units of its scale.
const KNOTS: [f64; 6] = [-5.0, -2.5, -1.0, 1.0, 2.5, 5.0];
/// Places of one set at most.
const MOST_PLACES: usize = 4;
/// Sets of each size that are fitted about the machine with the set in force.
const REFINED: usize = 10;
/// Sets that are reported.
const MOST_SETS: usize = 12;

/// One place and kind with the amplitude that each condition asks for.
#[derive(Debug, Clone)]
pub struct PlaceAndKind {
    /// Which.
    pub hypothesis: Hypothesis,
    /// Amplitude in each row of the table, in the hypothesis' unit.
    pub amplitudes: Vec<f64>,
    /// Standard deviation of the amplitude in each row, in the hypothesis' unit.
    pub deviations: Vec<f64>,
    /// Whether every row may have its own.
    pub is_free: bool,
    /// The variable over which it runs smoothly, if it does; `row` is the order of the rows.
    pub over: Option<String>,
}

/// A set of places and kinds.
#[derive(Debug, Clone)]
pub struct PlaceSet {
    /// Places and kinds in the set; the machine as it is has none.
    pub members: Vec<PlaceAndKind>,
    /// Logarithm of the evidence over that of the machine as it is.
    pub lead: f64,
    /// Posterior probability among all sets that were fitted.
    pub probability: f64,
    /// Logarithm of the density of each row given all others, over that of the machine as it is, summed; and its standard error.
    pub kept_out: (f64, f64),
    /// Standard deviation of the logarithms of the machine's numbers.
    pub spread: f64,
    /// The disturbance, as a share of the machine's mean heat.
    pub disturbance: f64,
}

/// Places and kinds that a table of readings asks for.
#[derive(Debug, Clone)]
pub struct Places {
    /// Sets, most probable first.
    pub sets: Vec<PlaceSet>,
    /// Places and kinds that were tried, each fitted to the end.
    pub tried: usize,
}

/// Finds the places and kinds that a steady table asks for.
///
/// # Errors
/// The machine as it is cannot be solved at the data's conditions; the data are a log.
pub fn places(problem: &Problem, settings: &AmplitudeSettings, progress: &dyn Progress) -> Result<Places> {
    let (study, data) = (&problem.study, &problem.data);
    if data.is_transient() {
        let error = Error::input("amplitudes that are free in every row are found in steady tables, and this is a log");
        return Err(error.help("leave --amplitudes out, or state the steady end of each test as a row of a table without a time"));
    }
    let scales = Scales::of(data, &study.model.machine);
    let mut catalogue = hypotheses(study, data, &problem.user);
    catalogue.retain(|h| h.law == h.effect.usual_law() && !problem.without.iter().any(|kind| kind == h.kind()));
    let base = Comparison::of(problem, study, &catalogue, &scales)?;
    let predictor = Predictor {
        study,
        data,
        predicted: &base.found.prediction.values,
        fields: &base.found.fields,
        runs: problem.runs(),
        scales: &scales,
        user: &problem.user,
        fronts: history::has_fronts(study, data)?,
        slopes: KnownSlopes { catalogue: &catalogue, columns: &base.found.columns },
    };
    progress.say(&format!("{} places and kinds, each at several amplitudes", catalogue.len()));
    let known = (catalogue.iter().zip(&base.found.columns)).collect::<Vec<_>>();
    let visible: Vec<(&Hypothesis, &Vec<f64>)> = known.into_iter().filter(|(_, column)| column.iter().any(|c| c.abs() > 1e-9)).collect();
    let candidates: Vec<Candidate> = visible.par_iter().map(|(h, column)| candidate(&predictor, h, column)).collect();
    let errors = errors(problem, &base, &catalogue);
    let together = |members: &[(usize, f64)]| -> Option<Vec<f64>> {
        let with: Vec<(&Hypothesis, f64)> = members.iter().map(|(m, a)| (visible[*m].0, a * visible[*m].0.scale)).collect();
        Some(difference(&predictor.predict(&with).ok()?, predictor.predicted))
    };
    // Rows without a reading say nothing.
    let rows: Vec<&ReadingRow> = data.rows.iter().filter(|row| row.has_readings()).collect();
    let value = |v: usize| rows.iter().map(|row| row.condition.si()[v]).collect::<Vec<f64>>();
    let own = study.model.machine.variables.iter().enumerate().filter(|(_, variable)| problem.states(&variable.name));
    let own = own.map(|(v, variable)| (variable.name.clone(), value(v)));
    // In the order of the rows: what sets in or drifts while a table is taken.
    let order = ("row".to_string(), (0..rows.len()).map(|row| row as f64).collect());
    let varies = |(_, values): &(String, Vec<f64>)| values.iter().any(|x| *x != values[0]);
    let (names, variables): (Vec<String>, Vec<Vec<f64>>) = own.chain([order]).filter(varies).unzip();
    let numbers_with = |m: usize, a: f64| numbers_with(&predictor, &base, visible[m].0, a * visible[m].0.scale);
    let search = Search::new(&errors, &base.found.residual, &candidates, settings, (&together, &numbers_with), &variables);
    let nothing = search.nothing();
    progress.say("places and kinds alone");
    let mut all = refined(&search, search.singles(&nothing));
    let mut last = all.clone();
    for count in 2..=MOST_PLACES {
        let best = all.first().map_or(f64::NEG_INFINITY, Fit::log_posterior);
        progress.say(&format!("sets of {count}"));
        last = refined(&search, search.grown(&last));
        let is_better = last.first().is_some_and(|first| first.log_posterior() > best);
        all.extend(last.iter().cloned());
        if !is_better {
            break;
        }
    }
    all.sort_by(|a, b| b.log_posterior().total_cmp(&a.log_posterior()));
    let tried = candidates.len();
    let most = all.iter().map(Fit::log_posterior).fold(nothing.log_posterior(), f64::max);
    let whole: f64 = all.iter().chain([&nothing]).map(|fit| (fit.log_posterior() - most).exp()).sum();
    let kept_out = |fit: &Fit| seen(&search, fit).1;
    let ground = kept_out(&nothing);
    let of = |fit: &Fit| -> PlaceSet {
        let (posterior, density) = seen(&search, fit);
        let gains = difference(&density, &ground);
        let members = fit.members.iter().enumerate().map(|(m, c)| {
            let h = visible[*c].0;
            PlaceAndKind {
                hypothesis: h.clone(),
                amplitudes: fit.amplitudes[m].iter().map(|a| a * h.scale).collect(),
                deviations: posterior[m].iter().map(|d| d * h.scale).collect(),
                is_free: fit.freedoms[m].freedom > 0.0,
                over: fit.freedoms[m].curve.map(|((v, _), _)| names[v].clone()),
            }
        });
        PlaceSet {
            members: members.collect(),
            lead: fit.log_evidence - nothing.log_evidence,
            probability: (fit.log_posterior() - most).exp() / whole,
            kept_out: sum_and_error(&gains),
            spread: fit.looseness.spread,
            disturbance: fit.looseness.disturbance,
        }
    };
    all.push(nothing.clone());
    all.sort_by(|a, b| b.log_posterior().total_cmp(&a.log_posterior()));
    let sets = all.iter().take(MOST_SETS).map(of).collect();
    Ok(Places { sets, tried })
}

/// The best of some fits about the machine with their sets in force, most probable first.
fn refined(search: &Search<'_>, mut fits: Vec<Fit>) -> Vec<Fit> {
    let rest = fits.split_off(fits.len().min(REFINED));
    let mut all: Vec<Fit> = fits.into_par_iter().map(|fit| search.refined(fit)).chain(rest).collect();
    all.sort_by(|a, b| b.log_posterior().total_cmp(&a.log_posterior()));
    all
}

/// Change of the readings with the logarithm of each number of the machine (K) with a cause in force at an amplitude.
fn numbers_with(predictor: &Predictor<'_>, base: &Comparison, h: &Hypothesis, amplitude: f64) -> Option<Vec<Vec<f64>>> {
    if h.is_sensor() {
        return None;
    }
    let study = predictor.extended(&[(h, amplitude)]).ok()??.study;
    // An effect is numbered anew in another file.
    let own = hypotheses(&study, predictor.data, predictor.user);
    let same = |(number, _): &(Hypothesis, f64)| {
        let is = |other: &&Hypothesis| (other.kind(), &other.place, other.law) == (number.kind(), &number.place, number.law);
        own.iter().find(is).cloned()
    };
    let numbers = base.numbers.iter().map(same).collect::<Option<Vec<Hypothesis>>>()?;
    let about = (predictor.scales, predictor.user);
    let found = signature::steady(&study, predictor.data, &[], &numbers, about, Some(predictor.fields)).ok()?;
    let scaled = |(column, (_, unit)): (&Vec<f64>, &(Hypothesis, f64))| column.iter().map(|c| unit * c).collect();
    Some(found.columns.iter().zip(&base.numbers).map(scaled).collect())
}

/// Deviations of the amplitudes of each member, and the density of each row given all others.
fn seen(search: &Search<'_>, fit: &Fit) -> (Vec<Vec<f64>>, Vec<f64>) {
    let search = search.with_errors_of(fit);
    let (rows, linear) = search.about(fit);
    let explained = Explained::new(rows, &search.profiles, &linear.residual, &linear.columns, &search.followed(&fit.freedoms));
    let Some(posterior) = explained.posterior(&fit.freedoms, fit.looseness.spread) else { return Default::default() };
    let deviations = |m: usize| posterior.covariance(m).diagonal().iter().map(|v| v.max(0.0).sqrt()).collect();
    ((0..fit.members.len()).map(deviations).collect(), posterior.kept_out())
}

fn difference(a: &[f64], b: &[f64]) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| a - b).collect()
}

/// Sum of some numbers, and its standard error.
fn sum_and_error(numbers: &[f64]) -> (f64, f64) {
    let n = numbers.len().max(1) as f64;
    let mean = numbers.iter().sum::<f64>() / n;
    let variance = numbers.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (n - 1.0).max(1.0);
    (n * mean, (n * variance).sqrt())
}

/// A cause with its answer: straight where heats, offsets and exchanges are, else solved at several amplitudes.
fn candidate(predictor: &Predictor<'_>, h: &Hypothesis, column: &[f64]) -> Candidate {
    let (low, high) = if h.is_fixed() { (0.0, 1.0) } else { h.range() };
    let range = (low / h.scale, high / h.scale);
    let slope: Vec<f64> = column.iter().map(|c| c * h.scale).collect();
    let is_straight = h.is_sensor() || matches!(h.effect, Effect::Heat(_) | Effect::User(_));
    let mut answer = Answer::Straight(slope.clone());
    if !is_straight {
        let at = |knot: &f64| Some((*knot, difference(&predictor.predict(&[(h, knot * h.scale)]).ok()?, predictor.predicted)));
        let mut solved: Vec<(f64, Vec<f64>)> = KNOTS.iter().filter(|k| **k >= range.0 && **k <= range.1).filter_map(at).collect();
        solved.push((0.0, vec![0.0; column.len()]));
        solved.sort_by(|a, b| a.0.total_cmp(&b.0));
        if solved.len() > 2 {
            let (knots, changes) = solved.into_iter().unzip();
            answer = Answer::Bent(Response::new(knots, changes));
        }
    }
    Candidate { answer, is_signed: h.is_signed && !h.is_fixed(), range, rate: h.rate(1) }
}

/// The covariance of a table's readings without any cause.
fn errors(problem: &Problem, base: &Comparison, catalogue: &[Hypothesis]) -> Errors {
    let places = whiten::places(&problem.data);
    let machine = &problem.study.model.machine;
    let loads = problem.data.rows.iter().filter_map(|row| Load::at(machine, &row.condition).ok());
    let heats: Vec<f64> = loads.flat_map(|load| load.powers).map(f64::abs).collect();
    let mean = heats.iter().sum::<f64>() / heats.len().max(1) as f64;
    let is_heat = |h: &Hypothesis| matches!(h.effect, Effect::Heat(Heat::Into(_))) && h.law == Law::Constant;
    let of_heat = catalogue.iter().zip(&base.found.columns).filter(|(h, _)| is_heat(h));
    Errors {
        row_of: consecutive(places.iter().map(|(row, _)| *row)),
        noise: base.errors.noise().to_vec(),
        stated: base.errors.shared(),
        numbers: base.errors.numbers().to_vec(),
        heats: of_heat.map(|(_, column)| column.iter().map(|c| c * mean).collect()).collect(),
    }
}

/// Rising numbers, counted from zero without gaps.
fn consecutive(rows: impl Iterator<Item = usize>) -> Vec<usize> {
    let (mut all, mut last) = (Vec::new(), None);
    for row in rows {
        let before = all.last().copied().unwrap_or(0);
        all.push(if last.is_some_and(|last| last != row) { before + 1 } else { before });
        last = Some(row);
    }
    all
}
