//! Conjugate gradients for elastic structures, on two levels: a sweep of Gauss and Seidel before and after, and between
//! them the rigid motions of boxes of nodes, which sweeps hardly touch, solved by faer's sparse Cholesky decomposition.

use faer::Side;
use faer::linalg::solvers::SolveCore;
use faer::sparse::linalg::solvers::Llt;
use faer::sparse::{SparseColMat, Triplet};
use nalgebra::{SMatrix, Vector3};
use std::collections::HashMap;

use super::matrix::{Matrix, NodeVectors};
use coldplate_base::error::{Error, Result};

/// Relative residual aimed at, dimensionless. Chosen: digits of displacements against iterations.
const TOLERANCE: f64 = 1e-10;
/// Iterations after which a structure counts as not solvable, a count. Chosen.
const MOST: usize = 5000;
/// Share of the coarse diagonal that is added to it, dimensionless: boxes whose nodes lie on one line have no sixth motion. Chosen.
const SLACK: f64 = 1e-9;

/// Rigid motions of a node in its box: three along the axes, three about its centre.
type Motions = SMatrix<f64, 3, 6>;

/// A structure ready to be solved for any forces.
pub(crate) struct ElasticSolver {
    matrix: Matrix,
    /// Box of each node, and the rigid motions of that box at the node.
    motions: Vec<(u32, Motions)>,
    held: Vec<[bool; 3]>,
    boxes: usize,
    coarse: Llt<usize, f64>,
}

impl ElasticSolver {
    /// `boxes` says in which box each node is, `points` where it is (m); held directions take no part in rigid motions.
    ///
    /// # Errors
    /// The structure is not held.
    pub fn new(matrix: Matrix, boxes: &[u32], points: &[[f64; 3]], held: &[[bool; 3]]) -> Result<Self> {
        let count = boxes.iter().max().map_or(0, |most| *most as usize + 1);
        let mut centres = vec![(Vector3::zeros(), 0.0); count];
        for (own, point) in boxes.iter().zip(points) {
            let (sum, number) = &mut centres[*own as usize];
            *sum += Vector3::from(*point);
            *number += 1.0;
        }
        let centre = |own: u32| centres[own as usize].0 / centres[own as usize].1;
        let mut sizes = vec![0.0_f64; count];
        for (own, point) in boxes.iter().zip(points) {
            sizes[*own as usize] = sizes[*own as usize].max((Vector3::from(*point) - centre(*own)).norm());
        }
        let motion = |((own, point), held): ((&u32, &[f64; 3]), &[bool; 3])| {
            let size = sizes[*own as usize];
            let [x, y, z] = ((Vector3::from(*point) - centre(*own)) / if size > 0.0 { size } else { 1.0 }).into();
            #[rustfmt::skip]
            let free = Motions::from_row_slice(&[
                1.0, 0.0, 0.0, 0.0, z, -y,
                0.0, 1.0, 0.0, -z, 0.0, x,
                0.0, 0.0, 1.0, y, -x, 0.0,
            ]);
            (*own, Motions::from_fn(|i, j| if held[i] { 0.0 } else { free[(i, j)] }))
        };
        let motions: Vec<(u32, Motions)> = boxes.iter().zip(points).zip(held).map(motion).collect();
        let coarse = coarse(&matrix, &motions, count)?;
        Ok(Self { matrix, motions, held: held.to_vec(), boxes: count, coarse })
    }

    /// Number of nodes.
    pub fn len(&self) -> usize {
        self.held.len()
    }

    /// Removes forces in held directions, where supports bear them.
    pub fn free(&self, forces: &mut NodeVectors) {
        for (force, held) in forces.iter_mut().zip(&self.held) {
            (0..3).filter(|d| held[*d]).for_each(|d| force[d] = 0.0);
        }
    }

    /// Displacements (m) under forces (N); those of held directions are zero.
    ///
    /// # Errors
    /// The iteration does not converge.
    pub fn solve(&self, forces: &NodeVectors) -> Result<(NodeVectors, usize)> {
        let n = self.matrix.len();
        let zero = || vec![Vector3::zeros(); n];
        let (mut x, mut r, mut direction, mut image) = (zero(), forces.clone(), zero(), zero());
        let (mut z, mut left) = (zero(), zero());
        let aim = TOLERANCE * dot(forces, forces).sqrt();
        let mut last = 0.0;
        for iteration in 0..MOST {
            if dot(&r, &r).sqrt() <= aim {
                return Ok((x, iteration));
            }
            self.precondition(&r, &mut z, &mut left);
            let now = dot(&r, &z);
            let share = if iteration == 0 { 0.0 } else { now / last };
            last = now;
            direction.iter_mut().zip(&z).for_each(|(d, z)| *d = z + *d * share);
            self.matrix.multiply(&direction, &mut image);
            let step = now / dot(&direction, &image);
            if !(step.is_finite() && step > 0.0) {
                break;
            }
            x.iter_mut().zip(&direction).for_each(|(x, d)| *x += d * step);
            r.iter_mut().zip(&image).for_each(|(r, i)| *r -= i * step);
        }
        Err(Error::numerics("the displacements of the structure do not converge")
            .help("look for parts that are joined by very little, or use other cells"))
    }

    /// z = M r with a symmetric M near the inverse of the matrix.
    fn precondition(&self, r: &NodeVectors, z: &mut NodeVectors, left: &mut NodeVectors) {
        z.fill(Vector3::zeros());
        self.matrix.sweep(z, r, true);
        self.matrix.residual(z, r, left);
        let mut coarse = faer::Mat::zeros(6 * self.boxes, 1);
        for ((own, motions), left) in self.motions.iter().zip(left.iter()) {
            let pull = motions.transpose() * left;
            (0..6).for_each(|m| coarse[(6 * *own as usize + m, 0)] += pull[m]);
        }
        self.coarse.solve_in_place_with_conj(faer::Conj::No, coarse.as_mut());
        for ((own, motions), z) in self.motions.iter().zip(z.iter_mut()) {
            *z += motions * SMatrix::<f64, 6, 1>::from_fn(|m, _| coarse[(6 * *own as usize + m, 0)]);
        }
        self.matrix.sweep(z, r, false);
    }
}

/// The stiffness of rigid motions of boxes, decomposed.
fn coarse(matrix: &Matrix, motions: &[(u32, Motions)], boxes: usize) -> Result<Llt<usize, f64>> {
    let mut blocks: HashMap<(u32, u32), SMatrix<f64, 6, 6>> = HashMap::new();
    for (row, (own, motion)) in motions.iter().enumerate() {
        for (column, block) in matrix.row(row) {
            let (other, far) = &motions[column];
            if other <= own {
                *blocks.entry((*own, *other)).or_insert_with(SMatrix::zeros) += motion.transpose() * block * far;
            }
        }
    }
    let mut entries = Vec::with_capacity(36 * blocks.len());
    for ((own, other), block) in &blocks {
        for (i, j) in (0..36).map(|e| (e % 6, e / 6)).filter(|(i, j)| own != other || i >= j) {
            let value = block[(i, j)];
            let is_diagonal = own == other && i == j;
            let value = if is_diagonal && value <= 0.0 { 1.0 } else { value * if is_diagonal { 1.0 + SLACK } else { 1.0 } };
            entries.push(Triplet::new(6 * *own as usize + i, 6 * *other as usize + j, value));
        }
    }
    let failed = || Error::numerics("the structure is not held firmly enough to be solved").help("look at [support.NAME] and the joints");
    let small = SparseColMat::<usize, f64>::try_new_from_triplets(6 * boxes, 6 * boxes, &entries).map_err(|_| failed())?;
    small.sp_cholesky(Side::Lower).map_err(|_| failed())
}

fn dot(a: &NodeVectors, b: &NodeVectors) -> f64 {
    a.iter().zip(b).map(|(a, b)| a.dot(b)).sum()
}
