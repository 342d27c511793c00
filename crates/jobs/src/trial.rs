//! Random histories of conditions, run through a surrogate with dynamics and through the reduced model beside it.

use nalgebra::DVector;

use coldplate_base::error::{Error, Result};
use coldplate_base::random::Random;
use coldplate_base::units::{self, Dimension, Measurand};
use coldplate_describe::machine::Condition;
use coldplate_reduce::{Beginning, ConditionStretch, ReducedModel};
use coldplate_runtime::{StepError, Surrogate};

/// Number of stretches of one condition in each history. Chosen as for the histories of the reduced model.
const STRETCHES: usize = 5;
/// Shortest and longest stretch, in slowest time constants. Chosen: from a change that only fast states follow to one that
/// mostly settles.
const LENGTHS: (f64, f64) = (0.01, 1.0);
/// Number of outputs in a stretch. Chosen: dense enough to meet the largest error.
const OUTPUTS: usize = 24;
/// Time of the first output after the beginning of a stretch, s. Chosen: early enough for the fastest response.
const FIRST: f64 = 1.0;
/// Temperature with its unit that histories begin at if no point is a temperature. Chosen: a usual room.
const ROOM: (f64, &str) = (20.0, "degC");

/// A random history of conditions, in the surrogate's units.
pub(crate) struct Trial {
    /// Whether everything begins at the coldest reading of the first steady state; otherwise it begins in that state.
    is_uniform: bool,
    /// Conditions, each with its length, s.
    stretches: Vec<(Vec<f64>, f64)>,
}

/// Both models at a time of a history.
pub(crate) struct TrialStep {
    /// The condition, in the surrogate's units.
    pub(crate) x: Vec<f64>,
    /// States of the surrogate less those of the steady state at the condition.
    pub(crate) away: Vec<f64>,
    /// Values of the surrogate's points, in their units.
    pub(crate) values: Vec<f64>,
    /// Readings of all sensors by the finer network of the model, K or um.
    pub(crate) readings: Vec<f64>,
    /// Amplitudes of that network's modes, K.
    pub(crate) amplitudes: DVector<f64>,
}

impl Trial {
    /// A history whose every other `number` begins at one temperature; `at` makes a condition of a share for each of the `varied`
    /// variables, `slowest` is the slowest time constant, s.
    pub(crate) fn random(number: usize, slowest: f64, random: &mut Random, at: &dyn Fn(&[f64]) -> Vec<f64>, varied: usize) -> Self {
        let stretch = |_| {
            let shares: Vec<f64> = (0..varied).map(|_| random.unit()).collect();
            let length = slowest * LENGTHS.0 * (LENGTHS.1 / LENGTHS.0).powf(random.unit());
            (at(&shares), length.max(10.0 * FIRST))
        };
        Self { is_uniform: number % 2 == 1, stretches: (0..STRETCHES).map(stretch).collect() }
    }

    /// Both models at all outputs; `condition` makes the model's condition of the surrogate's.
    ///
    /// # Errors
    /// One of the models cannot follow the history.
    pub(crate) fn steps(
        &self,
        surrogate: &Surrogate<'_>,
        model: &ReducedModel,
        condition: &dyn Fn(&[f64]) -> Result<Condition>,
    ) -> Result<Vec<TrialStep>> {
        let broken = |e: StepError| Error::numerics(format!("the dynamics cannot be followed: {e}"));
        let mut values = vec![0.0; surrogate.point_count()];
        let first = &self.stretches[0].0;
        let mut state = surrogate.at_rest(first).map_err(broken)?;
        let mut beginning = Beginning::Steady;
        if self.is_uniform {
            surrogate.read(&state, first, &mut values).map_err(broken)?;
            let temperatures = values.iter().zip(surrogate.points()).filter(|(_, point)| point.unit != Measurand::Displacement.unit());
            let (coldest, unit) =
                temperatures.map(|(value, point)| (*value, point.unit)).min_by(|a, b| a.0.total_cmp(&b.0)).unwrap_or(ROOM);
            state = surrogate.at_temperature(coldest).map_err(broken)?;
            beginning = Beginning::Uniform(units::convert(coldest, unit, Dimension::TEMPERATURE)?);
        }
        let (mut stretches, mut from) = (Vec::new(), 0.0);
        for (x, length) in &self.stretches {
            let condition = condition(x)?;
            let time = |k: usize| from + FIRST * (length / FIRST).powf(k as f64 / (OUTPUTS - 1) as f64);
            let outputs: Vec<f64> = (0..OUTPUTS).map(time).collect();
            from = outputs[OUTPUTS - 1];
            stretches.push(ConditionStretch { until: from, condition: Box::new(move |_| condition.clone()), at_end: None, outputs });
        }
        let course = model.course(beginning, 0.0, &stretches)?;
        let states = surrogate.in_time().map_or(0, |own| own.states());
        let mut known = course.readings.into_iter().zip(course.amplitudes).skip(1);
        let (mut now, mut steps) = (0.0, Vec::with_capacity(OUTPUTS * STRETCHES));
        for ((x, _), stretch) in self.stretches.iter().zip(&stretches) {
            let steady = surrogate.at_rest(x).map_err(broken)?.numbers();
            for (time, (readings, amplitudes)) in stretch.outputs.iter().zip(&mut known) {
                surrogate.step(&mut state, time - now, x).map_err(broken)?;
                surrogate.read(&state, x, &mut values).map_err(broken)?;
                let away = state.numbers().iter().zip(&steady).take(states).map(|(own, steady)| own - steady).collect();
                steps.push(TrialStep { x: x.clone(), away, values: values.clone(), readings, amplitudes });
                now = *time;
            }
        }
        Ok(steps)
    }
}
