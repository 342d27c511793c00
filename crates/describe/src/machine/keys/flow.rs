//! Coolant channels and the circuits that feed them.

use super::{AREA_RESISTANCE, CELSIUS, CONDUCTIVITY, DENSITY, FILM, METRES, MICROMETRES, MILLIMETRES, SPECIFIC_HEAT, TRIPLE};
use crate::schema::{ChangeReach, Key, KeyTable, Unit, Unstated, ValueForm};
use coldplate_base::condition::{COOLANT_FLOW, COOLANT_TEMPERATURE};
use coldplate_base::units::Dimension;

const VISCOSITY: Unit = Unit::of(Dimension::VISCOSITY, "Pa s");
const DIRECTIONS: ValueForm = ValueForm::Word(&["+x", "-x", "+y", "-y", "+z", "-z"]);

/// The block that holds a serpentine.
pub(in crate::machine) const BLOCK: Key = Key::new("block", ValueForm::Whole(1), "the block it lies in").or(Unstated::Whole(1));
/// Direction of the first pass.
pub(in crate::machine) const ALONG: Key = Key::new("along", DIRECTIONS, "direction of the first pass").required();
/// Direction of the next pass.
pub(in crate::machine) const ACROSS: Key =
    Key::new("across", DIRECTIONS, "the next pass lies a `pitch` further that way and runs back").required();

const SERPENTINE: KeyTable = KeyTable {
    doc: "parallel passes joined at alternating ends, in a box",
    keys: &[&[
        ALONG,
        ACROSS,
        Key::new("passes", ValueForm::Whole(1), "how many").required(),
        Key::new("pitch", ValueForm::Quantity(MILLIMETRES), "distance of neighbouring passes; needed for two or more").positive(),
        Key::new("margin", ValueForm::Quantity(MILLIMETRES), "left free at both ends of the passes").or(Unstated::Follows("half a pitch")),
        Key::new("level", ValueForm::Quantity(MILLIMETRES), "above the low face of the third axis").or(Unstated::Follows("the middle")),
        Key::new("first", ValueForm::Quantity(MILLIMETRES), "distance of the first pass from the side it starts at")
            .or(Unstated::Follows("centred")),
        BLOCK,
    ]],
    one_of: &[],
};

/// Origin of the coordinates.
pub(in crate::machine) const COORDINATES: Key = Key::new(
    "coordinates",
    ValueForm::Word(&["part", "machine"]),
    "coordinates count from the smallest corner of the part's first block (cylinder: centre of its base; sphere: centre); \
     `\"machine\"`: from the origin",
)
.or(Unstated::Text("part"));
/// Thermal condition of the laminar law.
pub(in crate::machine) const WALL: Key =
    Key::new("wall", ValueForm::Word(&["flux", "temperature"]), "thermal condition of the laminar law").or(Unstated::Text("flux"));
/// Factor of the bends.
pub(in crate::machine) const BEND_FACTOR: Key = Key::new(
    "bend_factor",
    ValueForm::Either(&[ValueForm::Number, ValueForm::Word(&["auto"])]),
    "factor on the film; `\"auto\"` finds it for the default condition with the flow shared evenly among branches (1 to 1.4)",
)
.or(Unstated::Si(1.0));
/// Factor on the film.
pub(in crate::machine) const FILM_FACTOR: Key =
    Key::new("film_factor", ValueForm::Number, "factor on the film, given or found: 0.7 is a fouled channel")
        .or(Unstated::Si(1.0))
        .reaching(ChangeReach::Channel);
/// Thermal resistance of scale.
pub(in crate::machine) const FOULING_RESISTANCE: Key = Key::new(
    "fouling_resistance",
    ValueForm::Quantity(AREA_RESISTANCE),
    "of scale on the wall, in series with the film (1/h + R): 1e-4 to 5e-4 m2 K/W after years of hard water",
)
.or(Unstated::Si(0.0))
.reaching(ChangeReach::Channel);
/// Loss coefficients.
pub(in crate::machine) const MINOR_LOSS: Key = Key::new(
    "minor_loss",
    ValueForm::Number,
    "loss coefficients of bends, inlet and outlet, summed: a drilled right angle 1.1 to 1.5, a 180 degree bend 0.4 to 0.6, inlet 0.5, \
     outlet 1",
)
.or(Unstated::Si(0.0))
.reaching(ChangeReach::Channel);
/// Roughness of the wall.
pub(in crate::machine) const ROUGHNESS: Key = Key::new("roughness", ValueForm::Quantity(MICROMETRES), "of the wall").or(Unstated::Si(0.0));

/// `[channel.NAME]`
pub(super) const CHANNEL: KeyTable = KeyTable {
    doc: "a round hole in a part made of blocks, or the bore of one",
    keys: &[&[
        Key::new("in", ValueForm::Name("part"), "the part").required().also(&["part"]),
        Key::new("diameter", ValueForm::Quantity(MILLIMETRES), "hydraulic diameter; not with `bore`").positive().also(&["d"]),
        Key::new("path", ValueForm::List(&TRIPLE, None), "corners `[[x, y, z], ...]` from inlet to outlet, inside the part"),
        COORDINATES,
        Key::new("serpentine", ValueForm::Table(&SERPENTINE), "instead of `path`, in a box; see below"),
        Key::new(
            "bore",
            ValueForm::Word(&["start", "end"]),
            "instead of `path` and `diameter`: the bore of a hollow cylinder, entered at its `\"start\"` or `\"end\"`; its wall is the \
             face `inner`",
        ),
        Key::new("length", ValueForm::Quantity(METRES), "wetted length").positive().or(Unstated::Follows("length of the path")),
        Key::new(
            "film",
            ValueForm::Either(&[ValueForm::Word(&["correlation"]), ValueForm::Formula(FILM)]),
            "found from the flow, given (`\"2251 W/(m2 K)\"`), or a formula of condition and flow, see below",
        )
        .or(Unstated::Text("correlation"))
        .also(&["h", "htc", "film_coefficient"]),
        Key::new(
            "nusselt",
            ValueForm::Formula(Unit::of(Dimension::NUMBER, "1")),
            "instead of `film`: formula of condition and flow for the Nusselt number, `\"0.023 * Re^0.8 * Pr^0.4\"`",
        )
        .also(&["Nu", "nu"]),
        WALL,
        BEND_FACTOR,
        FILM_FACTOR,
        FOULING_RESISTANCE,
        MINOR_LOSS,
        ROUGHNESS,
    ]],
    one_of: &["path", "serpentine", "bore"],
};

const LIQUID: KeyTable = KeyTable {
    doc: "a liquid of constant properties",
    keys: &[&[
        Key::new("density", ValueForm::Quantity(DENSITY), "density").required().positive(),
        Key::new("specific_heat", ValueForm::Quantity(SPECIFIC_HEAT), "specific heat").required().positive(),
        Key::new("viscosity", ValueForm::Quantity(VISCOSITY), "dynamic viscosity").required().positive(),
        Key::new("conductivity", ValueForm::Quantity(CONDUCTIVITY), "conductivity").required().positive(),
    ]],
    one_of: &[],
};

/// Volume flow of a circuit.
pub(in crate::machine) const FLOW: Key =
    Key::new("flow", ValueForm::Formula(Unit::of(Dimension::VOLUME_FLOW, "m3/s")), "formula; volume flow at inlet conditions")
        .or(Unstated::Text(COOLANT_FLOW))
        .reaching(ChangeReach::Load);
/// Temperature of the inflow.
pub(in crate::machine) const INLET_TEMPERATURE: Key =
    Key::new("inlet_temperature", ValueForm::Formula(CELSIUS), "formula; temperature of what flows in")
        .or(Unstated::Text(COOLANT_TEMPERATURE))
        .reaching(ChangeReach::Load)
        .also(&["temperature", "inlet"]);
/// Whether friction heats the liquid.
pub(in crate::machine) const DISSIPATION: Key = Key::new("dissipation", ValueForm::Flag, "viscous heating").or(Unstated::Flag(true));

/// Absolute pressure of a circuit.
pub(in crate::machine) const PRESSURE: Key = Key::new(
    "pressure",
    ValueForm::Quantity(Unit::of(Dimension::PRESSURE, "bar")),
    "absolute, where it is lowest: the temperature at which water boils follows from it; at most 10 bar",
)
.or(Unstated::Si(101_325.0));

const PROPERTY_OF_FLUID: &str = "a constant, or a table against temperature `[[\"20 degC\", \"870 kg/m3\"], ...]`";

/// `[fluid.NAME]`
pub(super) const FLUID: KeyTable = KeyTable {
    doc: "a liquid by its properties against temperature",
    keys: &[&[
        Key::new("density", ValueForm::Either(&[ValueForm::Quantity(DENSITY), ValueForm::Curve(CELSIUS, DENSITY)]), PROPERTY_OF_FLUID)
            .required()
            .also(&["rho"]),
        Key::new(
            "specific_heat",
            ValueForm::Either(&[ValueForm::Quantity(SPECIFIC_HEAT), ValueForm::Curve(CELSIUS, SPECIFIC_HEAT)]),
            "a constant, or a table",
        )
        .required()
        .also(&["cp", "c", "heat_capacity"]),
        Key::new(
            "conductivity",
            ValueForm::Either(&[ValueForm::Quantity(CONDUCTIVITY), ValueForm::Curve(CELSIUS, CONDUCTIVITY)]),
            "a constant, or a table",
        )
        .required()
        .also(&["k", "lambda", "thermal_conductivity"]),
        Key::new(
            "viscosity",
            ValueForm::Either(&[ValueForm::Quantity(VISCOSITY), ValueForm::Curve(CELSIUS, VISCOSITY)]),
            "dynamic; a constant, or a table, whose logarithm runs straight in 1/T between the points",
        )
        .required()
        .also(&["mu", "eta", "dynamic_viscosity"]),
        Key::new("source", ValueForm::Text, "where the numbers come from").reaching(ChangeReach::Report),
    ]],
    one_of: &[],
};

/// `[circuit.NAME]`
pub(super) const CIRCUIT: KeyTable = KeyTable {
    doc: "what flows through the channels",
    keys: &[&[
        Key::new(
            "layout",
            ValueForm::Nested("channel"),
            "the outer list is in series, a list in it in parallel, a list in that in series: `[\"a\", [\"b\", [\"c\", \"d\"]], \"e\"]`",
        )
        .required()
        .also(&["channels", "channel"]),
        FLOW,
        INLET_TEMPERATURE,
        Key::new(
            "from",
            ValueForm::Either(&[ValueForm::Name("circuit"), ValueForm::List(&ValueForm::Name("circuit"), None)]),
            "instead of `inlet_temperature`: the circuits whose outflow, mixed, flows in; `flow` is then a part of it, by default all",
        )
        .also(&["fed_by", "feed"]),
        Key::new(
            "branches",
            ValueForm::Free(&ValueForm::Either(&[
                ValueForm::Formula(Unit::of(Dimension::NUMBER, "1")),
                ValueForm::Formula(Unit::of(Dimension::VOLUME_FLOW, "m3/s")),
            ])),
            "`{ a = 0.3, b = \"2 L/min\" }`: flow of parallel branches, each by one of its channels; the others share the rest",
        )
        .reaching(ChangeReach::Load),
        Key::new(
            "liquid",
            ValueForm::Either(&[ValueForm::Word(&["water", "paper_water"]), ValueForm::Name("fluid"), ValueForm::Table(&LIQUID)]),
            "`\"paper_water\"` (1000 kg/m3, 4200 J/(kg K)), a `[fluid.NAME]`, a mixture such as `\"ethylene glycol 30 %\"`, or \
             `{ density, specific_heat, viscosity, conductivity }`",
        )
        .or(Unstated::Text("water"))
        .also(&["fluid", "coolant"]),
        PRESSURE,
        DISSIPATION,
    ]],
    one_of: &[],
};
