//! How far an iteration to a fixed point goes of each step.

/// Least share of a step that is taken. Chosen: ten iterations of a smaller share would move nothing.
const LEAST_SHARE: f64 = 0.05;

/// Dynamic relaxation by Aitken's rule for vectors (Irons and Tuck, "A version of the Aitken accelerator for computer iteration", 1969): the
/// share of a step under which the last two steps would have met. An iteration that goes to and fro takes smaller shares; none goes beyond
/// the whole step.
#[derive(Debug, Default)]
pub struct Relaxation {
    /// Share and whole step of the last iteration.
    last: Option<(f64, Vec<f64>)>,
}

impl Relaxation {
    /// Share of a step that is taken, from 0.05 to 1.
    pub fn share(&mut self, step: Vec<f64>) -> f64 {
        let share = match &self.last {
            None => 1.0,
            Some((share, last)) => {
                let change = || step.iter().zip(last).map(|(now, then)| now - then);
                let along: f64 = change().zip(last).map(|(c, then)| c * then).sum();
                let square: f64 = change().map(|c| c * c).sum();
                let met = if square > 0.0 { -share * along / square } else { 1.0 };
                // Steps that grow on their way have not come near yet.
                if met > 0.0 { met.clamp(LEAST_SHARE, 1.0) } else { 1.0 }
            }
        };
        self.last = Some((share, step));
        share
    }
}

#[cfg(test)]
mod tests {
    use super::Relaxation;

    /// Iterations until x = f(x) stands to a millionth.
    fn iterations(f: impl Fn(f64) -> f64) -> usize {
        let (mut x, mut relaxation) = (0.0, Relaxation::default());
        for count in 1..100 {
            let step: f64 = f(x) - x;
            if step.abs() < 1e-6 {
                return count;
            }
            x += relaxation.share(vec![step]) * step;
        }
        100
    }

    #[test]
    fn what_goes_to_and_fro_comes_to_rest() {
        assert!(iterations(|x| 1.0 - x) <= 3);
        assert!(iterations(|x| 1.0 - 3.0 * x) <= 4);
        assert!(iterations(|x| (2.0 - 2.0 * x).tanh()) <= 10);
    }

    #[test]
    fn what_comes_to_rest_by_itself_is_no_slower() {
        assert!(iterations(|x| 1.0 + 0.3 * x) <= 13);
    }
}
