//! Why a run gave no result.

use std::fmt;

use serde::Serialize;

/// What went wrong with a run of another program.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Class {
    /// The command ended with another status than 0, or by a signal.
    Crashed,
    /// It took longer than it may.
    TimedOut,
    /// Its output says that it found no solution.
    DidNotConverge,
    /// It ended well, and a result is not where it should be or is no number.
    ResultMissing,
}

impl Class {
    const ALL: [Self; 4] = [Self::Crashed, Self::TimedOut, Self::DidNotConverge, Self::ResultMissing];

    /// In words, as reasons of failures begin.
    pub const fn words(self) -> &'static str {
        match self {
            Self::Crashed => "crashed",
            Self::TimedOut => "timed out",
            Self::DidNotConverge => "did not converge",
            Self::ResultMissing => "result missing",
        }
    }

    /// The class of a failure, by its reason; `None` where our own solver gave it.
    pub fn of(reason: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|class| reason.strip_prefix(class.words()).is_some_and(|rest| rest.starts_with(':')))
    }

    /// Whether another try may end otherwise: a program that finds no solution finds none the second time.
    pub(super) const fn is_worth_a_retry(self) -> bool {
        !matches!(self, Self::DidNotConverge)
    }
}

/// A run without result.
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
