//! Values of a surrogate at many conditions, in the widest registers of the present processor: for the command line, the
//! service, Python and C alike. The runtime computes them; which registers there are shows only when the program runs,
//! and needs the standard library.
#![warn(missing_docs)]

use coldplate_runtime::{Room, ShapeError, Surrogate};
use pulp::{Arch, Simd, WithSimd};

/// The values of all points at many conditions: those of [`Surrogate::evaluate_batch`], and so those of
/// [`Surrogate::evaluate`] to the last bit. `x` has the variables of one condition after the other, in their units,
/// `values` the points.
///
/// # Errors
/// `x` does not have a whole number of conditions, or `values` does not have one place per point for each condition.
pub fn evaluate(surrogate: &Surrogate<'_>, x: &[f64], values: &mut [f64], room: &mut Room) -> Result<(), ShapeError> {
    Arch::new().dispatch(Batch { surrogate, x, values, room })
}

struct Batch<'b, 'f> {
    surrogate: &'b Surrogate<'f>,
    x: &'b [f64],
    values: &'b mut [f64],
    room: &'b mut Room,
}

impl WithSimd for Batch<'_, '_> {
    type Output = Result<(), ShapeError>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> Self::Output {
        self.surrogate.evaluate_batch(self.x, self.values, self.room)
    }
}
