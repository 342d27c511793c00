//! Tables in formulas: straight between points, constant beyond the first and the last.

use std::sync::Arc;

use crate::error::{Error, Result};

/// Points (x, y) of a function that runs straight between them; x rises.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Table(Arc<[(f64, f64)]>);

impl Table {
    /// From x and y in turn, as a formula lists them.
    ///
    /// # Errors
    /// There is no point, a y is missing, a number is not finite, or x does not rise.
    pub(super) fn new(numbers: &[f64]) -> Result<Self> {
        const HELP: &str = "write interpolate(x, x0, y0, x1, y1, ...) with x0 < x1 < ..., two numbers for each point";
        if numbers.is_empty() || numbers.len() % 2 == 1 {
            return Err(
                Error::input(format!("{} numbers after the first argument make no points of 'interpolate'", numbers.len())).help(HELP)
            );
        }
        if let Some(number) = numbers.iter().find(|number| !number.is_finite()) {
            return Err(Error::input(format!("a number of 'interpolate' is {number}")).help(HELP));
        }
        let points: Vec<(f64, f64)> = numbers.chunks(2).map(|pair| (pair[0], pair[1])).collect();
        if let Some(pair) = points.windows(2).find(|pair| pair[0].0 >= pair[1].0) {
            return Err(Error::input(format!("in 'interpolate', {} does not lie beyond {}", pair[1].0, pair[0].0)).help(HELP));
        }
        Ok(Self(points.into()))
    }

    /// The points, x rising.
    pub(super) fn points(&self) -> &[(f64, f64)] {
        &self.0
    }

    /// Value and slope; the slope at a point is that beyond it.
    pub(super) fn at(&self, x: f64) -> (f64, f64) {
        let (first, last) = (self.0[0], self.0[self.0.len() - 1]);
        match x {
            x if x.is_nan() => (f64::NAN, 0.0),
            x if x < first.0 => (first.1, 0.0),
            x if x >= last.0 => (last.1, 0.0),
            x => {
                let after = self.0.partition_point(|(own, _)| *own <= x);
                let ((x0, y0), (x1, y1)) = (self.0[after - 1], self.0[after]);
                let slope = (y1 - y0) / (x1 - x0);
                (y0 + slope * (x - x0), slope)
            }
        }
    }
}
