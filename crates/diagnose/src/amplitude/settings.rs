//! The constants that decide an answer: one record, each field with its unit and its reason.

use serde::Serialize;

/// Constants of the search for places and kinds.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct AmplitudeSettings {
    /// Spreads of the file's numbers that are tried, standard deviations of their logarithms. Numbers of a careful machine file are
    /// known to 1 or 2 %; beyond 8 % a number is no longer a number but a cause.
    pub spreads: Vec<f64>,
    /// Price of the spread of the numbers in log evidence, per unit: an exponential prior of mean 3 %.
    pub spread_price: f64,
    /// Sizes of the disturbance that are tried, standard deviations of a heat in every part as shares of the machine's mean heat.
    pub disturbances: Vec<f64>,
    /// Price of the disturbance in log evidence, per unit: an exponential prior of mean 5 %.
    pub disturbance_price: f64,
    /// The same in logs, where the heat wanders with the time: sun, draught and duty that no column tells may be a third of
    /// the mean heat.
    pub wandering_heats: Vec<f64>,
    /// Errors of each sensor of a log that are tried, standard deviations in K: they wander with the time, beside what is stated. A converter
    /// of a third of a kelvin, air that is not still, a mixing that a lumped node leaves out.
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
}

impl Default for AmplitudeSettings {
    fn default() -> Self {
        Self {
            spreads: vec![0.0, 0.01, 0.02, 0.04, 0.08],
            spread_price: 30.0,
            disturbances: vec![0.0, 0.01, 0.03, 0.1],
            disturbance_price: 20.0,
            wandering_heats: vec![0.0, 0.01, 0.03, 0.1, 0.3],
            wanderings: vec![0.0, 0.05, 0.15, 0.3],
            wandering_price: 10.0,
            wandering_memory: 0.05,
            freedoms: vec![0.0, 0.15, 0.5, 1.5],
            sizes: vec![1.0, 3.0],
            choice_price: 1.0,
            expected_causes: 0.7,
        }
    }
}
