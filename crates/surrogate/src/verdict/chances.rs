//! Contributions to the probability of a verdict: parameters, the fit and the model error, and the reading that would
//! tell most.

use coldplate_runtime::{Chance, Origin, Surrogate};

use super::{ChanceAnswer, TellingReading, VarianceShare};

/// Standard deviation of the instrument whose reading is weighed, in the point's unit. Chosen: a usual temperature
/// sensor; a better one would be worth more.
const INSTRUMENT: f64 = 0.1;
/// Least share of the variance that a reading must take away to be named. Chosen: a smaller gain is not worth a
/// measurement.
const WORTH: f64 = 0.1;

/// Name of the part of a variance that is the error of the mesh.
pub(super) const MESH: &str = "the mesh";

/// The probability with the contributions that decide it, at the condition `x` where the points have `values`.
pub(super) fn explain(surrogate: &Surrogate<'_>, x: &[f64], values: &[f64], chance: Chance, confidence: f64) -> ChanceAnswer {
    let binding = chance.binding;
    ChanceAnswer {
        probability: chance.probability,
        confidence,
        deciding: binding.map(|limit| shares(surrogate, limit, x, values)).unwrap_or_default(),
        would_settle: binding.and_then(|limit| settling(surrogate, limit, x, values)),
    }
}

/// Shares in the variance of a limit, the largest first.
fn shares(surrogate: &Surrogate<'_>, limit: usize, x: &[f64], values: &[f64]) -> Vec<VarianceShare> {
    let (Some(uncertainty), Some(own)) = (surrogate.uncertainty(), surrogate.limit_chance(limit, x, None, values)) else {
        return Vec::new();
    };
    let mut of = vec![0.0; uncertainty.parameter_count()];
    if surrogate.shares(limit, x, None, values, &mut of).is_err() {
        return Vec::new();
    }
    let parts = [own.band.fit, own.band.mesh, own.band.parameters, own.band.misses];
    let whole: f64 = parts.iter().map(|part| part.powi(2)).sum();
    let share = |variance: f64| if whole > 0.0 { variance / whole } else { 0.0 };
    let parameters = uncertainty.parameters().zip(&of).map(|(p, of)| VarianceShare {
        name: p.name.to_owned(),
        share: share(of * own.band.parameters.powi(2)),
        is_assumed: p.origin == Origin::Assumed,
    });
    let others = [("fit", own.band.fit), (MESH, own.band.mesh), ("what the model misses", own.band.misses)];
    let others = others.map(|(name, deviation)| VarianceShare { name: name.into(), share: share(deviation.powi(2)), is_assumed: false });
    let others = others.into_iter().filter(|own| own.name != MESH || surrogate.mesh_half_width(0).is_some());
    let mut all: Vec<VarianceShare> = parameters.chain(others).collect();
    all.sort_by(|a, b| b.share.total_cmp(&a.share));
    all
}

/// The point whose reading would tell most about a limit.
fn settling(surrogate: &Surrogate<'_>, limit: usize, x: &[f64], values: &[f64]) -> Option<TellingReading> {
    let worth = |(p, point)| Some((surrogate.worth(limit, x, None, values, p, INSTRUMENT)?, point));
    let (share, point): (f64, coldplate_runtime::Point<'_>) =
        surrogate.points().enumerate().filter_map(worth).max_by(|a, b| a.0.total_cmp(&b.0))?;
    let unit = if matches!(point.unit, "degC" | "°C") { "K" } else { point.unit };
    (share >= WORTH).then(|| TellingReading { point: point.name.to_owned(), deviation: INSTRUMENT, unit: unit.to_owned(), share })
}
