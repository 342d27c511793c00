//! Options of a run of a schedule.

use std::path::PathBuf;
use std::time::Duration;

use super::{PlaceStart, Start, Watch};
use coldplate_solve::transient::BALANCE;

/// Options of a run.
#[derive(Debug, Clone, PartialEq)]
pub struct SimulateOptions {
    /// The state at the beginning.
    pub start: Start,
    /// Places with another initial temperature. The machine file's own `start` of parts and nodes has precedence.
    pub places: Vec<PlaceStart>,
    /// Distance of the outputs, s, beside those at the rows of the schedule. `None`: about 200 outputs, unless the schedule has
    /// as many rows itself.
    pub every: Option<f64>,
    /// Error allowed in each time step, K.
    pub tolerance: f64,
    /// Share of the heat that a time step may leave open.
    pub balance: f64,
    /// Only readings at the outputs count, not settling or passing between them. A machine that can be solved exactly from one
    /// output to the next is solved so.
    pub only_outputs: bool,
    /// Only temperatures at the outputs count, in a run that no checkpoint interrupts. Steps then go on across rows at which no
    /// condition jumps. Neither a steady state at the end nor settling, boiling or heat flows through meters are looked for.
    pub only_temperatures: bool,
    /// Ends of the time steps to take, s, ascending; if empty, the tolerance decides.
    pub steps: Vec<f64>,
    /// Temperatures of sensors' places whose passing is watched.
    pub watched: Vec<Watch>,
    /// Largest distance of a settled sensor from its steady reading, K.
    pub within: f64,
    /// File to write the state to now and then.
    pub checkpoint: Option<PathBuf>,
    /// Least time on the clock between two such writings.
    pub checkpoint_every: Duration,
    /// Whether to go on from the file `checkpoint`, if it is there.
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
