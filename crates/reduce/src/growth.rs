//! Growth of a reduced basis: full solves where the bound is largest, round by round, until it is small enough everywhere.

use rayon::prelude::*;

use super::assemble::Snapshot;
use super::basis::ModeBasis;
use super::model::{ReducedAnswer, ReducedModel};
use super::reference::ReferenceNetwork;
use coldplate_base::error::Result;
use coldplate_base::progress::Progress;
use coldplate_describe::machine::Condition;
use coldplate_network::{Load, Network};
use coldplate_solve::csr::for_chunks;
use coldplate_solve::sensitivity::OpenParameter;

/// Number of conditions solved in full before the first reduced model: `FIRST.0 + FIRST.1` · axes. Chosen: fewer make
/// the first bound a poor guide to the next conditions, more may be wasted.
pub(super) const FIRST: (usize, usize) = (16, 4);
/// Fewest conditions solved in a round, a count. Chosen: fewer are placed better, more use the cores better.
pub(super) const ROUND: usize = 8;
/// Share of the accuracy that the bounds with the least margin must keep while conditions are added. Chosen below one,
/// because the calibrated margin is larger and untried conditions may be worse.
pub(super) const AIM: f64 = 0.4;

/// Assumed error of the field, as a share of the largest bound. Chosen: the bound of a reading is mostly much larger
/// than the error.
const FIELD: f64 = 0.1;

/// Temperatures that the full solver starts from.
pub struct Guess {
    /// Temperatures of all nodes, K.
    pub temperatures: Vec<f64>,
    /// Estimated distance from the solution, K.
    pub error: f64,
}

/// A model of the conditions solved so far, and its modes.
pub(super) struct Grown {
    pub(super) model: ReducedModel,
    pub(super) basis: ModeBasis,
}

impl Grown {
    /// Guess of the solution of a full network at a condition with values of the parameters, `center` being the temperatures of the
    /// middle (K); `None` if the model has no steady state there.
    pub(super) fn guess(&self, condition: &Condition, parameters: &[f64], network: &Network, load: &Load, center: &[f64]) -> Option<Guess> {
        let answer = self.model.steady(condition, parameters).ok()?;
        let mut solids = center[..network.solids].to_vec();
        for (mode, amplitude) in self.basis.modes.iter().zip(answer.state.amplitudes.iter()) {
            for_chunks(&mut solids, |first, part| part.iter_mut().zip(&mode[first..]).for_each(|(t, m)| *t += amplitude * m));
        }
        let temperatures = self.model.fine.with_water(&answer.state, network, load, solids).ok()?;
        Some(Guess { temperatures, error: FIELD * answer.largest_bound() })
    }
}

/// Answer of a model at a condition, which is named by its number.
pub(super) type Steady<'s> = dyn Fn(&ReducedModel, usize) -> Result<ReducedAnswer> + Sync + 's;
/// Number of conditions in the next round, zero after the last one. Arguments: numbers of conditions in the basis, of open
/// conditions, and of open conditions with a bound above the aim.
pub(super) type RoundSize<'r> = dyn Fn(usize, usize, usize) -> usize + 'r;
/// Full solutions of the conditions with these numbers, started from the fields of a model if there is one; conditions
/// without a steady state are left out.
pub(super) type Solve<'s> = dyn FnMut(&[usize], Option<&Grown>) -> Result<Vec<Snapshot>> + 's;

/// Basis that grows by conditions with numbers.
pub(super) struct BasisGrowth<'a> {
    pub(super) reference: &'a ReferenceNetwork<'a>,
    /// Range of each variable of the machine, SI.
    pub(super) ranges: &'a [(f64, f64)],
    /// Parameters that take other values than those of the machine file.
    pub(super) parameters: Vec<OpenParameter>,
    /// Names of open parameters that keep the file's value.
    pub(super) left_out: Vec<String>,
    pub(super) steady: &'a Steady<'a>,
    pub(super) round: &'a RoundSize<'a>,
    /// Margin of the bound of every model, dimensionless.
    pub(super) margin: f64,
    /// Conditions that are not solved in full.
    pub(super) open: Vec<usize>,
    /// Full solutions that the basis is made of.
    pub(super) snapshots: Vec<Snapshot>,
    /// Number of conditions without a steady state.
    pub(super) failed: usize,
    /// Largest bound at the open conditions in the last round, K.
    pub(super) worst: f64,
}

impl BasisGrowth<'_> {
    /// A model of all conditions solved so far.
    ///
    /// # Errors
    /// Errors of [`ReferenceNetwork::model`].
    pub(super) fn grown(&self) -> Result<Grown> {
        let (model, basis) = self.reference.model(&self.snapshots, self.ranges)?;
        let (parameters, left_out) = (self.parameters.clone(), self.left_out.clone());
        Ok(Grown { model: ReducedModel { parameters, left_out, margin: self.margin, ..model }, basis })
    }

    /// Largest bound of a model at every open condition (K), the largest first; infinite without a steady state.
    pub(super) fn bounds(&self, model: &ReducedModel) -> Vec<(usize, f64)> {
        let bound = |at: &usize| (*at, (self.steady)(model, *at).map_or(f64::INFINITY, |answer| answer.largest_bound()));
        let mut bounds: Vec<(usize, f64)> = self.open.par_iter().map(bound).collect();
        bounds.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
        bounds
    }

    /// Adds full solutions of these conditions to the basis.
    ///
    /// # Errors
    /// Errors of `solve`.
    pub(super) fn add(&mut self, conditions: &[usize], known: Option<&Grown>, solve: &mut Solve<'_>) -> Result<()> {
        self.open.retain(|at| !conditions.contains(at));
        let solved = solve(conditions, known)?;
        self.failed += conditions.len() - solved.len();
        self.snapshots.extend(solved);
        Ok(())
    }

    /// Adds the open conditions with the largest bounds, round by round, until no bound is above `aim` (K) or the last round is over.
    ///
    /// # Errors
    /// Errors of `solve`, or no model can be made.
    pub(super) fn until(&mut self, mut grown: Grown, aim: f64, solve: &mut Solve<'_>, progress: &dyn Progress) -> Result<Grown> {
        loop {
            let bounds = self.bounds(&grown.model);
            self.worst = bounds.first().map_or(0.0, |(_, bound)| *bound);
            let (solved, modes) = (self.snapshots.len(), grown.basis.modes.len());
            progress.at(&format!("{solved} conditions solved in full, {modes} modes: largest bound {:.1e} K", self.worst));
            let missed = bounds.iter().filter(|(_, bound)| *bound > aim).count();
            let next: Vec<usize> = bounds.iter().take((self.round)(solved, bounds.len(), missed)).map(|(at, _)| *at).collect();
            if missed == 0 || next.is_empty() {
                return Ok(grown);
            }
            self.add(&next, Some(&grown), solve)?;
            grown = self.grown()?;
        }
    }
}
