//! How an effect depends on the condition.

/// How an effect depends on the condition.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Law {
    /// Not at all.
    Constant,
    /// In proportion to the motor speed.
    Speed,
    /// With the square of the motor speed.
    SpeedSquared,
    /// In proportion to one over the coolant flow.
    InverseFlow,
    /// In proportion to the temperature above 20 degC.
    Temperature,
    /// By a variable of the machine (an index into its variables).
    Of(usize, Form),
    /// One that was found from the data (an index into those of its [`super::Scales`]).
    Found(usize),
}

/// How an effect depends on one variable.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Form {
    /// In proportion to it.
    Proportional,
    /// With its square.
    Squared,
    /// In proportion to one over it.
    Inverse,
    /// Only above a threshold, which lies between this one of its levels in the data and the next.
    Above(usize),
    /// With a power of it that is found from the data, in hundredths.
    Power(u16),
    /// Of the time: in proportion to what has passed since the first row.
    Passed,
    /// Of the time: only after an instant that is found from the data, in ten-thousandths of what passes from the first row to the last.
    After(u16),
    /// Of a count, such as the number of the test: only where it is this one.
    At(u16),
    /// Of a count: only from this one on.
    From(u16),
    /// The variable is the amplitude itself: a course that was found without a law.
    Course,
}

/// Exponents that are looked for, all of them alike before the data are seen.
pub(super) const EXPONENTS: std::ops::RangeInclusive<u16> = 25..=400;
/// Hundredths of an exponent of one.
pub(super) const HUNDREDTHS: f64 = 100.0;
/// Parts of the time of a log that its instants are counted in.
pub(super) const PARTS: u16 = 10_000;
/// Time over which a cause sets in, as a share of all.
pub(super) const ONSET: f64 = 5e-3;

impl Form {
    /// The number that is found from the data, as it is counted.
    pub fn number(self) -> Option<f64> {
        match self {
            Self::Power(n) | Self::After(n) => Some(f64::from(n)),
            _ => None,
        }
    }

    /// Factor at a value of a count, which runs straight between two rows of a log; `None` of other forms.
    pub(crate) fn at_count(self, value: f64) -> Option<f64> {
        match self {
            Self::At(n) => Some((1.0 - (value - f64::from(n)).abs()).max(0.0)),
            Self::From(n) => Some((value - f64::from(n) + 1.0).clamp(0.0, 1.0)),
            _ => None,
        }
    }
}

/// The number of a law that was found from the data.
#[derive(Debug, Clone, PartialEq)]
pub struct LawNumber {
    /// What it is: `exponent`, `time`, or a count such as `test`.
    pub name: &'static str,
    /// Best value.
    pub value: f64,
    /// Low end of its 90 % interval.
    pub low: f64,
    /// High end.
    pub high: f64,
    /// Unit; `1` for exponents.
    pub unit: &'static str,
    /// Share of all values it could have that the data leave open: what it costs to have chosen it.
    pub share: f64,
    /// Its standard deviation, as the law counts it.
    pub deviation: f64,
}

impl Law {
    /// In words; what a variable of the machine does is told by [`super::Scales::words`].
    pub fn words(self) -> &'static str {
        match self {
            Self::Constant => "constant",
            Self::Speed => "in proportion to the motor speed",
            Self::SpeedSquared => "with the square of the motor speed",
            Self::InverseFlow => "in proportion to one over the coolant flow",
            Self::Temperature => "in proportion to the temperature",
            Self::Of(..) => "with a variable of the machine",
            Self::Found(_) => "by a law of its own",
        }
    }

    /// Whether a formula of the condition has to be written for it.
    pub(crate) fn is_formula(self) -> bool {
        !matches!(self, Self::Constant | Self::Temperature)
    }

    /// Whether it has a number that is found from the data.
    pub fn is_free(self) -> bool {
        matches!(self, Self::Of(_, form) if form.number().is_some())
    }

    /// Whether it says when a cause acts: at some times, in some tests, or on the way down.
    pub(crate) fn says_when(self) -> bool {
        matches!(self, Self::Of(_, Form::Passed | Form::After(_) | Form::At(_) | Form::From(_) | Form::Course))
    }

    /// Factor of a law of the time, at a share of all the time of the data; one for other laws.
    pub(crate) fn at_share_of_time(self, share: f64) -> f64 {
        match self {
            Self::Of(_, Form::Passed) => share,
            Self::Of(_, Form::After(n)) => (0.5 + (share - f64::from(n) / f64::from(PARTS)) / ONSET).clamp(0.0, 1.0),
            _ => 1.0,
        }
    }
}

/// A number as a person would write it.
pub(crate) fn nine_digits(v: f64) -> f64 {
    format!("{v:.8e}").parse().unwrap_or(v)
}
