//! Readings that are wrong beside causes: judged by the catalogue, or found beside the causes that explain the rest.

pub(crate) mod beside_causes;
pub(crate) mod by_catalogue;
