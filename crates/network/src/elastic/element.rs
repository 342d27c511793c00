//! The eight-node brick with incompatible modes (Wilson, Taylor, Doherty and Ghaboussi 1973, with the correction of Taylor,
//! Beresford and Wilson, Int. J. Numer. Meth. Eng. 10 (1976) 1211, so that constant strain is exact in any shape). Three
//! quadratic modes within the brick let it bend: trilinear displacements alone would lock in thin walls.

use nalgebra::{Matrix3, SMatrix, SVector, Vector3};

use coldplate_base::error::{Error, Result};

/// Corners of a brick: the first local axis counts fastest.
pub(crate) type Corners = [[f64; 3]; 8];

/// Stiffness of a brick, N/m, by corner and axis; condensed, so that its inner modes do not show.
pub(crate) type Stiffness = SMatrix<f64, 24, 24>;
/// Force of a brick's expansion against its neighbours, N/K: by corner and axis, for a warmer corner each.
pub(crate) type Expansion = SMatrix<f64, 24, 8>;

type Inner = SMatrix<f64, 9, 9>;
type Strain = SMatrix<f64, 6, 24>;
type InnerStrain = SMatrix<f64, 6, 9>;

/// Elastic and thermal constants of a solid.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct ElasticConstants {
    /// Young's modulus, Pa.
    pub modulus: f64,
    /// Poisson's ratio.
    pub poisson: f64,
    /// Coefficient of linear thermal expansion, 1/K.
    pub expansion: f64,
}

impl ElasticConstants {
    /// Stress of unit strains (xx, yy, zz, xy, yz, zx), Pa.
    fn stress(&self) -> SMatrix<f64, 6, 6> {
        let (shear, lame) = (self.modulus / 2.0 / (1.0 + self.poisson), self.lame());
        SMatrix::from_fn(|i, j| match (i < 3, j < 3) {
            (true, true) => lame + if i == j { 2.0 * shear } else { 0.0 },
            (false, false) if i == j => shear,
            _ => 0.0,
        })
    }

    fn lame(&self) -> f64 {
        self.modulus * self.poisson / (1.0 + self.poisson) / (1.0 - 2.0 * self.poisson)
    }
}

/// Coordinates of corner `i` in the brick's own axes, -1 or 1.
pub fn corner(i: usize) -> [f64; 3] {
    [i & 1, i >> 1 & 1, i >> 2 & 1].map(|high| if high == 1 { 1.0 } else { -1.0 })
}

/// Shape functions at a point of the brick's own axes.
pub fn shapes(at: [f64; 3]) -> [f64; 8] {
    std::array::from_fn(|i| (0..3).map(|d| (1.0 + corner(i)[d] * at[d]) / 2.0).product())
}

/// Derivatives of the shape functions along the brick's own axes.
fn slopes(at: [f64; 3]) -> [[f64; 3]; 8] {
    std::array::from_fn(|i| {
        let own = corner(i);
        let share = |d: usize| (1.0 + own[d] * at[d]) / 2.0;
        [own[0] / 2.0 * share(1) * share(2), own[1] / 2.0 * share(0) * share(2), own[2] / 2.0 * share(0) * share(1)]
    })
}

/// Derivatives of the machine's coordinates along the brick's own axes. Rows: own axes; columns: machine axes.
fn jacobian(corners: &Corners, at: [f64; 3]) -> Matrix3<f64> {
    let slopes = slopes(at);
    Matrix3::from_fn(|own, d| (0..8).map(|i| slopes[i][own] * corners[i][d]).sum())
}

/// The point of the brick's own axes that lies at a point of the machine (m), by Newton's method; a little outside too.
pub fn locate(corners: &Corners, point: [f64; 3]) -> [f64; 3] {
    let mut at = Vector3::zeros();
    for _ in 0..20 {
        let shapes = shapes(at.into());
        let off = Vector3::from_fn(|d, _| point[d] - (0..8).map(|i| shapes[i] * corners[i][d]).sum::<f64>());
        let Some(inverse) = jacobian(corners, at.into()).transpose().try_inverse() else { break };
        let step = inverse * off;
        at = (at + step).map(|x| x.clamp(-1.5, 1.5));
        if step.amax() < 1e-13 {
            break;
        }
    }
    at.into()
}

/// Columns of strain for a displacement along each of the machine's axes, from the slope of its shape function.
fn strain_of<const N: usize>(columns: &mut SMatrix<f64, 6, N>, first: usize, slope: Vector3<f64>) {
    let [x, y, z] = slope.into();
    for (axis, column) in [[x, 0.0, 0.0, y, 0.0, z], [0.0, y, 0.0, x, z, 0.0], [0.0, 0.0, z, 0.0, y, x]].into_iter().enumerate() {
        columns.set_column(first + axis, &SVector::from(column));
    }
}

/// Stiffness and expansion of a brick.
///
/// # Errors
/// The brick is flat or inside out.
pub fn brick(corners: &Corners, solid: &ElasticConstants) -> Result<(Stiffness, Expansion)> {
    let flat = || Error::numerics("a cell has no volume").help("check the sizes of the blocks, or use fewer cells");
    let middle = jacobian(corners, [0.0; 3]);
    let (middle_volume, middle_inverse) = (middle.determinant(), middle.try_inverse().ok_or_else(flat)?);
    let stress = solid.stress();
    let pressure = (3.0 * solid.lame() + solid.modulus / (1.0 + solid.poisson)) * solid.expansion;
    let uniform = SVector::<f64, 6>::from([pressure, pressure, pressure, 0.0, 0.0, 0.0]);
    let (mut outer, mut inner, mut across) = (Stiffness::zeros(), Inner::zeros(), SMatrix::<f64, 9, 24>::zeros());
    let (mut load, mut inner_load) = (Expansion::zeros(), SMatrix::<f64, 9, 8>::zeros());
    for i in 0..8 {
        let at = corner(i).map(|x| x / f64::sqrt(3.0));
        let own = jacobian(corners, at);
        let volume = own.determinant();
        let inverse = own.try_inverse().filter(|_| volume > 0.0).ok_or_else(flat)?;
        let (mut strain, mut inner_strain) = (Strain::zeros(), InnerStrain::zeros());
        for (corner, slope) in slopes(at).into_iter().enumerate() {
            strain_of(&mut strain, 3 * corner, inverse * Vector3::from(slope));
        }
        // Modes 1 - t², one along each own axis; the correction makes their mean slope zero.
        for (axis, own) in at.into_iter().enumerate() {
            let slope = middle_inverse.column(axis) * (-2.0 * own * middle_volume / volume);
            strain_of(&mut inner_strain, 3 * axis, slope);
        }
        let (stressed, inner_stressed) = (stress * strain * volume, stress * inner_strain * volume);
        outer += strain.transpose() * stressed;
        across += inner_strain.transpose() * stressed;
        inner += inner_strain.transpose() * inner_stressed;
        let shares = SMatrix::<f64, 1, 8>::from(shapes(at)) * volume;
        load += strain.transpose() * uniform * shares;
        inner_load += inner_strain.transpose() * uniform * shares;
    }
    let inner = inner.cholesky().ok_or_else(flat)?;
    let condensed = inner.solve(&across);
    Ok((outer - across.transpose() * condensed, load - condensed.transpose() * inner_load))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A steel for the tests.
    const STEEL: ElasticConstants = ElasticConstants { modulus: 210e9, poisson: 0.3, expansion: 12e-6 };

    /// A brick of no particular shape.
    fn crooked() -> Corners {
        std::array::from_fn(|i| {
            let [x, y, z] = corner(i);
            [0.02 * x + 0.003 * y * z, 0.03 * y + 0.002 * x - 0.004 * z * x * y, 0.01 * z + 0.002 * x * y]
        })
    }

    /// Rigid motions cost no force; a uniform temperature is met by u = alpha T x without any stress.
    #[test]
    fn moves_freely_and_expands_freely() {
        let corners = crooked();
        let (stiffness, expansion) = brick(&corners, &STEEL).unwrap();
        let of = |motion: &dyn Fn([f64; 3]) -> [f64; 3]| SVector::<f64, 24>::from_fn(|i, _| motion(corners[i / 3])[i % 3]);
        for motion in [|_: [f64; 3]| [1.0, 0.0, 0.0], |x: [f64; 3]| [-x[1], x[0], 0.0], |x: [f64; 3]| [0.0, -x[2], x[1]]] {
            let (motion, scale) = (of(&motion), stiffness.amax());
            assert!((stiffness * motion).amax() < 1e-12 * scale);
        }
        let free = of(&|x| x.map(|x| 12e-6 * x));
        let forces = expansion * SVector::<f64, 8>::repeat(1.0);
        assert!((stiffness * free - forces).amax() < 1e-11 * forces.amax());
    }

    #[test]
    fn finds_its_points_again() {
        let corners = crooked();
        let at = [0.3, -0.7, 0.9];
        let point: [f64; 3] = std::array::from_fn(|d| (0..8).map(|i| shapes(at)[i] * corners[i][d]).sum());
        let found = locate(&corners, point);
        assert!((0..3).all(|d| (found[d] - at[d]).abs() < 1e-10), "{found:?}");
    }
}
