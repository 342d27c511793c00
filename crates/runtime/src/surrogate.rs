//! An opened file and views of its content.

use crate::bytes::{Numbers, part, u16_at, u32_at};
use crate::format::{CORNER_RECORD, MAX_VARIABLES, MEDIUM_RECORD, POLYNOMIAL_RECORD, SMALL_RECORD};
use crate::in_time::InTime;
use crate::limit::LimitKind;
use crate::model::{Basis, Indices, Kernel, Polynomial, Scaling, Transform};
use crate::normal::NINETY_FIVE;
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
    pub(crate) corners: &'a [[u8; CORNER_RECORD]],
    pub(crate) readings: &'a [[u8; 8]],
    pub(crate) followed: &'a [u8],
    /// Part of each point's half width that is the error of the mesh; empty if it is not known.
    pub(crate) mesh: Numbers<'a>,
    pub(crate) in_time: Option<InTime<'a>>,
    /// Scaling per transform and variable; `None` if no model uses it.
    pub(crate) scaling: [[Option<Scaling>; MAX_VARIABLES]; 3],
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

/// A corner of the fitted ranges of two variables that no row of the fit lies in. With each value scaled to u from -1 to 1
/// over its range, and -u in place of u towards a low end, the corner begins where the sum of both is above the reach.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EmptyCorner {
    /// Indices of the variables.
    pub variables: [usize; 2],
    /// Whether the corner lies at the low end of each.
    pub is_low: [bool; 2],
    /// Largest sum that a row reaches, with a margin; dimensionless.
    pub reach: f64,
}

impl EmptyCorner {
    /// Whether a condition inside the ranges lies in the corner.
    fn holds(&self, surrogate: &Surrogate<'_>, x: &[f64]) -> bool {
        let mut sum = 0.0;
        for (variable, is_low) in self.variables.iter().zip(self.is_low) {
            let (low, high) = (surrogate.low(*variable), surrogate.high(*variable));
            // A variable without a range has no corners; its quotient is no number, and no sum of it is above the reach.
            let u = x.get(*variable).map_or(f64::NAN, |x| (2.0 * x - low - high) / (high - low));
            sum += if is_low { -u } else { u };
        }
        sum > self.reach
    }
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

    /// Half width of the part of point `index`'s band that is the error of the mesh, in its unit; `None` if it is not known.
    #[must_use]
    pub fn mesh_half_width(&self, index: usize) -> Option<f64> {
        self.mesh.get(index)
    }

    /// Half width of the part of point `index`'s band that is the fit alone, in its unit.
    #[must_use]
    pub fn fit_half_width(&self, index: usize) -> f64 {
        NINETY_FIVE * self.solved_band(core::iter::once(index)).fit
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

    /// True if `x` has one value per variable, each lies within its fitted range, ends included, and no two of them lie in a
    /// corner that no row of the fit lies in.
    #[must_use]
    pub fn in_domain(&self, x: &[f64]) -> bool {
        self.in_ranges(x) && !self.empty_corners().any(|corner| corner.holds(self, x))
    }

    /// Corners of the fitted ranges of two variables that no row of the fit lies in.
    pub fn empty_corners(&self) -> impl Iterator<Item = EmptyCorner> + '_ {
        self.corners.iter().map(|[number @ .., first, second, signs, _, _, _, _, _]| EmptyCorner {
            variables: [usize::from(*first), usize::from(*second)],
            is_low: [signs & 1 != 0, signs & 2 != 0],
            reach: f64::from_le_bytes(*number),
        })
    }

    /// Marks of the readings that the states were learnt from, eight bytes each.
    #[must_use]
    pub fn readings(&self) -> &'a [[u8; 8]] {
        self.readings
    }

    /// True if `x` has one value per variable and each lies within its fitted range, ends included.
    pub(crate) fn in_ranges(&self, x: &[f64]) -> bool {
        let ranges = self.numbers.part(0, 2 * self.variables.len()).0.as_chunks::<2>().0;
        let inside = |([low, high], x): (&[[u8; 8]; 2], &f64)| f64::from_le_bytes(*low) <= *x && *x <= f64::from_le_bytes(*high);
        x.len() == ranges.len() && ranges.iter().zip(x).all(inside)
    }

    /// Whether a point is a displacement: its unit is the micrometre, the unit of all displacements in this program.
    pub fn is_displacement(&self, point: usize) -> bool {
        self.point(point).is_some_and(|own| own.unit == "um")
    }

    /// Uncertainty of the answers of this file, if the file states it.
    #[must_use]
    pub fn uncertainty(&self) -> Option<Uncertainty<'_>> {
        self.uncertainty
    }

    /// The section on the machine over time, if the file has one.
    #[must_use]
    pub fn in_time(&self) -> Option<&InTime<'a>> {
        self.in_time.as_ref()
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
