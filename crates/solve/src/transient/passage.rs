//! A stream during an interval of constant flow: how far its water goes, and the stations that each place in it passes.
//!
//! Along the path of a place in plug flow the temperature follows the exact solution in each station, whose wall is held at one
//! temperature.

use super::parcels::{Parcel, Parcels};
use coldplate_network::StreamState;
use coldplate_network::stream::Stream;

/// Most parcels of one stream per station, a count. Chosen: sharpness of fronts against cost.
const MOST_PER_STATION: usize = 4;
/// Distances below this share of the water in the stream and the water that moves are rounding, dimensionless. Chosen.
const ROUNDING: f64 = 1e-12;

/// A stream during an interval of constant flow.
#[derive(Debug, Clone)]
pub(super) struct Passage {
    /// Capacity of the water in each station, J/K.
    pub capacity: Vec<f64>,
    /// End of each station, as the sum of capacities from the inlet, J/K.
    ends: Vec<f64>,
    /// Conductance to the wall of each station, W/K.
    conductance: Vec<f64>,
    /// Heating by dissipation in each station, W.
    dissipation: Vec<f64>,
    /// Share of the water's difference to the wall that is left after passing a whole station.
    pub left: Vec<f64>,
    /// Transfer units before each station, and before the end.
    units: Vec<f64>,
    /// Capacity rate of the flow, W/K.
    pub rate: f64,
    /// Duration, s.
    duration: f64,
    /// Capacity of a cubic metre, J/(m³ K).
    pub volumetric: f64,
}

/// A stretch of a way within one station.
#[derive(Debug, Clone, Copy)]
pub(super) struct StationPart {
    pub station: u32,
    /// Share of the difference to the wall that is given off in it.
    pub given: f64,
    /// Temperature rise by dissipation in it, K.
    pub warmed: f64,
}

/// The way of a place in the water over an interval.
#[derive(Debug, Clone, Copy)]
pub(super) struct Way {
    /// The rest of the station it stands in.
    pub begin: Option<StationPart>,
    /// First station that it passes whole, the station behind the last of these, and the share of a difference left behind them.
    pub from: u32,
    pub until: u32,
    pub passed: f64,
    /// The part of the station in which it comes to stand.
    pub end: Option<StationPart>,
}

/// The stations in which the last place looked for began and ended: the next one lies near.
#[derive(Debug, Default)]
pub(super) struct Nearest {
    start: usize,
    end: usize,
}

impl Passage {
    /// A stream in the given state for `duration` s.
    pub fn new(stream: &Stream, state: &StreamState, duration: f64) -> Self {
        let area = std::f64::consts::PI / 4.0 * stream.diameter * stream.diameter;
        let capacity = stream.stations.iter().map(|s| state.volumetric_capacity * area * s.length).collect();
        let dissipation = stream.stations.iter().map(|s| state.dissipation * s.length).collect();
        Self::of(capacity, state.conductance.clone(), dissipation, [state.capacity_rate, duration, state.volumetric_capacity])
    }

    /// A stream from the capacity (J/K), the conductance to the wall (W/K) and the dissipation (W) of each station; capacity rate
    /// (W/K), duration (s) and capacity of a cubic metre (J/(m³ K)).
    pub fn of(capacity: Vec<f64>, conductance: Vec<f64>, dissipation: Vec<f64>, [rate, duration, volumetric]: [f64; 3]) -> Self {
        let mut sum = 0.0;
        let ends = capacity
            .iter()
            .map(|c| {
                sum += c;
                sum
            })
            .collect();
        let passes = |ua: &f64| if rate > 0.0 { ua / rate } else { 0.0 };
        let left = conductance.iter().map(|ua| (-passes(ua)).exp()).collect();
        let mut units = vec![0.0];
        conductance.iter().for_each(|ua| units.push(units[units.len() - 1] + passes(ua)));
        Self { capacity, ends, conductance, dissipation, left, units, rate, duration, volumetric }
    }

    /// This passage without dissipation.
    pub(crate) fn calm(&self) -> Self {
        Self { dissipation: vec![0.0; self.dissipation.len()], ..self.clone() }
    }

    /// Number of stations.
    pub fn stations(&self) -> usize {
        self.capacity.len()
    }

    /// Volume of the channel, m³.
    pub fn volume(&self) -> f64 {
        self.content() / self.volumetric
    }

    /// Capacity that enters, and leaves, during the interval, J/K.
    pub fn moved(&self) -> f64 {
        self.rate * self.duration
    }

    /// Capacity of all the water in the stream, J/K.
    pub fn content(&self) -> f64 {
        self.ends.last().copied().unwrap_or(0.0)
    }

    /// Distance below which all is rounding, J/K.
    pub fn tiny(&self) -> f64 {
        ROUNDING * (self.content() + self.moved())
    }

    /// Temperature rise by dissipation of water that passes a whole station, K.
    pub fn warmed(&self, station: usize) -> f64 {
        if self.rate > 0.0 { self.dissipation[station] / self.rate } else { 0.0 }
    }

    /// The next place downstream of `start` where a piece must end: a station's end, or a place that reaches one in the interval.
    pub(crate) fn next_cut(&self, start: f64, near: &mut Nearest) -> f64 {
        let (content, moved, tiny) = (self.content(), self.moved(), self.tiny());
        // Water that passes all stations within the interval sees all of them wherever it starts.
        let after = |x: f64, near: &mut usize| {
            if x < -tiny {
                return 0.0;
            }
            let i = passed(&self.ends, x + tiny, near);
            self.ends.get(i).copied().unwrap_or(f64::INFINITY)
        };
        let arrival = start + moved;
        let by_end = if arrival < content - tiny { after(arrival, &mut near.end) - moved } else { f64::INFINITY };
        after(start, &mut near.start).min(by_end).max(start + tiny)
    }

    /// The way of flowing water from `start`.
    pub fn way(&self, start: f64, near: &mut Nearest) -> Way {
        let (at, to) = (start.max(0.0), (start + self.moved()).min(self.content()));
        let first = passed(&self.ends, at, &mut near.start);
        if first == self.ends.len() {
            return Way { begin: None, from: first as u32, until: first as u32, passed: 1.0, end: None };
        }
        let part = |station: usize, from: f64, to: f64| {
            let share = (to - from) / self.capacity[station];
            let given = 1.0 - (-self.conductance[station] / self.rate * share).exp();
            StationPart { station: station as u32, given, warmed: self.dissipation[station] / self.rate * share }
        };
        // The rest of the station it is in, unless it stands at its beginning; whole stations; a part of the last one.
        let is_whole = to >= self.ends[first] && self.ends[first] - at > (1.0 - 1e-12) * self.capacity[first];
        let begin = (!is_whole).then(|| part(first, at, self.ends[first].min(to)));
        let from = if is_whole { first } else { first + 1 };
        let until = passed(&self.ends, to, &mut near.end).max(from);
        let passed = if until > from { (self.units[from] - self.units[until]).exp() } else { 1.0 };
        let end = match self.ends.get(until) {
            Some(end) if until > first && to > end - self.capacity[until] => {
                Some(part(until, if until == 0 { 0.0 } else { self.ends[until - 1] }, to))
            }
            _ => None,
        };
        Way { begin, from: from as u32, until: until as u32, passed, end }
    }

    /// The way of water at rest, in the station of a place.
    pub fn rest(&self, place: f64) -> Way {
        let station = self.ends.partition_point(|e| *e <= place).min(self.ends.len() - 1);
        let given = 1.0 - (-self.conductance[station] * self.duration / self.capacity[station]).exp();
        let warmed = self.dissipation[station] * self.duration / self.capacity[station];
        let part = StationPart { station: station as u32, given, warmed };
        Way { begin: Some(part), from: station as u32, until: station as u32, passed: 1.0, end: None }
    }

    /// Temperature (K) before each station, and at the end, of water that enters at the first wall's temperature.
    pub fn reference(&self, wall: &[f64]) -> Vec<f64> {
        let mut found = Vec::with_capacity(wall.len() + 1);
        let mut t = wall.first().copied().unwrap_or(0.0);
        found.push(t);
        for (k, wall) in wall.iter().enumerate() {
            t += self.warmed(k) - (1.0 - self.left[k]) * (t - wall);
            found.push(t);
        }
        found
    }

    /// The parcels, scaled to the volume of the channel.
    pub fn fitted(&self, parcels: &Parcels) -> Parcels {
        let held: f64 = parcels.iter().map(|p| p.volume).sum();
        let scale = self.volume() / held;
        parcels.iter().map(|p| Parcel { volume: p.volume * scale, ..*p }).collect()
    }

    /// Parcels, given with their capacity (J/K) for a volume; small neighbours are joined if there are too many.
    pub fn merged(&self, parcels: Parcels) -> Parcels {
        let most = MOST_PER_STATION * self.stations().max(4);
        if parcels.len() <= most {
            return parcels;
        }
        let least = self.content() / (0.5 * most as f64);
        let mut found: Parcels = Vec::with_capacity(most);
        for parcel in parcels {
            match found.last_mut() {
                Some(last) if last.volume + parcel.volume < least => *last = last.joined(parcel),
                _ => found.push(parcel),
            }
        }
        found
    }

    /// Temperature (K) of the water at the end of each station; at the outlet: that of the parcel that left last, if one left.
    pub fn at_ends(&self, parcels: &Parcels, outlet: Option<f64>) -> Vec<f64> {
        let held: f64 = parcels.iter().map(|p| p.volume).sum();
        let scale = self.content() / held;
        let (mut at, mut next) = (0.0, 0);
        let mut found: Vec<f64> = Vec::with_capacity(self.ends.len());
        for end in &self.ends {
            while next + 1 < parcels.len() && at + parcels[next].volume * scale < *end {
                at += parcels[next].volume * scale;
                next += 1;
            }
            found.push(
                parcels
                    .get(next)
                    .map_or(f64::NAN, |p| p.upstream + (p.downstream - p.upstream) * ((end - at) / (p.volume * scale)).clamp(0.0, 1.0)),
            );
        }
        if let (Some(last), Some(outlet)) = (found.last_mut(), outlet) {
            *last = outlet;
        }
        found
    }
}

/// Number of ascending ends that do not lie behind `x`, searched from the place found last.
fn passed(ends: &[f64], x: f64, near: &mut usize) -> usize {
    while *near > 0 && ends[*near - 1] > x {
        *near -= 1;
    }
    while ends.get(*near).is_some_and(|end| *end <= x) {
        *near += 1;
    }
    *near
}
