//! Values and gradients of the fitted functions.
//!
//! Terms and centres are worked off in blocks that fit the stack. Monomials and kernels are computed
//! once per block and shared by all points of a polynomial or basis, which then cost one
//! multiplication and addition each.

use crate::bytes::Numbers;
use crate::format::{MAX_DEGREE, MAX_SLOPE_TERMS, MAX_VARIABLES};
use crate::math::{exp_minus, exp_minus_all, ln_normal, sqrt};
use crate::model::{Basis, Indices, Kernel, Polynomial, Scaling, TRANSFORMS, Transform};
use crate::shape::{ShapeError, check};
use crate::surrogate::Surrogate;

/// Number of terms or centres worked on at a time (count). Chosen: a block fits a controller's stack.
pub(crate) const BLOCK: usize = 128;
/// Number of places (count) for the powers 0 to 12 of a scaled variable: 2⁴, as an exponent has four bits.
pub(crate) const POWERS: usize = 16;
const _: () = assert!(MAX_DEGREE < POWERS);

type Scaled = [f64; MAX_VARIABLES];

/// Monomials of terms that several polynomials have in common, at one condition.
pub(crate) struct Monomials {
    pub(crate) values: [f64; MAX_SLOPE_TERMS],
    pub(crate) count: usize,
}

impl Surrogate<'_> {
    /// The values of all points without the knowledge of the parameters.
    pub(crate) fn evaluate_fit(&self, x: &[f64], values: &mut [f64]) -> Result<(), ShapeError> {
        check("number of variables", self.variables.len(), x.len())?;
        check("number of points", self.points.len(), values.len())?;
        let scaled = self.scale(x);
        values.fill(0.0);
        let mut buffer = [0.0; BLOCK];
        for polynomial in self.polynomials() {
            let u = pick(polynomial.transforms, &scaled);
            let mut done = 0;
            while done < polynomial.terms {
                let block = &mut buffer[..BLOCK.min(polynomial.terms - done)];
                monomials(&polynomial, &u[..x.len()], done, block);
                add_columns(block, polynomial.coefficients, done, polynomial.points, values);
                done += block.len();
            }
        }
        for basis in self.bases() {
            let u = pick(basis.transforms, &scaled);
            let mut done = 0;
            while done < basis.count {
                let block = &mut buffer[..BLOCK.min(basis.count - done)];
                squared_distances(&basis, &u[..x.len()], done, block);
                kernel_values(basis.kernel, block);
                add_columns(block, basis.weights, done, basis.points, values);
                done += block.len();
            }
        }
        Ok(())
    }

    /// The value of one point without the knowledge of the parameters.
    pub(crate) fn evaluate_fit_of(&self, x: &[f64], point: usize) -> Result<f64, ShapeError> {
        self.check_point(x, point)?;
        let scaled = self.scale(x);
        let mut value = 0.0;
        let mut buffer = [0.0; BLOCK];
        if let Some((polynomial, column)) = self.polynomial_of(point) {
            let u = pick(polynomial.transforms, &scaled);
            let mut done = 0;
            while done < polynomial.terms {
                let block = &mut buffer[..BLOCK.min(polynomial.terms - done)];
                monomials(&polynomial, &u[..x.len()], done, block);
                value += column_sum(block, polynomial.coefficients, done, polynomial.points.0.len(), column);
                done += block.len();
            }
        }
        if let Some((basis, column)) = self.basis_of(point) {
            let u = pick(basis.transforms, &scaled);
            let mut done = 0;
            while done < basis.count {
                let block = &mut buffer[..BLOCK.min(basis.count - done)];
                squared_distances(&basis, &u[..x.len()], done, block);
                kernel_values(basis.kernel, block);
                value += column_sum(block, basis.weights, done, basis.points.0.len(), column);
                done += block.len();
            }
        }
        Ok(value)
    }

    /// The derivatives of one point's value with respect to each variable at condition `x`, in the point's unit per
    /// unit of the variable, in closed form.
    ///
    /// # Errors
    /// `x` does not have one value per variable, `gradient` does not have one place per variable, or the point does not
    /// exist.
    pub fn gradient(&self, x: &[f64], point: usize, gradient: &mut [f64]) -> Result<(), ShapeError> {
        self.check_point(x, point)?;
        check("places for the gradient", self.variables.len(), gradient.len())?;
        let scaled = self.scale(x);
        gradient.fill(0.0);
        if let Some((polynomial, column)) = self.polynomial_of(point) {
            let mut slopes = [0.0; MAX_VARIABLES];
            let u = pick(polynomial.transforms, &scaled);
            polynomial_slopes(&polynomial, |term| polynomial.coefficient(term, column), &u, x.len(), &mut slopes);
            self.chain(polynomial.transforms, x, &slopes, gradient);
        }
        if let Some(uncertainty) = self.learnt() {
            let (mut slopes, polynomial) = ([0.0; MAX_VARIABLES], uncertainty.slope_terms);
            let u = pick(polynomial.transforms, &scaled);
            polynomial_slopes(&polynomial, |term| uncertainty.shift(point, term), &u, x.len(), &mut slopes);
            self.chain(polynomial.transforms, x, &slopes, gradient);
        }
        if let Some((basis, column)) = self.basis_of(point) {
            let mut slopes = [0.0; MAX_VARIABLES];
            self.basis_slopes(&basis, column, &pick(basis.transforms, &scaled), x.len(), &mut slopes);
            self.chain(basis.transforms, x, &slopes, gradient);
        }
        Ok(())
    }

    fn basis_slopes(&self, basis: &Basis<'_>, column: usize, u: &Scaled, variables: usize, slopes: &mut Scaled) {
        for centre in 0..basis.count {
            let weight = basis.weight(centre, column);
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

    /// Converts slopes with respect to the scaled variables to slopes with respect to the variables, and adds them.
    fn chain(&self, transforms: &[u8], x: &[f64], slopes: &Scaled, gradient: &mut [f64]) {
        for (v, (gradient, (x, slope))) in gradient.iter_mut().zip(x.iter().zip(slopes)).enumerate() {
            let transform = transforms.get(v).copied().and_then(Transform::from_code).unwrap_or(Transform::Identity);
            let factor = self.scaling[transform as usize][v % MAX_VARIABLES].map_or(0.0, |s| s.factor);
            *gradient += slope * factor * transform.slope(*x);
        }
    }

    /// Monomials of common terms at condition `x`.
    pub(crate) fn monomials(&self, terms: &Polynomial<'_>, x: &[f64]) -> Monomials {
        let mut all = Monomials { values: [0.0; MAX_SLOPE_TERMS], count: terms.terms.min(MAX_SLOPE_TERMS) };
        let u = pick(terms.transforms, &self.scale(x));
        monomials(terms, &u[..x.len().min(MAX_VARIABLES)], 0, &mut all.values[..all.count]);
        all
    }

    /// The scaled variables under each transform that a model uses.
    #[inline(always)]
    fn scale(&self, x: &[f64]) -> [Scaled; 3] {
        let mut scaled = [[0.0; MAX_VARIABLES]; 3];
        for (transform, (scaled, scaling)) in TRANSFORMS.into_iter().zip(scaled.iter_mut().zip(&self.scaling)) {
            for (x, (u, scaling)) in x.iter().zip(scaled.iter_mut().zip(scaling)) {
                if let Some(Scaling { low, factor, offset }) = scaling {
                    *u = (transform.apply(*x) - low) * factor + offset;
                }
            }
        }
        scaled
    }

    pub(crate) fn check_point(&self, x: &[f64], point: usize) -> Result<(), ShapeError> {
        check("number of variables", self.variables.len(), x.len())?;
        if point < self.points.len() {
            Ok(())
        } else {
            Err(ShapeError { argument: "index of the point", expected: self.points.len(), found: point })
        }
    }

    fn polynomial_of(&self, point: usize) -> Option<(Polynomial<'_>, usize)> {
        self.polynomials().find_map(|p| p.points.iter().position(|i| i == point).map(|column| (p, column)))
    }

    fn basis_of(&self, point: usize) -> Option<(Basis<'_>, usize)> {
        self.bases().find_map(|b| b.points.iter().position(|i| i == point).map(|column| (b, column)))
    }
}

/// Adds the slopes of a polynomial with these coefficients with respect to the scaled variables.
fn polynomial_slopes(polynomial: &Polynomial<'_>, coefficient: impl Fn(usize) -> f64, u: &Scaled, variables: usize, slopes: &mut Scaled) {
    let mut powers = [[1.0; POWERS]; MAX_VARIABLES];
    for (u, row) in u.iter().zip(&mut powers) {
        for e in 1..=polynomial.degree.min(MAX_DEGREE) {
            row[e] = row[e - 1] * u;
        }
    }
    for term in 0..polynomial.terms {
        let coefficient = coefficient(term);
        let mut exponents = [0; MAX_VARIABLES];
        exponents.iter_mut().enumerate().for_each(|(v, e)| *e = usize::from(polynomial.exponent(term, v)));
        for (by, slope) in slopes.iter_mut().enumerate().take(variables).filter(|(by, _)| exponents[*by] > 0) {
            let mut product = coefficient * exponents[by] as f64;
            for (v, (exponent, powers)) in exponents.iter().zip(&powers).enumerate() {
                product *= powers[(exponent - usize::from(v == by)) % POWERS];
            }
            *slope += product;
        }
    }
}

#[inline(always)]
fn pick(transforms: &[u8], scaled: &[Scaled; 3]) -> Scaled {
    let mut u = [0.0; MAX_VARIABLES];
    for (v, (u, code)) in u.iter_mut().zip(transforms).enumerate() {
        *u = scaled[usize::from(*code).min(2)][v];
    }
    u
}

/// The monomials of the terms from `start`, one per place of `out`.
fn monomials(polynomial: &Polynomial<'_>, u: &[f64], start: usize, out: &mut [f64]) {
    let bytes = u.len().div_ceil(2);
    let exponents = polynomial.exponents.get(start * bytes..).unwrap_or(&[]);
    match (bytes, polynomial.degree < 8) {
        (1, true) => products::<1, 8>(exponents, u, polynomial.degree, out),
        (2, true) => products::<2, 8>(exponents, u, polynomial.degree, out),
        (1, false) => products::<1, POWERS>(exponents, u, polynomial.degree, out),
        (2, false) => products::<2, POWERS>(exponents, u, polynomial.degree, out),
        (3, _) => products::<3, POWERS>(exponents, u, polynomial.degree, out),
        _ => products::<4, POWERS>(exponents, u, polynomial.degree, out),
    }
}

/// One table of products of powers per pair of variables, with the byte of both exponents as index; a monomial is then
/// one product per pair. Eight powers are sufficient for most polynomials.
fn products<const PAIRS: usize, const SIZE: usize>(exponents: &[u8], u: &[f64], degree: usize, out: &mut [f64]) {
    let mut tables = [[[0.0; POWERS]; SIZE]; PAIRS];
    for (table, pair) in tables.iter_mut().zip(u.chunks(2)) {
        let (even, odd) = (pair.first().copied().unwrap_or(0.0), pair.get(1).copied().unwrap_or(0.0));
        let mut powers = [1.0; SIZE];
        for e in 1..SIZE {
            powers[e] = powers[e - 1] * even;
        }
        let mut odd_power = 1.0;
        for row in table.iter_mut().take(degree + 1) {
            for e in 0..SIZE {
                row[e] = powers[e] * odd_power;
            }
            odd_power *= odd;
        }
    }
    let tables = tables.each_ref().map(|table| table.as_flattened());
    for (exponents, out) in exponents.as_chunks::<PAIRS>().0.iter().zip(out) {
        let mut product = 1.0;
        for (table, byte) in tables.iter().zip(exponents) {
            product *= table[usize::from(*byte) % (SIZE * POWERS)];
        }
        *out = product;
    }
}

/// The squared scaled distances to the centres from `start`, one per place of `out`.
fn squared_distances(basis: &Basis<'_>, u: &[f64], start: usize, out: &mut [f64]) {
    let (eights, rest) = out.as_chunks_mut::<8>();
    let tail = start + 8 * eights.len();
    for (i, eight) in eights.iter_mut().enumerate() {
        let mut squares = [0.0; 8];
        for (v, (u, scale)) in u.iter().zip(basis.scales.iter()).enumerate() {
            let Some((coordinates, _)) = basis.centres.0.get(v * basis.count + start + 8 * i..).and_then(|c| c.split_first_chunk::<8>())
            else {
                return;
            };
            for j in 0..8 {
                let d = (u - f64::from_le_bytes(coordinates[j])) * scale;
                squares[j] += d * d;
            }
        }
        *eight = squares;
    }
    for (i, square) in rest.iter_mut().enumerate() {
        let distances = u.iter().zip(basis.scales.iter()).enumerate();
        *square = distances.fold(0.0, |sum, (v, (u, scale))| {
            let d = (u - basis.centres.at(v * basis.count + tail + i)) * scale;
            sum + d * d
        });
    }
}

/// Converts squared distances to kernel values. The kernel is selected once, outside the loops, so that they vectorise.
#[inline(always)]
pub(crate) fn kernel_values(kernel: Kernel, block: &mut [f64]) {
    match kernel {
        Kernel::ThinPlate => block.iter_mut().for_each(|s| *s = 0.5 * *s * ln_normal(normal(*s))),
        Kernel::Cubic => block.iter_mut().for_each(|s| *s *= sqrt(*s)),
        Kernel::Multiquadric => block.iter_mut().for_each(|s| *s = sqrt(1.0 + *s)),
        Kernel::Gaussian => exp_minus_all(block),
    }
}

/// Derivative of the kernel with respect to the squared distance. At a centre the derivative of the thin plate has no
/// limit, but its product with the distance has the limit zero: the result there is zero.
fn kernel_slope(kernel: Kernel, square: f64) -> f64 {
    match kernel {
        Kernel::ThinPlate if square < f64::MIN_POSITIVE => 0.0,
        Kernel::ThinPlate => 0.5 * (ln_normal(square) + 1.0),
        Kernel::Cubic => 1.5 * sqrt(square),
        Kernel::Multiquadric => 0.5 / sqrt(1.0 + square),
        Kernel::Gaussian => -exp_minus(square),
    }
}

/// The number, but at least the smallest normal one, so that 0 ln 0 gives zero; NaN stays.
#[inline(always)]
fn normal(square: f64) -> f64 {
    if square < f64::MIN_POSITIVE { f64::MIN_POSITIVE } else { square }
}

/// Adds to each point's value the sum of its column of `table` times `block`, from row `start` of the table. One row
/// serves all points: their sums run side by side.
fn add_columns(block: &[f64], table: Numbers<'_>, start: usize, points: Indices<'_>, values: &mut [f64]) {
    let columns = points.0.len();
    let mut points = points.0;
    let mut rest = table.0.get(start * columns..).unwrap_or(&[]);
    while !points.is_empty() {
        // Up to twelve sums fit the registers; more columns are summed eight at a time.
        let width = if points.len() <= 12 { points.len() } else { 8 };
        let (now, later) = points.split_at(width);
        match width {
            1 => add_some::<1>(block, rest, columns, now, values),
            2 => add_some::<2>(block, rest, columns, now, values),
            3 => add_some::<3>(block, rest, columns, now, values),
            4 => add_some::<4>(block, rest, columns, now, values),
            5 => add_some::<5>(block, rest, columns, now, values),
            6 => add_some::<6>(block, rest, columns, now, values),
            7 => add_some::<7>(block, rest, columns, now, values),
            8 => add_some::<8>(block, rest, columns, now, values),
            9 => add_some::<9>(block, rest, columns, now, values),
            10 => add_some::<10>(block, rest, columns, now, values),
            11 => add_some::<11>(block, rest, columns, now, values),
            _ => add_some::<12>(block, rest, columns, now, values),
        }
        points = later;
        rest = rest.get(width..).unwrap_or(&[]);
    }
}

fn add_some<const W: usize>(block: &[f64], table: &[[u8; 8]], columns: usize, points: &[[u8; 2]], values: &mut [f64]) {
    let mut sums = [0.0; W];
    column_sums(block, table, columns, &mut sums);
    for (point, sum) in Indices(points).iter().zip(&sums) {
        if let Some(value) = values.get_mut(point) {
            *value += sum;
        }
    }
}

/// Sums of the first `W` columns. Not inlined: with results stored in one piece, the sums stay in wide registers and
/// are not taken apart in every turn of the loop.
#[inline(never)]
fn column_sums<const W: usize>(block: &[f64], table: &[[u8; 8]], columns: usize, out: &mut [f64; W]) {
    if columns == W {
        *out = sum_rows(block, table.as_chunks::<W>().0.iter());
    } else {
        let rows = (0..).map_while(|row| table.get(row * columns..).and_then(<[[u8; 8]]>::first_chunk::<W>));
        *out = sum_rows(block, rows);
    }
}

#[inline(always)]
fn sum_rows<'a, const W: usize>(block: &[f64], rows: impl Iterator<Item = &'a [[u8; 8]; W]>) -> [f64; W] {
    let mut sums = [0.0; W];
    for (factor, row) in block.iter().zip(rows) {
        for i in 0..W {
            sums[i] += factor * f64::from_le_bytes(row[i]);
        }
    }
    sums
}

/// The sum of one column, in the order of [`add_columns`].
fn column_sum(block: &[f64], table: Numbers<'_>, start: usize, columns: usize, column: usize) -> f64 {
    let rest = table.0.get(start * columns + column..).unwrap_or(&[]);
    block.iter().zip(rest.iter().step_by(columns)).fold(0.0, |sum, (factor, entry)| sum + factor * f64::from_le_bytes(*entry))
}
