//! Contacts, and boundary conditions on faces.

use super::super::contact_law;
use super::elastic::JOINT_KEYS;
use super::flow::COORDINATES;
use super::{AREA, CELSIUS, FILM, MILLIMETRES, TRIPLE};
use crate::schema::{Form, Key, Reach, Table, Unit, Unstated};
use coldplate_base::units::Dimension;
use coldplate_physics::convection::{Gas, Shape};

/// The places a contact joins.
const PLACES: &[Key] = &[Key::new(
    "between",
    Form::List(&Form::Name("part, face or node"), Some(2)),
    "two parts, faces or nodes: `[\"motor.-z\", \"plate.+z\"]`",
)
.required()];
/// The area of a contact.
const CONTACT_AREA: &[Key] = &[Key::new(
    "area",
    Form::Quantity(AREA),
    "needed for a conductance to a lumped node; between parts it replaces the true touching area in total",
)
.positive()
.or(Unstated::Follows("the touching area"))];

/// Factor on the conductance of a contact.
pub(in crate::machine) const FACTOR: Key = Key::new(
    "factor",
    Form::Formula(Unit::of(Dimension::NUMBER, "1")),
    "formula; on the conductance of any law, not negative: `\"1 + time_s / 500\"`; 0 is an open joint",
)
.or(Unstated::Si(1.0))
.reaching(Reach::Load);

/// The places, the keys of every law, the area, the factor and the joint.
const CONTACT_KEYS: [&[Key]; contact_law::COUNT + 4] = {
    let mut all = [PLACES; contact_law::COUNT + 4];
    let mut law = 0;
    while law < contact_law::COUNT {
        all[law + 1] = contact_law::KEYS[law];
        law += 1;
    }
    all[contact_law::COUNT + 1] = CONTACT_AREA;
    all[contact_law::COUNT + 2] = &[FACTOR];
    all[contact_law::COUNT + 3] = JOINT_KEYS;
    all
};

/// `[contact.NAME]`
pub(super) const CONTACT: Table = Table { doc: "what joins two places", keys: &CONTACT_KEYS, one_of: contact_law::NAMES };

const DEFAULT_LAW: Table = Table { doc: "a law for every touching pair", keys: &contact_law::KEYS, one_of: contact_law::NAMES };

/// `[contacts]`
pub(super) const CONTACTS: Table = Table {
    doc: "touching faces that no contact names",
    keys: &[&[Key::new(
        "default",
        Form::Either(&[Form::Word(&["bonded", "insulated"]), Form::Table(&DEFAULT_LAW)]),
        "`\"bonded\"`, `\"insulated\"` or a law such as `{ conductance = \"500 W/(m2 K)\" }`",
    )
    .or(Unstated::Follows("bonded, with a warning"))]],
    one_of: &[],
};

/// Temperature that a boundary radiates to.
pub(in crate::machine) const SURROUNDINGS: Key =
    Key::new("surroundings_temperature", Form::Formula(CELSIUS), "with `emissivity`: formula; what the faces radiate to")
        .or(Unstated::Text("ambient_temperature"))
        .reaching(Reach::Load);

/// Gas of free convection.
pub(in crate::machine) const GAS: Key =
    Key::new("gas", Form::Word(&Gas::NAMES), "with `free_convection`: the gas").or(Unstated::Text("air")).reaching(Reach::Load);
/// Pressure of the gas.
pub(in crate::machine) const GAS_PRESSURE: Key =
    Key::new("gas_pressure", Form::Quantity(Unit::of(Dimension::PRESSURE, "bar")), "with `free_convection`: absolute pressure of the gas")
        .or(Unstated::Si(101_325.0))
        .reaching(Reach::Load);
const RANGE: Form = Form::List(&Form::Quantity(MILLIMETRES), Some(2));

/// Origin of the coordinates of a part of a face.
pub(in crate::machine) const WITHIN_COORDINATES: Key = COORDINATES;

const WITHIN: Table = Table {
    doc: "a part of the faces: between coordinates, or a disc",
    keys: &[&[
        Key::new("x", RANGE, "between these: `[\"10 mm\", \"30 mm\"]`"),
        Key::new("y", RANGE, "likewise"),
        Key::new("z", RANGE, "likewise"),
        Key::new("centre", TRIPLE, "instead: the centre of a disc").also(&["center"]),
        Key::new("radius", Form::Quantity(MILLIMETRES), "its radius").positive(),
        WITHIN_COORDINATES,
    ]],
    one_of: &[],
};

/// `[boundary.NAME]`
pub(super) const BOUNDARY: Table = Table {
    doc: "what is prescribed on faces",
    keys: &[&[
        Key::new("faces", Form::List(&Form::Name("face"), None), "`[\"bed.-z\"]`").also(&["face", "on"]),
        Key::new("within", Form::Table(&WITHIN), "part of these faces alone; see below"),
        Key::new("node", Form::Name("node"), "instead of `faces`: a lumped node, with `area`"),
        Key::new("area", Form::Quantity(AREA), "of the node").positive(),
        Key::new("temperature", Form::Formula(CELSIUS), "formula; of the surface").reaching(Reach::Load),
        Key::new("film", Form::Formula(FILM), "formula; film coefficient, with `fluid_temperature`").reaching(Reach::Load).also(&[
            "h",
            "htc",
            "film_coefficient",
            "heat_transfer_coefficient",
            "alpha",
        ]),
        Key::new(
            "fluid_temperature",
            Form::Formula(CELSIUS),
            "formula; of the fluid behind the film; of the gas of free convection `ambient_temperature`",
        )
        .reaching(Reach::Load),
        Key::new("heat_flux", Form::Formula(Unit::of(Dimension::HEAT_FLUX, "W/m2")), "formula; into the machine")
            .reaching(Reach::Load)
            .also(&["flux", "q"]),
        Key::new(
            "free_convection",
            Form::Word(&Shape::NAMES),
            "to still gas at `fluid_temperature`: film by the law of a shape, with `length`; see below",
        )
        .reaching(Reach::Load)
        .also(&["natural_convection"]),
        Key::new(
            "length",
            Form::Quantity(MILLIMETRES),
            "with `free_convection`: height of a vertical plate, area over perimeter of a horizontal one, diameter of a cylinder or sphere",
        )
        .positive()
        .reaching(Reach::Load),
        GAS,
        GAS_PRESSURE,
        Key::new("emissivity", Form::Number, "radiation, with `surroundings_temperature`").reaching(Reach::Load).usual(),
        SURROUNDINGS,
    ]],
    one_of: &["temperature", "film", "heat_flux", "free_convection", "emissivity"],
};
