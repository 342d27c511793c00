//! Signs of sensors that are not connected or do not answer.

use super::grid::Grid;
use super::{Fault, FaultKind};
use coldplate_base::units::celsius;

/// Values that digital sensors and scanners show if nothing is read, degC. Chosen: more values find more dead sensors and
/// mistake more readings.
const SIGNS: [f64; 3] = [0.0, 85.0, 999.0];
/// Largest distance of a reading from such a sign, K. Chosen: a larger one takes readings for signs.
const SAME: f64 = 5e-3;
/// Least distance of such a sign from the prediction, K. Chosen: some machines are at 0 or 85 degC.
pub(super) const ABSURD: f64 = 10.0;

/// Whether a temperature (K) is the sign of no reading, while `predicted` (K) is far from it.
pub(super) fn is_sign(kelvin: f64, predicted: f64) -> bool {
    SIGNS.iter().any(|sign| (celsius(kelvin) - sign).abs() < SAME) && (kelvin - predicted).abs() > ABSURD
}

/// Sensors that show nothing but the sign of no reading.
pub(super) fn dead(grid: &Grid<'_>) -> Vec<Fault> {
    let of = |k: usize| -> Option<Fault> {
        let rows = grid.rows_of(k);
        let is_dead = |r: &usize| grid.read[*r][k].zip(grid.predicted[*r][k]).is_some_and(|(read, told)| is_sign(read, told));
        if rows.len() < 2 || !rows.iter().all(is_dead) {
            return None;
        }
        let words = format!("dead, {:.1} degC in all {} readings", celsius(grid.read[rows[0]][k]?), rows.len());
        Some(Fault::new(grid.data, FaultKind::DeadSensor, rows.iter().map(|r| (*r, k)).collect(), Some(k), words))
    };
    (0..grid.data.names.len()).filter_map(of).collect()
}
