//! How an amplitude may run over the rows of a table: alike in all, smooth over one variable, and new in every row.

use nalgebra::{DMatrix, DVector, SymmetricEigen};

use crate::low_rank::low_rank;

/// Lengths over which a smooth amplitude changes, in standard deviations of its variable over the rows. Chosen on functions in closed form
/// (powers, a root, an exponential that falls within a sixth of the range, a saturation, a hump), known to 1 %: the first has the most evidence
/// for all but the hump, which the second follows. Shorter ones are the amplitude that is new in every row.
pub const LENGTHS: [f64; 2] = [2.0, 0.7];
/// Directions of a smooth amplitude with less than this share of its largest variance are left out. Chosen: an amplitude of its kind's scale
/// is then followed to 2 %, as those functions ask for; ten times more costs their evidence 3 to 8.
const LEAST_VARIANCE: f64 = 3e-4;
/// Values closer than this share of a variable's standard deviation are one.
const ALIKE: f64 = 1e-9;

/// A smooth run over one variable, by the variable and its length's place in [`LENGTHS`].
pub type Curve = (usize, usize);

/// Kind of a function of the rows.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Function {
    /// Alike in all.
    Constant,
    /// In proportion to a variable, less its mean.
    Linear(usize),
    /// A law of the time of a log, which is counted behind the variables.
    When(usize),
    /// One of those of a smooth amplitude.
    Smooth(Curve),
}

/// Functions of the rows: the constant first, then those of a smooth amplitude over each variable. In logs those in proportion to each
/// variable and the laws of the time, then those of a smooth amplitude over the time and over each variable.
#[derive(Debug, Clone)]
pub struct Profiles {
    /// Rows times functions; of unit prior variance each.
    pub functions: DMatrix<f64>,
    /// What each function is.
    pub of: Vec<Function>,
    /// The variable that is the time of a log.
    pub time: Option<usize>,
    /// Laws of the time of a log that set in at an instant, by time.
    pub instants: Vec<usize>,
    /// How many functions every cause is screened by in a log: the constant, laws, and slow ones of the time.
    pub screened: usize,
}

/// Correlation of a smooth amplitude at two values so many lengths apart: Matérn's with two derivatives (Rasmussen and Williams, Gaussian
/// Processes for Machine Learning, MIT Press 2006, eq. 4.17). One with all derivatives would know a curve from a piece of it.
pub fn near(apart: f64) -> f64 {
    let r = 5f64.sqrt() * apart.abs();
    (1.0 + r + r * r / 3.0) * (-r).exp()
}

/// Standard deviation of a variable over the rows.
fn deviation(values: &[f64]) -> f64 {
    let n = values.len().max(1) as f64;
    let mean = values.iter().sum::<f64>() / n;
    (values.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / n).sqrt()
}

impl Profiles {
    /// The constant alone.
    pub fn constant(rows: usize) -> Self {
        Self { functions: DMatrix::from_element(rows, 1, 1.0), of: vec![Function::Constant], time: None, instants: Vec::new(), screened: 1 }
    }

    /// Of the rows of a log, by the values of some variables in them, of which the last is the time: the constant, what is in proportion to
    /// each of the others, laws of the time by their factors in the rows, and smooth functions of the time and of each of the others. Means and
    /// deviations are those of the rows that `counts`.
    pub fn of_log(variables: &[Vec<f64>], when: &[Vec<f64>], counts: &[usize]) -> Self {
        let rows = variables.last().map_or(0, Vec::len);
        let n = counts.len().max(1) as f64;
        let centred = |values: &[f64]| {
            let mean = counts.iter().map(|r| values[*r]).sum::<f64>() / n;
            values.iter().map(|x| x - mean).collect::<Vec<f64>>()
        };
        let standardised = |values: &Vec<f64>| {
            let mut centred = centred(values);
            let deviation = (counts.iter().map(|r| centred[*r].powi(2)).sum::<f64>() / n).sqrt();
            centred.iter_mut().for_each(|x| *x /= deviation.max(f64::MIN_POSITIVE));
            centred
        };
        let all: Vec<Vec<f64>> = variables.iter().map(standardised).collect();
        let time = all.len().saturating_sub(1);
        let mut columns = vec![vec![1.0; rows]];
        let mut of = vec![Function::Constant];
        for (v, values) in all.iter().enumerate().take(time) {
            columns.push(values.clone());
            of.push(Function::Linear(v));
        }
        for (law, factors) in when.iter().enumerate() {
            columns.push(factors.clone());
            of.push(Function::When(all.len() + law));
        }
        let mut screened = 0;
        // The slow ones of the time first.
        let varies = |v: &usize| all[*v].iter().any(|x| *x != all[*v][0]);
        let curves = std::iter::once(time).chain((0..time).filter(varies)).flat_map(|v| (0..LENGTHS.len()).map(move |place| (v, place)));
        for (v, place) in curves {
            let kernel = |j: usize| (0..rows).map(|i| near((all[v][i] - all[v][j]) / LENGTHS[place])).collect();
            for column in low_rank(vec![1.0; rows], kernel, LEAST_VARIANCE) {
                columns.push(centred(&column));
                of.push(Function::Smooth((v, place)));
            }
            screened = if (v, place) == (time, 0) { columns.len() } else { screened };
        }
        let columns: Vec<DVector<f64>> = columns.into_iter().map(DVector::from_vec).collect();
        Self { functions: DMatrix::from_columns(&columns), of, time: Some(time), instants: Vec::new(), screened }
    }

    /// Those of some rows alone.
    pub fn in_rows(&self, rows: &[usize]) -> Self {
        Self { functions: self.functions.select_rows(rows), ..self.clone() }
    }

    /// The first functions alone.
    pub fn first(&self, count: usize) -> Self {
        Self { functions: self.functions.columns(0, count).into_owned(), of: self.of[..count].to_vec(), ..self.clone() }
    }

    /// With smooth functions of each of some variables, given by their values in the rows: variables that do not vary have none.
    pub fn smooth(rows: usize, variables: &[Vec<f64>]) -> Self {
        let mut columns = vec![DVector::from_element(rows, 1.0)];
        let mut of = vec![Function::Constant];
        for (v, values) in variables.iter().enumerate() {
            let n = rows.max(1) as f64;
            let (mean, deviation) = (values.iter().sum::<f64>() / n, deviation(values));
            if deviation <= ALIKE * mean.abs() || deviation == 0.0 {
                continue;
            }
            for (place, length) in LENGTHS.iter().enumerate() {
                let near = |i: usize, j: usize| near((values[i] - values[j]) / (length * deviation));
                let kernel = DMatrix::from_fn(rows, rows, near);
                // The constant is a function of its own.
                let means: Vec<f64> = kernel.column_iter().map(|column| column.mean()).collect();
                let all = means.iter().sum::<f64>() / n;
                let centred = DMatrix::from_fn(rows, rows, |i, j| kernel[(i, j)] - means[i] - means[j] + all);
                let eigen = SymmetricEigen::new(centred);
                let largest = eigen.eigenvalues.max();
                for (value, vector) in eigen.eigenvalues.iter().zip(eigen.eigenvectors.column_iter()) {
                    if *value > LEAST_VARIANCE * largest {
                        columns.push(vector * value.sqrt());
                        of.push(Function::Smooth((v, place)));
                    }
                }
            }
        }
        Self { functions: DMatrix::from_columns(&columns), screened: of.len(), of, time: None, instants: Vec::new() }
    }

    /// With further functions, which belong to curves of variables beyond these.
    pub fn with_laws<'a>(&self, laws: impl Iterator<Item = (Curve, &'a [f64])>) -> Self {
        let mut columns: Vec<DVector<f64>> = self.functions.column_iter().map(|column| column.into_owned()).collect();
        let mut of = self.of.clone();
        for (curve, factors) in laws {
            columns.push(DVector::from_column_slice(factors));
            of.push(Function::Smooth(curve));
        }
        Self { functions: DMatrix::from_columns(&columns), of, ..self.clone() }
    }

    /// The smooth part of some amplitudes along a curve, at other values of its variable than those in the rows.
    pub fn continued(&self, curve: Curve, values: &[f64], amplitudes: &[f64], at: &[f64]) -> Vec<f64> {
        let n = values.len().max(1) as f64;
        let mean = amplitudes.iter().sum::<f64>() / n;
        let own = DVector::from_column_slice(amplitudes);
        // Weights of the centred kernels of the rows: each function is an eigenvector times the root of its eigenvalue.
        let mut weights = DVector::zeros(values.len());
        for (f, _) in self.of.iter().enumerate().filter(|(_, of)| **of == Function::Smooth(curve)) {
            let function = self.functions.column(f);
            let variance = function.norm_squared();
            weights.axpy(function.dot(&own) / (variance * variance), &function, 1.0);
        }
        let scale = LENGTHS[curve.1] * deviation(values);
        let near = |a: f64, b: f64| near((a - b) / scale);
        let mean_near: Vec<f64> = values.iter().map(|a| values.iter().map(|b| near(*a, *b)).sum::<f64>() / n).collect();
        let all = mean_near.iter().sum::<f64>() / n;
        let value = |x: &f64| {
            let own = values.iter().map(|b| near(*x, *b)).sum::<f64>() / n;
            let kernel = values.iter().zip(&mean_near).map(|(b, mean)| near(*x, *b) - own - mean + all);
            mean + kernel.zip(&weights).map(|(kernel, weight)| kernel * weight).sum::<f64>()
        };
        at.iter().map(value).collect()
    }

    /// All curves.
    pub fn curves(&self) -> Vec<Curve> {
        let curve = |f: &Function| if let Function::Smooth(curve) = f { Some(*curve) } else { None };
        let mut all: Vec<Curve> = self.of.iter().filter_map(curve).collect();
        all.dedup();
        all
    }

    /// Laws that an amplitude may follow: variables that it is in proportion to, and laws of the time.
    pub fn laws(&self) -> Vec<usize> {
        self.of.iter().filter_map(|f| if let Function::Linear(law) | Function::When(law) = f { Some(*law) } else { None }).collect()
    }

    /// Whether two laws set in at instants that are next to each other.
    pub fn are_next(&self, a: usize, b: usize) -> bool {
        self.instants.windows(2).any(|pair| pair == [a.min(b), a.max(b)])
    }

    /// Whether a law is one of the time.
    pub fn is_when(&self, law: usize) -> bool {
        self.of.contains(&Function::When(law))
    }

    /// An amplitude in every row, by its coefficients.
    pub fn course(&self, coefficients: &[f64]) -> Vec<f64> {
        let mut course = DVector::zeros(self.functions.nrows());
        for (c, column) in coefficients.iter().zip(self.functions.column_iter()).filter(|(c, _)| **c != 0.0) {
            course.axpy(*c, &column, 1.0);
        }
        course.data.into()
    }
}
