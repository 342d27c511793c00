//! The choices beside a set: how free its amplitudes are, and how loose the machine is. Each is made by evidence, at its price.

use std::sync::{Arc, PoisonError};

use super::evidence::{Explained, Freedom};
use super::profiles::{Curve, Function};
use super::rows::{Looseness, Rows};
use super::search::{Candidate, Fit, Linear, Open, Search, Sought, near_by};

/// Laws of a log that one amplitude follows at most. Chosen: what asks for more is a curve.
const MOST_LAWS: usize = 4;

impl Search<'_> {
    /// Rows under a looseness; `None` where a block is not positive, for lack of noise.
    pub(super) fn rows_at(&self, looseness: Looseness) -> Option<Arc<Rows>> {
        if self.is_log() {
            return Rows::under(self.errors, looseness);
        }
        let find = |all: &Vec<Arc<Rows>>| all.iter().find(|rows| rows.is_under(looseness)).cloned();
        if let Some(rows) = find(&self.rows.lock().unwrap_or_else(PoisonError::into_inner)) {
            return Some(rows);
        }
        let rows = Rows::under(self.errors, looseness)?;
        self.rows.lock().unwrap_or_else(PoisonError::into_inner).push(rows.clone());
        Some(rows)
    }

    /// Logarithm of the prior of a set of so many places: a Poisson count, shared among the sets of as many by how often each is to blame.
    pub(super) fn log_prior(&self, members: &[usize]) -> f64 {
        let all: f64 = self.candidates.iter().map(|c| c.rate).sum();
        let expected = self.settings.expected_causes;
        // Poisson's k! cancels against the k! orders of the members.
        members.iter().map(|m| (expected * self.candidates[*m].rate / all).ln()).sum::<f64>() - expected
    }

    /// Price of choices that are not the plainest.
    pub(super) fn price(&self, freedoms: &[Freedom], looseness: Looseness) -> f64 {
        let s = self.settings;
        let chosen = |is: bool| s.choice_price * f64::from(u8::from(is));
        // A curve pays for the choice of its variable and its length too, what is in proportion for that of its variable; a law is paid for
        // where it is chosen.
        let curve = |(own, _): (Curve, f64)| {
            let curves = self.all_profiles.curves();
            if curves.contains(&own) { s.choice_price + (curves.len() as f64).ln() } else { 0.0 }
        };
        let law = |count: u32| f64::from(count) * (s.choice_price + (self.all_profiles.laws().len().max(1) as f64).ln());
        let of = |f: &Freedom| {
            let laws = if f.law == 0 { 0.0 } else { law(f.law.count_ones()) };
            chosen(f.freedom > 0.0) + self.price_of_size(f.size) + f.curve.map_or(0.0, curve) + laws
        };
        freedoms.iter().map(of).sum::<f64>()
            + s.spread_price * looseness.spread
            + s.disturbance_price * (looseness.disturbance + looseness.level)
            + s.condition_price * looseness.conditions
            + s.wandering_price * looseness.wandering
            + s.noise_price * (looseness.noise - 1.0)
    }

    /// Neighbours of a looseness that differ in one size: first in sizes of shared columns, then in sizes that rows are whitened by.
    fn one_size_from(&self, at: Looseness, sought: Sought) -> [Vec<Looseness>; 2] {
        if sought == Sought::AsItIs {
            return Default::default();
        }
        let s = self.settings;
        let any_or_near = |all: &[f64], value: f64| if sought == Sought::All { all.to_vec() } else { near_by(all, value) };
        let mut shared: Vec<Looseness> = any_or_near(&s.spreads, at.spread).into_iter().map(|spread| Looseness { spread, ..at }).collect();
        let mut own: Vec<Looseness> = near_by(&s.noises, at.noise).into_iter().map(|noise| Looseness { noise, ..at }).collect();
        let in_time = if self.is_log() { &mut shared } else { &mut own };
        // A level or a condition that is off by more than is usual throughout a test of a log is a cause, which has a name.
        let may_be = |own: f64, usual: f64| !self.is_log() || own <= usual;
        if !self.errors.levels.is_empty() {
            let levels = if self.is_log() { any_or_near(&s.disturbances, at.level) } else { near_by(&s.disturbances, at.level) };
            in_time.extend(levels.into_iter().filter(|own| may_be(*own, s.usual.level)).map(|level| Looseness { level, ..at }));
        }
        if !self.errors.conditions.is_empty() {
            let errors = near_by(&s.condition_errors, at.conditions);
            in_time
                .extend(errors.into_iter().filter(|own| may_be(*own, s.usual.conditions)).map(|conditions| Looseness { conditions, ..at }));
        }
        let heats = if self.is_log() { any_or_near(&s.wandering_heats, at.disturbance) } else { near_by(&s.disturbances, at.disturbance) };
        in_time.extend(heats.into_iter().map(|disturbance| Looseness { disturbance, ..at }));
        if self.is_log() {
            own.extend(near_by(&s.wanderings, at.wandering).into_iter().map(|wandering| Looseness { wandering, ..at }));
        }
        [shared, own]
    }

    /// Logarithm of the evidence of a fit over that where the model leaves no more open than is usual.
    pub(super) fn lead_over_usual(&self, fit: &Fit) -> f64 {
        if self.settings.is_usual(&fit.looseness) {
            return 0.0;
        }
        let (own, settings) = (self.with_errors_of(fit), self.settings.within_usual());
        let within = Search::new(own.errors, own.residual, own.candidates, &settings, None, (own.profiles, own.all_profiles));
        let linear = own.linear_about(fit);
        let evidence = |search: &Search<'_>, from: Looseness, sought: Sought| search.loosest(&linear, &fit.freedoms, from, sought).1;
        evidence(&own, fit.looseness, Sought::AsItIs) - evidence(&within, Looseness::default(), Sought::All)
    }

    /// The looseness of the model with the largest evidence under given freedoms, found by one size at a time. A size that
    /// rows are whitened by is tried only where no size of the shared columns is better.
    pub(super) fn loosest(&self, linear: &Linear<'_>, freedoms: &[Freedom], from: Looseness, sought: Sought) -> (Looseness, f64) {
        let followed = self.followed(freedoms);
        let mut tried: Vec<(Looseness, f64)> = Vec::new();
        let mut evidence = |own: Looseness| -> (Looseness, f64) {
            if let Some(known) = tried.iter().find(|(other, _)| *other == own) {
                return *known;
            }
            let log = self.explained(linear, own, &followed).and_then(|explained| explained.log_evidence(freedoms, own));
            let found = (own, log.map_or(f64::NEG_INFINITY, |log| log - self.price(freedoms, own)));
            tried.push(found);
            found
        };
        let mut best = (from, f64::NEG_INFINITY);
        for start in [from, Looseness::default()].into_iter().take(if sought == Sought::All { 2 } else { 1 }) {
            let mut own = evidence(start);
            let mut best_step = |from: (Looseness, f64)| {
                let best = |steps: Vec<Looseness>| steps.into_iter().map(&mut evidence).max_by(|a, b| a.1.total_cmp(&b.1));
                self.one_size_from(from.0, sought).into_iter().filter_map(best).find(|step| step.1 > from.1)
            };
            while let Some(step) = best_step(own) {
                own = step;
            }
            if own.1 > best.1 {
                best = own;
            }
        }
        best
    }

    /// A linear model with the functions that each amplitude may follow, whitened under a looseness; `None` as in [`Search::rows_at`].
    pub(super) fn explained<'l>(&self, linear: &Linear<'l>, looseness: Looseness, followed: &[Vec<usize>]) -> Option<Arc<Explained<'l>>> {
        let rows = self.rows_at(looseness)?;
        linear.known.get(
            |own| own.is_of(&rows, followed),
            || Some(Explained::new(rows.clone(), linear.profiles, &linear.residual, &linear.slopes, followed)),
        )
    }

    /// Evidence that a way of one member loses where its amplitude wants to be beyond its range.
    fn loss(&self, explained: &Explained<'_>, freedoms: &[Freedom], looseness: Looseness, (m, candidate): (usize, usize)) -> f64 {
        let own = freedoms[m];
        if own.freedom == 0.0 && own.curve.is_none() && own.law == 0 {
            return 0.0;
        }
        let Some(found) = explained.most_probable(freedoms, looseness) else { return f64::INFINITY };
        self.beyond(candidate, own, &found[m], || explained.variances(freedoms, looseness, m))
    }

    /// Whether an amplitude may be another in every row. In one condition there is nothing to vary.
    pub(super) fn may_scatter(&self, candidate: &Candidate) -> bool {
        candidate.may_run && candidate.may_vary && candidate.may_scatter && !self.is_log() && self.profiles.functions.nrows() > 1
    }

    /// Functions of the rows that each amplitude follows.
    pub fn followed(&self, freedoms: &[Freedom]) -> Vec<Vec<usize>> {
        freedoms.iter().map(|f| f.acting(self.profiles).into_iter().map(|(function, _)| function).collect()).collect()
    }

    /// Whether an amplitude may follow a function of the rows. An error of a sensor of a log that follows anything is the wandering one.
    fn may_follow(&self, candidate: &Candidate, function: Function) -> bool {
        let may_run = candidate.may_run && candidate.may_vary;
        match function {
            Function::Constant => true,
            Function::Linear(_) => may_run && candidate.may_follow,
            Function::When(_) => may_run,
            Function::Smooth((variable, _)) => {
                may_run && self.profiles.time.is_none_or(|time| if time == variable { candidate.may_wander } else { candidate.may_follow })
            }
        }
    }

    /// Ways in which an amplitude may run over the rows, from one of them: another size or freedom, another curve, or another law.
    pub(super) fn ways(&self, from: Freedom, with_curves: bool, (candidate, own): (&Candidate, &[f64])) -> [Vec<Freedom>; 3] {
        let s = self.settings;
        let may_vary = candidate.may_run && candidate.may_vary;
        let freedoms = if self.may_scatter(candidate) { &s.freedoms[..] } else { &s.freedoms[..1] };
        let of = |size: &f64| freedoms.iter().map(|freedom| Freedom { size: *size, freedom: *freedom, ..from }).collect::<Vec<_>>();
        // What acts by laws of the time may not be there beside them.
        let none = Some(0.0).filter(|_| self.profiles.laws().into_iter().any(|law| from.has(law) && self.profiles.is_when(law)));
        let sizes = none.iter().chain(&self.sizes(candidate, own, from.size)).flat_map(of).collect();
        let mut curves = Vec::new();
        let mut laws = Vec::new();
        if with_curves && may_vary {
            let free = s.freedoms.iter().copied().filter(|f| *f > 0.0);
            let of = |curve: Curve| {
                free.clone().flat_map(move |size| {
                    // A curve takes the place of the freedom, or leaves some of it.
                    [from.freedom, 0.0].map(|freedom| Freedom { freedom, curve: Some((curve, size)), ..from })
                })
            };
            curves.extend(self.profiles.curves().into_iter().filter(|own| self.may_follow(candidate, Function::Smooth(*own))).flat_map(of));
            curves.push(Freedom { curve: None, ..from });
            // One law more, or one less; by a law of the time it may act alone. It has one of these, or two next to each other, which are an
            // instant between them: several make any course in time, which is the disturbance where it is a heat, and elsewhere a curve.
            let present: Vec<usize> = self.profiles.laws().into_iter().filter(|l| from.has(*l) && self.profiles.is_when(*l)).collect();
            for law in self.profiles.laws() {
                let is_when = self.profiles.is_when(law);
                if !is_when && !self.may_follow(candidate, Function::Linear(law)) {
                    continue;
                }
                let is_beside = present.contains(&law) || matches!(present[..], [own] if self.profiles.are_next(own, law));
                let instead = if is_when && !is_beside { present.iter().map(|own| 1 << own).sum::<u64>() } else { 0 };
                let of = from.law ^ 1 << law ^ instead;
                let size = if of == 0 && from.size == 0.0 { s.sizes[0] } else { from.size };
                laws.push(Freedom { law: of, size, ..from });
                if from.curve.is_some() {
                    laws.push(Freedom { law: of, size, curve: None, ..from });
                }
                if is_when && from.law == 0 {
                    laws.push(Freedom { law: of, size: 0.0, curve: None, ..from });
                }
            }
        }
        [sizes, curves, laws]
    }

    /// The freedoms with the largest evidence at a looseness; those of members that are not open stay as they are.
    pub(super) fn freest(
        &self,
        linear: &Linear<'_>,
        freedoms: &[Freedom],
        amplitudes: &[Vec<f64>],
        open: Open<'_>,
        looseness: Looseness,
    ) -> (Vec<Freedom>, f64) {
        let mut followed = self.followed(freedoms);
        for (m, candidate) in open.members {
            let is_tried = |f: &usize| {
                let function = self.profiles.of[*f];
                function == Function::Constant || self.may_follow(&self.candidates[*candidate], function) || followed[*m].contains(f)
            };
            if self.is_log() {
                followed[*m] = (0..self.profiles.of.len()).filter(is_tried).collect();
            }
        }
        let mut best = (freedoms.to_vec(), f64::NEG_INFINITY);
        let Some(explained) = self.explained(linear, looseness, &followed) else { return best };
        for (m, candidate) in open.members {
            let Some(beside) = explained.one_cause(*m, &best.0, looseness) else { continue };
            let mut gain = beside.gains();
            // Laws grow by a variable at a time, as long as each is worth its price.
            for kind in [0, 1].into_iter().chain(std::iter::repeat_n(2, MOST_LAWS)) {
                let before = best.1;
                let mut tried: Vec<(Vec<Freedom>, f64)> = Vec::new();
                for way in &self.ways(best.0[*m], open.with_curves, (&self.candidates[*candidate], &amplitudes[*m]))[kind] {
                    let mut freedoms = best.0.clone();
                    freedoms[*m] = *way;
                    let log = gain(way).map(|gain| beside.without + gain - self.price(&freedoms, looseness));
                    tried.extend(log.filter(|log| *log > best.1).map(|log| (freedoms, log)));
                }
                tried.sort_by(|a, b| b.1.total_cmp(&a.1));
                for (freedoms, log) in tried {
                    if log <= best.1 {
                        break;
                    }
                    let log = log - if open.are_bounded { self.loss(&explained, &freedoms, looseness, (*m, *candidate)) } else { 0.0 };
                    if log > best.1 {
                        best = (freedoms, log);
                    }
                }
                if kind == 2 && best.1 == before {
                    break;
                }
            }
        }
        best
    }
}
