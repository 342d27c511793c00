//! What could be wrong: place x kind x law, composed from the machine's own network. One file per family of effects.
//!
//! A family's file holds everything about its effects: where they can act and how large they may be, what they do to the
//! network or to the readings ([`Disturbance`], for the screen), the lines of the machine file that make them so (for the fit
//! and the extended machine), and the words they are told in. The rest of the diagnosis speaks to [`Effect`] and
//! [`Hypothesis`] alone. A new family is a file here and a line in the list below; a new effect of a family is an entry in
//! that family's file. `tests/diagnose/derivatives.rs` compares every derivative with the lines of the same effect.

mod derivative;
mod file;
mod ground;
mod law;
mod words;

use crate::describe::machine::{Machine, Place};
use crate::discretise::network::{Load, Network, Surface};
use crate::error::Result;
use crate::evidence::measurement::Data;
use crate::solve::sensitivity::{Derivatives, Disturbance, Screen, Study, Variation};

use super::Discrepancy;
pub use derivative::EffectDerivatives;
use file::{Lines, MachineEdit};
use ground::Ground;
pub use law::{Form as LawForm, Law, Scales};
use words::{Quantity, Told};
pub use words::{Shown, sentence};

/// Declares the families: their files, the closed enum of them, and the list of all candidates.
macro_rules! families {
    ($($(#[$what:meta])* $file:ident: $Family:ident,)+) => {
        $(mod $file; pub use $file::$Family;)+

        /// What is wrong, by family.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
        #[non_exhaustive]
        pub enum Effect {
            $($(#[$what])* $Family($Family),)+
        }

        $(impl From<$Family> for Effect {
            fn from(effect: $Family) -> Self {
                Self::$Family(effect)
            }
        })+

        impl Effect {
            fn family(&self) -> &dyn Family {
                match self {
                    $(Self::$Family(effect) => effect,)+
                }
            }
        }

        fn candidates(site: &Site<'_>) -> Vec<Hypothesis> {
            let families: &[fn(&Site<'_>) -> Vec<Hypothesis>] = &[$($Family::candidates,)+];
            families.iter().flat_map(|of_family| of_family(site)).collect()
        }
    };
}

families! {
    /// Heat that the model lacks, or has otherwise.
    heat: Heat,
    /// What parts store.
    storage: Storage,
    /// Conductivities of materials.
    material: Material,
    /// Contacts between parts.
    contact: Contact,
    /// Coolant and the films it has, and films of boundaries.
    flow: Flow,
    /// Radiation and the residual gas.
    radiation: Radiation,
    /// Paths that the model lacks: to the surroundings and between parts.
    leak: Leak,
    /// What all members of a kind share: films, heats, emissivities, contacts, inlets.
    common: Common,
    /// Sensors' own errors.
    sensor: Sensor,
    /// Numbers of the file that are uncertain themselves.
    number: Number,
    /// Kinds of the user's own.
    user: User,
}

/// What each family says about its effects.
trait Family {
    /// Those that could act on a machine and show in its data.
    fn candidates(site: &Site<'_>) -> Vec<Hypothesis>
    where
        Self: Sized;

    /// Name of the kind, as people and programs read it.
    fn kind(&self) -> &'static str;

    /// The lines of the machine file that make it so: none for what acts on readings.
    fn lines(&self, edit: &MachineEdit<'_>) -> Result<Lines>;

    /// What its derivative needs that does not depend on the state.
    fn prepared(&self, _study: &Study, _user: &[UserKind]) -> Option<Prepared> {
        None
    }

    /// What it does to the residual of the network at a state, per unit of its amplitude; `None` for what acts on readings, or
    /// where the machine file has no words for it.
    fn disturbance(&self, at: &Linearised<'_>) -> Option<Disturbance>;

    /// What its amplitude is to a reader.
    fn quantity(&self, law: Law) -> Quantity;

    /// The sentence that a test engineer reads.
    fn sentence(&self, told: &Told<'_>) -> String;

    /// The common factor of the model's discrepancy that it is part of.
    fn common_factor(&self) -> Option<CommonFactor> {
        None
    }

    /// Standard deviation of the model's discrepancy in this effect alone, in its unit.
    fn discrepancy(&self, _network: &Network, _all: &Discrepancy) -> Option<f64> {
        None
    }

    /// Whether more and less of it bend so differently that logs are followed along a secant to one side.
    fn is_bent(&self) -> bool {
        false
    }
}

/// Factors of the model's discrepancy that many effects share.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CommonFactor {
    /// Of all films.
    Films,
    /// Of all heats.
    Heats,
    /// Of all emissivities.
    Emissivities,
}

impl CommonFactor {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Films, Self::Heats, Self::Emissivities];

    /// Its standard deviation.
    pub fn deviation(self, discrepancy: &Discrepancy) -> f64 {
        match self {
            Self::Films => discrepancy.films,
            Self::Heats => discrepancy.heats,
            Self::Emissivities => discrepancy.emissivities,
        }
    }
}

/// A heat source of the user's own: a kind that the program does not know.
#[derive(Debug, Clone, PartialEq)]
pub struct UserKind {
    /// Its name.
    pub name: String,
    /// Where the heat goes: parts, faces or nodes.
    pub places: Vec<String>,
    /// Heat per unit of amplitude, W: a formula of the machine file.
    pub expression: String,
    /// Prior standard deviation of the amplitude.
    pub scale: f64,
    /// Whether it may be negative.
    pub is_signed: bool,
}

/// One cause that could explain the data.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Hypothesis {
    /// What it does.
    pub effect: Effect,
    /// Where, in the machine file's names.
    pub place: String,
    /// Parts it touches.
    pub parts: Vec<String>,
    /// How it depends on the condition.
    pub law: Law,
    /// That law in words, where it is by a variable of the machine.
    law_of: Option<String>,
    /// Prior standard deviation of its amplitude.
    pub scale: f64,
    /// Whether a negative amplitude means anything.
    pub is_signed: bool,
    /// Unit of the amplitude; `ln` for logarithms.
    pub unit: &'static str,
    /// Largest amplitude to which the screen continues its slope: what saturates does no more than that, however large it is.
    pub most: f64,
}

impl Hypothesis {
    /// A constant effect that may be more or less, with the standard deviation of its amplitude.
    fn signed(effect: impl Into<Effect>, place: impl Into<String>, parts: Vec<String>, scale: f64, unit: &'static str) -> Self {
        Self {
            effect: effect.into(),
            place: place.into(),
            parts,
            law: Law::Constant,
            law_of: None,
            scale,
            is_signed: true,
            unit,
            most: f64::INFINITY,
        }
    }

    /// One that can only be more.
    fn positive(effect: impl Into<Effect>, place: impl Into<String>, parts: Vec<String>, scale: f64, unit: &'static str) -> Self {
        Self { is_signed: false, ..Self::signed(effect, place, parts, scale, unit) }
    }

    /// The same under a law.
    fn under(self, law: Law) -> Self {
        Self { law, ..self }
    }

    /// The same under a law of some data.
    fn under_of(self, law: Law, scales: &Scales) -> Self {
        Self { law_of: matches!(law, Law::Of(..)).then(|| scales.words(law)), ..self.under(law) }
    }

    /// How it depends on the condition, in words.
    pub fn law_words(&self) -> String {
        self.law_of.clone().unwrap_or_else(|| self.law.words().into())
    }

    /// Name of its kind.
    pub fn kind(&self) -> &'static str {
        self.effect.family().kind()
    }

    /// Kind and place; what is common to all places has its own name alone.
    pub fn kind_and_place(&self) -> String {
        if self.kind() == self.place { self.place.clone() } else { format!("{} at {}", self.kind(), self.place) }
    }

    /// The lines of the machine file that make it so, (key, TOML value); empty for what a sensor does, `None` where the
    /// machine file has no words for it.
    ///
    /// # Errors
    /// A key of the file cannot be read.
    pub fn sets(&self, study: &Study, scales: &Scales, user: &[UserKind], amplitude: f64) -> Result<Lines> {
        self.effect.family().lines(&MachineEdit { study, scales, user, hypothesis: self, amplitude })
    }

    /// The lines of a machine file of its own that say all of it, what sensors show included.
    ///
    /// # Errors
    /// As [`Hypothesis::sets`].
    pub fn written(&self, study: &Study, data: &Data, scales: &Scales, user: &[UserKind], amplitude: f64) -> Result<Lines> {
        match self.sensor() {
            Some(sensor) => Ok(Some(sensor.written(&study.model.machine, data, amplitude))),
            None => self.sets(study, scales, user, amplitude),
        }
    }

    /// Whether nothing bounds its size but what the source may be: heat that the model lacks has no limit that a factor or a leak has.
    pub fn has_tails(&self) -> bool {
        matches!(self.effect, Effect::Heat(Heat::Into(_)))
    }

    /// Whether it is the same cause, whatever its amplitude may be.
    pub fn is_same(&self, other: &Self) -> bool {
        (self.effect, self.law, &self.place) == (other.effect, other.law, &other.place)
    }

    /// Whether it drifts with the temperature of its place, which its derivative must know.
    pub fn is_drift(&self) -> bool {
        self.law == Law::Temperature
    }

    /// The common factor of the model's discrepancy that it is part of.
    pub fn common_factor(&self) -> Option<CommonFactor> {
        self.effect.family().common_factor().filter(|_| self.law == Law::Constant)
    }

    /// Standard deviation of the model's discrepancy in it alone, in its unit.
    pub fn discrepancy(&self, network: &Network, all: &Discrepancy) -> Option<f64> {
        self.effect.family().discrepancy(network, all)
    }

    /// The amplitude of a change of a number of the machine file by a factor e, to first order; `None` of what is no such number.
    pub fn of_a_number(&self, network: &Network) -> Option<f64> {
        match self.effect {
            _ if self.law != Law::Constant => None,
            Effect::Storage(storage) => Some(storage.own(network)).filter(|own| *own > 0.0),
            Effect::Heat(Heat::Source(_)) => Some(1.0),
            Effect::Material(_)
            | Effect::Contact(_)
            | Effect::Flow(Flow::Film(_) | Flow::BoundaryFilm(_))
            | Effect::Radiation(Radiation::Emissivity(_)) => Some(1.0),
            _ => None,
        }
    }

    /// Whether more and less of it bend so differently that logs are followed along a secant to one side.
    pub fn is_bent(&self) -> bool {
        self.effect.family().is_bent()
    }

    /// Largest amplitude that is fitted.
    pub fn largest(&self) -> f64 {
        if self.unit.starts_with("ln") { 4.0 } else { 50.0 * self.scale }
    }

    /// What acts on a reading and not on the machine.
    pub fn sensor(&self) -> Option<Sensor> {
        if let Effect::Sensor(sensor) = self.effect { Some(sensor) } else { None }
    }

    /// Whether it is about a reading and not about the machine.
    pub fn is_sensor(&self) -> bool {
        self.sensor().is_some()
    }

    /// Whether it has no amplitude to fit: that amplitude is 1.
    pub fn is_fixed(&self) -> bool {
        matches!(self.sensor(), Some(Sensor::Swap(..)))
    }

    /// For swapped sensors: at each of some readings, given by row and sensor, the one that belongs there.
    pub fn relabelled(&self, places: &[(usize, usize)]) -> Option<Vec<usize>> {
        self.sensor()?.relabelled(places)
    }

    /// What it does to predicted readings (rows, then sensors) beside the machine: sensors' own errors.
    pub fn read(&self, data: &Data, predicted: &[f64], amplitude: f64) -> Vec<f64> {
        self.sensor().map_or_else(|| predicted.to_vec(), |sensor| sensor.read(data, predicted, amplitude))
    }
}

/// Where candidates are looked for.
struct Site<'a> {
    study: &'a Study,
    machine: &'a Machine,
    network: &'a Network,
    data: &'a Data,
    user: &'a [UserKind],
    /// Parts and lumped nodes that are free to move.
    groups: Vec<Group>,
    /// Laws that heat can follow in these data.
    laws: Vec<Law>,
    /// Where they are one.
    scales: Scales,
    /// Whether the coolant flow varies.
    flow_varies: bool,
    /// Whether anything radiates to the chamber: a machine in vacuum, not in a room.
    is_in_vacuum: bool,
}

/// A part or lumped node.
#[derive(Debug, Clone)]
struct Group {
    index: u32,
    name: String,
}

impl<'a> Site<'a> {
    fn new(study: &'a Study, data: &'a Data, user: &'a [UserKind]) -> Self {
        let (machine, network) = (&study.model.machine, &study.model.network);
        let varies = |name: &str| {
            let at = machine.variables.iter().position(|v| v.name == name);
            let first = |v: usize| data.rows[0].condition.si()[v].max(1e-30);
            at.is_some_and(|v| data.rows.iter().any(|r| (r.condition.si()[v] / first(v) - 1.0).abs() > 0.02))
        };
        let mut laws = vec![Law::Constant];
        if varies("motor_speed") {
            laws.extend([Law::Speed, Law::SpeedSquared]);
        }
        let scales = Scales::of(data, machine);
        laws.extend(scales.laws(machine));
        let is_free =
            |g: usize| (0..network.solids).any(|n| network.group[n] == g as u32 && !network.fixed.iter().any(|(f, _)| *f as usize == n));
        let groups = network.groups.iter().enumerate().filter(|(g, _)| is_free(*g));
        Self {
            groups: groups.map(|(g, name)| Group { index: g as u32, name: name.clone() }).collect(),
            flow_varies: varies("coolant_flow"),
            is_in_vacuum: network.surfaces.iter().any(|s| s.emissive > 0.0),
            study,
            machine,
            network,
            data,
            user,
            laws,
            scales,
        }
    }

    /// All heat of the sources, W: the most at any condition of the data.
    fn whole_heat(&self) -> f64 {
        let loads = self.data.rows.iter().filter_map(|row| Load::at(self.machine, &row.condition).ok());
        loads.map(|load| load.powers.iter().map(|p| p.abs()).sum::<f64>()).fold(0.0, f64::max)
    }

    /// Names of the parts and lumped nodes of some places.
    fn part_names(&self, places: &[Place]) -> Vec<String> {
        let name = |place: &Place| match place {
            Place::Part(p) => self.machine.parts[*p].name.clone(),
            Place::Face(face) => self.machine.parts[face.part].name.clone(),
            Place::Node(n) => self.machine.nodes[*n].name.clone(),
        };
        places.iter().map(name).collect()
    }

    /// Lumped nodes of given temperature, but those at the temperature of the chamber, to which every group may leak.
    fn given(&self) -> Vec<Group> {
        let loads: Vec<Load> = self.data.rows.iter().filter_map(|row| Load::at(self.machine, &row.condition).ok()).collect();
        let differs = |n: usize| loads.iter().any(|load| (load.fixed[n] - load.chamber).abs() > 1e-6);
        let parts = self.machine.parts.len();
        let held = self.machine.nodes.iter().enumerate().filter(|(n, node)| node.fixed.is_some() && differs(*n));
        held.map(|(n, node)| Group { index: (parts + n) as u32, name: node.name.clone() }).collect()
    }

    /// Whether something joins two groups.
    fn touch(&self, a: u32, b: u32) -> bool {
        let of = |n: u32| self.network.group[n as usize];
        self.network.joints.iter().any(|j| (of(j.a), of(j.b)) == (a, b) || (of(j.a), of(j.b)) == (b, a))
    }

    /// Pairs of some groups that do not touch.
    fn apart<'g>(&self, groups: &'g [Group]) -> Vec<(&'g Group, &'g Group)> {
        let of = |n: u32| self.network.group[n as usize];
        let touches: std::collections::HashSet<(u32, u32)> =
            self.network.joints.iter().map(|j| (of(j.a).min(of(j.b)), of(j.a).max(of(j.b)))).collect();
        let pairs = groups.iter().enumerate().flat_map(|(i, a)| groups[i + 1..].iter().map(move |b| (a, b)));
        pairs.filter(|(a, b)| !touches.contains(&(a.index.min(b.index), a.index.max(b.index)))).collect()
    }
}

/// Everything that could be wrong with this machine and could show in these data.
pub fn hypotheses(study: &Study, data: &Data, user: &[UserKind]) -> Vec<Hypothesis> {
    candidates(&Site::new(study, data, user))
}

/// What a derivative needs that does not depend on the state.
enum Prepared {
    /// Differences along a number of the machine file.
    Along(Box<Variation>),
    /// Heat of a source that is added: where it goes, and the machine and its source that say how much.
    Heat { shares: Vec<(u32, f64)>, machine: Box<Machine>, source: usize },
    /// Surfaces that an effect opens.
    Surfaces(Vec<Surface>),
    /// Networks with less and with more of an effect, and how far apart they are in its amplitude.
    Networks { less: Box<Network>, more: Box<Network>, apart: f64 },
}

/// A state of the machine, and what is known of an effect there.
struct Linearised<'a> {
    at: &'a Derivatives<'a>,
    screen: &'a Screen<'a>,
    ground: &'a Ground<'a>,
    prepared: Option<&'a Prepared>,
    /// Whether the effect drifts with the temperature of its place.
    is_drift: bool,
}

impl<'a> Linearised<'a> {
    fn machine(&self) -> &'a Machine {
        &self.at.study.model.machine
    }

    fn network(&self) -> &'a Network {
        &self.at.study.model.network
    }

    fn temperatures(&self) -> &[f64] {
        &self.at.state.solution.temperatures
    }

    fn load(&self) -> &Load {
        &self.at.state.load
    }

    /// Along the number of the machine file that was prepared.
    fn along(&self) -> Option<Disturbance> {
        let Some(Prepared::Along(variation)) = self.prepared else { return None };
        let partial = self.at.partial_of(variation).ok()?;
        let rows = partial.residual.iter().enumerate().filter(|(_, r)| **r != 0.0).map(|(n, r)| (n as u32, *r));
        Some(self.screen.disturbance(rows))
    }
}

/// Differences along a number of the machine file.
fn along(study: &Study, key: &str) -> Option<Prepared> {
    Some(Prepared::Along(Box::new(study.variation(&study.parameter(key).ok()?).ok()?)))
}
