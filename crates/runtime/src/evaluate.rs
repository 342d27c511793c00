//! Values and gradients.
//!
//! Terms and centres are worked off in blocks that fit the stack. Monomials and kernels are computed
//! once per block and shared by all points of a polynomial or basis, which then cost one dot
//! product each.

use core::fmt;

use crate::bytes::Numbers;
use crate::format::{MAX_DEGREE, MAX_VARIABLES};
use crate::math::{exp_minus, ln, ln_normal, sqrt};
use crate::surrogate::{Basis, Kernel, Polynomial, Scaling, Surrogate, Transform};

/// Terms or centres worked on at a time.
const BLOCK: usize = 128;
/// Places for the powers 0 to 12 of a scaled variable; a power of two, so that a mask bounds the index.
const POWERS: usize = 16;
const _: () = assert!(MAX_DEGREE < POWERS);

type Scaled = [f64; MAX_VARIABLES];

/// A slice does not have the length the surrogate asks for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ShapeError {
    /// Which argument.
    pub argument: &'static str,
    /// The length it must have, or the number it must stay under.
    pub expected: usize,
    /// The length or index that was given.
    pub found: usize,
}

impl fmt::Display for ShapeError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: expected {}, found {}", self.argument, self.expected, self.found)
    }
}

impl core::error::Error for ShapeError {}

fn check(argument: &'static str, expected: usize, found: usize) -> Result<(), ShapeError> {
    if expected == found { Ok(()) } else { Err(ShapeError { argument, expected, found }) }
}

impl Transform {
    /// g(x)
    pub(crate) fn apply(self, x: f64) -> f64 {
        match self {
            Self::Identity => x,
            Self::Reciprocal => 1.0 / x,
            Self::Log => ln(x),
        }
    }

    /// g'(x)
    fn slope(self, x: f64) -> f64 {
        match self {
            Self::Identity => 1.0,
            Self::Reciprocal => -1.0 / (x * x),
            Self::Log => 1.0 / x,
        }
    }
}

impl Surrogate<'_> {
    /// The values of all points at condition `x`, given in the variables' units, into `values`, in
    /// the points' units. Outside the fitted range the models extrapolate, and may give infinities
    /// or NaN; ask [`Surrogate::in_domain`].
    ///
    /// # Errors
    /// If `x` does not have one value per variable, or `values` one place per point.
    pub fn evaluate(&self, x: &[f64], values: &mut [f64]) -> Result<(), ShapeError> {
        check("number of variables", self.variables.len(), x.len())?;
        check("number of points", self.points.len(), values.len())?;
        let scaled = self.scale(x);
        values.fill(0.0);
        for polynomial in self.polynomials() {
            let u = pick(polynomial.transforms, &scaled);
            let powers = powers(&u[..x.len()], polynomial.degree);
            let mut done = 0;
            while done < polynomial.terms {
                let mut buffer = [0.0; BLOCK];
                let block = &mut buffer[..BLOCK.min(polynomial.terms - done)];
                monomials(&polynomial, x.len(), done, &powers, block);
                for (row, point) in polynomial.points.iter().enumerate() {
                    let coefficients = polynomial.coefficients.part(row * polynomial.terms + done, block.len());
                    if let Some(value) = values.get_mut(point) {
                        *value += dot(block, coefficients);
                    }
                }
                done += block.len();
            }
        }
        for basis in self.bases() {
            let u = pick(basis.transforms, &scaled);
            let mut done = 0;
            while done < basis.count {
                let mut buffer = [0.0; BLOCK];
                let block = &mut buffer[..BLOCK.min(basis.count - done)];
                squared_distances(&basis, &u[..x.len()], done, block);
                kernel_values(basis.kernel, block);
                for (row, point) in basis.points.iter().enumerate() {
                    if let Some(value) = values.get_mut(point) {
                        *value += dot(block, basis.weights.part(row * basis.count + done, block.len()));
                    }
                }
                done += block.len();
            }
        }
        Ok(())
    }

    /// The value of one point at condition `x`: the same bits as [`Surrogate::evaluate`] gives.
    ///
    /// # Errors
    /// If `x` does not have one value per variable, or there is no such point.
    pub fn evaluate_point(&self, x: &[f64], point: usize) -> Result<f64, ShapeError> {
        self.check_point(x, point)?;
        let scaled = self.scale(x);
        let mut value = 0.0;
        let mut buffer = [0.0; BLOCK];
        if let Some((polynomial, row)) = self.polynomial_of(point) {
            let u = pick(polynomial.transforms, &scaled);
            let powers = powers(&u[..x.len()], polynomial.degree);
            let mut done = 0;
            while done < polynomial.terms {
                let block = &mut buffer[..BLOCK.min(polynomial.terms - done)];
                monomials(&polynomial, x.len(), done, &powers, block);
                value += dot(block, polynomial.coefficients.part(row * polynomial.terms + done, block.len()));
                done += block.len();
            }
        }
        if let Some((basis, row)) = self.basis_of(point) {
            let u = pick(basis.transforms, &scaled);
            let mut done = 0;
            while done < basis.count {
                let block = &mut buffer[..BLOCK.min(basis.count - done)];
                block.fill(0.0);
                squared_distances(&basis, &u[..x.len()], done, block);
                kernel_values(basis.kernel, block);
                value += dot(block, basis.weights.part(row * basis.count + done, block.len()));
                done += block.len();
            }
        }
        Ok(value)
    }

    /// The derivatives of one point's value with respect to each variable at condition `x`, in the
    /// point's unit per unit of the variable, by the closed form.
    ///
    /// # Errors
    /// If `x` does not have one value per variable, `gradient` not one place per variable, or there
    /// is no such point.
    pub fn gradient(&self, x: &[f64], point: usize, gradient: &mut [f64]) -> Result<(), ShapeError> {
        self.check_point(x, point)?;
        check("places for the gradient", self.variables.len(), gradient.len())?;
        let scaled = self.scale(x);
        gradient.fill(0.0);
        if let Some((polynomial, row)) = self.polynomial_of(point) {
            let mut slopes = [0.0; MAX_VARIABLES];
            self.polynomial_slopes(&polynomial, row, &pick(polynomial.transforms, &scaled), x.len(), &mut slopes);
            self.chain(polynomial.transforms, x, &slopes, gradient);
        }
        if let Some((basis, row)) = self.basis_of(point) {
            let mut slopes = [0.0; MAX_VARIABLES];
            self.basis_slopes(&basis, row, &pick(basis.transforms, &scaled), x.len(), &mut slopes);
            self.chain(basis.transforms, x, &slopes, gradient);
        }
        Ok(())
    }

    fn polynomial_slopes(&self, polynomial: &Polynomial<'_>, row: usize, u: &Scaled, variables: usize, slopes: &mut Scaled) {
        let powers = powers(&u[..variables], polynomial.degree);
        let coefficients = polynomial.coefficients.part(row * polynomial.terms, polynomial.terms);
        for (exponents, coefficient) in polynomial.exponents.chunks_exact(variables.max(1)).zip(coefficients.iter()) {
            for (by, slope) in slopes.iter_mut().enumerate().take(variables) {
                let mut term = coefficient;
                for (v, (exponent, powers)) in exponents.iter().zip(&powers).enumerate() {
                    term *= match (v == by, *exponent) {
                        (true, 0) => 0.0,
                        (true, e) => f64::from(e) * powers[usize::from(e - 1) % POWERS],
                        (false, e) => powers[usize::from(e) % POWERS],
                    };
                }
                *slope += term;
            }
        }
    }

    fn basis_slopes(&self, basis: &Basis<'_>, row: usize, u: &Scaled, variables: usize, slopes: &mut Scaled) {
        let weights = basis.weights.part(row * basis.count, basis.count);
        for (centre, weight) in weights.iter().enumerate() {
            let mut square = 0.0;
            let mut pull = [0.0; MAX_VARIABLES]; // half the slope of the squared distance
            for (v, pull) in pull.iter_mut().enumerate().take(variables) {
                let scale = basis.scales.at(v);
                let d = (u[v] - basis.centres.at(v * basis.count + centre)) * scale;
                square += d * d;
                *pull = d * scale;
            }
            let slope = weight * 2.0 * kernel_slope(basis.kernel, square);
            for (total, pull) in slopes.iter_mut().zip(pull) {
                *total += slope * pull;
            }
        }
    }

    /// Adds slopes with respect to the scaled variables as slopes with respect to the variables.
    fn chain(&self, transforms: &[u8], x: &[f64], slopes: &Scaled, gradient: &mut [f64]) {
        for (v, (gradient, (x, slope))) in gradient.iter_mut().zip(x.iter().zip(slopes)).enumerate() {
            let transform = transforms.get(v).copied().and_then(Transform::from_code).unwrap_or(Transform::Identity);
            let factor = self.scaling[transform as usize][v % MAX_VARIABLES].map_or(0.0, |s| s.factor);
            *gradient += slope * factor * transform.slope(*x);
        }
    }

    /// The scaled variables under each transform that some model uses.
    fn scale(&self, x: &[f64]) -> [Scaled; 3] {
        let mut scaled = [[0.0; MAX_VARIABLES]; 3];
        for (transform, (scaled, scaling)) in
            [Transform::Identity, Transform::Reciprocal, Transform::Log].into_iter().zip(scaled.iter_mut().zip(&self.scaling))
        {
            for (x, (u, scaling)) in x.iter().zip(scaled.iter_mut().zip(scaling)) {
                if let Some(Scaling { low, factor, offset }) = scaling {
                    *u = (transform.apply(*x) - low) * factor + offset;
                }
            }
        }
        scaled
    }

    fn check_point(&self, x: &[f64], point: usize) -> Result<(), ShapeError> {
        check("number of variables", self.variables.len(), x.len())?;
        if point < self.points.len() {
            Ok(())
        } else {
            Err(ShapeError { argument: "index of the point", expected: self.points.len(), found: point })
        }
    }

    fn polynomial_of(&self, point: usize) -> Option<(Polynomial<'_>, usize)> {
        self.polynomials().find_map(|p| p.points.iter().position(|i| i == point).map(|row| (p, row)))
    }

    fn basis_of(&self, point: usize) -> Option<(Basis<'_>, usize)> {
        self.bases().find_map(|b| b.points.iter().position(|i| i == point).map(|row| (b, row)))
    }
}

fn pick(transforms: &[u8], scaled: &[Scaled; 3]) -> Scaled {
    let mut u = [0.0; MAX_VARIABLES];
    for (v, (u, code)) in u.iter_mut().zip(transforms).enumerate() {
        *u = scaled[usize::from(*code).min(2)][v];
    }
    u
}

/// Powers 0 to `degree` of each scaled variable.
fn powers(u: &[f64], degree: usize) -> [[f64; POWERS]; MAX_VARIABLES] {
    let mut powers = [[1.0; POWERS]; MAX_VARIABLES];
    for (u, row) in u.iter().zip(&mut powers) {
        let mut power = 1.0;
        for place in row.iter_mut().skip(1).take(degree) {
            power *= u;
            *place = power;
        }
    }
    powers
}

/// The monomials of the terms from `start`, as many as `out` has places.
fn monomials(polynomial: &Polynomial<'_>, variables: usize, start: usize, powers: &[[f64; POWERS]; MAX_VARIABLES], out: &mut [f64]) {
    let exponents = polynomial.exponents.get(start * variables..).unwrap_or(&[]);
    match variables {
        1 => products::<1>(exponents, powers, out),
        2 => products::<2>(exponents, powers, out),
        3 => products::<3>(exponents, powers, out),
        4 => products::<4>(exponents, powers, out),
        5 => products::<5>(exponents, powers, out),
        6 => products::<6>(exponents, powers, out),
        7 => products::<7>(exponents, powers, out),
        _ => products::<8>(exponents, powers, out),
    }
}

fn products<const V: usize>(exponents: &[u8], powers: &[[f64; POWERS]; MAX_VARIABLES], out: &mut [f64]) {
    for (exponents, out) in exponents.as_chunks::<V>().0.iter().zip(out) {
        let mut product = 1.0;
        for v in 0..V {
            product *= powers[v][usize::from(exponents[v]) % POWERS];
        }
        *out = product;
    }
}

/// Adds the squared scaled distances to the centres from `start` to `out`, which starts at zero.
fn squared_distances(basis: &Basis<'_>, u: &[f64], start: usize, out: &mut [f64]) {
    for (v, (u, scale)) in u.iter().zip(basis.scales.iter()).enumerate() {
        let coordinates = basis.centres.part(v * basis.count + start, out.len());
        for (square, coordinate) in out.iter_mut().zip(coordinates.iter()) {
            let d = (u - coordinate) * scale;
            *square += d * d;
        }
    }
}

/// Squared distances become kernel values.
fn kernel_values(kernel: Kernel, block: &mut [f64]) {
    match kernel {
        Kernel::ThinPlate => block.iter_mut().for_each(|s| *s = 0.5 * *s * ln_normal(normal(*s))),
        Kernel::Cubic => block.iter_mut().for_each(|s| *s *= sqrt(*s)),
        Kernel::Multiquadric => block.iter_mut().for_each(|s| *s = sqrt(1.0 + *s)),
        Kernel::Gaussian => block.iter_mut().for_each(|s| *s = exp_minus(*s)),
    }
}

/// Derivative of the kernel with respect to the squared distance; at a centre, where that of the
/// thin plate has no limit but its product with the distance has the limit zero, zero.
fn kernel_slope(kernel: Kernel, square: f64) -> f64 {
    match kernel {
        Kernel::ThinPlate if square < f64::MIN_POSITIVE => 0.0,
        Kernel::ThinPlate => 0.5 * (ln_normal(square) + 1.0),
        Kernel::Cubic => 1.5 * sqrt(square),
        Kernel::Multiquadric => 0.5 / sqrt(1.0 + square),
        Kernel::Gaussian => -exp_minus(square),
    }
}

/// At least the smallest normal number, so that 0 ln 0 comes out as zero; NaN stays.
#[inline(always)]
fn normal(square: f64) -> f64 {
    if square < f64::MIN_POSITIVE { f64::MIN_POSITIVE } else { square }
}

/// Dot product in eight partial sums, which add up in a fixed order.
fn dot(a: &[f64], b: Numbers<'_>) -> f64 {
    let mut sums = [0.0; 8];
    let ((a, a_rest), (b, b_rest)) = (a.as_chunks::<8>(), b.0.as_chunks::<8>());
    for (a, b) in a.iter().zip(b) {
        for i in 0..8 {
            sums[i] += a[i] * f64::from_le_bytes(b[i]);
        }
    }
    for (sum, (a, b)) in sums.iter_mut().zip(a_rest.iter().zip(b_rest)) {
        *sum += a * f64::from_le_bytes(*b);
    }
    ((sums[0] + sums[4]) + (sums[2] + sums[6])) + ((sums[1] + sums[5]) + (sums[3] + sums[7]))
}
