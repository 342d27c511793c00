//! Choice of the lines of cells where more cells lower the errors most.

use super::trial::{CellLine, Counts, cells};

/// Order at which a line's share in the errors is taken to fall with its number of cells, dimensionless. Chosen between the first and
/// second order that trials believe.
pub(super) const ORDER: f64 = 1.5;
/// Largest factor on the cells of a line in one round, either way, dimensionless. Chosen: rounds against overshoot.
const MOST: f64 = 2.0;
/// Largest factor by which one round means to lower the errors, dimensionless. Chosen: with more, lines that hardly matter would grow
/// too.
const FALL: f64 = 2.0;
/// Share of the cells of a line by which they grow at once, dimensionless. Chosen: fineness of the choice against its length.
const STEP: f64 = 0.25;

/// A line of cells with its share in the errors of all readings.
#[derive(Debug, Clone)]
pub(super) struct Share {
    pub line: CellLine,
    /// Error that the line's cells leave in every reading, over the accuracy.
    pub open: Vec<f64>,
    /// Fewest cells that the line may have; a number that was too small in an earlier round is the bound.
    pub least: usize,
}

impl Share {
    /// Largest error in any reading, over the accuracy.
    pub(super) fn largest(&self) -> f64 {
        self.open.iter().fold(0.0, |m: f64, e| m.max(e.abs()))
    }

    /// Updates the share for `factor` times as many cells along the line.
    fn scaled(&mut self, factor: f64) {
        let shrink = factor.powf(-ORDER);
        self.open.iter_mut().for_each(|open| *open *= shrink);
    }
}

/// Sum of the squares of all shares in every reading.
fn squares(shares: &[Share], readings: usize) -> Vec<f64> {
    (0..readings).map(|f| shares.iter().map(|s| s.open[f] * s.open[f]).sum()).collect()
}

/// Cells along all lines that bring the errors down to `aim` (over the accuracy), or by [`FALL`]. `whole` is the error in every reading
/// with all lines together; the shares say which lines it comes from. If lines may shrink, all start coarser; then cells go to the line
/// that lowers the excess over the aim most per added cell. The shares are brought up to date.
pub(super) fn refined(counts: &Counts, shares: &mut [Share], whole: &[f64], aim: f64, may_shrink: bool) -> Counts {
    let now = squares(shares, whole.len());
    let factor = |(w, square): (&f64, &f64)| if *square > 0.0 { w / square.sqrt() / aim.max(w / FALL) } else { 0.0 };
    let factor: Vec<f64> = whole.iter().zip(&now).map(factor).collect();
    let mut found = counts.clone();
    for share in shares.iter_mut() {
        let n = &mut found[share.line.block][share.line.axis];
        let fewer = if may_shrink { ((*n as f64 / MOST).ceil() as usize).max(share.least).min(*n) } else { *n };
        share.scaled(fewer as f64 / *n as f64);
        *n = fewer;
    }
    let mut open = squares(shares, whole.len());
    let over = |square: f64, factor: f64| (square.max(0.0).sqrt() * factor - 1.0).max(0.0);
    loop {
        let best = (shares.iter().enumerate())
            .filter_map(|(k, share)| {
                let CellLine { block, axis, .. } = share.line;
                let n = found[block][axis];
                let more = n + ((n as f64 * STEP) as usize).max(1);
                if more as f64 > MOST * counts[block][axis] as f64 {
                    return None;
                }
                let left = (n as f64 / more as f64).powf(2.0 * ORDER);
                let gain = |f: usize| over(open[f], factor[f]) - over(open[f] - share.open[f].powi(2) * (1.0 - left), factor[f]);
                let gain: f64 = (0..whole.len()).map(gain).sum();
                let added = cells(&vec![found[block]]) / n as f64 * (more - n) as f64;
                (gain > 0.0).then_some((k, more, gain / added))
            })
            .reduce(|a, b| if b.2 > a.2 { b } else { a });
        let Some((k, more, _)) = best else { break };
        let CellLine { block, axis, .. } = shares[k].line;
        for (open, own) in open.iter_mut().zip(&shares[k].open) {
            *open -= own * own * (1.0 - (found[block][axis] as f64 / more as f64).powf(2.0 * ORDER));
        }
        shares[k].scaled(more as f64 / found[block][axis] as f64);
        found[block][axis] = more;
    }
    for share in shares.iter_mut() {
        let CellLine { block, axis, .. } = share.line;
        if found[block][axis] > counts[block][axis] {
            share.least = counts[block][axis];
        }
    }
    found
}
