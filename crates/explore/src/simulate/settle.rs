//! Times at which readings have come near to a steady state for good.

/// Time since when each sensor has been near its steady reading without a break.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Settling {
    /// Largest distance that counts as near, K.
    pub(super) within: f64,
    /// Time of the last look, s.
    pub(super) time: f64,
    /// Distances from the steady readings at the last look, K.
    pub(super) distances: Vec<f64>,
    /// Time since when each sensor has been near, s; infinite while it is not.
    pub(super) since: Vec<f64>,
}

impl Settling {
    pub(super) fn new(within: f64, sensors: usize) -> Self {
        Self { within, time: f64::NEG_INFINITY, distances: vec![f64::INFINITY; sensors], since: vec![f64::INFINITY; sensors] }
    }

    /// Takes note of the readings (K) at `time` (s), later than the last ones or at a step of the condition.
    pub(super) fn see(&mut self, time: f64, readings: &[f64], steady: Option<&[f64]>) {
        let Some(steady) = steady else { return };
        for (i, (reading, target)) in readings.iter().zip(steady).enumerate() {
            let (before, now) = (self.distances[i], (reading - target).abs());
            if now > self.within {
                self.since[i] = f64::INFINITY;
            } else if self.since[i].is_infinite() {
                self.since[i] = self.crossing(time, before, now);
            }
            self.distances[i] = now;
        }
        self.time = time;
    }

    /// Time at which the distance fell to the limit between the last look and this one.
    fn crossing(&self, time: f64, before: f64, now: f64) -> f64 {
        if before.is_infinite() || before <= now {
            return time;
        }
        // Distances decay like exponentials, unless the reading runs through its steady value.
        let share = if now > 0.1 * before && self.within > 0.0 {
            (before / self.within).ln() / (before / now).ln()
        } else {
            (before - self.within) / (before - now)
        };
        self.time + share.clamp(0.0, 1.0) * (time - self.time)
    }

    /// Time after `start` at which each sensor has settled, s; `None` if it has not, or if no steady state is known.
    pub(super) fn settled(&self, start: f64, is_known: bool) -> Vec<Option<f64>> {
        self.since.iter().map(|since| (is_known && since.is_finite()).then(|| since - start)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 8 exp(-t/100) K above the steady reading is within 1 K from t = 100 ln 8 on, however far apart the looks are.
    #[test]
    fn an_exponential_is_met_between_two_looks() {
        let mut settling = Settling::new(1.0, 2);
        for k in 0..6 {
            let t = 10.0 + 70.0 * f64::from(k);
            let far = 8.0 * (-(t - 10.0) / 100.0).exp();
            settling.see(t, &[300.0 + far, 300.0 - far], Some(&[300.0, 300.0]));
        }
        for settled in settling.settled(10.0, true) {
            assert!((settled.unwrap() - 100.0 * 8f64.ln()).abs() < 1e-9, "{settled:?}");
        }
        assert_eq!(settling.settled(10.0, false), [None, None]);
    }

    #[test]
    fn leaving_again_counts_anew() {
        let mut settling = Settling::new(0.5, 1);
        for (t, reading) in [(0.0, 300.1), (1.0, 301.0), (2.0, 300.0), (3.0, 300.2), (3.0, 302.0)] {
            settling.see(t, &[reading], Some(&[300.0]));
        }
        assert_eq!(settling.settled(0.0, true), [None]);
        settling.see(4.0, &[300.0], Some(&[300.0]));
        // From 2 K to nothing in a second: through half a kelvin after three quarters of it.
        assert_eq!(settling.settled(0.0, true), [Some(3.75)]);
    }
}
