//! Times at which watched values pass given ones, and the largest values.

/// A temperature whose passing is watched.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Watch {
    /// Index of the sensor.
    pub sensor: usize,
    /// The temperature, K.
    pub value: f64,
}

/// Passing of a value.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Passed {
    /// Time, s on the schedule's clock.
    pub at: f64,
    /// Rate of the passing, K/s; infinite in a jump.
    pub rate: f64,
    /// Bound on the error of the time, s, if the readings have a bound.
    pub within: Option<f64>,
}

impl Passed {
    /// Passing at the beginning of a stretch, at which readings of water jump with the condition.
    pub(super) fn in_a_jump(at: f64) -> Self {
        Self { at, rate: f64::INFINITY, within: None }
    }
}

/// First passings of a value, from below and from above.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FirstPassings {
    /// The watched value.
    pub watch: Watch,
    /// Passing from below.
    pub rising: Option<Passed>,
    /// Passing from above.
    pub falling: Option<Passed>,
}

/// First and largest value of a watched quantity.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Extent {
    /// Time of the first look, s.
    pub(super) start: f64,
    pub(super) first: f64,
    pub(super) largest: f64,
    /// Time of the largest value, s.
    pub(super) at: f64,
}

/// Values seen of the watched quantities, and the passings that were found.
///
/// Between two time steps a cubic runs through these and their neighbours, as far as the schedule has no corner there: its
/// error is of higher order than that of the steps. Crossings are searched when a stretch without corners is over.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Passing {
    pub(super) found: Vec<FirstPassings>,
    /// First and largest value of each watch; empty before the first look.
    pub(super) extents: Vec<Extent>,
    /// Times of the present stretch, s, ascending.
    pub(super) times: Vec<f64>,
    /// Values at each time, K: one for each of the watches.
    pub(super) values: Vec<Vec<f64>>,
    /// Last values of the stretch before.
    pub(super) last: Vec<f64>,
}

impl Passing {
    pub(super) fn new(watched: &[Watch]) -> Self {
        let found = watched.iter().map(|watch| FirstPassings { watch: *watch, rising: None, falling: None }).collect();
        Self { found, ..Self::default() }
    }

    /// Whether nothing is watched.
    pub(super) fn is_idle(&self) -> bool {
        self.found.is_empty()
    }

    /// Takes note of all values (K) at `time` (s).
    pub(super) fn see(&mut self, time: f64, values: &[f64]) {
        if self.found.is_empty() || self.times.last().is_some_and(|last| *last >= time) {
            return;
        }
        let own: Vec<f64> = self.found.iter().map(|c| values[c.watch.sensor]).collect();
        if self.extents.is_empty() {
            self.extents = own.iter().map(|value| Extent { start: time, first: *value, largest: *value, at: time }).collect();
        }
        for (extent, value) in self.extents.iter_mut().zip(&own) {
            if *value > extent.largest {
                (extent.largest, extent.at) = (*value, time);
            }
        }
        self.times.push(time);
        self.values.push(own);
    }

    /// Watches that are passed between two looks at all values (K).
    pub(super) fn between<'a>(&'a self, before: &'a [f64], now: &'a [f64]) -> impl Iterator<Item = Watch> + 'a {
        let watches = self.found.iter().map(|crossing| crossing.watch);
        watches.filter(|w| (before[w.sensor] < w.value) != (now[w.sensor] < w.value))
    }

    /// Time of the last look, s (infinite before the first), and watches not yet found that are passed between it and values seen now (K).
    pub(super) fn crossed(&self, now: &[f64]) -> (f64, Vec<Watch>) {
        let (Some(since), Some(last)) = (self.times.last(), self.values.last()) else { return (f64::INFINITY, Vec::new()) };
        let is_new = |(own, last): &(&FirstPassings, &f64)| {
            let (before, behind) = (**last < own.watch.value, now[own.watch.sensor] < own.watch.value);
            before != behind && if before { own.rising.is_none() } else { own.falling.is_none() }
        };
        (*since, self.found.iter().zip(last).filter(is_new).map(|(own, _)| own.watch).collect())
    }

    /// Ends a stretch at a corner of the schedule.
    pub(super) fn corner(&mut self) {
        let (times, values) = (std::mem::take(&mut self.times), std::mem::take(&mut self.values));
        for (w, crossing) in self.found.iter_mut().enumerate() {
            let Some(first) = values.first() else { break };
            let value = crossing.watch.value;
            if let Some(last) = self.last.get(w) {
                crossing.note(*last, first[w], || Passed::in_a_jump(times[0]));
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

impl FirstPassings {
    /// A value that is met exactly is not passed yet: a course may begin at the very value.
    fn note(&mut self, before: f64, now: f64, passed: impl Fn() -> Passed) {
        let value = self.watch.value;
        let passes = |before: f64, now: f64, value: f64| (before < value && now >= value) || (before == value && now > value);
        if self.rising.is_none() && passes(before, now, value) {
            self.rising = Some(passed());
        }
        if self.falling.is_none() && passes(-before, -now, -value) {
            self.falling = Some(passed());
        }
    }
}

/// Time at which the polynomial through the nearest points meets `value` between the points `i - 1` and `i`.
fn root(times: &[f64], i: usize, value: f64, at: impl Fn(usize) -> f64) -> Passed {
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
    let (found, length) = (f64::midpoint(low, high), times[i] - times[i - 1]);
    // Half a hundredth of the interval to either side; the polynomial may be flat although the course is not.
    let near = 0.005 * length;
    let slope = (polynomial(found + near) - polynomial(found - near)) / (2.0 * near);
    let mean = (at(i) - at(i - 1)) / length;
    Passed { at: found, rate: if slope * mean > 0.0 { slope } else { mean }, within: None }
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
        assert!((found.rising.unwrap().at - std::f64::consts::FRAC_PI_6).abs() < 1e-5, "{found:?}");
        assert!((found.rising.unwrap().rate - 20.0 * std::f64::consts::FRAC_PI_6.cos()).abs() < 1e-3, "{found:?}");
        assert!((found.falling.unwrap().at - 5.0 * std::f64::consts::FRAC_PI_6).abs() < 1e-5, "{found:?}");
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
        assert_eq!((passing.found[0].rising, passing.found[0].falling), (Some(Passed::in_a_jump(1.0)), None));
        assert_eq!(passing.extents, [Extent { start: 0.0, first: 5.0, largest: 13.0, at: 2.0 }]);
    }

    /// A machine that begins at its limit breaks it at once.
    #[test]
    fn what_begins_at_the_value_passes_it_when_it_leaves() {
        let mut passing = Passing::new(&[Watch { sensor: 0, value: 0.0 }]);
        for (t, value) in [(0.0, 0.0), (1.0, 0.0), (2.0, 1.0)] {
            passing.see(t, &[value]);
        }
        passing.corner();
        let found = passing.found[0];
        assert!(found.rising.is_some_and(|passed| (passed.at - 1.0).abs() < 1e-9) && found.falling.is_none(), "{found:?}");
    }
}
