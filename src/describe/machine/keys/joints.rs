//! Contacts, and what is prescribed on faces.

use super::super::contact_law;
use super::{AREA, CELSIUS, FILM};
use crate::describe::schema::{Form, Key, Reach, Table, Unit, Unstated};
use crate::units::Dimension;

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

/// The places, the keys of every law, and the area.
const CONTACT_KEYS: [&[Key]; contact_law::COUNT + 2] = {
    let mut all = [PLACES; contact_law::COUNT + 2];
    let mut law = 0;
    while law < contact_law::COUNT {
        all[law + 1] = contact_law::KEYS[law];
        law += 1;
    }
    all[contact_law::COUNT + 1] = CONTACT_AREA;
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
