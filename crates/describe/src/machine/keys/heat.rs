//! Variables, drives and heat sources.

use super::super::source_law;
use super::MILLIMETRES;
use crate::schema::{ChangeReach, Key, KeyTable, Unit, Unstated, ValueForm};
use coldplate_base::condition::MOTOR_SPEED;
use coldplate_base::units::Dimension;
use coldplate_physics::drive::Parameters;

const VARIABLE_TABLE: KeyTable = KeyTable {
    doc: "a variable of the condition",
    keys: &[&[
        Key::new("default", ValueForm::AnyQuantity, "used when a caller gives no value; without it the value must be given"),
        Key::new("range", ValueForm::List(&ValueForm::AnyQuantity, Some(2)), "`[low, high]`, the range that makes sense"),
        Key::new(
            "unit",
            ValueForm::Text,
            "the unit it is shown in; required for variables of one's own. `degC` makes an absolute temperature, `K` a difference, \
             `\"1\"` a pure number",
        ),
    ]],
    one_of: &[],
};

/// An entry of `[variables]`.
pub(super) const VARIABLE: ValueForm = ValueForm::Either(&[ValueForm::AnyQuantity, ValueForm::Table(&VARIABLE_TABLE)]);

const PAPER: Parameters = Parameters::PAPER;
const KILOGRAMS: ValueForm = ValueForm::Quantity(Unit::of(Dimension::MASS, "kg"));
const INERTIA: ValueForm = ValueForm::Quantity(Unit::of(Dimension::INERTIA, "kg m2"));
const NEWTONS: ValueForm = ValueForm::Quantity(Unit::of(Dimension::FORCE, "N"));
const RPM: Unit = Unit::of(Dimension::ANGULAR_SPEED, "rpm");

const fn parameter(name: &'static str, form: ValueForm, default: f64, doc: &'static str) -> Key {
    Key::new(name, form, doc).or(Unstated::Si(default)).reaching(ChangeReach::Load)
}

/// Motor speed of a drive.
pub(in crate::machine) const SPEED: Key = Key::new("speed", ValueForm::Formula(RPM), "formula; of the motor. `\"0 rpm\"` stands still")
    .or(Unstated::Text(MOTOR_SPEED))
    .reaching(ChangeReach::Load);
/// Speed the acceleration torque is evaluated at.
pub(in crate::machine) const REFERENCE_SPEED: Key = Key::new(
    "reference_speed",
    ValueForm::Either(&[ValueForm::Quantity(RPM), ValueForm::Word(&["actual"])]),
    "speed of the acceleration torque; `\"actual\"` follows equation 4 as printed",
)
.reaching(ChangeReach::Load);
const REFERENCE_SPEED_OF_PAPER: Key = match PAPER.reference_speed {
    Some(speed) => REFERENCE_SPEED.or(Unstated::Si(speed)),
    None => REFERENCE_SPEED.or(Unstated::Text("actual")),
};
/// Torque of the motor.
pub(in crate::machine) const STARTING_TORQUE: Key =
    Key::new("starting_torque", ValueForm::Quantity(Unit::of(Dimension::TORQUE, "N m")), "of the motor")
        .or(Unstated::Follows("from equations 1 to 4"))
        .reaching(ChangeReach::Load);

/// The numbers of a drive, in the order of [`fields`].
pub(in crate::machine) const PARAMETERS: &[Key] = &[
    parameter("reducer_inertia", INERTIA, PAPER.reducer_inertia, "of the reducer at the motor shaft"),
    parameter("screw_mass", KILOGRAMS, PAPER.screw_mass, "of the screw"),
    parameter("screw_diameter", ValueForm::Quantity(MILLIMETRES), PAPER.screw_diameter, "of the screw"),
    parameter("coupling_mass", KILOGRAMS, PAPER.coupling_mass, "of the coupling"),
    parameter("coupling_diameter", ValueForm::Quantity(MILLIMETRES), PAPER.coupling_diameter, "of the coupling"),
    parameter("moving_mass", KILOGRAMS, PAPER.moving_mass, "moved along the guides"),
    parameter("rotary_inertia", INERTIA, PAPER.rotary_inertia, "turned directly by the reducer's output"),
    parameter("lead", ValueForm::Quantity(MILLIMETRES), PAPER.lead, "of the screw; 0 is a rotary axis"),
    parameter("ratio", ValueForm::Number, PAPER.ratio, "reduction ratio"),
    parameter(
        "acceleration_time",
        ValueForm::Quantity(Unit::of(Dimension::TIME, "s")),
        PAPER.acceleration_time,
        "until the motor has its speed",
    ),
    parameter("preload", NEWTONS, PAPER.preload, "of the screw nut"),
    parameter("screw_efficiency", ValueForm::Number, PAPER.screw_efficiency, "of the screw without preload"),
    parameter("reducer_efficiency", ValueForm::Number, PAPER.reducer_efficiency, "of the reducer"),
    parameter("motor_efficiency", ValueForm::Number, PAPER.motor_efficiency, "of the motor"),
    parameter("guide_friction", ValueForm::Number, PAPER.guide_friction, "friction coefficient of the guides"),
    parameter("bearing_friction", ValueForm::Number, PAPER.bearing_friction, "friction coefficient of the bearings"),
    parameter("bearing_load", NEWTONS, PAPER.bearing_load, "on the bearings"),
    parameter("bearing_diameter", ValueForm::Quantity(MILLIMETRES), PAPER.bearing_diameter, "inner diameter of the bearings"),
    parameter("rail_heat_share", ValueForm::Number, PAPER.rail_heat_share, "share of the guides' friction work that heats the guides"),
];

/// The numbers of [`PARAMETERS`] in their order.
pub(in crate::machine) fn fields(p: &mut Parameters) -> [&mut f64; 19] {
    [
        &mut p.reducer_inertia,
        &mut p.screw_mass,
        &mut p.screw_diameter,
        &mut p.coupling_mass,
        &mut p.coupling_diameter,
        &mut p.moving_mass,
        &mut p.rotary_inertia,
        &mut p.lead,
        &mut p.ratio,
        &mut p.acceleration_time,
        &mut p.preload,
        &mut p.screw_efficiency,
        &mut p.reducer_efficiency,
        &mut p.motor_efficiency,
        &mut p.guide_friction,
        &mut p.bearing_friction,
        &mut p.bearing_load,
        &mut p.bearing_diameter,
        &mut p.rail_heat_share,
    ]
}

/// `[drive.NAME]`
pub(super) const DRIVE: KeyTable =
    KeyTable { doc: "heat of a feed drive", keys: &[&[SPEED], PARAMETERS, &[REFERENCE_SPEED_OF_PAPER, STARTING_TORQUE]], one_of: &[] };

/// Keys common to all sources.
const PLACES_AND_POWER: &[Key] = &[
    Key::new(
        "in",
        ValueForm::Either(&[ValueForm::Name("part, face or node"), ValueForm::List(&ValueForm::Name("part, face or node"), None)]),
        "parts, blocks, faces, nodes: `\"motor\"`, `\"motor[2]\"` or `[\"seat\", \"motor.+z\", \"coil\"]`",
    )
    .required()
    .also(&["part", "on", "at", "where"]),
    Key::new("power", ValueForm::Formula(Unit::of(Dimension::POWER, "W")), "formula; the total, shared by volume or area")
        .reaching(ChangeReach::Load)
        .usual()
        .also(&["heat", "q", "watts"]),
    Key::new("power_density", ValueForm::Formula(Unit::of(Dimension::POWER_DENSITY, "W/m3")), "instead: formula; per volume")
        .reaching(ChangeReach::Load)
        .usual()
        .also(&["density", "volumetric_power", "heat_generation"]),
    Key::new("controller", ValueForm::Name("controller"), "the power is the full one, of which this controller gives a share"),
    Key::new(
        "distribution",
        ValueForm::Text,
        "shares of the power that vary in space: a formula of `x_mm`, `y_mm`, `z_mm`, coordinates of the part, such as `\"exp(-x_mm / 10)\"`",
    ),
];

/// The keys common to all sources, and the keys of every law.
const SOURCE_KEYS: [&[Key]; source_law::COUNT + 1] = {
    let mut all = [PLACES_AND_POWER; source_law::COUNT + 1];
    let mut law = 0;
    while law < source_law::COUNT {
        all[law + 1] = source_law::KEYS[law];
        law += 1;
    }
    all
};

/// `[source.NAME]`
pub(super) const SOURCE: KeyTable = KeyTable { doc: "a heat source", keys: &SOURCE_KEYS, one_of: &["power", "power_density"] };
