//! Uncertain numbers of a machine, as parameters with a standard deviation each, and the slopes of readings along them.
//!
//! There are three kinds of parameters: numbers that the file states as uncertain; factors that several numbers share; and, for every
//! kind of number, an assumed factor on all numbers of the kind for which the file states nothing.

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::difference::Variation;
use super::point::Derivatives;
use super::screen::Disturbance;
use crate::study::{MachineParameter, ParameterKind, Study};
use coldplate_base::document::Document;
use coldplate_base::error::{Error, Result, did_you_mean};
use coldplate_describe::machine::{Machine, NumberKind, SharedNumbers};
use coldplate_network::{Load, Network};

/// Relative residual that a parameter's field is solved to, dimensionless. Chosen: bands have two digits.
const AIM: f64 = 1e-5;
/// Largest deviation of a parameter from its value that may be stated, in standard deviations. Chosen.
const REACH: f64 = 3.0;
/// Least share of its value to which a parameter that must stay positive may be brought, dimensionless. Chosen.
const LEAST: f64 = 0.05;

/// Assumed standard deviation of a factor on all numbers of a kind, as a share, for files that state none. Correlations of films hold
/// to 10 % for one channel and less for all; shares of a drive's losses are known to 5 %, emissivities of machined metal to 10 %;
/// bolted joints of the same make differ by 20 %.
pub fn assumed(kind: NumberKind) -> f64 {
    match kind {
        NumberKind::Films => 0.07,
        NumberKind::Heats => 0.05,
        NumberKind::Emissivities => 0.1,
        NumberKind::Contacts => 0.2,
    }
}

pub use coldplate_base::terms::{Origin, Scale};

/// Kinds and things for which a file states an uncertainty.
#[derive(Default)]
struct Covered {
    /// Kinds as a whole.
    kinds: Vec<NumberKind>,
    /// Single things, by kind and name.
    things: Vec<(NumberKind, String)>,
}

impl Covered {
    fn add(&mut self, kind: Option<NumberKind>, key: &str) {
        let Some(kind) = kind else { return };
        let names = Document::names_in(key).unwrap_or_default();
        match names.iter().map(String::as_str).collect::<Vec<_>>()[..] {
            ["contact" | "channel" | "source" | "part" | "node", name, ..] => self.things.push((kind, name.to_string())),
            _ => self.kinds.push(kind),
        }
    }
}

/// A number of the machine that is not known for sure.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct OpenParameter {
    /// Key in the machine file, or the name of a factor.
    pub name: String,
    /// Unit of its values.
    pub unit: String,
    /// Value in the file, in `unit`; one for a factor.
    pub nominal: f64,
    /// Standard deviation, in `unit`; kelvin for temperatures.
    pub deviation: f64,
    /// Lowest value that may be stated for it, in `unit`.
    pub low: f64,
    /// Highest value that may be stated for it, in `unit`.
    pub high: f64,
    /// Scale on which the parameter enters.
    #[serde(with = "StoredScale")]
    pub scale: Scale,
    /// Origin of its standard deviation.
    #[serde(with = "StoredOrigin")]
    pub origin: Origin,
    acts: Vec<Act>,
}

/// [`Scale`] in a file of a reduced model.
#[derive(Serialize, Deserialize)]
#[serde(remote = "Scale")]
enum StoredScale {
    Linear,
    Log,
    Reciprocal,
}

/// [`Origin`] in a file of a reduced model.
#[derive(Serialize, Deserialize)]
#[serde(remote = "Origin")]
enum StoredOrigin {
    Stated,
    Assumed,
}

/// One number that a parameter moves.
#[derive(Debug, Clone, Serialize, Deserialize)]
struct Act {
    way: Way,
    /// Change of the number for one standard deviation of the parameter: relative, or SI along a number of the file.
    amount: f64,
}

#[derive(Debug, Clone, Serialize, Deserialize)]
enum Way {
    /// All numbers of a kind, except those of the things of these names.
    All(NumberKind, Vec<String>),
    Contact(String),
    Film(usize),
    /// Known only beside the machine file: never in a reduced model.
    #[serde(skip)]
    Along(Box<Variation>),
}

impl Study {
    /// All uncertain parameters; `with_assumed` adds the assumed factors on numbers for which the file states nothing.
    ///
    /// # Errors
    /// Errors of [`Study::uncertain`]; a factor names a key that is not there or does not vary continuously.
    pub fn open_parameters(&self, with_assumed: bool) -> Result<Vec<OpenParameter>> {
        let mut all = Vec::new();
        let mut covered = Covered::default();
        // Properties of sensors do not change the machine's temperatures.
        let is_of_machine = |key: &str| Document::names_in(key).is_none_or(|names| names.first().is_none_or(|first| first != "sensor"));
        for own in self.uncertain()?.into_iter().filter(|own| is_of_machine(&own.parameter.name)) {
            let p = &own.parameter;
            covered.add(self.kind_of(&p.name), &p.name);
            let (nominal, deviation) = (p.shown(p.value), own.deviation / p.per_unit(1.0).abs());
            let scale = self.scale_of(&p.name);
            let (low, high) = match own.limits {
                Some((low, high)) => (p.shown(low), p.shown(high)),
                None => (nominal - REACH * deviation, nominal + REACH * deviation),
            };
            // A positive number stays positive.
            let low = if nominal > 0.0 && !p.dimension.is_absolute() { low.max(LEAST * nominal) } else { low };
            let act = self.act(p, own.deviation)?;
            let (name, unit) = (p.name.clone(), p.unit.clone());
            all.push(OpenParameter { name, unit, nominal, deviation, low, high, scale, origin: Origin::Stated, acts: vec![act] });
        }
        for factor in &self.model.machine.shared_factors {
            let acts = match &factor.of {
                SharedNumbers::All(kind) => {
                    covered.kinds.push(*kind);
                    vec![Act { way: Way::All(*kind, Vec::new()), amount: factor.deviation }]
                }
                SharedNumbers::Keys(keys) => {
                    keys.iter().for_each(|key| covered.add(self.kind_of(key), key));
                    let act = |key: &String| {
                        let p = self.parameter(key)?;
                        match (p.kind == ParameterKind::Offset || p.dimension.is_absolute(), factor.is_offset) {
                            (true, true) => self.act(&p, factor.deviation),
                            (false, false) => self.act(&p, factor.deviation * p.value),
                            (true, false) => Err(Error::input("a temperature has no factor")
                                .help("state what it is off by: offset = \"0.3 K\", or its own uncertainty: \"20 degC +- 0.3 K\"")),
                            (false, true) => Err(Error::input("this is no temperature").help("write deviation = \"7 %\" for a factor")),
                        }
                    };
                    let place = |e: Error| e.at_key(format!("uncertain.{}", factor.name)).in_file(self.document().file());
                    keys.iter().map(act).collect::<Result<_>>().map_err(place)?
                }
            };
            let is_offset = factor.is_offset;
            let scale = match &factor.of {
                SharedNumbers::All(kind) => scale_of_kind(*kind),
                SharedNumbers::Keys(keys) => keys.first().map_or(Scale::Linear, |key| self.scale_of(key)),
            };
            let factor = Self::factor(factor.name.clone(), factor.deviation, scale, Origin::Stated, acts);
            all.push(if is_offset { factor.into_offset() } else { factor });
        }
        for kind in NumberKind::ALL.into_iter().filter(|kind| with_assumed && !covered.kinds.contains(kind)) {
            let but: Vec<String> = covered.things.iter().filter(|(of, _)| *of == kind).map(|(_, name)| name.clone()).collect();
            if !self.has(kind, &but) {
                continue;
            }
            let name = format!("{} {}", if but.is_empty() { "all" } else { "other" }, kind.word());
            let acts = vec![Act { way: Way::All(kind, but), amount: assumed(kind) }];
            all.push(Self::factor(name, assumed(kind), scale_of_kind(kind), Origin::Assumed, acts));
        }
        Ok(all)
    }

    /// Correlations of open parameters, as a full matrix.
    ///
    /// # Errors
    /// A correlation of the file names a number that is not uncertain, or the correlations contradict each other.
    pub fn correlations(&self, parameters: &[OpenParameter]) -> Result<Vec<Vec<f64>>> {
        let n = parameters.len();
        let mut all: Vec<Vec<f64>> = (0..n).map(|i| (0..n).map(|j| f64::from(u8::from(i == j))).collect()).collect();
        for own in &self.model.machine.correlations {
            let place = |name: &String| {
                let known = parameters.iter().map(|p| p.name.as_str());
                parameters.iter().position(|p| p.name == *name).ok_or_else(|| {
                    let error = Error::input(format!("'{name}' is not uncertain in this file"))
                        .at_key("correlation")
                        .in_file(self.document().file());
                    match did_you_mean(name, known) {
                        Some(meant) => error.help(format!("did you mean '{meant}'?")),
                        None => error.help("state its uncertainty, as in \"560 +- 40 W/(m2 K)\", or leave the correlation out"),
                    }
                })
            };
            let [a, b] = &own.between;
            let (a, b) = (place(a)?, place(b)?);
            (all[a][b], all[b][a]) = (own.value, own.value);
        }
        let matrix = nalgebra::DMatrix::from_fn(n, n, |i, j| all[i][j]);
        if n > 0 && matrix.symmetric_eigenvalues().min() < -1e-9 {
            return Err(Error::input("these correlations contradict each other: no quantities have them")
                .at_key("correlation")
                .in_file(self.document().file())
                .help("leave the weakest of them out"));
        }
        Ok(all)
    }

    fn factor(name: String, deviation: f64, scale: Scale, origin: Origin, acts: Vec<Act>) -> OpenParameter {
        let (low, high) = ((1.0 - REACH * deviation).max(LEAST), 1.0 + REACH * deviation);
        OpenParameter { name, unit: "1".into(), nominal: 1.0, deviation, low, high, scale, origin, acts }
    }

    /// Whether there is any number of a kind, except those of the things of some names.
    fn has(&self, kind: NumberKind, but: &[String]) -> bool {
        let (machine, network) = (&self.model.machine, &self.model.network);
        let is_meant = |name: &String| !but.contains(name);
        match kind {
            NumberKind::Films => machine.channels.iter().any(|c| is_meant(&c.name)),
            NumberKind::Heats => machine.sources.iter().any(|s| is_meant(&s.name)),
            NumberKind::Emissivities => !radiating(network, but).is_empty() || (but.is_empty() && !network.radiative.is_empty()),
            NumberKind::Contacts => !self.joints_of_contacts(but).is_empty(),
        }
    }

    /// Joints of the contacts of the file, except those of some names.
    fn joints_of_contacts(&self, but: &[String]) -> Vec<usize> {
        let (machine, network) = (&self.model.machine, &self.model.network);
        let is_meant = |i: &usize| {
            let group = network.contacts.get(network.joints[*i].contact as usize);
            group.and_then(|g| g.of).is_some_and(|c| !but.contains(&machine.contacts[c].name))
        };
        (0..network.joints.len()).filter(is_meant).collect()
    }

    /// The kind that a number of the file belongs to.
    fn kind_of(&self, key: &str) -> Option<NumberKind> {
        let names = Document::names_in(key)?;
        let last = names.last()?.as_str();
        Some(match names.first()?.as_str() {
            "channel" if last == "film_factor" => NumberKind::Films,
            "source" | "drive" => NumberKind::Heats,
            "contact" | "contacts" => NumberKind::Contacts,
            _ if last.contains("emissivity") => NumberKind::Emissivities,
            _ => return None,
        })
    }

    fn scale_of(&self, key: &str) -> Scale {
        self.kind_of(key).map_or(Scale::Linear, scale_of_kind)
    }

    /// How a change (SI) of a number acts: from the network where that is known, otherwise by differences.
    fn act(&self, p: &MachineParameter, change: f64) -> Result<Act> {
        let machine = &self.model.machine;
        let names = Document::names_in(&p.name).unwrap_or_default();
        let own = match names.iter().map(String::as_str).collect::<Vec<_>>()[..] {
            ["contact", name, "conductance" | "total_conductance"] => {
                machine.contacts.iter().any(|c| c.name == name).then(|| Way::Contact(name.to_string()))
            }
            ["channel", name, "film_factor"] => machine.channels.iter().position(|c| c.name == name).map(Way::Film),
            _ => None,
        };
        Ok(match own {
            Some(way) => Act { way, amount: change / p.value },
            None => Act { way: Way::Along(Box::new(self.variation(p)?)), amount: change },
        })
    }
}

impl OpenParameter {
    /// An offset of temperatures in the place of a factor of the same deviation.
    fn into_offset(self) -> Self {
        let reach = REACH * self.deviation;
        Self { unit: "K".into(), nominal: 0.0, low: -reach, high: reach, scale: Scale::Linear, ..self }
    }

    /// Whether a value of the parameter can be set in a network and its load without making them anew.
    pub fn is_direct(&self) -> bool {
        self.acts.iter().all(|act| !matches!(act.way, Way::Along(_)))
    }

    /// Sets a value (in the parameter's unit) in a network, which may be a sampled one, and in a load of it. Nothing is changed by
    /// a parameter that is not [direct](OpenParameter::is_direct).
    pub fn set(&self, value: f64, machine: &Machine, network: &mut Network, load: &mut Load) {
        let deviations = (value - self.nominal) / self.deviation;
        for act in &self.acts {
            let factor = 1.0 + act.amount * deviations;
            match &act.way {
                Way::All(NumberKind::Films, but) => {
                    network.streams.iter_mut().filter(|s| !but.contains(&s.name)).for_each(|s| s.film_factor *= factor);
                }
                Way::All(NumberKind::Heats, but) => {
                    let sources = machine.sources.iter().zip(&mut load.powers).filter(|(source, _)| !but.contains(&source.name));
                    sources.for_each(|(_, power)| *power *= factor);
                }
                Way::All(NumberKind::Emissivities, but) => {
                    for i in radiating(network, but) {
                        network.surfaces[i].emissive *= factor;
                    }
                    if but.is_empty() {
                        network.radiative.iter_mut().for_each(|(_, _, area)| *area *= factor);
                    }
                }
                Way::All(NumberKind::Contacts, but) => {
                    let is_meant = |of: Option<usize>| of.is_some_and(|c| !but.contains(&machine.contacts[c].name));
                    network.contacts.iter_mut().filter(|g| is_meant(g.of)).for_each(|g| g.scale *= factor);
                }
                Way::Contact(name) => {
                    let is_own = |of: Option<usize>| of.is_some_and(|c| machine.contacts[c].name == *name);
                    network.contacts.iter_mut().filter(|g| is_own(g.of)).for_each(|g| g.scale *= factor);
                }
                Way::Film(c) => network.streams[*c].film_factor *= factor,
                Way::Along(_) => {}
            }
        }
    }
}

/// Surfaces of a network that radiate, except those of the parts and nodes of some names.
fn radiating(network: &Network, but: &[String]) -> Vec<usize> {
    let is_meant = |i: &usize| {
        let surface = &network.surfaces[*i];
        surface.emissive > 0.0 && !network.groups.get(network.group[surface.node as usize] as usize).is_some_and(|g| but.contains(g))
    };
    (0..network.surfaces.len()).filter(is_meant).collect()
}

impl Derivatives<'_> {
    /// How every sensor's reading changes with one standard deviation of each parameter, K: a row per sensor, a column per
    /// parameter.
    ///
    /// # Errors
    /// Errors of [`Derivatives::partial_of`] and [`crate::Tangent::solve`].
    pub fn along_open(&self, parameters: &[OpenParameter]) -> Result<Vec<Vec<f64>>> {
        let network = &self.study.model.network;
        let targets = self.study.sensors();
        let pulls: Vec<Pull> = parameters.iter().map(|p| self.pull(p)).collect::<Result<_>>()?;
        if targets.len() < pulls.len() {
            let adjoints: Vec<_> = targets.par_iter().map(|t| self.adjoint_within(*t, AIM)).collect::<Result<_>>()?;
            let slope = |(s, adjoint): (usize, &super::point::Adjoint), pull: &Pull| {
                let inner: f64 = adjoint.field.iter().zip(&pull.residual).map(|(l, r)| l * r).sum();
                pull.readings[s] - inner
            };
            return Ok(adjoints.iter().enumerate().map(|own| pulls.iter().map(|pull| slope(own, pull)).collect()).collect());
        }
        let column = |pull: &Pull| -> Result<Vec<f64>> {
            let right: Vec<f64> = pull.residual.iter().map(|r| -r).collect();
            let mut field = self.tangent.solve_within(&right, AIM)?;
            network.fixed.iter().zip(&pull.held).for_each(|((node, _), slope)| field[*node as usize] = *slope);
            let held = |node: u32| network.fixed.iter().any(|(n, _)| *n == node);
            let reading = |s: usize| {
                let weights = network.sensors[s].weights.iter().filter(|(n, _)| !held(*n));
                pull.readings[s] + weights.map(|(n, w)| w * field[*n as usize]).sum::<f64>()
            };
            Ok((0..targets.len()).map(reading).collect())
        };
        let columns: Vec<Vec<f64>> = pulls.par_iter().map(column).collect::<Result<_>>()?;
        Ok((0..targets.len()).map(|s| columns.iter().map(|c| c[s]).collect()).collect())
    }

    /// Direct effect of one standard deviation of a parameter at fixed temperatures.
    fn pull(&self, parameter: &OpenParameter) -> Result<Pull> {
        let (machine, network) = (&self.study.model.machine, &self.study.model.network);
        let screen = self.screen();
        let mut pull =
            Pull { residual: vec![0.0; network.nodes], readings: vec![0.0; network.sensors.len()], held: vec![0.0; network.fixed.len()] };
        for act in &parameter.acts {
            let mut add = |own: Disturbance| own.rows.iter().for_each(|(node, r)| pull.residual[*node as usize] += act.amount * r);
            match &act.way {
                Way::All(NumberKind::Films, but) => {
                    let streams = (0..network.streams.len()).filter(|s| !but.contains(&network.streams[*s].name));
                    streams.for_each(|s| add(screen.stream_film(s)));
                }
                Way::All(NumberKind::Heats, but) => {
                    let sources = machine.sources.iter().enumerate().filter(|(_, source)| !but.contains(&source.name));
                    sources.for_each(|(s, _)| add(screen.power(s)));
                }
                Way::All(NumberKind::Emissivities, but) => {
                    add(screen.emissivity(radiating(network, but)));
                    if but.is_empty() {
                        add(screen.radiative(0..network.radiative.len()));
                    }
                }
                Way::All(NumberKind::Contacts, but) => add(screen.joints(self.study.joints_of_contacts(but))),
                Way::Contact(name) => add(screen.contact(name)),
                Way::Film(c) => add(screen.stream_film(*c)),
                Way::Along(variation) => {
                    let partial = self.partial_of(variation)?;
                    let lists =
                        [(&mut pull.residual, &partial.residual), (&mut pull.readings, &partial.readings), (&mut pull.held, &partial.held)];
                    for (total, own) in lists {
                        total.iter_mut().zip(own).for_each(|(t, o)| *t += act.amount * o);
                    }
                }
            }
        }
        Ok(pull)
    }
}

/// Direct effect of a parameter at fixed temperatures, per standard deviation: on the residual of every node, W; on the reading of
/// every sensor and the temperature of every held node, K.
struct Pull {
    residual: Vec<f64>,
    readings: Vec<f64>,
    held: Vec<f64>,
}

/// Contacts and films act as resistances.
fn scale_of_kind(kind: NumberKind) -> Scale {
    match kind {
        NumberKind::Films | NumberKind::Contacts => Scale::Reciprocal,
        NumberKind::Heats | NumberKind::Emissivities => Scale::Linear,
    }
}
