//! An opened file and views of its content.

use crate::bytes::{Numbers, part, u16_at, u32_at};
use crate::format::{MAX_VARIABLES, MEDIUM_RECORD, POLYNOMIAL_RECORD, SMALL_RECORD};
use crate::in_time::InTime;
use crate::limit::LimitKind;
use crate::uncertain::Uncertainty;

/// An opened surrogate file. It borrows the bytes, and holds nothing but slices of them and the
/// scaling of the variables.
#[derive(Debug, Clone)]
pub struct Surrogate<'a> {
    pub(crate) variables: &'a [[u8; SMALL_RECORD]],
    pub(crate) points: &'a [[u8; SMALL_RECORD]],
    pub(crate) limits: &'a [[u8; MEDIUM_RECORD]],
    pub(crate) polynomials: &'a [[u8; POLYNOMIAL_RECORD]],
    pub(crate) sets: &'a [[u8; MEDIUM_RECORD]],
    pub(crate) bases: &'a [[u8; MEDIUM_RECORD]],
    pub(crate) provenance: &'a [[u8; SMALL_RECORD]],
    pub(crate) numbers: Numbers<'a>,
    pub(crate) indices: &'a [[u8; 2]],
    pub(crate) exponents: &'a [u8],
    pub(crate) text: &'a str,
    pub(crate) version: usize,
    pub(crate) self_tests: usize,
    pub(crate) held: &'a [[u8; MEDIUM_RECORD]],
    /// Names and units of the held variables.
    pub(crate) held_text: &'a str,
    pub(crate) uncertainty: Option<Uncertainty<'a>>,
    pub(crate) followed: &'a [u8],
    pub(crate) in_time: Option<InTime<'a>>,
    /// Scaling per transform and variable; `None` if no model uses it.
    pub(crate) scaling: [[Option<Scaling>; MAX_VARIABLES]; 3],
}

/// u = (g(x) - low) * factor + offset, which maps the fitted range onto [-1, 1], and a fixed variable to 0.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scaling {
    /// g at the low end of the range.
    pub low: f64,
    /// Two over the width of the range of g; zero for a fixed variable.
    pub factor: f64,
    /// Minus one; zero for a fixed variable.
    pub offset: f64,
}

/// A condition inside the fitted range, and the values that every build of every reader must find there.
#[derive(Debug, Clone, Copy)]
pub struct SelfTest<'a> {
    /// One value per variable.
    pub condition: Numbers<'a>,
    /// One value per point.
    pub values: Numbers<'a>,
    /// The standard deviation of each value, if the file states the uncertainty of its answers; otherwise empty.
    pub deviations: Numbers<'a>,
}

/// A condition variable.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Variable<'a> {
    /// Name, for example `coolant_flow`.
    pub name: &'a str,
    /// Unit of the variable's values.
    pub unit: &'a str,
    /// Lower end of the fitted range.
    pub low: f64,
    /// Upper end of the fitted range; equal to `low` for a variable that was held fixed.
    pub high: f64,
}

/// A variable that did not vary while the surrogate was made: every answer is for this value alone.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Held<'a> {
    /// Name, for example `motor_speed`.
    pub name: &'a str,
    /// Unit of the value.
    pub unit: &'a str,
    /// The value.
    pub value: f64,
}

/// A measurement point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Point<'a> {
    /// Name.
    pub name: &'a str,
    /// Unit of its value.
    pub unit: &'a str,
    /// Half width of the band that covers 95 % of new conditions inside the range, in that unit.
    pub half_width: f64,
}

/// A limit on the points' values.
#[derive(Debug, Clone, Copy)]
pub struct Limit<'a> {
    /// Name.
    pub name: &'a str,
    /// The bounded value.
    pub kind: LimitKind<Indices<'a>>,
    /// Largest value allowed, in the points' unit.
    pub maximum: f64,
}

/// A list of indices in the file.
#[derive(Debug, Clone, Copy)]
pub struct Indices<'a>(pub(crate) &'a [[u8; 2]]);

impl<'a> Indices<'a> {
    /// The indices in order.
    pub fn iter(self) -> impl ExactSizeIterator<Item = usize> + Clone + 'a {
        self.0.iter().map(|b| usize::from(u16::from_le_bytes(*b)))
    }

    pub(crate) fn at(self, position: usize) -> usize {
        self.0.get(position).map_or(0, |b| usize::from(u16::from_le_bytes(*b)))
    }
}

impl<'a> IntoIterator for &Indices<'a> {
    type Item = usize;
    type IntoIter = core::iter::Map<core::slice::Iter<'a, [u8; 2]>, fn(&[u8; 2]) -> usize>;

    fn into_iter(self) -> Self::IntoIter {
        self.0.iter().map(|b| usize::from(u16::from_le_bytes(*b)))
    }
}

/// Transform of a variable, before it is scaled to [-1, 1] over its range.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Transform {
    /// g(x) = x
    Identity,
    /// g(x) = 1/x, for ranges without zero
    Reciprocal,
    /// g(x) = ln x, for positive ranges
    Log,
}

impl Transform {
    /// Whether g is finite and monotonic on [low, high].
    #[must_use]
    pub fn is_allowed(self, low: f64, high: f64) -> bool {
        match self {
            Self::Identity => true,
            Self::Reciprocal => low > 0.0 || high < 0.0,
            Self::Log => low > 0.0,
        }
    }

    pub(crate) fn from_code(code: u8) -> Option<Self> {
        match code {
            0 => Some(Self::Identity),
            1 => Some(Self::Reciprocal),
            2 => Some(Self::Log),
            _ => None,
        }
    }
}

/// Radial kernels of r, the length of (scaled variables minus centre) times the inverse length scales.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kernel {
    /// r² ln r
    ThinPlate,
    /// r³
    Cubic,
    /// sqrt(1 + r²)
    Multiquadric,
    /// exp(-r²)
    Gaussian,
}

impl Kernel {
    pub(crate) fn from_code(code: u8) -> Option<Self> {
        match code {
            0 => Some(Self::ThinPlate),
            1 => Some(Self::Cubic),
            2 => Some(Self::Multiquadric),
            3 => Some(Self::Gaussian),
            _ => None,
        }
    }
}

/// Polynomials of one or more points over common terms. For a point with a radial part it is the polynomial tail.
#[derive(Debug, Clone, Copy)]
pub struct Polynomial<'a> {
    pub(crate) transforms: &'a [u8],
    /// The points.
    pub points: Indices<'a>,
    /// Term by term, two exponents per byte: the exponent of an even variable in the lower four bits.
    pub(crate) exponents: &'a [u8],
    /// Term by term, one coefficient per point.
    pub(crate) coefficients: Numbers<'a>,
    /// Number of terms.
    pub terms: usize,
    /// Largest total degree of a term.
    pub(crate) degree: usize,
}

impl<'a> Polynomial<'a> {
    /// A polynomial without points, for its terms alone.
    pub(crate) fn of_terms(transforms: &'a [u8], exponents: &'a [u8], terms: usize, degree: usize) -> Self {
        Self { transforms, points: Indices(&[]), exponents, coefficients: Numbers(&[]), terms, degree }
    }

    /// Exponent of a variable in a term; zero if the term or variable does not exist.
    #[must_use]
    pub fn exponent(&self, term: usize, variable: usize) -> u8 {
        if term >= self.terms {
            return 0;
        }
        let bytes = self.exponents.len() / self.terms;
        let pair = if variable / 2 < bytes { self.exponents.get(term * bytes + variable / 2) } else { None };
        pair.map_or(0, |pair| pair >> (4 * (variable % 2)) & 15)
    }

    /// Coefficient of a term for the point at place `column` of `points`; zero if there is none.
    #[must_use]
    pub fn coefficient(&self, term: usize, column: usize) -> f64 {
        entry(self.coefficients, term, self.points, column)
    }

    /// Transform of variable `index`.
    #[must_use]
    pub fn transform(&self, index: usize) -> Transform {
        transform(self.transforms, index)
    }
}

/// A radial basis and the weights of the points that use it.
#[derive(Debug, Clone, Copy)]
pub struct Basis<'a> {
    pub(crate) transforms: &'a [u8],
    /// The kernel.
    pub kernel: Kernel,
    /// Inverse length scale per variable, multiplying the scaled variable.
    pub scales: Numbers<'a>,
    /// Coordinates in scaled variables: all centres for the first variable, then for the second.
    pub(crate) centres: Numbers<'a>,
    /// Number of centres.
    pub count: usize,
    /// The points.
    pub points: Indices<'a>,
    /// Centre by centre, one weight per point.
    pub(crate) weights: Numbers<'a>,
}

impl Basis<'_> {
    /// Coordinate of a centre along a scaled variable; zero if there is none.
    #[must_use]
    pub fn coordinate(&self, centre: usize, variable: usize) -> f64 {
        if centre < self.count { self.centres.at(variable * self.count + centre) } else { 0.0 }
    }

    /// Weight of a centre for the point at place `column` of `points`; zero if there is none.
    #[must_use]
    pub fn weight(&self, centre: usize, column: usize) -> f64 {
        entry(self.weights, centre, self.points, column)
    }

    /// Transform of variable `index`.
    #[must_use]
    pub fn transform(&self, index: usize) -> Transform {
        transform(self.transforms, index)
    }
}

fn entry(table: Numbers<'_>, row: usize, points: Indices<'_>, column: usize) -> f64 {
    let columns = points.0.len();
    if column < columns { table.at(row.saturating_mul(columns).saturating_add(column)) } else { 0.0 }
}

fn transform(codes: &[u8], index: usize) -> Transform {
    codes.get(index).copied().and_then(Transform::from_code).unwrap_or(Transform::Identity)
}

impl<'a> Surrogate<'a> {
    /// Number of condition variables.
    #[must_use]
    pub fn variable_count(&self) -> usize {
        self.variables.len()
    }

    /// Number of measurement points.
    #[must_use]
    pub fn point_count(&self) -> usize {
        self.points.len()
    }

    /// Number of limits.
    #[must_use]
    pub fn limit_count(&self) -> usize {
        self.limits.len()
    }

    /// Variable `index`, in the order of a query.
    #[must_use]
    pub fn variable(&self, index: usize) -> Option<Variable<'a>> {
        let (name, unit) = self.two_texts(self.variables.get(index)?);
        Some(Variable { name, unit, low: self.low(index), high: self.high(index) })
    }

    /// Point `index`.
    #[must_use]
    pub fn point(&self, index: usize) -> Option<Point<'a>> {
        let (name, unit) = self.two_texts(self.points.get(index)?);
        Some(Point { name, unit, half_width: self.half_width(index) })
    }

    /// Limit `index`.
    #[must_use]
    pub fn limit(&self, index: usize) -> Option<Limit<'a>> {
        let record = self.limits.get(index)?;
        let name = self.text_at(u32_at(record, 0), u16_at(record, 4));
        Some(Limit { name, kind: self.limit_kind(record), maximum: self.maxima().at(index) })
    }

    #[inline(always)]
    pub(crate) fn limit_kind(&self, record: &[u8; MEDIUM_RECORD]) -> LimitKind<Indices<'a>> {
        let start = u32_at(record, 8);
        let at = |k: usize| Indices(self.indices).at(start.saturating_add(k));
        match record[6] {
            0 => LimitKind::Maximum { point: at(0) },
            1 => LimitKind::Rise { point: at(0), variable: at(1) },
            2 => LimitKind::Difference { first: at(0), second: at(1) },
            _ => LimitKind::Spread(Indices(part(self.indices, start, u16_at(record, 12)))),
        }
    }

    /// The largest values allowed, one per limit.
    pub(crate) fn maxima(&self) -> Numbers<'a> {
        self.numbers.part(2 * self.variables.len() + self.points.len(), self.limits.len())
    }

    /// The half widths of the bands, one per point.
    pub(crate) fn half_widths(&self) -> Numbers<'a> {
        self.numbers.part(2 * self.variables.len(), self.points.len())
    }

    /// The variables, in the order of a query.
    pub fn variables(&self) -> impl Iterator<Item = Variable<'a>> + '_ {
        (0..self.variables.len()).filter_map(|i| self.variable(i))
    }

    /// Dependence of the answers on held variables, as the bytes of the file; empty if the file has none. The main
    /// crate uses them to make the file for another value of a held variable.
    #[must_use]
    pub fn followed(&self) -> &'a [u8] {
        self.followed
    }

    /// The variables that were held while the surrogate was made. They are no part of a condition; a question about
    /// another value of one of them lies outside the fitted range.
    ///
    /// Files of version 1 have no section for them; their provenance is used instead, in which the writer noted them.
    pub fn held(&self) -> impl Iterator<Item = Held<'a>> + '_ {
        let noted = self.provenance().filter(|_| self.version == 1).filter_map(|(key, text)| {
            let (number, unit) = text.split_once(' ').unwrap_or((text, ""));
            let value = number.parse().ok().filter(|value: &f64| value.is_finite())?;
            Some(Held { name: key.strip_prefix("held ")?, unit, value })
        });
        self.held.iter().map(|record| self.held_variable(record)).chain(noted)
    }

    pub(crate) fn held_variable(&self, record: &[u8; MEDIUM_RECORD]) -> Held<'a> {
        let (start, name, unit) = (u32_at(record, 8), u16_at(record, 12), u16_at(record, 14));
        let text = |from: usize, length: usize| from.checked_add(length).and_then(|end| self.held_text.get(from..end)).unwrap_or("");
        let value = record.first_chunk().map_or(0.0, |bytes| f64::from_le_bytes(*bytes));
        Held { name: text(start, name), unit: text(start.saturating_add(name), unit), value }
    }

    /// The measurement points, in the order of the values of a query.
    pub fn points(&self) -> impl Iterator<Item = Point<'a>> + '_ {
        (0..self.points.len()).filter_map(|i| self.point(i))
    }

    /// The limits.
    pub fn limits(&self) -> impl Iterator<Item = Limit<'a>> + '_ {
        (0..self.limits.len()).filter_map(|i| self.limit(i))
    }

    /// Provenance: key and value.
    pub fn provenance(&self) -> impl Iterator<Item = (&'a str, &'a str)> + '_ {
        self.provenance.iter().map(|record| self.two_texts(record))
    }

    /// The polynomials. Every point is in exactly one of them.
    pub fn polynomials(&self) -> impl Iterator<Item = Polynomial<'a>> + '_ {
        self.polynomials.iter().map(|record| self.polynomial(record))
    }

    /// The radial bases. A point is in one of them at most.
    pub fn bases(&self) -> impl Iterator<Item = Basis<'a>> + '_ {
        self.bases.iter().map(|record| self.basis(record))
    }

    /// Scaling of variable `index` under a transform; `None` if no model uses it.
    #[must_use]
    pub fn scaling(&self, transform: Transform, index: usize) -> Option<Scaling> {
        self.scaling[transform as usize].get(index).copied().flatten()
    }

    /// The self-test vectors, which opening the file has reproduced.
    pub fn self_tests(&self) -> impl Iterator<Item = SelfTest<'a>> + '_ {
        let (variables, points) = (self.variables.len(), self.points.len());
        let start = self.numbers.len().saturating_sub(self.self_tests * (variables + points));
        (0..self.self_tests).map(move |vector| {
            let at = start + vector * (variables + points);
            SelfTest {
                condition: self.numbers.part(at, variables),
                values: self.numbers.part(at + variables, points),
                deviations: self.uncertainty.map_or(Numbers(&[]), |own| own.tests.part(vector * points, points)),
            }
        })
    }

    pub(crate) fn polynomial(&self, record: &'a [u8; POLYNOMIAL_RECORD]) -> Polynomial<'a> {
        let (terms, rows) = (u16_at(record, 8), u16_at(record, 10));
        Polynomial {
            transforms: part(record, 0, MAX_VARIABLES),
            points: Indices(part(self.indices, u32_at(record, 20), rows)),
            exponents: part(self.exponents, u32_at(record, 16), terms * self.variables.len().div_ceil(2)),
            coefficients: self.numbers.part(u32_at(record, 24), rows * terms),
            terms,
            degree: u16_at(record, 12),
        }
    }

    pub(crate) fn basis(&self, record: &'a [u8; MEDIUM_RECORD]) -> Basis<'a> {
        let (variables, rows, start) = (self.variables.len(), u16_at(record, 4), u32_at(record, 12));
        let (transforms, count, first) = match self.sets.get(u16_at(record, 2)) {
            Some(set) => (part(set, 0, MAX_VARIABLES), u16_at(set, 8), u32_at(set, 12)),
            None => (&[][..], 0, 0),
        };
        Basis {
            transforms,
            kernel: Kernel::from_code(record[0]).unwrap_or(Kernel::ThinPlate),
            scales: self.numbers.part(start, variables),
            centres: self.numbers.part(first, variables * count),
            count,
            points: Indices(part(self.indices, u32_at(record, 8), rows)),
            weights: self.numbers.part(start.saturating_add(variables), rows * count),
        }
    }

    pub(crate) fn low(&self, variable: usize) -> f64 {
        self.numbers.at(2 * variable)
    }

    pub(crate) fn high(&self, variable: usize) -> f64 {
        self.numbers.at(2 * variable + 1)
    }

    pub(crate) fn half_width(&self, point: usize) -> f64 {
        self.numbers.at(2 * self.variables.len() + point)
    }

    /// Two texts that follow each other.
    pub(crate) fn two_texts(&self, record: &[u8; SMALL_RECORD]) -> (&'a str, &'a str) {
        let (start, first, second) = (u32_at(record, 0), u16_at(record, 4), u16_at(record, 6));
        (self.text_at(start, first), self.text_at(start + first, second))
    }

    pub(crate) fn text_at(&self, start: usize, length: usize) -> &'a str {
        start.checked_add(length).and_then(|end| self.text.get(start..end)).unwrap_or("")
    }
}
