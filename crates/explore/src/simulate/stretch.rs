//! Stretches of a schedule from corner to corner, and the outputs at which steps must end.

use std::ops::Range;

use super::Stop;
use crate::schedule::Schedule;
use coldplate_describe::machine::Condition;
use coldplate_network::{Network, SensorTerm};
use coldplate_solve::transient::TransientState;
use coldplate_solve::transient::tr_bdf2::GAMMA;

/// Values that differ from a straight line by less than this share of their size lie on it: values between two rows are
/// rounded. Chosen: far above rounding.
const STRAIGHT: f64 = 1e-12;

/// Stops between two corners of the schedule, the one at its end included.
#[derive(Debug, Clone)]
pub(super) struct Stretch<'s> {
    schedule: &'s Schedule,
    stops: &'s [Stop],
    /// Index of the first stop.
    first: usize,
}

impl<'s> Stretch<'s> {
    /// All stretches of a schedule whose stops begin at its start.
    pub fn all(schedule: &'s Schedule, stops: &'s [Stop]) -> Vec<Self> {
        let mut firsts = corners(schedule, stops);
        firsts.push(stops.len());
        firsts.windows(2).map(|ends| Self { schedule, stops: &stops[ends[0]..ends[1]], first: ends[0] }).collect()
    }

    /// Indices of the stretch's stops among all.
    pub fn range(&self) -> Range<usize> {
        self.first..self.first + self.stops.len()
    }

    /// Start and end of the stretch, s.
    pub fn ends(&self) -> (f64, f64) {
        (self.stops[0].segment.from, self.stops[self.stops.len() - 1].time)
    }

    /// The condition at a time of the stretch, s, its ends included.
    pub fn condition(&self, time: f64) -> Condition {
        let at = self.stops.partition_point(|stop| stop.time < time).min(self.stops.len() - 1);
        self.schedule.condition(self.stops[at].segment, time)
    }
}

/// The stops, as indices, behind the corners of a schedule: the first of every stretch.
pub(super) fn corners(schedule: &Schedule, stops: &[Stop]) -> Vec<usize> {
    (1..stops.len()).filter(|at| is_corner(schedule, stops, *at)).collect()
}

/// Whether the schedule has a corner between a stop and the one before it.
fn is_corner(schedule: &Schedule, stops: &[Stop], at: usize) -> bool {
    let (before, behind) = (stops[at - 1].segment, stops[at].segment);
    if at == 1 || behind == before {
        return at == 1;
    }
    let has_length = before.until > before.from && behind.until > behind.from;
    if !has_length || behind.row != before.row + 1 {
        return true;
    }
    let runs_on = |first: f64, here: f64, last: f64| {
        let share = (behind.from - before.from) / (behind.until - before.from);
        (first + share * (last - first) - here).abs() <= STRAIGHT * first.abs().max(last.abs())
    };
    let [first, here] = [before.from, before.until].map(|time| schedule.condition(before, time));
    let [there, last] = [behind.from, behind.until].map(|time| schedule.condition(behind, time));
    here != there || !first.si().iter().zip(here.si()).zip(last.si()).all(|((first, here), last)| runs_on(*first, *here, *last))
}

/// End of the time in which water of before the corner may be in the channels, and whether readings of water bend too much to
/// be read within steps.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Fronts {
    /// End of the time with water of before the corner, s.
    pub until: f64,
    /// Whether readings of water bent too much in the last step.
    pub are_near: bool,
}

/// Whether a sensor reads water that moves.
pub(super) fn reads_water(network: &Network, sensor: &SensorTerm) -> bool {
    sensor.weights.iter().any(|(node, _)| *node as usize >= network.solids)
}

/// Largest distance of readings of water within the last step from a straight line, K.
pub(super) fn unevenness(network: &Network, state: &TransientState) -> f64 {
    let Some(before) = &state.before else { return 0.0 };
    let uneven = |sensor: &SensorTerm| {
        let part = |(node, weight): &(u32, f64)| {
            let [begin, between, end] = [&before.temperatures, &before.between, &state.temperatures].map(|t| t[*node as usize]);
            weight * (between - begin - GAMMA * (end - begin))
        };
        sensor.weights.iter().map(part).sum::<f64>().abs()
    };
    network.sensors.iter().filter(|sensor| reads_water(network, sensor)).map(uneven).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::super::stops;
    use super::*;
    use crate::schedule::Breakpoint;

    /// Rows of a log on one line are no corners; a jump, a bend and its end are.
    #[test]
    fn rows_on_a_line_are_no_corners() {
        let row = |(time, value): (f64, f64)| Breakpoint { time, values: vec![value, 3.0] };
        let rows = [(0.0, 1.0), (1.0, 1.0), (4.0, 1.0), (4.0, 2.0), (6.0, 2.4), (9.0, 3.0), (10.0, 3.0), (11.0, 3.0)];
        let schedule = Schedule::from_rows(rows.map(row).to_vec(), &[]).unwrap();
        let stops = stops(&schedule, Some(0.5)).unwrap();
        let stretches = Stretch::all(&schedule, &stops);
        let ends: Vec<(f64, f64)> = stretches.iter().map(Stretch::ends).collect();
        assert_eq!(ends, [(0.0, 4.0), (4.0, 4.0), (4.0, 9.0), (9.0, 11.0)]);
        assert_eq!(stretches.iter().map(|s| s.range().len()).sum::<usize>(), stops.len() - 1);
        for (time, value) in [(4.0, 2.0), (5.0, 2.2), (6.0, 2.4), (7.5, 2.7), (9.0, 3.0)] {
            assert!((stretches[2].condition(time).si()[0] - value).abs() < 1e-14, "{time} s");
        }
    }
}
