//! The constants that decide an answer: one record, each field with its unit and its reason.

use super::rows::Looseness;
use serde::{Deserialize, Serialize};

/// Constants of the diagnosis: of its search for places and kinds, and of its verdict.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct AmplitudeSettings {
    /// Spreads of the file's numbers that are tried, standard deviations of their logarithms. Numbers of a careful machine file are
    /// known to 1 or 2 %; beyond 8 % a number is no longer a number but a cause.
    pub spreads: Vec<f64>,
    /// Price of the spread of the numbers in log evidence, per unit: an exponential prior of mean 3 %.
    pub spread_price: f64,
    /// Sizes of the disturbance of tables that are tried, standard deviations of a heat in every part as shares of the machine's mean heat, and
    /// of the level of all heats as shares of these.
    pub disturbances: Vec<f64>,
    /// Price of each of these in log evidence, per unit: an exponential prior of mean 5 %.
    pub disturbance_price: f64,
    /// Further errors of the conditions of each row of a table that are tried, as multiples of what is stated of them: water and room differ
    /// from test to test by more than their instruments do.
    pub condition_errors: Vec<f64>,
    /// Price of these in log evidence, per multiple: an exponential prior of mean 3.
    pub condition_price: f64,
    /// Noise of readings and biases of sensors that are tried, as multiples of what is stated of them. Chosen: what is stated comes from data
    /// sheets, which know neither the mounting nor the cabling; beyond three times it a sensor is broken.
    pub noises: Vec<f64>,
    /// Price of these in log evidence, per multiple beyond the first: an exponential prior of mean one half.
    pub noise_price: f64,
    /// Sizes of the disturbance of logs that are tried, where the heat wanders with the time: sun, draught and duty that no column tells may be a third of
    /// the mean heat.
    pub wandering_heats: Vec<f64>,
    /// Errors of each sensor of a log that are tried, standard deviations in K: they wander with the time, beside what is stated. A converter
    /// of a third of a kelvin, air that is not still, a mixing that a lumped node leaves out, rows that were thinned.
    pub wanderings: Vec<f64>,
    /// Price of the wandering error in log evidence, 1/K: an exponential prior of mean 0.1 K.
    pub wandering_price: f64,
    /// Time over which they wander, as a share of the test.
    pub wandering_memory: f64,
    /// Freedoms of an amplitude from condition to condition that are tried, as shares of its kind's scale.
    pub freedoms: Vec<f64>,
    /// Sizes of the mean amplitude that are tried, as multiples of its kind's scale: the second one is for large effects.
    pub sizes: Vec<f64>,
    /// Price in log evidence of each choice that is not the plainest: a free amplitude, and a large one.
    pub choice_price: f64,
    /// Causes that a machine with a misfit has, expected number: the prior of a set of k is that of a Poisson count.
    pub expected_causes: f64,
    /// Probability that a reading is grossly wrong, or the value that a row states of a condition. Chosen between those of typed
    /// numbers, of which one in two hundred is wrong, and of
    /// numbers that a logger writes.
    pub wrong_reading: f64,
    /// Probability that a row is wrong as a whole: taken in another state than is stated, or shifted. Chosen: three in a thousand.
    pub wrong_row: f64,
    /// Probability that a sensor is wrong as a whole: broken, or fallen off. Chosen: one in a hundred.
    pub wrong_sensor: f64,
    /// Range in which a grossly wrong reading lies anywhere, K (um of displacements): what thermometers about machines show.
    pub wrong_range: f64,
    /// Share of the readings that may be wrong at most, beside the largest part that is: a row or a sensor. All readings of a row that
    /// states a wrong condition count. Chosen: with more, a table cannot say which.
    pub most_wrong: f64,
    /// Looseness beyond which a model without causes is wrong in some way that nothing names: numbers of a careful machine file are known to
    /// 2 %, the heats of a test bench repeat within 3 %, its conditions within three times what is stated, and instruments are no worse than twice
    /// what is stated of them.
    pub usual: Looseness,
    /// Probability of a misfit, under all that a model leaves open, below which more is wrong than what is named: two in a thousand clean
    /// tables.
    pub alarm: f64,
    /// Share of the squared residual that causes take at least where what they leave is no noise: with less, something else is wrong.
    pub least_share: f64,
    /// Probability at which something is said without reserve.
    pub certain: f64,
    /// Probability that the explanations of the set have together: the truth is among them as often.
    pub set: f64,
}

impl AmplitudeSettings {
    /// Whether a model leaves no more open than models of careful machine files do.
    pub(crate) fn is_usual(&self, looseness: &Looseness) -> bool {
        looseness.spread <= self.usual.spread
            && looseness.disturbance <= self.usual.disturbance
            && looseness.level <= self.usual.level
            && looseness.conditions <= self.usual.conditions
            && looseness.wandering <= self.usual.wandering
            && looseness.noise <= self.usual.noise
    }

    /// These settings where a model may leave no more open than those of careful machine files do.
    pub(super) fn within_usual(&self) -> Self {
        let up_to = |sizes: &[f64], usual: f64| sizes.iter().copied().filter(|size| *size <= usual).collect::<Vec<f64>>();
        let usual = self.usual;
        Self {
            spreads: up_to(&self.spreads, usual.spread),
            // Levels are as large as disturbances, and as usual.
            disturbances: up_to(&self.disturbances, usual.disturbance.min(usual.level)),
            condition_errors: up_to(&self.condition_errors, usual.conditions),
            noises: up_to(&self.noises, usual.noise),
            wandering_heats: up_to(&self.wandering_heats, usual.disturbance),
            wanderings: up_to(&self.wanderings, usual.wandering),
            ..self.clone()
        }
    }
}

impl Default for AmplitudeSettings {
    fn default() -> Self {
        Self {
            spreads: vec![0.0, 0.01, 0.02, 0.04, 0.08],
            spread_price: 30.0,
            disturbances: vec![0.0, 0.01, 0.03, 0.1],
            disturbance_price: 20.0,
            condition_errors: vec![0.0, 1.0, 3.0, 10.0],
            condition_price: 0.3,
            noises: vec![1.0, 1.5, 2.0, 3.0],
            noise_price: 2.0,
            wandering_heats: vec![0.0, 0.01, 0.03, 0.1, 0.3],
            wanderings: vec![0.0, 0.015, 0.05, 0.15, 0.5, 1.5],
            wandering_price: 10.0,
            wandering_memory: 0.05,
            freedoms: vec![0.0, 0.15, 0.5, 1.5],
            sizes: vec![1.0, 3.0],
            choice_price: 1.0,
            expected_causes: 0.7,
            usual: Looseness { spread: 0.02, disturbance: 0.03, level: 0.03, conditions: 3.0, wandering: 0.1, noise: 2.0 },
            alarm: 0.002,
            least_share: 0.5,
            certain: 0.9,
            set: 0.95,
            wrong_reading: 1e-3,
            wrong_row: 3e-3,
            wrong_sensor: 1e-2,
            wrong_range: 100.0,
            most_wrong: 0.25,
        }
    }
}
