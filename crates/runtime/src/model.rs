//! The functions of a file: polynomials and radial bases of transformed and scaled variables.

use crate::bytes::Numbers;
use crate::math::ln;

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

    /// g(x)
    #[inline(always)]
    pub(crate) fn apply(self, x: f64) -> f64 {
        match self {
            Self::Identity => x,
            Self::Reciprocal => 1.0 / x,
            Self::Log => ln(x),
        }
    }

    /// g'(x)
    pub(crate) fn slope(self, x: f64) -> f64 {
        match self {
            Self::Identity => 1.0,
            Self::Reciprocal => -1.0 / (x * x),
            Self::Log => 1.0 / x,
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

/// Transforms in the order of their codes.
pub(crate) const TRANSFORMS: [Transform; 3] = [Transform::Identity, Transform::Reciprocal, Transform::Log];

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
