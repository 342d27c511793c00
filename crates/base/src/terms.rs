//! Terms common to several crates. Kinds of limits, origins and scales of uncertain numbers, and the limits on their
//! lengths and numbers stand in the machine file and in the surrogate file; the latter defines them, because its reader
//! depends on nothing.

pub use coldplate_runtime::format::{MAX_DEGREE, MAX_NAME, MAX_PARAMETERS};
pub use coldplate_runtime::{LimitKind, Origin, Scale};

/// Text in the group column of a sweep's table that marks conditions for checking the fit to moved held variables; the
/// other conditions take part in this fit.
pub const FOLLOW_CHECK: &str = "follow check";
