//! The schema of a machine file: every table and key with its form, default, reach and a line about it.
//!
//! The reader, `--set`, `--free`, sensitivities, "did you mean", the tables of `docs/reference/machine-file.md` and the JSON
//! Schema printed by `coldplate schema` all use this schema.

pub(super) mod bodies;
pub(super) mod control;
pub(super) mod elastic;
pub(super) mod flow;
pub(super) mod heat;
pub(super) mod joints;
pub(super) mod outputs;
pub(super) mod radiation;
pub(super) mod uncertain;

use crate::schema::{ChangeReach, Key, KeyTable, Unit, Unstated, ValueForm};
use coldplate_base::units::Dimension;

/// Lengths are shown in millimetres.
const MILLIMETRES: Unit = Unit::of(Dimension::LENGTH, "mm");
/// Unit of lengths of the size of a machine.
const METRES: Unit = Unit::of(Dimension::LENGTH, "m");
const MICROMETRES: Unit = Unit::of(Dimension::LENGTH, "um");
pub(super) const AREA: Unit = Unit::of(Dimension::AREA, "m2");
const CELSIUS: Unit = Unit::of(Dimension::TEMPERATURE, "degC");
pub(super) const KELVIN: Unit = Unit::of(Dimension::DIFFERENCE, "K");
pub(super) const FILM: Unit = Unit::of(Dimension::FILM, "W/(m2 K)");
pub(super) const AREA_RESISTANCE: Unit = Unit::of(Dimension::AREA_RESISTANCE, "m2 K/W");
const CONDUCTIVITY: Unit = Unit::of(Dimension::CONDUCTIVITY, "W/(m K)");
const DENSITY: Unit = Unit::of(Dimension::DENSITY, "kg/m3");
const SPECIFIC_HEAT: Unit = Unit::of(Dimension::SPECIFIC_HEAT, "J/(kg K)");
pub(super) const SECONDS: Unit = Unit::of(Dimension::TIME, "s");
pub(super) const PASCALS: Unit = Unit::of(Dimension::PRESSURE, "Pa");
pub(super) const WATTS: Unit = Unit::of(Dimension::POWER, "W");
pub(super) const CONDUCTANCE: Unit = Unit::of(Dimension::CONDUCTANCE, "W/K");

/// A property: a constant, or a table against temperature.
const PROPERTY_OF_CONDUCTION: ValueForm = ValueForm::Either(&[ValueForm::Quantity(CONDUCTIVITY), ValueForm::Curve(CELSIUS, CONDUCTIVITY)]);
/// A point or three sizes.
const TRIPLE: ValueForm = ValueForm::List(&ValueForm::Quantity(MILLIMETRES), Some(3));

/// Cells aimed at when neither the file nor the caller says.
pub(super) const CELLS: Key = Key::new("cells", ValueForm::Whole(1), "cells aimed at when the caller does not say")
    .or(Unstated::Whole(20_000))
    .reaching(ChangeReach::Mesh);

/// Largest error of a reading from the mesh.
pub(super) const ACCURACY: Key = Key::new(
    "accuracy",
    ValueForm::Quantity(KELVIN),
    "cells are chosen so that they leave less than this open in every reading: `\"0.05 K\"`; `cells` then says nothing",
)
.positive()
.reaching(ChangeReach::Mesh);

const MESH: KeyTable = KeyTable { doc: "how finely the machine is meshed", keys: &[&[CELLS, ACCURACY]], one_of: &[] };

const NAME: Key = Key::new("name", ValueForm::Text, "one line").required().reaching(ChangeReach::Report).also(&["title"]);
const DESCRIPTION: Key = Key::new("description", ValueForm::Text, "free text").reaching(ChangeReach::Report);

/// The machine file.
pub const SCHEMA: KeyTable = KeyTable {
    doc: "A machine file of coldplate: what a machine is made of, what heats and cools it, and what is measured.",
    keys: &[&[
        NAME,
        DESCRIPTION,
        Key::new("variables", ValueForm::Free(&heat::VARIABLE), "what a condition consists of"),
        Key::new("define", ValueForm::Free(&ValueForm::Formula(Unit::of(Dimension::NUMBER, "1"))), "intermediate results for formulas"),
        Key::new("drive", ValueForm::Named(&heat::DRIVE), "feed drives, whose heats formulas may use"),
        Key::new("chamber", ValueForm::Table(&radiation::CHAMBER), "the vacuum chamber around the machine"),
        Key::new("mesh", ValueForm::Table(&MESH), "how finely the machine is meshed").reaching(ChangeReach::Mesh),
        Key::new("material", ValueForm::Named(&bodies::MATERIAL), "materials beside those of the library").also(&["materials"]),
        Key::new("part", ValueForm::Named(&bodies::PART), "bodies of one material").also(&["parts"]),
        Key::new("surfaces", ValueForm::Table(&radiation::SURFACES), "radiation of all parts that do not say otherwise"),
        Key::new("node", ValueForm::Named(&bodies::NODE), "lumped nodes").also(&["nodes"]),
        Key::new("contact", ValueForm::Named(&joints::CONTACT), "what joins two places"),
        Key::new("contacts", ValueForm::Table(&joints::CONTACTS), "what joins places that touch and that no contact names"),
        Key::new("channel", ValueForm::Named(&flow::CHANNEL), "coolant channels").also(&["channels"]),
        Key::new("fluid", ValueForm::Named(&flow::FLUID), "liquids beside water and those of the library").also(&["fluids", "liquid"]),
        Key::new("circuit", ValueForm::Named(&flow::CIRCUIT), "what flows through the channels").also(&["circuits"]),
        Key::new("boundary", ValueForm::Named(&joints::BOUNDARY), "what is prescribed on faces").also(&["boundaries"]),
        Key::new("radiation_link", ValueForm::Named(&radiation::LINK), "radiation between two surfaces that face each other"),
        Key::new("enclosure", ValueForm::Named(&radiation::ENCLOSURE), "grey surfaces that all see each other"),
        Key::new("source", ValueForm::Named(&heat::SOURCE), "heat sources").also(&["sources", "heat"]),
        Key::new("controller", ValueForm::Named(&control::CONTROLLER), "what switches or leads sources by a sensor")
            .also(&["controllers", "thermostat"]),
        Key::new("sensor", ValueForm::Named(&outputs::SENSOR), "measurement points").also(&["sensors"]),
        Key::new("heat_flow", ValueForm::Named(&outputs::HEAT_FLOW), "heat-flow sensors").also(&["heat_flows"]),
        Key::new("displacement", ValueForm::Named(&elastic::DISPLACEMENT), "displacement sensors").also(&["displacements"]),
        Key::new("support", ValueForm::Named(&elastic::SUPPORT), "what holds the machine, for displacements").also(&["supports"]),
        Key::new("elasticity", ValueForm::Table(&elastic::ELASTICITY), "what displacements are counted from"),
        Key::new("limit", ValueForm::Named(&outputs::LIMIT), "what is acceptable").also(&["limits"]),
        Key::new("measurement", ValueForm::Named(&outputs::MEASUREMENT), "measured states to print beside the prediction")
            .also(&["measurements"]),
        Key::new("uncertain", ValueForm::Named(&uncertain::FACTOR), "factors that several numbers share and that are uncertain"),
        Key::new("correlation", ValueForm::Tables(&uncertain::CORRELATION), "uncertain numbers that deviate together"),
        Key::new("model_error", ValueForm::Table(&uncertain::MODEL_ERROR), "what the model misses"),
        Key::new("prior", ValueForm::Table(&super::prior::PRIOR), "how large causes of an error usually are"),
    ]],
    one_of: &[],
};
