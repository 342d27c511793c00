//! Logs: functions of time that amplitudes follow, the disturbance that wanders with the time, and the machine with a set in force.
//!
//! A reading answers to all that was before it. So an amplitude is given by the coefficients of few functions of the rows, and the readings
//! answer to each of them by a column, which comes from the machine linearised along its own histories ([`crate::follow`]). What is large is
//! put in force: the machine is run with the course of each amplitude, as a variable of its file, and made linear again there. Where fronts
//! run there is no such machine; there columns are differences of runs, amplitudes are alike in all rows, and so is the disturbance in each
//! test.

use std::borrow::Cow;
use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector, SVD};

use super::force::{self, Acting, Courses, STEP};
use super::profiles::{Function, Profiles};
use super::response::{Slope, shows, sum};
use super::rows::{Errors, LogNoise, uncertain};
use super::search::{Fit, Reference};
use super::settings::AmplitudeSettings;
use super::sizing::Sizing;
use crate::Problem;
use crate::effects::{Course, Effect, FoundLaw, Heat, Hypothesis, Law, Scales, hypotheses};
use crate::follow::{Along, Follower};
use crate::low_rank::low_rank;
use crate::predictor::Predictor;
use crate::view::Comparison;
use crate::when::TEST_NUMBER;
use coldplate_base::units::Measurand;
use coldplate_describe::machine::Condition;
use coldplate_evidence::measurement::{Data, MeasurementUncertainty, TIME, whiten};
use coldplate_explore::simulate::Start;
use coldplate_network::Load;
use coldplate_solve::study::Study;

/// Columns of the disturbance, about: knots are as many as fill them. Chosen: time against what wanders fast.
const COLUMNS: usize = 400;
/// Least and most knots of the disturbance in each test. Chosen.
const KNOTS: (usize, usize) = (6, 24);
/// Stretches that are kept out, at least: fewer tests are divided.
const STRETCHES: usize = 6;
/// Instants in each test at which courses turn, of a machine of nodes and of one of cells. Chosen: time steps against what is between them.
const INSTANTS: [usize; 2] = [1500, 48];
/// Instants from which a cause may act: first few in the whole of a test, then as many between those that single causes ask for. Chosen: an
/// amplitude from the one before and one from the one behind are an instant between them.
pub const ONSETS: usize = 24;
/// Instants that are added around one, at most. Chosen.
const CLOSER: usize = 8;
/// Variance of a reading that the largest disturbance may lose where its columns are made few, as a share of that of the noise. Chosen: a
/// twentieth of it decides nothing.
const LOST: f64 = 0.05;
/// Directions of functions with less than this share of the largest square are one with others.
const ALIKE: f64 = 1e-10;
/// Tests of which one may be another than the rest, at most. Chosen: beyond them each takes readings of its own.
const MOST_TESTS: usize = 12;

/// A log with what its search needs.
pub struct Log<'a> {
    problem: &'a Problem,
    predictor: &'a Predictor<'a>,
    base: &'a Comparison,
    catalogue: &'a [Hypothesis],
    visible: &'a [(&'a Hypothesis, &'a Vec<f64>)],
    sizes: &'a [Sizing],
    settings: &'a AmplitudeSettings,
    /// Functions of all rows.
    functions: Profiles,
    /// Values of the variables over which an amplitude may run.
    variables: Vec<Vec<f64>>,
    /// Knots of the disturbance: functions of all rows.
    hats: Vec<Vec<f64>>,
    /// Between instants at which courses turn, in rows.
    stride: usize,
    /// Mean heat of the machine, W.
    heat: f64,
    /// Heats into parts, each with the change of the readings with it, K/W: they are the disturbance.
    into_parts: Vec<(&'a Hypothesis, &'a Vec<f64>)>,
    /// Stretch of each reading.
    stretches: Vec<usize>,
    /// Variables over which an amplitude may run, by name; the time in each test is the last one.
    pub names: Vec<String>,
    /// Laws of the time, which are counted behind the variables.
    pub when: Vec<FoundLaw>,
}

impl<'a> Log<'a> {
    /// A log beside the machine as it is; `visible` are the causes that show with their columns, and `sizes` their amplitudes in units of scales.
    pub fn new(
        problem: &'a Problem,
        predictor: &'a Predictor<'a>,
        (base, catalogue): (&'a Comparison, &'a [Hypothesis]),
        (visible, sizes): (&'a [(&'a Hypothesis, &'a Vec<f64>)], &'a [Sizing]),
        settings: &'a AmplitudeSettings,
    ) -> Self {
        let data = &problem.data;
        let machine = &problem.study.model.machine;
        let (mut names, mut variables) = (Vec::new(), Vec::new());
        for (v, variable) in machine.variables.iter().enumerate() {
            let values: Vec<f64> = data.rows.iter().map(|row| row.condition.si()[v]).collect();
            if problem.states(&variable.name) && variable.name != TIME && varies_within_tests(data, &values) {
                names.push(variable.name.clone());
                variables.push(values);
            }
        }
        names.push(TIME.into());
        variables.push(times(data));
        let is_followed = base.found.linear.is_some();
        let all = onsets(problem);
        let count = ONSETS.min(all.len());
        let coarse: Vec<f64> = (0..count).map(|k| all[(2 * k + 1) * all.len() / (2 * count)]).collect();
        let when = laws_of_time(problem, predictor.scales, &coarse);
        let functions = Profiles::constant(data.rows.len());
        let loads = data.rows.iter().filter_map(|row| Load::at(machine, &row.condition).ok());
        let heats: Vec<f64> = loads.flat_map(|load| load.powers).map(f64::abs).collect();
        let tests = data.tests();
        let into_parts: Vec<_> = catalogue.iter().zip(&base.found.columns).filter(|(h, column)| is_heat(h) && shows(column)).collect();
        let knots = (COLUMNS / (into_parts.len() * tests.len()).max(1)).clamp(KNOTS.0, KNOTS.1);
        let hats = if is_followed { hats(data, knots) } else { hats(data, 1) };
        let longest = tests.iter().map(|test| data.rows.iter().filter(|row| row.test == *test).count()).max().unwrap_or(1);
        let stride = longest.div_ceil(INSTANTS[usize::from(problem.study.model.mesh.cells > 0)]);
        let heat = heats.iter().sum::<f64>() / heats.len().max(1) as f64;
        let stretches = stretches(data);
        let mut log = Self {
            problem,
            predictor,
            base,
            catalogue,
            visible,
            sizes,
            settings,
            functions,
            variables,
            hats,
            stride,
            heat,
            into_parts,
            stretches,
            names,
            when,
        };
        log.functions = log.functions();
        log
    }

    /// This log in which amplitudes are alike in all rows.
    pub fn with_means_alone(self) -> Self {
        Self { functions: Profiles::constant(self.problem.data.rows.len()), ..self }
    }

    fn functions(&self) -> Profiles {
        let data = &self.problem.data;
        if !self.is_followed() {
            return Profiles::constant(data.rows.len());
        }
        let conditions: Vec<&Condition> = data.rows.iter().map(|row| &row.condition).collect();
        let factors: Vec<Vec<f64>> = self.when.iter().map(|law| law.factors(&conditions)).collect();
        let instants = (0..self.when.len()).filter(|law| instant(&self.when[*law]).is_some()).map(|law| self.names.len() + law).collect();
        Profiles { instants, ..Profiles::of_log(&self.variables, &factors, &rows_that_count(data)) }
    }

    /// Adds instants around those from which causes act in some fits, the most probable first, as many as there is room for.
    pub fn look_closer(&mut self, fits: &[Fit]) {
        let instants = onsets(self.problem);
        let mut all: Vec<f64> = self.when.iter().filter_map(instant).collect();
        let room = (u64::BITS as usize - self.variables.len() - (self.when.len() - all.len())).min(2 * ONSETS);
        let coarse = all.clone();
        let asked =
            fits.iter().flat_map(|fit| &fit.freedoms).flat_map(|f| (0..self.when.len()).filter(|law| f.has(self.names.len() + law)));
        for at in asked.filter_map(|law| instant(&self.when[law])) {
            let k = coarse.iter().position(|own| *own == at).unwrap_or(0);
            let (from, to) = (coarse[k.saturating_sub(1)], coarse[(k + 1).min(coarse.len() - 1)]);
            let mut own: Vec<f64> = instants.iter().copied().filter(|t| *t > from && *t < to && !all.contains(t)).collect();
            let step = own.len().div_ceil(CLOSER).max(1);
            own = own.into_iter().step_by(step).collect();
            own.truncate(room.saturating_sub(all.len()));
            all.extend(own);
        }
        all.sort_by(f64::total_cmp);
        self.when = laws_of_time(self.problem, self.predictor.scales, &all);
        self.functions = self.functions();
    }

    /// Functions of the rows with readings that causes are screened by, and all of them.
    pub fn profiles(&self) -> (Profiles, Profiles) {
        let all = self.functions.in_rows(&rows_that_count(&self.problem.data));
        (all.first(self.functions.screened), all)
    }

    fn as_it_is(&self) -> About<'_> {
        About { found: self.base, study: &self.problem.study, data: &self.problem.data, scales: self.predictor.scales }
    }

    /// What follows causes about a machine that was made linear.
    fn follower<'b>(&'b self, about: &About<'b>) -> Option<Follower<'b>> {
        let About { found, study, data, scales } = *about;
        let (runs, user) = (self.predictor.runs, self.predictor.user);
        Some(Follower { study, data, runs, scales, user, linear: found.found.linear.as_ref()? })
    }

    /// Errors about the machine as it is.
    pub fn errors(&self) -> Errors {
        self.errors_about(&self.as_it_is())
    }

    /// Whether the machine is followed to first order.
    pub fn is_followed(&self) -> bool {
        self.base.found.linear.is_some()
    }

    /// Slopes in every visible cause about the machine as it is, by the functions that causes are screened by, K per scale.
    pub fn along(&self) -> Vec<Vec<Vec<f64>>> {
        let own: Vec<Hypothesis> = self.visible.iter().map(|(h, _)| (*h).clone()).collect();
        let units: Vec<f64> = self.sizes.iter().map(|size| size.slope(0.0)).collect();
        let scaled = |((_, column), unit): (&(&Hypothesis, &Vec<f64>), &f64)| column.iter().map(|c| c * unit).collect::<Vec<f64>>();
        let means: Vec<Vec<f64>> = self.visible.iter().zip(&units).map(scaled).collect();
        let units: Vec<Units> = units.into_iter().map(Units::Alike).collect();
        self.slopes(&self.as_it_is(), (&own, &units), means, self.functions.screened)
    }

    /// Slopes of the readings in causes by the first functions of the rows, K per scale, about a machine in which `means` are those in the mean.
    /// `units` are the causes' own units per unit of the scale.
    fn slopes(&self, about: &About<'_>, (own, units): (&[Hypothesis], &[Units]), means: Vec<Vec<f64>>, count: usize) -> Vec<Vec<Vec<f64>>> {
        let courses: Vec<Vec<f64>> = (1..count).map(|f| self.functions.functions.column(f).iter().copied().collect()).collect();
        let products: Vec<Vec<Cow<'_, [f64]>>> =
            units.iter().map(|units| courses.iter().map(|course| units.times(course)).collect()).collect();
        let courses_of =
            |h: usize| products[h].iter().enumerate().map(move |(c, values)| (h, Along { values, is_held: self.is_step(c + 1) }));
        let wanted: Vec<(usize, Along<'_>)> = (0..own.len()).filter(|h| !own[*h].is_sensor()).flat_map(courses_of).collect();
        let found = match self.follower(about) {
            Some(follower) if !courses.is_empty() => follower.along(own, &wanted, self.stride).unwrap_or_else(|_| vec![None; wanted.len()]),
            _ => vec![None; wanted.len()],
        };
        let places = whiten::places(about.data);
        let mut all: Vec<Vec<Vec<f64>>> = means.into_iter().map(|mean| vec![mean]).collect();
        for ((h, _), column) in wanted.iter().zip(found) {
            all[*h].push(units[*h].scaled(column.unwrap_or_else(|| vec![0.0; places.len()])));
        }
        // What acts on a reading acts at its own row.
        for (_, columns) in all.iter_mut().enumerate().filter(|(h, _)| own[*h].is_sensor()) {
            let at_rows = |course: &Vec<f64>| places.iter().zip(&columns[0]).map(|((row, _), x)| x * course[*row]).collect::<Vec<f64>>();
            let further: Vec<Vec<f64>> = courses.iter().map(at_rows).collect();
            columns.extend(further);
        }
        all
    }

    /// Errors about a machine: what is stated, starting temperatures, numbers, and the disturbance.
    fn errors_about(&self, about: &About<'_>) -> Errors {
        let (found, study, data) = (about.found, about.study, about.data);
        let user = self.predictor.user;
        let known: Vec<&str> = self.into_parts.iter().map(|(h, _)| h.place.as_str()).collect();
        let heats: Vec<Hypothesis> =
            hypotheses(study, data, user).into_iter().filter(|h| is_heat(h) && known.contains(&h.place.as_str())).collect();
        let group = |h: &Hypothesis| if let Effect::Heat(Heat::Into(group)) = h.effect { Some(group) } else { None };
        let groups: Vec<u32> = heats.iter().filter_map(group).collect();
        let mut stated = found.errors.shared();
        let scaled = |column: Vec<f64>, by: f64| column.iter().map(|c| c * by).collect::<Vec<f64>>();
        let size = |h: &Hypothesis| if self.heat > 0.0 { self.heat } else { h.scale };
        let heated = match self.follower(about) {
            Some(follower) => {
                if matches!(self.problem.start, Start::Readings | Start::Parts) {
                    let deviations = self.starts(study, &groups);
                    stated.extend(follower.starts(&groups, self.stride).into_iter().zip(deviations).map(|(c, by)| scaled(c, by)));
                }
                let courses: Vec<(usize, Along<'_>)> =
                    (0..heats.len()).flat_map(|h| self.hats.iter().map(move |hat| (h, Along::straight(hat)))).collect();
                let columns = follower.along(&heats, &courses, self.stride).unwrap_or_default();
                courses.iter().zip(columns).filter_map(|((h, _), c)| Some(scaled(c?, size(&heats[*h])))).collect()
            }
            None => {
                let places = whiten::places(data);
                let of = |(h, column): &(&Hypothesis, &Vec<f64>)| {
                    let in_test = |hat: &Vec<f64>| places.iter().zip(*column).map(|((row, _), c)| c * hat[*row] * size(h)).collect();
                    self.hats.iter().map(in_test).collect::<Vec<Vec<f64>>>()
                };
                self.into_parts.iter().flat_map(of).collect()
            }
        };
        let most = self.settings.wandering_heats.iter().copied().fold(0.0, f64::max);
        let noise = found.errors.noise().to_vec();
        // One test shows nothing that differs from test to test.
        let (levels, conditions): (Vec<Vec<f64>>, Vec<Vec<f64>>) = match data.tests().len() {
            0 | 1 => Default::default(),
            _ => {
                let shared = whiten::common_errors(data, &self.problem.uncertainty, &found.found.prediction.conditions);
                (self.levels(about), shared.into_iter().skip(data.sensors.len()).collect())
            }
        };
        let (numbers, heats) = (found.errors.numbers().to_vec(), few(heated, &noise, LOST / (most * most)));
        let columns = stated.len() + numbers.len() + heats.len() + levels.len() + conditions.len();
        Errors {
            row_of: self.stretches.clone(),
            stated,
            uncertain: uncertain(&found.errors),
            numbers,
            heats,
            levels,
            noise,
            conditions,
            wrong_conditions: Vec::new(),
            biases: data.sensors.len(),
            aside: Vec::new(),
            wide: 0.0,
            log: Some(LogNoise::new(found.errors.clone(), self.settings.wandering_memory, [self.stretches.len(), columns])),
        }
    }

    /// Change of the readings with the level of all heats in each test, K.
    fn levels(&self, about: &About<'_>) -> Vec<Vec<f64>> {
        let sources: Vec<Hypothesis> =
            hypotheses(about.study, about.data, self.predictor.user).into_iter().filter(Hypothesis::is_source).collect();
        let tests = hats(about.data, 1);
        let courses: Vec<(usize, Along<'_>)> =
            tests.iter().flat_map(|own| (0..sources.len()).map(move |s| (s, Along { values: own, is_held: true }))).collect();
        let found = self.follower(about).and_then(|follower| follower.along(&sources, &courses, self.stride).ok());
        let columns: Vec<Vec<f64>> = found.into_iter().flatten().flatten().collect();
        columns.chunks(sources.len().max(1)).filter_map(|of_test| sum(of_test.to_vec())).collect()
    }

    /// Standard deviation of the temperature of each group at the start of each test, K: where a sensor is, what it may be off by and what the
    /// start leaves out of its first reading; elsewhere how far the sensors, the surroundings and the water are from the sensors' mean.
    fn starts(&self, study: &Study, groups: &[u32]) -> Vec<f64> {
        let (data, uncertainty) = (&self.problem.data, &self.problem.uncertainty);
        let (network, measurands) = (&study.model.network, data.measurands(&study.model.machine));
        let mut all = Vec::new();
        for test in data.tests() {
            let rows: Vec<_> = data.rows.iter().filter(|row| row.test == test).collect();
            let Some(first) = rows.iter().find(|row| row.has_readings()) else { continue };
            let is_temperature = |k: usize| measurands[k] == Measurand::Temperature;
            let begun: Vec<f64> = first.readings.iter().enumerate().filter(|(k, _)| is_temperature(*k)).filter_map(|(_, t)| *t).collect();
            let load = Load::at(&study.model.machine, &first.condition).ok();
            let around = load.iter().flat_map(|load| load.inlets.iter().copied().chain([load.chamber]));
            let all_begun: Vec<f64> = begun.iter().copied().chain(around).collect();
            let known = if begun.is_empty() { &all_begun } else { &begun };
            let mean = known.iter().sum::<f64>() / known.len().max(1) as f64;
            let apart = all_begun.iter().map(|t| (t - mean).powi(2)).sum::<f64>() / all_begun.len().max(1) as f64;
            let own_error = |k: usize| uncertainty.noise[k].hypot(uncertainty.bias[k]);
            let least = (0..data.sensors.len()).filter(|k| is_temperature(*k)).map(own_error).fold(0.0, f64::max);
            for group in groups {
                let is_in = |k: &usize| network.sensors[data.sensors[*k]].weights.iter().any(|(n, _)| network.group[*n as usize] == *group);
                let own = (0..data.sensors.len()).find(|k| is_in(k) && first.readings[*k].is_some());
                all.push(match own {
                    Some(k) => {
                        let left_out = if self.problem.start == Start::Parts { 0.0 } else { first.readings[k].map_or(0.0, |t| t - mean) };
                        own_error(k).hypot(left_out)
                    }
                    None => least.hypot(apart.sqrt()),
                });
            }
        }
        all
    }

    /// The machine with causes in force by coefficients in units of their scales, made linear; `None` where it cannot be. Its errors are `known`
    /// ones where there are some.
    pub fn about(&self, members: &[usize], amplitudes: &[Vec<f64>], with_all: bool, known: Option<&Errors>) -> Option<(Reference, Errors)> {
        self.base.found.linear.as_ref()?;
        let user = self.predictor.user;
        let own: Vec<&Hypothesis> = members.iter().map(|m| self.visible[*m].0).collect();
        let within: Vec<Vec<f64>> = members.iter().zip(amplitudes).map(|(m, own)| self.within(*m, own)).collect();
        let amplitudes = &within[..];
        let (problem, laws) = self.forced(members, amplitudes)?;
        let scales = Scales::of(&problem.data, &problem.study.model.machine);
        let study = &problem.study;
        let (data, catalogue) = (&problem.data, self.catalogue);
        let found = self.base.about(&problem, study, catalogue, &scales).ok()?;
        let about = About { found: &found, study, data, scales: &scales };
        let values = &found.found.prediction.values;
        // The same causes in the machine that has them.
        let there = hypotheses(study, data, user);
        let same = |h: &Hypothesis| {
            let is = |other: &&Hypothesis| (other.kind(), &other.place, other.law) == (h.kind(), &h.place, h.law);
            there.iter().find(is).unwrap_or(h).clone()
        };
        let asked: Vec<usize> = if with_all { (0..self.visible.len()).collect() } else { Vec::new() };
        let all: Vec<usize> = members.iter().chain(&asked).copied().collect();
        let there: Vec<Hypothesis> = all.iter().map(|m| same(self.visible[*m].0)).collect();
        let of_members = members.iter().zip(amplitudes).map(|(m, own)| self.units(*m, own));
        let units: Vec<Units> = of_members.chain(asked.iter().map(|m| Units::Alike(self.sizes[*m].slope(0.0)))).collect();
        let ones = vec![1.0; data.rows.len()];
        let courses: Vec<Cow<'_, [f64]>> = units.iter().map(|units| units.times(&ones)).collect();
        let wanted: Vec<(usize, Along<'_>)> = courses.iter().enumerate().map(|(h, course)| (h, Along::straight(course))).collect();
        let columns = self.follower(&about)?.along(&there, &wanted, self.stride).ok()?;
        let machine = (&scales, &study.model.machine, data);
        let shown = force::shown(machine, values, &laws, None);
        let mean = |(k, column): (usize, Option<Vec<f64>>)| match column {
            _ if there[k].is_sensor() => {
                let more = force::shown(machine, values, &laws, Some((k, &there[k], STEP * self.sizes[all[k]].slope(0.0))));
                more.iter().zip(&shown).map(|(a, b)| (a - b) / STEP).collect()
            }
            column => units[k].scaled(column.unwrap_or_else(|| vec![0.0; values.len()])),
        };
        let mut of_members: Vec<Vec<f64>> = columns.into_iter().enumerate().map(mean).collect();
        let of_all = of_members.split_off(own.len());
        let (here, others) = (0..own.len(), own.len()..all.len());
        let slopes = self.slopes(&about, (&there[here.clone()], &units[here]), of_members, self.functions.of.len());
        let change = shown.iter().zip(&self.base.found.prediction.values).map(|(a, b)| a - b).collect();
        let others = self.slopes(&about, (&there[others.clone()], &units[others]), of_all, self.functions.screened);
        let of = |columns: Vec<Vec<Vec<f64>>>| columns.into_iter().map(Slope::OfFunctions).collect();
        let reference =
            Reference { amplitudes: amplitudes.to_vec(), change, slopes: of(slopes), others: of(others), exchanges: Vec::new() };
        Some((reference, known.cloned().unwrap_or_else(|| self.errors_about(&about))))
    }

    /// The machine and its data with members in force, and the law of each.
    fn forced(&self, members: &[usize], amplitudes: &[Vec<f64>]) -> Option<(Problem, Vec<(Hypothesis, f64)>)> {
        let acting = |(m, own): (&usize, &Vec<f64>)| Acting {
            hypothesis: self.visible[*m].0,
            values: self.course(*m, own),
            is_held: (0..own.len()).all(|f| own[f] == 0.0 || self.is_step(f)),
        };
        let acting: Vec<Acting<'_>> = members.iter().zip(amplitudes).map(acting).collect();
        let Problem { study, data, uncertainty, .. } = self.problem;
        let courses = Courses::new(self.predictor, (study, data), &acting)?;
        let given = &study.model.machine.variables;
        let own = courses.data(given, data, &acting);
        let before = |name: &str| given.iter().position(|own| own.name == name);
        let stated = |name: &str| before(name).and_then(|v| uncertainty.variables.get(v).copied()).unwrap_or_default();
        let variables = courses.study.model.machine.variables.iter().map(|v| stated(&v.name)).collect();
        let uncertainty = MeasurementUncertainty { variables, ..uncertainty.clone() };
        Some((Problem { study: courses.study, data: own, uncertainty, ..self.problem.clone() }, courses.laws))
    }

    /// Whether a function changes by jumps alone. What a cause does sets in at a row: the sum of two causes that set in at neighbouring rows is,
    /// to first order, one that sets in between them.
    fn is_step(&self, function: usize) -> bool {
        match self.functions.of[function] {
            Function::Constant => true,
            Function::When(law) => {
                self.when.get(law - self.names.len()).is_some_and(|law| !matches!(law, FoundLaw::Over(_, Course::Straight)))
            }
            Function::Linear(_) | Function::Smooth(_) => false,
        }
    }

    /// Units of a cause of the machine that has it per unit of the scale: with an amplitude a number moves by its logarithm, and a factor counts
    /// from the machine as it is.
    fn units(&self, member: usize, coefficients: &[f64]) -> Units {
        let (size, h) = (self.sizes[member], self.visible[member].0);
        let positions = self.functions.course(coefficients);
        let amplitudes = self.course(member, coefficients);
        let units = positions.iter().zip(amplitudes).map(|(x, amplitude)| size.slope(*x) * h.per_unit_of(amplitude)).collect::<Vec<f64>>();
        match units.first() {
            Some(first) if units.iter().all(|unit| unit == first) => Units::Alike(*first),
            _ => Units::OfRows(units),
        }
    }

    /// The course of an amplitude over all rows, in its unit.
    fn course(&self, member: usize, coefficients: &[f64]) -> Vec<f64> {
        let (least, most) = self.visible[member].0.range();
        self.functions.course(coefficients).iter().map(|a| self.sizes[member].amplitude(*a).clamp(least, most)).collect()
    }

    /// Coefficients of an amplitude whose course is within its range: of the same functions, those next to the course that is cut off there. The
    /// linear model is about what is in force, and no more than the range is.
    fn within(&self, member: usize, coefficients: &[f64]) -> Vec<f64> {
        let (size, (least, most)) = (self.sizes[member], self.visible[member].0.range());
        let (least, most) = (size.position(least), size.position(most));
        let course = self.functions.course(coefficients);
        if course.iter().all(|a| (least..=most).contains(a)) {
            return coefficients.to_vec();
        }
        let acting: Vec<usize> = (0..coefficients.len()).filter(|f| coefficients[*f] != 0.0).collect();
        let functions = self.functions.functions.select_columns(&acting);
        let less = DVector::from_iterator(course.len(), course.iter().map(|a| a.clamp(least, most) - a));
        let mut all = coefficients.to_vec();
        if let Ok(change) = SVD::new(functions.tr_mul(&functions), true, true).solve(&functions.tr_mul(&less), ALIKE) {
            acting.iter().zip(change.iter()).for_each(|(f, change)| all[*f] += change);
        }
        all
    }
}

/// A cause's own units per unit of its scale. Few causes have others in every row, and logs many rows.
enum Units {
    /// Alike in all rows.
    Alike(f64),
    /// In every row.
    OfRows(Vec<f64>),
}

impl Units {
    /// A course times those that are not alike.
    fn times<'c>(&self, course: &'c [f64]) -> Cow<'c, [f64]> {
        match self {
            Self::Alike(_) => Cow::Borrowed(course),
            Self::OfRows(units) => units.iter().zip(course).map(|(unit, f)| unit * f).collect(),
        }
    }

    /// A column times those that are alike.
    fn scaled(&self, mut column: Vec<f64>) -> Vec<f64> {
        if let Self::Alike(unit) = self {
            column.iter_mut().for_each(|c| *c *= unit);
        }
        column
    }
}

/// Few columns with the covariance of many, K: of each reading they lose no more than a share of the variance of its noise.
fn few(columns: Vec<Vec<f64>>, noise: &[f64], share: f64) -> Vec<Vec<f64>> {
    let scaled: Vec<DVector<f64>> =
        columns.iter().map(|column| DVector::from_iterator(noise.len(), column.iter().zip(noise).map(|(c, n)| c / n))).collect();
    if scaled.is_empty() || !share.is_finite() {
        return columns;
    }
    let by_reading = DMatrix::from_columns(&scaled).transpose();
    let variances = by_reading.column_iter().map(|own| own.norm_squared()).collect();
    let found = low_rank(variances, |i| by_reading.tr_mul(&by_reading.column(i)).data.into(), share);
    found.into_iter().map(|column| column.iter().zip(noise).map(|(c, n)| c * n).collect()).collect()
}

/// A machine beside its data.
struct About<'a> {
    found: &'a Comparison,
    study: &'a Study,
    data: &'a Data,
    scales: &'a Scales,
}

/// Rows that have readings.
pub fn rows_that_count(data: &Data) -> Vec<usize> {
    (0..data.rows.len()).filter(|row| data.rows[*row].has_readings()).collect()
}

fn is_heat(h: &Hypothesis) -> bool {
    matches!(h.effect, Effect::Heat(Heat::Into(_))) && h.law == Law::Constant
}

/// Rows of each test, in the order of the tests.
fn rows_of_tests(data: &Data) -> Vec<Vec<usize>> {
    data.tests().iter().map(|test| (0..data.rows.len()).filter(|row| data.rows[*row].test == *test).collect()).collect()
}

/// Whether values change within a test: what only labels tests is no law.
fn varies_within_tests(data: &Data, values: &[f64]) -> bool {
    rows_of_tests(data).iter().any(|rows| {
        let size = rows.iter().map(|row| values[*row].abs()).fold(0.0, f64::max);
        rows.iter().any(|row| (values[*row] - values[rows[0]]).abs() > 1e-9 * size)
    })
}

/// Time that has passed in every row since the start of its test, s.
fn times(data: &Data) -> Vec<f64> {
    let mut all = vec![0.0; data.rows.len()];
    for rows in rows_of_tests(data) {
        let time = |row: usize| data.rows[row].time.unwrap_or(0.0);
        let start = rows.first().map_or(0.0, |row| time(*row));
        rows.iter().for_each(|row| all[*row] = time(*row) - start);
    }
    all
}

/// Instants between two rows, as the machine file's variable of the time has them.
fn onsets(problem: &Problem) -> Vec<f64> {
    let Some(v) = problem.study.model.machine.variables.iter().position(|v| v.name == TIME) else { return Vec::new() };
    let mut times: Vec<f64> = problem.data.rows.iter().map(|row| row.condition.si()[v]).collect();
    times.sort_by(f64::total_cmp);
    times.dedup();
    times.windows(2).map(|pair| 0.5 * (pair[0] + pair[1])).collect()
}

/// The instant at which a law of the time sets in, if it does, s.
fn instant(law: &FoundLaw) -> Option<f64> {
    match law {
        FoundLaw::Over(axis, Course::Above(at)) if axis.is_time() => Some(at * axis.per_unit),
        _ => None,
    }
}

/// Laws of the time: growing from the start of a test on, after some instants of it, in one test alone, and from a test on.
fn laws_of_time(problem: &Problem, scales: &Scales, onsets: &[f64]) -> Vec<FoundLaw> {
    let (data, variables) = (&problem.data, &problem.study.model.machine.variables);
    let axis = |name: &str| variables.iter().position(|v| v.name == name).map(|v| scales.axis(v).0);
    let mut all = Vec::new();
    if let Some(axis) = axis(TIME).filter(|axis| axis.most > axis.least) {
        all.push(FoundLaw::over(&axis, Course::Straight));
        all.extend(onsets.iter().map(|at| FoundLaw::over(&axis, Course::Above(at / axis.per_unit))));
    }
    let tests = data.tests().len();
    if let Some(axis) = axis(TEST_NUMBER).filter(|_| (2..=MOST_TESTS).contains(&tests)) {
        all.extend((1..=tests).map(|n| FoundLaw::over(&axis, Course::Only(n as f64))));
        all.extend((2..tests).map(|n| FoundLaw::over(&axis, Course::Above(n as f64 - 0.5))));
    }
    all
}

/// Functions of all rows that are one at a knot of a test, and fall to nothing at the next ones; one knot is the whole test.
fn hats(data: &Data, knots: usize) -> Vec<Vec<f64>> {
    let mut all = Vec::new();
    for rows in rows_of_tests(data) {
        let time = |row: &usize| data.rows[*row].time.unwrap_or(0.0);
        let (start, end) = (rows.first().map_or(0.0, time), rows.last().map_or(0.0, time));
        for knot in 0..knots {
            let mut hat = vec![0.0; data.rows.len()];
            for row in &rows {
                let place = (time(row) - start) / (end - start).max(f64::MIN_POSITIVE) * (knots.max(2) - 1) as f64;
                hat[*row] = if knots == 1 { 1.0 } else { (1.0 - (place - knot as f64).abs()).max(0.0) };
            }
            all.push(hat);
        }
    }
    all
}

/// Stretch that each reading is kept out with: its test, or a part of the time of it where tests are few.
fn stretches(data: &Data) -> Vec<usize> {
    let tests = rows_of_tests(data);
    let parts = STRETCHES.div_ceil(tests.len().max(1)).max(1);
    let mut of_row = BTreeMap::new();
    for (t, rows) in tests.iter().enumerate() {
        for (i, row) in rows.iter().enumerate() {
            of_row.insert(*row, t * parts + i * parts / rows.len());
        }
    }
    whiten::places(data).iter().map(|(row, _)| of_row[row]).collect()
}
