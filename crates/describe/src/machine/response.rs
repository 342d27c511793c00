//! Response of a sensor to the temperature at its place.

use coldplate_base::units::ZERO_CELSIUS;

/// Reference temperature of gains, K: 20 degC. Chosen: the reference temperature of ISO 1.
const REFERENCE: f64 = 20.0 + ZERO_CELSIUS;

/// Errors of a sensor: a share of the temperature of the surroundings, then a first-order lag, then a gain relative to 20 degC, then an
/// offset.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SensorResponse {
    /// Share of the temperature of the surroundings in the temperature that the sensor takes on, from 0 to below 1; the rest is that of its
    /// place.
    pub surroundings: f64,
    /// Time constant of the lag, s; not negative.
    pub lag: f64,
    /// Offset, K.
    pub offset: f64,
    /// Gain, positive (dimensionless); 1 shows differences unchanged.
    pub gain: f64,
}

impl Default for SensorResponse {
    fn default() -> Self {
        Self { surroundings: 0.0, lag: 0.0, offset: 0.0, gain: 1.0 }
    }
}

/// A sensor with a lag at one instant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ShownTemperature {
    /// Time, s.
    pub time: f64,
    /// Temperature at the sensor's place, K.
    pub told: f64,
    /// Temperature that the sensor shows, K.
    pub shown: f64,
}

impl ShownTemperature {
    /// A sensor that has settled at the temperature of its place, K.
    pub fn settled(time: f64, told: f64) -> Self {
        Self { time, told, shown: told }
    }

    /// The sensor at a later time (s), after the temperature at its place has changed linearly to `told` (K), for a
    /// time constant `lag` (s): the exact solution of lag dS/dt = T - S.
    #[must_use]
    pub fn followed(self, time: f64, told: f64, lag: f64) -> Self {
        let passed = time - self.time;
        let shown = if lag <= 0.0 {
            told
        } else if passed <= 0.0 {
            self.shown
        } else {
            let behind = lag * (told - self.told) / passed;
            told - behind + (self.shown - self.told + behind) * (-passed / lag).exp()
        };
        Self { time, told, shown }
    }
}

impl SensorResponse {
    /// Whether the sensor shows the temperature of its place.
    pub fn is_ideal(&self) -> bool {
        *self == Self::default()
    }

    /// Temperature (K) that the settled sensor takes on at a place of a temperature (K) in surroundings of another (K).
    fn taken_on(&self, place: f64, surroundings: f64) -> f64 {
        if self.surroundings == 0.0 { place } else { place + self.surroundings * (surroundings - place) }
    }

    fn of_taken_on(&self, temperature: f64) -> f64 {
        self.offset + if self.gain == 1.0 { temperature } else { REFERENCE + self.gain * (temperature - REFERENCE) }
    }

    /// Reading (K) of the sensor once it has settled at a place of a temperature (K) in surroundings of another (K).
    pub fn settled(&self, place: f64, surroundings: f64) -> f64 {
        self.of_taken_on(self.taken_on(place, surroundings))
    }

    /// Temperature of its place (K) at which the settled sensor shows a reading (K) in surroundings of a temperature (K).
    pub fn temperature(&self, reading: f64, surroundings: f64) -> f64 {
        let taken_on = if self.gain == 1.0 { reading - self.offset } else { REFERENCE + (reading - self.offset - REFERENCE) / self.gain };
        if self.surroundings == 0.0 {
            return taken_on;
        }
        surroundings + (taken_on - surroundings) / (1.0 - self.surroundings)
    }

    /// Readings (K) for a course of temperatures of the place and of the surroundings (K) at ascending times (s), linear in between and
    /// constant before.
    pub fn course(&self, times: &[f64], places: &[f64], surroundings: &[f64]) -> Vec<f64> {
        let taken_on: Vec<f64> = places.iter().zip(surroundings).map(|(place, around)| self.taken_on(*place, *around)).collect();
        self.lagging(times, &taken_on).into_iter().map(|t| self.of_taken_on(t)).collect()
    }

    /// Change of the shown course (K) for a change of the temperatures of the place (K).
    pub fn course_of_change(&self, times: &[f64], changes: &[f64]) -> Vec<f64> {
        self.lagging(times, changes).into_iter().map(|change| self.of_place() * change).collect()
    }

    /// Derivative of the settled reading with respect to the temperature of the place.
    pub fn of_place(&self) -> f64 {
        self.gain * (1.0 - self.surroundings)
    }

    /// Derivative of the settled reading with respect to the temperature of the surroundings.
    pub fn of_surroundings(&self) -> f64 {
        self.gain * self.surroundings
    }

    fn lagging(&self, times: &[f64], values: &[f64]) -> Vec<f64> {
        let mut last: Option<ShownTemperature> = None;
        let follow = |(time, told): (&f64, &f64)| {
            let now = last.map_or(ShownTemperature::settled(*time, *told), |before| before.followed(*time, *told, self.lag));
            last = Some(now);
            now.shown
        };
        times.iter().zip(values).map(follow).collect()
    }

    /// Whether a key is one of a sensor's own numbers.
    pub fn has_key(key: &str) -> bool {
        matches!(key, "surroundings_share" | "lag" | "offset" | "gain")
    }

    /// Derivative of the settled sensor's reading with respect to one of its own numbers by its key, at a place of a temperature (K) in
    /// surroundings of another (K); `None` for other keys.
    pub fn slope(&self, key: &str, place: f64, surroundings: f64) -> Option<f64> {
        match key {
            "lag" => Some(0.0),
            "offset" => Some(1.0),
            "gain" => Some(self.taken_on(place, surroundings) - REFERENCE),
            "surroundings_share" => Some(self.gain * (surroundings - place)),
            _ => None,
        }
    }

    /// The response followed by a further offset (K).
    #[must_use]
    pub fn with_offset(self, offset: f64) -> Self {
        Self { offset: self.offset + offset, ..self }
    }

    /// The response followed by a further relative gain: the reading grows by this share of its distance from 20 degC.
    #[must_use]
    pub fn with_gain(self, more: f64) -> Self {
        Self { gain: self.gain * (1.0 + more), offset: self.offset * (1.0 + more), ..self }
    }

    /// The response followed by a further share of the surroundings: the reading moves by this share of the way to their temperature.
    #[must_use]
    pub fn with_surroundings(self, share: f64) -> Self {
        let left = 1.0 - share;
        let gain = left * self.gain + share;
        let surroundings = (left * self.gain * self.surroundings + share) / gain;
        Self { surroundings, gain, offset: left * self.offset, ..self }
    }

    /// The response with a further lag, s. Two lags in series are nearly one lag of their sum.
    #[must_use]
    pub fn with_lag(self, lag: f64) -> Self {
        Self { lag: self.lag + lag, ..self }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Behind a ramp of 0.1 K/s a lag of 20 s shows T - 2 K (1 - exp(-t / 20 s)), however the ramp is cut.
    #[test]
    fn a_lag_follows_a_ramp_exactly() {
        let response = SensorResponse { lag: 20.0, offset: 0.3, gain: 0.98, ..SensorResponse::default() };
        for step in [1.0, 7.0, 30.0] {
            let times: Vec<f64> = (0..8).map(|i| step * f64::from(i)).collect();
            let temperatures: Vec<f64> = times.iter().map(|t| 300.0 + 0.1 * t).collect();
            for ((t, place), shown) in times.iter().zip(&temperatures).zip(response.course(&times, &temperatures, &[280.0; 8])) {
                let lagging = place - 2.0 * (1.0 - (-t / 20.0).exp());
                assert!((shown - (293.15 + 0.98 * (lagging - 293.15) + 0.3)).abs() < 1e-10, "{t} s: {shown}");
            }
        }
        let glued = SensorResponse { surroundings: 0.2, ..response };
        assert!((glued.temperature(glued.settled(310.0, 290.0), 290.0) - 310.0).abs() < 1e-10);
    }

    /// At a step of the condition two instants have one time: the reading of the sensor does not change.
    #[test]
    fn a_jump_is_not_shown_at_once() {
        let response = SensorResponse { lag: 10.0, ..SensorResponse::default() };
        let shown = response.course(&[0.0, 0.0, 10.0], &[300.0, 310.0, 310.0], &[290.0; 3]);
        assert_eq!(shown[..2], [300.0, 300.0]);
        assert!((shown[2] - (310.0 - 10.0 * (-1f64).exp())).abs() < 1e-12, "{}", shown[2]);
    }

    #[test]
    fn responses_behind_each_other_are_one() {
        for surroundings in [0.0, 0.1] {
            let first = SensorResponse { offset: 0.4, gain: 0.97, surroundings, ..SensorResponse::default() };
            for t in [280.0, 330.0] {
                let shown = first.settled(t, 290.0);
                assert!((first.with_offset(0.2).settled(t, 290.0) - (shown + 0.2)).abs() < 1e-12);
                assert!((first.with_gain(0.05).settled(t, 290.0) - (shown + 0.05 * (shown - 293.15))).abs() < 1e-12);
                assert!((first.with_surroundings(0.2).settled(t, 290.0) - (0.8 * shown + 0.2 * 290.0)).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn slopes_are_those_of_differences() {
        let at = |surroundings: f64, gain: f64, place: f64, around: f64| {
            SensorResponse { surroundings, gain, offset: 0.3, lag: 0.0 }.settled(place, around)
        };
        let (own, step) = (SensorResponse { surroundings: 0.2, gain: 0.9, offset: 0.3, lag: 0.0 }, 1e-3);
        let near = |more: f64, slope: f64| assert!(((more - at(0.2, 0.9, 310.0, 290.0)) / step - slope).abs() < 1e-6);
        near(at(0.2 + step, 0.9, 310.0, 290.0), own.slope("surroundings_share", 310.0, 290.0).unwrap());
        near(at(0.2, 0.9 + step, 310.0, 290.0), own.slope("gain", 310.0, 290.0).unwrap());
        near(at(0.2, 0.9, 310.0 + step, 290.0), own.of_place());
        near(at(0.2, 0.9, 310.0, 290.0 + step), own.of_surroundings());
    }
}
