//! A surrogate as owned, plain data: the result of a fit, the content of a surrogate file.

pub use coldplate_runtime::{Kernel, LimitKind, Origin, Scale, Transform};

/// A condition variable of a surrogate.
#[derive(Debug, Clone, PartialEq)]
pub struct Variable {
    /// Name, for example `coolant_flow`.
    pub name: String,
    /// Unit of the values it takes, for example `L/min`.
    pub unit: String,
    /// Smallest value the surrogate was fitted on.
    pub low: f64,
    /// Largest value the surrogate was fitted on.
    pub high: f64,
}

/// A variable that did not vary while the surrogate was made: its answers are for this value alone.
#[derive(Debug, Clone, PartialEq)]
pub struct Held {
    /// Name.
    pub name: String,
    /// Unit of the value.
    pub unit: String,
    /// The value.
    pub value: f64,
}

/// A polynomial in the scaled variables.
#[derive(Debug, Clone, PartialEq)]
pub struct Polynomial {
    /// One per variable.
    pub transforms: Vec<Transform>,
    /// Exponents, `terms.len()` rows of one exponent per variable.
    pub terms: Vec<Vec<u8>>,
    /// One coefficient per term, in the point's unit.
    pub coefficients: Vec<f64>,
}

/// Kernel, scales and centres, shared by every point that uses them.
#[derive(Debug, Clone, PartialEq)]
pub struct RbfBasis {
    /// The kernel.
    pub kernel: Kernel,
    /// One per variable.
    pub transforms: Vec<Transform>,
    /// Inverse length scale per variable, multiplying the scaled variable.
    pub scales: Vec<f64>,
    /// Centres in scaled variables, one row of one value per variable each.
    pub centres: Vec<Vec<f64>>,
}

/// The function fitted to one measurement point.
#[derive(Debug, Clone, PartialEq)]
pub enum PointModel {
    /// A polynomial.
    Polynomial(Polynomial),
    /// Radial basis functions with a polynomial tail.
    Rbf {
        /// Index into [`Surrogate::bases`].
        basis: usize,
        /// One weight per centre.
        weights: Vec<f64>,
        /// The tail.
        tail: Polynomial,
    },
}

/// A measurement point and its model.
#[derive(Debug, Clone, PartialEq)]
pub struct Point {
    /// Name.
    pub name: String,
    /// Unit of its value, for example `degC`.
    pub unit: String,
    /// Its function.
    pub model: PointModel,
    /// Half width of the band that covers 95 % of new conditions inside the range.
    pub half_width: f64,
}

/// A limit, by indices into [`Surrogate::points`] and [`Surrogate::variables`].
#[derive(Debug, Clone, PartialEq)]
pub struct Limit {
    /// Name.
    pub name: String,
    /// The bounded value.
    pub kind: LimitKind<Vec<usize>>,
    /// Largest value allowed, in the points' unit.
    pub maximum: f64,
}

/// An uncertain parameter of the machine.
#[derive(Debug, Clone, PartialEq)]
pub struct Parameter {
    /// Key in the machine file, or name of a factor.
    pub name: String,
    /// Unit of its values.
    pub unit: String,
    /// Value the surrogate was made with.
    pub nominal: f64,
    /// Standard deviation.
    pub deviation: f64,
    /// Smallest value that may be stated.
    pub low: f64,
    /// Largest value that may be stated.
    pub high: f64,
    /// How it enters.
    pub scale: Scale,
    /// Where its deviation is from.
    pub origin: Origin,
}

/// What the model misses at a point, as standard deviations in its unit.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Miss {
    /// At this point alone.
    pub own: f64,
    /// In common with all points.
    pub common: f64,
}

/// What is known of the states (one per parameter, one per point, one for all points) beyond their standard deviations.
#[derive(Debug, Clone, PartialEq)]
pub struct States {
    /// Mean of each.
    pub mean: Vec<f64>,
    /// Packed lower triangle of their covariance, row by row.
    pub covariance: Vec<f64>,
}

/// What the answers of a surrogate leave open.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Uncertainty {
    /// Uncertain parameters.
    pub parameters: Vec<Parameter>,
    /// How the variables enter the slopes.
    pub transforms: Vec<Transform>,
    /// Exponents of the slopes' terms.
    pub terms: Vec<Vec<u8>>,
    /// Point by point, term by term, one coefficient per parameter: change of the point with one standard deviation.
    pub slopes: Vec<Vec<Vec<f64>>>,
    /// What the model misses, point by point.
    pub misses: Vec<Miss>,
    /// Growth of that away from the measured conditions.
    pub growth: f64,
    /// Conditions at which the model was compared with measurements.
    pub measured: Vec<Vec<f64>>,
    /// What is known of the states; `None` where that is nothing.
    pub states: Option<States>,
}

/// Key in the provenance, before its name, of a held variable that was moved; the text says from where.
pub const MOVED: &str = "moved ";

/// How the answers follow a variable that was held.
#[derive(Debug, Clone, PartialEq)]
pub struct FollowedVariable {
    /// Index into [`Surrogate::held`].
    pub held: usize,
    /// Smallest value that may be stated for it.
    pub low: f64,
    /// Largest value that may be stated for it.
    pub high: f64,
    /// Point by point, term by term: what t and its square add to the point, where t is the change of the variable over
    /// `high - low`.
    pub coefficients: Vec<Vec<[f64; 2]>>,
    /// Standard deviation of each point's change, per t, where this variable alone is moved.
    pub errors: Vec<f64>,
}

/// How the change with one held variable follows another one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Interaction {
    /// The point.
    pub point: usize,
    /// Whose change it is: index into [`Followed::variables`].
    pub of: usize,
    /// The other variable, likewise.
    pub by: usize,
    /// The change is multiplied by one plus this times the other's t.
    pub factor: f64,
}

/// How the answers follow variables that were held.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Followed {
    /// How the other variables enter.
    pub transforms: Vec<Transform>,
    /// Exponents of the terms.
    pub terms: Vec<Vec<u8>>,
    /// Those that may be stated.
    pub variables: Vec<FollowedVariable>,
    /// What moving several at a time adds to their sum.
    pub interactions: Vec<Interaction>,
    /// By what the deviations of the variables' own changes, taken together, are multiplied at each point where several are moved:
    /// what conditions gave that took no part in the fit.
    pub errors: Vec<f64>,
    /// Limits over the temperature that a held variable is, with that variable's index in [`Surrogate::held`]: their maximum moves
    /// with it.
    pub limits: Vec<(usize, usize)>,
}

/// Polynomials in common terms, or rather those terms.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Shared {
    /// How each variable enters.
    pub transforms: Vec<Transform>,
    /// Exponents of the terms.
    pub terms: Vec<Vec<u8>>,
}

/// The machine over time: states that fall back to those of the steady state, z' = -rates (z - steady), and move the points by
/// outputs (z - steady). All but the uniform states are polynomials of the condition.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct InTime {
    /// How many.
    pub states: usize,
    /// Terms of the steady states, and of rates and outputs.
    pub steady_terms: Shared,
    /// See there.
    pub moving_terms: Shared,
    /// Term by term, one coefficient per state.
    pub steady: Vec<Vec<f64>>,
    /// Term by term, states times states coefficients, column by column, 1/s.
    pub rates: Vec<Vec<f64>>,
    /// Point by point, term by term, one coefficient per state.
    pub outputs: Vec<Vec<f64>>,
    /// States of one temperature everywhere: at zero, and per unit of the points.
    pub uniform: [Vec<f64>; 2],
    /// How far a unit of each state moves a point at most.
    pub reach: Vec<f64>,
    /// Packed lower triangle of the covariance of what states are away from steady ones.
    pub spread: Vec<f64>,
    /// By how much each point may be off over time.
    pub errors: Vec<f64>,
}

/// Everything a surrogate file holds, except the self-test vectors, which the writer computes.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Surrogate {
    /// Condition variables, in the order of a query.
    pub variables: Vec<Variable>,
    /// Variables that were held, in no condition.
    pub held: Vec<Held>,
    /// Shared radial bases.
    pub bases: Vec<RbfBasis>,
    /// Measurement points.
    pub points: Vec<Point>,
    /// Limits.
    pub limits: Vec<Limit>,
    /// What the answers leave open, where that is known.
    pub uncertainty: Option<Uncertainty>,
    /// How the answers follow held variables, where that was found out.
    pub followed: Option<Followed>,
    /// How the machine moves over time, where that was found out.
    pub in_time: Option<InTime>,
    /// Provenance: key and value, both text.
    pub provenance: Vec<(String, String)>,
}
