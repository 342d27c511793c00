//! When sensors' places pass given temperatures.

/// A temperature that is waited for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Watch {
    /// Index of the sensor.
    pub sensor: usize,
    /// K
    pub value: f64,
}

/// When it was passed for the first time, s on the schedule's clock, coming from below and from above.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Crossing {
    /// What was waited for.
    pub watch: Watch,
    /// From below.
    pub rising: Option<f64>,
    /// From above.
    pub falling: Option<f64>,
}

/// What has been seen of the temperatures that are waited for, and what was found.
///
/// Between two time steps a cubic runs through these and their neighbours, as far as the schedule has no corner there: its
/// error is of higher order than that of the steps. It is looked for crossings when a stretch without corners is over.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Passing {
    pub(super) found: Vec<Crossing>,
    /// Times of the present stretch, s, ascending.
    pub(super) times: Vec<f64>,
    /// What was waited for at each, K: one value for each of the watches.
    pub(super) values: Vec<Vec<f64>>,
    /// The last of the stretch before.
    pub(super) last: Vec<f64>,
}

impl Passing {
    pub(super) fn new(watched: &[Watch]) -> Self {
        let found = watched.iter().map(|watch| Crossing { watch: *watch, rising: None, falling: None }).collect();
        Self { found, ..Self::default() }
    }

    /// Takes note of the temperatures of all places (K) at `time` (s).
    pub(super) fn see(&mut self, time: f64, temperatures: &[f64]) {
        if self.found.is_empty() || self.times.last().is_some_and(|last| *last >= time) {
            return;
        }
        self.times.push(time);
        self.values.push(self.found.iter().map(|c| temperatures[c.watch.sensor]).collect());
    }

    /// A corner of the schedule: the stretch is over.
    pub(super) fn corner(&mut self) {
        let (times, values) = (std::mem::take(&mut self.times), std::mem::take(&mut self.values));
        for (w, crossing) in self.found.iter_mut().enumerate() {
            let Some(first) = values.first() else { break };
            let value = crossing.watch.value;
            if let Some(last) = self.last.get(w) {
                crossing.note(*last, first[w], || times[0]);
            }
            for i in 1..times.len() {
                crossing.note(values[i - 1][w], values[i][w], || root(&times, i, value, |k| values[k][w]));
            }
        }
        if let Some(last) = values.last() {
            self.last.clone_from(last);
        }
    }
}

impl Crossing {
    fn note(&mut self, before: f64, now: f64, time: impl Fn() -> f64) {
        let value = self.watch.value;
        if before < value && now >= value && self.rising.is_none() {
            self.rising = Some(time());
        }
        if before > value && now <= value && self.falling.is_none() {
            self.falling = Some(time());
        }
    }
}

/// Where the polynomial through the nearest points meets `value` between the points `i - 1` and `i`.
fn root(times: &[f64], i: usize, value: f64, at: impl Fn(usize) -> f64) -> f64 {
    let points: Vec<usize> = (i.saturating_sub(2)..=(i + 1).min(times.len() - 1)).collect();
    let polynomial = |t: f64| -> f64 {
        let term = |k: &usize| {
            let others = points.iter().filter(|other| *other != k);
            at(*k) * others.map(|other| (t - times[*other]) / (times[*k] - times[*other])).product::<f64>()
        };
        points.iter().map(term).sum()
    };
    let (mut low, mut high) = (times[i - 1], times[i]);
    let is_rising = at(i) > at(i - 1);
    for _ in 0..80 {
        let middle = f64::midpoint(low, high);
        if (polynomial(middle) >= value) == is_rising { high = middle } else { low = middle }
    }
    f64::midpoint(low, high)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 20 K sin(t): the first time up through 10 K is at pi/6, down at 5 pi/6; steps of 0.1 s miss it by 1e-5 s.
    #[test]
    fn a_sine_is_met_in_both_directions() {
        let mut passing = Passing::new(&[Watch { sensor: 1, value: 10.0 }]);
        for i in 0..100 {
            let t = 0.1 * f64::from(i);
            passing.see(t, &[0.0, 20.0 * t.sin()]);
        }
        passing.corner();
        let found = passing.found[0];
        assert!((found.rising.unwrap() - std::f64::consts::FRAC_PI_6).abs() < 1e-5, "{found:?}");
        assert!((found.falling.unwrap() - 5.0 * std::f64::consts::FRAC_PI_6).abs() < 1e-5, "{found:?}");
    }

    #[test]
    fn a_jump_counts_at_its_time() {
        let mut passing = Passing::new(&[Watch { sensor: 0, value: 10.0 }]);
        for (t, value) in [(0.0, 5.0), (1.0, 6.0)] {
            passing.see(t, &[value]);
        }
        passing.corner();
        for (t, value) in [(1.0, 12.0), (2.0, 13.0)] {
            passing.see(t, &[value]);
        }
        passing.corner();
        assert_eq!((passing.found[0].rising, passing.found[0].falling), (Some(1.0), None));
    }
}
