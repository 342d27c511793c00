//! The quantity that a limit bounds, and its value from the values of the points and variables.

use core::borrow::Borrow;

/// The value that a limit bounds, by indices of points and of variables. `P` is a list of points: borrowed from a file
/// ([`crate::Indices`]), or owned (`Vec<usize>`).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LimitKind<P> {
    /// The value of a point.
    Maximum {
        /// The point.
        point: usize,
    },
    /// The value of a point minus the value of a variable.
    Rise {
        /// The point.
        point: usize,
        /// The variable.
        variable: usize,
    },
    /// The value of the first point minus the value of the second.
    Difference {
        /// The first point.
        first: usize,
        /// The second point.
        second: usize,
    },
    /// The largest value minus the smallest among several points.
    Spread(P),
}

impl<P> LimitKind<P>
where
    for<'p> &'p P: IntoIterator<Item: Borrow<usize>>,
{
    /// The bounded value, from the values of the points and of the variables, in the points' unit. A spread is NaN if
    /// one of its points has no finite value.
    #[inline(always)]
    pub fn value(&self, point: impl Fn(usize) -> f64, variable: impl Fn(usize) -> f64) -> f64 {
        match self {
            Self::Maximum { point: p } => point(*p),
            Self::Rise { point: p, variable: v } => point(*p) - variable(*v),
            Self::Difference { first, second } => point(*first) - point(*second),
            Self::Spread(points) => {
                let (mut low, mut high, mut sum) = (f64::INFINITY, f64::NEG_INFINITY, 0.0);
                for index in points {
                    let value = point(*index.borrow());
                    (low, high, sum) = (low.min(value), high.max(value), sum + value);
                }
                if f64::is_finite(sum) { high - low } else { f64::NAN }
            }
        }
    }

    /// The points of the limit, in order.
    pub fn points(&self) -> impl Iterator<Item = usize> {
        let (single, several) = match self {
            Self::Maximum { point } | Self::Rise { point, .. } => ([Some(*point), None], None),
            Self::Difference { first, second } => ([Some(*first), Some(*second)], None),
            Self::Spread(points) => ([None, None], Some(points)),
        };
        single.into_iter().flatten().chain(several.into_iter().flatten().map(|index| *index.borrow()))
    }

    /// The variable of a rise.
    pub fn variable(&self) -> Option<usize> {
        if let Self::Rise { variable, .. } = self { Some(*variable) } else { None }
    }

    /// The limit with other indices of points and variables; `None` if one of them has no new index.
    pub fn renumbered<Q: FromIterator<usize>>(
        &self,
        point: impl Fn(usize) -> Option<usize>,
        variable: impl Fn(usize) -> Option<usize>,
    ) -> Option<LimitKind<Q>> {
        Some(match self {
            Self::Maximum { point: p } => LimitKind::Maximum { point: point(*p)? },
            Self::Rise { point: p, variable: v } => LimitKind::Rise { point: point(*p)?, variable: variable(*v)? },
            Self::Difference { first, second } => LimitKind::Difference { first: point(*first)?, second: point(*second)? },
            Self::Spread(points) => LimitKind::Spread(points.into_iter().map(|index| point(*index.borrow())).collect::<Option<Q>>()?),
        })
    }
}
