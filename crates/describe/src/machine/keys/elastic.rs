//! Supports of the machine, and sensors of displacement.

use super::{CELSIUS, TRIPLE, flow::COORDINATES};
use crate::schema::{Key, KeyTable, Unit, Unstated, ValueForm};
use coldplate_base::units::{Dimension, ZERO_CELSIUS};

/// Temperature without displacement: 20 degC, the reference temperature of ISO 1.
pub(in crate::machine) const REFERENCE_TEMPERATURE: Key =
    Key::new("reference_temperature", ValueForm::Quantity(CELSIUS), "where nothing is displaced")
        .or(Unstated::Si(20.0 + ZERO_CELSIUS))
        .also(&["stress_free_temperature"]);

/// `[elasticity]`
pub(super) const ELASTICITY: KeyTable =
    KeyTable { doc: "what displacements are counted from", keys: &[&[REFERENCE_TEMPERATURE]], one_of: &[] };

/// `[support.NAME]`
pub(super) const SUPPORT: KeyTable = KeyTable {
    doc: "what holds the machine",
    keys: &[&[
        Key::new("faces", ValueForm::List(&ValueForm::Name("face"), None), "`[\"bed.-z\"]`: these do not move")
            .required()
            .also(&["face", "on"]),
        Key::new("directions", ValueForm::List(&ValueForm::Word(&AXES), None), "along these axes alone: `[\"z\"]` lets them slide")
            .or(Unstated::Follows("all three"))
            .also(&["direction"]),
    ]],
    one_of: &[],
};

/// The axes of the machine.
pub(in crate::machine) const AXES: [&str; 3] = ["x", "y", "z"];
/// Directions along an axis: even entries are positive, odd ones negative.
pub(in crate::machine) const DIRECTIONS: [&str; 6] = ["x", "-x", "y", "-y", "z", "-z"];

/// `[displacement.NAME]`
pub(super) const DISPLACEMENT: KeyTable = KeyTable {
    doc: "a displacement sensor",
    keys: &[&[
        Key::new("point", TRIPLE, "`[x, y, z]`: whose displacement, with `in`").required().also(&["at", "tool"]),
        Key::new("in", ValueForm::Name("part"), "the part it lies in").required(),
        Key::new("relative_to", TRIPLE, "a point that it is counted from, with `relative_in`; else the supports").also(&["table"]),
        Key::new("relative_in", ValueForm::Name("part"), "the part that one lies in"),
        COORDINATES,
        Key::new(
            "direction",
            ValueForm::Either(&[ValueForm::Word(&DIRECTIONS), ValueForm::List(&ValueForm::Number, Some(3))]),
            "what counts as positive: `\"z\"`, `\"-x\"`, or a vector `[1, 0, 1]` of any length",
        )
        .required()
        .also(&["axis"]),
    ]],
    one_of: &[],
};

/// Stiffness of a joint per area.
const BEDDING: Unit = Unit::of(Dimension::BEDDING, "N/m3");

/// Effect of a contact on movements; see [`crate::machine::JointKind`].
pub(in crate::machine) const JOINT: Key = Key::new(
    "joint",
    ValueForm::Word(&["glued", "sliding", "open"]),
    "for displacements: `\"glued\"` moves as one, `\"sliding\"` leaves the faces free along each other, `\"open\"` joins nothing",
)
.or(Unstated::Text("glued"));
/// Stiffness across a joint.
pub(in crate::machine) const NORMAL_STIFFNESS: Key =
    Key::new("normal_stiffness", ValueForm::Quantity(BEDDING), "for displacements: stiffness across the joint per area, `\"1e12 N/m3\"`")
        .positive()
        .or(Unstated::Follows("rigid"));
/// Stiffness along a joint.
pub(in crate::machine) const TANGENTIAL_STIFFNESS: Key =
    Key::new("tangential_stiffness", ValueForm::Quantity(BEDDING), "for displacements: stiffness along the joint per area")
        .positive()
        .or(Unstated::Follows("rigid, and none where sliding"));

/// Keys for the stiffness of contacts.
pub(super) const JOINT_KEYS: &[Key] = &[JOINT, NORMAL_STIFFNESS, TANGENTIAL_STIFFNESS];
