//! The exact derivative of a network's residual at a state, and linear solves with it and its transpose.
//!
//! J = J_sparse + sum u vᵀ: the sparse part treats the coolant's films and flows as given, the rank-one terms are their derivatives
//! (see [`coldplate_network::slopes`]). Solves are by GMRES, preconditioned by one multigrid cycle on the solids and one pass along the
//! streams: downstream for J, upstream for Jᵀ.

use super::csr::{add_scaled, dot, norm};
use super::jacobian::Jacobian;
use super::krylov::Hessenberg;
use super::multigrid::{Multigrid, Workspace};
use super::surfaces::surface_states;
use super::system::{self, System};
use coldplate_base::error::{Error, Result, Stop};
use coldplate_network::slopes::RankOne;
use coldplate_network::stream::members;
use coldplate_network::{Load, Network, StreamState};

/// Largest relative residual with which a solution may be used, dimensionless. Chosen: exactness of the derivatives against solves that
/// are refused.
const TOLERANCE: f64 = 1e-11;
/// Relative residual that a solve aims at, dimensionless. Chosen below the rounding of J x, which ends the iteration first. Strong rows
/// (water) dominate the norm, and a weakly connected part feels a residual that the norm hardly shows.
const AIM: f64 = 1e-15;
/// Least ratio of the residuals after and before one cycle of GMRES, dimensionless. Chosen: below it the recursive residual is no
/// longer the true one.
const CYCLE: f64 = 1e-12;
/// Most Krylov iterations of a solve, a count. Chosen: time against solves that are refused.
const MOST_KRYLOV: usize = 600;
/// Vectors of the basis after which GMRES begins anew, a count. Chosen: memory against iterations.
const RESTART: usize = 50;

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
        let mut matrix = system.jacobian(network, load, &streams, temperatures);
        // The solver leaves this out: far from the solution it may turn a coefficient negative.
        let mut stiffening = vec![0.0; network.solids];
        for (surface, state) in network.surfaces.iter().zip(surface_states(network, load, temperatures)) {
            stiffening[surface.node as usize] += state.stiffening;
        }
        matrix.add_diagonal(stiffening.into_iter());
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
        Ok(step.iter().fold(0.0, |m: f64, s| m.max(s.abs())))
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
    pub fn solve_within(&self, b: &[f64], aim: f64) -> Result<Vec<f64>> {
        let mut work = self.multigrid.workspace();
        self.gmres(b, aim, |x, y| self.multiply(x, y), |r, z| self.downstream(r, z, &mut work))
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
    pub fn solve_transposed_within(&self, b: &[f64], aim: f64) -> Result<Vec<f64>> {
        let mut work = self.multigrid.workspace();
        self.gmres(b, aim, |x, y| self.multiply_transposed(x, y), |r, z| self.upstream(r, z, &mut work))
    }

    /// Preconditioner: solids by one V-cycle, then the water that follows from them.
    fn downstream(&self, r: &[f64], z: &mut [f64], work: &mut Workspace) {
        let solids = self.network.solids;
        let (solid, water) = z.split_at_mut(solids);
        self.multigrid.apply(&r[..solids], solid, work);
        for s in self.network.circuits.iter().flat_map(|tree| members(&tree.layout)) {
            let (stream, state) = (&self.network.streams[s], &self.streams[s]);
            let first = stream.first_node as usize - solids;
            let outlet = |u: &usize| water[self.network.streams[*u].outlet() as usize - solids];
            let mut above: f64 = stream.upstream.iter().zip(&state.mixture).map(|(u, w)| w * outlet(u)).sum();
            for (k, station) in stream.stations.iter().enumerate() {
                let wall: f64 = station.cells.iter().map(|(n, w)| w * solid[*n]).sum();
                let (rate, exchange) = (state.capacity_rate, state.exchange[k]);
                let right = r[solids + first + k];
                above = if rate > 0.0 { (right + (rate - exchange) * above + exchange * wall) / rate } else { right + wall };
                water[first + k] = above;
            }
        }
    }

    /// Transposed preconditioner: the water against its flow, then solids by one V-cycle.
    fn upstream(&self, r: &[f64], z: &mut [f64], work: &mut Workspace) {
        let solids = self.network.solids;
        let mut right = r.to_vec();
        let (solid_right, water_right) = right.split_at_mut(solids);
        let (solid, water) = z.split_at_mut(solids);
        let order: Vec<usize> = self.network.circuits.iter().flat_map(|tree| members(&tree.layout)).collect();
        for s in order.into_iter().rev() {
            let (stream, state) = (&self.network.streams[s], &self.streams[s]);
            let first = stream.first_node as usize - solids;
            let rate = state.capacity_rate;
            for (k, station) in stream.stations.iter().enumerate().rev() {
                let exchange = state.exchange[k];
                // Value of this node, and the coefficients by which it adds to the node above and to the cells of the wall.
                let (own, carried, given) = if rate > 0.0 {
                    (water_right[first + k] / rate, rate - exchange, exchange)
                } else {
                    (water_right[first + k], 0.0, 1.0)
                };
                water[first + k] = own;
                station.cells.iter().for_each(|(n, w)| solid_right[*n] += given * w * own);
                if k > 0 {
                    water_right[first + k - 1] += carried * own;
                } else {
                    for (u, w) in stream.upstream.iter().zip(&state.mixture) {
                        water_right[self.network.streams[*u].outlet() as usize - solids] += w * carried * own;
                    }
                }
            }
        }
        self.multigrid.apply(solid_right, solid, work);
    }

    /// Restarted GMRES to a relative residual `aim` with right preconditioning, from zero (Saad, Iterative Methods, alg. 9.5).
    fn gmres(
        &self,
        b: &[f64],
        aim: f64,
        multiply: impl Fn(&[f64], &mut [f64]),
        mut precondition: impl FnMut(&[f64], &mut [f64]),
    ) -> Result<Vec<f64>> {
        let n = b.len();
        let size = norm(b);
        let (mut x, mut r, mut z, mut product) = (vec![0.0; n], b.to_vec(), vec![0.0; n], vec![0.0; n]);
        let mut iterations = 0;
        let mut before = f64::INFINITY;
        loop {
            let beta = norm(&r);
            // No iteration brings the residual below the rounding of J x.
            let scaled: Vec<f64> = self.diagonal.iter().zip(&x).map(|(d, x)| d * x).collect();
            let target = (aim * size).max(2.0 * f64::EPSILON * norm(&scaled));
            let has_settled = beta > 0.5 * before || iterations >= MOST_KRYLOV;
            if beta <= target || (has_settled && beta <= TOLERANCE * size) {
                return Ok(x);
            }
            before = beta;
            if iterations >= MOST_KRYLOV || !beta.is_finite() {
                return Err(Error::stopped(
                    Stop::LinearSolver,
                    format!(
                        "the linear solver of the derivatives stopped at a relative residual of {:.2e} after {iterations} iterations",
                        beta / size
                    ),
                ));
            }
            let mut basis: Vec<Vec<f64>> = vec![r.iter().map(|v| v / beta).collect()];
            let mut hessenberg = Hessenberg::new(beta);
            while hessenberg.len() < RESTART && iterations < MOST_KRYLOV {
                precondition(&basis[hessenberg.len()], &mut z);
                let mut w = vec![0.0; n];
                multiply(&z, &mut w);
                iterations += 1;
                let mut h = Vec::with_capacity(basis.len());
                for v in &basis {
                    let projection = dot(v, &w);
                    add_scaled(&mut w, -projection, v);
                    h.push(projection);
                }
                let length = norm(&w);
                let left = hessenberg.add(h, length);
                if left <= (0.3 * target).max(CYCLE * beta) || length <= 1e-300 {
                    break;
                }
                w.iter_mut().for_each(|v| *v /= length);
                basis.push(w);
            }
            let y = hessenberg.weights();
            let mut combination = vec![0.0; n];
            basis.iter().zip(&y).for_each(|(v, weight)| add_scaled(&mut combination, *weight, v));
            precondition(&combination, &mut z);
            add_scaled(&mut x, 1.0, &z);
            multiply(&x, &mut product);
            r.iter_mut().zip(b.iter().zip(&product)).for_each(|(r, (b, p))| *r = b - p);
        }
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
