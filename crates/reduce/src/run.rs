//! A reduced model over time, each reading with a bound.

use nalgebra::DVector;

use super::integrator::{Motion, Output, Path};
use super::model::ReducedModel;
use super::reduced_network::ReducedNetwork;
use coldplate_base::error::{Error, Result};
use coldplate_describe::machine::Condition;
use coldplate_network::{Corners, Load};

/// Error allowed in a time step of the coarser and of the finer network, K. Chosen: different, so that the difference
/// of the two networks, which the bound is made of, shows errors of the steps too.
const TOLERANCES: [f64; 2] = [0.004, 0.001];

/// The state at the beginning.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Beginning {
    /// The steady state of the first condition.
    Steady,
    /// One temperature everywhere, K.
    Uniform(f64),
}

/// A stretch of time with a smooth condition.
pub struct ConditionStretch<'s> {
    /// End of the stretch, s; it begins at the end of the one before.
    pub until: f64,
    /// The condition at a time, s.
    pub condition: Box<dyn Fn(f64) -> Condition + Sync + 's>,
    /// If a step follows this stretch: the condition after it, which inlet sensors show at once.
    pub at_end: Option<Condition>,
    /// Ascending times at which readings are taken, s, after the beginning of the stretch and not after its end.
    pub outputs: Vec<f64>,
}

/// Readings over time.
#[derive(Debug, Clone)]
pub struct ReducedHistory {
    /// Readings of all sensors at the beginning and at every output, K, from the finer network.
    pub readings: Vec<Vec<f64>>,
    /// Readings of the coarser network at the beginning and at every output, K, which the bound is made of.
    pub coarser: Vec<Vec<f64>>,
    /// Amplitudes of the finer network's modes at the beginning and at every output, K.
    pub amplitudes: Vec<DVector<f64>>,
    /// Readings of the finer network at the beginning of each stretch and at the end of every step in it, under the condition there:
    /// between two steps a reading can be followed.
    pub path: Vec<Path>,
    /// Time steps of both networks.
    pub steps: usize,
}

/// One network over time.
struct OfLevel {
    outputs: Vec<Output>,
    path: Vec<Path>,
    steps: usize,
}

impl ReducedModel {
    /// Readings over stretches of time that begin at `from` (s), with the file's values of all parameters.
    ///
    /// # Errors
    /// No stretch; a condition cannot be evaluated; the reduced network cannot follow it.
    pub fn course(&self, beginning: Beginning, from: f64, stretches: &[ConditionStretch<'_>]) -> Result<ReducedHistory> {
        let (coarse, fine) = rayon::join(
            || self.of_level(&self.coarse, TOLERANCES[0], beginning, from, stretches),
            || self.of_level(&self.fine, TOLERANCES[1], beginning, from, stretches),
        );
        let (coarse, fine) = (coarse?, fine?);
        let (readings, amplitudes) = fine.outputs.into_iter().map(|own| (own.readings, own.amplitudes)).unzip();
        let coarser = coarse.outputs.into_iter().map(|own| own.readings).collect();
        Ok(ReducedHistory { readings, coarser, amplitudes, path: fine.path, steps: coarse.steps + fine.steps })
    }

    fn of_level(
        &self,
        level: &ReducedNetwork,
        tolerance: f64,
        beginning: Beginning,
        from: f64,
        stretches: &[ConditionStretch<'_>],
    ) -> Result<OfLevel> {
        let Some(first) = stretches.first() else { return Err(Error::input("there is no time to follow")) };
        let network = &level.network;
        let load = Load::at(&self.machine, &(first.condition)(from))?;
        let mut motion = match beginning {
            Beginning::Steady => {
                let state = level.steady(network, &load, &DVector::zeros(level.len()))?;
                Motion::from_steady(level, &load, state, from, tolerance)
            }
            Beginning::Uniform(temperature) => Motion::from_uniform(level, &load, temperature, from, tolerance)?,
        };
        let warming = level.warming();
        let (mut reached, mut path) = (vec![motion.output(&load)], Vec::with_capacity(stretches.len()));
        for stretch in stretches {
            let load = |time: f64| Load::at(&self.machine, &(stretch.condition)(time));
            // Sensors of inlet water show the condition after a step at once.
            let seen = |time: f64| match stretch.at_end.as_ref().filter(|_| time >= stretch.until) {
                Some(condition) => Load::at(&self.machine, condition),
                None => load(time),
            };
            let mut own: Path = Vec::new();
            let ends = [motion.time, stretch.until];
            let found = Corners::of(&self.machine, &warming, &|time| (stretch.condition)(time), ends, tolerance);
            if found.is_cut_off {
                return Err(Error::input(format!("formulas have more kinks until {:.0} s than are looked for", stretch.until))
                    .help("state the course in the schedule instead of a formula"));
            }
            let mut outputs = stretch.outputs.as_slice();
            for end in found.corners.iter().map(|corner| corner.time).chain([stretch.until]) {
                let (due, later) = outputs.split_at(outputs.partition_point(|time| *time <= end));
                outputs = later;
                reached.extend(motion.advance(end, &load, due, &seen, &mut own)?);
            }
            path.push(own);
        }
        Ok(OfLevel { outputs: reached, path, steps: motion.steps })
    }
}
