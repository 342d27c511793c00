//! What each hypothesis does to logs to first order, followed in the few unknowns that the sensors can see.
//!
//! The machine is linearised at moments of its own histories, between which these run about straight, and projected ([`ObservableSpace`]); there
//! every hypothesis costs a few small products per step. The histories, the space and the projected derivatives are the machine's: they
//! serve every further set of hypotheses about it ([`Linear`]).

use std::sync::Arc;

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::effects::{Change, Disturbances, EffectDerivatives, Hypothesis, Law, Scales, UserKind};
use coldplate_base::error::Result;
use coldplate_describe::machine::Condition;
use coldplate_evidence::identify::{self, Runs, own_key};
use coldplate_evidence::measurement::{Data, whiten};
use coldplate_explore::simulate::Start;
use coldplate_solve::sensitivity::{Derivatives, Disturbance, LinearisedHistory, Moment, ObservableSpace, STEPS, Variation};
use coldplate_solve::study::{MachineParameter, Study};

/// Disturbances followed at a time.
const TOGETHER: usize = 32;

/// A machine linearised along its logs.
#[derive(Debug)]
pub struct Linear {
    /// Of every reading, K.
    pub values: Vec<f64>,
    /// Of every test.
    histories: Vec<Vec<Moment>>,
    basis: ObservableSpace,
    /// The derivative of the residual, projected, at each moment of each history.
    matrices: Vec<Vec<DMatrix<f64>>>,
}

impl Linear {
    /// About the histories of a machine through the tests of some data, run to an error in each time step, K.
    ///
    /// # Errors
    /// The machine cannot be run through the data's conditions; it has no path to any given temperature, or its sensors read inlets alone.
    pub fn new(study: &Study, data: &Data, Runs { start, tolerance }: Runs) -> Result<Self> {
        let (values, histories) = identify::histories(study, data, start, tolerance)?;
        let (slowest, fastest) = rates(data);
        let moments: Vec<&Moment> = histories.iter().flatten().collect();
        let basis = ObservableSpace::new(study, &data.sensors, &moments, slowest, fastest)?;
        let of = |moment: &Moment| Ok(basis.matrix(&Derivatives::at(study, &moment.condition, &moment.temperatures)?));
        let matrices = histories.iter().map(|moments| moments.par_iter().map(of).collect()).collect::<Result<_>>()?;
        Ok(Self { values, histories, basis, matrices })
    }
}

/// What hypotheses are followed with.
pub(crate) struct Follower<'a> {
    /// The machine.
    pub study: &'a Study,
    /// Its logs.
    pub data: &'a Data,
    /// How they are run.
    pub runs: Runs,
    /// Where laws are one.
    pub scales: &'a Scales,
    /// The user's kinds.
    pub user: &'a [UserKind],
    /// The machine linearised along them.
    pub linear: &'a Arc<Linear>,
}

/// What was followed, reading by reading.
pub(crate) struct Followed {
    /// Per unit of each hypothesis; `None` for what acts on no node.
    pub columns: Vec<Option<Vec<f64>>>,
    /// Rows of slopes along the uncertain parameters, and along the condition variables.
    pub slopes: Vec<Vec<f64>>,
    /// The same along the condition variables.
    pub conditions: Vec<Vec<f64>>,
}

/// What acts at a moment: what each effect and then each parameter does; `None` for what acts on no node.
struct Acting {
    disturbances: Vec<Option<Projected>>,
}

/// A change of the residual, projected, and what reaches the sensors of the data at once, K.
struct Projected {
    residual: DVector<f64>,
    direct: Vec<f64>,
}

/// An instant at which laws are looked at: a moment of the history, or one between it and the next.
#[derive(Clone)]
struct Instant {
    time: f64,
    condition: Condition,
    moment: usize,
    /// How far it is on the way to the next moment.
    share: f64,
}

/// Factor on what an effect does along the logs.
#[derive(Clone, Copy)]
enum Weight<'a> {
    /// By a law of the condition.
    Law(Law),
    /// By a course.
    Course(Along<'a>),
}

/// A factor that runs through logs.
#[derive(Clone, Copy)]
pub(crate) struct Along<'a> {
    /// Value of the factor at every row of the data.
    pub values: &'a [f64],
    /// Whether it stays until the next row of its test instead of running straight to it.
    pub is_held: bool,
}

impl<'a> Along<'a> {
    /// One that runs straight between rows.
    pub fn straight(values: &'a [f64]) -> Self {
        Self { values, is_held: false }
    }

    /// Whether it jumps from a row to the next.
    fn jumps(&self, row: usize, next: usize) -> bool {
        self.is_held && self.values[row] != self.values[next]
    }
}

impl Follower<'_> {
    /// Follows hypotheses and parameters.
    ///
    /// # Errors
    /// A derivative cannot be taken.
    pub fn follow(&self, uncertain: &[MachineParameter], hypotheses: &[Hypothesis]) -> Result<Followed> {
        let (study, data) = (self.study, self.data);
        let variables = study.model.machine.variables.iter().map(|v| study.parameter(&v.name)).collect::<Result<Vec<_>>>()?;
        let variations: Vec<Variation> = uncertain.iter().chain(&variables).map(|p| study.variation(p)).collect::<Result<_>>()?;
        let derivatives = EffectDerivatives::new(study, hypotheses, self.user);
        let of_hypothesis = |h: &Hypothesis| (derivatives.position(h).unwrap_or(usize::MAX), Weight::Law(h.law));
        let of_parameter = |p: usize| (derivatives.count() + p, Weight::Law(Law::Constant));
        let wanted: Vec<(usize, Weight<'_>)> =
            hypotheses.iter().map(of_hypothesis).chain((0..variations.len()).map(of_parameter)).collect();
        let turns = self.scales.turns(hypotheses.iter().map(|h| h.law));
        let count = data.count();
        let mut columns = self.columns(&derivatives, &variations, &wanted, |_| turns.clone())?;
        let mut along = columns.split_off(hypotheses.len());
        for (column, variation) in along.iter_mut().zip(&variations) {
            if own_key(&variation.parameter, data).is_some() {
                *column = Some(self.own(&variation.parameter)?);
            }
        }
        let rows = |which: std::ops::Range<usize>| -> Vec<Vec<f64>> {
            (0..count).map(|i| which.clone().map(|p| along[p].as_ref().map_or(0.0, |column| column[i])).collect()).collect()
        };
        Ok(Followed { columns, slopes: rows(0..uncertain.len()), conditions: rows(uncertain.len()..along.len()) })
    }

    /// Change of every reading (K) per unit of hypotheses along courses, each given by the place of its hypothesis and its factor; `None` for
    /// what acts on no node. Courses turn at every `stride`-th row, and those that are held jump where they change.
    ///
    /// # Errors
    /// A derivative cannot be taken.
    pub fn along(&self, hypotheses: &[Hypothesis], courses: &[(usize, Along<'_>)], stride: usize) -> Result<Vec<Option<Vec<f64>>>> {
        let derivatives = EffectDerivatives::new(self.study, hypotheses, self.user);
        let of = |(h, _): &(usize, Along<'_>)| derivatives.position(&hypotheses[*h]).unwrap_or(usize::MAX);
        let wanted: Vec<(usize, Weight<'_>)> = courses.iter().map(|own| (of(own), Weight::Course(own.1))).collect();
        self.columns(&derivatives, &[], &wanted, |test| RowsOfTest::new(self.data, test).turns(stride))
    }

    /// Change of every reading (K) with the temperature of groups at the start of a test, per kelvin; for each test and group. Time steps end
    /// at every `stride`-th row.
    pub fn starts(&self, groups: &[u32], stride: usize) -> Vec<Vec<f64>> {
        let (network, basis) = (&self.study.model.network, &self.linear.basis);
        let content = |group: &u32| {
            let own = (0..network.solids).filter(|n| network.group[*n] == *group);
            basis.project(own.map(|n| (n, network.capacity[n])))
        };
        let contents: Vec<DVector<f64>> = groups.iter().map(content).collect();
        if contents.is_empty() {
            return Vec::new();
        }
        let contents = DMatrix::from_columns(&contents);
        let count = self.data.count();
        let of = |(t, test): (usize, &String)| -> Vec<Vec<f64>> {
            let rows = RowsOfTest::new(self.data, test);
            let instants = instants(&self.linear.histories[t], &rows.turns(stride));
            let matrices: Vec<(f64, DMatrix<f64>)> = instants.iter().map(|i| (i.time, i.between(&self.linear.matrices[t]))).collect();
            let course = LinearisedHistory::new(basis, &matrices, |i| steps(&instants[i..=i + 1]), false);
            let values = course.relaxing(&contents, &rows.times);
            let of_group = |values: Vec<f64>| {
                let read = |(row, k, i): &(usize, usize, usize)| (*i, values[row * self.data.sensors.len() + k]);
                let mut column = vec![0.0; count];
                self.shown(&rows, rows.readings.iter().map(read).collect()).into_iter().for_each(|(i, value)| column[i] = value);
                column
            };
            values.into_iter().map(of_group).collect()
        };
        self.data.tests().iter().enumerate().flat_map(of).collect()
    }

    /// Columns of what is wanted: the place of an effect or parameter and its weight. `turns` has the times of a test, s, at which weights turn.
    fn columns(
        &self,
        derivatives: &EffectDerivatives<'_>,
        variations: &[Variation],
        wanted: &[(usize, Weight<'_>)],
        turns: impl Fn(&str) -> Vec<f64>,
    ) -> Result<Vec<Option<Vec<f64>>>> {
        let data = self.data;
        let mut columns: Vec<Option<Vec<f64>>> = vec![None; wanted.len()];
        for (t, test) in data.tests().iter().enumerate() {
            let acting = |moment: &Moment| self.acting(moment, derivatives, variations);
            let acting: Vec<Acting> = self.linear.histories[t].par_iter().map(acting).collect::<Result<_>>()?;
            let rows = RowsOfTest::new(data, test);
            let instants = with_jumps(&self.linear.histories[t], turns(test), &jumps(&rows, wanted));
            for (column, found) in columns.iter_mut().zip(self.of_test(t, &rows, &instants, &acting, wanted)) {
                let Some(found) = found.map(|found| self.shown(&rows, found)) else { continue };
                let column = column.get_or_insert_with(|| vec![0.0; data.count()]);
                found.into_iter().for_each(|(i, value)| column[i] = value);
            }
        }
        Ok(columns)
    }

    /// What effects and parameters do at a moment.
    fn acting(&self, moment: &Moment, derivatives: &EffectDerivatives<'_>, variations: &[Variation]) -> Result<Acting> {
        let (study, sensors, basis) = (self.study, &self.data.sensors, &self.linear.basis);
        let at = Derivatives::at(study, &moment.condition, &moment.temperatures)?;
        let project = |rows: &[(u32, f64)]| basis.project(rows.iter().map(|(n, r)| (*n as usize, *r)));
        let Disturbances { effects, shared } = derivatives.disturbances(&at, &at.screen());
        let shared: Vec<DVector<f64>> = shared.iter().map(|field| project(field)).collect();
        let of_effect = |effect: Option<Change>| -> Option<Projected> {
            Some(match effect? {
                Change::Own(own) => {
                    // Through the temperatures it goes later; at once it changes what sensors in inlets read.
                    let direct = |s: &usize| Disturbance::direct(&own, study.model.network.sensors[*s].inlet);
                    Projected { residual: project(&own.rows), direct: sensors.iter().map(direct).collect() }
                }
                Change::Shared(terms) => {
                    let mut residual = DVector::zeros(basis.size());
                    terms.iter().for_each(|(field, coefficient)| residual.axpy(*coefficient, &shared[*field], 1.0));
                    Projected { residual, direct: vec![0.0; sensors.len()] }
                }
            })
        };
        let along = |variation: &Variation| -> Result<Option<Projected>> {
            let partial = at.partial_of(variation)?;
            let rows = partial.residual.iter().copied().enumerate().filter(|(_, r)| *r != 0.0);
            Ok(Some(Projected { residual: basis.project(rows), direct: sensors.iter().map(|s| partial.readings[*s]).collect() }))
        };
        let effects = effects.into_iter().map(|effect| Ok(of_effect(effect)));
        Ok(Acting { disturbances: effects.chain(variations.iter().map(along)).collect::<Result<_>>()? })
    }

    /// Change that sensors show with a change of the temperatures of their places in one test, reading by reading of its rows: a place among all
    /// readings, and K.
    fn shown(&self, rows: &RowsOfTest, mut found: Vec<(usize, f64)>) -> Vec<(usize, f64)> {
        let machine = &self.study.model.machine;
        for (k, sensor) in self.data.sensors.iter().enumerate() {
            let response = machine.sensors[*sensor].shows;
            if response.lag == 0.0 && response.of_place() == 1.0 {
                continue;
            }
            let own: Vec<usize> = (0..found.len()).filter(|n| rows.readings[*n].1 == k).collect();
            let times: Vec<f64> = own.iter().map(|n| rows.times[rows.readings[*n].0]).collect();
            let changes: Vec<f64> = own.iter().map(|n| found[*n].1).collect();
            own.iter().zip(response.course_of_change(&times, &changes)).for_each(|(n, shown)| found[*n].1 = shown);
        }
        found
    }

    /// The slope of all readings along a number of a sensor's own.
    fn own(&self, parameter: &MachineParameter) -> Result<Vec<f64>> {
        let found = identify::predict_within(self.study, self.data, std::slice::from_ref(parameter), self.runs.start, self.runs.tolerance)?;
        Ok(found.slopes.into_iter().map(|row| row[0]).collect())
    }

    /// What disturbances under their laws do to the readings of one test: where each stands among all readings, and K per unit.
    fn of_test(
        &self,
        t: usize,
        RowsOfTest { rows, times, readings }: &RowsOfTest,
        instants: &[Instant],
        acting: &[Acting],
        wanted: &[(usize, Weight<'_>)],
    ) -> Vec<Option<Vec<(usize, f64)>>> {
        let (data, moments) = (self.data, &self.linear.histories[t]);
        let matrices: Vec<(f64, DMatrix<f64>)> = instants.iter().map(|i| (i.time, i.between(&self.linear.matrices[t]))).collect();
        let course =
            LinearisedHistory::new(&self.linear.basis, &matrices, |i| steps(&instants[i..=i + 1]), self.runs.start == Start::Steady);
        let nearest = |time: &f64| -> usize {
            let later = moments.partition_point(|m| m.time < *time).min(moments.len() - 1);
            let before = later.saturating_sub(1);
            if *time - moments[before].time <= moments[later].time - *time { before } else { later }
        };
        let nearest: Vec<usize> = times.iter().map(nearest).collect();
        let within: Vec<(usize, f64)> = instants.iter().map(|instant| between(times, instant.time)).collect();
        let factor = |weight: &Weight<'_>, i: usize| match weight {
            Weight::Law(law) => self.scales.factor(*law, &instants[i].condition),
            Weight::Course(Along { values, is_held: true }) => {
                let (row, _) = within[i];
                // The first of two instants at one time is before the jump.
                let is_before = instants.get(i + 1).is_some_and(|next| next.time == instants[i].time && times[row] == next.time);
                values[rows[row - usize::from(is_before && row > 0)]]
            }
            Weight::Course(Along { values, is_held: false }) => {
                let (row, share) = within[i];
                let next = rows[(row + 1).min(rows.len() - 1)];
                values[rows[row]] * (1.0 - share) + values[next] * share
            }
        };
        let of = |moment: usize, d: usize| acting[moment].disturbances.get(d).and_then(Option::as_ref);
        let count = acting.first().map_or(0, |first| first.disturbances.len());
        let known: Vec<bool> = (0..count).map(|d| (0..acting.len()).all(|moment| of(moment, d).is_some())).collect();
        let is_known = |(d, _): &(usize, Weight<'_>)| known.get(*d) == Some(&true);
        // Residual of a disturbance at every instant, a column each.
        let at_instants = |d: usize| -> DMatrix<f64> {
            let mut all = DMatrix::zeros(self.linear.basis.size(), instants.len());
            for (instant, mut column) in instants.iter().zip(all.column_iter_mut()) {
                let ends = [(instant.moment, 1.0 - instant.share), (instant.moment + 1, instant.share)];
                for (moment, share) in ends.into_iter().filter(|(_, share)| *share != 0.0) {
                    of(moment, d).into_iter().for_each(|own| column.axpy(share, &own.residual, 1.0));
                }
            }
            all
        };
        // Forwards with every disturbance, or back from every reading: whichever are fewer.
        let answers = (wanted.len() > times.len() * data.sensors.len()).then(|| course.answers(instants.len(), times));
        let values_of = |known: &[(usize, Weight<'_>)]| -> Vec<Vec<f64>> {
            // Courses of one disturbance follow each other.
            let mut residuals: Vec<(usize, DMatrix<f64>)> = known.iter().map(|(d, _)| (*d, DMatrix::zeros(0, 0))).collect();
            residuals.dedup_by_key(|(d, _)| *d);
            residuals.iter_mut().for_each(|(d, own)| *own = at_instants(*d));
            let forced = |i: usize| {
                let mut all = DMatrix::zeros(self.linear.basis.size(), known.len());
                let mut place = 0;
                for ((d, weight), mut column) in known.iter().zip(all.column_iter_mut()) {
                    place += usize::from(residuals[place].0 != *d);
                    column.axpy(factor(weight, i), &residuals[place].1.column(i), 0.0);
                }
                all
            };
            let Some(answers) = &answers else {
                return course.readings(&(0..instants.len()).map(forced).collect::<Vec<_>>(), times);
            };
            let mut sum = DMatrix::zeros(times.len() * data.sensors.len(), known.len());
            answers.iter().enumerate().for_each(|(i, answer)| sum.gemm(1.0, answer, &forced(i), 1.0));
            sum.column_iter().map(|column| column.iter().copied().collect()).collect()
        };
        let followed = |some: &[(usize, Weight<'_>)]| -> Vec<Option<Vec<(usize, f64)>>> {
            let known: Vec<(usize, Weight<'_>)> = some.iter().copied().filter(is_known).collect();
            if known.is_empty() {
                return vec![None; some.len()];
            }
            let mut values = values_of(&known).into_iter();
            let read = |wanted: &(usize, Weight<'_>)| -> Option<Vec<(usize, f64)>> {
                let (d, weight) = *wanted;
                let values = if is_known(wanted) { values.next()? } else { return None };
                let value = |(row, k, i): &(usize, usize, usize)| {
                    let direct = of(nearest[*row], d).map_or(0.0, |d| d.direct[*k]);
                    let at_row = match weight {
                        Weight::Law(law) => self.scales.factor(law, &data.rows[rows[*row]].condition),
                        Weight::Course(own) => own.values[rows[*row]],
                    };
                    (*i, values[row * data.sensors.len() + k] + direct * at_row)
                };
                Some(readings.iter().map(value).collect())
            };
            some.iter().map(read).collect()
        };
        wanted.par_chunks(TOGETHER).flat_map(followed).collect()
    }
}

/// Times of one test at which held courses jump, s.
fn jumps(rows: &RowsOfTest, wanted: &[(usize, Weight<'_>)]) -> Vec<f64> {
    let mut all = Vec::new();
    for (pair, time) in rows.rows.windows(2).zip(rows.times.iter().skip(1)) {
        let jumps = |(_, weight): &(usize, Weight<'_>)| matches!(weight, Weight::Course(own) if own.jumps(pair[0], pair[1]));
        if wanted.iter().any(jumps) {
            all.push(*time);
        }
    }
    all
}

/// The rows of one test.
struct RowsOfTest {
    /// Places among the rows of the data.
    rows: Vec<usize>,
    /// s
    times: Vec<f64>,
    /// Row of the test, sensor of the data, place among all readings.
    readings: Vec<(usize, usize, usize)>,
}

impl RowsOfTest {
    fn new(data: &Data, test: &str) -> Self {
        let rows: Vec<usize> = (0..data.rows.len()).filter(|r| data.rows[*r].test == test).collect();
        let times = rows.iter().map(|r| data.rows[*r].time.unwrap_or(0.0)).collect();
        let of = |(i, (r, k)): (usize, (usize, usize))| rows.binary_search(&r).ok().map(|row| (row, k, i));
        let readings = whiten::places(data).into_iter().enumerate().filter_map(of).collect();
        Self { times, readings, rows }
    }

    /// The times of every `stride`-th row, and of the last, s.
    fn turns(&self, stride: usize) -> Vec<f64> {
        self.times.iter().step_by(stride.max(1)).chain(self.times.last()).copied().collect()
    }
}

/// Where a time lies among others, which rise: the one before, and the share of the way to the next.
fn between(times: &[f64], time: f64) -> (usize, f64) {
    let row = times.partition_point(|t| *t <= time).saturating_sub(1);
    match times.get(row + 1) {
        Some(next) if *next > times[row] => (row, ((time - times[row]) / (next - times[row])).clamp(0.0, 1.0)),
        _ => (row, 0.0),
    }
}

impl Instant {
    /// What holds between moments.
    fn between(&self, of_moments: &[DMatrix<f64>]) -> DMatrix<f64> {
        let own = &of_moments[self.moment];
        if self.share > 0.0 { own * (1.0 - self.share) + &of_moments[self.moment + 1] * self.share } else { own.clone() }
    }
}

/// Time steps between an instant and the next, so that as many as ever lie between two moments.
fn steps(instants: &[Instant]) -> usize {
    let apart = (instants[1].moment - instants[0].moment) as f64 + instants[1].share - instants[0].share;
    (apart * STEPS as f64).ceil().max(1.0) as usize
}

/// The moments of a history, and given times (s, rising) between them, where laws of the time turn.
fn instants(moments: &[Moment], turns: &[f64]) -> Vec<Instant> {
    let of = |(moment, m): (usize, &Moment)| Instant { time: m.time, condition: m.condition.clone(), moment, share: 0.0 };
    let mut found: Vec<Instant> = moments.iter().enumerate().map(of).collect();
    for time in turns {
        let later = moments.partition_point(|m| m.time < *time);
        let (Some(before), Some(after)) = (later.checked_sub(1).map(|i| &moments[i]), moments.get(later)) else { continue };
        if after.time <= *time {
            continue;
        }
        let share = (time - before.time) / (after.time - before.time);
        let condition = before.condition.si().iter().zip(after.condition.si()).map(|(a, b)| a + share * (b - a)).collect();
        let place = found.partition_point(|i| i.time <= *time);
        found.insert(place, Instant { time: *time, condition: Condition::from_si(condition), moment: later - 1, share });
    }
    found
}

/// Instants as [`instants`] has them, with times of jumps twice each, before and after.
fn with_jumps(moments: &[Moment], mut turns: Vec<f64>, jumps: &[f64]) -> Vec<Instant> {
    let new: Vec<f64> = jumps.iter().filter(|time| !turns.contains(time)).copied().collect();
    turns.extend(new);
    let mut found = instants(moments, &turns);
    for time in jumps {
        let first = found.partition_point(|i| i.time < *time);
        let alike = found[first..].iter().take_while(|i| i.time == *time).count();
        if alike == 1 {
            found.insert(first, found[first].clone());
        }
    }
    found
}

/// The rates that logs can show, 1/s: from the longest test's to that of half their usual distance between rows.
fn rates(data: &Data) -> (f64, f64) {
    let (mut longest, mut gaps) = (0.0f64, Vec::new());
    for test in data.tests() {
        let times: Vec<f64> = data.rows.iter().filter(|row| row.test == test).filter_map(|row| row.time).collect();
        longest = longest.max(times.last().copied().unwrap_or(0.0) - times.first().copied().unwrap_or(0.0));
        gaps.extend(times.windows(2).map(|pair| pair[1] - pair[0]).filter(|gap| *gap > 0.0));
    }
    gaps.sort_by(f64::total_cmp);
    let usual = gaps.get(gaps.len() / 2).copied().unwrap_or(longest);
    (1.0 / longest.max(1e-3), 2.0 / usual.clamp(1e-3, longest.max(1e-3)))
}
