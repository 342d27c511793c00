//! How large an amplitude may be before anything is measured, and how much a cause by its kind and its law counts.

use super::{Effect, Hypothesis, Law, Leak, Radiation, Sensor};

/// How much rarer a wrong conductivity of a table is than what depends on how a machine was put together, and radiation between two parts
/// that the model lacks than what conducts.
const TABLED: f64 = 0.25;

/// Largest share of the surroundings in what a sensor shows: it must feel something of its place.
const MOST_OF_SHARES: f64 = 0.99;

/// Times the usual that an amplitude with tails is followed to: a path of 0.1 W/K in a machine tool is one of 100 W/K in a house.
const MOST_TIMES: f64 = 1000.0;

impl Hypothesis {
    /// The same as a number of the file that is inexact by this standard deviation, beside a cause.
    pub(crate) fn inexact_by(self, scale: f64) -> Self {
        Self { scale, is_inexactness: true, ..self }
    }

    /// How often it is to blame beside one contact, heat source, channel or sensor of a machine, before anything is measured and under all of
    /// its laws: a machine of fifty contacts has fifty that may be loose. What may act between any two parts has as many places as there
    /// are pairs, `places`, and is to blame in proportion to the parts.
    pub fn rate(&self, places: usize) -> f64 {
        let of_pair = (places.max(1) as f64).sqrt().recip();
        match self.effect {
            Effect::Material(_) => TABLED,
            Effect::Radiation(Radiation::Exchange(..)) => TABLED * of_pair,
            Effect::Leak(Leak::Link(..)) | Effect::Sensor(Sensor::Swap(..)) => of_pair,
            _ => 1.0,
        }
    }

    /// Whether it may be many times what is usual: heat, paths and mass that the model lacks, a contact that came loose, a channel that is
    /// nearly shut, a sensor that fell off. The prior of its amplitude has tails like 1/a², so that of causes that fit alike the one is not
    /// preferred whose prior happens to be wider. What tables or nature bound has none: conductivities, emissivities, what all have in common,
    /// how anything drifts with its temperature.
    pub(crate) fn has_tails(&self) -> bool {
        let is_open = match self.effect {
            Effect::Heat(_) | Effect::Leak(_) | Effect::Flow(_) | Effect::Contact(_) | Effect::Storage(_) => true,
            Effect::Radiation(radiation) => matches!(radiation, Radiation::Gas | Radiation::Exchange(..)),
            Effect::Sensor(sensor) => sensor != Sensor::All,
            _ => false,
        };
        is_open && !self.is_inexactness && (self.law != Law::Temperature || self.effect.usual_law() == Law::Temperature)
    }

    /// Standard deviation of a normal prior of an amplitude that is guessed to be this large: its own size, where the prior has tails.
    pub fn spread(&self, guess: f64) -> f64 {
        if self.has_tails() { self.scale.max(guess.abs().min(self.largest())) } else { self.scale }
    }

    /// Largest amplitude that is fitted.
    pub fn largest(&self) -> f64 {
        match self.unit {
            unit if unit.starts_with("ln") => 4.0,
            "share" => MOST_OF_SHARES,
            _ if self.has_tails() => MOST_TIMES * self.scale,
            _ => 50.0 * self.scale,
        }
    }

    /// Least and largest amplitude: no factor goes beyond what it can reach, as an emissivity that of a black surface.
    pub fn range(&self) -> (f64, f64) {
        let most = self.largest();
        let most_up = if self.unit == "ln" { most.min(self.most.ln_1p()) } else { most };
        (if self.is_signed { -most } else { 0.0 }, most_up)
    }
}
