//! The chamber, radiation to the chamber, and enclosures of surfaces.

use super::{AREA, CELSIUS, METRES, PASCALS};
use crate::schema::{ChangeReach, Key, KeyTable, Unstated, ValueForm};
use coldplate_base::condition::AMBIENT_TEMPERATURE;

/// Temperature of the chamber wall.
pub(in crate::machine) const TEMPERATURE: Key = Key::new("temperature", ValueForm::Formula(CELSIUS), "formula; temperature of the wall")
    .or(Unstated::Text(AMBIENT_TEMPERATURE))
    .reaching(ChangeReach::Load);
/// Pressure of the residual gas.
pub(in crate::machine) const PRESSURE: Key =
    Key::new("pressure", ValueForm::Quantity(PASCALS), "of the residual gas").or(Unstated::Si(0.0)).reaching(ChangeReach::LoadUnlessZero);
/// Energy accommodation coefficient of the residual gas.
pub(in crate::machine) const ACCOMMODATION: Key =
    Key::new("accommodation", ValueForm::Number, "energy accommodation coefficient of the residual gas")
        .or(Unstated::Si(0.9))
        .reaching(ChangeReach::Load);
/// Distance from the machine to the chamber wall.
pub(in crate::machine) const GAP: Key = Key::new("gap", ValueForm::Quantity(METRES), "distance from machine to wall")
    .positive()
    .or(Unstated::Si(0.5))
    .reaching(ChangeReach::Load);

/// `[chamber]`
pub(super) const CHAMBER: KeyTable = KeyTable {
    doc: "the vacuum chamber around the machine",
    keys: &[&[
        TEMPERATURE,
        Key::new(
            "wall_emissivity",
            ValueForm::Number,
            "with `wall_area`; without them the emissivity of a part is its effective emissivity",
        ),
        Key::new("wall_area", ValueForm::Quantity(AREA), "with `wall_emissivity`").positive(),
        PRESSURE,
        ACCOMMODATION,
        GAP,
    ]],
    one_of: &[],
};

/// The two ways to state an emissivity.
pub(super) const EMISSIVITIES: &[Key] = &[
    Key::new("emissivity", ValueForm::Number, "of the surface; made effective by the enclosure formula if the chamber gives its wall")
        .usual()
        .also(&["eps", "epsilon"]),
    Key::new("effective_emissivity", ValueForm::Number, "used as it stands; one of the two").usual().also(&["eps_eff"]),
];

/// `[surfaces]`
pub(super) const SURFACES: KeyTable = KeyTable {
    doc: "radiation of all parts without a surface of their own; without it they do not radiate",
    keys: &[EMISSIVITIES, &[Key::new("group", ValueForm::Named(&SURFACE_GROUP), "parts that radiate alike, by one number")]],
    one_of: &[],
};

/// `[surfaces.group.NAME]`
const SURFACE_GROUP: KeyTable = KeyTable {
    doc: "radiation of some parts without a surface of their own, by one number",
    keys: &[
        EMISSIVITIES,
        &[Key::new("parts", ValueForm::List(&ValueForm::Name("part"), None), "the parts: `[\"motor\", \"gear\"]`").required()],
    ],
    one_of: &["emissivity", "effective_emissivity"],
};

/// `[part.NAME.surface]`
pub(super) const SURFACE: KeyTable = KeyTable {
    doc: "radiation of a part to the chamber",
    keys: &[
        EMISSIVITIES,
        &[
            Key::new("area", ValueForm::Quantity(AREA), "total radiating area")
                .positive()
                .or(Unstated::Follows("the exposed area of the faces")),
            Key::new(
                "excluded",
                ValueForm::List(&ValueForm::Name("face"), None),
                "faces that do not see the chamber: `[\"-z\", \"[2].+x\"]`",
            ),
        ],
    ],
    one_of: &[],
};

/// `[radiation_link.NAME]`
pub(super) const LINK: KeyTable = KeyTable {
    doc: "radiation between two surfaces that face each other",
    keys: &[&[
        Key::new("between", ValueForm::List(&ValueForm::Name("part, face or node"), Some(2)), "the two places").required(),
        Key::new("view_factor", ValueForm::Number, "from the first to the second, above 0, at most 1").required().also(&["view", "f12"]),
        Key::new("emissivity", ValueForm::List(&ValueForm::Number, Some(2)), "`[e1, e2]`").required().usual().also(&["emissivities"]),
        Key::new("area", ValueForm::Quantity(AREA), "of the first; needed for a node").positive().or(Unstated::Follows("its exposed area")),
    ]],
    one_of: &[],
};

const ENCLOSURE_SURFACE: KeyTable = KeyTable {
    doc: "a surface of an enclosure",
    keys: &[&[
        Key::new("face", ValueForm::Name("face"), "a face"),
        Key::new("part", ValueForm::Name("part"), "all open faces of a part"),
        Key::new("node", ValueForm::Name("node"), "a lumped node, with `area`"),
        Key::new("chamber", ValueForm::True, "the chamber's wall, last in the list"),
        Key::new("emissivity", ValueForm::Number, "of the surface").or(Unstated::Follows("of the wall, that of `[chamber]`")).usual(),
        Key::new("area", ValueForm::Quantity(AREA), "of a node or of the wall")
            .positive()
            .or(Unstated::Follows("of the wall, that of `[chamber]`")),
        Key::new(
            "patches",
            ValueForm::List(&ValueForm::Whole(1), Some(2)),
            "pieces along the two axes of each face, each with a radiosity of its own; at most 32",
        )
        .or(Unstated::Follows("`[1, 1]`")),
    ]],
    one_of: &["face", "part", "node", "chamber"],
};

/// Rays from each patch.
pub(in crate::machine) const RAYS: Key = Key::new("rays", ValueForm::Whole(16), "from each patch; 16 to 1e8").or(Unstated::Whole(100_000));
/// Largest error of a table of view factors.
pub(in crate::machine) const TOLERANCE: Key =
    Key::new("tolerance", ValueForm::Number, "how far a table may miss reciprocity and the sum of a row").or(Unstated::Si(1e-3));
/// Whether view factors computed by rays are kept.
pub(in crate::machine) const CACHE: Key = Key::new("cache", ValueForm::Flag, "keep what rays found beside the machine file")
    .or(Unstated::Flag(true))
    .reaching(ChangeReach::Report);

/// `[enclosure.NAME]`
pub(super) const ENCLOSURE: KeyTable = KeyTable {
    doc: "grey surfaces that all see each other",
    keys: &[&[
        Key::new(
            "surfaces",
            ValueForm::Tables(&ENCLOSURE_SURFACE),
            "list of `{ face = \"plate.+z\", emissivity = 0.3 }`; of blocks, not of a `mesh`",
        )
        .required(),
        Key::new(
            "view_factors",
            ValueForm::Either(&[
                ValueForm::Word(&["computed", "rays"]),
                ValueForm::List(&ValueForm::List(&ValueForm::Either(&[ValueForm::Number, ValueForm::Word(&["?"])]), None), None),
            ]),
            "`\"computed\"` (closed forms, else rays), `\"rays\"`, or a table `[[0, 0.2, \"?\"], ...]`; `\"?\"` follows from the others",
        )
        .required(),
        Key::new("closed", ValueForm::Flag, "nothing leaves between the surfaces; else the rest of each view is the chamber")
            .or(Unstated::Follows("false; true with `chamber`")),
        RAYS,
        TOLERANCE,
        CACHE,
    ]],
    one_of: &[],
};
