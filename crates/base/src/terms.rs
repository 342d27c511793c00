//! Terms common to the machine file and the surrogate file: kinds of limits, origins and scales of uncertain numbers,
//! and the limits on their lengths and numbers. The surrogate file defines them, because its reader depends on nothing.

pub use coldplate_runtime::format::{MAX_DEGREE, MAX_NAME, MAX_PARAMETERS};
pub use coldplate_runtime::{LimitKind, Origin, Scale};
