//! The machine's limits over a run: the largest value of each, and the time at which it is first broken.

use super::passing::{FirstPassings, Passed, Passing, Watch};
use coldplate_base::units::Measurand;
use coldplate_describe::machine::{LimitKind, MachineLimit};
use coldplate_solve::meshed::LimitState;

/// A limit over a run.
#[derive(Debug, Clone, PartialEq)]
pub struct LimitCourse {
    /// State of the limit at its largest value, as far as that was seen: at the outputs and at the ends of the time steps.
    pub largest: LimitState,
    /// Time of the largest value, s on the schedule's clock.
    pub at: f64,
    /// Time at which the limit was broken first.
    pub first_broken: Option<Passed>,
    /// Bound on the distance of the largest value from that of the full model, K or um, if the readings have a bound.
    pub bound: Option<f64>,
}

/// Values that are watched in a run: the temperatures of all places, followed by the limited quantities.
pub(super) struct Limits<'a> {
    limits: &'a [MachineLimit],
    measurands: &'a [Measurand],
}

/// Bounds of the readings over time.
pub(super) struct Bounds<'a> {
    /// Times of the bounds, s.
    pub times: &'a [f64],
    /// Bounds of all sensors at each time, K or um.
    pub bounds: &'a [Vec<f64>],
}

impl Bounds<'_> {
    /// Bound of a difference of some of the sensors at a time (s): the larger of the bounds before and behind that time.
    fn at(&self, time: f64, sensors: impl Iterator<Item = usize>) -> f64 {
        let behind = self.times.partition_point(|t| *t < time).min(self.times.len() - 1);
        let around = [behind.saturating_sub(1), behind];
        let mut own: Vec<f64> = sensors.map(|s| around.iter().map(|row| self.bounds[*row][s]).fold(0.0, f64::max)).collect();
        // A difference of two sensors may be off by the sum of their bounds; among more sensors, by that of the two largest.
        own.sort_by(|a, b| b.total_cmp(a));
        own.iter().take(2).sum()
    }
}

impl<'a> Limits<'a> {
    /// Limits of a machine, with the measurands of its sensors.
    pub(super) fn new(limits: &'a [MachineLimit], measurands: &'a [Measurand]) -> Self {
        Self { limits, measurands }
    }

    /// Number of sensors.
    pub(super) fn sensors(&self) -> usize {
        self.measurands.len()
    }

    /// Watches of a run: the requested ones, followed by one for the maximum of each limit.
    pub(super) fn passing(&self, asked: &[Watch]) -> Passing {
        let sensor = |limit: usize| self.measurands.len() + limit;
        let limits = self.limits.iter().enumerate();
        let own = limits.map(|(l, limit)| Watch { sensor: sensor(l), value: self.measurand(limit).of_si(limit.maximum) });
        Passing::new(&asked.iter().copied().chain(own).collect::<Vec<_>>())
    }

    /// Readings (K or um), followed by the limited quantities at values of the variables (SI).
    pub(super) fn beside(&self, readings: &[f64], variables: &[f64]) -> Vec<f64> {
        let limited = self.limits.iter().map(|limit| limit.kind.value(|sensor| readings[sensor], |variable| variables[variable]));
        readings.iter().copied().chain(limited).collect()
    }

    /// Crossings of the requested watches, and the courses of the limits.
    pub(super) fn found(&self, passing: &Passing, bounds: Option<&Bounds<'_>>) -> (Vec<FirstPassings>, Vec<LimitCourse>) {
        let (mut crossings, mut courses) = (passing.found.clone(), Vec::new());
        let of_limits = crossings.split_off(crossings.len().saturating_sub(self.limits.len()));
        let known = |passed: Passed, sensors: &[usize]| {
            let within = bounds.map(|bounds| bounds.at(passed.at, sensors.iter().copied()) / passed.rate.abs());
            Passed { within, ..passed }
        };
        for crossing in &mut crossings {
            let sensor = crossing.watch.sensor;
            for passed in [&mut crossing.rising, &mut crossing.falling].into_iter().flatten() {
                *passed = known(*passed, &[sensor]);
            }
        }
        let extents = passing.extents.iter().skip(crossings.len());
        let start = passing.extents.first().map(|extent| extent.start);
        for ((limit, crossing), extent) in self.limits.iter().zip(of_limits).zip(extents) {
            let (measurand, maximum) = (self.measurand(limit), crossing.watch.value);
            let sensors: Vec<usize> = limit.kind.points().collect();
            let at_once = start.filter(|_| extent.first > maximum).map(Passed::in_a_jump);
            // A limit that is met exactly is kept.
            let broken = at_once.or(crossing.rising).filter(|_| extent.largest > maximum);
            courses.push(LimitCourse {
                largest: LimitState {
                    name: limit.name.clone(),
                    value: extent.largest,
                    maximum,
                    is_absolute: matches!(limit.kind, LimitKind::Maximum { .. }),
                    measurand,
                },
                at: extent.at,
                first_broken: broken.map(|passed| known(passed, &sensors)),
                bound: bounds.map(|bounds| bounds.at(extent.at, sensors.iter().copied())),
            });
        }
        (crossings, courses)
    }

    fn measurand(&self, limit: &MachineLimit) -> Measurand {
        limit.kind.points().next().and_then(|point| self.measurands.get(point)).copied().unwrap_or_default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn limit(name: &str, kind: LimitKind<Vec<usize>>, maximum: f64) -> MachineLimit {
        MachineLimit { name: name.into(), kind, maximum }
    }

    /// Two sensors that warm up in straight lines, and the ambient temperature as the only variable.
    #[test]
    fn every_kind_of_limit_is_followed() {
        let limits = [
            limit("hot", LimitKind::Maximum { point: 0 }, 310.0),
            limit("rise", LimitKind::Rise { point: 0, variable: 0 }, 4.0),
            limit("apart", LimitKind::Difference { first: 0, second: 1 }, 5.0),
            limit("spread", LimitKind::Spread(vec![0, 1]), -1.0),
        ];
        let measurands = [Measurand::Temperature; 2];
        let own = Limits::new(&limits, &measurands);
        let mut passing = own.passing(&[Watch { sensor: 1, value: 292.5 }]);
        for t in 0..=10 {
            let t = f64::from(t);
            passing.see(t, &own.beside(&[290.0 + t, 290.0 + 0.5 * t], &[290.0]));
        }
        passing.corner();
        let times = [0.0, 10.0];
        let bounds = [vec![0.1, 0.2], vec![0.1, 0.2]];
        let (crossings, courses) = own.found(&passing, Some(&Bounds { times: &times, bounds: &bounds }));
        let rising = crossings[0].rising.unwrap();
        // 0.2 K at 0.5 K/s.
        assert!((rising.at - 5.0).abs() < 1e-9 && (rising.within.unwrap() - 0.4).abs() < 1e-9, "{rising:?}");
        let at = |l: usize| courses[l].first_broken.map(|passed| passed.at);
        assert_eq!(crossings.len(), 1);
        assert_eq!((courses[0].largest.value, courses[0].largest.margin(), at(0)), (300.0, 10.0, None));
        assert!((at(1).unwrap() - 4.0).abs() < 1e-9, "{:?}", courses[1]);
        // Met at the very end, and not broken.
        assert_eq!((courses[2].largest.value, courses[2].at, at(2)), (5.0, 10.0, None));
        assert!((courses[2].bound.unwrap() - 0.3).abs() < 1e-12);
        // Broken from the beginning.
        assert_eq!(at(3), Some(0.0));
    }
}
