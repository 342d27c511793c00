//! How a search ended.

/// End of a search. Whether the data determine a number is another question: it is answered by the curvature at a point at rest.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum SearchEnd {
    /// The linear model of the readings promises no further fall of the misfit.
    #[default]
    AtRest,
    /// A further fall is promised, but no step that was tried led down or could be solved.
    NoStep,
    /// A further fall is promised after the most steps that are made.
    StepLimit,
}

impl SearchEnd {
    /// Name in records.
    pub fn key(self) -> &'static str {
        match self {
            Self::AtRest => "at_rest",
            Self::NoStep => "no_step",
            Self::StepLimit => "step_limit",
        }
    }

    /// The reason in words, if the search did not come to rest.
    pub fn reason(self) -> Option<&'static str> {
        match self {
            Self::AtRest => None,
            Self::NoStep => Some("no step led down"),
            Self::StepLimit => Some("the most steps were made"),
        }
    }
}
