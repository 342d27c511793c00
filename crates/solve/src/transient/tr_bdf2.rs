//! Coefficients of TR-BDF2 (Bank et al., IEEE Trans. Electron Devices 32 (1985) 1992; Hosea and Shampine, Applied Numerical
//! Mathematics 20 (1996) 21): a step by the trapezoidal rule to a share of its length, then one by the second backward difference.

/// End of the first stage, as a share of the step: 2 - sqrt 2.
pub const GAMMA: f64 = 0.585_786_437_626_905;
/// Weight of each stage's own heat flow, dimensionless: gamma / 2 in both.
pub const OWN: f64 = GAMMA / 2.0;
/// Weights of the first two heat flows in the whole step, dimensionless: sqrt 2 / 4.
pub const EARLIER: f64 = std::f64::consts::SQRT_2 / 4.0;
/// Constant of the local error h³ T''', dimensionless: (3 gamma² - 4 gamma + 2) / (12 (2 - gamma)).
pub const LOCAL_ERROR: f64 = 0.040_440_114_519_881;

/// Weights of the three states of a step at a share of its length.
pub fn parabola(share: f64) -> [f64; 3] {
    let (behind, ahead) = (share - GAMMA, share - 1.0);
    [behind * ahead / GAMMA, share * ahead / (GAMMA * (GAMMA - 1.0)), share * behind / (1.0 - GAMMA)]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Exact for a parabola, anywhere in the step.
    #[test]
    fn a_parabola_through_three_states_is_that_parabola() {
        let course = |share: f64| 3.0 - 2.0 * share + 5.0 * share * share;
        for share in [0.0, 0.2, GAMMA, 0.9, 1.0] {
            let [begin, between, end] = parabola(share);
            let read = begin * course(0.0) + between * course(GAMMA) + end * course(1.0);
            assert!((read - course(share)).abs() < 1e-14, "{share}: {read}");
        }
    }
}
