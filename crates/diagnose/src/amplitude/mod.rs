//! The amplitude first: causes as places and kinds whose size is free in every condition.
//!
//! A hypothesis says where and of which kind a cause is, not by which law it acts. All readings of a condition together decide whether a place
//! and a kind fit, whatever law governs them; the amplitudes that come out are the law, as a curve. In logs an amplitude is a mean, a law of the
//! columns of the table, and a smooth curve in time.

mod beside;
mod choices;
mod course;
mod evidence;
mod force;
mod gross;
mod kept_out;
mod laws;
mod logs;
mod others;
mod profiles;
mod ranking;
mod relaxation;
mod response;
mod rows;
mod search;
mod sets;
mod settings;
mod sizing;
mod steady;
mod ways;
mod wrong;

use std::sync::Arc;

use super::effects::{Hypothesis, Scales};
use super::{Cause, Problem};
use coldplate_base::error::Result;
use coldplate_base::progress::Progress;

pub(crate) use beside::Beside;
pub(crate) use force::{Acting, Courses, runs};
pub use gross::Aside;
pub(crate) use kept_out::KeptOut;
pub use rows::Looseness;
pub(crate) use rows::{Errors, Rows};
pub use settings::AmplitudeSettings;

/// One place and kind with the amplitude that each condition asks for.
#[derive(Debug, Clone)]
pub struct PlaceAndKind {
    /// Which.
    pub hypothesis: Hypothesis,
    /// Amplitude in each row with readings, in the hypothesis' unit.
    pub amplitudes: Vec<f64>,
    /// Standard deviation of the amplitude in each row, in the hypothesis' unit.
    pub deviations: Vec<f64>,
    /// Whether every row may have its own.
    pub is_free: bool,
    /// The variables over which it runs, if it does, joined by `, `: `row` is the order of the rows of a table, `time` what has passed in each
    /// test of a log.
    pub over: Option<String>,
}

/// One way in which a set of places and kinds acts: each under a law.
#[derive(Debug, Clone)]
pub struct Way {
    /// One cause for each member of the set, in its order.
    pub causes: Vec<Cause>,
    /// Probability among all ways of the set.
    pub probability: f64,
    /// Whether the machine file has words for it.
    pub is_writable: bool,
    /// Predictions of each row from all others; none of a way that is far behind.
    pub(crate) kept_out: Option<Arc<KeptOut>>,
}

/// A set of places and kinds.
#[derive(Debug, Clone)]
pub struct PlaceSet {
    /// Places and kinds in the set; the machine as it is has none.
    pub members: Vec<PlaceAndKind>,
    /// Ways in which it acts, most probable first.
    pub ways: Vec<Way>,
    /// Logarithm of the evidence over that of the machine as it is.
    pub lead: f64,
    /// Posterior probability among all sets that were fitted.
    pub probability: f64,
    /// Logarithm of the density of each row given all others, over that of the machine as it is, summed; and its standard error.
    pub kept_out: (f64, f64),
    /// What the model leaves open beside it.
    pub looseness: Looseness,
    /// Logarithm of the evidence over that where the model leaves no more open than is usual.
    pub lead_over_usual: f64,
    /// Readings that it calls grossly wrong, and of a table rows, sensors and conditions.
    pub aside: Vec<Aside>,
    /// Covariance of the readings about the machine with it in force.
    pub(crate) errors: Arc<Errors>,
}

/// Places and kinds that readings ask for.
#[derive(Debug, Clone)]
pub struct Places {
    /// Sets, most probable first.
    pub sets: Vec<PlaceSet>,
    /// Places and kinds that were tried, each fitted to the end.
    pub tried: usize,
    /// Causes among them that were followed by their slope alone, however large they are: of a machine of cells all but the best.
    pub by_slope: usize,
    /// Where the laws of its ways are one.
    pub scales: Scales,
}

/// Finds the places and kinds that steady tables or logs ask for.
///
/// # Errors
/// The machine as it is cannot be solved at the data's conditions.
pub fn places(problem: &Problem, settings: &AmplitudeSettings, progress: &dyn Progress) -> Result<Places> {
    Ok(Beside::of(problem)?.places(settings, progress))
}
