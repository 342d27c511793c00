//! What the simulation gets wrong, the cause by name, the extended model, and what it gains.
//!
//! ```text
//! data, machine -> residual -> significant? -> catalogue (place x kind x law) -> screen -> pairs -> refit -> probabilities
//!               -> the set that cannot be told apart -> next measurement, extended machine, gain on what was kept out
//! ```
//!
//! The covariance of the residual decides everything: reading noise, each sensor's own error, the errors of every
//! condition, and what any model of such a machine leaves open ([`Openness`]). The machine's numbers that the user calls
//! uncertain join it with their priors, so that a cause is never named for what calibration may still move.

mod advice;
mod catalogue;
mod decide;
mod gain;
mod logs;
mod probability;
pub mod random;
mod refine;
mod screen;
mod signature;
mod words;

use std::time::Instant;

use crate::error::Result;
use crate::identify::Prediction;
use crate::measure::{Data, Uncertainty, Whitener, wander, whiten};
use crate::sensitivity::{Parameter, Study};
use crate::simulate::Start;

pub use advice::Next;
pub use catalogue::{Act, Hypothesis, Law, Scales, UserKind, hypotheses};
pub use decide::{Level, Verdict};
pub use gain::Gain;
pub use refine::{Bench, Fitted, fit};
pub use signature::{Signatures, signatures};
pub use words::sentence;

use probability::{Candidate, Posterior};
use screen::Screened;

/// Chi-square above the best within which causes count as not refuted: 95 % for two parameters.
const SET_95: f64 = 5.991_465;
/// Half width of a 90 % interval in standard deviations.
const TWO_SIDED_90: f64 = 1.644_854;
/// Cells of the finer mesh that predictions are corrected with, over those of the model.
const FINER: f64 = 3.0;
/// Causes and pairs that are fitted through the full solver.
const FINALISTS: usize = 6;
/// Least probability of a finalist, once there is one.
const LEAST: f64 = 3e-3;

/// What any model of such a machine leaves open, as standard deviations of common factors, and its own noise.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Openness {
    /// Of all films together: correlations of channels.
    pub films: f64,
    /// Of all heats together.
    pub heats: f64,
    /// Of all emissivities together.
    pub emissivities: f64,
    /// Of each heat capacity.
    pub capacities: f64,
    /// Of mesh and geometry, K, reading by reading; in logs it wanders with the time.
    pub model: f64,
}

impl Default for Openness {
    fn default() -> Self {
        Self { films: 0.07, heats: 0.02, emissivities: 0.1, capacities: 0.03, model: 0.02 }
    }
}

/// What is to be diagnosed.
#[derive(Debug, Clone)]
pub struct Problem {
    /// The machine as its file has it.
    pub study: Study,
    /// What was measured.
    pub data: Data,
    /// How well.
    pub uncertainty: Uncertainty,
    /// Numbers of the file that are uncertain, with the standard deviation of each, SI.
    pub uncertain: Vec<(Parameter, f64)>,
    /// What every model leaves open.
    pub openness: Openness,
    /// The user's own kinds.
    pub user: Vec<UserKind>,
    /// The state logs begin with.
    pub start: Start,
    /// Seed of simulated noise.
    pub seed: u64,
    /// Kinds that are not tried.
    pub without: Vec<String>,
}

/// The misfit of the machine as it is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Misfit {
    /// Chi-square of the whitened residual.
    pub chi2: f64,
    /// Readings.
    pub freedom: usize,
    /// Probability of a chi-square this large from noise alone.
    pub probability: f64,
    /// Probability that noise alone lets some cause of the catalogue explain as much as the best one does.
    pub look_elsewhere: f64,
}

/// One cause (or one of two).
#[derive(Debug, Clone, PartialEq)]
pub struct Part {
    /// Which.
    pub hypothesis: Hypothesis,
    /// Its amplitude, in the hypothesis' unit.
    pub amplitude: f64,
    /// Its standard deviation.
    pub deviation: f64,
}

impl Part {
    /// 90 % interval of the amplitude.
    pub fn interval(&self) -> (f64, f64) {
        let (low, high) = (self.amplitude - TWO_SIDED_90 * self.deviation, self.amplitude + TWO_SIDED_90 * self.deviation);
        (if self.hypothesis.is_signed { low } else { low.max(0.0) }, high)
    }
}

/// An explanation: one cause, or two together.
#[derive(Debug, Clone, PartialEq)]
pub struct Explanation {
    /// Its parts.
    pub parts: Vec<Part>,
    /// Its probability.
    pub probability: f64,
    /// Misfit left.
    pub misfit: f64,
    /// Whether it was fitted through the full solver.
    pub is_fitted: bool,
}

/// The answer.
#[derive(Debug, Clone)]
pub struct Diagnosis {
    /// Misfit of the machine as it is.
    pub misfit: Misfit,
    /// What it comes to.
    pub verdict: Verdict,
    /// How far up the ladder the answer is certain.
    pub level: Level,
    /// Probability that nothing is wrong, and that it is something else.
    pub others: (f64, f64),
    /// Explanations, most probable first.
    pub explanations: Vec<Explanation>,
    /// How many of them the data cannot refute.
    pub set: usize,
    /// Hypotheses tried, and those that could show in these data.
    pub tried: (usize, usize),
    /// Predictions of the machine as it is, residuals (K) and whitened residuals.
    pub sheet: Sheet,
    /// Predictions with the best explanation, K.
    pub explained: Option<Vec<f64>>,
    /// Gain on conditions kept out of the selection; none with fewer than three.
    pub gain: Option<Gain>,
    /// What to measure next where the answer is open.
    pub next: Vec<Next>,
    /// Lines of the machine file that make the best explanation true.
    pub sets: Option<Vec<(String, String)>>,
    /// The covariance that was used.
    pub whitener: Whitener,
    /// Seconds it took.
    pub seconds: f64,
}

/// Residuals, reading by reading.
#[derive(Debug, Clone, PartialEq)]
pub struct Sheet {
    /// Predictions, K.
    pub predicted: Vec<f64>,
    /// Readings less predictions, K.
    pub residual: Vec<f64>,
    /// The same whitened.
    pub whitened: Vec<f64>,
}

/// Covariance in parts, so that it can be cut to some readings.
#[derive(Debug, Clone)]
pub(crate) struct Errors {
    deviation: Vec<f64>,
    common: Vec<Vec<f64>>,
}

impl Errors {
    fn new(problem: &Problem, prediction: &Prediction, catalogue: &[Hypothesis], columns: &[Vec<f64>]) -> Self {
        let deviation = if problem.data.is_transient() {
            whiten::noise(&problem.data, &problem.uncertainty)
        } else {
            whiten::deviations(&problem.data, &problem.uncertainty).iter().map(|d| d.hypot(problem.openness.model)).collect()
        };
        let mut common = whiten::common_errors(&problem.data, &problem.uncertainty, &prediction.conditions);
        common.extend(wander::errors(&problem.data, &problem.uncertainty, problem.openness.model, &prediction.values));
        for (k, (_, spread)) in problem.uncertain.iter().enumerate() {
            common.push(prediction.slopes.iter().map(|row| row[k] * spread).collect());
        }
        let sum = |chosen: &dyn Fn(&Hypothesis) -> bool, spread: f64| {
            let mut sum = vec![0.0; prediction.values.len()];
            for (h, column) in catalogue.iter().zip(columns).filter(|(h, _)| h.law == Law::Constant && chosen(h)) {
                debug_assert!(!h.is_sensor());
                sum.iter_mut().zip(column).for_each(|(s, c)| *s += spread * c);
            }
            sum
        };
        common.push(sum(&|h| matches!(h.act, Act::Film(_)), problem.openness.films));
        common.push(sum(&|h| matches!(h.act, Act::Source(_)), problem.openness.heats));
        common.push(sum(&|h| matches!(h.act, Act::Emissivity(_)), problem.openness.emissivities));
        // Films follow one correlation; what parts store does not: each has its own shape and material.
        for (h, column) in catalogue.iter().zip(columns) {
            let Act::Capacity(g) = h.act else { continue };
            let spread = problem.openness.capacities * catalogue::capacity(&problem.study.model.network, g);
            common.push(column.iter().map(|c| spread * c).collect());
        }
        Self { deviation, common }
    }

    fn whitener(&self, readings: &[usize]) -> Whitener {
        let pick = |v: &Vec<f64>| readings.iter().map(|i| v[*i]).collect::<Vec<f64>>();
        Whitener::new(&pick(&self.deviation), &self.common.iter().map(pick).collect::<Vec<_>>())
    }

    /// Standard deviation of each reading, K.
    fn marginal(&self) -> Vec<f64> {
        let of = |i: usize| (self.deviation[i].powi(2) + self.common.iter().map(|c| c[i] * c[i]).sum::<f64>()).sqrt();
        (0..self.deviation.len()).map(of).collect()
    }
}

/// Diagnoses.
///
/// # Errors
/// The machine as it is cannot be solved at the data's conditions.
pub fn diagnose(problem: &Problem, progress: &mut dyn FnMut(&str)) -> Result<Diagnosis> {
    let clock = Instant::now();
    let (study, data) = (&problem.study, &problem.data);
    let scales = Scales::of(data, &study.model.machine);
    let mut catalogue = hypotheses(study, data, &problem.user);
    catalogue.retain(|h| !problem.without.iter().any(|kind| kind == h.kind));
    progress(&format!("{} readings, {} causes to hold against them", data.count(), catalogue.len()));
    let uncertain: Vec<Parameter> = problem.uncertain.iter().map(|(p, _)| p.clone()).collect();
    let mut found = signatures(study, data, problem.start, &uncertain, &catalogue, &scales, &problem.user)?;
    let mesh = mesh_correction(problem, &found.prediction.values)?;
    found.residual.iter_mut().zip(&mesh).for_each(|(r, m)| *r -= m);
    let mut errors = Errors::new(problem, &found.prediction, &catalogue, &found.columns);
    // What a finer mesh changes is corrected for, and half of it stays an error.
    errors.common.push(mesh.iter().map(|m| 0.5 * m).collect());
    let base = found.prediction.values.clone();
    let bench = Bench { study, data, start: problem.start, scales: &scales, user: &problem.user, base: Some(&base) };
    if data.is_transient()
        && let Some(around) = logs::taken_up(&bench, &catalogue, &mut found, &errors, &uncertain, problem.seed)?
    {
        errors = Errors::new(problem, &around, &catalogue, &found.columns);
    }
    let all: Vec<usize> = (0..found.residual.len()).collect();
    let whitener = errors.whitener(&all);
    let screened = screened(&found.residual, &found.columns, &whitener, &catalogue);
    let misfit = misfit(&screened, problem.seed);
    let prior = probability::prior(&screened, &catalogue);
    let mut posterior = probability::posterior(&screened, &prior);
    let is_wrong = decide::is_wrong(&misfit);
    let readings: Vec<f64> = whiten::readings(data).iter().zip(&mesh).map(|(r, m)| r - m).collect();
    let mut fitted: Vec<(Vec<usize>, Fitted)> = Vec::new();
    if is_wrong {
        progress("fitting the most probable causes through the full solver");
        fitted = refit(&bench, &catalogue, &screened, &mut posterior, &readings, &whitener);
    }
    let explanation = |c: &Candidate| -> Explanation {
        let known = fitted.iter().find(|(members, _)| *members == c.members);
        let parts = c.members.iter().enumerate().map(|(i, j)| {
            let hypothesis = catalogue[screened.visible[*j]].clone();
            let linear = 1.0 / (1.0 + screened.gram[(*j, *j)]).sqrt() * hypothesis.scale;
            let (amplitude, deviation) = match known {
                Some((_, f)) => (f.amplitudes[i], f.deviations[i]),
                None => (c.amplitudes[i] * hypothesis.scale, linear),
            };
            Part { hypothesis, amplitude, deviation }
        });
        Explanation {
            parts: parts.collect(),
            probability: c.probability,
            misfit: known.map_or(screened.misfit() - c.gain, |(_, f)| f.misfit),
            is_fitted: known.is_some(),
        }
    };
    let explanations: Vec<Explanation> = posterior.candidates.iter().take(200).map(explanation).collect();
    let (verdict, level, set) = decide::decide(&misfit, &posterior, &explanations);
    let best = explanations.first().filter(|_| matches!(verdict, Verdict::Explained | Verdict::CannotTell));
    let members = best.map(|e| e.parts.iter().map(|p| (&p.hypothesis, p.amplitude)).collect::<Vec<_>>());
    let explained = best.and_then(|_| {
        fitted
            .iter()
            .find(|(m, _)| *m == posterior.candidates[0].members)
            .map(|(_, f)| f.values.iter().zip(&mesh).map(|(v, m)| v + m).collect())
    });
    let sets = match &members {
        Some(members) => bench.sets(members)?,
        None => None,
    };
    progress("gain on conditions kept out");
    let gain = gain::gain(problem, &catalogue, &found, &errors, &fitted, &screened, is_wrong);
    let next = if verdict == Verdict::CannotTell || verdict == Verdict::SomethingElse {
        progress("what to measure next");
        advice::next(problem, &explanations[..set.min(explanations.len())], &scales)?
    } else {
        Vec::new()
    };
    Ok(Diagnosis {
        misfit,
        verdict,
        level,
        others: (posterior.nothing, posterior.something_else),
        set,
        tried: (catalogue.len(), screened.visible.len()),
        sheet: Sheet {
            predicted: found.prediction.values.iter().zip(&mesh).map(|(v, m)| v + m).collect(),
            whitened: screened.residual.clone(),
            residual: found.residual.clone(),
        },
        explained,
        gain,
        next,
        sets,
        explanations,
        whitener,
        seconds: clock.elapsed().as_secs_f64(),
    })
}

/// What a mesh of more cells changes in every prediction, K; nothing for logs, whose runs take long.
fn mesh_correction(problem: &Problem, coarse: &[f64]) -> Result<Vec<f64>> {
    if problem.data.is_transient() {
        return Ok(vec![0.0; coarse.len()]);
    }
    let cells = (FINER * problem.study.model.mesh.cells as f64) as usize;
    let fine = Study::new(problem.study.document().clone(), Some(cells))?;
    let values = crate::identify::values(&fine, &problem.data, problem.start)?;
    Ok(values.iter().zip(coarse).map(|(f, c)| f - c).collect())
}

fn screened(residual: &[f64], columns: &[Vec<f64>], whitener: &Whitener, catalogue: &[Hypothesis]) -> Screened {
    use rayon::prelude::*;
    let scaled = |(column, h): (&Vec<f64>, &Hypothesis)| whitener.apply(&column.iter().map(|c| c * h.scale).collect::<Vec<_>>());
    let whitened: Vec<Vec<f64>> = columns.par_iter().zip(catalogue).map(scaled).collect();
    let signed: Vec<bool> = catalogue.iter().map(|h| h.is_signed).collect();
    Screened::new(whitener.apply(residual), &whitened, &signed)
}

fn misfit(screened: &Screened, seed: u64) -> Misfit {
    let (chi2, freedom) = (screened.misfit(), screened.residual.len());
    Misfit { chi2, freedom, probability: crate::identify::chi_square_tail(chi2, freedom), look_elsewhere: screened.look_elsewhere(seed) }
}

/// Fits the most probable candidates through the full solver and puts their evidence in place of the linear one.
fn refit(
    bench: &Bench<'_>,
    catalogue: &[Hypothesis],
    screened: &Screened,
    posterior: &mut Posterior,
    readings: &[f64],
    whitener: &Whitener,
) -> Vec<(Vec<usize>, Fitted)> {
    use rayon::prelude::*;
    let chosen: Vec<Candidate> = posterior
        .candidates
        .iter()
        .take(FINALISTS)
        .enumerate()
        .filter(|(i, c)| *i == 0 || c.probability > LEAST)
        .map(|(_, c)| c.clone())
        .collect();
    let attempt = |c: &Candidate| -> Option<(Vec<usize>, Fitted)> {
        let members: Vec<&Hypothesis> = c.members.iter().map(|j| &catalogue[screened.visible[*j]]).collect();
        let guess: Vec<f64> = c.amplitudes.iter().zip(&members).map(|(a, h)| a * h.scale).collect();
        fit(bench, &members, &guess, readings, whitener).ok().map(|f| (c.members.clone(), f))
    };
    let fitted: Vec<(Vec<usize>, Fitted)> = chosen.par_iter().filter_map(attempt).collect();
    let whole = 0.5 * screened.misfit();
    for (members, f) in &fitted {
        let Some(candidate) = posterior.candidates.iter_mut().find(|c| c.members == *members) else { continue };
        // The prior of the hypothesis stays; its evidence over nothing is the fit's.
        let sides: f64 = members.iter().filter(|j| !screened.signed[**j]).count() as f64 * 2f64.ln();
        let linear = probability::evidence(screened, members);
        candidate.weight += f.evidence + whole + sides - linear;
        candidate.gain = screened.misfit() - f.misfit;
    }
    posterior.normalise();
    fitted
}
