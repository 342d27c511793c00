//! The machine as it is beside the data: every place and kind fitted, sets grown, laws told.

use std::collections::{BTreeSet, HashMap};
use std::sync::{Arc, OnceLock};

use rayon::prelude::*;

use super::course::Courses;
use super::evidence::Freedom;
use super::force;
use super::gross::Gross;
use super::laws::{Laws, Rule};
use super::logs::{Log, rows_that_count};
use super::profiles::Profiles;
use super::ranking::{
    REFINED, best_of_each_size, difference, most_probable, resampled, sum_and_error, that_predict_more, whole, with_certain_first,
};
use super::response::{Answer, Response, shows, sum};
use super::rows::{Errors, Recent, Rows, uncertain};
use super::search::{About, Candidate, Fit, Search, Sought};
use super::sets::{self, seen};
use super::settings::AmplitudeSettings;
use super::sizing::Sizing;
use super::steady::{KEPT_MACHINES, Table};
use super::ways::{FoundWay, Ways};
use super::{PlaceAndKind, PlaceSet, Places, Way};
use crate::effects::{Axis, Common, Effect, FoundLaw, Heat, Hypothesis, Law, Scales, Sensor, hypotheses};
use crate::open_numbers::{OpenNumber, open_numbers};
use crate::predictor::Predictor;
use crate::view::Comparison;
use crate::{Cause, Problem};
use coldplate_base::error::Result;
use coldplate_base::progress::Progress;
use coldplate_evidence::discrepancy::DiscrepancySize;
use coldplate_evidence::identify::chi_square_tail;
use coldplate_evidence::measurement::{MeasurementUncertainty, ReadingRow, TIME, VariableUncertainty, whiten};
use coldplate_network::Load;

/// Amplitudes at which the machine is solved for each cause that bends, in units of its scale.
const KNOTS: [f64; 6] = [-5.0, -2.5, -1.0, 1.0, 2.5, 5.0];
/// Amplitudes of a cause that can only be more, in units of its scale. A machine of cells, whose solves take long, has the first three.
const KNOTS_OF_MORE: [f64; 6] = [1.0, 2.5, 5.0, 15.0, 50.0, 150.0];
/// Ways whose probability is less are not asked what they predict of rows kept out: none of them is the answer.
const LEAST_KEPT_OUT: f64 = 0.01;
/// Sets of each size that are so fitted to tables of a machine of cells, and to its logs, where each takes several runs.
const REFINED_OF_CELLS: [usize; 2] = [6, 3];
/// Causes that bend and are solved at several amplitudes in tables of a machine of cells, and in its logs: those that explain most where each
/// row has its own amplitude. A path, a film or a contact changes a row's readings by one pattern, however large it is; its size bends, which
/// the amplitudes of the rows take up.
const RUN_OF_CELLS: [usize; 2] = [48, 12];
/// Sets of a log whose posterior is further behind the best one of their size, in logarithms, say nothing of the answer.
const COUNTS: f64 = 10.0;

/// The machine as it is beside the data, with all that could be wrong with it.
pub(crate) struct Beside<'p> {
    /// The problem.
    pub problem: &'p Problem,
    /// Places and kinds, each under its usual law, and those that may change with the temperature of their place under that law too.
    pub catalogue: Vec<Hypothesis>,
    /// Where laws are one.
    pub scales: Scales,
    /// Predictions, residual, signatures of the catalogue, and covariance.
    pub base: Comparison,
}

impl<'p> Beside<'p> {
    /// Of a problem.
    ///
    /// # Errors
    /// The machine as it is cannot be solved at the data's conditions.
    pub fn of(problem: &'p Problem) -> Result<Self> {
        let (study, data) = (&problem.study, &problem.data);
        let scales = Scales::of(data, &study.model.machine);
        let mut catalogue = hypotheses(study, data, &problem.user);
        catalogue.retain(|h| h.law == h.effect.usual_law() || h.is_drift());
        // A temperature whose uncertainty the user states is as certain as that.
        let usual = MeasurementUncertainty::usual(data, &study.model.machine).variables;
        let is_stated = |v: usize| problem.uncertainty.file.is_some() && problem.uncertainty.variables[v] != usual[v];
        catalogue.retain(|h| h.variable().is_none_or(|v| !is_stated(v)));
        let base = Comparison::of(problem, study, &catalogue, &scales)?;
        Ok(Self { problem, catalogue, scales, base })
    }

    /// The same where further laws are known.
    pub fn knowing(self, scales: Scales) -> Self {
        Self { scales, ..self }
    }

    /// The covariance of a table's readings without any cause.
    pub fn errors(&self) -> Errors {
        let Self { problem, base, catalogue, .. } = self;
        let places = whiten::places(&problem.data);
        let machine = &problem.study.model.machine;
        let loads = problem.data.rows.iter().filter_map(|row| Load::at(machine, &row.condition).ok());
        let heats: Vec<f64> = loads.flat_map(|load| load.powers).map(f64::abs).collect();
        let mean = heats.iter().sum::<f64>() / heats.len().max(1) as f64;
        let columns = |is: &dyn Fn(&Hypothesis) -> bool| {
            let all = catalogue.iter().zip(&base.found.columns).filter(|(h, _)| is(h)).map(|(_, column)| column.clone());
            all.collect::<Vec<Vec<f64>>>()
        };
        let into = columns(&|h| matches!(h.effect, Effect::Heat(Heat::Into(_))) && h.law == Law::Constant);
        // From test to test the level of all sources together differs too: one supply, one load.
        let levels = sum(columns(&Hypothesis::is_source));
        let condition = |(v, stated): (usize, &VariableUncertainty)| -> Vec<f64> {
            let size = |row: &usize| stated.absolute.max(stated.relative * problem.data.rows[*row].condition.si()[v].abs());
            let slopes = base.found.prediction.conditions.iter().map(|slopes| slopes[v]);
            places.iter().zip(slopes).map(|((row, _), slope)| size(row) * slope).collect()
        };
        let heats = into.into_iter().map(|own| own.iter().map(|c| c * mean).collect()).collect();
        Errors {
            row_of: consecutive(places.iter().map(|(row, _)| *row)),
            noise: base.errors.noise().to_vec(),
            stated: base.errors.shared(),
            uncertain: uncertain(&base.errors),
            numbers: base.errors.numbers().to_vec(),
            heats,
            levels: levels.into_iter().collect(),
            conditions: problem.uncertainty.variables.iter().enumerate().map(condition).collect(),
            wrong_conditions: Vec::new(),
            biases: problem.data.sensors.len(),
            aside: Vec::new(),
            wide: 0.0,
            log: None,
        }
    }

    /// Predictions with causes in force.
    pub fn predictor(&self) -> Predictor<'_> {
        Predictor {
            study: &self.problem.study,
            data: &self.problem.data,
            predicted: &self.base.found.prediction.values,
            fields: &self.base.found.fields,
            runs: self.problem.runs(),
            scales: &self.scales,
            user: &self.problem.user,
        }
    }

    /// Whether a cause may be named: what may not leaves the machine as uncertain as it is.
    fn may_be_named(&self, h: &Hypothesis) -> bool {
        self.problem.without.iter().all(|kind| kind != h.kind())
    }

    /// How many causes may be named.
    pub fn count(&self) -> usize {
        self.catalogue.iter().filter(|h| self.may_be_named(h)).count()
    }

    /// Causes that show, each with the change of the readings with it, K per unit.
    fn visible(&self) -> Vec<(&Hypothesis, &Vec<f64>)> {
        let known = self.catalogue.iter().zip(&self.base.found.columns);
        known.filter(|(h, column)| self.may_be_named(h) && shows(column)).collect()
    }

    fn sizes(&self, visible: &[(&Hypothesis, &Vec<f64>)]) -> Vec<Sizing> {
        let network = &self.problem.study.model.network;
        visible.iter().map(|(h, _)| Sizing::of(h, network, is_straight(h))).collect()
    }

    /// Flags of the readings of a log: true of the first ones of each test.
    fn is_first(&self) -> Vec<bool> {
        let test = |row: usize| &self.problem.data.rows[row].test;
        let mut first: Option<usize> = None;
        let mut is_in_first = |row: usize| {
            first = first.filter(|first| test(*first) == test(row)).or(Some(row));
            first == Some(row)
        };
        whiten::places(&self.problem.data).into_iter().map(|(row, _)| is_in_first(row)).collect()
    }

    /// Probability that the first readings of the tests of a log are as far from the machine as it is as they are, or further, by all that is
    /// stated of their errors.
    pub fn chance_of_firsts(&self) -> f64 {
        let deviations = self.base.errors.marginal(&DiscrepancySize::NONE);
        let own = self.base.found.residual.iter().zip(deviations).zip(self.is_first()).filter(|(_, is_first)| *is_first);
        let squares: Vec<f64> = own.map(|((r, d), _)| (r / d).powi(2)).collect();
        chi_square_tail(squares.iter().sum(), squares.len().max(1))
    }

    /// Logarithm of the posterior of the best single cause of a log, or of none, in force with an amplitude that is alike in all rows, for what
    /// follows the first readings of each test: the density of all readings over that of the first ones given the others.
    pub fn best_single(&self, settings: &AmplitudeSettings) -> f64 {
        let (predictor, visible) = (self.predictor(), self.visible());
        let sizes = self.sizes(&visible);
        let log = Log::new(self.problem, &predictor, (&self.base, &self.catalogue), (&visible, &sizes), settings).with_means_alone();
        let (places, is_first) = (whiten::places(&self.problem.data), self.is_first());
        // First readings and what follows them, by turns.
        let row_of = consecutive(places.iter().zip(&is_first).map(|((row, _), first)| if *first { *row } else { usize::MAX }));
        let errors = Errors { row_of, ..log.errors() };
        let is_costly = self.problem.study.model.mesh.cells > 0;
        let means = candidates(&predictor, (&visible, &sizes), !is_costly, settings);
        let in_time = |own: Candidate| own.in_time(Vec::new(), false);
        let means: Vec<Candidate> = means.into_iter().map(in_time).collect();
        let (profiles, _) = log.profiles();
        let about = |members: &[usize], amplitudes: &[Vec<f64>], with_all: bool, known: Option<&Errors>| {
            let (reference, own) = log.about(members, amplitudes, with_all, known)?;
            Some((reference, Errors { row_of: errors.row_of.clone(), ..own }))
        };
        let about: Option<About<'_>> = if log.is_followed() { Some(&about) } else { None };
        let search = Search::new(&errors, &self.base.found.residual, &means, settings, about, (&profiles, &profiles));
        let nothing = search.nothing();
        let most = if is_costly { REFINED_OF_CELLS[1] } else { REFINED };
        let singles = sets::refined(&search, most, search.singles(&nothing));
        let best = singles.into_iter().next().filter(|best| best.log_posterior() > nothing.log_posterior());
        let best = best.unwrap_or(nothing);
        let firsts = errors.row_of.iter().zip(&is_first).filter(|(_, first)| **first).map(|(row, _)| *row).collect::<BTreeSet<usize>>();
        let densities = seen(&search, &best).1;
        best.log_posterior() - firsts.into_iter().filter_map(|row| densities.get(row)).sum::<f64>()
    }

    /// Places and kinds by evidence.
    pub fn places(&self, settings: &AmplitudeSettings, progress: &dyn Progress) -> Places {
        let predictor = self.predictor();
        let (problem, base) = (self.problem, &self.base);
        progress.say(&format!("{} places and kinds, each at several amplitudes", self.count()));
        let visible = self.visible();
        let is_log = problem.data.is_transient();
        let sizes = self.sizes(&visible);
        let is_costly = problem.study.model.mesh.cells > 0;
        let mut candidates = candidates(&predictor, (&visible, &sizes), !is_costly, settings);
        let residual = &base.found.residual;
        let in_time = |log: &Log<'_>, along: &[Vec<Vec<f64>>], m: usize, own: Candidate| {
            let may_run = own.may_run && force::runs(&predictor, visible[m].0);
            own.in_time(along[m].clone(), may_run && log.is_followed())
        };
        let mut log = is_log.then(|| Log::new(problem, &predictor, (base, &self.catalogue), (&visible, &sizes), settings));
        let errors = log.as_ref().map_or_else(|| self.errors(), Log::errors);
        if let Some(log) = log.as_mut().filter(|log| log.is_followed()) {
            progress.say("instants at which causes set in");
            let (along, profiles) = (log.along(), log.profiles());
            let all: Vec<Candidate> = candidates.iter().cloned().enumerate().map(|(m, own)| in_time(log, &along, m, own)).collect();
            let search = Search::new(&errors, residual, &all, settings, None, (&profiles.0, &profiles.1));
            let found = search.singles(&search.nothing());
            log.look_closer(&found);
        }
        let (profiles, names) = match &log {
            None => {
                let (names, variables) = variables(problem);
                let count = rows_that_count(&problem.data).len();
                ((Profiles::constant(count), Profiles::smooth(count, &variables)), names)
            }
            Some(log) => (log.profiles(), log.names.clone()),
        };
        let (machines, attached) = (Recent::of(KEPT_MACHINES), OnceLock::new());
        let table = Table { problem, predictor: &predictor, base, errors: &errors, visible: &visible, sizes: &sizes, machines, attached };
        let about = |members: &[usize], amplitudes: &[Vec<f64>], with_all: bool, known: Option<&Errors>| match &log {
            Some(log) => log.about(members, amplitudes, with_all, known),
            None => table.about(members, amplitudes, known),
        };
        let is_followed = log.as_ref().is_none_or(Log::is_followed);
        let about: Option<About<'_>> = if is_followed { Some(&about) } else { None };
        let along = log.as_ref().map(Log::along);
        let in_time = |m: usize, own: Candidate| match log.as_ref().zip(along.as_ref()) {
            Some((log, along)) => in_time(log, along, m, own),
            None => own,
        };
        candidates = candidates.into_iter().enumerate().map(|(m, own)| in_time(m, own)).collect();
        let profiles = (&profiles.0, &profiles.1);
        let by_slope = if is_costly {
            progress.say("places and kinds by their slopes");
            let search = Search::new(&errors, residual, &candidates, settings, about, profiles);
            let bent = |m: &usize| !is_straight(visible[*m].0);
            let best: Vec<usize> = search
                .singles(&search.nothing())
                .iter()
                .map(|fit| fit.members[0])
                .filter(bent)
                .take(RUN_OF_CELLS[usize::from(is_log)])
                .collect();
            let run = |m: &usize| (*m, candidate(&predictor, visible[*m], sizes[*m], true));
            best.par_iter()
                .map(run)
                .collect::<Vec<_>>()
                .into_iter()
                .for_each(|(m, run)| candidates[m] = in_time(m, Candidate { rate: candidates[m].rate, ..run }));
            (0..visible.len()).filter(bent).count() - best.len()
        } else {
            0
        };
        let search = Search::new(&errors, residual, &candidates, settings, about, profiles);
        let gross = Gross::new(&search, problem, &base.found.prediction.conditions);
        let most = if is_costly { REFINED_OF_CELLS[usize::from(is_log)] } else { REFINED };
        let (nothing, mut all) = sets::fitted(&search, &gross, most, progress);
        all.push(nothing.clone());
        let (gross, nothing) = (&gross, &nothing);
        let when = log.as_ref().map_or(&[][..], |log| &log.when);
        let found = Found { beside: self, search: &search, gross, visible: &visible, sizes: &sizes, names: &names, when, nothing };
        let (sets, scales) = if is_log { found.in_time(all) } else { found.under_laws(all, progress) };
        Places { sets: with_certain_first(sets), tried: candidates.len(), by_slope, scales }
    }
}

/// What a search found.
struct Found<'a> {
    beside: &'a Beside<'a>,
    search: &'a Search<'a>,
    gross: &'a Gross<'a>,
    visible: &'a [(&'a Hypothesis, &'a Vec<f64>)],
    sizes: &'a [Sizing],
    /// Variables over which amplitudes may run.
    names: &'a [String],
    /// Laws of the time of a log, which are counted behind them.
    when: &'a [FoundLaw],
    nothing: &'a Fit,
}

impl Found<'_> {
    /// Sets of a log, most probable first, each with the course of its amplitudes. Errors of a log wander in ways that no model of them has, and
    /// thousands of readings count each of these as evidence for one place more. So each law and curve, too, must make stretches of time that
    /// are kept out more probable by more than the standard error of that.
    fn in_time(&self, all: Vec<Fit>) -> (Vec<PlaceSet>, Scales) {
        let (best, _) = best_of_each_size(all);
        let most =
            |size: usize| best.iter().filter(|fit| fit.members.len() == size).map(Fit::log_posterior).fold(f64::NEG_INFINITY, f64::max);
        let counts = |fit: &Fit| fit.log_posterior() > most(fit.members.len()) - COUNTS;
        let without: Vec<Fit> = best.par_iter().map(|fit| if counts(fit) { self.without_idle_laws(fit) } else { fit.clone() }).collect();
        // Sets before they lose laws are compared with too: a further place may stand for such a law.
        let best = that_predict_more(self.search, without, &best);
        let log_posteriors: Vec<f64> = best.iter().map(Fit::log_posterior).collect();
        let densities: Vec<Vec<f64>> = best.par_iter().map(|fit| seen(self.search, fit).1).collect();
        let probabilities = resampled(&log_posteriors, &densities, self.beside.problem.seed);
        let mut found: Vec<(Fit, f64)> = best.into_iter().zip(probabilities).collect();
        found.sort_by(|a, b| b.1.total_cmp(&a.1));
        let mut named = self.beside.scales.clone();
        let (problem, profiles) = (self.beside.problem, self.search.all_profiles);
        let courses = Courses { problem, profiles, names: self.names, when: self.when };
        let told = |(fit, probability): (Fit, f64)| {
            let set = self.told(&fit, 0.0);
            let causes: Vec<Cause> =
                set.members.iter().zip(&fit.amplitudes).map(|(member, own)| courses.told(member, own, &mut named)).collect();
            let numbers = self.open_numbers(&set, &causes);
            let kept_out = self.search.with_errors_of(&fit).kept_out(&fit, &numbers).map(Arc::new);
            let way = Way { probability: 1.0, is_writable: self.is_writable(&causes, &named), kept_out, causes };
            PlaceSet { ways: vec![way], probability, ..set }
        };
        (most_probable(found, |(fit, _)| fit).map(told).collect(), named)
    }

    /// A fit to a log without the laws and curves that do not make stretches of time that are kept out more probable, the idlest first.
    fn without_idle_laws(&self, fit: &Fit) -> Fit {
        let mut fit = fit.clone();
        loop {
            let own = seen(self.search, &fit).1;
            let search = self.search.with_errors_of(&fit);
            let idle = |freedoms: Vec<Freedom>| {
                let less = search.fit_from(Fit { freedoms, ..fit.clone() }, Sought::Near, true);
                let (sum, error) = sum_and_error(&difference(&own, &seen(self.search, &less).1));
                (less.log_evidence.is_finite() && sum <= error).then_some((sum - error, less))
            };
            let tried = (0..fit.members.len()).flat_map(|m| {
                let with =
                    |own: Freedom| fit.freedoms.iter().enumerate().map(|(k, f)| if k == m { own } else { *f }).collect::<Vec<Freedom>>();
                fit.freedoms[m].with_one_less().into_iter().map(with).collect::<Vec<_>>()
            });
            let found: Vec<(f64, Fit)> = tried.collect::<Vec<_>>().into_par_iter().filter_map(idle).collect();
            match found.into_iter().min_by(|a, b| a.0.total_cmp(&b.0)) {
                Some((_, less)) => fit = less,
                None => return fit,
            }
        }
    }

    fn is_writable(&self, causes: &[Cause], scales: &Scales) -> bool {
        let problem = self.beside.problem;
        let lines = |cause: &Cause| cause.hypothesis.written(&problem.study, &problem.data, scales, &problem.user, cause.amplitude);
        causes.iter().all(|cause| matches!(lines(cause), Ok(Some(_))))
    }

    /// Sets of a table, most probable first, with the laws of their members, and scales that know these.
    fn under_laws(&self, all: Vec<Fit>, progress: &dyn Progress) -> (Vec<PlaceSet>, Scales) {
        progress.say("laws");
        let Beside { problem, scales, .. } = self.beside;
        let machine = &problem.study.model.machine;
        let at = self.names.iter().map(|name| machine.variables.iter().position(|variable| variable.name == *name)).collect::<Vec<_>>();
        let axes: Vec<Option<Axis>> = at.iter().map(|v| v.map(|v| scales.axis(v).0)).collect();
        let laws = Laws::new(scales, machine, &problem.data, &at.into_iter().flatten().collect::<Vec<_>>());
        let (mut all, rest) = best_of_each_size(that_predict_more(self.search, all, &[]));
        let (_, variables) = variables(problem);
        let of = Ways { search: self.search, fit: self.nothing, laws: &laws, axes: &axes, variables: &variables };
        let ways: Vec<(f64, Vec<FoundWay>)> = all.par_iter().map(|fit| Ways { fit, ..of }.found()).collect();
        // The evidence of a set is that of all ways in which it can act.
        all.iter_mut().zip(&ways).for_each(|(fit, (log, _))| fit.log_evidence = *log);
        let whole = whole(all.iter().chain(&rest));
        let mut found: Vec<(Fit, (f64, Vec<FoundWay>))> = all.into_iter().zip(ways).collect();
        found.sort_by(|a, b| b.0.log_posterior().total_cmp(&a.0.log_posterior()));
        let mut named = scales.clone();
        let told = |(fit, (_, found)): (Fit, (f64, Vec<FoundWay>))| -> PlaceSet {
            let set = self.told(&fit, whole);
            let sizes: Vec<Sizing> = fit.members.iter().map(|m| self.sizes[*m]).collect();
            let told = |way: FoundWay| {
                let own = told(&way, (&set.members, &sizes), &mut named, problem);
                let is_told = fit.members.is_empty() || set.probability * way.probability > LEAST_KEPT_OUT;
                let kept_out = is_told.then(|| Ways { fit: &fit, ..of }.kept_out(&way, &self.open_numbers(&set, &own.causes))).flatten();
                Way { kept_out: kept_out.map(Arc::new), ..own }
            };
            let ways = found.into_iter().map(told).collect();
            PlaceSet { ways, ..set }
        };
        (most_probable(found, |(fit, _)| fit).map(told).collect(), named)
    }

    /// Numbers of the file that may be off beside causes of a set.
    fn open_numbers(&self, set: &PlaceSet, causes: &[Cause]) -> Vec<OpenNumber> {
        let Some(rows) = Rows::under(&set.errors, set.looseness) else { return Vec::new() };
        open_numbers(self.beside, causes, (&set.errors, &rows, &rows.deviations(set.looseness)))
    }

    /// A set beside the logarithm of the sum of all posteriors, without its laws.
    fn told(&self, fit: &Fit, whole: f64) -> PlaceSet {
        let (posterior, density) = seen(self.search, fit);
        let ground = seen(self.search, self.nothing).1;
        let profiles = self.search.all_profiles;
        let member = |(m, c): (usize, &usize)| {
            let own = if self.search.is_log() { profiles.course(&fit.amplitudes[m]) } else { fit.amplitudes[m].clone() };
            let freedom = &fit.freedoms[m];
            let laws = profiles.laws().into_iter().filter(|law| freedom.has(*law));
            let name = |v: usize| self.names.get(v).map_or(TIME, String::as_str);
            let mut over: Vec<&str> = freedom.curve.map(|((v, _), _)| v).into_iter().chain(laws).map(name).collect();
            over.dedup();
            PlaceAndKind {
                hypothesis: self.visible[*c].0.clone(),
                deviations: posterior[m].iter().zip(&own).map(|(d, a)| d * self.sizes[*c].slope(*a)).collect(),
                amplitudes: own.iter().map(|a| self.sizes[*c].amplitude(*a)).collect(),
                is_free: freedom.freedom > 0.0,
                over: (!over.is_empty()).then(|| over.join(", ")),
            }
        };
        PlaceSet {
            members: fit.members.iter().enumerate().map(member).collect(),
            ways: Vec::new(),
            lead: fit.log_mixture() - self.nothing.log_mixture(),
            probability: (fit.log_posterior() - whole).exp(),
            kept_out: sum_and_error(&difference(&density, &ground)),
            looseness: fit.looseness,
            lead_over_usual: self.search.lead_over_usual(fit),
            aside: self.gross.aside(fit),
            errors: fit.errors.clone().unwrap_or_else(|| Arc::new(self.search.errors.clone())),
        }
    }
}

/// A way as causes; its laws get names in the scales.
fn told(way: &FoundWay, (members, sizes): (&[PlaceAndKind], &[Sizing]), scales: &mut Scales, problem: &Problem) -> Way {
    let mut causes = Vec::with_capacity(members.len());
    for ((own, member), size) in way.causes.iter().cloned().zip(members).zip(sizes) {
        let h = &member.hypothesis;
        let under = match own.rule {
            None => h.clone(),
            Some(rule) => {
                let law = match rule {
                    Rule::Listed(law) => law,
                    Rule::Found(found) => scales.named(found),
                };
                own.number.map_or_else(|| h.clone().under_of(law, scales), |number| h.under_found(law, number, scales))
            }
        };
        let (amplitude, deviation) = own.amplitude;
        // A law is in proportion to the amplitude in the hypothesis' own unit, a constant may be of a number that moves by its logarithm.
        let (amplitude, deviation) = (size.amplitude(amplitude), deviation * size.slope(amplitude));
        causes.push(Cause::new(under, amplitude, deviation));
    }
    let lines = |cause: &Cause| cause.hypothesis.written(&problem.study, &problem.data, scales, &problem.user, cause.amplitude);
    let is_writable = causes.iter().all(|cause| matches!(lines(cause), Ok(Some(_))));
    Way { causes, probability: way.probability, is_writable, kept_out: None }
}

/// Variables of a steady table over which an amplitude may run, by name, with their values in the rows with readings; the order of the rows
/// is the last one.
fn variables(problem: &Problem) -> (Vec<String>, Vec<Vec<f64>>) {
    // Rows without a reading say nothing.
    let rows: Vec<&ReadingRow> = problem.data.rows.iter().filter(|row| row.has_readings()).collect();
    let value = |v: usize| rows.iter().map(|row| row.condition.si()[v]).collect::<Vec<f64>>();
    let own = problem.study.model.machine.variables.iter().enumerate().filter(|(_, variable)| problem.states(&variable.name));
    let own = own.map(|(v, variable)| (variable.name.clone(), value(v)));
    // In the order of the rows: what sets in or drifts while a table is taken.
    let order = ("row".to_string(), (0..rows.len()).map(|row| row as f64).collect());
    let varies = |(_, values): &(String, Vec<f64>)| values.iter().any(|x| *x != values[0]);
    own.chain([order]).filter(varies).unzip()
}

/// Whether the readings answer straight, however large it is.
fn is_straight(h: &Hypothesis) -> bool {
    h.is_fixed() || h.reads_course() || matches!(h.effect, Effect::Heat(_) | Effect::User(_))
}

/// Causes with their answers, each as often to blame as its kind is. A law is a choice that is not the plainest, and pays for it.
fn candidates(
    predictor: &Predictor<'_>,
    (visible, sizes): (&[(&Hypothesis, &Vec<f64>)], &[Sizing]),
    is_solved: bool,
    settings: &AmplitudeSettings,
) -> Vec<Candidate> {
    let mut of_kind: HashMap<&str, usize> = HashMap::new();
    visible.iter().for_each(|(h, _)| *of_kind.entry(h.kind()).or_default() += 1);
    let price = |h: &Hypothesis| if h.law == h.effect.usual_law() { 0.0 } else { settings.choice_price };
    let one = |(own, size): (&(&Hypothesis, &Vec<f64>), &Sizing)| Candidate {
        rate: own.0.rate(of_kind[own.0.kind()]) * (-price(own.0)).exp(),
        ..candidate(predictor, *own, *size, is_solved)
    };
    visible.par_iter().zip(sizes).map(one).collect()
}

/// A cause with its answer: straight where heats, offsets and exchanges are, else solved at several amplitudes, if it is to be.
fn candidate(predictor: &Predictor<'_>, (h, column): (&Hypothesis, &Vec<f64>), size: Sizing, is_solved: bool) -> Candidate {
    let (low, high) = if h.is_fixed() { (0.0, 1.0) } else { h.range() };
    let range = (size.position(low), size.position(high));
    let slope: Vec<f64> = column.iter().map(|c| c * size.slope(0.0)).collect();
    let mut answer = Answer::Straight(slope.clone());
    if is_solved && !is_straight(h) {
        let is_costly = predictor.study.model.mesh.cells > 0;
        let knots = if h.is_signed { &KNOTS } else { &KNOTS_OF_MORE[..if is_costly { 3 } else { 6 }] };
        let knots: Vec<f64> = knots.iter().copied().filter(|k| (range.0..=range.1).contains(k)).collect();
        let amplitudes: Vec<f64> = knots.iter().map(|knot| size.amplitude(*knot)).collect();
        let change = |(knot, found): (f64, Option<Vec<f64>>)| Some((knot, difference(&found?, predictor.predicted)));
        let mut solved: Vec<(f64, Vec<f64>)> = knots.into_iter().zip(predictor.at_each(h, &amplitudes)).filter_map(change).collect();
        solved.push((0.0, vec![0.0; column.len()]));
        solved.sort_by(|a, b| a.0.total_cmp(&b.0));
        if solved.len() > 2 {
            let (knots, changes) = solved.into_iter().unzip();
            answer = Answer::Bent(Response::new(knots, changes));
        }
    }
    // An error of a sensor or of a temperature around the machine that follows anything does what the wandering errors and the disturbance do,
    // and would explain everything by definition: it is there, sets in, or grows. A kind of the user's own has its law.
    let is_of_user = matches!(h.effect, Effect::User(_));
    let may_follow = !h.is_sensor() && h.unit != "K" && !is_of_user;
    let may_wander = may_follow && !matches!(h.effect, Effect::Heat(_));
    let (is_signed, may_run) = (h.is_signed && !h.is_fixed(), h.law == h.effect.usual_law());
    // An error of one sensor that is another in every row is noise, which is stated, or a broken sensor. What all members of a kind share may
    // follow something; where it is another in every row, it is the disturbance.
    let is_heats = h.effect == Effect::Common(Common::Heats);
    let may_vary = !is_heats && !is_of_user && (!h.is_sensor() || h.is_fixed() || h.effect == Effect::Sensor(Sensor::All));
    let may_scatter = may_vary && !matches!(h.effect, Effect::Common(_) | Effect::Sensor(Sensor::All));
    // Heats and paths that a machine lacks may have any size. A sensor that is off by many times the usual is broken, a case of the mixture.
    let has_tails = h.has_tails() && !h.is_sensor();
    Candidate {
        answer,
        is_signed,
        is_fixed: h.is_fixed(),
        range,
        has_tails,
        rate: 1.0,
        may_wander,
        may_follow,
        may_run,
        may_vary,
        may_scatter,
    }
}

/// Rising numbers, counted from zero without gaps.
pub(super) fn consecutive(rows: impl Iterator<Item = usize>) -> Vec<usize> {
    let (mut all, mut last) = (Vec::new(), None);
    for row in rows {
        let before = all.last().copied().unwrap_or(0);
        all.push(if last.is_some_and(|last| last != row) { before + 1 } else { before });
        last = Some(row);
    }
    all
}
