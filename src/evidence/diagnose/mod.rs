//! What the simulation gets wrong, the cause by name, the extended model, and what it gains.
//!
//! ```text
//! data, machine -> residual -> significant? -> catalogue (place x kind x law) -> screen -> pairs -> refit -> probabilities
//!               -> the set that cannot be told apart -> next measurement, extended machine, gain on what was kept out
//! ```
//!
//! The covariance of the residual decides everything: reading noise, each sensor's own error, the errors of every
//! condition, and what any model of such a machine leaves open ([`Discrepancy`]). The machine's numbers that the user calls
//! uncertain join it with their priors, so that a cause is never named for what calibration may still move.

mod advice;
mod catalogue;
mod decide;
mod edits;
mod effect;
mod finalists;
mod gain;
mod history;
mod missing;
mod probability;
mod refine;
mod screen;
mod signature;
mod trial;
mod view;
mod words;

use std::path::Path;
use std::time::Instant;

use crate::error::Result;
use crate::evidence::measurement::{Data, Uncertainty, Whitener, whiten};
use crate::explore::simulate::Start;
use crate::solve::sensitivity::{Parameter, Study};

pub use advice::Next;
pub use catalogue::{Act, Hypothesis, Law, Scales, UserKind, hypotheses};
pub use decide::{Level, Verdict};
pub use gain::Gain;
pub use missing::MissingHeat;
pub use refine::{Bench, Extended, Fitted, fit};
pub use signature::{Signatures, signatures};
pub use trial::Trial;
pub use words::{Shown, sentence};

use finalists::{Finals, Outcome};
use probability::Candidate;
use screen::Screened;
use view::View;

/// Chi-square above the best within which causes count as not refuted: 95 % for two parameters.
const SET_95: f64 = 5.991_465;
/// Half width of a 90 % interval in standard deviations.
const TWO_SIDED_90: f64 = 1.644_854;

/// What any model of such a machine leaves open, as standard deviations of common factors, and its own noise.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Discrepancy {
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

impl Default for Discrepancy {
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
    pub openness: Discrepancy,
    /// The user's own kinds.
    pub user: Vec<UserKind>,
    /// The state logs begin with.
    pub start: Start,
    /// Seed of simulated noise.
    pub seed: u64,
    /// Kinds that are not tried.
    pub without: Vec<String>,
}

impl Problem {
    /// A machine against data of the usual uncertainty: limits of 0.1 K for readings, sensors and water, 0.05 L/min. Every
    /// cause is tried; logs begin in the steady state.
    pub fn new(study: Study, data: Data) -> Self {
        Self {
            uncertainty: Uncertainty::usual(&data, &study.model.machine),
            study,
            data,
            uncertain: Vec::new(),
            openness: Discrepancy::default(),
            user: Vec::new(),
            start: Start::Steady,
            seed: 1,
            without: Vec::new(),
        }
    }

    /// A machine file on about `cells` cells (the file's own number where `None`) against a table of readings, with the
    /// uncertainty that `DATA.toml` beside the table states.
    ///
    /// # Errors
    /// A file cannot be used.
    pub fn read(machine: impl AsRef<Path>, data: impl AsRef<Path>, cells: Option<usize>) -> Result<Self> {
        let data = data.as_ref();
        let study = Study::read(machine.as_ref(), &[], cells)?;
        let table = Data::read(data, &study.model.machine)?;
        let uncertainty = Uncertainty::beside(data, &table, &study.model.machine)?;
        Ok(Self { uncertainty, ..Self::new(study, table) })
    }
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
    /// Which of them the data cannot refute, as indices.
    pub set: Vec<usize>,
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
    /// What each part alone would have to give or take.
    pub missing: Vec<MissingHeat>,
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
    /// Standard deviation of each reading with everything that may be off in it and in its prediction, K.
    pub deviation: Vec<f64>,
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
    let base = View::of(problem, study, &catalogue, &scales)?;
    let screened = base.screen(&catalogue, data);
    let misfit = misfit(&screened, problem.seed);
    let prior = probability::prior(&screened, &catalogue);
    let fronts = history::has_fronts(study, data)?;
    let posterior = probability::posterior(&screened, &prior, !data.is_transient());
    let is_wrong = decide::is_wrong(&misfit);
    let predicted = &base.found.prediction.values;
    let bench =
        Bench { study, data, predicted, fields: &base.found.fields, start: problem.start, scales: &scales, user: &problem.user, fronts };
    let sheet = Sheet {
        predicted: predicted.iter().zip(&base.mesh).map(|(v, m)| v + m).collect(),
        whitened: screened.residual.clone(),
        deviation: base.errors.marginal(),
        residual: base.found.residual.clone(),
    };
    let finals = Finals {
        problem,
        bench: &bench,
        catalogue: &catalogue,
        base: &base,
        screened: &screened,
        prior: &prior,
        places: whiten::places(data),
    };
    let Outcome { posterior, fitted, screened: weighed, mesh } = match is_wrong {
        true => finals.fit(posterior, progress)?,
        false => Outcome { posterior, fitted: Vec::new(), screened: screened.clone(), mesh: base.mesh.clone() },
    };
    let explanation = |c: &Candidate| -> Explanation {
        let known = fitted.iter().find(|(members, _)| *members == c.members);
        let linear = weighed.deviations(&c.members);
        let parts = c.members.iter().enumerate().map(|(i, j)| {
            let hypothesis = catalogue[screened.visible[*j]].clone();
            let linear = linear[i] * hypothesis.scale;
            let (amplitude, deviation) = match known {
                Some((_, f)) => (f.amplitudes[i], f.deviations[i]),
                None => (c.amplitudes[i] * hypothesis.scale, linear),
            };
            Part { hypothesis, amplitude, deviation }
        });
        Explanation {
            parts: parts.collect(),
            probability: c.probability,
            misfit: known.map_or(weighed.misfit() - c.gain, |(_, f)| f.misfit),
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
        Some(members) => bench.extended(members)?.map(|extended| extended.sets),
        None => None,
    };
    progress("gain on conditions kept out");
    let gain = gain::gain(problem, &bench, &catalogue, &base, best.is_some());
    let next = if verdict == Verdict::CannotTell || verdict == Verdict::SomethingElse {
        progress("what to measure next");
        advice::next(&bench, problem, verdict, &set.iter().map(|i| &explanations[*i]).collect::<Vec<_>>())?
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
        sheet,
        explained,
        gain,
        next,
        missing: missing::missing(&screened, &catalogue),
        sets,
        explanations,
        whitener: base.whitener,
        seconds: clock.elapsed().as_secs_f64(),
    })
}

fn misfit(screened: &Screened, seed: u64) -> Misfit {
    Misfit { look_elsewhere: screened.look_elsewhere(seed), ..of_the_whole(screened) }
}

fn of_the_whole(screened: &Screened) -> Misfit {
    let (chi2, freedom) = (screened.misfit(), screened.residual.len());
    Misfit { chi2, freedom, probability: crate::evidence::identify::chi_square_tail(chi2, freedom), look_elsewhere: 1.0 }
}

/// Whether a screen raises the alarm; noise is simulated only where the misfit of the whole does not.
fn is_wrong(screened: &Screened, seed: u64) -> bool {
    decide::is_wrong(&of_the_whole(screened)) || decide::is_wrong(&misfit(screened, seed))
}
