//! Modes that store heat, and modes that store none and are in balance at once: faces that exchange radiation, nodes without capacity.

use nalgebra::{DMatrix, DVector, DVectorView};

use super::conductors::conductors;
use super::reduced_network::{ConstantTerms, ReducedNetwork};
use coldplate_base::error::{Error, Result, Stop};
use coldplate_network::Load;

/// Time constant up to which a mode counts as in balance at once, s. Chosen: far above the rounding of the slowest one (1e-16 of
/// hours), far below what a reading shows.
const AT_ONCE: f64 = 1e-3;

/// Most Newton steps that bring modes into balance, a count. Chosen: each halves a temperature at most, and a balance that exists is
/// found in far fewer.
const MOST_NEWTON: usize = 50;

/// The modes of a reduced network, turned so that some store heat and the others none.
///
/// Modes are orthonormal in the norm of the heat per kelvin at the middle of the ranges. An eigenvalue of their capacity matrix is
/// therefore a time constant.
#[derive(Debug)]
pub(super) struct Storing {
    /// Directions that store heat: n x p, orthonormal.
    pub(super) kept: DMatrix<f64>,
    /// Capacity of each of them, J/K.
    pub(super) capacity: DVector<f64>,
    /// Directions that store none: n x q, orthonormal.
    pub(super) balanced: DMatrix<f64>,
}

impl Storing {
    /// The directions of a capacity matrix, J/K.
    pub(super) fn of(capacity: &DMatrix<f64>) -> Self {
        let eigen = capacity.clone().symmetric_eigen();
        let (kept, rest): (Vec<usize>, Vec<usize>) = (0..capacity.nrows()).partition(|i| eigen.eigenvalues[*i] > AT_ONCE);
        Self {
            kept: eigen.eigenvectors.select_columns(&kept),
            capacity: eigen.eigenvalues.select_rows(&kept),
            balanced: eigen.eigenvectors.select_columns(&rest),
        }
    }

    /// Whether every mode stores heat.
    pub(super) fn is_whole(&self) -> bool {
        self.balanced.ncols() == 0
    }

    /// Coordinates along the directions that store heat of a state that stores this heat, J.
    pub(super) fn coordinates(&self, stored: &DVector<f64>) -> DVector<f64> {
        self.kept.tr_mul(stored).component_div(&self.capacity)
    }

    /// Amplitudes of the modes that store this heat (J), without those in balance at once.
    pub(super) fn amplitudes(&self, stored: &DVector<f64>) -> DVector<f64> {
        &self.kept * self.coordinates(stored)
    }
}

impl ReducedNetwork {
    /// Heat stored in the modes at one temperature (K) everywhere, less the heat at the temperatures of the middle, J.
    pub(super) fn uniform(&self, temperature: f64) -> DVector<f64> {
        self.stored.column(0) * temperature - self.stored.column(1)
    }

    /// Largest warming of a reading or a sampled node by a joule of each source that does not pass on, K/J.
    pub(super) fn warming(&self) -> Vec<f64> {
        let storing = Storing::of(&self.capacity);
        let of_source = |shares: DVectorView<'_, f64>| self.largest(&storing.amplitudes(&shares.into_owned()));
        self.sources.column_iter().map(of_source).collect()
    }

    /// Brings the modes that store no heat into balance under a load (with the terms that it gives) while all others stand still: to
    /// within a temperature (K) at a time (s). `t` are the temperatures of the sampled network, K.
    ///
    /// # Errors
    /// They find no balance.
    pub(super) fn settle(
        &self,
        storing: &Storing,
        (load, given): (&Load, &ConstantTerms),
        (within, time): (f64, f64),
        a: &mut DVector<f64>,
        t: &mut [f64],
    ) -> Result<()> {
        let (network, free) = (&self.network, &storing.balanced);
        self.set_outside(network, load, a, t);
        for _ in 0..MOST_NEWTON {
            let acting = conductors(network, load, t);
            let open = free.tr_mul(&self.solid_residual(given, &acting, a));
            let slopes = free.tr_mul(&(self.solid_jacobian(given, &acting) * free));
            let Some(step) = slopes.lu().solve(&open).map(|step| free * step) else { break };
            let falls = &self.rows * &step;
            let shares = falls.iter().zip(t.iter()).map(|(fall, t)| if *fall > 0.5 * t { 0.5 * t / fall } else { 1.0 });
            a.axpy(-shares.fold(1.0, f64::min), &step, 1.0);
            self.set_outside(network, load, a, t);
            self.set_walls(network, a, t);
            if self.largest(&step) < within {
                return Ok(());
            }
        }
        let what = format!("surfaces of the reduced model that store no heat find no balance at {time:.6} s");
        Err(Error::stopped(Stop::MostNewtonSteps, what).help("run the machine file in full"))
    }
}
