//! Amplitudes in units of their scale.

use crate::effects::Hypothesis;
use coldplate_network::Network;

/// From units of a scale to the unit of a hypothesis and back. A number of the machine file moves by its logarithm, so that it stays positive
/// however small it becomes; all else moves straight.
#[derive(Debug, Clone, Copy)]
pub struct Sizing {
    scale: f64,
    /// The number of the file that an amplitude is added to, in the hypothesis' unit.
    number: Option<f64>,
}

impl Sizing {
    /// Of a cause of a machine; `is_straight` where the readings answer straight to its own unit.
    pub fn of(h: &Hypothesis, network: &Network, is_straight: bool) -> Self {
        let is_added_to = !is_straight && !h.unit.starts_with("ln");
        Self { scale: h.scale, number: h.of_a_number(network).filter(|own| is_added_to && *own > 0.0) }
    }

    /// Standard deviation of the number's logarithm: one scale more is the amplitude of one scale.
    fn of_logarithm(&self, number: f64) -> f64 {
        (self.scale / number).ln_1p()
    }

    /// In the hypothesis' unit, from units of the scale.
    pub fn amplitude(&self, x: f64) -> f64 {
        self.number.map_or(x * self.scale, |number| number * (x * self.of_logarithm(number)).exp_m1())
    }

    /// In units of the scale, from the hypothesis' unit.
    pub fn position(&self, amplitude: f64) -> f64 {
        self.number.map_or(amplitude / self.scale, |number| (amplitude / number).max(-1.0).ln_1p() / self.of_logarithm(number))
    }

    /// Amplitude in the hypothesis' unit per unit of the scale.
    pub fn slope(&self, x: f64) -> f64 {
        self.number.map_or(self.scale, |number| number * self.of_logarithm(number) * (x * self.of_logarithm(number)).exp())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A capacity of 4 that is more by 2 in the mean: half of it is as far below as twice is above, and nothing is less than nothing.
    #[test]
    fn a_number_moves_by_its_logarithm() {
        let own = Sizing { scale: 2.0, number: Some(4.0) };
        assert!((own.amplitude(1.0) - 2.0).abs() < 1e-12 && (own.amplitude(-1.0) + 4.0 / 3.0).abs() < 1e-12);
        assert!(own.amplitude(-50.0) > -4.0);
        for x in [-3.0, -0.4, 0.0, 2.5] {
            assert!((own.position(own.amplitude(x)) - x).abs() < 1e-9);
            let slope = (own.amplitude(x + 1e-6) - own.amplitude(x - 1e-6)) / 2e-6;
            assert!((slope - own.slope(x)).abs() < 1e-6);
        }
        let straight = Sizing { scale: 0.5, number: None };
        assert_eq!((straight.amplitude(3.0), straight.position(1.5), straight.slope(9.0)), (1.5, 3.0, 0.5));
    }
}
