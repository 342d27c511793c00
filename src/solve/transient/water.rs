//! Water that moves: parcels in plug flow, exchanging heat with walls held at one temperature for an interval.
//!
//! Parcels are carried exactly as far as the flow goes and are never remapped to a grid, so a front at the
//! inlet stays as sharp as it came. Temperature runs straight from one end of a parcel to the other. Each
//! parcel is cut where it starts or ends in another station; along the paths of a piece's two ends the
//! plug-flow solution in each station is exact. What the water loses is what the wall gains, to rounding.

use std::sync::OnceLock;

use super::parcels::{Flow, Parcel, Parcels, Share};
use crate::discretise::network::StreamState;
use crate::discretise::network::stream::Stream;

/// Parcels of one stream never become more than this many per station.
const MOST_PER_STATION: usize = 4;
/// Distances below this share of what water there is and what moves are rounding.
const ROUNDING: f64 = 1e-12;

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
    /// How the water that was carried first is cut: the same water is carried along one wall after another.
    plan: OnceLock<Plan>,
}

/// How water is cut into pieces, and the way of each piece's ends: whatever the temperatures are.
#[derive(Debug, Clone)]
struct Plan {
    /// Where each parcel begins and its capacity, J/K.
    parcels: Vec<[f64; 2]>,
    pieces: Vec<Piece>,
}

/// A piece of a parcel.
#[derive(Debug, Clone, Copy)]
struct Piece {
    parcel: usize,
    start: f64,
    end: f64,
    /// Of its upstream and its downstream end; none of what stands still.
    ways: Option<[Way; 2]>,
}

impl Plan {
    fn is_of(&self, elements: &[(f64, Parcel)]) -> bool {
        self.parcels.len() == elements.len() && self.parcels.iter().zip(elements).all(|(own, (from, p))| *own == [*from, p.volume])
    }
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
        let (volumetric, plan) = (state.volumetric_capacity, OnceLock::new());
        Self { capacity, ends, conductance, dissipation, left, units, rate, duration, volumetric, plan }
    }

    /// The same without dissipation.
    pub fn calm(&self) -> Self {
        Self { dissipation: vec![0.0; self.dissipation.len()], ..self.clone() }
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
        let held: f64 = parcels.iter().map(|p| p.volume).sum();
        let scale = if held > 0.0 { content / held } else { 0.0 };
        // Where each begins, and itself with its capacity for its volume, J/K.
        let mut elements: Vec<(f64, Parcel)> = Vec::with_capacity(parcels.len() + inflow.len());
        let mut at = 0.0;
        for entered in inflow.iter().rev() {
            // The last to enter is at the inlet at the end of the interval: before it, everything lies upstream.
            let volume = entered.share * moved;
            elements.push((-moved + at, Parcel { volume, upstream: entered.last, downstream: entered.first }));
            at += volume;
        }
        at = 0.0;
        for parcel in parcels {
            let volume = parcel.volume * scale;
            elements.push((at, Parcel { volume, ..*parcel }));
            at += volume;
        }
        let mut kept: Parcels = Vec::with_capacity(elements.len() + stations);
        let mut outflow: Parcels = Vec::new();
        let known = self.plan.get_or_init(|| self.planned(&elements, moved));
        let other = (!known.is_of(&elements)).then(|| self.planned(&elements, moved));
        // Pieces of one parcel join again as long as they stay smaller than a station.
        let (mut joined, mut of): (Option<Parcel>, usize) = (None, 0);
        let pieces = &other.as_ref().unwrap_or(known).pieces;
        // Where one piece of a parcel ends and the next begins both take one way, which is followed once for the halves of both.
        let mut arrived: Option<f64> = None;
        for (i, Piece { parcel, start, end, ways }) in pieces.iter().enumerate() {
            if *parcel != of {
                kept.extend(joined.take());
                of = *parcel;
            }
            let (from, whole) = elements[*parcel];
            let at = |x: f64| whole.upstream + (whole.downstream - whole.upstream) * ((x - from) / whole.volume);
            let piece = Parcel { volume: end - start, upstream: at(*start), downstream: at(*end) };
            let after = match ways {
                Some([upstream, downstream]) => {
                    let half = 0.5 * piece.volume;
                    let first = match arrived.take() {
                        Some(first) => first,
                        None => self.follow(upstream, piece.upstream, half, wall, &mut found, &mut through),
                    };
                    let next = pieces.get(i + 1).filter(|next| next.parcel == *parcel);
                    let both = half + next.map_or(0.0, |next| 0.5 * (next.end - next.start));
                    let last = self.follow(downstream, piece.downstream, both, wall, &mut found, &mut through);
                    arrived = next.map(|_| last);
                    Parcel { upstream: first, downstream: last, ..piece }
                }
                None => self.at_rest(*start, piece, wall, &mut found),
            };
            if f64::midpoint(*start, *end) + moved < content {
                joined = match joined {
                    Some(before) if before.volume + after.volume <= content / stations as f64 => Some(before.joined(after)),
                    earlier => {
                        kept.extend(earlier);
                        Some(after)
                    }
                };
            } else {
                outflow.push(after);
            }
        }
        kept.extend(joined);
        through.settle(self, wall, &mut found);
        // The foremost leaves first.
        let total: f64 = outflow.iter().map(|o| o.volume).sum();
        let share = |c: f64| if total > 0.0 { c / total } else { 1.0 };
        found.outflow = outflow.iter().rev().map(|o| Share { share: share(o.volume), first: o.downstream, last: o.upstream }).collect();
        found.parcels = self.merged(kept).into_iter().map(|p| Parcel { volume: p.volume / self.volumetric, ..p }).collect();
        found
    }

    /// Cuts water, each parcel with where it begins and its capacity (J/K) for its volume, and finds the ways of the pieces.
    fn planned(&self, elements: &[(f64, Parcel)], moved: f64) -> Plan {
        let mut pieces = Vec::with_capacity(elements.len() + 2 * self.capacity.len());
        let mut last: Option<(f64, Way)> = None;
        let mut near = Nearest::default();
        let tiny = ROUNDING * (self.content() + moved);
        for (parcel, (from, whole)) in elements.iter().enumerate() {
            let (mut start, to) = (*from, from + whole.volume);
            while start < to {
                let cut = self.next_cut(start, moved, &mut near);
                // No slivers: whether there is one would be a matter of rounding, and each counts as a parcel.
                let end = if cut < to - tiny { cut } else { to };
                // Where one piece ends the next one begins: both take the same way.
                let ways = (self.rate > 0.0).then(|| {
                    let upstream = last.take().filter(|(at, _)| *at == start).map(|(_, way)| way);
                    [upstream.unwrap_or_else(|| self.way(start, moved, &mut near)), self.way(end, moved, &mut near)]
                });
                last = ways.map(|[_, downstream]| (end, downstream));
                pieces.push(Piece { parcel, start, end, ways });
                start = end;
            }
        }
        Plan { parcels: elements.iter().map(|(from, p)| [*from, p.volume]).collect(), pieces }
    }

    /// A piece, its capacity (J/K) for its volume, that begins at `start` and stays there: what stands still stands in one station.
    fn at_rest(&self, start: f64, piece: Parcel, wall: &[f64], found: &mut Carried) -> Parcel {
        let middle = start + 0.5 * piece.volume;
        let station = self.ends.partition_point(|e| *e <= middle).min(self.ends.len() - 1);
        let left = (-self.conductance[station] * self.duration / self.capacity[station]).exp();
        let part = Part { station, time: self.duration, left };
        // Half of the heat is booked with either end.
        let upstream = self.pass(&part, piece.upstream, 0.5 * piece.volume, wall, found);
        let downstream = self.pass(&part, piece.downstream, 0.5 * piece.volume, wall, found);
        Parcel { upstream, downstream, ..piece }
    }

    /// The next place downstream of `start` where a piece must end: a station's end, or what reaches one.
    fn next_cut(&self, start: f64, moved: f64, near: &mut Nearest) -> f64 {
        let content = self.content();
        let tiny = ROUNDING * (content + moved);
        // Water that passes all stations within the interval sees the same wherever it starts.
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

    /// The way of what stands at `start` over the distance `moved`.
    fn way(&self, start: f64, moved: f64, near: &mut Nearest) -> Way {
        let content = self.content();
        let (at, to) = (start.max(0.0), (start + moved).min(content));
        let first = passed(&self.ends, at, &mut near.start);
        if first == self.ends.len() {
            return Way { begin: None, from: first, until: first, passed: 1.0, end: None };
        }
        let part = |station: usize, from: f64, to: f64| {
            let left = (-self.conductance[station] / self.rate * ((to - from) / self.capacity[station])).exp();
            Part { station, time: (to - from) / self.rate, left }
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
        Way { begin, from, until, passed, end }
    }

    /// Follows a capacity `c` (J/K) on its way; returns its last temperature.
    fn follow(&self, way: &Way, t: f64, c: f64, wall: &[f64], found: &mut Carried, through: &mut Through) -> f64 {
        let mut t = way.begin.iter().fold(t, |t, part| self.pass(part, t, c, wall, found));
        if way.until > way.from {
            t = through.pass(way, t, c);
        }
        way.end.iter().fold(t, |t, part| self.pass(part, t, c, wall, found))
    }

    /// A piece of capacity `c` (J/K) in a part of a station.
    fn pass(&self, part: &Part, t: f64, c: f64, wall: &[f64], found: &mut Carried) -> f64 {
        let Part { station: k, time, left } = *part;
        let lost = (1.0 - left) * (t - wall[k]);
        let warmed = self.dissipation[k] * time / self.capacity[k];
        found.heat[k] += c * lost;
        found.weight[k] += c * (1.0 - left);
        found.dissipated += c * warmed;
        t + warmed - lost
    }

    /// Joins the smallest neighbours where parcels have become too many.
    fn merged(&self, parcels: Parcels) -> Parcels {
        let most = MOST_PER_STATION * self.capacity.len().max(4);
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

    /// Temperature (K) of the water at the end of each station, and at the outlet of what left last.
    pub fn at_ends(&self, parcels: &Parcels, outflow: &Flow) -> Vec<f64> {
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
        if let (Some(outlet), Some(left)) = (found.last_mut(), outflow.last()) {
            *outlet = left.last;
        }
        found
    }
}

/// The stations in which the last place looked for began and ended: the next one lies near.
#[derive(Debug, Default)]
struct Nearest {
    start: usize,
    end: usize,
}

/// How many of ascending ends do not lie behind `x`, looked for from where the last one was found.
fn passed(ends: &[f64], x: f64, near: &mut usize) -> usize {
    while *near > 0 && ends[*near - 1] > x {
        *near -= 1;
    }
    while ends.get(*near).is_some_and(|end| *end <= x) {
        *near += 1;
    }
    *near
}

/// A stretch of a way within one station: for how long (s), and the share of the difference to the wall that is left behind it.
#[derive(Debug, Clone, Copy)]
struct Part {
    station: usize,
    time: f64,
    left: f64,
}

/// The way of a place in the water over an interval.
#[derive(Debug, Clone, Copy)]
struct Way {
    /// The rest of the station it stands in.
    begin: Option<Part>,
    /// The first station that it passes whole, the one behind the last of these, and the share of a difference left behind them.
    from: usize,
    until: usize,
    passed: f64,
    /// The part of the one it comes to stand in.
    end: Option<Part>,
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

    /// A piece of capacity `c` (J/K) passes the whole stations of its way; returns its temperature behind them, K.
    fn pass(&mut self, way: &Way, t: f64, c: f64) -> f64 {
        let Way { from, until, passed, .. } = *way;
        let begun = t - self.reference[from];
        let ended = begun * passed;
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
        Passage {
            capacity,
            ends,
            conductance,
            dissipation: vec![0.5; STATIONS],
            left,
            units,
            rate,
            duration,
            volumetric: 4.18e6,
            plan: OnceLock::new(),
        }
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
            let parcels: Parcels =
                (0..30).map(|i| Parcel::even(content / 30.0 / passage.volumetric, 290.0 + 15.0 * f64::from(i % 5))).collect();
            let inflow: Flow = vec![Share { share: 0.3, first: 290.0, last: 300.0 }, Share { share: 0.7, first: 310.0, last: 310.0 }];
            let found = passage.carry(&walls, &parcels, &inflow);
            let moved = passage.moved();
            let held = |p: &Parcels| p.iter().map(|p| p.volume * passage.volumetric * p.mean()).sum::<f64>();
            let flow = |f: &Flow| f.iter().map(|s| moved * s.share * s.mean()).sum::<f64>();
            let lost = held(&parcels) + flow(&inflow) - held(&found.parcels) - flow(&found.outflow) + found.dissipated;
            let gained: f64 = found.heat.iter().sum();
            assert!((lost - gained).abs() < 1e-12 * (content + moved) * 300.0, "{duration} s: {lost} J, {gained} J");
            // The last water to leave in a long time entered at 310 K and passed every station.
            if duration > 100.0 {
                let step = |t: f64, k: usize| t + passage.dissipation[k] / passage.rate - (1.0 - passage.left[k]) * (t - walls[k]);
                let expected = (0..STATIONS).fold(310.0, step);
                let last = found.outflow.last().unwrap().last;
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
