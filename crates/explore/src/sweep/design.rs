//! Designs of experiments on the unit cube, and the way from there to a variable's range.

pub use super::lhs::maximin as latin_hypercube;
pub use super::sobol::points as sobol;

use coldplate_base::random::Random;

/// Spacing of the points of a design along a variable's range.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum LevelSpacing {
    /// Evenly in the variable.
    #[default]
    Linear,
    /// Evenly in the variable's logarithm; the range must be positive.
    Logarithmic,
    /// Evenly in the variable's reciprocal, so densest at the low end; the range must not touch zero.
    Reciprocal,
}

impl LevelSpacing {
    /// Names in sweep files, in the order of the variants.
    pub const NAMES: [&str; 3] = ["linear", "log", "reciprocal"];

    /// The spacing called `NAMES[index]`.
    pub fn named(index: usize) -> Self {
        [Self::Linear, Self::Logarithmic, Self::Reciprocal].get(index).copied().unwrap_or_default()
    }

    /// The value at `unit` in [0, 1] of the range from `low` to `high`; both ends are met exactly.
    pub fn value(self, unit: f64, low: f64, high: f64) -> f64 {
        let mix = |a: f64, b: f64| a * (1.0 - unit) + b * unit;
        match unit {
            0.0 => low,
            1.0 => high,
            _ => match self {
                Self::Linear => mix(low, high),
                Self::Logarithmic => libm::exp(mix(libm::log(low), libm::log(high))),
                Self::Reciprocal => 1.0 / mix(1.0 / low, 1.0 / high),
            },
        }
    }

    /// Place of `value` in the range from `low` to `high`, in [0, 1]: the inverse of [`LevelSpacing::value`].
    pub fn unit(self, value: f64, low: f64, high: f64) -> f64 {
        let share = |g: fn(f64) -> f64| (g(value) - g(low)) / (g(high) - g(low));
        match self {
            Self::Linear => share(|x| x),
            Self::Logarithmic => share(libm::log),
            Self::Reciprocal => share(|x| 1.0 / x),
        }
    }
}

/// `points` values from `low` to `high`, evenly spaced in the sense of `spacing`; the middle for a single point.
pub fn levels(points: usize, low: f64, high: f64, spacing: LevelSpacing) -> Vec<f64> {
    let unit = |k: usize| if points > 1 { k as f64 / (points - 1) as f64 } else { 0.5 };
    (0..points).map(|k| spacing.value(unit(k), low, high)).collect()
}

/// Every combination of the levels of each variable; the last variable changes fastest.
pub fn full_factorial(levels: &[Vec<f64>]) -> Vec<Vec<f64>> {
    levels.iter().fold(vec![Vec::new()], |rows, values| {
        rows.iter().flat_map(|row| values.iter().map(move |v| row.iter().copied().chain([*v]).collect())).collect()
    })
}

/// Independent uniform points in [0, 1)^`dimensions`, for checking a fit at other conditions than its own.
pub fn uniform(count: usize, dimensions: usize, seed: u64) -> Vec<Vec<f64>> {
    let mut rng = Random::new(seed);
    (0..count).map(|_| (0..dimensions).map(|_| rng.unit()).collect()).collect()
}

/// The 2^`dimensions` corners of the unit cube.
pub fn corners(dimensions: usize) -> Vec<Vec<f64>> {
    full_factorial(&vec![vec![0.0, 1.0]; dimensions])
}
