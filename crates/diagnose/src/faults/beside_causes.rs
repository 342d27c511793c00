//! Readings and rows of a table without which causes explain the rest.
//!
//! Beside two causes a wrong reading need not stand out of its sensor or of its row, so that no look at the table finds it
//! ([`super::by_catalogue`]). Here sets of readings and rows are taken out of the linear problem, each set beside the best cause and the
//! best two. What is left must be little more than noise, and each reading or row that goes must pay for itself: the more of
//! them, the more misfit must go with them. Noise may be larger than stated, so that a misfit counts beside what is left of it.
//! The sets grow by one member at a time from the best few (beam search).

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use crate::screen::Screened;
use crate::view::Comparison;
use crate::{NOISE, Problem, WRONG};
use coldplate_base::units::celsius;
use coldplate_evidence::faulty_readings::{Fault, kelvin};
use coldplate_evidence::identify::chi_square_tail;
use coldplate_evidence::measurement::whiten;

/// Members of a set at most, and sets from which larger ones are made.
const MOST: usize = 4;
const BEAM: usize = 6;
/// Readings of a table that is searched, at most: the search costs their square.
const MOST_READINGS: usize = 600;
/// Rows that are needed for one to go, and sensors.
const LEAST_ROWS: usize = 5;
const LEAST_SENSORS: usize = 3;
/// Rows of which one may go, and readings: of more the machine is wrong. Two readings may go in any case.
const ROWS_OF_ONE: usize = 10;
const READINGS_OF_ONE: usize = 40;
/// What may be left of each reading: noise stated half is four.
const NOISY: f64 = 5.0;
/// Standard deviations of what is left that a wrong reading is off by, and the readings of a wrong row in the root mean square.
const GROSS: [f64; 2] = [15.0, 5.0];
/// Misfit that each member must take, that each of its readings must take beside, and that each cause must take.
const MEMBER: f64 = 12.0;
const READING: f64 = 2.0;
const CAUSE: f64 = 12.0;
/// By how much the best set must be better than none.
const BETTER: f64 = 12.0;
/// Causes beside which a second one is looked for.
const FIRSTS: usize = 30;
/// Share of a signature's square that must lie outside the set for its cause to count beside it.
const OUTSIDE: f64 = 1e-3;

/// A reading, or all readings of a row.
struct Member {
    readings: Vec<usize>,
    is_row: bool,
}

/// Members taken out.
#[derive(Clone)]
struct Set {
    members: Vec<usize>,
    /// Their readings, member by member.
    readings: Vec<usize>,
    /// The best causes beside them, as positions in the screen, and the whitened misfit that these leave.
    causes: Vec<usize>,
    left: f64,
    /// What is left of each reading, at least one: the variance of noise over the stated one.
    noise: f64,
    /// Minus twice the logarithm of the likelihood with noise of this size, and the price of members and causes.
    score: f64,
}

/// The linear problem with a unit vector for each reading.
struct Search<'a> {
    screened: &'a Screened,
    members: Vec<Member>,
    /// Readings that may go one by one, and rows.
    most: [usize; 2],
    /// Stated noise of each reading, K.
    deviation: Vec<f64>,
    /// Sensor of each reading.
    sensors: Vec<usize>,
    /// Unwhitened signatures, K.
    columns: Vec<&'a [f64]>,
    /// Whitened unit vectors: with each other, with all signatures, with the residual.
    among: DMatrix<f64>,
    across: DMatrix<f64>,
    along: DVector<f64>,
}

/// The fewest readings and rows without which at most two causes explain a table; nothing where all of them are needed.
pub fn aside(problem: &Problem, base: &Comparison, screened: &Screened) -> Vec<Fault> {
    let data = &problem.data;
    let places = whiten::places(data);
    if data.is_transient() || places.len() > MOST_READINGS {
        return Vec::new();
    }
    let search = Search::new(problem, &places, base, screened);
    let Some(found) = search.best() else { return Vec::new() };
    let of = |(Member { readings, is_row }, off): (&Member, Vec<f64>)| -> Fault {
        let (row, sensor) = places[readings[0]];
        let most = off.into_iter().fold(0.0f64, |most, off| if off.abs() > most.abs() { off } else { most });
        if *is_row {
            let words =
                format!("all {} sensors are off what causes make of it that explain the rest, the most by {most:+.1} K", readings.len());
            return Fault::wrong_row(data, row, words + ": the readings of other conditions");
        }
        let read = data.rows[row].readings[sensor].map_or(f64::NAN, celsius);
        let words = format!("{read:.1} degC is {} off what causes make of it that explain the rest", kelvin(most));
        Fault::wrong_reading(data, row, sensor, words)
    };
    let mut faults: Vec<Fault> = search.off(&found).into_iter().map(of).collect();
    faults.sort_by_key(|fault| *fault.rows.start());
    faults
}

impl<'a> Search<'a> {
    fn new(problem: &Problem, places: &[(usize, usize)], base: &'a Comparison, screened: &'a Screened) -> Self {
        let (n, count) = (places.len(), problem.data.rows.len());
        let unit = |i: usize| (0..n).map(|j| if i == j { 1.0 } else { 0.0 }).collect::<Vec<f64>>();
        let units = base.whitener.apply_all(&(0..n).map(unit).collect::<Vec<_>>());
        let singles = (0..n).map(|i| Member { readings: vec![i], is_row: false });
        let of_row = |r: usize| (0..n).filter(|i| places[*i].0 == r).collect::<Vec<usize>>();
        let rows = (0..if count < LEAST_ROWS { 0 } else { count }).map(of_row);
        let rows = rows.filter(|readings| readings.len() >= LEAST_SENSORS).map(|readings| Member { readings, is_row: true });
        Self {
            screened,
            members: singles.chain(rows).collect(),
            most: [n.div_ceil(READINGS_OF_ONE).max(2), count.div_ceil(ROWS_OF_ONE)],
            sensors: places.iter().map(|(_, k)| *k).collect(),
            columns: screened.visible.iter().map(|h| base.found.columns[*h].as_slice()).collect(),
            deviation: places.iter().map(|(_, k)| problem.uncertainty.noise[*k]).collect(),
            among: units.tr_mul(&units),
            across: units.tr_mul(&screened.columns),
            along: units.tr_mul(&DVector::from_column_slice(&screened.residual)),
        }
    }

    /// The best set; `None` where none is better than keeping all readings.
    fn best(&self) -> Option<Set> {
        let none = self.beside(Vec::new())?;
        if chi_square_tail(none.left, self.deviation.len().saturating_sub(none.causes.len()).max(1)) > NOISE {
            return None;
        }
        let (mut beam, mut best) = (vec![none.clone()], None::<Set>);
        for _ in 0..MOST {
            let mut larger: Vec<Vec<usize>> = beam.iter().flat_map(|set| self.larger(set)).collect();
            larger.sort();
            larger.dedup();
            let mut found: Vec<Set> = larger.into_par_iter().filter_map(|members| self.beside(members)).collect();
            found.sort_by(|a, b| a.score.total_cmp(&b.score));
            found.truncate(BEAM);
            let is_better = |set: &&Set| {
                set.noise < NOISY && best.as_ref().is_none_or(|best| set.score < best.score) && self.is_gross(set) && !self.is_law(set)
            };
            if let Some(better) = found.iter().find(is_better) {
                best = Some(better.clone());
            }
            beam = found;
        }
        best.filter(|best| best.score < none.score - BETTER)
    }

    /// Whether all members are off by far.
    fn is_gross(&self, set: &Set) -> bool {
        self.off(set).into_iter().all(|(Member { readings, is_row }, off)| {
            let squares = off.iter().zip(readings).map(|(off, i)| (off / self.deviation[*i]).powi(2));
            squares.sum::<f64>() / readings.len() as f64 > GROSS[usize::from(*is_row)].powi(2) * set.noise
        })
    }

    /// Whether one of several members is a reading of the sensor that shows one of the causes most: without the readings that a law
    /// misses, a wrong law explains the rest.
    fn is_law(&self, set: &Set) -> bool {
        let shown = |j: &usize| -> Option<usize> {
            let square = |k: usize| -> f64 {
                let own = self.columns[*j].iter().zip(&self.deviation).zip(&self.sensors).filter(|(_, sensor)| **sensor == k);
                own.map(|((c, d), _)| (c / d).powi(2)).sum()
            };
            let sensors = 0..=self.sensors.iter().copied().max()?;
            sensors.max_by(|a, b| square(*a).total_cmp(&square(*b)))
        };
        let most: Vec<usize> = set.causes.iter().filter_map(shown).collect();
        let mut singles = set.members.iter().map(|m| &self.members[*m]).filter(|member| !member.is_row);
        set.members.len() > 1 && singles.any(|member| most.contains(&self.sensors[member.readings[0]]))
    }

    /// Sets with one member more.
    fn larger(&self, set: &Set) -> Vec<Vec<usize>> {
        let gone = |is_row: bool| set.members.iter().filter(|m| self.members[**m].is_row == is_row).count();
        let may_go = [false, true].map(|is_row| gone(is_row) < self.most[usize::from(is_row)]);
        let is_apart = |m: &usize| {
            let Member { readings, is_row } = &self.members[*m];
            if !may_go[usize::from(*is_row)] {
                return false;
            }
            let total = readings.len() + set.readings.len();
            total as f64 <= WRONG * self.deviation.len() as f64 && !readings.iter().any(|i| set.readings.contains(i))
        };
        let with = |m: usize| {
            let mut members = set.members.clone();
            members.push(m);
            members.sort_unstable();
            members
        };
        (0..self.members.len()).filter(is_apart).map(with).collect()
    }

    /// What the best cause or two, or none, leave beside some members; `None` where these cannot be told apart.
    fn beside(&self, members: Vec<usize>) -> Option<Set> {
        let screened = self.screened;
        let readings: Vec<usize> = members.iter().flat_map(|m| self.members[*m].readings.iter().copied()).collect();
        // The whitened units in an orthonormal basis: what lies inside it goes with them.
        let (inside, gone) = self.inside(&readings)?;
        let misfit = screened.misfit() - gone.norm_squared();
        let count = screened.visible.len();
        let (mut squares, mut along) = (vec![0.0; count], vec![0.0; count]);
        for j in 0..count {
            let column = inside.column(j);
            squares[j] = screened.square(j) - column.norm_squared();
            along[j] = screened.along[j] - column.dot(&gone);
        }
        let counts = |j: &usize| !screened.is_fixed(*j) && !screened.is_rare[*j] && squares[*j] > OUTSIDE * screened.square(*j);
        let mut singles: Vec<(usize, f64)> = (0..count).filter(counts).map(|j| (j, screened.taken_away(j, squares[j], along[j]))).collect();
        singles.sort_by(|a, b| b.1.total_cmp(&a.1));
        let total = self.deviation.len();
        let scored = |gain: f64, causes: Vec<usize>| -> Set {
            let left = misfit - gain;
            let noise = (left / total.saturating_sub(readings.len() + causes.len()).max(1) as f64).max(1.0);
            let price = members.iter().map(|m| MEMBER + READING * self.members[*m].readings.len() as f64).sum::<f64>();
            let score = left / noise + total as f64 * noise.ln() + price + CAUSE * causes.len() as f64;
            Set { left, noise, score, causes, members: members.clone(), readings: readings.clone() }
        };
        let pair = |i: usize, j: usize| -> f64 {
            let product = screened.product(i, j) - inside.column(i).dot(&inside.column(j));
            screened.pair_beside([i, j], (squares[i], product, squares[j]), [along[i], along[j]]).1
        };
        let pairs = singles.iter().take(FIRSTS).flat_map(|(i, _)| singles.iter().map(move |(j, _)| [*i, *j]));
        let pair = pairs.map(|[i, j]| (pair(i, j), [i, j])).max_by(|a, b| a.0.total_cmp(&b.0)).map(|(gain, both)| (gain, both.to_vec()));
        let single = singles.first().map(|(j, gain)| (*gain, vec![*j]));
        let all = [Some((0.0, Vec::new())), single, pair].into_iter().flatten().map(|(gain, causes)| scored(gain, causes));
        all.min_by(|a, b| a.score.total_cmp(&b.score))
    }

    /// Signatures and residual along an orthonormal basis of some units.
    fn inside(&self, readings: &[usize]) -> Option<(DMatrix<f64>, DVector<f64>)> {
        let n = readings.len();
        let among = DMatrix::from_fn(n, n, |i, j| self.among[(readings[i], readings[j])]);
        let factor = among.cholesky()?;
        let mut inside = DMatrix::from_fn(n, self.across.ncols(), |i, j| self.across[(readings[i], j)]);
        let mut gone = DVector::from_fn(n, |i, _| self.along[readings[i]]);
        let is_solved = factor.l().solve_lower_triangular_mut(&mut inside) && factor.l().solve_lower_triangular_mut(&mut gone);
        is_solved.then_some((inside, gone))
    }

    /// By how much each reading of every member of a set is off what the causes beside make of it, K.
    fn off(&self, set: &Set) -> Vec<(&Member, Vec<f64>)> {
        let (readings, causes) = (&set.readings, &set.causes);
        let n = readings.len();
        let size = n + causes.len();
        let normal = DMatrix::from_fn(size, size, |i, j| match (i < n, j < n) {
            (true, true) => self.among[(readings[i], readings[j])],
            (true, false) => self.across[(readings[i], causes[j - n])],
            (false, true) => self.across[(readings[j], causes[i - n])],
            (false, false) => self.screened.product(causes[i - n], causes[j - n]),
        });
        let right = DVector::from_fn(size, |i, _| if i < n { self.along[readings[i]] } else { self.screened.along[causes[i - n]] });
        let found = normal.lu().solve(&right).unwrap_or_else(|| DVector::zeros(size));
        let mut off = found.iter().copied();
        set.members.iter().map(|m| &self.members[*m]).map(|member| (member, off.by_ref().take(member.readings.len()).collect())).collect()
    }
}
