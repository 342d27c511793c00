//! Values of a surrogate at a condition, straight from its owned data: the definition that the runtime crate is tested
//! against.

use coldplate_runtime::NINETY_FIVE;

use super::model::{Kernel, Miss, PointModel, PolynomialSpec, SurrogateSpec, Transform, UncertaintySpec, VariableSpec};
use coldplate_base::error::{Error, Result};

/// g(x) of a transform.
pub(crate) fn transformed(transform: Transform, x: f64) -> f64 {
    match transform {
        Transform::Identity => x,
        Transform::Reciprocal => 1.0 / x,
        Transform::Log => libm::log(x),
    }
}

/// A kernel as a function of the squared distance r².
pub fn radial(kernel: Kernel, r2: f64) -> f64 {
    match kernel {
        Kernel::ThinPlate if r2 > 0.0 => 0.5 * r2 * libm::log(r2),
        Kernel::ThinPlate => 0.0,
        Kernel::Cubic => r2 * libm::sqrt(r2),
        Kernel::Multiquadric => libm::sqrt(1.0 + r2),
        Kernel::Gaussian => libm::exp(-r2),
    }
}

/// u = 2 (g(x) - g(low)) / (g(high) - g(low)) - 1; 0 where the variable has no range.
pub fn scaled(variable: &VariableSpec, transform: Transform, x: f64) -> f64 {
    let (low, high) = (transformed(transform, variable.low), transformed(transform, variable.high));
    if high == low { 0.0 } else { 2.0 * (transformed(transform, x) - low) / (high - low) - 1.0 }
}

/// A condition in scaled variables.
pub fn scale_row(variables: &[VariableSpec], transforms: &[Transform], x: &[f64]) -> Vec<f64> {
    variables.iter().zip(transforms).zip(x).map(|((variable, transform), x)| scaled(variable, *transform, *x)).collect()
}

/// Product of powers of the scaled variables.
pub(super) fn monomial(exponents: &[u8], u: &[f64]) -> f64 {
    exponents.iter().zip(u).fold(1.0, |product, (e, u)| (0..*e).fold(product, |p, _| p * u))
}

fn polynomial_value(polynomial: &PolynomialSpec, variables: &[VariableSpec], x: &[f64]) -> f64 {
    let u = scale_row(variables, &polynomial.transforms, x);
    polynomial.terms.iter().zip(&polynomial.coefficients).map(|(term, c)| c * monomial(term, &u)).sum()
}

/// Value of point `point` at the condition `x`, in the point's unit.
///
/// # Errors
/// A point or basis that does not exist, or a condition of the wrong length, as bad input.
pub fn evaluate(surrogate: &SurrogateSpec, point: usize, x: &[f64]) -> Result<f64> {
    let index = point;
    let Some(point) = surrogate.points.get(index) else {
        return Err(Error::input(format!("point {index} is asked for, the surrogate has {}", surrogate.points.len())));
    };
    if x.len() != surrogate.variables.len() {
        return Err(Error::input(format!("a condition of this surrogate has {} values", surrogate.variables.len())).read(x.len()));
    }
    let learnt = surrogate.uncertainty.as_ref().map_or(0.0, |own| own.shift(surrogate, index, x));
    match &point.model {
        PointModel::Polynomial(polynomial) => Ok(polynomial_value(polynomial, &surrogate.variables, x) + learnt),
        PointModel::Rbf { basis, weights, tail } => {
            let Some(basis) = surrogate.bases.get(*basis) else {
                return Err(Error::input("a point names a radial basis the surrogate does not hold").at_key(point.name.clone()));
            };
            let u = scale_row(&surrogate.variables, &basis.transforms, x);
            let radial: f64 = basis
                .centres
                .iter()
                .zip(weights)
                .map(|(centre, w)| w * radial(basis.kernel, distance_square(&basis.scales, &u, centre)))
                .sum();
            Ok(radial + polynomial_value(tail, &surrogate.variables, x) + learnt)
        }
    }
}

/// Σ (s_k (a_k - b_k))².
pub(super) fn distance_square(scales: &[f64], a: &[f64], b: &[f64]) -> f64 {
    scales.iter().zip(a).zip(b).map(|((s, a), b)| (s * (a - b)).powi(2)).sum()
}

impl UncertaintySpec {
    /// Change of a point with one standard deviation of each parameter at the condition `x`, in the point's unit.
    pub fn slopes_at(&self, surrogate: &SurrogateSpec, point: usize, x: &[f64]) -> Vec<f64> {
        let u = scale_row(&surrogate.variables, &self.transforms, x);
        let mut slopes = vec![0.0; self.parameters.len()];
        for (term, row) in self.terms.iter().zip(&self.slopes[point]) {
            let factor = monomial(term, &u);
            slopes.iter_mut().zip(row).for_each(|(s, c)| *s += factor * c);
        }
        slopes
    }

    /// Change of a point's value by the mean of the states at the condition `x`, in the point's unit.
    pub fn shift(&self, surrogate: &SurrogateSpec, point: usize, x: &[f64]) -> f64 {
        let Some(states) = &self.states else { return 0.0 };
        let (count, Miss { own, common }) = (self.parameters.len(), self.misses[point]);
        let slopes: f64 = self.slopes_at(surrogate, point, x).iter().zip(&states.mean).map(|(s, m)| s * m).sum();
        let last = states.mean.len() - 1;
        slopes + own * states.mean[count + point] + common * states.mean[last]
    }

    /// Standard deviation of a point's value at the condition `x`, in the point's unit: the definition that the runtime crate
    /// is tested against.
    pub fn deviation(&self, surrogate: &SurrogateSpec, point: usize, x: &[f64]) -> f64 {
        let (count, points) = (self.parameters.len(), surrogate.points.len());
        let Miss { own, common } = self.misses[point];
        let mut weights = self.slopes_at(surrogate, point, x);
        weights.extend((0..points).map(|p| if p == point { own } else { 0.0 }));
        weights.push(common);
        let covariance = |i: usize, j: usize| match &self.states {
            Some(states) => states.covariance[i.max(j) * (i.max(j) + 1) / 2 + i.min(j)],
            None => f64::from(u8::from(i == j)),
        };
        let n = count + points + 1;
        let by_states: f64 = (0..n).map(|i| weights[i] * (0..n).map(|j| weights[j] * covariance(i, j)).sum::<f64>()).sum();
        let fit = surrogate.points[point].half_width / NINETY_FIVE;
        let away = self.growth * self.distance(surrogate, x);
        (by_states.max(0.0) + fit * fit + away * away * (own * own + common * common)).sqrt()
    }

    fn distance(&self, surrogate: &SurrogateSpec, x: &[f64]) -> f64 {
        let rows = self.measured.len() as f64;
        let square = |(k, v): (usize, &VariableSpec)| {
            let mean = self.measured.iter().map(|row| row[k]).sum::<f64>() / rows;
            if v.high > v.low { (2.0 * (x[k] - mean) / (v.high - v.low)).powi(2) } else { 0.0 }
        };
        if self.measured.is_empty() { 0.0 } else { surrogate.variables.iter().enumerate().map(square).sum::<f64>().sqrt() }
    }
}
