//! What the simulation gets wrong, the cause by name, the extended model, and what it gains.
//!
//! ```text
//! data, machine -> residual -> significant? -> catalogue (place x kind x law) -> screen -> pairs -> refit -> probabilities
//!               -> the set that cannot be told apart -> next measurement, extended machine, gain on what was kept out
//! ```
//!
//! Everything is judged by the covariance of the residual: reading noise, each sensor's own error, the errors of every
//! condition, and the discrepancy of any such model ([`Discrepancy`]). Numbers of the machine that the user calls uncertain
//! join it with their priors. So no cause is named for what calibration may still move.

#![forbid(unsafe_code)]
#![warn(missing_docs)]
#![cfg_attr(not(test), warn(clippy::unwrap_used, clippy::panic))]

mod amplitude;
mod attached;
mod calibrated;
mod choice;
mod decide;
mod effects;
mod extension;
mod faults;
mod finalists;
mod fits;
mod follow;
mod gain;
mod history;
mod inexact;
mod joint;
mod ladder;
mod missing;
mod next;
mod numbers;
mod overstated;
mod predictor;
mod probability;
mod rarer;
mod refine;
mod rung;
mod screen;
mod shared;
mod signature;
mod stated;
mod synonyms;
mod view;
mod when;

use std::path::Path;

use faults::by_catalogue;

use coldplate_base::document::Document;
use coldplate_base::error::Result;
use coldplate_base::numbers::{TWO_SIDED_90, significant};
use coldplate_base::progress::Progress;
use coldplate_describe::machine::DescribedVariable;
use coldplate_evidence::discrepancy;
use coldplate_evidence::faulty_readings::{Cleared, Fault, cleared, kept, rest};
use coldplate_evidence::identify::{Runs, chi_square_tail};
use coldplate_evidence::measurement::{Data, DividedData, MOST_READINGS, MeasurementUncertainty, VariableUncertainty, Whitener, thinned};
use coldplate_explore::simulate::Start;
use coldplate_solve::sensitivity::UncertainNumber;
use coldplate_solve::study::{MachineParameter, Study};

pub use amplitude::{AmplitudeSettings, PlaceAndKind, PlaceSet, Places, places};
pub use decide::{ALARM_CAUSE, ALARM_MISFIT, Certainty, Level, Verdict};
pub use effects::{Common, Contact, Flow, Heat, Leak, Material, Radiation, Sensor, Storage, User};
pub use effects::{
    CommonFactor, Effect, Hypothesis, Law, LawForm, LawNumber, Scales, Shown, UserKind, hypotheses, sentence, under_rarer_laws,
};
pub use gain::{Gain, HeldOutReading};
pub use ladder::{diagnose, settled};
pub use missing::MissingHeat;
pub use next::{Costs, Expected, ExtraSensor, Next, Trial, Worth};
pub use predictor::{Extended, Predictor};
pub use refine::{Fitted, fit};
pub use rung::{Rung, WhereLeft};
pub use screen::SIMULATIONS;
pub use signature::Signatures;
use when::Added;

/// Chi-square above the best within which causes count as not refuted: 95 % for two parameters.
pub const SET_95: f64 = 5.991_465;
/// A misfit that is more probable than this is noise: it needs no further explanation.
const NOISE: f64 = 0.01;
/// Share of the readings of a table that may be wrong.
const WRONG: f64 = 0.25;
/// Explanations that are kept.
const MOST_EXPLANATIONS: usize = 200;

/// The discrepancy of any model of such a machine: standard deviations of factors that many effects share, and its own noise.
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

/// What is to be diagnosed: [`Problem::new`], then whatever differs from the usual.
#[derive(Debug, Clone)]
pub struct Problem {
    /// The machine as its file has it.
    pub study: Study,
    /// What was measured.
    pub data: Data,
    /// Standard deviations of readings and conditions.
    pub uncertainty: MeasurementUncertainty,
    /// Numbers of the file that are uncertain; see [`Study::uncertain`] for those that the file states.
    pub uncertain: Vec<UncertainNumber>,
    /// The model's own discrepancy.
    pub discrepancy: Discrepancy,
    /// The user's own kinds.
    pub user: Vec<UserKind>,
    /// The state logs begin with.
    pub start: Start,
    /// Seed of simulated noise.
    pub seed: u64,
    /// Kinds that are not tried.
    pub without: Vec<String>,
    /// What further tests and sensors cost.
    pub costs: Costs,
    /// Faulty readings that were found in the data; see [`Problem::cleared`].
    pub faults: Vec<Fault>,
    /// Whether readings of a table may be set aside that the catalogue alone can tell from a cause; see [`settled`].
    pub may_set_aside: bool,
    /// The noise that the residual shows over what is stated, where that is far too large; one everywhere else.
    noise_share: f64,
    /// The machine file as it was before [`Problem::timed`], and the variables that this added.
    given: Option<Document>,
    added: Vec<Added>,
    /// Where each row of the data stood in the table that was cleared; nothing before.
    places: Vec<usize>,
}

impl Problem {
    /// How its logs are run.
    pub fn runs(&self) -> Runs {
        Runs::beside(&self.study, &self.uncertainty.noise, self.start)
    }

    /// A machine against data of the usual uncertainty: limits of 0.1 K for readings, sensors and water, 0.05 L/min. Every
    /// cause is tried; logs begin in the steady state.
    pub fn new(study: Study, data: Data) -> Self {
        Self {
            uncertainty: MeasurementUncertainty::usual(&data, &study.model.machine),
            study,
            data,
            uncertain: Vec::new(),
            discrepancy: Discrepancy::default(),
            user: Vec::new(),
            start: Start::Steady,
            seed: 1,
            without: Vec::new(),
            costs: Costs::default(),
            faults: Vec::new(),
            may_set_aside: false,
            noise_share: 1.0,
            given: None,
            added: Vec::new(),
            places: Vec::new(),
        }
    }

    /// The same with reading noise that is a share of what is stated.
    fn with_noise(&self, share: f64, progress: &dyn Progress) -> Self {
        progress.say(&format!("readings scatter by {} % of the noise that is stated: again with that", significant(100.0 * share, 2)));
        let mut uncertainty = self.uncertainty.clone();
        let model = self.discrepancy.model.hypot(uncertainty.model);
        uncertainty.noise.iter_mut().for_each(|noise| {
            // The model's own errors are no smaller.
            let left = share * noise.hypot(model);
            *noise = (left * left - model * model).max(0.0).sqrt().max(overstated::LEAST * share * *noise);
        });
        Self { uncertainty, noise_share: share, ..self.clone() }
    }

    /// The same without faulty readings, which are named in [`Problem::faults`]. What stands out of a table by itself, and may be the
    /// machine's, is judged by the catalogue.
    ///
    /// # Errors
    /// As [`cleared`].
    pub fn cleared(self) -> Result<Self> {
        let found = cleared(&self.study, &self.data, &self.uncertainty, self.start)?;
        let Cleared { data, faults, .. } = if found.suspects.is_empty() { found } else { by_catalogue::judged(&self, found)? };
        let places = kept(&self.data, &faults);
        Ok(Self { data, faults, places, may_set_aside: true, ..self })
    }

    /// The same without further faulty readings of its data, which are named by their places in the table that was cleared.
    pub fn without(&self, faults: &[Fault]) -> Self {
        let mut faults = faults.to_vec();
        faults.iter_mut().for_each(|fault| fault.is_left_out = true);
        let at = |r: usize| self.places.get(r).copied().unwrap_or(r);
        let places = kept(&self.data, &faults).into_iter().map(at).collect();
        let mut all = self.faults.clone();
        all.extend(faults.iter().map(|fault| fault.moved(&self.places)));
        all.sort_by_key(|fault| *fault.rows.start());
        Self { data: rest(&self.data, &faults), faults: all, places, may_set_aside: false, ..self.clone() }
    }

    /// This problem without readings that are held out ([`DividedData::held_out`]), and the data with them.
    ///
    /// # Errors
    /// Errors of [`DividedData::held_out`].
    pub fn holding_out(self, texts: &[String]) -> Result<(Self, DividedData)> {
        let divided = DividedData::held_out(&self.data, texts)?;
        let places = divided.kept.iter().map(|r| self.places.get(*r).copied().unwrap_or(*r)).collect();
        Ok((Self { data: divided.fitted.clone(), places, ..self }, divided))
    }

    /// The same with logs thinned to about [`MOST_READINGS`].
    pub fn thinned(self) -> Self {
        Self { data: thinned(&self.data, MOST_READINGS), ..self }
    }

    /// The same in which formulas of the machine may say when a cause acts: at which times of logs, in which tests, on the way up or down.
    /// What the machine file declares itself stays as it is.
    ///
    /// # Errors
    /// The machine cannot be read again.
    pub fn timed(self) -> Result<Self> {
        let given = &self.study.model.machine.variables;
        let added = Added::all(&self.data, given);
        if added.is_empty() {
            return Ok(self);
        }
        let study = self.study.edited(&Added::lines(&added, self.study.document())?)?;
        let mut uncertainty = self.uncertainty;
        let before = |v: &DescribedVariable| given.iter().position(|own| own.name == v.name);
        let of = |v: &DescribedVariable| before(v).and_then(|v| uncertainty.variables.get(v).copied()).unwrap_or_default();
        uncertainty.variables = study.model.machine.variables.iter().map(of).collect::<Vec<VariableUncertainty>>();
        let data = Added::fill(self.data, given, &study.model.machine.variables, &added);
        let given = Some(self.study.document().clone());
        Ok(Self { study, data, uncertainty, given, added, ..self })
    }

    /// Other data of the machine as it was given, in the variables that [`Problem::timed`] leaves: their tests are none of those of the
    /// problem's own data.
    pub fn unseen(&self, data: Data) -> Data {
        let all = &self.study.model.machine.variables;
        let given: Vec<DescribedVariable> = all.iter().filter(|v| self.states(&v.name)).cloned().collect();
        let added: Vec<Added> = Added::all(&data, &given).into_iter().filter(|added| !added.is_test_number()).collect();
        Added::fill(data, &given, all, &added)
    }

    /// Whether the machine file has a variable; [`Problem::timed`] adds others.
    pub fn states(&self, variable: &str) -> bool {
        self.added.iter().all(|added| added.name != variable)
    }

    /// The machine file as it was given.
    pub fn machine_file(&self) -> &Document {
        self.given.as_ref().unwrap_or_else(|| self.study.document())
    }

    /// The machine file that some lines are written into: what says when a cause acts is declared in it where they name it.
    ///
    /// # Errors
    /// A declaration cannot be added.
    pub fn document(&self, lines: &[(String, String)]) -> Result<Document> {
        let mut document = self.machine_file().clone();
        let named: Vec<Added> = self.added.iter().filter(|added| added.is_named(lines)).cloned().collect();
        for (key, value) in Added::lines(&named, &document)? {
            document.apply_set(&key, &value)?;
        }
        Ok(document)
    }

    /// A machine file on about `cells` cells (the file's own number where `None`) against a table of readings, with the
    /// uncertainty that `DATA.toml` beside the table states, and the machine file of its numbers.
    ///
    /// # Errors
    /// A file cannot be used.
    pub fn read(machine: impl AsRef<Path>, data: impl AsRef<Path>, cells: Option<usize>) -> Result<Self> {
        let data = data.as_ref();
        let study = Study::read(machine.as_ref(), &[], cells)?;
        let table = Data::read(data, &study.model.machine)?;
        let uncertainty = MeasurementUncertainty::beside(data, &table, &study.model.machine)?;
        Ok(Self { uncertainty, uncertain: study.uncertain()?, ..Self::new(study, table) })
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
pub struct Cause {
    /// Which.
    pub hypothesis: Hypothesis,
    /// Its amplitude, in the hypothesis' unit.
    pub amplitude: f64,
    /// Its standard deviation, as the readings leave it open.
    pub deviation: f64,
    /// Of a path, what it hangs on where in a part it is attached: a standard deviation, as a share of the amplitude. The machine that is
    /// written has it at the faces of the part alike, and what that predicts does not hang on it.
    pub of_place: f64,
}

impl Cause {
    /// A cause that acts on a part as a whole.
    pub fn new(hypothesis: Hypothesis, amplitude: f64, deviation: f64) -> Self {
        Self { hypothesis, amplitude, deviation, of_place: 0.0 }
    }

    /// 90 % interval of the amplitude, wherever it is attached.
    pub fn interval(&self) -> (f64, f64) {
        let half = TWO_SIDED_90 * self.deviation.hypot(self.of_place * self.amplitude);
        let (low, high) = (self.amplitude - half, self.amplitude + half);
        (if self.hypothesis.is_signed { low } else { low.max(0.0) }, high)
    }

    /// Widens the deviation to at least another one, in the hypothesis' unit.
    fn at_least(&mut self, deviation: f64) {
        self.deviation = self.deviation.max(deviation);
    }
}

/// An explanation: one cause, or two together.
#[derive(Debug, Clone, PartialEq)]
pub struct Explanation {
    /// Its causes.
    pub causes: Vec<Cause>,
    /// Its probability.
    pub probability: f64,
    /// Misfit left, under its own discrepancy.
    pub misfit: f64,
    /// Minus twice the logarithm of its likelihood and of the prior of its discrepancy: what explanations are compared by.
    pub deviance: f64,
    /// The discrepancy that is left beside it.
    pub level: discrepancy::DiscrepancySize,
    /// Whether it was fitted through the full solver.
    pub is_fitted: bool,
    /// Other names of its causes, which predict the same at every condition.
    pub synonyms: Vec<Synonym>,
}

/// A cause of an explanation under another name.
#[derive(Debug, Clone, PartialEq)]
pub struct Synonym {
    /// Which cause of the explanation.
    pub of: usize,
    /// What else it may be called.
    pub cause: Cause,
}

/// Probabilities of what is no cause of the catalogue.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Others {
    /// Nothing is wrong.
    pub nothing: f64,
    /// Something else is.
    pub something_else: f64,
}

/// Numbers of hypotheses.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Tried {
    /// In the catalogue of this machine.
    pub all: usize,
    /// Large enough to show in these data.
    pub visible: usize,
}

impl Tried {
    /// Both numbers, as every output states them.
    pub fn sentence(&self) -> String {
        format!("{} causes that could show ({} tried)", self.visible, self.all)
    }
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
    /// Of the best explanation, the probability of its places, of its kinds there, and of its laws; empty where no cause is named.
    pub certainties: Vec<Level>,
    /// Probabilities of what is no cause of the catalogue.
    pub others: Others,
    /// Explanations, most probable first.
    pub explanations: Vec<Explanation>,
    /// Which of them the data cannot refute, as indices.
    pub set: Vec<usize>,
    /// How many hypotheses were tried.
    pub tried: Tried,
    /// Predictions of the machine as it is, residuals (K) and whitened residuals.
    pub residuals: Residuals,
    /// Predictions of the machine that is written, K.
    pub explained: Option<Vec<f64>>,
    /// Gain on conditions kept out of the selection; none with fewer than three.
    pub gain: Option<Gain>,
    /// What to measure next where the answer is open.
    pub next: Vec<Next>,
    /// What each part alone would have to give or take.
    pub missing: Vec<MissingHeat>,
    /// Lines of the machine file that make every rung true.
    pub sets: Option<Vec<(String, String)>>,
    /// Whether causes would be named for certain were all numbers of the machine file exact; they are not beside numbers that are all off by
    /// a few per cent.
    pub is_open_by_numbers: bool,
    /// The causes that the data carry, one after another, each with what it explains and what is left.
    pub rungs: Vec<Rung>,
    /// The noise that was found over what is stated, where readings of a table show that it is far smaller; one everywhere else.
    pub noise_share: f64,
    /// The discrepancy of the machine as it is.
    pub unexplained: discrepancy::DiscrepancySize,
    /// Whether the machine with the best explanation missed the very data by more than the machine as it is: it is not written.
    pub misses: bool,
    /// Whether causes fit, but predict data kept out no better than the machine as it is.
    pub is_vetoed: bool,
    /// Readings and rows of a table without which causes explain the rest to first order, rows counted in the problem's data; none where
    /// causes explain all of it.
    pub aside: Vec<Fault>,
    /// The covariance that was used.
    pub whitener: Whitener,
    /// Of a table on the reduced model, the largest difference of the end result's predictions from those of full solves, K: of the
    /// machine with what is named, or as it is.
    pub off_in_full: Option<f64>,
    /// Seconds it took.
    pub seconds: f64,
}

impl Diagnosis {
    /// Whether what is left needs no further explanation, but for a usual discrepancy.
    fn leaves_noise(&self, is_log: bool) -> bool {
        match self.verdict {
            Verdict::Consistent => true,
            Verdict::SomethingElse => false,
            Verdict::Explained | Verdict::CannotTell => self.explanations.first().is_some_and(|best| {
                let freedom = self.misfit.freedom.saturating_sub(best.causes.len());
                best.level.is_usual(is_log) && freedom > 0 && chi_square_tail(best.misfit, freedom) > NOISE
            }),
        }
    }

    /// Whether the only rung has no cause: numbers of the file as the readings draw them, which predict data kept out better for certain.
    pub fn is_calibrated(&self) -> bool {
        self.rungs.first().is_some_and(|rung| rung.causes.is_empty())
    }
}

/// Residuals, reading by reading.
#[derive(Debug, Clone, PartialEq)]
pub struct Residuals {
    /// Predictions, K.
    pub predicted: Vec<f64>,
    /// Readings less predictions, K.
    pub residual: Vec<f64>,
    /// The same whitened.
    pub whitened: Vec<f64>,
    /// Standard deviation of each reading with everything that may be off in it and in its prediction, K.
    pub deviation: Vec<f64>,
}

/// What each hypothesis would do to every reading, to first order, beside the predictions of the machine as it is.
///
/// # Errors
/// The machine as it is cannot be solved at the data's conditions.
pub fn signatures(
    study: &Study,
    data: &Data,
    runs: impl Into<Runs>,
    uncertain: &[MachineParameter],
    hypotheses: &[Hypothesis],
    scales: &Scales,
    user: &[UserKind],
) -> Result<Signatures> {
    if data.is_transient() {
        return history::Logs { study, data, runs: runs.into(), scales, user }.signatures(uncertain, hypotheses, None);
    }
    signature::steady(study, data, uncertain, hypotheses, (scales, user), None)
}
