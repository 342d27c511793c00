//! The choices beside a set: how free its amplitudes are, and how loose the machine is. Each is made by evidence, at its price.

use std::sync::Arc;

use super::evidence::{Explained, Freedom};
use super::profiles::Curve;
use super::rows::{Looseness, Rows};
use super::search::{Candidate, Linear, Search, near_by};

/// Laws of a log that one amplitude follows at most. Chosen: what asks for more is a curve.
const MOST_LAWS: usize = 4;

impl Search<'_> {
    pub(super) fn rows_at(&self, looseness: Looseness) -> &Rows {
        let is = |rows: &&Arc<Rows>| rows.disturbance.is_none_or(|d| d == looseness.disturbance) && rows.wandering == looseness.wandering;
        self.rows.iter().find(is).unwrap_or(&self.rows[0])
    }

    /// Logarithm of the prior of a set of so many places: a Poisson count, shared among the sets of as many by how often each is to blame.
    pub(super) fn log_prior(&self, members: &[usize]) -> f64 {
        let all: f64 = self.candidates.iter().map(|c| c.rate).sum();
        let expected = self.settings.expected_causes;
        // Poisson's k! cancels against the k! orders of the members.
        members.iter().map(|m| (expected * self.candidates[*m].rate / all).ln()).sum::<f64>() - expected
    }

    /// Sizes of the disturbance that are tried.
    pub(super) fn disturbances(&self) -> &Vec<f64> {
        if self.is_log() { &self.settings.wandering_heats } else { &self.settings.disturbances }
    }

    /// Price of choices that are not the plainest.
    pub(super) fn price(&self, freedoms: &[Freedom], looseness: Looseness) -> f64 {
        let s = self.settings;
        let chosen = |is: bool| s.choice_price * f64::from(u8::from(is));
        // A curve pays for the choice of its variable and its length too, what is in proportion for that of its variable; a law is paid for
        // where it is chosen.
        let (curves, laws) = (self.all_profiles.curves(), self.all_profiles.laws().len().max(1));
        let is_smooth = |(own, _): &(Curve, f64)| curves.contains(own);
        let curve = |f: &Freedom| f.curve.filter(is_smooth).map_or(0.0, |_| s.choice_price + (curves.len() as f64).ln());
        let law = |f: &Freedom| f64::from(f.law.count_ones()) * (s.choice_price + (laws as f64).ln());
        freedoms.iter().map(|f| chosen(f.freedom > 0.0) + self.price_of_size(f.size) + curve(f) + law(f)).sum::<f64>()
            + s.spread_price * looseness.spread
            + s.disturbance_price * looseness.disturbance
            + s.wandering_price * looseness.wandering
    }

    /// The looseness of the model with the largest evidence under given freedoms, near one where there is one.
    pub(super) fn loosest(&self, linear: &Linear, freedoms: &[Freedom], near: Option<Looseness>) -> (Looseness, f64) {
        let s = self.settings;
        let all_disturbances = self.disturbances();
        let (disturbances, spreads, wanderings) = match near {
            Some(near) => {
                (near_by(all_disturbances, near.disturbance), near_by(&s.spreads, near.spread), near_by(&s.wanderings, near.wandering))
            }
            None => (all_disturbances.clone(), s.spreads.clone(), s.wanderings.clone()),
        };
        let mut best = (Looseness { spread: 0.0, disturbance: 0.0, wandering: 0.0 }, f64::NEG_INFINITY);
        for rows in self.rows.iter().filter(|rows| !self.is_log() || wanderings.contains(&rows.wandering)) {
            let own: Vec<f64> = disturbances.iter().copied().filter(|d| rows.disturbance.is_none_or(|own| own == *d)).collect();
            if own.is_empty() {
                continue;
            }
            let explained = Explained::new(rows, self.profiles, &linear.residual, &linear.slopes, &self.followed(freedoms));
            for (disturbance, spread) in own.iter().flat_map(|d| spreads.iter().map(move |s| (*d, *s))) {
                let looseness = Looseness { spread, disturbance, wandering: rows.wandering };
                let Some(log) = explained.log_evidence(freedoms, looseness) else { continue };
                let log = log - self.price(freedoms, looseness);
                if log > best.1 {
                    best = (looseness, log);
                }
            }
        }
        best
    }

    /// Whether an amplitude may be another in every row. In one condition there is nothing to vary.
    pub(super) fn may_scatter(&self, candidate: &Candidate) -> bool {
        candidate.may_run && candidate.may_vary && candidate.may_scatter && !self.is_log() && self.profiles.functions.nrows() > 1
    }

    /// Functions of the rows that each amplitude follows.
    pub fn followed(&self, freedoms: &[Freedom]) -> Vec<Vec<usize>> {
        freedoms.iter().map(|f| self.profiles.with(f.curve.map(|(curve, _)| curve))).collect()
    }

    /// Ways in which an amplitude may run over the rows, from one of them: another size or freedom, another curve, or another law.
    pub(super) fn ways(&self, from: Freedom, with_curves: bool, (candidate, own): (&Candidate, &[f64])) -> [Vec<Freedom>; 3] {
        let s = self.settings;
        let may_vary = candidate.may_run && candidate.may_vary;
        let freedoms = if self.may_scatter(candidate) { &s.freedoms[..] } else { &s.freedoms[..1] };
        let of = |size: &f64| freedoms.iter().map(|freedom| Freedom { size: *size, freedom: *freedom, ..from }).collect::<Vec<_>>();
        // What acts by laws of the time may not be there beside them.
        let none = Some(0.0).filter(|_| self.profiles.laws().into_iter().any(|law| from.has(law) && self.profiles.is_when(law)));
        let sizes = none.iter().chain(&self.sizes(candidate, own)).flat_map(of).collect();
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
            let is_open = |variable: usize| candidate.may_wander || self.profiles.time != Some(variable);
            curves.extend(self.profiles.curves().into_iter().filter(|(variable, _)| is_open(*variable)).flat_map(of));
            curves.push(Freedom { curve: None, ..from });
            // One law more, or one less; by a law of the time it may act alone.
            for law in self.profiles.laws() {
                let (is_when, of) = (self.profiles.is_when(law), from.law ^ 1 << law);
                if !is_when && !candidate.may_follow {
                    continue;
                }
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

    /// The freedoms with the largest evidence at a looseness; those of all members but `of`, each with its candidate, stay as
    /// they are.
    pub(super) fn freest(
        &self,
        linear: &Linear,
        freedoms: &[Freedom],
        amplitudes: &[Vec<f64>],
        (of, with_curves): (&[(usize, usize)], bool),
        looseness: Looseness,
    ) -> (Vec<Freedom>, f64) {
        let mut followed = self.followed(freedoms);
        if with_curves {
            of.iter().for_each(|(m, _)| followed[*m] = self.profiles.all());
        }
        let explained = Explained::new(self.rows_at(looseness), self.profiles, &linear.residual, &linear.slopes, &followed);
        let mut best = (freedoms.to_vec(), f64::NEG_INFINITY);
        for (m, candidate) in of {
            // Laws grow by a variable at a time, as long as each is worth its price.
            for kind in [0, 1].into_iter().chain(std::iter::repeat_n(2, MOST_LAWS)) {
                let before = best.1;
                for tried in &self.ways(best.0[*m], with_curves, (&self.candidates[*candidate], &amplitudes[*m]))[kind] {
                    let mut freedoms = best.0.clone();
                    freedoms[*m] = *tried;
                    let Some(log) = explained.log_evidence(&freedoms, looseness) else { continue };
                    let log = log - self.price(&freedoms, looseness);
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
