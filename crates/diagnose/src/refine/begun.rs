//! Where several fits of the same causes begin: solved once for all of them.

use rayon::prelude::*;

use super::super::effects::Hypothesis;
use super::super::predictor::{Predictor, Solved};
use super::{Fitted, MachineSlopes, Origin, bounded};

/// Where several fits of the same causes begin: solved once for all of them.
#[derive(Debug, Clone)]
pub struct Begun<'a> {
    pub(super) members: Vec<&'a Hypothesis>,
    pub(super) amplitudes: Vec<f64>,
    pub(super) solved: Solved,
    pub(super) origin: Origin,
    /// The same a step of each amplitude up and down, as far as they are known.
    pub(super) up: Vec<Option<Solved>>,
    pub(super) down: Vec<Option<Solved>>,
    /// Slopes of a fit that ended here: of its readings, K per unit of each amplitude, and of the machine.
    pub(super) slopes: Option<(Vec<Vec<f64>>, MachineSlopes)>,
}

impl<'a> Begun<'a> {
    /// The beginning alone; `None` where the machine cannot be solved so, or fits begin elsewhere too.
    pub fn at(predictor: &Predictor<'_>, members: &[&'a Hypothesis], guess: &[f64]) -> Option<Self> {
        let amplitudes: Vec<f64> = members.iter().zip(guess).map(|(h, a)| bounded(h, *a)).collect();
        let with: Vec<(&Hypothesis, f64)> = members.iter().copied().zip(amplitudes.iter().copied()).collect();
        let solved = if predictor.fronts { None } else { predictor.solve_near(&with, predictor.fields).ok() }?;
        let unknown = vec![None; members.len()];
        let origin = Origin::here(&amplitudes, &solved);
        Some(Self { members: members.to_vec(), amplitudes, solved, origin, up: unknown.clone(), down: unknown, slopes: None })
    }

    /// Where another fit ended, with its slopes.
    pub fn ended(members: &[&'a Hypothesis], before: &Fitted) -> Self {
        let unknown = vec![None; members.len()];
        Self {
            members: members.to_vec(),
            amplitudes: before.amplitudes.clone(),
            solved: Solved { values: before.machine.clone(), fields: Vec::new() },
            origin: before.origin.clone(),
            up: unknown.clone(),
            down: unknown,
            slopes: (before.slopes.len() == members.len()).then(|| (before.slopes.clone(), before.machine_slopes.clone())),
        }
    }

    /// With the steps that slopes are made of; fits by secants make none.
    pub(crate) fn with_steps(mut self, predictor: &Predictor<'_>) -> Self {
        if predictor.has_slopes_of(&self.members) {
            return self;
        }
        let (share, both) = predictor.steps();
        let one = |j: usize, sign: f64| {
            let h = self.members[j];
            let mut with: Vec<(&Hypothesis, f64)> = self.members.iter().copied().zip(self.amplitudes.iter().copied()).collect();
            with[j].1 = bounded(h, with[j].1 + sign * share * h.scale);
            let is_known = h.is_sensor() || with[j].1 == self.amplitudes[j];
            if is_known { None } else { predictor.solve_near(&with, &self.solved.fields).ok() }
        };
        let count = self.members.len();
        let (up, down) = rayon::join(
            || (0..count).into_par_iter().map(|j| one(j, 1.0)).collect(),
            || (0..count).into_par_iter().map(|j| if both { one(j, -1.0) } else { None }).collect(),
        );
        (self.up, self.down) = (up, down);
        self
    }

    pub(super) fn has_steps(&self) -> bool {
        self.up.iter().chain(&self.down).any(Option::is_some)
    }

    /// Whether it is the beginning of these causes, in this order.
    pub fn is_about(&self, members: &[&Hypothesis]) -> bool {
        let is_same = |(a, b): (&&Hypothesis, &&Hypothesis)| a.is_same(b) && a.scale == b.scale;
        self.members.len() == members.len() && self.members.iter().zip(members).all(is_same)
    }

    /// Where it begins.
    pub fn amplitudes(&self) -> &[f64] {
        &self.amplitudes
    }

    pub(super) fn is_of(&self, members: &[&Hypothesis], amplitudes: &[f64]) -> bool {
        self.is_about(members) && self.amplitudes == amplitudes
    }
}
