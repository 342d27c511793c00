//! A surrogate as owned, plain data: the result of a fit, the content of a surrogate file.

pub use coldplate_runtime::{Kernel, LimitKind, Origin, Scale, Transform};

/// A condition variable of a surrogate.
#[derive(Debug, Clone, PartialEq)]
pub struct VariableSpec {
    /// Name, for example `coolant_flow`.
    pub name: String,
    /// Unit of the values it takes, for example `L/min`.
    pub unit: String,
    /// Smallest value the surrogate was fitted on.
    pub low: f64,
    /// Largest value the surrogate was fitted on.
    pub high: f64,
}

/// A variable that did not vary while the surrogate was made; the answers are for this value alone.
#[derive(Debug, Clone, PartialEq)]
pub struct HeldSpec {
    /// Name.
    pub name: String,
    /// Unit of the value.
    pub unit: String,
    /// The value.
    pub value: f64,
}

/// A polynomial in the scaled variables.
#[derive(Debug, Clone, PartialEq)]
pub struct PolynomialSpec {
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
    Polynomial(PolynomialSpec),
    /// Radial basis functions with a polynomial tail.
    Rbf {
        /// Index into [`SurrogateSpec::bases`].
        basis: usize,
        /// One weight per centre.
        weights: Vec<f64>,
        /// The tail.
        tail: PolynomialSpec,
    },
}

/// A measurement point and its model.
#[derive(Debug, Clone, PartialEq)]
pub struct PointSpec {
    /// Name.
    pub name: String,
    /// Unit of the point's value, for example `degC`.
    pub unit: String,
    /// The function fitted to it.
    pub model: PointModel,
    /// Half width of the band that covers 95 % of new conditions inside the range: of the fit, and of the mesh if its error
    /// is known.
    pub half_width: f64,
}

/// A limit, by indices into [`SurrogateSpec::points`] and [`SurrogateSpec::variables`].
#[derive(Debug, Clone, PartialEq)]
pub struct LimitSpec {
    /// Name.
    pub name: String,
    /// The bounded value.
    pub kind: LimitKind<Vec<usize>>,
    /// Largest value allowed, in the points' unit.
    pub maximum: f64,
}

/// An uncertain parameter of the machine.
#[derive(Debug, Clone, PartialEq)]
pub struct ParameterSpec {
    /// Key in the machine file, or name of a factor.
    pub name: String,
    /// Unit of the parameter's values.
    pub unit: String,
    /// Value the surrogate was made with.
    pub nominal: f64,
    /// Standard deviation.
    pub deviation: f64,
    /// Smallest value that may be stated.
    pub low: f64,
    /// Largest value that may be stated.
    pub high: f64,
    /// Scale on which the parameter is normal.
    pub scale: Scale,
    /// Origin of the standard deviation.
    pub origin: Origin,
}

/// Model error at a point, as standard deviations in the point's unit.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Miss {
    /// Standard deviation of the error at this point alone.
    pub own: f64,
    /// Standard deviation of the error common to all points.
    pub common: f64,
}

/// Joint distribution of the states (one per parameter, one per point, one for all points), in their standard
/// deviations.
#[derive(Debug, Clone, PartialEq)]
pub struct StateDistribution {
    /// Mean of each state.
    pub mean: Vec<f64>,
    /// Packed lower triangle of their covariance, row by row.
    pub covariance: Vec<f64>,
}

/// Uncertainty of the answers of a surrogate.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct UncertaintySpec {
    /// Uncertain parameters.
    pub parameters: Vec<ParameterSpec>,
    /// How the variables enter the slopes.
    pub transforms: Vec<Transform>,
    /// Exponents of the slopes' terms.
    pub terms: Vec<Vec<u8>>,
    /// Point by point, term by term, one coefficient per parameter: change of the point with one standard deviation.
    pub slopes: Vec<Vec<Vec<f64>>>,
    /// Model error, point by point.
    pub misses: Vec<Miss>,
    /// Growth of the model error away from the measured conditions.
    pub growth: f64,
    /// Conditions at which the model was compared with measurements.
    pub measured: Vec<Vec<f64>>,
    /// Joint distribution of the states; `None` if nothing is known beyond their standard deviations.
    pub states: Option<StateDistribution>,
}

/// Key in the provenance, before its name, of a variable with a default; the text is the value with its unit.
pub const DEFAULT: &str = "default ";
/// Key in the provenance, before its name, of a held variable that was moved; the text says from where.
pub const MOVED: &str = "moved ";

/// How the answers follow a variable that was held.
#[derive(Debug, Clone, PartialEq)]
pub struct FollowedVariable {
    /// Index into [`SurrogateSpec::held`].
    pub held: usize,
    /// Smallest value that may be stated for it.
    pub low: f64,
    /// Largest value that may be stated for it.
    pub high: f64,
    /// Coefficients of t and t² in the change of each point, point by point, term by term; t is the change of the
    /// variable over `high - low`.
    pub coefficients: Vec<Vec<[f64; 2]>>,
    /// Standard deviation of each point's change, per t, where this variable alone is moved.
    pub errors: Vec<f64>,
}

/// How the change with one held variable follows another one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Interaction {
    /// The point.
    pub point: usize,
    /// The variable whose change is multiplied: index into [`FollowedSpec::variables`].
    pub of: usize,
    /// The other variable, likewise.
    pub by: usize,
    /// The change is multiplied by 1 + `factor` · t of the other variable.
    pub factor: f64,
}

/// How the answers follow variables that were held.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct FollowedSpec {
    /// How the other variables enter.
    pub transforms: Vec<Transform>,
    /// Exponents of the terms.
    pub terms: Vec<Vec<u8>>,
    /// Held variables for which other values may be stated.
    pub variables: Vec<FollowedVariable>,
    /// Interactions between variables that are moved at the same time.
    pub interactions: Vec<Interaction>,
    /// Factor at each point on the standard deviation of the variables' own changes, taken together, if several are moved: from
    /// conditions that took no part in the fit.
    pub errors: Vec<f64>,
    /// Limits that bound a rise over a held temperature, each with the variable's index in [`SurrogateSpec::held`]: their maximum
    /// moves with it.
    pub limits: Vec<(usize, usize)>,
}

/// The terms of polynomials that share them.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct SharedTerms {
    /// How each variable enters.
    pub transforms: Vec<Transform>,
    /// Exponents of the terms.
    pub terms: Vec<Vec<u8>>,
}

/// The machine over time. States decay to the steady ones, z' = -rates (z - steady), and move the points by outputs (z -
/// steady). All but the uniform states are polynomials of the condition.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct InTimeSpec {
    /// Number of states.
    pub states: usize,
    /// Terms of the steady states.
    pub steady_terms: SharedTerms,
    /// Terms of the rates and of the outputs.
    pub moving_terms: SharedTerms,
    /// Coefficients of the steady states: term by term, one per state.
    pub steady: Vec<Vec<f64>>,
    /// Coefficients of the rates, 1/s: term by term, states times states, column by column.
    pub rates: Vec<Vec<f64>>,
    /// Coefficients of the outputs: point by point, term by term, one per state.
    pub outputs: Vec<Vec<f64>>,
    /// States of one temperature everywhere: at zero, and per unit of the points.
    pub uniform: [Vec<f64>; 2],
    /// Largest change of a point per unit of each state.
    pub reach: Vec<f64>,
    /// Packed lower triangle of the covariance of the states' distances from the steady ones.
    pub spread: Vec<f64>,
    /// Largest error of each point over time, in the point's unit.
    pub errors: Vec<f64>,
}

/// Everything a surrogate file holds, except the self-test vectors, which the writer computes.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct SurrogateSpec {
    /// Condition variables, in the order of a query.
    pub variables: Vec<VariableSpec>,
    /// Variables that were held, in no condition.
    pub held: Vec<HeldSpec>,
    /// Shared radial bases.
    pub bases: Vec<RbfBasis>,
    /// Measurement points.
    pub points: Vec<PointSpec>,
    /// Part of each point's half width that is the error of the mesh, in the point's unit; empty if it is not known.
    pub mesh: Vec<f64>,
    /// Limits.
    pub limits: Vec<LimitSpec>,
    /// Uncertainty of the answers, if it is known.
    pub uncertainty: Option<UncertaintySpec>,
    /// How the answers follow held variables, if it was fitted.
    pub followed: Option<FollowedSpec>,
    /// How the machine moves over time, if it was fitted.
    pub in_time: Option<InTimeSpec>,
    /// Corners of the fitted ranges that no row lies in.
    pub empty_corners: Vec<coldplate_runtime::EmptyCorner>,
    /// Marks of the readings that the states were learnt from.
    pub readings: Vec<[u8; 8]>,
    /// Provenance: key and value, both text.
    pub provenance: Vec<(String, String)>,
}
