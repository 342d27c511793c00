//! Contacts, and boundary conditions on faces.

use super::super::contact_law;
use super::elastic::JOINT_KEYS;
use super::flow::COORDINATES;
use super::{AREA, CELSIUS, FILM, MILLIMETRES, TRIPLE};
use crate::schema::{ChangeReach, Key, KeyTable, Unit, Unstated, ValueForm};
use coldplate_base::condition::AMBIENT_TEMPERATURE;
use coldplate_base::units::Dimension;
use coldplate_physics::convection::{BodyShape, Gas};

/// The places a contact joins.
const PLACES: &[Key] = &[Key::new(
    "between",
    ValueForm::List(&ValueForm::Name("part, face or node"), Some(2)),
    "two parts, faces or nodes: `[\"motor.-z\", \"plate.+z\"]`",
)
.required()];
/// The area of a contact.
const CONTACT_AREA: &[Key] = &[Key::new(
    "area",
    ValueForm::Quantity(AREA),
    "needed for a conductance to a lumped node; between parts it replaces the true touching area in total",
)
.positive()
.or(Unstated::Follows("the touching area"))];

/// Factor on the conductance of a contact.
pub(in crate::machine) const FACTOR: Key = Key::new(
    "factor",
    ValueForm::Formula(Unit::of(Dimension::NUMBER, "1")),
    "formula; on the conductance of any law, not negative: `\"1 + time_s / 500\"`; 0 is an open joint",
)
.or(Unstated::Si(1.0))
.reaching(ChangeReach::Load);

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
pub(super) const CONTACT: KeyTable = KeyTable { doc: "what joins two places", keys: &CONTACT_KEYS, one_of: contact_law::NAMES };

const DEFAULT_LAW: KeyTable = KeyTable { doc: "a law for every touching pair", keys: &contact_law::KEYS, one_of: contact_law::NAMES };

/// `[contacts]`
pub(super) const CONTACTS: KeyTable = KeyTable {
    doc: "touching faces that no contact names",
    keys: &[&[Key::new(
        "default",
        ValueForm::Either(&[ValueForm::Word(&["bonded", "insulated"]), ValueForm::Table(&DEFAULT_LAW)]),
        "`\"bonded\"`, `\"insulated\"` or a law such as `{ conductance = \"500 W/(m2 K)\" }`",
    )
    .or(Unstated::Follows("bonded, with a warning"))]],
    one_of: &[],
};

/// Temperature that a boundary radiates to.
pub(in crate::machine) const SURROUNDINGS: Key =
    Key::new("surroundings_temperature", ValueForm::Formula(CELSIUS), "with `emissivity`: formula; what the faces radiate to")
        .or(Unstated::Text(AMBIENT_TEMPERATURE))
        .reaching(ChangeReach::Load);

/// Gas of free convection.
pub(in crate::machine) const GAS: Key =
    Key::new("gas", ValueForm::Word(&Gas::NAMES), "with `free_convection`: the gas").or(Unstated::Text("air")).reaching(ChangeReach::Load);
/// Pressure of the gas.
pub(in crate::machine) const GAS_PRESSURE: Key = Key::new(
    "gas_pressure",
    ValueForm::Quantity(Unit::of(Dimension::PRESSURE, "bar")),
    "with `free_convection`: absolute pressure of the gas",
)
.or(Unstated::Si(101_325.0))
.reaching(ChangeReach::Load);
const RANGE: ValueForm = ValueForm::List(&ValueForm::Quantity(MILLIMETRES), Some(2));

/// Origin of the coordinates of a part of a face.
pub(in crate::machine) const WITHIN_COORDINATES: Key = COORDINATES;

const WITHIN: KeyTable = KeyTable {
    doc: "a part of the faces: between coordinates, or a disc",
    keys: &[&[
        Key::new("x", RANGE, "between these: `[\"10 mm\", \"30 mm\"]`"),
        Key::new("y", RANGE, "likewise"),
        Key::new("z", RANGE, "likewise"),
        Key::new("centre", TRIPLE, "instead: the centre of a disc").also(&["center"]),
        Key::new("radius", ValueForm::Quantity(MILLIMETRES), "its radius").positive(),
        WITHIN_COORDINATES,
    ]],
    one_of: &[],
};

/// `[boundary.NAME]`
pub(super) const BOUNDARY: KeyTable = KeyTable {
    doc: "what is prescribed on faces",
    keys: &[&[
        Key::new("faces", ValueForm::List(&ValueForm::Name("face"), None), "`[\"bed.-z\"]`").also(&["face", "on"]),
        Key::new("within", ValueForm::Table(&WITHIN), "part of these faces alone; see below"),
        Key::new("node", ValueForm::Name("node"), "instead of `faces`: a lumped node, with `area`"),
        Key::new("area", ValueForm::Quantity(AREA), "of the node").positive(),
        Key::new("temperature", ValueForm::Formula(CELSIUS), "formula; of the surface").reaching(ChangeReach::Load),
        Key::new("film", ValueForm::Formula(FILM), "formula; film coefficient, with `fluid_temperature`")
            .reaching(ChangeReach::Load)
            .also(&["h", "htc", "film_coefficient", "heat_transfer_coefficient", "alpha"]),
        Key::new(
            "fluid_temperature",
            ValueForm::Formula(CELSIUS),
            "formula; of the fluid behind the film; of the gas of free convection `ambient_temperature`",
        )
        .reaching(ChangeReach::Load),
        Key::new("heat_flux", ValueForm::Formula(Unit::of(Dimension::HEAT_FLUX, "W/m2")), "formula; into the machine")
            .reaching(ChangeReach::Load)
            .also(&["flux", "q"]),
        Key::new(
            "free_convection",
            ValueForm::Word(&BodyShape::NAMES),
            "to still gas at `fluid_temperature`: film by the law of a shape, with `length`; see below",
        )
        .reaching(ChangeReach::Load)
        .also(&["natural_convection"]),
        Key::new(
            "length",
            ValueForm::Quantity(MILLIMETRES),
            "with `free_convection`: height of a vertical plate, area over perimeter of a horizontal one, diameter of a cylinder or sphere",
        )
        .positive()
        .reaching(ChangeReach::Load),
        GAS,
        GAS_PRESSURE,
        Key::new("emissivity", ValueForm::Number, "radiation, with `surroundings_temperature`").reaching(ChangeReach::Load).usual(),
        SURROUNDINGS,
    ]],
    one_of: &["temperature", "film", "heat_flux", "free_convection", "emissivity"],
};
