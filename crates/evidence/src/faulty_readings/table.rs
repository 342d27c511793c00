//! Single wrong readings and wrong rows of steady tables: judged by the sensor's other rows and the row's other sensors.

use super::grid::{Grid, median, robust};
use super::signs::is_sign;
use super::{Fault, kelvin};
use crate::measurement::{Data, whiten};
use coldplate_base::units::celsius;

/// Least deviation of a wrong reading inside the range of the conditions: in standard deviations of the noise, and as a
/// multiple of any other deviation of its row and column. Chosen (docs/how-to/diagnose.md): smaller ones take effects of the machine
/// for faults.
const INSIDE: [f64; 2] = [30.0, 10.0];
/// Least deviation of a wrong reading at the edge of that range, in the same two measures. Chosen larger, because a cause may
/// act at one condition alone there.
const EDGE: [f64; 2] = [200.0, 30.0];
/// Largest deviation that is asked of a wrong reading at the edge, K. Chosen (docs/how-to/diagnose.md).
const PLAIN: f64 = 15.0;
/// Least deviation of the sign of a sensor that does not answer: as a multiple of any other deviation, and in standard
/// deviations of the noise. Chosen: the sign itself is evidence.
const SIGN: f64 = 3.0;
/// Least number of rows and of sensors for a judgement, count. Chosen: with fewer nothing stands out.
const LEAST: [usize; 2] = [3, 2];
/// Least number of rows for two wrong readings of one sensor, count. Chosen.
const LEAST_OF_PAIRS: usize = 6;
/// Least number of rows and of sensors for a row of wrong conditions, count. Chosen.
const LEAST_OF_ROWS: [usize; 2] = [6, 3];
/// Least deviation of a row of wrong conditions: in standard deviations of its sensors, and as a multiple of the next row's.
/// Chosen: smaller ones take effects of the machine for faults.
const ODD: [f64; 2] = [10.0, 3.0];

/// Least deviation of a suspect reading, which only the catalogue of causes can judge: in standard deviations of the noise, and
/// as a multiple of the others. Chosen (docs/how-to/diagnose.md): smaller ones cost fits.
const SUSPECT: [f64; 2] = [5.0, 3.0];
/// Least deviation of a suspect row: in standard deviations of its sensors, and as a multiple of the next row's. Chosen
/// (docs/how-to/diagnose.md).
const SUSPECT_ROW: [f64; 2] = [5.0, 2.0];
/// Least number of rows for suspects, count. Chosen.
const LEAST_OF_SUSPECTS: usize = 4;

/// Deviations of the residuals from the median of each sensor, K, by row and sensor.
fn deviations(sensors: usize, rows: usize, residual: impl Fn(usize, usize) -> Option<f64>) -> Vec<Vec<Option<f64>>> {
    let middle = |k: usize| median((0..rows).filter_map(|r| residual(r, k)).collect()).unwrap_or(0.0);
    let medians: Vec<f64> = (0..sensors).map(middle).collect();
    (0..rows).map(|r| medians.iter().enumerate().map(|(k, median)| Some(residual(r, k)? - median)).collect()).collect()
}

/// Readings off all others of their row and of their column. If there is none, two readings of one sensor that hide each other
/// are looked for.
pub(super) fn wrong_readings(grid: &Grid<'_>) -> Vec<Fault> {
    let judge = Judge::new(grid);
    let places: Vec<(usize, usize)> = (0..grid.data.names.len()).flat_map(|k| grid.rows_of(k).into_iter().map(move |r| (r, k))).collect();
    let mut wrong: Vec<(usize, usize)> = places.iter().copied().filter(|(r, k)| judge.is_wrong(&[*r], *k)).collect();
    if wrong.is_empty() {
        let largest = |k: usize| -> Option<(usize, Vec<usize>)> {
            let mut rows = grid.rows_of(k);
            rows.sort_by(|a, b| judge.off(*b, k).total_cmp(&judge.off(*a, k)));
            (rows.len() >= LEAST_OF_PAIRS).then(|| (k, rows[..2].to_vec()))
        };
        let pairs = (0..grid.data.names.len()).filter_map(largest).filter(|(k, rows)| judge.is_wrong(rows, *k));
        wrong = pairs.flat_map(|(k, rows)| rows.into_iter().map(move |r| (r, k))).collect();
    }
    wrong.into_iter().map(|(r, k)| judge.fault(r, k, "")).collect()
}

/// Suspect rows and readings of a table, which stand out by themselves without being wrong for certain: rows first, then
/// readings by decreasing deviation. `predicted` and `noise` as in [`super::find`].
pub fn suspects(data: &Data, predicted: &[f64], noise: &[f64]) -> Vec<Fault> {
    if data.is_transient() || data.rows.len() < LEAST_OF_SUSPECTS {
        return Vec::new();
    }
    let grid = Grid::new(data, predicted, noise);
    let judge = Judge::new(&grid);
    let mut out = whiten::places(data);
    out.retain(|(r, k)| judge.stands_out(*r, *k));
    let noises = |(r, k): &(usize, usize)| judge.off(*r, *k) / noise[*k];
    out.sort_by(|a, b| noises(b).total_cmp(&noises(a)));
    // A row is judged without the suspect readings. At the end of a range all sensors may show an effect that the machine has
    // nowhere else.
    let told = |(place, told): ((usize, usize), &f64)| (!out.contains(&place)).then_some(*told);
    let left: Vec<f64> = whiten::places(data).into_iter().zip(predicted).filter_map(told).collect();
    let mut others = data.clone();
    out.iter().for_each(|(r, k)| others.rows[*r].readings[*k] = None);
    let rows = oddest(&others, &left, noise).filter(|odd| odd.row.is_inside && odd.exceeds(SUSPECT_ROW)).map(|odd| {
        let odd = odd.row;
        let most = odd.off.iter().fold(0.0f64, |most, off| if off.abs() > most.abs() { *off } else { most });
        let words = format!(
            "all {} sensors are off what they show in other rows, the most by {most:+.1} K, as no cause makes them: the readings of other conditions",
            odd.sensors.len()
        );
        Fault::wrong_row(data, odd.row, words)
    });
    let readings = out.into_iter().map(|(r, k)| judge.fault(r, k, ", as no cause makes it"));
    rows.into_iter().chain(readings).collect()
}

/// Deviations of a table, and the tests of their size.
struct Judge<'a> {
    grid: &'a Grid<'a>,
    /// Deviation from the median of the sensor, K, by row and sensor.
    deviation: Vec<Vec<Option<f64>>>,
}

impl<'a> Judge<'a> {
    fn new(grid: &'a Grid<'a>) -> Self {
        let deviation = deviations(grid.data.names.len(), grid.data.rows.len(), |r, k| grid.residual(r, k));
        Self { grid, deviation }
    }

    /// Deviation of a reading from the median of its sensor, K.
    fn off(&self, row: usize, sensor: usize) -> f64 {
        self.deviation[row][sensor].map_or(0.0, f64::abs)
    }

    /// Whether a reading is off more than all but one other reading of its row and of its sensor.
    fn stands_out(&self, row: usize, sensor: usize) -> bool {
        let elsewhere = self.grid.rows_of(sensor).into_iter().filter(|r| *r != row).map(|r| self.off(r, sensor));
        let beside = (0..self.grid.data.names.len()).filter(|k| *k != sensor).map(|k| self.off(row, k));
        let mut others: Vec<f64> = elsewhere.chain(beside).collect();
        others.sort_by(|a, b| b.total_cmp(a));
        let next = others.get(1).copied().unwrap_or(f64::INFINITY);
        self.off(row, sensor) > (SUSPECT[0] * self.grid.noise[sensor]).max(SUSPECT[1] * next)
    }

    /// Fault of a reading that is off, in words.
    fn fault(&self, r: usize, k: usize, more: &str) -> Fault {
        let read = self.grid.read[r][k].map_or(f64::NAN, celsius);
        let words = format!("{read:.1} degC is {} off what its sensor and its row show elsewhere{more}", kelvin(self.off(r, k)));
        Fault::wrong_reading(self.grid.data, r, k, words)
    }

    /// Whether all of some readings of a sensor are off more than every other reading of their rows and of the sensor.
    fn is_wrong(&self, rows: &[usize], k: usize) -> bool {
        let grid = self.grid;
        let own = grid.rows_of(k);
        let is_edge = is_at_edge(grid.data, rows, &own);
        let elsewhere = own.iter().filter(|r| !rows.contains(r)).map(|r| self.off(*r, k)).fold(0.0, f64::max);
        rows.iter().all(|r| {
            let beside: Vec<f64> = (0..grid.data.names.len()).filter(|j| *j != k).filter_map(|j| self.deviation[*r][j]).collect();
            let (Some(read), Some(predicted)) = (grid.read[*r][k], grid.predicted[*r][k]) else { return false };
            if own.len() < LEAST[0] || beside.len() + 1 < LEAST[1] {
                return false;
            }
            let off = self.off(*r, k);
            let others = beside.iter().map(|v| v.abs()).fold(elsewhere, f64::max);
            if is_sign(read, predicted) {
                off > SIGN * others && off > SIGN * grid.noise[k]
            } else if is_edge {
                off > (EDGE[0] * grid.noise[k]).min(PLAIN.max(INSIDE[0] * grid.noise[k])) && off > EDGE[1] * others
            } else {
                off > INSIDE[0] * grid.noise[k] && off > INSIDE[1] * others
            }
        })
    }
}

/// Whether some of the rows alone have the least or the largest values of a variable that varies.
pub fn is_at_edge(data: &Data, chosen: &[usize], rows: &[usize]) -> bool {
    (0..data.rows[chosen[0]].condition.si().len()).any(|v| {
        let at = |r: usize| data.rows[r].condition.si()[v];
        let others = || rows.iter().filter(|r| !chosen.contains(r)).map(|r| at(*r));
        let (low, high) = (others().fold(f64::INFINITY, f64::min), others().fold(f64::NEG_INFINITY, f64::max));
        chosen.iter().all(|r| at(*r) < low) || chosen.iter().all(|r| at(*r) > high)
    })
}

/// A row whose sensors are all off, unlike those of any other row.
#[derive(Debug, Clone, PartialEq)]
pub struct OddRow {
    /// Index of the row, counted from 0.
    pub row: usize,
    /// Sensors read in it, as columns of the data.
    pub sensors: Vec<usize>,
    /// Residual of each of the row's sensors less the median of the sensor's residuals, K.
    pub off: Vec<f64>,
    /// Scatter of the residuals of each sensor in the other rows, K.
    pub scatter: Vec<f64>,
    /// Whether every stated condition lies between those of other rows, where an effect of the machine would show too.
    pub is_inside: bool,
}

impl OddRow {
    /// Root mean square of some deviations of the row's sensors (K) over their scatter.
    pub fn size(&self, off: &[f64]) -> f64 {
        let squares = off.iter().zip(&self.scatter).map(|(o, s)| (o / s).powi(2));
        (squares.sum::<f64>() / off.len().max(1) as f64).sqrt()
    }
}

/// The oddest row of a table, compared with the next.
struct Oddest {
    row: OddRow,
    /// Size of the oddest row, and of the next.
    sizes: [f64; 2],
}

impl Oddest {
    /// Whether the row exceeds a number of deviations, and a multiple of the next row.
    fn exceeds(&self, [far, times]: [f64; 2]) -> bool {
        self.row.sensors.len() >= LEAST_OF_ROWS[1] && self.sizes[0] > far && self.sizes[0] > times * self.sizes[1]
    }
}

/// The row of a steady table that is off unlike any other; `predicted` and `noise` as in [`super::find`].
pub fn odd_row(data: &Data, predicted: &[f64], noise: &[f64]) -> Option<OddRow> {
    if data.rows.len() < LEAST_OF_ROWS[0] {
        return None;
    }
    oddest(data, predicted, noise).filter(|odd| odd.exceeds(ODD)).map(|odd| odd.row)
}

fn oddest(data: &Data, predicted: &[f64], noise: &[f64]) -> Option<Oddest> {
    let (sensors, rows) = (data.names.len(), data.rows.len());
    if data.is_transient() || rows < LEAST_OF_SUSPECTS {
        return None;
    }
    let mut residual = vec![vec![None; sensors]; rows];
    for (((r, k), read), told) in whiten::places(data).into_iter().zip(whiten::readings(data)).zip(predicted) {
        residual[r][k] = Some(read - told);
    }
    let all = deviations(sensors, rows, |r, k| residual[r][k]);
    let scatter: Vec<f64> = (0..sensors).map(|k| robust((0..rows).filter_map(|r| all[r][k])).max(noise[k])).collect();
    let of = |r: usize| -> OddRow {
        let read: Vec<usize> = (0..sensors).filter(|k| all[r][*k].is_some()).collect();
        OddRow {
            row: r,
            off: read.iter().filter_map(|k| all[r][*k]).collect(),
            scatter: read.iter().map(|k| scatter[*k]).collect(),
            sensors: read,
            is_inside: !is_at_edge(data, &[r], &(0..rows).collect::<Vec<_>>()),
        }
    };
    let mut odd: Vec<(f64, OddRow)> = (0..rows).map(of).map(|row| (row.size(&row.off), row)).collect();
    odd.sort_by(|a, b| b.0.total_cmp(&a.0));
    let next = odd[1].0;
    let (size, row) = odd.swap_remove(0);
    Some(Oddest { row, sizes: [size, next] })
}
