//! Stretches of a schedule from corner to corner, and where steps must end in them.

use std::ops::Range;

use super::Stop;
use crate::describe::machine::Condition;
use crate::discretise::network::{Network, SensorTerm};
use crate::explore::schedule::Schedule;
use crate::solve::transient::{GAMMA, TransientState};

/// Values that differ by less than this share of their size run on straight: those between two rows are rounded.
const STRAIGHT: f64 = 1e-12;

/// Stops between two corners of the schedule, the one at its end included.
#[derive(Debug, Clone)]
pub(super) struct Stretch<'s> {
    schedule: &'s Schedule,
    stops: &'s [Stop],
    /// Index of the first one.
    first: usize,
}

impl<'s> Stretch<'s> {
    /// All stretches of a schedule whose stops begin at its start.
    pub fn all(schedule: &'s Schedule, stops: &'s [Stop]) -> Vec<Self> {
        let mut firsts = corners(schedule, stops);
        firsts.push(stops.len());
        firsts.windows(2).map(|ends| Self { schedule, stops: &stops[ends[0]..ends[1]], first: ends[0] }).collect()
    }

    /// Its stops, as indices among all.
    pub fn range(&self) -> Range<usize> {
        self.first..self.first + self.stops.len()
    }

    /// Where it begins and ends, s.
    pub fn ends(&self) -> (f64, f64) {
        (self.stops[0].segment.from, self.stops[self.stops.len() - 1].time)
    }

    /// The condition at a time in it, s, its ends included.
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

/// Until when water of before the corner may be in the channels, and whether readings of water bend too much to be read within steps.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Fronts {
    /// s
    pub until: f64,
    /// Whether the last step's readings of water bent so.
    pub are_near: bool,
}

/// Whether a sensor reads water that moves.
pub(super) fn reads_water(network: &Network, sensor: &SensorTerm) -> bool {
    sensor.weights.iter().any(|(node, _)| *node as usize >= network.solids)
}

/// How far readings of water between the beginning and the end of the last step are from the straight line, K.
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
    use crate::explore::schedule::Row;

    /// Rows of a log on one line are no corners; a jump, a bend and its end are.
    #[test]
    fn rows_on_a_line_are_no_corners() {
        let row = |(time, value): (f64, f64)| Row { time, values: vec![value, 3.0] };
        let rows = [(0.0, 1.0), (1.0, 1.0), (4.0, 1.0), (4.0, 2.0), (6.0, 2.4), (9.0, 3.0), (10.0, 3.0), (11.0, 3.0)];
        let schedule = Schedule::from_rows(rows.map(row).to_vec()).unwrap();
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
