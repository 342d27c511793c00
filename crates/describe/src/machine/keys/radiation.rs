//! The chamber, radiation to the chamber, and enclosures of surfaces.

use super::{AREA, CELSIUS, METRES, PASCALS};
use crate::schema::{Form, Key, Reach, Table, Unstated};

/// Temperature of the chamber wall.
pub(in crate::machine) const TEMPERATURE: Key = Key::new("temperature", Form::Formula(CELSIUS), "formula; temperature of the wall")
    .or(Unstated::Text("ambient_temperature"))
    .reaching(Reach::Load);
/// Pressure of the residual gas.
pub(in crate::machine) const PRESSURE: Key =
    Key::new("pressure", Form::Quantity(PASCALS), "of the residual gas").or(Unstated::Si(0.0)).reaching(Reach::LoadUnlessZero);
/// Energy accommodation coefficient of the residual gas.
pub(in crate::machine) const ACCOMMODATION: Key =
    Key::new("accommodation", Form::Number, "energy accommodation coefficient of the residual gas")
        .or(Unstated::Si(0.9))
        .reaching(Reach::Load);
/// Distance from the machine to the chamber wall.
pub(in crate::machine) const GAP: Key =
    Key::new("gap", Form::Quantity(METRES), "distance from machine to wall").positive().or(Unstated::Si(0.5)).reaching(Reach::Load);

/// `[chamber]`
pub(super) const CHAMBER: Table = Table {
    doc: "the vacuum chamber around the machine",
    keys: &[&[
        TEMPERATURE,
        Key::new("wall_emissivity", Form::Number, "with `wall_area`; without them the emissivity of a part is its effective emissivity"),
        Key::new("wall_area", Form::Quantity(AREA), "with `wall_emissivity`").positive(),
        PRESSURE,
        ACCOMMODATION,
        GAP,
    ]],
    one_of: &[],
};

/// The two ways to state an emissivity.
pub(super) const EMISSIVITIES: &[Key] = &[
    Key::new("emissivity", Form::Number, "of the surface; made effective by the enclosure formula if the chamber gives its wall")
        .usual()
        .also(&["eps", "epsilon"]),
    Key::new("effective_emissivity", Form::Number, "used as it stands; one of the two").usual().also(&["eps_eff"]),
];

/// `[surfaces]`
pub(super) const SURFACES: Table = Table {
    doc: "radiation of all parts without a surface of their own; without it they do not radiate",
    keys: &[EMISSIVITIES, &[Key::new("group", Form::Named(&SURFACE_GROUP), "parts that radiate alike, by one number")]],
    one_of: &[],
};

/// `[surfaces.group.NAME]`
const SURFACE_GROUP: Table = Table {
    doc: "radiation of some parts without a surface of their own, by one number",
    keys: &[EMISSIVITIES, &[Key::new("parts", Form::List(&Form::Name("part"), None), "the parts: `[\"motor\", \"gear\"]`").required()]],
    one_of: &["emissivity", "effective_emissivity"],
};

/// `[part.NAME.surface]`
pub(super) const SURFACE: Table = Table {
    doc: "radiation of a part to the chamber",
    keys: &[
        EMISSIVITIES,
        &[
            Key::new("area", Form::Quantity(AREA), "total radiating area")
                .positive()
                .or(Unstated::Follows("the exposed area of the faces")),
            Key::new("excluded", Form::List(&Form::Name("face"), None), "faces that do not see the chamber: `[\"-z\", \"[2].+x\"]`"),
        ],
    ],
    one_of: &[],
};

/// `[radiation_link.NAME]`
pub(super) const LINK: Table = Table {
    doc: "radiation between two surfaces that face each other",
    keys: &[&[
        Key::new("between", Form::List(&Form::Name("part, face or node"), Some(2)), "the two places").required(),
        Key::new("view_factor", Form::Number, "from the first to the second, above 0, at most 1").required().also(&["view", "f12"]),
        Key::new("emissivity", Form::List(&Form::Number, Some(2)), "`[e1, e2]`").required().usual().also(&["emissivities"]),
        Key::new("area", Form::Quantity(AREA), "of the first; needed for a node").positive().or(Unstated::Follows("its exposed area")),
    ]],
    one_of: &[],
};

const ENCLOSURE_SURFACE: Table = Table {
    doc: "a surface of an enclosure",
    keys: &[&[
        Key::new("face", Form::Name("face"), "a face"),
        Key::new("part", Form::Name("part"), "all open faces of a part"),
        Key::new("node", Form::Name("node"), "a lumped node, with `area`"),
        Key::new("chamber", Form::True, "the chamber's wall, last in the list"),
        Key::new("emissivity", Form::Number, "of the surface").or(Unstated::Follows("of the wall, that of `[chamber]`")).usual(),
        Key::new("area", Form::Quantity(AREA), "of a node or of the wall")
            .positive()
            .or(Unstated::Follows("of the wall, that of `[chamber]`")),
        Key::new(
            "patches",
            Form::List(&Form::Whole(1), Some(2)),
            "pieces along the two axes of each face, each with a radiosity of its own; at most 32",
        )
        .or(Unstated::Follows("`[1, 1]`")),
    ]],
    one_of: &["face", "part", "node", "chamber"],
};

/// Rays from each patch.
pub(in crate::machine) const RAYS: Key = Key::new("rays", Form::Whole(16), "from each patch; 16 to 1e8").or(Unstated::Whole(100_000));
/// Largest error of a table of view factors.
pub(in crate::machine) const TOLERANCE: Key =
    Key::new("tolerance", Form::Number, "how far a table may miss reciprocity and the sum of a row").or(Unstated::Si(1e-3));
/// Whether view factors computed by rays are kept.
pub(in crate::machine) const CACHE: Key =
    Key::new("cache", Form::Flag, "keep what rays found beside the machine file").or(Unstated::Flag(true)).reaching(Reach::Report);

/// `[enclosure.NAME]`
pub(super) const ENCLOSURE: Table = Table {
    doc: "grey surfaces that all see each other",
    keys: &[&[
        Key::new(
            "surfaces",
            Form::Tables(&ENCLOSURE_SURFACE),
            "list of `{ face = \"plate.+z\", emissivity = 0.3 }`; of blocks, not of a `mesh`",
        )
        .required(),
        Key::new(
            "view_factors",
            Form::Either(&[
                Form::Word(&["computed", "rays"]),
                Form::List(&Form::List(&Form::Either(&[Form::Number, Form::Word(&["?"])]), None), None),
            ]),
            "`\"computed\"` (closed forms, else rays), `\"rays\"`, or a table `[[0, 0.2, \"?\"], ...]`; `\"?\"` follows from the others",
        )
        .required(),
        Key::new("closed", Form::Flag, "nothing leaves between the surfaces; else the rest of each view is the chamber")
            .or(Unstated::Follows("false; true with `chamber`")),
        RAYS,
        TOLERANCE,
        CACHE,
    ]],
    one_of: &[],
};
