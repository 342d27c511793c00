//! Contacts, and what is prescribed on faces.

use super::{AREA, CELSIUS, CONDUCTANCE, CONDUCTIVITY, FILM, MEGAPASCALS, MICROMETRES, PASCALS};
use crate::describe::schema::{Form, Key, Reach, Table, Unit, Unstated};
use crate::units::Dimension;

/// Energy accommodation coefficient of the gas between rough surfaces.
pub(in crate::describe::machine) const GAS_ACCOMMODATION: Key =
    Key::new("accommodation", Form::Number, "energy accommodation coefficient").or(Unstated::Si(0.9)).reaching(Reach::Contact);
/// Conductivity of the gas between rough surfaces.
pub(in crate::describe::machine) const GAS_CONDUCTIVITY: Key = Key::new("conductivity", Form::Quantity(CONDUCTIVITY), "of the gas in bulk")
    .positive()
    .or(Unstated::Si(0.026))
    .reaching(Reach::Contact);

const GAS: Table = Table {
    doc: "gas between rough surfaces",
    keys: &[&[
        Key::new("pressure", Form::Quantity(PASCALS), "of the gas").required().positive().reaching(Reach::Contact),
        GAS_CONDUCTIVITY,
        Key::new("gap", Form::Quantity(MICROMETRES), "mean distance between the surfaces")
            .positive()
            .or(Unstated::Follows("from the law"))
            .reaching(Reach::Contact),
        GAS_ACCOMMODATION,
        Key::new("rarefaction", Form::Quantity(MICROMETRES), "rarefaction length at 1 atm")
            .positive()
            .or(Unstated::Follows("from the accommodation, for air"))
            .reaching(Reach::Contact),
    ]],
    one_of: &[],
};

const ROUGH: Table = Table {
    doc: "two rough, flat surfaces pressed together",
    keys: &[&[
        Key::new("roughness", Form::Quantity(MICROMETRES), "combined roughness (s1² + s2²)^(1/2)")
            .required()
            .positive()
            .reaching(Reach::Contact),
        Key::new("slope", Form::Number, "combined mean absolute asperity slope").required().positive().reaching(Reach::Contact),
        Key::new("pressure", Form::Quantity(MEGAPASCALS), "contact pressure").required().positive().reaching(Reach::Contact).usual(),
        Key::new("hardness", Form::Quantity(MEGAPASCALS), "microhardness of the softer side").positive().reaching(Reach::Contact),
        Key::new("modulus", Form::Quantity(MEGAPASCALS), "or, for elastic contact, the effective modulus")
            .positive()
            .reaching(Reach::Contact),
        Key::new("emissivity", Form::List(&Form::Number, Some(2)), "of the two, for radiation across the gap").reaching(Reach::Contact),
        Key::new("gas", Form::Table(&GAS), "gas in the gap").or(Unstated::Follows("vacuum")).reaching(Reach::Contact),
    ]],
    one_of: &["hardness", "modulus"],
};

/// The keys that each say how heat crosses a contact.
pub(in crate::describe::machine) const LAW_NAMES: &[&str] =
    &["conductance", "total_conductance", "temperature_table", "pressure_table", "rough", "bonded", "insulated"];

/// The keys of all laws.
const LAWS: &[Key] = &[
    Key::new("conductance", Form::Quantity(FILM), "per area").positive().reaching(Reach::Contact).usual().also(&[
        "h",
        "hc",
        "tcc",
        "contact_conductance",
        "resistance",
    ]),
    Key::new("total_conductance", Form::Quantity(CONDUCTANCE), "spread over the true area").positive().reaching(Reach::Contact).usual(),
    Key::new(
        "temperature_table",
        Form::Either(&[Form::Quantity(FILM), Form::Curve(CELSIUS, FILM)]),
        "`[[\"20 degC\", \"300 W/(m2 K)\"], ...]` against the mean temperature of the interface",
    )
    .reaching(Reach::Contact)
    .usual(),
    Key::new(
        "pressure_table",
        Form::Curve(MEGAPASCALS, FILM),
        "with `pressure`: `[[\"0.1 MPa\", \"300 W/(m2 K)\"], ...]`, at that contact pressure, which must lie in the table",
    )
    .reaching(Reach::Contact)
    .usual(),
    Key::new("pressure", Form::Quantity(MEGAPASCALS), "contact pressure, with `pressure_table`")
        .positive()
        .reaching(Reach::Contact)
        .usual(),
    Key::new(
        "rough",
        Form::Table(&ROUGH),
        "Cooper, Mikic and Yovanovich: `{ roughness, slope, hardness, pressure }`; `modulus` instead of `hardness` for elastic contact \
         (Mikic)",
    )
    .reaching(Reach::Contact),
    Key::new("bonded", Form::True, "no resistance").reaching(Reach::Contact),
    Key::new("insulated", Form::True, "no heat").reaching(Reach::Contact),
];

/// `[contact.NAME]`
pub(super) const CONTACT: Table = Table {
    doc: "what joins two places",
    keys: &[
        &[Key::new(
            "between",
            Form::List(&Form::Name("part, face or node"), Some(2)),
            "two parts, faces or nodes: `[\"motor.-z\", \"plate.+z\"]`",
        )
        .required()],
        LAWS,
        &[Key::new(
            "area",
            Form::Quantity(AREA),
            "needed for a conductance to a lumped node; between parts it replaces the true touching area in total",
        )
        .positive()
        .or(Unstated::Follows("the touching area"))],
    ],
    one_of: LAW_NAMES,
};

const DEFAULT_LAW: Table = Table { doc: "a law for every touching pair", keys: &[LAWS], one_of: LAW_NAMES };

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
pub(in crate::describe::machine) const SURROUNDINGS: Key =
    Key::new("surroundings_temperature", Form::Formula(CELSIUS), "with `emissivity`: formula; what the faces radiate to")
        .or(Unstated::Text("ambient_temperature"))
        .reaching(Reach::Load);

/// `[boundary.NAME]`
pub(super) const BOUNDARY: Table = Table {
    doc: "what is prescribed on faces",
    keys: &[&[
        Key::new("faces", Form::List(&Form::Name("face"), None), "`[\"bed.-z\"]`").required().also(&["face", "on"]),
        Key::new("temperature", Form::Formula(CELSIUS), "formula; of the surface").reaching(Reach::Load),
        Key::new("film", Form::Formula(FILM), "formula; film coefficient, with `fluid_temperature`").reaching(Reach::Load).also(&[
            "h",
            "htc",
            "film_coefficient",
            "heat_transfer_coefficient",
            "alpha",
        ]),
        Key::new("fluid_temperature", Form::Formula(CELSIUS), "formula; of the fluid behind the film").reaching(Reach::Load),
        Key::new("heat_flux", Form::Formula(Unit::of(Dimension::HEAT_FLUX, "W/m2")), "formula; into the machine")
            .reaching(Reach::Load)
            .also(&["flux", "q"]),
        Key::new("emissivity", Form::Number, "radiation, with `surroundings_temperature`").reaching(Reach::Load).usual(),
        SURROUNDINGS,
    ]],
    one_of: &["temperature", "film", "heat_flux", "emissivity"],
};
