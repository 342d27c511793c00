//! Distance of a condition from the border of the acceptable ones.

use coldplate_runtime::{Band, Surrogate};
use statrs::distribution::{ContinuousCDF, Normal};

/// Weight of a standardised margin beside a probability, dimensionless. Chosen: it gives plateaus of the probability
/// a slope, but never decides the verdict.
const TIE: f64 = 1e-12;
/// Distance of a probability from zero or one below which it no longer shows the way to the border, and the
/// standardised margin takes over. Chosen: nearer, differences of probabilities are lost in rounding.
const CERTAIN: f64 = 1e-9;

/// Judges conditions, one after the other, in the same memory.
pub(super) struct Slack<'a, 'b> {
    surrogate: &'a Surrogate<'b>,
    values: Vec<f64>,
    bands: Vec<Band>,
    confidence: f64,
}

/// A condition's distance from the border of the acceptable ones.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Distance {
    /// Slack: not negative where the condition is acceptable; minus infinity where a limit has no finite value.
    pub(super) slack: f64,
    /// Index of the limit with this slack.
    pub(super) limit: usize,
    /// Measure without plateaus, with the sign of the slack: in standard deviations if the surrogate knows any, else in the
    /// limit's unit.
    pub(super) steer: f64,
}

impl Distance {
    fn unknown(limit: usize) -> Self {
        Self { slack: f64::NEG_INFINITY, limit, steer: f64::NEG_INFINITY }
    }
}

impl<'a, 'b> Slack<'a, 'b> {
    pub(super) fn new(surrogate: &'a Surrogate<'b>, confidence: f64) -> Self {
        let points = surrogate.point_count();
        Self { surrogate, values: vec![0.0; points], bands: vec![Band::default(); points], confidence }
    }

    /// The distance at a condition. The slack is the smallest distance of a limit from the upper end of its band. If the
    /// surrogate has uncertainty, it is the probability that all limits are kept, less the one asked for. `x` holds the variables
    /// that varied.
    pub(super) fn at(&mut self, x: &[f64]) -> Distance {
        // In a corner without a row nothing is acceptable for sure.
        if !self.surrogate.in_domain(x) {
            return Distance::unknown(0);
        }
        if self.surrogate.uncertainty().is_some() {
            return self.chance(x);
        }
        if self.surrogate.evaluate(x, &mut self.values).is_err() {
            return Distance::unknown(0);
        }
        let slack = |i| {
            let limit = self.surrogate.limit_value(i, x, &self.values)?;
            Some(limit.maximum - limit.high).filter(|s: &f64| s.is_finite())
        };
        let slacks = (0..self.surrogate.limit_count()).map(|i| (slack(i).unwrap_or(f64::NEG_INFINITY), i));
        let least = slacks.min_by(|a, b| a.0.total_cmp(&b.0));
        least.map_or(Distance::unknown(0), |(slack, limit)| Distance { slack, limit, steer: slack })
    }

    /// The distance by the probability. Where that is zero or one, the standardised margin still tells which way is
    /// better.
    fn chance(&mut self, x: &[f64]) -> Distance {
        let found = self.surrogate.assess(x, None, self.confidence, &mut self.values, &mut self.bands);
        let Ok((chance, limit)) = found.map(|chance| (chance, chance.binding.unwrap_or(0))) else { return Distance::unknown(0) };
        let own = self.surrogate.limit_chance(limit, x, None, &self.values);
        let Some(own) = own.filter(|_| chance.probability.is_finite()) else { return Distance::unknown(limit) };
        let standardised = (own.maximum - own.value) / own.band.total.max(f64::MIN_POSITIVE);
        // The tie never decides the verdict.
        let tied = chance.probability - self.confidence + TIE * standardised.clamp(-1e6, 1e6);
        let slack = if chance.probability >= self.confidence { tied.max(0.0) } else { tied.min(-f64::MIN_POSITIVE) };
        let quantile = |p: f64| Normal::standard().inverse_cdf(p);
        let steer = match chance.probability {
            p if (CERTAIN..=1.0 - CERTAIN).contains(&p) => quantile(p) - quantile(self.confidence),
            _ => standardised - quantile(self.confidence),
        };
        let steer = if slack >= 0.0 { steer.max(0.0) } else { steer.min(-f64::MIN_POSITIVE) };
        Distance { slack, limit, steer }
    }

    /// Excess of the upper end of a limit's band over the limit, at the condition that was looked at last, in the limit's
    /// unit.
    pub(super) fn excess(&self, limit: usize, x: &[f64]) -> f64 {
        self.surrogate.limit_value(limit, x, &self.values).map_or(f64::NAN, |own| own.high - own.maximum)
    }

    /// The values of the points at the condition that was looked at last.
    pub(super) fn values(&self) -> &[f64] {
        &self.values
    }
}
