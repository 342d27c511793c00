//! Plan of the water's motion: how it is cut into pieces, once for all walls and temperatures of an interval.
//!
//! Parcels are carried exactly as far as the flow goes and are never remapped to a grid, so a front at the inlet stays as sharp as it
//! came. Temperature runs straight from one end of a parcel to the other. Each parcel is cut where it starts or ends in another
//! station; the ends of its pieces, the *marks*, are followed along their ways. Water that passes whole stations is booked where it
//! enters and where it leaves them. All of it is followed at once, because every difference to the water of one mark shrinks alike. The
//! wall gains the heat that the water loses, to rounding.

use super::parcels::{Inflow, Inflows, Parcel, Parcels};
use super::passage::{Nearest, Passage, StationPart, Way};

/// Cuts of the water, and the quantities of its passage that follow from no temperature.
#[derive(Debug, Clone)]
pub(super) struct WaterPlan {
    /// Ends of pieces from the inlet on; an end that two pieces share stands once.
    marks: Vec<Mark>,
    /// Pieces from the inlet on: the last ones leave.
    pieces: Vec<Piece>,
    /// Number of pieces that stay.
    staying: usize,
    /// Capacity of the water that leaves, J/K.
    leaving: f64,
    /// Capacity that passes each station as a whole, J/K.
    through: Vec<f64>,
    /// Derivative of the heat to each station's wall with respect to the wall's own temperature, sign turned, J/K.
    pub weight: Vec<f64>,
    /// Heat of dissipation, J.
    pub dissipated: f64,
}

/// A place in the water that is followed.
#[derive(Debug, Clone, Copy)]
struct Mark {
    /// Element that it lies in: first the shares that enter, last first, then the parcels.
    element: u32,
    /// Place in the element, as a share.
    share: f64,
    /// Capacity whose heat is booked with it, J/K: half of the piece on either side.
    capacity: f64,
    way: Way,
}

/// A piece between two marks.
#[derive(Debug, Clone, Copy)]
struct Piece {
    element: u32,
    /// The mark of its upstream end; the next one is that of its downstream end.
    mark: u32,
    /// Capacity, J/K.
    capacity: f64,
}

/// Result of carrying water along walls.
#[derive(Debug, Clone, Default)]
pub struct WaterPassage {
    /// Heat to the wall of each station, J.
    pub heat: Vec<f64>,
    /// Temperatures that its marks have come to, K.
    pub(super) marks: Vec<f64>,
    /// Water that left, if another stream takes it in.
    pub(super) outflow: Inflows,
}

impl WaterPlan {
    /// A plan for parcels, which fill the channel whatever its capacity is now, while `inflow` enters.
    pub fn new(passage: &Passage, parcels: &[Parcel], inflow: &[Inflow]) -> Self {
        let stations = passage.stations();
        let size = inflow.len() + parcels.len() + 2 * stations;
        let mut plan = Self {
            marks: Vec::with_capacity(2 * size),
            pieces: Vec::with_capacity(size),
            staying: 0,
            leaving: 0.0,
            through: vec![0.0; stations],
            weight: vec![0.0; stations],
            dissipated: 0.0,
        };
        plan.cut(passage, parcels, inflow);
        plan.book(passage);
        plan
    }

    /// Finds pieces and marks.
    fn cut(&mut self, passage: &Passage, parcels: &[Parcel], inflow: &[Inflow]) {
        let (content, moved, tiny) = (passage.content(), passage.moved(), passage.tiny());
        let held: f64 = parcels.iter().map(|p| p.volume).sum();
        let scale = if held > 0.0 { content / held } else { 0.0 };
        // The last to enter is at the inlet at the end of the interval: before it, everything lies upstream.
        let entering = inflow.iter().rev().map(|entered| entered.share * moved);
        let volumes = entering.chain(parcels.iter().map(|p| p.volume * scale));
        let mut near = Nearest::default();
        let flows = passage.rate > 0.0;
        // Place of the last mark.
        let mut last = f64::NAN;
        let mut next = -moved;
        for (element, volume) in volumes.enumerate() {
            let from = if element == inflow.len() { 0.0 } else { next };
            let (mut start, to) = (from, from + volume);
            next = to;
            while start < to {
                let cut = passage.next_cut(start, &mut near);
                // No slivers: whether there is one would be a matter of rounding, and each counts as a parcel.
                let end = if cut < to - tiny { cut } else { to };
                let capacity = end - start;
                let middle = f64::midpoint(start, end);
                let mark = |at: f64, way: Way| Mark { element: element as u32, share: (at - from) / volume, capacity: 0.5 * capacity, way };
                match self.marks.last_mut() {
                    // A mark between two pieces serves both, unless they stand still in two stations.
                    Some(shared) if start > from && flows => shared.capacity += 0.5 * capacity,
                    // One parcel begins at the end of another: both ends take one way.
                    Some(before) if last == start && flows => {
                        let way = before.way;
                        self.marks.push(mark(start, way));
                    }
                    _ if flows => self.marks.push(mark(start, passage.way(start, &mut near))),
                    _ => self.marks.push(mark(start, passage.rest(middle))),
                }
                self.pieces.push(Piece { element: element as u32, mark: self.marks.len() as u32 - 1, capacity });
                self.marks.push(mark(end, if flows { passage.way(end, &mut near) } else { passage.rest(middle) }));
                last = end;
                if middle + moved < content {
                    self.staying = self.pieces.len();
                } else {
                    self.leaving += capacity;
                }
                start = end;
            }
        }
    }

    /// Books the quantities that follow from no temperature.
    fn book(&mut self, passage: &Passage) {
        let mut begun = vec![0.0; passage.stations() + 1];
        for Mark { capacity, way, .. } in &self.marks {
            for part in way.begin.iter().chain(&way.end) {
                self.weight[part.station as usize] += capacity * part.given;
                self.dissipated += capacity * part.warmed;
            }
            if way.until > way.from {
                begun[way.from as usize] += capacity;
                begun[way.until as usize] -= capacity;
            }
        }
        let mut capacity = 0.0;
        for (k, begun) in begun[..passage.stations()].iter().enumerate() {
            capacity += begun;
            self.through[k] = capacity;
            self.weight[k] += capacity * (1.0 - passage.left[k]);
            self.dissipated += capacity * passage.warmed(k);
        }
    }

    /// Carries parcels and inflow, of volumes as in the plan, along walls at `wall` (K, by station).
    pub fn pass(&self, passage: &Passage, wall: &[f64], parcels: &[Parcel], inflow: &[Inflow]) -> WaterPassage {
        let stations = passage.stations();
        let reference = passage.reference(wall);
        let mut heat = vec![0.0; stations];
        let mut difference = vec![0.0; stations + 1];
        let mut pass = |part: &StationPart, t: f64, c: f64| {
            let k = part.station as usize;
            let lost = part.given * (t - wall[k]);
            heat[k] += c * lost;
            t + part.warmed - lost
        };
        let ends = |element: usize| match inflow.len().checked_sub(element + 1) {
            Some(entered) => (inflow[entered].last, inflow[entered].first),
            None => (parcels[element - inflow.len()].upstream, parcels[element - inflow.len()].downstream),
        };
        let follow = |mark: &Mark| {
            let Mark { element, share, capacity, way } = mark;
            let (upstream, downstream) = ends(*element as usize);
            let mut t = upstream + (downstream - upstream) * share;
            if let Some(part) = &way.begin {
                t = pass(part, t, *capacity);
            }
            if way.until > way.from {
                let (from, until) = (way.from as usize, way.until as usize);
                let begun = t - reference[from];
                let ended = begun * way.passed;
                difference[from] += capacity * begun;
                difference[until] -= capacity * ended;
                t = reference[until] + ended;
            }
            match &way.end {
                Some(part) => pass(part, t, *capacity),
                None => t,
            }
        };
        let marks = self.marks.iter().map(follow).collect();
        let mut running = 0.0;
        for (k, wall) in wall.iter().enumerate() {
            running += difference[k];
            heat[k] += (1.0 - passage.left[k]) * (self.through[k] * (reference[k] - wall) + running);
            running *= passage.left[k];
        }
        WaterPassage { heat, marks, outflow: Inflows::new() }
    }

    /// Water that leaves, the foremost first, from the temperatures of the marks (K).
    pub fn outflow(&self, marks: &[f64]) -> Inflows {
        let share = |piece: &Piece| if self.leaving > 0.0 { piece.capacity / self.leaving } else { 1.0 };
        let of = |piece: &Piece| {
            let mark = piece.mark as usize;
            Inflow { share: share(piece), first: marks[mark + 1], last: marks[mark] }
        };
        self.pieces[self.staying..].iter().rev().map(of).collect()
    }

    /// Shares of the water that leaves, without temperatures.
    pub(crate) fn empty_outflow(&self) -> Inflows {
        self.outflow(&vec![0.0; self.marks.len()])
    }

    /// Temperature (K) of the water that leaves last.
    pub fn outlet(&self, marks: &[f64]) -> Option<f64> {
        self.pieces.get(self.staying).map(|piece| marks[piece.mark as usize])
    }

    /// Parcels that stay. Pieces of one parcel join again as long as they stay smaller than a station.
    pub fn parcels(&self, passage: &Passage, marks: &[f64]) -> Parcels {
        let most = passage.content() / passage.stations() as f64;
        let mut kept = Parcels::with_capacity(self.staying);
        let mut of = None;
        for piece in &self.pieces[..self.staying] {
            let mark = piece.mark as usize;
            let own = Parcel { volume: piece.capacity, upstream: marks[mark], downstream: marks[mark + 1] };
            match kept.last_mut() {
                Some(before) if of == Some(piece.element) && before.volume + own.volume <= most => *before = before.joined(own),
                _ => kept.push(own),
            }
            of = Some(piece.element);
        }
        passage.merged(kept).into_iter().map(|p| Parcel { volume: p.volume / passage.volumetric, ..p }).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Stations of the test's channel, a count.
    const STATIONS: usize = 12;
    /// Capacity of a cubic metre of water in the test, J/(m³ K).
    const VOLUMETRIC: f64 = 4.18e6;

    /// A channel of unlike stations, 0.5 W of dissipation in each.
    fn passage(duration: f64) -> Passage {
        let capacity = (0..STATIONS).map(|k| 10.0 + 3.0 * (k % 4) as f64).collect();
        let conductance = (0..STATIONS).map(|k| 4.0 + (k % 3) as f64).collect();
        Passage::of(capacity, conductance, vec![0.5; STATIONS], [25.0, duration, VOLUMETRIC])
    }

    fn walls() -> Vec<f64> {
        (0..STATIONS).map(|k| 300.0 + 7.0 * (1.3 * k as f64).sin()).collect()
    }

    /// Water of uneven temperature moved by less than a station, by some, and by several fillings: the walls gain the heat that it
    /// loses, and the last water to leave agrees with a walk from station to station.
    #[test]
    fn what_the_water_loses_the_walls_gain() {
        for duration in [0.1, 3.0, 7.3, 200.0] {
            let (passage, walls) = (passage(duration), walls());
            let content = passage.content();
            let parcels: Parcels = (0..30).map(|i| Parcel::even(content / 30.0 / VOLUMETRIC, 290.0 + 15.0 * f64::from(i % 5))).collect();
            let inflow: Inflows = vec![Inflow { share: 0.3, first: 290.0, last: 300.0 }, Inflow { share: 0.7, first: 310.0, last: 310.0 }];
            let plan = WaterPlan::new(&passage, &parcels, &inflow);
            let passed = plan.pass(&passage, &walls, &parcels, &inflow);
            let (kept, outflow) = (plan.parcels(&passage, &passed.marks), plan.outflow(&passed.marks));
            let moved = passage.moved();
            let held = |p: &Parcels| p.iter().map(|p| p.volume * VOLUMETRIC * p.mean()).sum::<f64>();
            let flow = |f: &Inflows| f.iter().map(|s| moved * s.share * s.mean()).sum::<f64>();
            let lost = held(&parcels) + flow(&inflow) - held(&kept) - flow(&outflow) + plan.dissipated;
            let gained: f64 = passed.heat.iter().sum();
            assert!((lost - gained).abs() < 1e-12 * (content + moved) * 300.0, "{duration} s: {lost} J, {gained} J");
            // The last water to leave in a long time entered at 310 K and passed every station.
            if duration > 100.0 {
                let step = |t: f64, k: usize| t + passage.warmed(k) - (1.0 - passage.left[k]) * (t - walls[k]);
                let expected = (0..STATIONS).fold(310.0, step);
                let last = plan.outlet(&passed.marks).unwrap();
                assert!((last - expected).abs() < 1e-11, "{last} K, {expected} K");
            }
            // With walls one kelvin warmer each takes as much less as its weight says.
            for k in [0, 5, STATIONS - 1] {
                let mut warmer = walls.clone();
                warmer[k] += 1.0;
                let change = passed.heat[k] - plan.pass(&passage, &warmer, &parcels, &inflow).heat[k];
                assert!((change - plan.weight[k]).abs() < 1e-9 * plan.weight[k].max(1.0), "{duration} s, station {k}: {change} J/K");
            }
        }
    }

    /// Water that stands still goes to its own station's wall.
    #[test]
    fn standing_water_stays_with_its_station() {
        let walls = walls();
        let still = Passage::of(vec![10.0; STATIONS], vec![5.0; STATIONS], vec![0.0; STATIONS], [0.0, 4.0, VOLUMETRIC]);
        let parcels = vec![Parcel::even(still.volume(), 290.0)];
        let plan = WaterPlan::new(&still, &parcels, &[]);
        let passed = plan.pass(&still, &walls, &parcels, &[]);
        for (k, (heat, wall)) in passed.heat.iter().zip(&walls).enumerate() {
            let expected = 10.0 * (1.0 - (-2.0f64).exp()) * (290.0 - wall);
            assert!((heat - expected).abs() < 1e-11, "station {k}: {heat} J, {expected} J");
        }
        assert!(plan.outlet(&passed.marks).is_none() && plan.parcels(&still, &passed.marks).len() == STATIONS);
    }
}
