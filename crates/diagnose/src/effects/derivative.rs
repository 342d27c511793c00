//! Derivatives of effects: what each changes in the residual of the network, at a state of the machine.

use std::collections::BTreeMap;
use std::sync::OnceLock;

use rayon::prelude::*;

use super::ground::{Ground, PathFields, Shares};
use super::{Effect, Hypothesis, Linearised, Prepared, UserKind};
use coldplate_solve::sensitivity::{Derivatives, Disturbance, Screen};
use coldplate_solve::study::Study;

/// What effects do to the residual at a state, per unit of amplitude.
pub struct Disturbances {
    /// Of the distinct effects; `None` for what acts on sensors, or where the machine file has no words for it.
    pub effects: Vec<Option<Change>>,
    /// Fields that several effects share: nodes, and W per unit of a coefficient.
    pub shared: Vec<Shares>,
}

/// What one effect does.
pub enum Change {
    /// Node by node.
    Own(Disturbance),
    /// Shared fields by number, each with its coefficient.
    Shared(Vec<(usize, f64)>),
}

/// The effects of some hypotheses, with what does not depend on the state made ready once.
pub struct EffectDerivatives<'a> {
    ground: Ground<'a>,
    /// Effects and whether they drift: laws of the condition share what an effect does.
    distinct: Vec<(Effect, bool)>,
    prepared: BTreeMap<Effect, Prepared>,
}

impl<'a> EffectDerivatives<'a> {
    /// For the effects of some hypotheses.
    pub fn new(study: &'a Study, hypotheses: &[Hypothesis], user: &[UserKind]) -> Self {
        let mut distinct: Vec<(Effect, bool)> = hypotheses.iter().map(|h| (h.effect, h.is_drift())).collect();
        distinct.sort_unstable();
        distinct.dedup();
        let mut effects: Vec<Effect> = distinct.iter().map(|(effect, _)| *effect).collect();
        effects.dedup();
        let prepared = effects.into_par_iter().filter_map(|effect| Some((effect, effect.family().prepared(study, user)?))).collect();
        Self { ground: Ground::new(study), distinct, prepared }
    }

    /// How many distinct effects there are.
    pub fn count(&self) -> usize {
        self.distinct.len()
    }

    /// Where the effect of a hypothesis stands among them.
    pub fn position(&self, h: &Hypothesis) -> Option<usize> {
        self.distinct.binary_search(&(h.effect, h.is_drift())).ok()
    }

    /// What the distinct effects do to the residual at a state; a drift per 10 K away from 20 degC.
    pub fn disturbances(&self, at: &Derivatives<'_>, screen: &Screen<'_>) -> Disturbances {
        // Where heat enters groups takes a network to find.
        let has_paths = self.distinct.iter().any(|(effect, _)| effect.family().path().is_some());
        let paths = has_paths.then(|| self.ground.path_fields(&at.state.solution.temperatures, |node| screen.is_free(node)));
        let residual = OnceLock::new();
        let one = |(effect, is_drift): &(Effect, bool)| {
            let family = effect.family();
            if let (Some((ends, law)), Some(paths)) = (family.path(), &paths) {
                return Some(Change::Shared(paths.path(ends, law)));
            }
            let prepared = self.prepared.get(effect);
            let (ground, is_drift, residual) = (&self.ground, *is_drift, &residual);
            family.disturbance(&Linearised { at, screen, ground, prepared, is_drift, residual }).map(Change::Own)
        };
        let effects = self.distinct.par_iter().map(one).collect();
        Disturbances { effects, shared: paths.map_or(Vec::new(), PathFields::into_fields) }
    }
}
