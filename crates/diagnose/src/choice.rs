//! Which causes of a screen are worth a fit.

use super::effects::Hypothesis;
use super::probability::{Candidate, Posterior};
use super::screen::Screened;
use coldplate_evidence::identify::chi_square_tail;

/// Least probability of a finalist, once there is one.
pub const LEAST: f64 = 3e-3;
/// Causes beside the finalists by laws that are looked for only where something is wrong.
pub(crate) const RARE_FINALISTS: usize = 2;
/// A misfit left that is less probable than this is no noise.
pub const LEFT: f64 = 0.05;
/// A cause that takes away more than this share of the misfit that the best one takes looks like it, and how many such are fitted.
const ALIKE: f64 = 0.97;
const MOST_ALIKE: usize = 3;
/// Causes that slopes may do wrong, at most.
const MOST_DOUBTED: usize = 8;

/// Whether a cause by a rarer law is part of it.
pub(crate) fn has_rare(screened: &Screened, candidate: &Candidate) -> bool {
    candidate.members.iter().any(|j| screened.is_rare[*j])
}

/// Candidates worth a fit, at most `most` and some by rarer laws, which take nothing from the others.
pub(crate) fn leading(posterior: &Posterior, screened: &Screened, most: usize) -> Vec<Candidate> {
    let (rare, usual): (Vec<Candidate>, Vec<Candidate>) = posterior.candidates.iter().cloned().partition(|c| has_rare(screened, c));
    let mut chosen = leading_of(&usual, screened, most);
    chosen.extend(leading_of(&rare, screened, most.min(RARE_FINALISTS)));
    chosen
}

/// Candidates worth a fit of some, at most `most`. Slopes serve only near the machine as it is: where even the best leaves more than
/// noise, differences of evidence count for as much less.
fn leading_of(candidates: &[Candidate], screened: &Screened, most: usize) -> Vec<Candidate> {
    let Some(best) = candidates.first() else { return Vec::new() };
    let left = (screened.misfit() - best.gain) / screened.residual.len() as f64;
    let share = 1.0 / left.max(1.0);
    let is_probable = |c: &&Candidate| (share * (c.weight - best.weight)).exp() > LEAST;
    let mut chosen: Vec<Candidate> = candidates.iter().filter(is_probable).take(most).cloned().collect();
    // A pair competes with its stronger cause alone, which slopes put far behind where its effect bends.
    for pair in chosen.clone().iter().filter(|c| c.members.len() > 1) {
        let alone = candidates.iter().filter(|c| c.members.len() == 1 && pair.members.contains(&c.members[0]));
        if let Some(single) = alone.max_by(|a, b| a.gain.total_cmp(&b.gain))
            && !chosen.iter().any(|c| c.members == single.members)
        {
            chosen.push(single.clone());
        }
    }
    // What looks the same to slopes, but needs an amplitude that its prior makes improbable, may bend: a film at a third of its value is three
    // standard deviations off and not the six that its slope needs.
    let is_single = |c: &&Candidate| c.members.len() == 1;
    let most_gain = chosen.iter().filter(is_single).map(|c| c.gain).fold(0.0, f64::max);
    let looks_alike = |c: &&Candidate| c.gain > ALIKE * most_gain && !chosen.iter().any(|other| other.members == c.members);
    let mut alike: Vec<Candidate> = candidates.iter().filter(is_single).filter(looks_alike).cloned().collect();
    alike.sort_by(|a, b| b.gain.total_cmp(&a.gain));
    alike.truncate(MOST_ALIKE);
    chosen.extend(alike);
    chosen
}

/// Single causes that slopes may do wrong: what is left beside them could be the bend of their own effect, and then less than the best of
/// all leaves.
///
/// Readings that are off by many times their noise show where an effect bends. A sensor's gain is straight, and leaves less than the slope
/// of the contact that has changed, although that contact explains everything. Where slopes leave no more than noise nobody is in doubt.
pub(crate) fn doubted<'a>(
    posterior: &Posterior,
    screened: &Screened,
    chosen: &[Candidate],
    of: &dyn Fn(usize) -> &'a Hypothesis,
) -> Vec<Candidate> {
    let singles = || posterior.candidates.iter().filter(|c| c.members.len() == 1);
    let left = |c: &Candidate| (screened.misfit() - c.gain).max(0.0);
    let least = singles().map(left).fold(f64::INFINITY, f64::min);
    if !least.is_finite() || chi_square_tail(least, screened.residual.len()) > LEFT {
        return Vec::new();
    }
    // What it leaves at best: its effect may be off by a share of its own length, in any direction.
    let at_best = |c: &Candidate| {
        let h = of(c.members[0]);
        left(c).sqrt() - h.bend(c.amplitudes[0] * h.scale) * c.gain.sqrt()
    };
    let is_open = |c: &&Candidate| at_best(c) < least.sqrt() && !chosen.iter().any(|other| other.members == c.members);
    let mut found: Vec<Candidate> = singles().filter(is_open).cloned().collect();
    found.sort_by(|a, b| at_best(a).total_cmp(&at_best(b)));
    found.truncate(MOST_DOUBTED);
    found
}
