//! Water as parcels: the content of a channel, and the flow into and out of it.

/// Water in a stretch of a channel, its temperature straight from end to end.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Parcel {
    /// Volume, m³.
    pub volume: f64,
    /// Temperature at its upstream end, K.
    pub upstream: f64,
    /// Temperature at its downstream end, K.
    pub downstream: f64,
}

/// Water that enters or leaves in a share of an interval, its temperature straight over time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Inflow {
    /// Share of the interval.
    pub share: f64,
    /// Temperature of the water that comes first, K.
    pub first: f64,
    /// Temperature of the water that comes last, K.
    pub last: f64,
}

/// Parcels from inlet to outlet.
pub type Parcels = Vec<Parcel>;
/// Water that enters or leaves during an interval, in the order of time.
pub(crate) type Inflows = Vec<Inflow>;

impl Parcel {
    /// A volume (m³) of one temperature (K).
    pub fn even(volume: f64, temperature: f64) -> Self {
        Self { volume, upstream: temperature, downstream: temperature }
    }

    /// Mean temperature, K.
    pub fn mean(&self) -> f64 {
        f64::midpoint(self.upstream, self.downstream)
    }

    /// This parcel joined with the next one downstream: of their common mean, straight between their outer ends, and within the
    /// temperatures of both.
    pub(super) fn joined(self, next: Self) -> Self {
        let volume = self.volume + next.volume;
        let mean = (self.volume * self.mean() + next.volume * next.mean()) / volume;
        let ends = [self.upstream, self.downstream, next.upstream, next.downstream];
        let (low, high) = ends.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), t| (l.min(*t), h.max(*t)));
        let most = (mean - low).min(high - mean).max(0.0);
        let half = (0.5 * (next.downstream - self.upstream)).clamp(-most, most);
        Self { volume, upstream: mean - half, downstream: mean + half }
    }
}

impl Inflow {
    /// Mean temperature, K.
    pub fn mean(&self) -> f64 {
        f64::midpoint(self.first, self.last)
    }

    /// Temperature (K) after a time counted from its beginning in shares of the interval.
    pub(super) fn at(&self, time: f64) -> f64 {
        self.first + (self.last - self.first) * (time / self.share).clamp(0.0, 1.0)
    }
}

/// Outflows that mix, each with its weight: one flow of their common temperature.
pub fn mixed(flows: &[(&Inflows, f64)]) -> Inflows {
    if let [(flow, _)] = flows {
        return (*flow).clone();
    }
    let mut at: Vec<(usize, f64)> = vec![(0, 0.0); flows.len()];
    let mut found = Inflows::new();
    let mut now = 0.0;
    while now < 1.0 - 1e-12 {
        // The next moment at which one of them changes.
        let next = flows.iter().zip(&at).filter_map(|((flow, _), (i, begun))| flow.get(*i).map(|s| begun + s.share)).fold(1.0, f64::min);
        let mixture = |time: f64| -> f64 {
            let of = |((flow, w), (i, begun)): (&(&Inflows, f64), &(usize, f64))| match flow.get(*i) {
                Some(share) => Some(w * share.at(time - begun)),
                None => flow.last().map(|share| w * share.last),
            };
            flows.iter().zip(&at).filter_map(of).sum()
        };
        if next > now {
            found.push(Inflow { share: next - now, first: mixture(now), last: mixture(next) });
        }
        for ((flow, _), (i, begun)) in flows.iter().zip(&mut at) {
            while flow.get(*i).is_some_and(|s| *begun + s.share <= next + 1e-12) {
                *begun += flow[*i].share;
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
