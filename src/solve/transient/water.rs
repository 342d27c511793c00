//! Water that moves: parcels in plug flow, exchanging heat with walls held at one temperature for an interval.
//!
//! Parcels are carried exactly as far as the flow goes and are never remapped to a grid, so a front at the
//! inlet stays as sharp as it came. Each parcel is cut where it starts or ends in another station; along
//! the path of a piece's middle the plug-flow solution in each station is exact. What the water loses is
//! what the wall gains, to rounding.

use crate::network::StreamState;
use crate::network::stream::Stream;

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
        let left = state.conductance.iter().map(|ua| if rate > 0.0 { (-ua / rate).exp() } else { 1.0 }).collect();
        let dissipation = stream.stations.iter().map(|s| state.dissipation * s.length).collect();
        let conductance = state.conductance.clone();
        Self { capacity, ends, conductance, dissipation, left, rate, duration, volumetric: state.volumetric_capacity }
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
                let after = self.follow(middle, moved, t, c, wall, &mut found);
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
    fn follow(&self, start: f64, moved: f64, mut t: f64, c: f64, wall: &[f64], found: &mut Carried) -> f64 {
        let content = self.content();
        let (mut at, to) = (start.max(0.0), (start + moved).min(content));
        let mut k = self.ends.partition_point(|e| *e <= at);
        let rests = self.rate <= 0.0;
        while k < self.ends.len() && (at < to || rests) {
            let end = self.ends[k].min(to);
            let (time, left) = if rests {
                let left = (-self.conductance[k] * self.duration / self.capacity[k]).exp();
                (self.duration, left)
            } else {
                let share = (end - at) / self.capacity[k];
                let left = if share > 1.0 - 1e-12 { self.left[k] } else { (-self.conductance[k] / self.rate * share).exp() };
                ((end - at) / self.rate, left)
            };
            let lost = (1.0 - left) * (t - wall[k]);
            let warmed = self.dissipation[k] * time / self.capacity[k];
            t += warmed - lost;
            found.heat[k] += c * lost;
            found.weight[k] += c * (1.0 - left);
            found.dissipated += c * warmed;
            if rests {
                break;
            }
            at = end;
            k += 1;
        }
        t
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
