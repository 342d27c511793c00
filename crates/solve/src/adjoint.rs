//! The exact derivative of a network's residual at a state, and linear solves with it and its transpose.
//!
//! J = J_sparse + sum u vᵀ: the sparse part treats the coolant's films and flows as given, the rank-one terms are their derivatives
//! (see [`coldplate_network::slopes`]). Solves are by GMRES, preconditioned by one multigrid cycle on the solids and one pass along the
//! streams: downstream for J, upstream for Jᵀ.

use super::csr::norm;
use super::jacobian::Jacobian;
use super::krylov::{DoubleBasis, Operator, Scratch, Status, Stopping, gmres};
use super::multigrid::Multigrid;
use super::newton::largest;
use super::preconditioner::{downstream, upstream};
use super::system::{self, System};
use coldplate_base::error::Result;
use coldplate_network::slopes::RankOne;
use coldplate_network::{Load, Network, StreamState};

/// Largest relative residual with which a solution may be used, dimensionless. Chosen: exactness of the derivatives against solves that
/// are refused.
const TOLERANCE: f64 = 1e-11;
/// Relative residual that a solve aims at, dimensionless. Chosen below the rounding of J x, which ends the iteration first. Strong rows
/// (water) dominate the norm, and a weakly connected part feels a residual that the norm hardly shows.
const AIM: f64 = 1e-15;
/// Most Krylov iterations of a solve, a count. Chosen: time against solves that are refused.
const MOST_KRYLOV: usize = 600;

/// The derivative of the residual with respect to all temperatures, W/K, at one state. Rows and columns of
/// nodes that are held at a temperature are those of the identity.
#[derive(Debug, Clone)]
pub struct Tangent<'a> {
    network: &'a Network,
    system: System,
    streams: Vec<StreamState>,
    matrix: Jacobian<'a>,
    transposed: Jacobian<'a>,
    rank: Vec<RankOne>,
    diagonal: Vec<f64>,
    multigrid: Multigrid,
}

impl<'a> Tangent<'a> {
    /// The derivative at `temperatures` (K, of every node).
    ///
    /// # Errors
    /// Errors of [`Network::stream_states`]; some node has no path to any given temperature.
    pub fn new(network: &'a Network, load: &Load, temperatures: &[f64]) -> Result<Self> {
        let system = System::new(network);
        let streams = network.stream_states(load, temperatures)?;
        let rank = network.stream_slopes(load, &streams, temperatures)?;
        let matrix = system.jacobian(network, load, &streams, temperatures);
        let multigrid = Multigrid::new(&system.symmetric(network, load, &streams, temperatures), &network.capacity)?;
        let diagonal = sizes(&matrix);
        Ok(Self { network, system, streams, transposed: matrix.transposed(), matrix, rank, diagonal, multigrid })
    }

    /// The derivative J + rate C, the matrix of an implicit step in time: `rate` in 1/s, C the capacity of every node (J/K) on the
    /// diagonal.
    ///
    /// # Errors
    /// Errors of [`Tangent::new`].
    pub fn shifted(&self, rate: f64, capacity: &[f64]) -> Result<Self> {
        let mut shifted = self.clone();
        shifted.matrix.add_diagonal(capacity.iter().map(|c| rate * c));
        shifted.transposed = shifted.matrix.transposed();
        shifted.diagonal = sizes(&shifted.matrix);
        shifted.multigrid.shift(rate)?;
        Ok(shifted)
    }

    /// The streams' states the derivative was taken at.
    pub fn streams(&self) -> &[StreamState] {
        &self.streams
    }

    /// Size of the coefficients in each row of the sparse part, W/K.
    pub fn diagonal(&self) -> &[f64] {
        &self.diagonal
    }

    /// Heat leaving each node minus heat entering it, W, for this or another network with the same nodes.
    ///
    /// # Errors
    /// Errors of [`Network::stream_states`].
    pub fn residual(&self, network: &Network, load: &Load, temperatures: &[f64]) -> Result<Vec<f64>> {
        let streams = network.stream_states(load, temperatures)?;
        if std::ptr::eq(network, self.network) {
            return Ok(self.system.residual(network, load, &streams, temperatures));
        }
        Ok(system::residual(network, load, &streams, temperatures))
    }

    /// One exact Newton step from temperatures near those of this tangent; returns the largest move, K.
    ///
    /// # Errors
    /// Errors of [`Tangent::solve`].
    pub fn correct(&self, load: &Load, temperatures: &mut [f64]) -> Result<f64> {
        let right: Vec<f64> = self.residual(self.network, load, temperatures)?.iter().map(|r| -r).collect();
        let step = self.solve(&right)?;
        temperatures.iter_mut().zip(&step).for_each(|(t, s)| *t += s);
        Ok(largest(&step))
    }

    /// y = J x
    pub fn multiply(&self, x: &[f64], y: &mut [f64]) {
        self.matrix.multiply(x, y);
        for term in &self.rank {
            let m: f64 = term.weights.iter().map(|(i, w)| w * x[*i as usize]).sum();
            term.rows.iter().for_each(|(i, u)| y[*i as usize] += u * m);
        }
    }

    /// y = Jᵀ x
    pub fn multiply_transposed(&self, x: &[f64], y: &mut [f64]) {
        self.transposed.multiply(x, y);
        for term in &self.rank {
            let m: f64 = term.rows.iter().map(|(i, u)| u * x[*i as usize]).sum();
            term.weights.iter().for_each(|(i, w)| y[*i as usize] += w * m);
        }
    }

    /// x with J x = b.
    ///
    /// # Errors
    /// The iteration does not reach a relative residual of 1e-11; it aims at the rounding of the matrix-vector product.
    pub fn solve(&self, b: &[f64]) -> Result<Vec<f64>> {
        self.solve_within(b, AIM)
    }

    /// x with J x = b, to a relative residual `aim`.
    ///
    /// # Errors
    /// Errors of [`Tangent::solve`].
    pub(crate) fn solve_within(&self, b: &[f64], aim: f64) -> Result<Vec<f64>> {
        let mut work = self.multigrid.workspace();
        self.solved(self, b, aim, |r, z| downstream(self.network, &self.streams, &self.multigrid, r, z, &mut work))
    }

    /// x with Jᵀ x = b.
    ///
    /// # Errors
    /// Errors of [`Tangent::solve`].
    pub fn solve_transposed(&self, b: &[f64]) -> Result<Vec<f64>> {
        self.solve_transposed_within(b, AIM)
    }

    /// x with Jᵀ x = b, to a relative residual `aim`.
    ///
    /// # Errors
    /// Errors of [`Tangent::solve`].
    pub(crate) fn solve_transposed_within(&self, b: &[f64], aim: f64) -> Result<Vec<f64>> {
        let mut work = self.multigrid.workspace();
        self.solved(&Transposed(self), b, aim, |r, z| upstream(self.network, &self.streams, &self.multigrid, r, z, &mut work))
    }

    /// x with A x = b for an operator with its preconditioner, to a relative residual `aim`.
    fn solved(&self, operator: &impl Operator, b: &[f64], aim: f64, precondition: impl FnMut(&[f64], &mut [f64])) -> Result<Vec<f64>> {
        let mut x = vec![0.0; b.len()];
        let stopping = Stopping { tolerance: aim, settled: TOLERANCE, most: MOST_KRYLOV };
        let found = gmres(operator, b, &mut x, stopping, &mut Scratch::<DoubleBasis>::default(), precondition);
        let is_usable = found.status == Status::Converged || found.relative_residual <= TOLERANCE;
        if is_usable { Ok(x) } else { Err(found.stopped("the linear solver of the derivatives")) }
    }
}

impl Operator for Tangent<'_> {
    fn multiply(&self, x: &[f64], y: &mut [f64]) {
        self.multiply(x, y);
    }

    fn rounding(&self, x: &[f64]) -> f64 {
        let scaled: Vec<f64> = self.diagonal.iter().zip(x).map(|(d, x)| d * x).collect();
        2.0 * f64::EPSILON * norm(&scaled)
    }
}

/// A tangent as its transposed operator.
struct Transposed<'t, 'a>(&'t Tangent<'a>);

impl Operator for Transposed<'_, '_> {
    fn multiply(&self, x: &[f64], y: &mut [f64]) {
        self.0.multiply_transposed(x, y);
    }

    fn rounding(&self, x: &[f64]) -> f64 {
        self.0.rounding(x)
    }
}

/// The size of each row: the largest of its products with a few vectors of noise between -1 and 1.
pub(super) fn sizes(matrix: &Jacobian<'_>) -> Vec<f64> {
    let n = matrix.rows();
    let (mut size, mut product) = (vec![0.0f64; n], vec![0.0; n]);
    for k in 0..4 {
        let noise: Vec<f64> =
            (0..n).map(|i| 2.0 * ((i as f64 + 1.0) * 0.754_877_666_246_692_8 + 0.23 * f64::from(k)).fract() - 1.0).collect();
        matrix.multiply(&noise, &mut product);
        size.iter_mut().zip(&product).for_each(|(s, p)| *s = s.max(p.abs()));
    }
    size
}
