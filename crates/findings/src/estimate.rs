//! A number with its interval, as outside programs read it.

use serde::Serialize;

/// A number with its 90 % interval.
#[derive(Debug, Clone, Serialize)]
#[allow(missing_docs)]
pub struct EstimateRecord {
    pub value: f64,
    pub low: f64,
    pub high: f64,
    pub unit: String,
}
