//! What could be wrong: place x kind x law, composed from the machine's own network. One file per family of effects.
//!
//! A family's file holds everything about its effects: where they can act and how large they may be, what they do to the
//! network or to the readings ([`Disturbance`], for the screen), the lines of the machine file that make them so (for the fit
//! and the extended machine), and the words they are told in. The rest of the diagnosis speaks to [`Effect`] and
//! [`Hypothesis`] alone. A new family is a file here and a line in the list below; a new effect of a family is an entry in
//! that family's file. `tests/it/diagnose/derivatives.rs` compares every derivative with the lines of the same effect.

mod derivative;
mod file;
mod found;
mod ground;
mod law;
mod prior;
mod scales;
mod site;
mod words;

use std::sync::OnceLock;

use coldplate_base::error::Result;
use coldplate_describe::machine::Machine;
use coldplate_evidence::measurement::Data;
use coldplate_network::{Load, Network, Surface};
use coldplate_solve::sensitivity::{Derivatives, Disturbance, Screen, Variation};
use coldplate_solve::study::Study;

use super::Discrepancy;
pub use derivative::{Change, Disturbances, EffectDerivatives};
use file::{Lines, MachineEdit};
pub use found::{Axis, Course, FoundLaw, Sequence};
use ground::PathLaw;
pub use ground::{Ground, Shares};
pub use law::{Form as LawForm, Law, LawNumber};
pub use scales::Scales;
use site::{Group, Site};
use words::{Quantity, Told};
pub use words::{Shown, sentence};

/// Declares the families: their files, the closed enum of them, and the list of all candidates.
macro_rules! families {
    ($($(#[$what:meta])* $file:ident: $Family:ident,)+) => {
        $(mod $file; pub use $file::$Family;)+

        /// What is wrong, by family.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
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
    /// Columns of the table that state a temperature around the machine.
    variable: Variable,
    /// Sensors' own errors.
    sensor: Sensor,
    /// Numbers of the file that are uncertain themselves.
    number: Number,
    /// Kinds of the user's own.
    user: User,
}

impl Effect {
    /// The law under which it is alike in all rows: a gain's share grows with the temperature by itself.
    pub fn usual_law(&self) -> Law {
        if matches!(self, Self::Sensor(Sensor::Gain(_))) { Law::Temperature } else { Law::Constant }
    }
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
    fn disturbance(&self, at: &Linearised<'_, '_>) -> Option<Disturbance>;

    /// The groups between which it is a path for heat, and its law, where it is one: in place of its disturbance, which takes heat from many
    /// nodes.
    fn path(&self) -> Option<([u32; 2], PathLaw)> {
        None
    }

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

    /// Whether its lines, or what it makes of readings, can say when it acts: at some times, in some tests.
    fn says_when(&self) -> bool {
        false
    }

    /// Whether its lines can follow a law by a formula of the condition.
    fn has_formula_of(&self, _law: Law) -> bool {
        self.says_when()
    }

    /// Whether it can also set in or grow in the course of a log.
    fn follows_time(&self) -> bool {
        self.says_when()
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
    /// The number of that law which was found from the data.
    pub number: Option<LawNumber>,
    /// Prior standard deviation of its amplitude.
    pub scale: f64,
    /// Whether that is how far numbers of the file are off, and no cause: its prior is normal.
    pub is_inexactness: bool,
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
            number: None,
            scale,
            is_inexactness: false,
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
    pub(crate) fn under_of(self, law: Law, scales: &Scales) -> Self {
        Self { law_of: matches!(law, Law::Of(..) | Law::Found(_)).then(|| scales.words(law)), ..self.under(law) }
    }

    /// The same under a law whose number was found from the data.
    pub(crate) fn under_found(&self, law: Law, number: LawNumber, scales: &Scales) -> Self {
        Self { law, law_of: Some(scales.words_with(law, &number)), number: Some(number), ..self.clone() }
    }

    /// The same by the law that its kind usually has.
    pub(crate) fn under_usual_law(&self) -> Self {
        self.clone().under(self.effect.usual_law())
    }

    /// The same by a variable that is its amplitude.
    pub(crate) fn by_course(&self, law: Law) -> Self {
        self.clone().under(law)
    }

    /// Whether what it makes of readings can follow a variable.
    pub(crate) fn reads_course(&self) -> bool {
        self.is_sensor() && self.effect.family().says_when()
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
        let is_said = !self.law.is_formula() || self.effect.family().has_formula_of(self.law) && scales.has_formula(self.law);
        if !self.is_sensor() && !is_said {
            return Ok(None);
        }
        self.effect.family().lines(&MachineEdit { study, scales, user, hypothesis: self, amplitude })
    }

    /// The lines of a machine file of its own that say all of it, what sensors show included. What depends on the order of the rows is written as
    /// it is after the last one.
    ///
    /// # Errors
    /// As [`Hypothesis::sets`].
    pub fn written(&self, study: &Study, data: &Data, scales: &Scales, user: &[UserKind], amplitude: f64) -> Result<Lines> {
        if let Some((own, amplitude)) = self.afterwards(scales, amplitude) {
            return own.written(study, data, scales, user, amplitude);
        }
        match self.sensor() {
            // The machine file has no words for a sensor whose error is not always alike.
            Some(_) if self.law.is_formula() => Ok(None),
            Some(sensor) => sensor.written(study, data, amplitude),
            None => self.sets(study, scales, user, amplitude),
        }
    }

    /// The cause as it is after the last row of the data, with its amplitude; `None` where a formula says its law, or where nothing is known of
    /// later rows. An exchange is there or not: the mean of some numbers is neither.
    fn afterwards(&self, scales: &Scales, amplitude: f64) -> Option<(Self, f64)> {
        let is_said = !self.law.is_formula() || !self.is_sensor() && scales.has_formula(self.law);
        let factor = scales.found(self.law).filter(|_| !is_said)?.factor_afterwards()?;
        let is_there = || self.has_known_law(scales) && factor * amplitude > 0.5;
        (!self.is_fixed() || is_there()).then(|| (self.under_usual_law(), factor * amplitude))
    }

    /// The cause at conditions that are none of the data's rows, with the factor on its amplitude: what depends on the order of the rows is as it
    /// is after the last of them, or alike everywhere where nothing is known of that.
    pub(crate) fn elsewhere(&self, scales: &Scales) -> (Self, f64) {
        if scales.has_formula(self.law) {
            return (self.clone(), 1.0);
        }
        self.afterwards(scales, 1.0).unwrap_or_else(|| (self.under_usual_law(), 1.0))
    }

    /// Whether it is another number in every row: a machine file has the mean of them, whose deviation is not that of its amplitude.
    pub fn is_mean(&self, scales: &Scales) -> bool {
        self.is_written_afterwards(scales) && !self.has_known_law(scales)
    }

    /// Whether a machine file has the cause only as it is after the last row.
    pub fn is_written_afterwards(&self, scales: &Scales) -> bool {
        self.afterwards(scales, 1.0).is_some()
    }

    /// Whether its law is a law, and not a curve or a number of its own in every row.
    pub fn has_known_law(&self, scales: &Scales) -> bool {
        scales.found(self.law).is_none_or(|law| !law.is_unknown())
    }

    /// Whether it is the same cause, whatever its amplitude may be.
    pub fn is_same(&self, other: &Self) -> bool {
        (self.effect, self.law, &self.place) == (other.effect, other.law, &other.place)
    }

    /// Whether it is a factor on a source, alike in all conditions.
    pub(crate) fn is_source(&self) -> bool {
        matches!(self.effect, Effect::Heat(Heat::Source(_))) && self.law == self.effect.usual_law()
    }

    /// Whether it drifts with the temperature of its place, which its derivative must know.
    pub(crate) fn is_drift(&self) -> bool {
        self.law == Law::Temperature
    }

    /// The common factor of the model's discrepancy that it is part of.
    pub(crate) fn common_factor(&self) -> Option<CommonFactor> {
        self.effect.family().common_factor().filter(|_| self.law == Law::Constant)
    }

    /// Standard deviation of the model's discrepancy in it alone, in its unit.
    pub fn discrepancy(&self, network: &Network, all: &Discrepancy) -> Option<f64> {
        self.effect.family().discrepancy(network, all)
    }

    /// The amplitude of a change of a number of the machine file by a factor e, to first order; `None` of what is no such number.
    pub(crate) fn of_a_number(&self, network: &Network) -> Option<f64> {
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

    /// By how much the same cause of a machine that has it with an amplitude moves, per unit of the amplitude. What adds moves by one.
    pub(crate) fn per_unit_of(&self, amplitude: f64) -> f64 {
        match self.effect {
            // Heats with a factor 1 + a grow by the factor 1 + b to (1 + a) (1 + b).
            Effect::Heat(Heat::Source(_)) | Effect::Common(Common::Heats) if !self.is_drift() => {
                let grown = 1.0 + amplitude;
                grown.signum() / grown.abs().max(f64::EPSILON)
            }
            _ => 1.0,
        }
    }

    /// Whether more and less of it bend so differently that logs are followed along a secant to one side.
    pub(crate) fn is_bent(&self) -> bool {
        self.effect.family().is_bent()
    }

    /// What acts on a reading and not on the machine.
    pub fn sensor(&self) -> Option<Sensor> {
        if let Effect::Sensor(sensor) = self.effect { Some(sensor) } else { None }
    }

    /// The variable whose values it is about.
    pub(crate) fn variable(&self) -> Option<usize> {
        if let Effect::Variable(own) = &self.effect { Some(own.variable()) } else { None }
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
    pub(crate) fn relabelled(&self, places: &[(usize, usize)]) -> Option<Vec<usize>> {
        self.sensor()?.relabelled(places)
    }

    /// What it does to predicted readings (rows, then sensors) beside the machine: sensors' own errors.
    pub fn read(&self, (scales, machine): (&Scales, &Machine), data: &Data, predicted: &[f64], amplitude: f64) -> Vec<f64> {
        self.sensor().map_or_else(|| predicted.to_vec(), |sensor| sensor.read(((self.law, scales), machine), data, predicted, amplitude))
    }
}

/// Everything that could be wrong with this machine and could show in these data.
pub fn hypotheses(study: &Study, data: &Data, user: &[UserKind]) -> Vec<Hypothesis> {
    candidates(&Site::new(study, data, user))
}

/// Causes by laws that are looked for only where something is wrong: some of the catalogue's as they set in or grow in the course of
/// logs, in some tests only, or on the way down, and heats with other powers than those that have names. Of laws with a number to be found
/// the grid of its values.
pub fn under_rarer_laws(catalogue: &[Hypothesis], machine: &Machine, scales: &Scales) -> Vec<Hypothesis> {
    let (times, counts, powers) = (scales.laws_of_time(), scales.laws_of_counts(), scales.powers(machine));
    let of = |h: &Hypothesis| -> Vec<Hypothesis> {
        if h.law != h.effect.usual_law() {
            return Vec::new();
        }
        let (says_when, follows_time) = (h.effect.family().says_when(), h.effect.family().follows_time());
        let of_when = times.iter().filter(|_| follows_time).map(|law| h.clone().under_of(*law, scales));
        let of_count = counts.iter().filter(|_| says_when).map(|(law, number)| h.under_found(*law, number.clone(), scales));
        let of_power = powers.iter().filter(|_| matches!(h.effect, Effect::Heat(_))).map(|law| h.clone().under_of(*law, scales));
        of_when.chain(of_count).chain(of_power).collect()
    };
    catalogue.iter().flat_map(of).collect()
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
struct Linearised<'a, 'd> {
    at: &'a Derivatives<'d>,
    screen: &'a Screen<'a>,
    ground: &'a Ground<'a>,
    prepared: Option<&'a Prepared>,
    /// Whether the effect drifts with the temperature of its place.
    is_drift: bool,
    /// See [`Linearised::residual`].
    residual: &'a OnceLock<Option<Vec<f64>>>,
}

impl<'a> Linearised<'a, '_> {
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

    /// Residual of every node, W, which is what each stores; computed once for all effects. `None` where it cannot be.
    fn residual(&self) -> Option<&'a [f64]> {
        let of = || self.at.tangent.residual(self.network(), self.load(), self.temperatures()).ok();
        self.residual.get_or_init(of).as_deref()
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
    Some(Prepared::Along(Box::new(study.variation(&study.known_parameter(key)?).ok()?)))
}
