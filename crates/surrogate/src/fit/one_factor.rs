//! Polynomials in one raw variable, printed as formulas: the form of Tables 7 to 10 of the paper (cubic in flow, quadratic
//! in coolant temperature, motor speed and ambient temperature).
//!
//! The fit is made in Legendre polynomials of the variable scaled to [-1, 1], where least squares is well conditioned, and
//! expanded into powers of the raw variable in double-double arithmetic, so high degrees and narrow ranges far from zero
//! keep their digits.

use std::fmt;

use statrs::distribution::{ContinuousCDF, StudentsT};

use super::double_double::DoubleDouble;
use super::least_squares::{accurate_least_squares, max_abs};
use coldplate_base::error::{Error, Result};
use coldplate_base::numbers::compact;
use coldplate_base::numbers::root_mean_square;

/// Smallest difference that a printed formula keeps, in the unit of y, K or um. Chosen: no thermometer resolves a
/// thousandth of a kelvin, and the solver's own error is larger.
pub const RESOLVED: f64 = 1e-3;

/// y = c₀ + c₁ x + c₂ x² + ... in the raw variable.
#[derive(Debug, Clone)]
pub struct OneFactorFit {
    /// Coefficients of x⁰, x¹, ...
    pub coefficients: Vec<f64>,
    /// Standard deviation of each coefficient for independent errors of equal variance.
    pub standard_errors: Vec<f64>,
    /// Share of the variance about the mean that the fit explains.
    pub r_squared: f64,
    /// sqrt(sum of squared residuals / (rows - coefficients)).
    pub residual_deviation: f64,
    /// Root mean square of the residuals.
    pub rms: f64,
    /// Root mean square of the leave-one-out residuals; infinite where the fit needs a row.
    pub loo_rms: f64,
    /// Largest leave-one-out residual.
    pub loo_max: f64,
    /// Rows used (those where both x and y are present).
    pub rows: usize,
}

impl OneFactorFit {
    /// Fits a polynomial of `degree` to the pairs of `x` and `y`; pairs with a missing (NaN) value are left out.
    ///
    /// # Errors
    /// Fewer distinct values of x than coefficients, a value that is infinite, or lists of different lengths, as bad input.
    pub fn fit(x: &[f64], y: &[f64], degree: usize) -> Result<Self> {
        if x.len() != y.len() {
            return Err(Error::input(format!("{} values of x but {} of y", x.len(), y.len())));
        }
        let (x, y): (Vec<f64>, Vec<f64>) = x.iter().zip(y).filter(|(x, y)| !x.is_nan() && !y.is_nan()).unzip();
        if x.iter().chain(&y).any(|v| v.is_infinite()) {
            return Err(Error::input("a value to fit is infinite"));
        }
        let mut distinct = x.clone();
        distinct.sort_by(f64::total_cmp);
        distinct.dedup();
        let (Some(low), Some(high)) = (distinct.first(), distinct.last()) else {
            return Err(Error::input("no rows to fit: every one misses a value"));
        };
        if distinct.len() <= degree {
            return Err(Error::input(format!("degree {degree} needs {} distinct values of the variable", degree + 1))
                .read(distinct.len())
                .help("give more conditions, or a lower degree"));
        }
        let centre = 0.5 * (low + high);
        let half = if high > low { 0.5 * (high - low) } else { 1.0 };
        let u: Vec<DoubleDouble> =
            x.iter().map(|x| (DoubleDouble::from(*x) - DoubleDouble::from(centre)) / DoubleDouble::from(half)).collect();
        let columns: Vec<Vec<DoubleDouble>> = (0..=degree).map(|k| u.iter().map(|u| accurate_legendre(k, *u)).collect()).collect();
        let (solution, in_legendre) = accurate_least_squares(&columns, &y)?;
        let coefficients = raw_powers(&in_legendre, centre, half);
        let columns: Vec<Vec<f64>> = columns.iter().map(|c| c.iter().map(|x| x.value()).collect()).collect();
        Ok(Self {
            standard_errors: raw_standard_errors(&columns, &solution.residuals, degree, centre, half),
            coefficients,
            r_squared: solution.r_squared,
            residual_deviation: solution.residual_deviation,
            rms: root_mean_square(&solution.residuals),
            loo_rms: root_mean_square(&solution.left_out),
            loo_max: max_abs(&solution.left_out),
            rows: y.len(),
        })
    }

    /// Value at `x`.
    pub fn value(&self, x: f64) -> f64 {
        self.coefficients.iter().rev().fold(0.0, |y, c| y * x + c)
    }

    /// Half width of the band that holds a new value with probability `coverage`, for independent normal
    /// errors of equal variance, at a row of mean leverage; infinite where no degree of freedom is left.
    pub fn half_width(&self, coverage: f64) -> f64 {
        let (rows, terms) = (self.rows as f64, self.coefficients.len() as f64);
        match StudentsT::new(0.0, 1.0, rows - terms) {
            Ok(t) => t.inverse_cdf(0.5 + coverage / 2.0) * self.residual_deviation * (1.0 + terms / rows).sqrt(),
            Err(_) => f64::INFINITY,
        }
    }

    /// The formula with as many digits as its band is worth over `low` to `high`: rounding changes no value there by more
    /// than a tenth of the half width (95 %), or of [`RESOLVED`] where the band is narrower. A term that never reaches that
    /// is left out.
    pub fn honest_formula(&self, y: &str, x: &str, low: f64, high: f64) -> String {
        let band = self.half_width(0.95);
        let worth = 0.1 * if band.is_finite() { band.max(RESOLVED) } else { RESOLVED };
        let share = worth / self.coefficients.len() as f64;
        let reach = low.abs().max(high.abs());
        let rounded = |(k, c): (usize, &f64)| {
            let most = reach.powi(k as i32);
            if k > 0 && (c * most).abs() < share {
                return 0.0;
            }
            let step = share / most.max(1e-300);
            let digits = (c.abs().log10().floor() - step.log10().floor()).clamp(0.0, 15.0) as usize;
            format!("{c:.digits$e}").parse().unwrap_or(*c)
        };
        let coefficients = self.coefficients.iter().enumerate().map(rounded).collect();
        Self { coefficients, ..self.clone() }.formula(y, x, 15)
    }

    /// The formula with `digits` significant digits, for example
    /// `y = -3.178e-5 x^3 + 0.00117 x^2 - 0.02727 x + 25.76486`.
    pub fn formula(&self, y: &str, x: &str, digits: usize) -> String {
        let mut text = format!("{y} =");
        let mut first = true;
        for (k, c) in self.coefficients.iter().enumerate().rev() {
            if *c == 0.0 && self.coefficients.len() > 1 {
                continue;
            }
            match (first, *c < 0.0) {
                (true, true) => text.push_str(" -"),
                (true, false) => text.push(' '),
                (false, true) => text.push_str(" - "),
                (false, false) => text.push_str(" + "),
            }
            text.push_str(&compact(c.abs(), digits));
            match k {
                0 => {}
                1 => text.push_str(&format!(" {x}")),
                _ => text.push_str(&format!(" {x}^{k}")),
            }
            first = false;
        }
        if first {
            text.push_str(" 0");
        }
        text
    }
}

impl fmt::Display for OneFactorFit {
    /// The formula in `y` and `x` with seven significant digits.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.formula("y", "x", 7))
    }
}

/// Legendre polynomial P_k(u) by its three-term recurrence.
pub(super) fn legendre(k: usize, u: f64) -> f64 {
    let (mut p, mut next) = (1.0, u);
    for j in 1..=k {
        (p, next) = (next, ((2 * j + 1) as f64 * u * next - j as f64 * p) / (j + 1) as f64);
    }
    p
}

/// P_k(u) to twice the working precision.
fn accurate_legendre(k: usize, u: DoubleDouble) -> DoubleDouble {
    let number = |n: usize| DoubleDouble::from(n as f64);
    let (mut p, mut next) = (number(1), u);
    for j in 1..=k {
        (p, next) = (next, (number(2 * j + 1) * u * next - number(j) * p) / number(j + 1));
    }
    p
}

/// Coefficients of P_k in powers of u.
pub(super) fn legendre_powers(k: usize) -> Vec<f64> {
    let (mut p, mut next) = (vec![1.0], vec![0.0, 1.0]);
    for j in 1..=k {
        let mut after = vec![0.0; j + 2];
        for (power, c) in next.iter().enumerate() {
            after[power + 1] += (2 * j + 1) as f64 * c / (j + 1) as f64;
        }
        for (power, c) in p.iter().enumerate() {
            after[power] -= j as f64 * c / (j + 1) as f64;
        }
        (p, next) = (next, after);
    }
    p
}

/// Rows of the matrix that turns Legendre coefficients in u = (x - centre) / half into powers of x: T[power][k].
fn to_raw(degree: usize, centre: f64, half: f64) -> Vec<Vec<DoubleDouble>> {
    let zero = DoubleDouble::from(0.0);
    let (centre, half) = (DoubleDouble::from(centre), DoubleDouble::from(half));
    let mut table = vec![vec![zero; degree + 1]; degree + 1];
    let times_u = |p: &[DoubleDouble]| {
        let mut q = vec![zero; p.len() + 1];
        for (power, c) in p.iter().enumerate() {
            let scaled = *c / half;
            q[power + 1] = q[power + 1] + scaled;
            q[power] = q[power] - scaled * centre;
        }
        q
    };
    let mut p = vec![DoubleDouble::from(1.0)];
    let mut next = times_u(&p);
    for k in 0..=degree {
        for (row, c) in table.iter_mut().zip(&p) {
            row[k] = *c;
        }
        let j = DoubleDouble::from(k as f64 + 1.0);
        let mut after = times_u(&next);
        let (up, down) = (DoubleDouble::from(2.0 * k as f64 + 3.0), j);
        let divisor = DoubleDouble::from(k as f64 + 2.0);
        after.iter_mut().for_each(|c| *c = *c * up / divisor);
        for (power, c) in p.iter().enumerate() {
            after[power] = after[power] - *c * down / divisor;
        }
        (p, next) = (next, after);
    }
    table
}

fn raw_powers(legendre: &[DoubleDouble], centre: f64, half: f64) -> Vec<f64> {
    let Some(degree) = legendre.len().checked_sub(1) else { return Vec::new() };
    to_raw(degree, centre, half)
        .iter()
        .map(|row| {
            let zero = DoubleDouble::from(0.0);
            row.iter().zip(legendre).fold(zero, |sum, (t, c)| sum + *t * *c).value()
        })
        .collect()
}

/// Standard deviations of the raw coefficients: the rows of T R⁻¹, T from Legendre to raw powers.
fn raw_standard_errors(columns: &[Vec<f64>], residuals: &[f64], degree: usize, centre: f64, half: f64) -> Vec<f64> {
    let freedom = residuals.len().saturating_sub(degree + 1);
    let variance = if freedom > 0 { residuals.iter().map(|e| e * e).sum::<f64>() / freedom as f64 } else { 0.0 };
    let mut basis = super::least_squares::Orthonormal::new();
    columns.iter().for_each(|column| {
        basis.push(column);
    });
    let table = to_raw(degree, centre, half);
    let mut sums = vec![0.0; degree + 1];
    for k in 0..=degree {
        let mut unit = vec![0.0; degree + 1];
        unit[k] = 1.0;
        let inverse_column = basis.back_substitute(&unit);
        for (sum, row) in sums.iter_mut().zip(&table) {
            let t = row.iter().zip(&inverse_column).fold(DoubleDouble::from(0.0), |s, (t, c)| s + *t * DoubleDouble::from(*c));
            *sum += t.value().powi(2);
        }
    }
    sums.iter().map(|s| (s * variance).sqrt()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_print_with_their_significant_digits() {
        assert_eq!(compact(3.178e-5, 4), "3.178e-5");
        assert_eq!(compact(0.00117, 7), "0.00117");
        assert_eq!(compact(25.76486, 7), "25.76486");
        assert_eq!(compact(1234567.8, 3), "1230000");
        assert_eq!(compact(9.9999e-5, 2), "0.0001");
        assert_eq!(compact(0.0, 5), "0");
    }

    #[test]
    fn formulas_have_the_digits_their_band_is_worth() {
        let noise = [0.003, -0.002, 0.001, -0.004, 0.002, 0.001, -0.001];
        let x: Vec<f64> = (0..7).map(|i| 250.0 + 375.0 * f64::from(i)).collect();
        let y: Vec<f64> = x.iter().zip(noise).map(|(x, e)| 20.0 + 0.006 * x + e).collect();
        let fit = OneFactorFit::fit(&x, &y, 1).unwrap();
        let text = fit.honest_formula("y", "x", 250.0, 2500.0);
        assert!(text.len() < 26, "{text}");
        // A constant has no slope to print, however many digits rounding leaves it.
        let flat = OneFactorFit::fit(&x, &[20.0088; 7], 2).unwrap();
        assert_eq!(flat.honest_formula("y", "x", 250.0, 2500.0), "y = 20.0088");
    }

    #[test]
    fn legendre_powers_agree_with_the_recurrence() {
        for k in 0..12 {
            for u in [-1.0, -0.3, 0.0, 0.7, 1.0] {
                let by_powers = legendre_powers(k).iter().rev().fold(0.0, |y, c| y * u + c);
                assert!((by_powers - legendre(k, u)).abs() < 1e-12, "P_{k}({u})");
            }
        }
    }
}
