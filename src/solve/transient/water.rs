//! Water that moves: parcels in plug flow, exchanging heat with walls held at one temperature for an interval.
//!
//! Parcels are carried exactly as far as the flow goes and are never remapped to a grid, so a front at the
//! inlet stays as sharp as it came. Each parcel is cut where it starts or ends in another station; along
//! the path of a piece's middle the plug-flow solution in each station is exact. What the water loses is
//! what the wall gains, to rounding.

use crate::discretise::network::StreamState;
use crate::discretise::network::stream::Stream;

/// Parcels from inlet to outlet: volume m³ and temperature K.
pub type Parcels = Vec<(f64, f64)>;
/// What enters or leaves during an interval, in the order of time: share of the interval and temperature K.
pub type Flow = Vec<(f64, f64)>;

/// Parcels of one stream never become more than this many per station.
const MOST_PER_STATION: usize = 4;

/// A stream during an interval of constant flow.
#[derive(Debug, Clone)]
pub struct Passage {
    /// Capacity of the water in each station, J/K.
    capacity: Vec<f64>,
    /// End of each station, as the sum of capacities from the inlet, J/K.
    ends: Vec<f64>,
    /// Conductance to the wall of each station, W/K.
    conductance: Vec<f64>,
    /// Heating by dissipation in each station, W.
    dissipation: Vec<f64>,
    /// Share of the water's difference to the wall that is left after passing a whole station.
    left: Vec<f64>,
    /// Transfer units before each station, and before the end.
    units: Vec<f64>,
    /// Capacity rate of the flow, W/K.
    rate: f64,
    /// Duration, s.
    duration: f64,
    /// Capacity of a cubic metre, J/(m³ K).
    volumetric: f64,
}

/// What happened in an interval.
#[derive(Debug, Clone, Default)]
pub struct Carried {
    /// Parcels at its end.
    pub parcels: Parcels,
    /// Heat to the wall of each station, J.
    pub heat: Vec<f64>,
    /// Its derivative with respect to the station's own wall temperature, with the sign turned, J/K.
    pub weight: Vec<f64>,
    /// What left.
    pub outflow: Flow,
    /// Heat of dissipation, J.
    pub dissipated: f64,
}

impl Passage {
    /// A stream in the given state for `duration` s.
    pub fn new(stream: &Stream, state: &StreamState, duration: f64) -> Self {
        let area = std::f64::consts::PI / 4.0 * stream.diameter * stream.diameter;
        let capacity: Vec<f64> = stream.stations.iter().map(|s| state.volumetric_capacity * area * s.length).collect();
        let mut sum = 0.0;
        let ends = capacity
            .iter()
            .map(|c| {
                sum += c;
                sum
            })
            .collect();
        let rate = state.capacity_rate;
        let passes = |ua: &f64| if rate > 0.0 { ua / rate } else { 0.0 };
        let left = state.conductance.iter().map(|ua| (-passes(ua)).exp()).collect();
        let mut units = vec![0.0];
        state.conductance.iter().for_each(|ua| units.push(units[units.len() - 1] + passes(ua)));
        let dissipation = stream.stations.iter().map(|s| state.dissipation * s.length).collect();
        let conductance = state.conductance.clone();
        Self { capacity, ends, conductance, dissipation, left, units, rate, duration, volumetric: state.volumetric_capacity }
    }

    /// Volume of the channel, m³.
    pub fn volume(&self) -> f64 {
        self.content() / self.volumetric
    }

    /// Capacity of a cubic metre, J/(m³ K).
    pub fn volumetric(&self) -> f64 {
        self.volumetric
    }

    /// Capacity that enters, and leaves, during the interval, J/K.
    pub fn moved(&self) -> f64 {
        self.rate * self.duration
    }

    /// Capacity of all the water in the stream, J/K.
    pub fn content(&self) -> f64 {
        self.ends.last().copied().unwrap_or(0.0)
    }

    /// Carries `parcels` on while `inflow` enters, along walls at `wall` (K, by station).
    pub fn carry(&self, wall: &[f64], parcels: &Parcels, inflow: &Flow) -> Carried {
        let stations = self.capacity.len();
        let mut found = Carried { heat: vec![0.0; stations], weight: vec![0.0; stations], ..Carried::default() };
        let mut through = Through::new(self, wall);
        let (content, moved) = (self.content(), self.rate * self.duration);
        // Parcels fill the channel whatever its capacity is now.
        let held: f64 = parcels.iter().map(|p| p.0).sum();
        let scale = if held > 0.0 { content / held } else { 0.0 };
        let mut elements: Vec<(f64, f64, f64)> = Vec::with_capacity(parcels.len() + inflow.len());
        let mut at = 0.0;
        for (share, t) in inflow.iter().rev() {
            // The last to enter is at the inlet at the end of the interval: before it, everything lies upstream.
            elements.push((-moved + at, -moved + at + share * moved, *t));
            at += share * moved;
        }
        at = 0.0;
        for (volume, t) in parcels {
            elements.push((at, at + volume * scale, *t));
            at += volume * scale;
        }
        let mut kept: Vec<(f64, f64)> = Vec::new();
        let mut outflow: Vec<(f64, f64)> = Vec::new();
        for (from, to, t) in elements {
            // Pieces of one parcel join again as long as they stay smaller than a station.
            let mut joined: Option<(f64, f64)> = None;
            let mut start = from;
            while start < to {
                let end = self.next_cut(start, moved).min(to);
                let c = end - start;
                let middle = 0.5 * (start + end);
                let after = self.follow(middle, moved, t, c, wall, &mut found, &mut through);
                if middle + moved < content {
                    joined = match joined {
                        Some((c0, t0)) if c0 + c <= content / stations as f64 => Some((c0 + c, (c0 * t0 + c * after) / (c0 + c))),
                        earlier => {
                            kept.extend(earlier);
                            Some((c, after))
                        }
                    };
                } else {
                    outflow.push((c, after));
                }
                start = end;
            }
            kept.extend(joined);
        }
        through.settle(self, wall, &mut found);
        // The foremost leaves first.
        let total: f64 = outflow.iter().map(|o| o.0).sum();
        found.outflow = outflow.iter().rev().map(|(c, t)| (if total > 0.0 { c / total } else { 1.0 }, *t)).collect();
        found.parcels = self.merged(kept).into_iter().map(|(c, t)| (c / self.volumetric, t)).collect();
        found
    }

    /// The next place downstream of `start` where a piece must end: a station's end, or what reaches one.
    fn next_cut(&self, start: f64, moved: f64) -> f64 {
        let content = self.content();
        // Distances below this are rounding of the longest of them.
        let tiny = 1e-12 * (content + moved);
        // Water that passes all stations within the interval sees the same wherever it starts.
        let after = |x: f64| {
            if x < -tiny {
                return 0.0;
            }
            let i = self.ends.partition_point(|e| *e <= x + tiny);
            self.ends.get(i).copied().unwrap_or(f64::INFINITY)
        };
        let arrival = start + moved;
        let by_end = if arrival < content - tiny { after(arrival) - moved } else { f64::INFINITY };
        after(start).min(by_end).max(start + tiny)
    }

    /// Follows a piece of capacity `c` (J/K) from `start` over the distance `moved`; returns its last temperature.
    #[expect(clippy::too_many_arguments, reason = "a piece, its way, and where its heat is booked")]
    fn follow(&self, start: f64, moved: f64, t: f64, c: f64, wall: &[f64], found: &mut Carried, through: &mut Through) -> f64 {
        let content = self.content();
        let (at, to) = (start.max(0.0), (start + moved).min(content));
        let first = self.ends.partition_point(|e| *e <= at);
        if first == self.ends.len() {
            return t;
        }
        if self.rate <= 0.0 {
            let left = (-self.conductance[first] * self.duration / self.capacity[first]).exp();
            return self.pass(first, self.duration, left, t, c, wall, found);
        }
        let part = |k: usize, from: f64, to: f64, t: f64, found: &mut Carried| {
            let left = (-self.conductance[k] / self.rate * ((to - from) / self.capacity[k])).exp();
            self.pass(k, (to - from) / self.rate, left, t, c, wall, found)
        };
        // The rest of the station it is in, unless it stands at its beginning; whole stations; a part of the last one.
        let is_whole = to >= self.ends[first] && self.ends[first] - at > (1.0 - 1e-12) * self.capacity[first];
        let (mut t, from) = if is_whole { (t, first) } else { (part(first, at, self.ends[first].min(to), t, found), first + 1) };
        let until = self.ends.partition_point(|e| *e <= to).max(from);
        if until > from {
            t = through.pass(self, from, until, t, c);
        }
        match self.ends.get(until) {
            Some(end) if until > first && to > end - self.capacity[until] => {
                let begin = if until == 0 { 0.0 } else { self.ends[until - 1] };
                part(until, begin, to, t, found)
            }
            _ => t,
        }
    }

    /// A piece of capacity `c` (J/K) in a station for `time` (s), where `left` of its difference to the wall is left.
    #[expect(clippy::too_many_arguments, reason = "a piece, a station, and where its heat is booked")]
    fn pass(&self, k: usize, time: f64, left: f64, t: f64, c: f64, wall: &[f64], found: &mut Carried) -> f64 {
        let lost = (1.0 - left) * (t - wall[k]);
        let warmed = self.dissipation[k] * time / self.capacity[k];
        found.heat[k] += c * lost;
        found.weight[k] += c * (1.0 - left);
        found.dissipated += c * warmed;
        t + warmed - lost
    }

    /// Joins the smallest neighbours where parcels have become too many.
    fn merged(&self, mut parcels: Vec<(f64, f64)>) -> Vec<(f64, f64)> {
        let most = MOST_PER_STATION * self.capacity.len().max(4);
        if parcels.len() <= most {
            return parcels;
        }
        let least = self.content() / (0.5 * most as f64);
        let mut joined: Vec<(f64, f64)> = Vec::with_capacity(most);
        for (c, t) in parcels.drain(..) {
            match joined.last_mut() {
                Some((c0, t0)) if *c0 + c < least => {
                    *t0 = (*t0 * *c0 + t * c) / (*c0 + c);
                    *c0 += c;
                }
                _ => joined.push((c, t)),
            }
        }
        joined
    }

    /// Temperature (K) of the water at the end of each station: between the middles of the parcels around it, and
    /// at the outlet what left last.
    pub fn at_ends(&self, parcels: &Parcels, outflow: &Flow) -> Vec<f64> {
        let held: f64 = parcels.iter().map(|p| p.0).sum();
        let scale = self.content() / held;
        let mut at = 0.0;
        let middles: Vec<f64> = parcels
            .iter()
            .map(|(v, _)| {
                at += v * scale;
                at - 0.5 * v * scale
            })
            .collect();
        let between = |end: &f64| {
            let next = middles.partition_point(|m| m < end);
            match (next.checked_sub(1).and_then(|i| parcels.get(i)), parcels.get(next)) {
                (Some((_, t0)), Some((_, t1))) => t0 + (t1 - t0) * (end - middles[next - 1]) / (middles[next] - middles[next - 1]),
                (Some((_, t)), None) | (None, Some((_, t))) => *t,
                (None, None) => f64::NAN,
            }
        };
        let mut found: Vec<f64> = self.ends.iter().map(between).collect();
        if let (Some(last), Some((_, t))) = (found.last_mut(), outflow.last()) {
            *last = *t;
        }
        found
    }
}

/// What passes whole stations: each piece is booked where it enters and where it leaves, and followed at once, because every
/// difference to the water of one piece shrinks alike.
#[derive(Debug)]
struct Through {
    /// Temperature before each station, and at the end, of water that enters at the first wall's temperature, K.
    reference: Vec<f64>,
    /// Capacity that begins to pass at each station less what ends there, J/K, and the same times its difference to the reference, J.
    capacity: Vec<f64>,
    difference: Vec<f64>,
}

impl Through {
    fn new(passage: &Passage, wall: &[f64]) -> Self {
        let stations = passage.capacity.len();
        let mut reference = vec![wall.first().copied().unwrap_or(0.0)];
        for k in 0..stations {
            let before = reference[k];
            let warmed = if passage.rate > 0.0 { passage.dissipation[k] / passage.rate } else { 0.0 };
            reference.push(before + warmed - (1.0 - passage.left[k]) * (before - wall[k]));
        }
        Self { reference, capacity: vec![0.0; stations + 1], difference: vec![0.0; stations + 1] }
    }

    /// A piece of capacity `c` (J/K) passes the stations `from..until`; returns its temperature behind them, K.
    fn pass(&mut self, passage: &Passage, from: usize, until: usize, t: f64, c: f64) -> f64 {
        let begun = t - self.reference[from];
        let ended = begun * (passage.units[from] - passage.units[until]).exp();
        self.capacity[from] += c;
        self.capacity[until] -= c;
        self.difference[from] += c * begun;
        self.difference[until] -= c * ended;
        self.reference[until] + ended
    }

    /// Books the heat of all that passed.
    fn settle(&self, passage: &Passage, wall: &[f64], found: &mut Carried) {
        if passage.rate <= 0.0 {
            return;
        }
        let (mut capacity, mut difference) = (0.0, 0.0);
        for (k, wall) in wall.iter().enumerate() {
            capacity += self.capacity[k];
            difference += self.difference[k];
            let share = 1.0 - passage.left[k];
            found.heat[k] += share * (capacity * (self.reference[k] - wall) + difference);
            found.weight[k] += share * capacity;
            found.dissipated += capacity * passage.dissipation[k] / passage.rate;
            difference *= passage.left[k];
        }
    }
}

/// Outflows that mix, each with its weight: one flow of their common temperature.
pub fn mixed(flows: &[(&Flow, f64)]) -> Flow {
    if let [(flow, _)] = flows {
        return (*flow).clone();
    }
    let mut at: Vec<(usize, f64)> = vec![(0, 0.0); flows.len()];
    let mut found = Flow::new();
    let mut now = 0.0;
    while now < 1.0 - 1e-12 {
        // The next moment at which one of them changes.
        let next =
            flows.iter().zip(&at).filter_map(|((flow, _), (i, begun))| flow.get(*i).map(|(share, _)| begun + share)).fold(1.0, f64::min);
        let t: f64 = flows.iter().zip(&at).filter_map(|((flow, w), (i, _))| flow.get(*i).or(flow.last()).map(|(_, t)| w * t)).sum();
        if next > now {
            found.push((next - now, t));
        }
        for ((flow, _), (i, begun)) in flows.iter().zip(&mut at) {
            while flow.get(*i).is_some_and(|(share, _)| *begun + share <= next + 1e-12) {
                *begun += flow[*i].0;
                *i += 1;
            }
        }
        now = next;
        if flows.iter().zip(&at).all(|((flow, _), (i, _))| *i >= flow.len()) {
            break;
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    const STATIONS: usize = 12;

    /// A channel of unlike stations, 0.5 W of dissipation in each metre.
    fn passage(duration: f64) -> Passage {
        let capacity: Vec<f64> = (0..STATIONS).map(|k| 10.0 + 3.0 * (k % 4) as f64).collect();
        let conductance: Vec<f64> = (0..STATIONS).map(|k| 4.0 + (k % 3) as f64).collect();
        let rate = 25.0;
        let mut sums = (0.0, 0.0);
        let mut ends = Vec::new();
        let mut units = vec![0.0];
        for (c, ua) in capacity.iter().zip(&conductance) {
            sums = (sums.0 + c, sums.1 + ua / rate);
            ends.push(sums.0);
            units.push(sums.1);
        }
        let left = conductance.iter().map(|ua| (-ua / rate).exp()).collect();
        Passage { capacity, ends, conductance, dissipation: vec![0.5; STATIONS], left, units, rate, duration, volumetric: 4.18e6 }
    }

    fn walls() -> Vec<f64> {
        (0..STATIONS).map(|k| 300.0 + 7.0 * (1.3 * k as f64).sin()).collect()
    }

    /// Water of uneven temperature moved by less than a station, by some, and by several fillings: what it loses the walls gain, and
    /// a first piece of it comes out as station by station.
    #[test]
    fn what_the_water_loses_the_walls_gain() {
        for duration in [0.1, 3.0, 7.3, 200.0] {
            let (passage, walls) = (passage(duration), walls());
            let content = passage.content();
            let parcels: Parcels = (0..30).map(|i| (content / 30.0 / passage.volumetric, 290.0 + 15.0 * f64::from(i % 5))).collect();
            let inflow: Flow = vec![(0.3, 295.0), (0.7, 310.0)];
            let found = passage.carry(&walls, &parcels, &inflow);
            let moved = passage.moved();
            let held = |p: &Parcels| p.iter().map(|(v, t)| v * passage.volumetric * t).sum::<f64>();
            let flow = |f: &Flow| f.iter().map(|(share, t)| moved * share * t).sum::<f64>();
            let lost = held(&parcels) + flow(&inflow) - held(&found.parcels) - flow(&found.outflow) + found.dissipated;
            let gained: f64 = found.heat.iter().sum();
            assert!((lost - gained).abs() < 1e-12 * (content + moved) * 300.0, "{duration} s: {lost} J, {gained} J");
            // The last water to leave in a long time entered at 310 K and passed every station.
            if duration > 100.0 {
                let step = |t: f64, k: usize| t + passage.dissipation[k] / passage.rate - (1.0 - passage.left[k]) * (t - walls[k]);
                let expected = (0..STATIONS).fold(310.0, step);
                let last = found.outflow.last().unwrap().1;
                assert!((last - expected).abs() < 1e-11, "{last} K, {expected} K");
            }
            // With walls one kelvin warmer each takes as much less as its weight says.
            for k in [0, 5, STATIONS - 1] {
                let mut warmer = walls.clone();
                warmer[k] += 1.0;
                let change = found.heat[k] - passage.carry(&warmer, &parcels, &inflow).heat[k];
                assert!((change - found.weight[k]).abs() < 1e-9 * found.weight[k].max(1.0), "{duration} s, station {k}: {change} J/K");
            }
        }
    }
}
