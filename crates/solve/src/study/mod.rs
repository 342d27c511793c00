//! A machine file with its model, which can be built anew with other values on the same cells.

mod parameter;

pub use parameter::{MachineParameter, ParameterKind};

use std::path::Path;

use crate::meshed::MeshedMachine;
use coldplate_base::document::Document;
use coldplate_base::error::{Error, Result};
use coldplate_base::progress::{Progress, Silent};
use coldplate_describe::machine::{Condition, Machine, Part, PartBlock, SCHEMA};
use coldplate_describe::schema;
use coldplate_network::Network;
use coldplate_network::mesh::Mesh;

/// A machine file and its model.
#[derive(Debug, Clone)]
pub struct Study {
    document: Document,
    /// Machine, mesh and network.
    pub model: MeshedMachine,
    /// How tables of its steady states are solved.
    pub tables: StateTables,
}

/// How tables of steady states are solved.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum StateTables {
    /// In a small space of states that were solved, see [`Nearby::table`](crate::Nearby::table).
    #[default]
    Reduced,
    /// Every state by itself.
    InFull,
}

impl Study {
    /// Reads a machine file, applies `sets` and meshes it with about `cells` cells.
    ///
    /// # Errors
    /// Errors of [`Machine::read`] and [`MeshedMachine::new`].
    pub fn read(path: impl AsRef<Path>, sets: &[(String, String)], cells: Option<usize>) -> Result<Self> {
        Self::new(Document::read(path)?.with_sets(sets)?, cells)
    }

    /// A study of a file that is parsed already.
    ///
    /// # Errors
    /// Errors of [`Study::read`].
    pub fn new(document: Document, cells: Option<usize>) -> Result<Self> {
        Self::for_conditions(document, cells, Machine::usual_conditions, &Silent)
    }

    /// A study with given `conditions` for an accuracy; see [`MeshedMachine::for_conditions`].
    ///
    /// # Errors
    /// Errors of [`Machine::from_document`] and [`MeshedMachine::for_conditions`].
    pub fn for_conditions(
        document: Document,
        cells: Option<usize>,
        conditions: impl FnOnce(&Machine) -> Result<Vec<Condition>>,
        progress: &dyn Progress,
    ) -> Result<Self> {
        let machine = Machine::from_document(&document)?;
        Ok(Self { model: MeshedMachine::for_conditions(machine, cells, conditions, progress)?, document, tables: StateTables::default() })
    }

    /// This study with tables of its steady states solved as `tables` says.
    pub fn with_tables(self, tables: StateTables) -> Self {
        Self { tables, ..self }
    }

    /// This machine on about `factor` times the cells; cells that follow an accuracy grow by one factor along every line.
    ///
    /// # Errors
    /// Errors of [`MeshedMachine::new`] and [`MeshedMachine::on`].
    pub fn finer(&self, factor: f64) -> Result<Self> {
        let own = &self.model;
        if own.chosen.is_none() {
            let finer = Self::new(self.document.clone(), Some((factor * own.mesh.cells as f64) as usize))?;
            return Ok(finer.with_tables(self.tables));
        }
        let along = factor.cbrt();
        let blocks = own.machine.parts.iter().flat_map(|p| &p.blocks);
        let more = |(n, block): ([usize; 3], &PartBlock)| -> [usize; 3] {
            std::array::from_fn(|d| if block.cells[d].is_some() { n[d] } else { (n[d] as f64 * along).round() as usize })
        };
        let counts: Vec<[usize; 3]> = own.mesh.divisions().into_iter().zip(blocks).map(more).collect();
        let mesh = Mesh::with_divisions(&own.machine, &counts, own.mesh.element_size / along)?;
        Ok(Self { document: self.document.clone(), model: MeshedMachine::on(own.machine.clone(), mesh)?, tables: self.tables })
    }

    /// The machine file.
    pub fn document(&self) -> &Document {
        &self.document
    }

    /// A parameter by its name: a condition variable or a dotted key.
    ///
    /// # Errors
    /// Errors of [`MachineParameter::find`].
    pub fn parameter(&self, name: &str) -> Result<MachineParameter> {
        MachineParameter::find(name, &self.document, &self.model.machine)
    }

    /// A parameter by its name; `None` where there is none.
    pub fn known_parameter(&self, name: &str) -> Option<MachineParameter> {
        MachineParameter::known(name, &self.document, &self.model.machine)
    }

    /// Usual parameters: every condition variable, then the keys that the schema calls usual (every contact's conductance, every
    /// emissivity and every source).
    pub fn usual_parameters(&self) -> Vec<MachineParameter> {
        let variables = self.model.machine.variables.iter().map(|v| v.name.clone());
        let is_usual = |key: &String| schema_key(key).is_some_and(|found| found.key.is_usual);
        let keys = self.document.keys().into_iter().filter(is_usual);
        variables.chain(keys).filter_map(|name| self.parameter(&name).ok()).collect()
    }

    /// The file with other values of some parameters; condition variables are not part of it and are left out.
    ///
    /// # Errors
    /// Errors of [`MachineParameter::to_set`] and [`Document::apply_set`].
    pub fn document_with(&self, values: &[(&MachineParameter, f64)]) -> Result<Document> {
        let mut document = self.document.clone();
        for (parameter, value) in values {
            if let Some((key, text)) = parameter.to_set(*value, &self.model.machine)? {
                document.apply_set(&key, &text)?;
            }
        }
        Ok(document)
    }

    /// The study with other values of some parameters, on the same cells.
    ///
    /// # Errors
    /// The machine with these values is not valid, or has other unknowns.
    pub fn with(&self, values: &[(&MachineParameter, f64)]) -> Result<Self> {
        let mut sets = Vec::new();
        for (parameter, value) in values {
            sets.extend(parameter.to_set(*value, &self.model.machine)?);
        }
        let found = self.edited(&sets)?;
        self.check(&found.model.network)?;
        Ok(found)
    }

    /// The study with `--set` (key, value) pairs applied, on the same cells; unknowns may be added, as a new lumped node adds one.
    ///
    /// # Errors
    /// The machine with these values is not valid.
    pub fn edited(&self, sets: &[(String, String)]) -> Result<Self> {
        let mut document = self.document.clone();
        for (key, value) in sets {
            document.apply_set(key, value).map_err(|error| error.in_file(document.file()))?;
        }
        let mut machine = Machine::from_document(&document)?;
        let keys: Vec<&str> = sets.iter().map(|(key, _)| key.as_str()).collect();
        // A key that the file did not have before may change the network's shape.
        let is_channel = |key: &str| matches!(StalePart::of(key, &machine), StalePart::Channel(_));
        let is_report = |key: &str| schema_key(key).is_some_and(|found| found.key.reach == schema::ChangeReach::Report);
        let is_known = keys.iter().all(|key| matches!(self.document.leaf(key), Ok(Some(_))) || is_channel(key) || is_report(key));
        let kept = if is_known { self.kept(&machine, &keys) } else { None };
        let (mesh, network) = match kept {
            Some(network) => (self.model.mesh.clone(), network),
            None => {
                let mesh = self.moved(&mut machine)?.unwrap_or_else(|| self.model.mesh.clone());
                let network = Network::build(&machine, &mesh)?;
                (mesh, network)
            }
        };
        Ok(Self { document, model: MeshedMachine { machine, mesh, network, chosen: self.model.chosen.clone() }, tables: self.tables })
    }

    /// The machine with one value changed, and its network if it differs.
    pub(crate) fn changed(&self, parameter: &MachineParameter, value: f64) -> Result<(Machine, Option<Network>)> {
        let mut machine = Machine::from_document(&self.document_with(&[(parameter, value)])?)?;
        let network = match StalePart::of(&parameter.name, &self.model.machine) {
            StalePart::Load => None,
            StalePart::Contact(_) | StalePart::Channel(_) => self.kept(&machine, &[&parameter.name]),
            StalePart::Network => {
                let moved = self.moved(&mut machine)?;
                let network = Network::build(&machine, moved.as_ref().unwrap_or(&self.model.mesh))?;
                self.check(&network)?;
                Some(network)
            }
        };
        Ok((machine, network))
    }

    /// The network of a machine that differs by these keys alone, without building it; `None` where it must be built.
    fn kept(&self, machine: &Machine, keys: &[&str]) -> Option<Network> {
        let reaches: Vec<StalePart> = keys.iter().map(|key| StalePart::of(key, &self.model.machine)).collect();
        if reaches.contains(&StalePart::Network) {
            return None;
        }
        let mut network = self.model.network.clone();
        for reach in reaches {
            match reach {
                StalePart::Contact(c) => {
                    let contact = machine.contacts.get(c)?;
                    let groups = network.contacts.iter_mut().filter(|group| group.of == Some(c));
                    groups.for_each(|group| group.law = contact.law.clone());
                }
                StalePart::Channel(c) => {
                    let (stream, channel) = (network.streams.get_mut(c)?, machine.channels.get(c)?);
                    (stream.film_factor, stream.minor_loss) = (channel.film_factor, channel.minor_loss);
                    stream.fouling_resistance = channel.fouling_resistance;
                }
                StalePart::Load | StalePart::Network => {}
            }
        }
        Some(network)
    }

    /// The mesh of a machine whose blocks or imported parts moved; `None` where they did not. View factors of the moved geometry are
    /// not kept: the cache beside the file has those of the file's own geometry.
    fn moved(&self, machine: &mut Machine) -> Result<Option<Mesh>> {
        let own = &self.model.machine.parts;
        let place = |part: &Part| part.import.as_ref().map(|import| import.at);
        if own.iter().zip(&machine.parts).all(|(a, b)| a.blocks == b.blocks && place(a) == place(b)) {
            return Ok(None);
        }
        machine.enclosures.iter_mut().for_each(|e| e.cache = None);
        Mesh::with_divisions(machine, &self.model.mesh.divisions(), self.model.mesh.element_size).map(Some)
    }

    fn check(&self, network: &Network) -> Result<()> {
        let own = &self.model.network;
        let shape = |n: &Network| (n.nodes, n.solids, n.streams.iter().map(|s| s.first_node).collect::<Vec<_>>());
        if shape(own) == shape(network) {
            return Ok(());
        }
        Err(Error::input("a small change of this value changes the number of unknowns: no derivative on these cells")
            .help("fix the cell counts of the part, or ask for another number of cells"))
    }
}

/// Parts of a model that must be made anew when a number of the machine file changes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum StalePart {
    /// The load alone: heats, flows, temperatures.
    Load,
    /// The law of a contact.
    Contact(usize),
    /// The factor on a channel's film, its fouling resistance or its loss coefficient.
    Channel(usize),
    /// Anything of the network.
    Network,
}

/// Schema entry of a dotted key.
fn schema_key(key: &str) -> Option<schema::FoundKey> {
    let names = Document::names_in(key)?;
    SCHEMA.find(&names.iter().map(String::as_str).collect::<Vec<_>>())
}

impl StalePart {
    fn of(key: &str, machine: &Machine) -> Self {
        let names = Document::names_in(key).unwrap_or_default();
        let (Some(found), [table, name, ..]) = (schema_key(key), names.as_slice()) else { return Self::Network };
        if names.len() == 2 && matches!(found.form, schema::ValueForm::Table(_)) {
            return Self::Network;
        }
        match found.key.reach {
            schema::ChangeReach::Mesh | schema::ChangeReach::Network => Self::Network,
            schema::ChangeReach::Load | schema::ChangeReach::Report => Self::Load,
            // Surfaces that gas alone would act on are not in the network of a perfect vacuum.
            schema::ChangeReach::LoadUnlessZero if machine.chamber.pressure > 0.0 => Self::Load,
            schema::ChangeReach::LoadUnlessZero => Self::Network,
            schema::ChangeReach::Contact if table == "contact" => {
                machine.contacts.iter().position(|c| c.name == *name).map_or(Self::Network, Self::Contact)
            }
            schema::ChangeReach::Contact => Self::Network,
            schema::ChangeReach::Channel => machine.channels.iter().position(|c| c.name == *name).map_or(Self::Network, Self::Channel),
        }
    }
}
