//! Checks that every part of a file has in common, and the reasons why a file is refused.

use core::fmt;

use crate::format::{MAX_NAME, OLDEST_VERSION, VERSION};
use crate::model::{Scaling, Transform};
use crate::surrogate::Surrogate;

/// Reason why a file was refused.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum OpenError {
    /// The file does not begin like a surrogate file.
    NotASurrogate,
    /// The file has a version of the layout that this reader does not know.
    Version(u16),
    /// The length of the file differs from the stated length, or from the sum of its counts.
    Length,
    /// The checksum does not match: the file was damaged.
    Checksum,
    /// The count named is zero or over its bound.
    Count(&'static str),
    /// The record named does not point at the place where its data must lie.
    Place(&'static str),
    /// The text named is empty, too long, not UTF-8, contains a control character, or occurs twice.
    Text(&'static str),
    /// The number named is not finite, or not of a legal sign or size.
    Number(&'static str),
    /// A variable's range ends below its start.
    Range,
    /// A transform is unknown or illegal on the range of its variable.
    Transform,
    /// The total degree of a term is over its bound, or differs from the stated degree.
    Degree,
    /// A kernel is unknown.
    Kernel,
    /// The index named is out of range, or occurs twice.
    Index(&'static str),
    /// A point is in no polynomial, or a limit mixes units.
    Inconsistent(&'static str),
    /// A byte that must be zero is not.
    Reserved,
    /// A further section that answers depend on is unknown to this reader, or the sections are out of order.
    Section([u8; 4]),
    /// This reader does not reproduce the value of this point in this self-test vector.
    SelfTest {
        /// Number of the vector, from 0.
        vector: usize,
        /// Index of the point.
        point: usize,
    },
}

impl fmt::Display for OpenError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NotASurrogate => write!(f, "this is not a surrogate file"),
            Self::Version(found) => write!(f, "layout version {found}, and this reader knows versions {OLDEST_VERSION} to {VERSION}"),
            Self::Length => write!(f, "the file is cut off or has something added"),
            Self::Checksum => write!(f, "the checksum does not match: the file is damaged"),
            Self::Count(what) => write!(f, "the number of {what} is zero or over its bound"),
            Self::Place(what) => write!(f, "the {what} are not where they must lie"),
            Self::Text(what) => write!(f, "the {what} is empty, too long, not plain text, or there twice"),
            Self::Number(what) => write!(f, "the {what} is not finite or not of a legal size"),
            Self::Range => write!(f, "the range of a variable ends below its start"),
            Self::Transform => write!(f, "a transform is unknown or illegal on the range of its variable"),
            Self::Degree => write!(f, "the degree of a term is over its bound or not the one stated"),
            Self::Kernel => write!(f, "an unknown kernel"),
            Self::Index(what) => write!(f, "the index of a {what} is out of range or there twice"),
            Self::Inconsistent(what) => write!(f, "{what}"),
            Self::Reserved => write!(f, "a byte that must be zero is not"),
            Self::Section(tag) => write!(f, "the section '{}' is out of place, or unknown to this reader", tag.escape_ascii()),
            Self::SelfTest { vector, point } => {
                write!(f, "self-test vector {vector} is not reproduced at point {point}")
            }
        }
    }
}

impl core::error::Error for OpenError {}

pub(crate) type Checked = Result<(), OpenError>;

pub(crate) fn ensure(condition: bool, error: OpenError) -> Checked {
    if condition { Ok(()) } else { Err(error) }
}

pub(crate) fn within(count: usize, least: usize, most: usize, what: &'static str) -> Checked {
    ensure((least..=most).contains(&count), OpenError::Count(what))
}

/// Takes `count` records of `N` bytes off the front.
pub(crate) fn records<'a, const N: usize>(rest: &mut &'a [u8], count: usize) -> Result<&'a [[u8; N]], OpenError> {
    let length = count.checked_mul(N).ok_or(OpenError::Length)?;
    let (taken, left) = rest.split_at_checked(length).ok_or(OpenError::Length)?;
    *rest = left;
    Ok(taken.as_chunks().0)
}

pub(crate) fn check_name(name: &str, may_be_empty: bool) -> Result<(), ()> {
    let fits = name.len() <= MAX_NAME && (may_be_empty || !name.is_empty());
    if fits && !name.chars().any(char::is_control) { Ok(()) } else { Err(()) }
}

impl Surrogate<'_> {
    /// Checks the transforms of a model and prepares their scaling.
    pub(crate) fn use_transforms(&mut self, codes: &[u8]) -> Checked {
        for (v, code) in codes.iter().enumerate() {
            if v >= self.variables.len() {
                ensure(*code == 0, OpenError::Reserved)?;
                continue;
            }
            let transform = Transform::from_code(*code).ok_or(OpenError::Transform)?;
            let (low, high) = (self.low(v), self.high(v));
            if low == high {
                // A variable that was held fixed enters as the constant 0.
                ensure(transform == Transform::Identity, OpenError::Transform)?;
                self.scaling[0][v] = Some(Scaling { low, factor: 0.0, offset: 0.0 });
                continue;
            }
            let (g_low, g_high) = (transform.apply(low), transform.apply(high));
            let factor = 2.0 / (g_high - g_low);
            let usable = transform.is_allowed(low, high) && g_low.is_finite() && g_high.is_finite() && factor.is_finite() && factor != 0.0;
            ensure(usable, OpenError::Transform)?;
            self.scaling[transform as usize][v] = Some(Scaling { low: g_low, factor, offset: -1.0 });
        }
        Ok(())
    }
}
