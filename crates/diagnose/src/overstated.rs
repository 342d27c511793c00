//! Noise of a table that is stated as larger than its residual can be: it hides what the readings show.
//!
//! A cause stands out of noise by how large the noise is, and a misfit far below the number of readings says that it is smaller. The machine
//! as it is may be wrong, and whatever is wrong adds to the misfit: the noise that is learnt is no smaller than it is.

use super::Problem;
use super::view::Comparison;
use coldplate_evidence::discrepancy::DiscrepancySize;
use coldplate_evidence::identify::chi_square_tail;

/// Shares of the stated noise that are tried: the smallest, and how many up to all of it. Where even the smallest is too large, shares of
/// that are, down to a last one.
pub const LEAST: f64 = 0.1;
const TRIED: usize = 31;
const LAST: f64 = 1e-4;
/// Of a larger share than this nothing else follows, and what was done with all of it stays.
const FAR: f64 = 0.85;
/// Of shares that suit alike, within one standard deviation, the largest is believed: few readings may lie close together by chance.
const WITHIN: f64 = 1.0;

/// The share of the stated noise that suits a residual (K, one per reading) which some causes were fitted to, where noise as stated would
/// leave a misfit as small in less than one of five hundred tables.
pub fn share(problem: &Problem, view: &Comparison, residual: &[f64], causes: usize) -> Option<f64> {
    if problem.data.is_transient() || problem.noise_share < 1.0 || residual.len() <= causes {
        return None;
    }
    let all: Vec<usize> = (0..residual.len()).collect();
    let at = |share: f64| -> (f64, f64) {
        let noise = view.errors.noise().iter().map(|noise| share * noise).collect();
        let whitener = view.errors.with_noise(noise).whitener(&DiscrepancySize::NONE, &all);
        let misfit = whitener.apply(residual).iter().map(|v| v * v).sum::<f64>();
        (misfit, misfit + whitener.log_determinant())
    };
    if 1.0 - chi_square_tail(at(1.0).0, residual.len() - causes) >= problem.settings.alarm {
        return None;
    }
    let mut all_of_it = 1.0;
    loop {
        let tried = (0..TRIED - 1).map(|k| all_of_it * (LEAST + (1.0 - LEAST) * k as f64 / (TRIED - 1) as f64));
        let tried: Vec<(f64, f64)> = tried.map(|share| (share, at(share).1)).collect();
        let least = tried.iter().map(|(_, deviance)| *deviance).min_by(f64::total_cmp)?;
        let (share, _) = tried.into_iter().rfind(|(_, deviance)| *deviance < least + WITHIN)?;
        all_of_it *= LEAST;
        if share > all_of_it || share < LAST {
            return Some(share).filter(|share| *share < FAR);
        }
    }
}
