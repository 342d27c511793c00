//! Sparse Cholesky decompositions of a symmetric positive definite matrix with a rate times the capacity on its diagonal.

use std::sync::Arc;

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::sparse::linalg::cholesky::{LltRef, SymbolicCholesky, SymmetricOrdering, factorize_symbolic_cholesky};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};
use faer::{Conj, MatMut, Par, Side};

use super::csr::Csr;
use coldplate_base::error::{Error, Result, Stop};

/// Decompositions that are kept, a count. Chosen: memory against decompositions made again.
const MOST_KNOWN: usize = 8;

/// A matrix, and its decompositions.
#[derive(Debug, Clone)]
pub(crate) struct Direct {
    matrix: Csr,
    /// Heat capacity by row, J/K.
    capacity: Vec<f64>,
    /// Start of each row, in the type that the decomposition takes.
    starts: Vec<u32>,
    /// Places of a factor's entries, equal at every rate.
    pattern: Arc<SymbolicCholesky<u32>>,
    /// Factor in use; `known` has the latest ones, newest first, because rates come again.
    factor: Arc<Vec<f64>>,
    known: Vec<Shifted>,
}

/// A decomposition with the capacity over a time on the diagonal.
#[derive(Debug, Clone)]
struct Shifted {
    /// Rate, 1/s.
    rate: f64,
    factor: Arc<Vec<f64>>,
}

impl Direct {
    /// Decomposes a matrix with `capacity` (J/K, by row).
    ///
    /// # Errors
    /// The matrix is not positive definite: some node has no path to any given temperature.
    pub fn new(matrix: Csr, capacity: Vec<f64>) -> Result<Self> {
        Self::within(matrix, capacity, f64::INFINITY)?.ok_or_else(|| Error::numerics("the network's matrix cannot be decomposed"))
    }

    /// Decomposes a matrix with `capacity` (J/K, by row); `None` if a factor would have more than `most` entries per row.
    ///
    /// # Errors
    /// Errors of [`Direct::new`].
    pub fn within(matrix: Csr, capacity: Vec<f64>, most: f64) -> Result<Option<Self>> {
        let starts: Vec<u32> = matrix.starts.iter().map(|s| *s as u32).collect();
        let pattern = factorize_symbolic_cholesky(shape(&matrix, &starts), Side::Lower, SymmetricOrdering::Amd, Default::default())
            .map_err(|e| Error::numerics(format!("the network's matrix cannot be decomposed: {e:?}")))?;
        if pattern.len_val() as f64 > most * matrix.rows() as f64 {
            return Ok(None);
        }
        let (factor, known) = (Arc::new(Vec::new()), Vec::new());
        let mut found = Self { matrix, capacity, starts, pattern: Arc::new(pattern), factor, known };
        found.factor = Arc::new(found.decomposed(0.0)?);
        Ok(Some(found))
    }

    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.matrix.rows()
    }

    /// Puts `rate` (1/s) times the capacity on the diagonal, in place of a rate set before.
    ///
    /// # Errors
    /// Errors of [`Direct::new`].
    pub fn shift(&mut self, rate: f64) -> Result<()> {
        let shifted = match self.known.iter().position(|s| s.rate == rate) {
            Some(at) => self.known.remove(at),
            None => Shifted { rate, factor: Arc::new(self.decomposed(rate)?) },
        };
        self.factor.clone_from(&shifted.factor);
        self.known.insert(0, shifted);
        self.known.truncate(MOST_KNOWN);
        Ok(())
    }

    /// Solves A x = b; `x` holds b before.
    pub fn solve(&self, x: &mut [f64]) {
        let rows = self.rows();
        let mut memory = MemBuffer::new(self.pattern.solve_in_place_scratch::<f64>(1, Par::Seq));
        let x = MatMut::from_column_major_slice_mut(x, rows, 1);
        LltRef::new(&*self.pattern, &self.factor).solve_in_place_with_conj(Conj::No, x, Par::Seq, MemStack::new(&mut memory));
    }

    fn decomposed(&self, rate: f64) -> Result<Vec<f64>> {
        let mut values = self.matrix.values.clone();
        for (i, c) in self.capacity.iter().enumerate().filter(|_| rate != 0.0) {
            let (cols, first) = (self.matrix.row(i).0, self.matrix.starts[i]);
            if let Ok(at) = cols.binary_search(&(i as u32)) {
                values[first + at] += rate * c;
            }
        }
        let mut factor = vec![0.0; self.pattern.len_val()];
        let mut memory = MemBuffer::new(self.pattern.factorize_numeric_llt_scratch::<f64>(Par::Seq, Default::default()));
        let matrix = SparseColMatRef::new(shape(&self.matrix, &self.starts), &values);
        let stack = MemStack::new(&mut memory);
        let done =
            self.pattern.factorize_numeric_llt(&mut factor, matrix, Side::Lower, Default::default(), Par::Seq, stack, Default::default());
        done.map_err(|_| {
            Error::stopped(Stop::Singular, "the network's matrix is not positive definite")
                .help("some part has no path for its heat: connect it by a contact, or let it radiate to the chamber")
        })?;
        Ok(factor)
    }
}

/// Places of a matrix's entries; rows serve as columns, because the matrix is symmetric.
fn shape<'a>(matrix: &'a Csr, starts: &'a [u32]) -> SymbolicSparseColMatRef<'a, u32> {
    SymbolicSparseColMatRef::new_checked(matrix.rows(), matrix.columns, starts, None, &matrix.cols)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A chain of three, one end held: solved at each rate, and again at a rate of before.
    #[test]
    fn what_is_solved_gives_the_right_side_back() -> Result<()> {
        let (starts, cols) = (vec![0, 2, 5, 7], vec![0, 1, 0, 1, 2, 1, 2]);
        let chain = Csr { columns: 3, starts, cols, values: vec![3.0, -1.0, -1.0, 3.0, -2.0, -2.0, 2.0] };
        let (capacity, b) = ([1.0, 5.0, 2.0], [1.0, -2.0, 4.0]);
        let mut direct = Direct::new(chain.clone(), capacity.to_vec())?;
        assert!(Direct::within(chain.clone(), capacity.to_vec(), 1.0)?.is_none(), "a factor of this chain has five entries in three rows");
        for rate in [0.5, 40.0, 0.5, 0.0] {
            direct.shift(rate)?;
            let (mut x, mut back) = (b.to_vec(), vec![0.0; 3]);
            direct.solve(&mut x);
            chain.multiply(&x, &mut back);
            for i in 0..3 {
                assert!((back[i] + rate * capacity[i] * x[i] - b[i]).abs() < 1e-12, "rate {rate}: {x:?}");
            }
        }
        // Without anything held it has no steady state.
        let values = vec![1.0, -1.0, -1.0, 3.0, -2.0, -2.0, 1.9];
        assert!(Direct::new(Csr { values, ..chain }, capacity.to_vec()).is_err());
        Ok(())
    }
}
