//! How a schedule is run.

use std::path::PathBuf;
use std::time::Duration;

use super::{PlaceStart, Start, Watch};
use crate::solve::transient::BALANCE;

/// How to run.
#[derive(Debug, Clone, PartialEq)]
pub struct SimulateOptions {
    /// The state at the beginning.
    pub start: Start,
    /// What begins otherwise; before the machine file's own `start` of parts and nodes, which counts where both speak.
    pub places: Vec<PlaceStart>,
    /// Outputs this far apart, s, beside those at the rows of the schedule; `None`: about 200 of them, unless the
    /// schedule has as many rows itself.
    pub every: Option<f64>,
    /// Error allowed in each time step, K.
    pub tolerance: f64,
    /// Share of the heat that a time step may leave open.
    pub balance: f64,
    /// Only what is read at the outputs counts, not when something settles or passes between them: what can be solved exactly from
    /// one to the next is.
    pub only_outputs: bool,
    /// Temperatures at the outputs alone are wanted, of a run that no checkpoint interrupts: steps go on across rows at which no
    /// condition jumps, and neither a steady state at the end nor what settles, boils or flows through meters is looked for.
    pub only_temperatures: bool,
    /// Ends of the time steps to take, s, ascending; none: the tolerance decides.
    pub steps: Vec<f64>,
    /// Temperatures of sensors' places that are waited for.
    pub watched: Vec<Watch>,
    /// A sensor has settled when it stays this near to its steady reading, K.
    pub within: f64,
    /// File to write the state to now and then.
    pub checkpoint: Option<PathBuf>,
    /// Least time on the clock between two such writings.
    pub checkpoint_every: Duration,
    /// Go on from that file, if it is there.
    pub resume: bool,
}

impl Default for SimulateOptions {
    fn default() -> Self {
        Self {
            start: Start::Steady,
            places: Vec::new(),
            every: None,
            tolerance: 0.01,
            balance: BALANCE,
            only_outputs: false,
            only_temperatures: false,
            steps: Vec::new(),
            watched: Vec::new(),
            within: 0.5,
            checkpoint: None,
            checkpoint_every: Duration::from_secs(5),
            resume: false,
        }
    }
}
