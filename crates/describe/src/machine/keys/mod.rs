//! The schema of a machine file: every table and key with its form, default, reach and a line about it.
//!
//! The reader, `--set`, `--free`, sensitivities, "did you mean", the tables of `docs/machine-file.md` and the JSON
//! Schema printed by `coldplate schema` all use this schema.

pub(super) mod bodies;
pub(super) mod elastic;
pub(super) mod flow;
pub(super) mod heat;
pub(super) mod joints;
pub(super) mod outputs;
pub(super) mod radiation;
pub(super) mod uncertain;

use crate::schema::{Form, Key, Reach, Table, Unit, Unstated};
use coldplate_base::units::Dimension;

/// Lengths are shown in millimetres.
const MILLIMETRES: Unit = Unit::of(Dimension::LENGTH, "mm");
/// Unit of lengths of the size of a machine.
const METRES: Unit = Unit::of(Dimension::LENGTH, "m");
const MICROMETRES: Unit = Unit::of(Dimension::LENGTH, "um");
const AREA: Unit = Unit::of(Dimension::AREA, "m2");
const CELSIUS: Unit = Unit::of(Dimension::TEMPERATURE, "degC");
const KELVIN: Unit = Unit::of(Dimension::DIFFERENCE, "K");
const FILM: Unit = Unit::of(Dimension::FILM, "W/(m2 K)");
const AREA_RESISTANCE: Unit = Unit::of(Dimension::AREA_RESISTANCE, "m2 K/W");
const CONDUCTIVITY: Unit = Unit::of(Dimension::CONDUCTIVITY, "W/(m K)");
const DENSITY: Unit = Unit::of(Dimension::DENSITY, "kg/m3");
const SPECIFIC_HEAT: Unit = Unit::of(Dimension::SPECIFIC_HEAT, "J/(kg K)");
const SECONDS: Unit = Unit::of(Dimension::TIME, "s");
const PASCALS: Unit = Unit::of(Dimension::PRESSURE, "Pa");

/// A property: a constant, or a table against temperature.
const PROPERTY_OF_CONDUCTION: Form = Form::Either(&[Form::Quantity(CONDUCTIVITY), Form::Curve(CELSIUS, CONDUCTIVITY)]);
/// A point or three sizes.
const TRIPLE: Form = Form::List(&Form::Quantity(MILLIMETRES), Some(3));

/// Cells aimed at when neither the file nor the caller says.
pub(super) const CELLS: Key =
    Key::new("cells", Form::Whole(1), "cells aimed at when the caller does not say").or(Unstated::Whole(20_000)).reaching(Reach::Mesh);

/// Largest error of a reading from the mesh.
pub(super) const ACCURACY: Key = Key::new(
    "accuracy",
    Form::Quantity(KELVIN),
    "cells are chosen so that they leave less than this open in every reading: `\"0.05 K\"`; `cells` then says nothing",
)
.positive()
.reaching(Reach::Mesh);

const MESH: Table = Table { doc: "how finely the machine is meshed", keys: &[&[CELLS, ACCURACY]], one_of: &[] };

const NAME: Key = Key::new("name", Form::Text, "one line").required().reaching(Reach::Report).also(&["title"]);
const DESCRIPTION: Key = Key::new("description", Form::Text, "free text").reaching(Reach::Report);

/// The machine file.
pub const SCHEMA: Table = Table {
    doc: "A machine file of coldplate: what a machine is made of, what heats and cools it, and what is measured.",
    keys: &[&[
        NAME,
        DESCRIPTION,
        Key::new("variables", Form::Free(&heat::VARIABLE), "what a condition consists of"),
        Key::new("define", Form::Free(&Form::Formula(Unit::of(Dimension::NUMBER, "1"))), "intermediate results for formulas"),
        Key::new("drive", Form::Named(&heat::DRIVE), "feed drives, whose heats formulas may use"),
        Key::new("chamber", Form::Table(&radiation::CHAMBER), "the vacuum chamber around the machine"),
        Key::new("mesh", Form::Table(&MESH), "how finely the machine is meshed").reaching(Reach::Mesh),
        Key::new("material", Form::Named(&bodies::MATERIAL), "materials beside those of the library").also(&["materials"]),
        Key::new("part", Form::Named(&bodies::PART), "bodies of one material").also(&["parts"]),
        Key::new("surfaces", Form::Table(&radiation::SURFACES), "radiation of all parts that do not say otherwise"),
        Key::new("node", Form::Named(&bodies::NODE), "lumped nodes").also(&["nodes"]),
        Key::new("contact", Form::Named(&joints::CONTACT), "what joins two places"),
        Key::new("contacts", Form::Table(&joints::CONTACTS), "what joins places that touch and that no contact names"),
        Key::new("channel", Form::Named(&flow::CHANNEL), "coolant channels").also(&["channels"]),
        Key::new("fluid", Form::Named(&flow::FLUID), "liquids beside water and those of the library").also(&["fluids", "liquid"]),
        Key::new("circuit", Form::Named(&flow::CIRCUIT), "what flows through the channels").also(&["circuits"]),
        Key::new("boundary", Form::Named(&joints::BOUNDARY), "what is prescribed on faces").also(&["boundaries"]),
        Key::new("radiation_link", Form::Named(&radiation::LINK), "radiation between two surfaces that face each other"),
        Key::new("enclosure", Form::Named(&radiation::ENCLOSURE), "grey surfaces that all see each other"),
        Key::new("source", Form::Named(&heat::SOURCE), "heat sources").also(&["sources", "heat"]),
        Key::new("sensor", Form::Named(&outputs::SENSOR), "measurement points").also(&["sensors"]),
        Key::new("heat_flow", Form::Named(&outputs::HEAT_FLOW), "heat-flow sensors").also(&["heat_flows"]),
        Key::new("displacement", Form::Named(&elastic::DISPLACEMENT), "displacement sensors").also(&["displacements"]),
        Key::new("support", Form::Named(&elastic::SUPPORT), "what holds the machine, for displacements").also(&["supports"]),
        Key::new("elasticity", Form::Table(&elastic::ELASTICITY), "what displacements are counted from"),
        Key::new("limit", Form::Named(&outputs::LIMIT), "what is acceptable").also(&["limits"]),
        Key::new("measurement", Form::Named(&outputs::MEASUREMENT), "measured states to print beside the prediction")
            .also(&["measurements"]),
        Key::new("uncertain", Form::Named(&uncertain::FACTOR), "factors that several numbers share and that are uncertain"),
        Key::new("correlation", Form::Tables(&uncertain::CORRELATION), "uncertain numbers that deviate together"),
        Key::new("model_error", Form::Table(&uncertain::MODEL_ERROR), "what the model misses"),
    ]],
    one_of: &[],
};
