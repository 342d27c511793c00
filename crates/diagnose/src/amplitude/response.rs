//! How the readings answer to an amplitude, however large: predictions at a few amplitudes, and cubics between them.
//!
//! A slope at zero does not know a factor of 0.4 or 30. The machine is solved at a few amplitudes of a cause in all rows; between them each
//! reading follows a natural cubic spline, and beyond them a straight line. So any amplitude in any row costs no further solve.

/// Changes of every reading at a few amplitudes.
#[derive(Debug, Clone)]
pub struct Response {
    /// Amplitudes, rising, in units of the kind's scale; zero among them.
    knots: Vec<f64>,
    /// Change of every reading at each of them, K.
    changes: Vec<Vec<f64>>,
    /// Second derivatives at the knots, K per square unit.
    bends: Vec<Vec<f64>>,
}

/// A straight answer, or one between knots.
#[derive(Debug, Clone)]
pub enum Answer {
    /// K for an amplitude of the kind's scale.
    Straight(Vec<f64>),
    /// A curve.
    Bent(Response),
    /// In logs, where a reading answers to all that was before: one of the above to the mean amplitude, and straight ones to functions of the
    /// rows, the constant first.
    InTime(Box<Answer>, Vec<Vec<f64>>),
}

/// Slopes of the readings in the amplitude of one cause, K per scale.
#[derive(Debug, Clone)]
pub enum Slope {
    /// In steady tables: each reading answers to the amplitude of its own row.
    OfRow(Vec<f64>),
    /// In logs: to each function of the rows.
    OfFunctions(Vec<Vec<f64>>),
}

/// The sum of some columns; none of none.
pub fn sum(columns: Vec<Vec<f64>>) -> Option<Vec<f64>> {
    columns.into_iter().reduce(|sum, own| sum.iter().zip(own).map(|(a, b)| a + b).collect())
}

/// Whether a change of the readings (K) is more than rounding.
pub fn shows(change: &[f64]) -> bool {
    change.iter().any(|c| c.abs() > 1e-9)
}

impl Response {
    /// From changes (K) at amplitudes that rise.
    pub fn new(knots: Vec<f64>, changes: Vec<Vec<f64>>) -> Self {
        let (n, readings) = (knots.len(), changes.first().map_or(0, Vec::len));
        let mut bends = vec![vec![0.0; readings]; n];
        if n > 2 {
            // Thomas' algorithm on the matrix that all readings share.
            let h: Vec<f64> = knots.windows(2).map(|pair| pair[1] - pair[0]).collect();
            let mut diagonal = vec![0.0; n];
            for k in 1..n - 1 {
                let right = |i: usize| 6.0 * ((changes[k + 1][i] - changes[k][i]) / h[k] - (changes[k][i] - changes[k - 1][i]) / h[k - 1]);
                let (factor, less) = if k > 1 { (h[k - 1] / diagonal[k - 1], h[k - 1]) } else { (0.0, 0.0) };
                diagonal[k] = 2.0 * (h[k - 1] + h[k]) - factor * less;
                let (before, own) = bends.split_at_mut(k);
                for (i, (bend, last)) in own[0].iter_mut().zip(&before[k - 1]).enumerate() {
                    *bend = right(i) - factor * last;
                }
            }
            for k in (1..n - 1).rev() {
                // The last one is zero: beyond the knots the spline is straight.
                let (own, after) = bends.split_at_mut(k + 1);
                for (bend, next) in own[k].iter_mut().zip(&after[0]) {
                    *bend = (*bend - h[k] * next) / diagonal[k];
                }
            }
        }
        Self { knots, changes, bends }
    }

    /// Change of a reading at an amplitude, K, and its slope, K per unit.
    fn at(&self, reading: usize, amplitude: f64) -> (f64, f64) {
        let last = self.knots.len() - 1;
        let within = amplitude.clamp(self.knots[0], self.knots[last]);
        let k = self.knots[1..last].iter().filter(|knot| **knot <= within).count();
        let h = self.knots[k + 1] - self.knots[k];
        let (a, b) = ((self.knots[k + 1] - within) / h, (within - self.knots[k]) / h);
        let (low, high) = (self.changes[k][reading], self.changes[k + 1][reading]);
        let (bend, next) = (self.bends[k][reading], self.bends[k + 1][reading]);
        let value = a * low + b * high + ((a.powi(3) - a) * bend + (b.powi(3) - b) * next) * h * h / 6.0;
        let slope = (high - low) / h + ((1.0 - 3.0 * a * a) * bend + (3.0 * b * b - 1.0) * next) * h / 6.0;
        (value + slope * (amplitude - within), slope)
    }
}

impl Answer {
    /// Change of every reading (K) at the amplitude of its row, and its slope, K per unit. In logs the amplitude is given by its coefficients.
    pub fn at(&self, amplitudes: &[f64], row_of: &[usize]) -> (Vec<f64>, Slope) {
        match self {
            Self::Straight(column) => {
                let change = column.iter().zip(row_of).map(|(c, row)| c * amplitudes[*row]).collect();
                (change, Slope::OfRow(column.clone()))
            }
            Self::Bent(response) => {
                let (change, slope) = (0..row_of.len()).map(|i| response.at(i, amplitudes[row_of[i]])).unzip();
                (change, Slope::OfRow(slope))
            }
            Self::InTime(mean, along) => {
                let (mut change, slope) = mean.at(&amplitudes[..1], &vec![0; row_of.len()]);
                for (c, column) in amplitudes.iter().zip(along).skip(1).filter(|(c, _)| **c != 0.0) {
                    change.iter_mut().zip(column).for_each(|(change, own)| *change += c * own);
                }
                let Slope::OfRow(slope) = slope else { return (change, slope) };
                (change, Slope::OfFunctions(std::iter::once(slope).chain(along.iter().skip(1).cloned()).collect()))
            }
        }
    }

    /// Whether it is straight at any amplitude.
    pub fn is_straight(&self) -> bool {
        match self {
            Self::Straight(_) => true,
            Self::Bent(_) => false,
            Self::InTime(mean, _) => mean.is_straight(),
        }
    }

    /// Amplitudes about which the answer is known, in units of the kind's scale.
    pub fn knots(&self) -> &[f64] {
        match self {
            Self::Straight(_) => &[0.0],
            Self::Bent(response) => &response.knots,
            Self::InTime(mean, _) => mean.knots(),
        }
    }
}

impl Slope {
    /// Another column in place of each.
    pub fn map(self, of: impl Fn(&[f64]) -> Vec<f64>) -> Self {
        match self {
            Self::OfRow(slope) => Self::OfRow(of(&slope)),
            Self::OfFunctions(columns) => Self::OfFunctions(columns.iter().map(|column| of(column)).collect()),
        }
    }

    /// Adds the slope times amplitudes, in logs coefficients, to readings, K.
    pub fn add_to(&self, readings: &mut [f64], amplitudes: &[f64], row_of: &[usize]) {
        match self {
            Self::OfRow(slope) => readings.iter_mut().enumerate().for_each(|(i, r)| *r += slope[i] * amplitudes[row_of[i]]),
            Self::OfFunctions(columns) => {
                for (column, c) in columns.iter().zip(amplitudes).filter(|(_, c)| **c != 0.0) {
                    readings.iter_mut().zip(column).for_each(|(r, own)| *r += c * own);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A saturating answer, as that of a contact: within a hundredth of its range between knots, exact at them, and straight beyond.
    #[test]
    fn follows_an_answer_that_saturates() {
        let of = |a: f64| [10.0 / (1.0 + a.exp()) - 5.0, 2.0 * a];
        let knots = vec![-4.0, -2.0, -1.0, 0.0, 1.0, 2.0, 4.0];
        let answer = Answer::Bent(Response::new(knots.clone(), knots.iter().map(|a| of(*a).to_vec()).collect()));
        for a in [-4.0, -3.0, -1.4, -0.3, 0.0, 0.7, 1.0, 3.1] {
            let (change, slope) = answer.at(&[a], &[0, 0]);
            let Slope::OfRow(slope) = slope else { panic!("a slope for each row") };
            let [bent, straight] = of(a);
            assert!((change[0] - bent).abs() < 0.1 && (change[1] - straight).abs() < 1e-12, "{a}: {change:?}");
            let (more, _) = answer.at(&[a + 1e-6], &[0, 0]);
            assert!(((more[0] - change[0]) / 1e-6 - slope[0]).abs() < 1e-4, "{a}: slope {}", slope[0]);
        }
        let ((at, Slope::OfRow(slope)), (beyond, _)) = (answer.at(&[4.0], &[0, 0]), answer.at(&[6.0], &[0, 0])) else {
            panic!("a slope for each row")
        };
        assert!((at[0] + 2.0 * slope[0] - beyond[0]).abs() < 1e-12);
    }
}
