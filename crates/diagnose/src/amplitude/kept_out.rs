//! Predictions of rows that took no part: each row by causes as all other rows have them.

use super::response::Slope;
use super::search::{Fit, Search};
use crate::open_numbers::OpenNumber;

/// Changes of all readings (K), each by what all rows but its own say. A curve over few rows, or a number of its own in every row, says little of
/// a further one.
#[derive(Debug, Clone, PartialEq)]
pub struct KeptOut {
    /// By each cause.
    by_causes: Vec<Vec<f64>>,
    /// Changes by all causes together less the sum of those by each.
    together: Vec<f64>,
    /// By numbers of the file that may be off; none where there are no such numbers.
    pub by_numbers: Option<Vec<f64>>,
}

impl KeptOut {
    /// Changes by some of the causes.
    pub fn by(&self, is_chosen: &[bool]) -> Vec<f64> {
        let mut all = self.together.clone();
        for (own, _) in self.by_causes.iter().zip(is_chosen).filter(|(_, is_chosen)| **is_chosen) {
            all.iter_mut().zip(own).for_each(|(sum, change)| *sum += change);
        }
        all
    }
}

impl Search<'_> {
    /// Predictions of each row from all others by a fit; `None` where its covariance is not positive. Numbers of the file are columns among
    /// those that rows share about this fit.
    pub fn kept_out(&self, fit: &Fit, numbers: &[OpenNumber]) -> Option<KeptOut> {
        let linear = self.linear_about(fit);
        let explained = self.explained(&linear, fit.looseness, &self.followed(&fit.freedoms))?;
        let posterior = explained.posterior(&fit.freedoms, fit.looseness)?;
        let places: Vec<usize> = numbers.iter().flat_map(|number| number.places.iter().copied()).collect();
        let mut together: Vec<f64> = self.residual.iter().zip(&linear.residual).map(|(before, left)| before - left).collect();
        let mut by_causes = Vec::with_capacity(fit.members.len());
        for ((member, slope), own) in fit.members.iter().zip(&linear.slopes).zip(&fit.amplitudes) {
            let mut straight = vec![0.0; together.len()];
            slope.add_to(&mut straight, own, &self.errors.row_of);
            let (change, _) = self.candidates[*member].answer.at(own, &self.errors.row_of);
            let bend: Vec<f64> = change.iter().zip(&straight).map(|(change, straight)| change - straight).collect();
            together.iter_mut().zip(&bend).for_each(|(all, own)| *all -= own);
            by_causes.push(bend);
        }
        let mut by_numbers = vec![0.0; together.len()];
        let smooth = self.all_profiles.curves();
        for (row, without) in posterior.without_each_row(&places)?.iter().enumerate() {
            let readings = explained.readings(row);
            for (k, (member, slope)) in fit.members.iter().zip(&linear.slopes).enumerate() {
                let candidate = &self.candidates[*member];
                // An exchange of sensors is there or not: by a law it keeps its amplitude in a row that is kept out.
                let freedom = fit.freedoms[k];
                let is_law = freedom.freedom == 0.0 && freedom.curve.is_none_or(|(curve, _)| !smooth.contains(&curve));
                let is_given = candidate.is_fixed && is_law;
                let own = if is_given && self.is_log() { &fit.amplitudes[k] } else { &without.coefficients[k] };
                match slope {
                    Slope::OfRow(slope) => {
                        let said = || own.iter().zip(&linear.profiles.functions.row(row)).map(|(c, f)| c * f).sum::<f64>();
                        let amplitude = if is_given { fit.amplitudes[k][row] } else { said() };
                        let amplitude = amplitude.clamp(candidate.range.0, candidate.range.1);
                        readings.clone().for_each(|i| by_causes[k][i] += amplitude * slope[i]);
                    }
                    Slope::OfFunctions(columns) => {
                        for (c, column) in own.iter().zip(columns).filter(|(c, _)| **c != 0.0) {
                            readings.clone().for_each(|i| by_causes[k][i] += c * column[i]);
                        }
                    }
                }
            }
            let mut said = without.shared.iter();
            for number in numbers {
                let mean = said.by_ref().take(number.places.len()).sum::<f64>() / number.places.len() as f64;
                readings.clone().for_each(|i| by_numbers[i] += mean * number.column[i]);
            }
        }
        Some(KeptOut { by_causes, together, by_numbers: (!numbers.is_empty()).then_some(by_numbers) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn some_of_the_causes_change_less_than_all() {
        let kept_out = KeptOut { by_causes: vec![vec![1.0, 2.0], vec![10.0, 20.0]], together: vec![0.1, 0.2], by_numbers: None };
        assert_eq!(kept_out.by(&[true, true]), [11.1, 22.2]);
        assert_eq!(kept_out.by(&[true, false]), [1.1, 2.2]);
        let none = KeptOut { by_causes: Vec::new(), together: vec![0.0; 2], by_numbers: Some(vec![3.0, 4.0]) };
        assert_eq!(none.by(&[]), [0.0, 0.0]);
    }
}
