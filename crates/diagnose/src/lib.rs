//! Errors of the simulation, their causes by name, the extended model, and its gain.
//!
//! ```text
//! data, machine -> places and kinds with free amplitudes -> evidence -> sets -> laws -> posterior
//!               -> verdict, extended machine, gain on rows kept out, next measurement
//! ```
//!
//! A cause is a place and a kind. Its amplitude is free in every condition, so that all sensors together decide the place whatever law governs
//! it ([`amplitude`]); the law follows from the amplitudes. Reading noise, each sensor's own error, the errors of every condition, a spread of
//! all numbers of the machine file and a heat in every part are in every hypothesis, "nothing" included.

#![forbid(unsafe_code)]
#![warn(missing_docs)]
#![cfg_attr(not(test), warn(clippy::unwrap_used, clippy::panic))]

mod amplitude;
mod answer;
mod attached;
mod decide;
mod effects;
mod follow;
mod gain;
mod history;
mod in_force;
mod low_rank;
mod missing;
mod next;
mod open_numbers;
mod overstated;
mod plan;
mod predictor;
mod signature;
mod stated;
mod triangular;
mod view;
mod when;

use std::path::Path;
use std::sync::Arc;

use coldplate_base::document::Document;
use coldplate_base::error::Result;
use coldplate_base::numbers::{TWO_SIDED_90, significant};
use coldplate_base::progress::Progress;
use coldplate_describe::machine::DescribedVariable;
use coldplate_evidence::faulty_readings::{Cleared, Fault, FaultKind, cleared, kept, rest};
use coldplate_evidence::identify::Runs;
use coldplate_evidence::measurement::{Data, DividedData, MOST_READINGS, MeasurementUncertainty, VariableUncertainty, Whitener, thinned};
use coldplate_explore::simulate::Start;
use coldplate_solve::sensitivity::UncertainNumber;
use coldplate_solve::study::{MachineParameter, Study};

pub use amplitude::{AmplitudeSettings, Aside, Looseness, PlaceAndKind, PlaceSet, Places, Way, places};
use amplitude::{Beside, KeptOut};
pub use answer::{LeftOut, Rung, WhereLeft, diagnose};
pub use decide::{Certainty, Level, Verdict};
pub use effects::{
    Axis, CommonFactor, Course, Effect, FoundLaw, Hypothesis, Law, LawForm, LawNumber, Scales, Sequence, Shown, UserKind, hypotheses,
    sentence, under_rarer_laws,
};
pub use effects::{Common, Contact, Flow, Heat, Leak, Material, Radiation, Sensor, Storage, User, Variable};
pub use gain::{Gain, HeldOutReading};
pub use missing::MissingHeat;
pub use next::{Costs, Expected, ExtraSensor, Next, Trial, Worth};
pub use plan::{Detectable, FurtherSensor, Plan, plan, planned_conditions};
pub use predictor::{Extended, Predictor};
pub use signature::Signatures;
use when::Added;

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
    /// Constants that decide the answer.
    pub settings: AmplitudeSettings,
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
            settings: AmplitudeSettings::default(),
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

    /// The same without faulty readings of logs, or without copies of rows of a table, which are named in [`Problem::faults`]. Of a table every
    /// hypothesis says by itself which readings are wrong ([`PlaceSet::aside`]).
    ///
    /// # Errors
    /// As [`cleared`].
    pub fn cleared(self) -> Result<Self> {
        let Cleared { mut data, mut faults, .. } = cleared(&self.study, &self.data, &self.uncertainty, self.start)?;
        if !self.data.is_transient() {
            faults.retain(|fault| fault.kind == FaultKind::DuplicateRow);
            data = rest(&self.data, &faults);
        }
        let places = kept(&self.data, &faults);
        Ok(Self { data, faults, places, ..self })
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

    /// The same with logs that begin in the steady state, where their first readings do not contradict it; else so or at the first readings of
    /// each part, whichever makes what follows these more probable beside the best single cause, or none.
    ///
    /// # Errors
    /// The machine as it is cannot be solved at the data's conditions.
    pub fn begun(self, progress: &dyn Progress) -> Result<Self> {
        if !self.data.is_transient() {
            return Ok(self);
        }
        progress.say("the state that the logs begin with");
        let thin = Self { data: thinned(&self.data, MOST_READINGS), ..self.clone() };
        let steady = Self { start: Start::Steady, ..thin.clone() };
        let steady = Beside::of(&steady)?;
        if steady.chance_of_firsts() >= self.settings.alarm {
            return Ok(self);
        }
        let begun = Self { start: Start::Parts, ..thin };
        let Ok(begun) = Beside::of(&begun) else { return Ok(self) };
        let is_begun = begun.best_single(&self.settings) > steady.best_single(&self.settings);
        let start = if is_begun { Start::Parts } else { Start::Steady };
        Ok(Self { start, ..self })
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
    /// Posterior probability that no cause of the catalogue acts.
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
}

/// An explanation: causes under laws.
#[derive(Debug, Clone, PartialEq)]
pub struct Explanation {
    /// Its causes.
    pub causes: Vec<Cause>,
    /// Its probability.
    pub probability: f64,
    /// Misfit left, under the covariance beside it; not a number of those far behind.
    pub misfit: f64,
    /// What the model leaves open beside it.
    pub level: Looseness,
    /// Whether the machine file has words for it.
    pub is_writable: bool,
    /// Predictions of each row from all others; none of an explanation that is far behind.
    pub(crate) kept_out: Option<Arc<KeptOut>>,
    /// Set of places that it is of, as an index into [`Places::sets`].
    pub of: usize,
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
    /// Those large enough to show in these data, each fitted to the end.
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
    /// The machine that is written: its causes, their share of the misfit, and what is left. None where nothing is added.
    pub rungs: Vec<Rung>,
    /// The noise that was found over what is stated, where readings of a table show that it is far smaller; one everywhere else.
    pub noise_share: f64,
    /// What the machine as it is leaves open.
    pub unexplained: Looseness,
    /// Whether the machine with the best explanation misses the very data by more than the machine as it is: it is not written.
    pub misses: bool,
    /// Whether causes fit, but predict data kept out no better than the machine as it is.
    pub is_vetoed: bool,
    /// Places and kinds by their amplitudes in every row, as sets with laws.
    pub places: Places,
    /// The covariance that was used.
    pub whitener: Whitener,
    /// Of a table on the reduced model, the largest difference of the end result's predictions from those of full solves, K: of the
    /// machine with what is named, or as it is.
    pub off_in_full: Option<f64>,
    /// Seconds it took.
    pub seconds: f64,
}

impl Diagnosis {
    /// Parts of the data that the answer calls grossly wrong: those of the most probable explanation where causes are named, else of none.
    pub fn aside(&self) -> &[Aside] {
        let best = self.explanations.first().filter(|_| self.verdict.names_causes()).and_then(|best| self.places.sets.get(best.of));
        let set = best.or_else(|| self.places.sets.iter().find(|set| set.members.is_empty()));
        set.map_or(&[], |set| &set.aside)
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
    signature::steady(study, data, Some(uncertain), hypotheses, (scales, user), None)
}
