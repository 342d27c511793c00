//! Content of every target: the numbers of a surrogate, laid out in the order of the arithmetic.

use coldplate_runtime::{Kernel, LimitKind, Surrogate, Transform};

/// A surrogate, taken apart.
pub(crate) struct Content {
    pub(crate) variables: Vec<Variable>,
    pub(crate) held: Vec<Held>,
    pub(crate) points: Vec<Point>,
    pub(crate) limits: Vec<Limit>,
    /// Every scaling that a model uses; models refer to scalings by place.
    pub(crate) scalings: Vec<Scaling>,
    pub(crate) polynomials: Vec<Polynomial>,
    pub(crate) bases: Vec<Basis>,
    pub(crate) uncertainty: Option<Uncertainty>,
    pub(crate) in_time: Option<InTime>,
    pub(crate) self_tests: Vec<SelfTest>,
}

pub(crate) struct Variable {
    pub(crate) name: String,
    pub(crate) unit: String,
    pub(crate) low: f64,
    pub(crate) high: f64,
}

pub(crate) struct Held {
    pub(crate) name: String,
    pub(crate) unit: String,
    pub(crate) value: f64,
}

pub(crate) struct Point {
    pub(crate) name: String,
    pub(crate) unit: String,
    pub(crate) half_width: f64,
}

impl Point {
    /// Whether the point is a displacement, as in the runtime.
    pub(crate) fn is_displacement(&self) -> bool {
        self.unit == "um"
    }
}

pub(crate) struct Limit {
    pub(crate) name: String,
    pub(crate) kind: LimitKind<Vec<usize>>,
    pub(crate) maximum: f64,
}

/// u = (g(x) - low) * factor + offset
pub(crate) struct Scaling {
    pub(crate) variable: usize,
    pub(crate) transform: Transform,
    pub(crate) low: f64,
    pub(crate) factor: f64,
    pub(crate) offset: f64,
}

pub(crate) struct Polynomial {
    /// Index of the scaling of each variable.
    pub(crate) scalings: Vec<usize>,
    pub(crate) points: Vec<usize>,
    /// Exponents, term by term, one per variable.
    pub(crate) exponents: Vec<u8>,
    /// Coefficients, term by term, one per point.
    pub(crate) coefficients: Vec<f64>,
    pub(crate) terms: usize,
}

pub(crate) struct Basis {
    pub(crate) scalings: Vec<usize>,
    pub(crate) kernel: Kernel,
    /// Inverse length scale per variable.
    pub(crate) scales: Vec<f64>,
    /// Coordinates of the centres, centre by centre, one per variable.
    pub(crate) centres: Vec<f64>,
    pub(crate) count: usize,
    pub(crate) points: Vec<usize>,
    /// Weights, centre by centre, one per point.
    pub(crate) weights: Vec<f64>,
}

pub(crate) struct Uncertainty {
    pub(crate) parameters: usize,
    pub(crate) scalings: Vec<usize>,
    pub(crate) exponents: Vec<u8>,
    pub(crate) terms: usize,
    /// Slopes: point by point, term by term, one coefficient per parameter.
    pub(crate) slopes: Vec<f64>,
    /// Standard deviation of the model error per point: alone, and in common with the other points.
    pub(crate) own: Vec<f64>,
    pub(crate) common: Vec<f64>,
    pub(crate) growth: f64,
    /// Mean of the measured conditions and half of the fitted range, per variable; a half of zero switches the distance
    /// off.
    pub(crate) centre: Vec<f64>,
    pub(crate) halves: Vec<f64>,
    /// Mean of the states and packed lower triangle of their covariance, if they are known.
    pub(crate) known: Option<Known>,
}

/// The machine over time, with the numbers of the file.
pub(crate) struct InTime {
    pub(crate) states: usize,
    /// Terms of the steady states; those of rates and outputs follow.
    pub(crate) steady: Terms,
    pub(crate) moving: Terms,
    pub(crate) errors: Vec<f64>,
    pub(crate) reach: Vec<f64>,
    pub(crate) uniform: Vec<f64>,
    pub(crate) spread: Vec<f64>,
    pub(crate) steady_coefficients: Vec<f64>,
    pub(crate) rates: Vec<f64>,
    pub(crate) outputs: Vec<f64>,
    pub(crate) tests: Vec<TimeTest>,
}

/// A duration at one condition, starting from the steady state of another, and the values at its end.
pub(crate) struct TimeTest {
    pub(crate) start: Vec<f64>,
    pub(crate) condition: Vec<f64>,
    pub(crate) duration: f64,
    pub(crate) values: Vec<f64>,
}

/// Terms that several polynomials share.
pub(crate) struct Terms {
    pub(crate) scalings: Vec<usize>,
    pub(crate) exponents: Vec<u8>,
    pub(crate) count: usize,
}

pub(crate) struct Known {
    pub(crate) mean: Vec<f64>,
    pub(crate) covariance: Vec<f64>,
}

/// See [`Uncertainty::spread`].
pub(crate) struct Spread {
    /// Covariance of the parameters, row by row; `None` for the identity.
    pub(crate) covariance: Option<Vec<f64>>,
    /// Covariance with the parameters: point by point, one per parameter.
    pub(crate) cross: Vec<f64>,
    /// Variance of the model error per point.
    pub(crate) missed: Vec<f64>,
}

pub(crate) struct SelfTest {
    pub(crate) condition: Vec<f64>,
    pub(crate) values: Vec<f64>,
    pub(crate) deviations: Vec<f64>,
}

impl Content {
    pub(crate) fn of(surrogate: &Surrogate<'_>) -> Self {
        let count = surrogate.variable_count();
        let mut scalings = Scalings { surrogate, list: Vec::new() };
        let polynomials = surrogate.polynomials().map(|own| {
            let points: Vec<usize> = own.points.iter().collect();
            Polynomial {
                scalings: scalings.places(|v| own.transform(v)),
                exponents: (0..own.terms).flat_map(|t| (0..count).map(move |v| own.exponent(t, v))).collect(),
                coefficients: (0..own.terms).flat_map(|t| (0..points.len()).map(move |c| own.coefficient(t, c))).collect(),
                terms: own.terms,
                points,
            }
        });
        let polynomials = polynomials.collect();
        let bases = surrogate.bases().map(|own| {
            let points: Vec<usize> = own.points.iter().collect();
            Basis {
                scalings: scalings.places(|v| own.transform(v)),
                kernel: own.kernel,
                scales: own.scales.iter().collect(),
                centres: (0..own.count).flat_map(|k| (0..count).map(move |v| own.coordinate(k, v))).collect(),
                count: own.count,
                weights: (0..own.count).flat_map(|k| (0..points.len()).map(move |c| own.weight(k, c))).collect(),
                points,
            }
        });
        let bases = bases.collect();
        let uncertainty = surrogate.uncertainty().map(|own| {
            let (points, parameters, terms) = (own.point_count(), own.parameter_count(), own.terms());
            let rows = own.measured().count();
            let mean = |v: usize| own.measured().filter_map(|row| row.get(v)).sum::<f64>() / rows as f64;
            let half = |v: &coldplate_runtime::Variable<'_>| if rows > 0 { 0.5 * (v.high - v.low) } else { 0.0 };
            let at = |p: usize, t: usize, k: usize| own.slope_coefficient(p, t, k);
            Uncertainty {
                parameters,
                scalings: scalings.places(|v| own.transform(v)),
                exponents: (0..terms).flat_map(|t| (0..count).map(move |v| own.exponent(t, v))).collect(),
                terms,
                slopes: (0..points)
                    .flat_map(|p| (0..terms).flat_map(move |t| (0..parameters).map(move |k| (p, t, k))))
                    .map(|(p, t, k)| at(p, t, k))
                    .collect(),
                own: (0..points).map(|p| own.missed(p).0).collect(),
                common: (0..points).map(|p| own.missed(p).1).collect(),
                growth: own.growth(),
                centre: (0..count).map(|v| if rows > 0 { mean(v) } else { 0.0 }).collect(),
                halves: surrogate.variables().map(|v| half(&v)).collect(),
                known: own.known().map(|(mean, covariance)| Known { mean: mean.iter().collect(), covariance: covariance.iter().collect() }),
            }
        });
        let in_time = surrogate.in_time().map(|own| {
            let (states, points) = (own.states(), surrogate.point_count());
            let mut terms = |all: coldplate_runtime::Polynomial<'_>| Terms {
                scalings: scalings.places(|v| all.transform(v)),
                exponents: (0..all.terms).flat_map(|t| (0..count).map(move |v| all.exponent(t, v))).collect(),
                count: all.terms,
            };
            let (steady, moving) = (terms(own.steady_terms()), terms(own.moving_terms()));
            let numbers = own.numbers();
            let mut numbers = numbers.iter();
            let mut take = |count: usize| -> Vec<f64> { numbers.by_ref().take(count).collect() };
            InTime {
                states,
                errors: take(points),
                reach: take(states),
                uniform: take(2 * states),
                spread: take(states * (states + 1) / 2),
                steady_coefficients: take(steady.count * states),
                rates: take(moving.count * states * states),
                outputs: take(points * moving.count * states),
                tests: (0..own.test_count())
                    .map(|_| TimeTest {
                        start: take(count),
                        condition: take(count),
                        duration: take(1).first().copied().unwrap_or_default(),
                        values: take(points),
                    })
                    .collect(),
                steady,
                moving,
            }
        });
        Self {
            variables: surrogate
                .variables()
                .map(|v| Variable { name: v.name.into(), unit: v.unit.into(), low: v.low, high: v.high })
                .collect(),
            held: surrogate.held().map(|h| Held { name: h.name.into(), unit: h.unit.into(), value: h.value }).collect(),
            points: surrogate.points().map(|p| Point { name: p.name.into(), unit: p.unit.into(), half_width: p.half_width }).collect(),
            limits: surrogate
                .limits()
                .filter_map(|l| Some(Limit { name: l.name.into(), kind: l.kind.renumbered(Some, Some)?, maximum: l.maximum }))
                .collect(),
            scalings: scalings.list,
            polynomials,
            bases,
            uncertainty,
            in_time,
            self_tests: surrogate
                .self_tests()
                .map(|test| SelfTest {
                    condition: test.condition.iter().collect(),
                    values: test.values.iter().collect(),
                    deviations: test.deviations.iter().collect(),
                })
                .collect(),
        }
    }
}

/// The scalings found so far.
struct Scalings<'s, 'a> {
    surrogate: &'s Surrogate<'a>,
    list: Vec<Scaling>,
}

impl Scalings<'_, '_> {
    /// Index of each variable's scaling in the list.
    fn places(&mut self, transform: impl Fn(usize) -> Transform) -> Vec<usize> {
        (0..self.surrogate.variable_count()).map(|variable| self.place(variable, transform(variable))).collect()
    }

    fn place(&mut self, variable: usize, transform: Transform) -> usize {
        if let Some(place) = self.list.iter().position(|own| own.variable == variable && own.transform == transform) {
            return place;
        }
        let own = self.surrogate.scaling(transform, variable);
        let (low, factor, offset) = own.map_or((0.0, 0.0, 0.0), |own| (own.low, own.factor, own.offset));
        self.list.push(Scaling { variable, transform, low, factor, offset });
        self.list.len() - 1
    }
}

impl Limit {
    /// Code of the kind of limit, as in the file.
    pub(crate) fn code(&self) -> usize {
        match self.kind {
            LimitKind::Maximum { .. } => 0,
            LimitKind::Rise { .. } => 1,
            LimitKind::Difference { .. } => 2,
            LimitKind::Spread(_) => 3,
        }
    }
}

impl Known {
    /// Covariance of two states.
    pub(crate) fn covariance(&self, i: usize, j: usize) -> f64 {
        self.covariance.get(i.max(j) * (i.max(j) + 1) / 2 + i.min(j)).copied().unwrap_or(0.0)
    }
}

impl Uncertainty {
    /// Point by point, term by term: the contribution of the parameters' mean to the coefficient of the term.
    pub(crate) fn shifts(&self, known: &Known) -> Vec<f64> {
        if self.parameters == 0 {
            return vec![0.0; self.own.len() * self.terms];
        }
        self.slopes.chunks_exact(self.parameters).map(|row| row.iter().zip(&known.mean).map(|(slope, mean)| slope * mean).sum()).collect()
    }

    /// Contribution of the mean of each point's own state to the point's value.
    pub(crate) fn missed_means(&self, known: &Known) -> Vec<f64> {
        let of = |state: usize| known.mean.get(state).copied().unwrap_or(0.0);
        let last = self.parameters + self.own.len();
        let each = self.own.iter().zip(&self.common).enumerate();
        each.map(|(point, (own, common))| own * of(self.parameters + point) + common * of(last)).collect()
    }

    /// Variance of a point's value from the states, in parts. With the slopes J of the point along the parameters the
    /// variance is J' covariance J + 2 J' cross + missed.
    pub(crate) fn spread(&self) -> Spread {
        let (parameters, points) = (self.parameters, self.own.len());
        let last = parameters + points;
        let missed = |both: &dyn Fn(usize, usize) -> f64, point: usize| {
            let (own, common, state) = (self.own[point], self.common[point], parameters + point);
            own * own * both(state, state) + 2.0 * own * common * both(state, last) + common * common * both(last, last)
        };
        let Some(known) = &self.known else {
            let both = |i: usize, j: usize| f64::from(u8::from(i == j));
            return Spread {
                covariance: None,
                cross: vec![0.0; points * parameters],
                missed: (0..points).map(|point| missed(&both, point)).collect(),
            };
        };
        let both = |i: usize, j: usize| known.covariance(i, j);
        let cross = |point: usize, k: usize| self.own[point] * both(k, parameters + point) + self.common[point] * both(k, last);
        Spread {
            covariance: Some((0..parameters).flat_map(|i| (0..parameters).map(move |j| both(i, j))).collect()),
            cross: (0..points).flat_map(|point| (0..parameters).map(move |k| cross(point, k))).collect(),
            missed: (0..points).map(|point| missed(&both, point)).collect(),
        }
    }
}
