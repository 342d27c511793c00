//! Failures of runs without a result.

use std::fmt;

use serde::Serialize;

/// Class of a failure of another program's run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Class {
    /// The command ended with another status than 0, or by a signal.
    Crashed,
    /// The run exceeded its time limit.
    TimedOut,
    /// The output states that no solution was found.
    DidNotConverge,
    /// The command ended well, but a result is not at its place or is no number.
    ResultMissing,
}

impl Class {
    const ALL: [Self; 4] = [Self::Crashed, Self::TimedOut, Self::DidNotConverge, Self::ResultMissing];

    /// The class in words, with which reasons of failures begin.
    pub const fn words(self) -> &'static str {
        match self {
            Self::Crashed => "crashed",
            Self::TimedOut => "timed out",
            Self::DidNotConverge => "did not converge",
            Self::ResultMissing => "result missing",
        }
    }

    /// Class of a failure, by its reason; `None` for a failure of our own solver.
    pub fn of(reason: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|class| reason.strip_prefix(class.words()).is_some_and(|rest| rest.starts_with(':')))
    }

    /// Whether another try may end otherwise: a program that finds no solution finds none the second time.
    pub(super) const fn is_worth_a_retry(self) -> bool {
        !matches!(self, Self::DidNotConverge)
    }
}

/// Failure of a run: class and reason.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Failure {
    pub(super) class: Class,
    pub(super) why: String,
}

impl Failure {
    pub(super) fn new(class: Class, why: impl Into<String>) -> Self {
        Self { class, why: why.into() }
    }
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.class.words(), self.why)
    }
}
