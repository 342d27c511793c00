//! Parts of a table that are grossly wrong, with their price.

/// A part of the table that can be wrong at once.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Part {
    /// One reading, by its place among all.
    Reading(usize),
    /// All readings of a row that has some, by its number.
    Row(usize),
    /// All readings of a column of the data.
    Sensor(usize),
    /// The value that a row states of a variable; the readings are right.
    Condition { row: usize, variable: usize },
}

/// A part that is set aside.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Wrong {
    pub part: Part,
    /// Logarithm of its prior odds, and of the density of its readings where they are one value over that anywhere in the range.
    pub log_odds: f64,
    /// The one value of a sensor that is stuck, K.
    pub stuck_at: Option<f64>,
}

impl Wrong {
    /// A part that is wrong with this probability, whatever its readings are.
    pub fn with_rate(part: Part, rate: f64) -> Self {
        Self { part, log_odds: (rate / (1.0 - rate)).ln(), stuck_at: None }
    }

    /// Whether a stated condition is wrong, and the readings are right.
    pub fn is_condition(&self) -> bool {
        matches!(self.part, Part::Condition { .. })
    }
}

/// Logarithm of the prior odds of some parts together.
pub fn log_odds(wrong: &[Wrong]) -> f64 {
    wrong.iter().map(|wrong| wrong.log_odds).sum()
}
