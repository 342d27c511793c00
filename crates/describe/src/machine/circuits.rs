//! Circuits: their intake, their channels, and the circuits fed by them.

use super::fluids::Fluids;
use super::keys::flow as keys;
use super::names::lookup;
use super::symbols::Symbols;
use super::variables::{formula, formula_or};
use coldplate_base::document::{Section, Value, suggestion};
use coldplate_base::error::Result;
use coldplate_base::formula::Formula;
use coldplate_base::units::{Dimension, ZERO_CELSIUS};
use coldplate_physics::liquid::Liquid;

/// A coolant circuit: its intake and its channels.
#[derive(Debug, Clone)]
pub struct Circuit {
    /// Name.
    pub name: String,
    /// Inflow of the circuit.
    pub intake: Intake,
    /// Properties of the liquid.
    pub liquid: Liquid,
    /// Lowest absolute pressure of the circuit, Pa; the boiling point of the liquid is taken at this pressure.
    pub pressure: f64,
    /// Order in which the channels are passed.
    pub layout: Layout,
    /// Branches with a given flow, which is not found from pressure drops.
    pub branches: Vec<Branch>,
    /// Whether viscous dissipation heats the liquid.
    pub dissipation: bool,
}

/// Channels in series and parallel.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Layout {
    /// Index into [`Machine::channels`](super::Machine::channels).
    Channel(usize),
    /// One after the other.
    Series(Vec<Layout>),
    /// Side by side; branches without a given flow share the rest at equal pressure drops.
    Parallel(Vec<Layout>),
}

/// Inflow of a circuit.
#[derive(Debug, Clone)]
pub enum Intake {
    /// A flow (m³/s at inlet conditions) of a temperature (K).
    Stated {
        /// Volume flow, m³/s.
        flow: Formula,
        /// Temperature, K.
        temperature: Formula,
    },
    /// The mixed outflow of other circuits.
    Fed {
        /// Indices of the feeding circuits; all stand before this one.
        from: Vec<usize>,
        /// Volume flow taken, m³/s; `None` takes all.
        flow: Option<Formula>,
    },
}

/// A volume flow and the temperature at which its properties are taken.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Supply {
    /// Volume flow, m³/s.
    pub flow: f64,
    /// Temperature, K.
    pub temperature: f64,
}

/// A branch of parallel channels with a given flow.
#[derive(Debug, Clone)]
pub struct Branch {
    /// A channel of the branch outside any further branching.
    pub channel: usize,
    /// Flow through the branch.
    pub flow: BranchFlow,
}

/// The given flow of a branch.
#[derive(Debug, Clone)]
pub enum BranchFlow {
    /// Share of the flow into the group of branches.
    Share(Formula),
    /// Volume flow at the circuit's inlet conditions, m³/s.
    Flow(Formula),
}

impl Intake {
    /// Supply that other circuits offer this one, from the flows (m³/s) and temperatures (K) that enter the circuits
    /// before it; `None` for a circuit that is not fed.
    pub fn offered(&self, flows: &[f64], inlets: &[f64]) -> Option<Supply> {
        let Self::Fed { from, .. } = self else { return None };
        let flow: f64 = from.iter().map(|c| flows[*c]).sum();
        let weight = |c: &usize| if flow > 0.0 { flows[*c] / flow } else { 1.0 / from.len() as f64 };
        Some(Supply { flow, temperature: from.iter().map(|c| weight(c) * inlets[*c]).sum() })
    }

    /// The circuits that feed this one.
    pub fn feeders(&self) -> &[usize] {
        if let Self::Fed { from, .. } = self { from } else { &[] }
    }
}

impl Layout {
    /// Whether a channel lies in this layout outside any further branching.
    pub fn has_directly(&self, channel: usize) -> bool {
        match self {
            Self::Channel(own) => *own == channel,
            Self::Series(items) => items.iter().any(|item| item.has_directly(channel)),
            Self::Parallel(_) => false,
        }
    }

    /// All groups of branches in this layout.
    fn groups(&self) -> Vec<&[Layout]> {
        match self {
            Self::Channel(_) => Vec::new(),
            Self::Series(items) => items.iter().flat_map(Self::groups).collect(),
            Self::Parallel(items) => std::iter::once(items.as_slice()).chain(items.iter().flat_map(Self::groups)).collect(),
        }
    }
}

/// Reads `[circuit.NAME]`, feeding circuits first; every channel must be fed exactly once.
pub(super) fn circuits(root: &Section<'_>, names: &[String], symbols: &Symbols, fluids: &Fluids) -> Result<Vec<Circuit>> {
    let mut found: Vec<Circuit> = Vec::new();
    let mut fed: Vec<Option<String>> = vec![None; names.len()];
    for (name, section) in ordered(root)? {
        let from = feeders(&section)?;
        let from: Vec<usize> = from.iter().filter_map(|feeder| found.iter().position(|c| c.name == *feeder)).collect();
        let intake = intake(&section, from, symbols)?;
        let above: Vec<&Circuit> = intake.feeders().iter().map(|c| &found[*c]).collect();
        let liquid = liquid(&section, fluids, &above)?;
        let layout = layout(&section.value("layout")?, true, names, &name, &mut fed)?;
        let branches = given_branches(&section, &layout, names, symbols)?;
        let dissipation = keys::DISSIPATION.read_flag(&section)?;
        let pressure = match above.iter().map(|c| c.pressure).reduce(f64::min) {
            Some(lowest) if !section.has(keys::PRESSURE.name) => lowest,
            _ => keys::PRESSURE.read(&section)?,
        };
        if !(1e3..=1e6).contains(&pressure) {
            return Err(section.error_at("pressure", "properties of liquids hold from 0.01 to 10 bar").help("state the absolute pressure"));
        }
        let inlet = if let Intake::Stated { temperature, .. } = &intake { temperature.as_constant() } else { None };
        if let Some((inlet, boils)) = inlet.zip(liquid.boils_at(pressure)).filter(|(inlet, boils)| inlet > boils) {
            let help = format!(
                "water boils at {:.1} degC under {:.4} bar: state the circuit's absolute pressure",
                boils - ZERO_CELSIUS,
                pressure / 1e5
            );
            let what = format!("the water enters as steam, at {:.1} degC", inlet - ZERO_CELSIUS);
            return Err(section.error_at("inlet_temperature", what).help(help));
        }
        section.finish()?;
        found.push(Circuit { name, intake, liquid, pressure, layout, branches, dissipation });
    }
    match fed.iter().position(Option::is_none) {
        None => Ok(found),
        Some(at) => {
            let what = format!("no circuit feeds the channel '{}'", names[at]);
            let table = root.section("channel")?;
            Err(table.error_at(&names[at], what).help("name it in the layout of a [circuit.NAME]"))
        }
    }
}

/// The names under `from`.
fn feeders(section: &Section<'_>) -> Result<Vec<String>> {
    match section.opt("from") {
        None => Ok(Vec::new()),
        Some(value) if value.is_text() => Ok(vec![value.text()?]),
        Some(value) => value.texts(),
    }
}

/// The circuits of the file, feeding circuits before the circuits they feed.
fn ordered<'a>(root: &Section<'a>) -> Result<Vec<(String, Section<'a>)>> {
    let mut waiting = root.sections("circuit")?;
    let names: Vec<String> = waiting.iter().map(|(name, _)| name.clone()).collect();
    for (name, section) in &waiting {
        let from = feeders(section)?;
        if from.is_empty() && section.has("from") {
            return Err(section.error_at("from", "no circuit is named").help("write from = \"NAME\", or leave it out"));
        }
        for (i, feeder) in from.iter().enumerate() {
            if !names.contains(feeder) {
                let known: Vec<&str> = names.iter().filter(|n| *n != name).map(String::as_str).collect();
                return Err(section.error_at("from", format!("there is no circuit '{feeder}'")).help(suggestion(feeder, &known)));
            }
            if from[..i].contains(feeder) {
                return Err(section.error_at("from", format!("the circuit '{feeder}' is named twice")).help("name it once"));
            }
        }
    }
    let mut found: Vec<(String, Section<'a>)> = Vec::new();
    while !waiting.is_empty() {
        let mut next = None;
        for (i, (_, section)) in waiting.iter().enumerate() {
            if feeders(section)?.iter().all(|feeder| found.iter().any(|(name, _)| name == feeder)) {
                next = Some(i);
                break;
            }
        }
        let Some(next) = next else {
            let circle: Vec<&str> = waiting.iter().map(|(name, _)| name.as_str()).collect();
            return Err(waiting[0]
                .1
                .error_at("from", "these circuits feed one another in a circle: no flow into them is given")
                .help(format!("give one of them a flow and an inlet_temperature instead of 'from': {}", circle.join(", "))));
        };
        found.push(waiting.remove(next));
    }
    Ok(found)
}

fn intake(section: &Section<'_>, from: Vec<usize>, symbols: &Symbols) -> Result<Intake> {
    let check = |flow: &Formula| {
        if flow.as_constant().is_some_and(|q| q < 0.0) {
            return Err(section.error_at("flow", "a flow cannot be negative").help("turn the layout round instead"));
        }
        Ok(())
    };
    if from.is_empty() {
        let flow = formula_or(section, &keys::FLOW, symbols)?;
        check(&flow)?;
        return Ok(Intake::Stated { flow, temperature: formula_or(section, &keys::INLET_TEMPERATURE, symbols)? });
    }
    if section.has(keys::INLET_TEMPERATURE.name) {
        let what = "the inflow from another circuit has the temperature at which it leaves that circuit";
        return Err(section.error_at(keys::INLET_TEMPERATURE.name, what).help("leave out this key, or 'from'"));
    }
    let flow = section.opt(keys::FLOW.name).map(|value| formula(&value, Dimension::VOLUME_FLOW, symbols)).transpose()?;
    flow.as_ref().map_or(Ok(()), check)?;
    Ok(Intake::Fed { from, flow })
}

/// The liquid of a circuit; a circuit that is fed has the liquid of its feeders.
fn liquid(section: &Section<'_>, fluids: &Fluids, above: &[&Circuit]) -> Result<Liquid> {
    let own = match section.opt("liquid") {
        None => above.first().map_or(Liquid::Water, |feeder| feeder.liquid.clone()),
        Some(value) if value.is_text() => fluids.find(&value)?,
        Some(value) => {
            let table = value.section()?;
            let liquid = Liquid::Constant {
                density: table.positive("density", Dimension::DENSITY)?,
                specific_heat: table.positive("specific_heat", Dimension::SPECIFIC_HEAT)?,
                viscosity: table.positive("viscosity", Dimension::VISCOSITY)?,
                conductivity: table.positive("conductivity", Dimension::CONDUCTIVITY)?,
            };
            table.finish()?;
            liquid
        }
    };
    match above.iter().find(|feeder| feeder.liquid != own) {
        None => Ok(own),
        Some(feeder) => Err(section
            .error_at("from", format!("the circuit '{}' carries another liquid", feeder.name))
            .help("circuits that feed one another have one liquid; a circuit without 'liquid' has that of its feeder")),
    }
}

/// Reads `branches`: in every group of branches at least one takes the rest.
fn given_branches(section: &Section<'_>, layout: &Layout, names: &[String], symbols: &Symbols) -> Result<Vec<Branch>> {
    let Some(table) = section.opt_section("branches")? else { return Ok(Vec::new()) };
    let groups = layout.groups();
    let mut found: Vec<Branch> = Vec::new();
    for name in table.keys() {
        let value = table.value(name)?;
        let Some(channel) = names.iter().position(|n| n == name) else {
            let known: Vec<&str> = names.iter().map(String::as_str).collect();
            return Err(value.error(format!("there is no channel '{name}'")).help(suggestion(name, &known)));
        };
        let Some(group) = groups.iter().find(|group| group.iter().any(|item| item.has_directly(channel))) else {
            return Err(value
                .error(format!("'{name}' is in no branch of this circuit that has others beside it"))
                .help("name one channel of a list in the layout that lies parallel to others"));
        };
        found.push(Branch { channel, flow: branch_flow(&value, symbols)? });
        let given = |item: &&Layout| found.iter().filter(|b| item.has_directly(b.channel)).count();
        if group.iter().any(|item| given(&item) > 1) {
            return Err(value.error(format!("the branch of '{name}' is given twice")).help("name one channel of each branch"));
        }
        if group.iter().all(|item| given(&item) == 1) {
            return Err(value.error("all branches of a group are given").help("leave one out: it takes the rest"));
        }
    }
    table.finish()?;
    Ok(found)
}

/// A share without unit, or a volume flow.
fn branch_flow(value: &Value<'_>, symbols: &Symbols) -> Result<BranchFlow> {
    let help = "write a share of what flows in, 0.3 or \"30 %\", a flow, \"2 L/min\", or a formula of one of them";
    let read = formula(value, Dimension::NUMBER, symbols).map(BranchFlow::Share);
    let read = read.or_else(|_| formula(value, Dimension::VOLUME_FLOW, symbols).map(BranchFlow::Flow));
    let found = read.map_err(|_| value.error("this is neither a share nor a flow").help(help))?;
    let (BranchFlow::Share(given) | BranchFlow::Flow(given)) = &found;
    let most = if matches!(found, BranchFlow::Share(_)) { 1.0 } else { f64::INFINITY };
    if given.as_constant().is_some_and(|given| !(0.0..=most).contains(&given)) {
        return Err(value.error("a share lies from 0 to 1, and a flow is not negative").help(help));
    }
    Ok(found)
}

/// Layout from nested lists: the outer list is in series, a list inside it in parallel, a list inside that in series,
/// and so forth.
fn layout(value: &Value<'_>, series: bool, names: &[String], circuit: &str, fed: &mut [Option<String>]) -> Result<Layout> {
    if value.is_text() {
        let channel = lookup(value, names, "channel")?;
        if let Some(other) = &fed[channel] {
            return Err(value
                .error(format!("the channel '{}' is fed already, by circuit '{other}'", names[channel]))
                .help("name every channel once"));
        }
        fed[channel] = Some(circuit.to_string());
        return Ok(Layout::Channel(channel));
    }
    let entries = value.list()?;
    if entries.is_empty() {
        return Err(value
            .error("this part of the layout is empty")
            .help("write layout = [\"first\", [\"one side\", \"other side\"], \"last\"]"));
    }
    let mut inside = entries.iter().map(|entry| layout(entry, !series, names, circuit, fed)).collect::<Result<Vec<_>>>()?;
    match (inside.len(), inside.pop()) {
        (1, Some(only)) => Ok(only),
        (_, last) => {
            inside.extend(last);
            Ok(if series { Layout::Series(inside) } else { Layout::Parallel(inside) })
        }
    }
}

/// Number of parallel paths the flow is split into at `channel`; `None` if the layout does not contain it.
pub(super) fn branches(layout: &Layout, channel: usize) -> Option<usize> {
    match layout {
        Layout::Channel(index) => (*index == channel).then_some(1),
        Layout::Series(inside) => inside.iter().find_map(|layout| branches(layout, channel)),
        Layout::Parallel(inside) => inside.iter().find_map(|layout| branches(layout, channel)).map(|n| n * inside.len()),
    }
}
