//! Parts, their blocks and materials, and lumped nodes.

use super::{AREA, CELSIUS, CONDUCTIVITY, DENSITY, METRES, MILLIMETRES, PROPERTY_OF_CONDUCTION, SPECIFIC_HEAT, TRIPLE, radiation};
use crate::schema::{ChangeReach, Key, KeyTable, Unit, Unstated, ValueForm};
use coldplate_base::units::Dimension;

/// Thermal expansion.
pub(in crate::machine) const EXPANSION: Key = Key::new(
    "expansion",
    ValueForm::Quantity(Unit::of(Dimension::PER_KELVIN, "1/K")),
    "for displacements: coefficient of linear thermal expansion, `\"11.5e-6 1/K\"`",
)
.also(&["thermal_expansion", "cte", "alpha"]);
/// Stiffness.
pub(in crate::machine) const YOUNGS_MODULUS: Key =
    Key::new("youngs_modulus", ValueForm::Quantity(Unit::of(Dimension::PRESSURE, "GPa")), "for displacements: `\"210 GPa\"`")
        .positive()
        .also(&["elastic_modulus", "young", "stiffness"]);
/// Lateral contraction.
pub(in crate::machine) const POISSON_RATIO: Key =
    Key::new("poisson_ratio", ValueForm::Number, "for displacements: from 0 to below 0.5").also(&["poisson", "nu"]);

/// `[material.NAME]`
pub(super) const MATERIAL: KeyTable = KeyTable {
    doc: "a material",
    keys: &[&[
        Key::new(
            "conductivity",
            ValueForm::Either(&[
                ValueForm::Quantity(CONDUCTIVITY),
                ValueForm::Curve(CELSIUS, CONDUCTIVITY),
                ValueForm::List(&PROPERTY_OF_CONDUCTION, Some(3)),
            ]),
            "`\"16.3 W/(m K)\"`; a table against temperature `[[\"20 degC\", \"15 W/(m K)\"], ...]`; or three of either, along x, \
             y, z (cylinders: r, theta, z)",
        )
        .also(&["k", "lambda", "thermal_conductivity"]),
        Key::new("density", ValueForm::Quantity(DENSITY), "at room temperature").positive().also(&["rho"]),
        Key::new(
            "specific_heat",
            ValueForm::Either(&[ValueForm::Quantity(SPECIFIC_HEAT), ValueForm::Curve(CELSIUS, SPECIFIC_HEAT)]),
            "a constant, or a table against temperature",
        )
        .also(&["cp", "c", "heat_capacity"]),
        EXPANSION,
        YOUNGS_MODULUS,
        POISSON_RATIO,
        Key::new("source", ValueForm::Text, "where the numbers come from").reaching(ChangeReach::Report),
        Key::new("base", ValueForm::Name("material"), "takes what is not given from a library material, or from one defined above"),
    ]],
    one_of: &[],
};

pub(in crate::machine) const AXIS: Key =
    Key::new("axis", ValueForm::Word(&["x", "y", "z"]), "its axis").or(Unstated::Text("z")).reaching(ChangeReach::Mesh);
pub(in crate::machine) const INNER: Key = Key::new("inner", ValueForm::Quantity(MILLIMETRES), "inner radius; 0 is solid")
    .or(Unstated::Si(0.0))
    .reaching(ChangeReach::Mesh)
    .also(&["inner_radius"]);

/// Radii of cylinders and spheres.
const RADII: &[Key] = &[
    Key::new("outer", ValueForm::Quantity(MILLIMETRES), "outer radius").reaching(ChangeReach::Mesh).also(&["radius", "outer_radius", "r"]),
    Key::new("outer_diameter", ValueForm::Quantity(MILLIMETRES), "or the outer diameter").reaching(ChangeReach::Mesh).also(&["diameter"]),
    INNER,
    Key::new("inner_diameter", ValueForm::Quantity(MILLIMETRES), "or the inner diameter").reaching(ChangeReach::Mesh),
];

const CYLINDER: KeyTable = KeyTable {
    doc: "a cylinder",
    keys: &[
        &[AXIS],
        RADII,
        &[
            Key::new("length", ValueForm::Quantity(METRES), "along the axis").required().reaching(ChangeReach::Mesh).also(&["height"]),
            Key::new(
                "turn",
                ValueForm::List(&ValueForm::Quantity(Unit::of(Dimension::ANGLE, "deg")), Some(2)),
                "first and last angle of a part-turn",
            )
            .or(Unstated::Follows("the full turn"))
            .reaching(ChangeReach::Mesh),
        ],
    ],
    one_of: &["outer", "outer_diameter"],
};

const SPHERE: KeyTable = KeyTable { doc: "a ball or a shell", keys: &[RADII], one_of: &["outer", "outer_diameter"] };

/// Shapes of a block.
const SHAPES: &[Key] = &[
    Key::new("box", TRIPLE, "`[size x, size y, size z]`").reaching(ChangeReach::Mesh).also(&["size", "cuboid", "block"]),
    Key::new(
        "cylinder",
        ValueForm::Table(&CYLINDER),
        "`{ axis = \"z\", outer = \"50 mm\", inner = \"20 mm\", length = \"0.2 m\", turn = [\"0 deg\", \"90 deg\"] }`",
    )
    .reaching(ChangeReach::Mesh),
    Key::new(
        "sphere",
        ValueForm::Table(&SPHERE),
        "`{ outer = \"50 mm\", inner = \"20 mm\" }`, a ball or a shell; its temperature depends on the radius alone",
    )
    .reaching(ChangeReach::Mesh),
    Key::new(
        "cells",
        ValueForm::List(&ValueForm::Whole(0), Some(3)),
        "with one shape: `[4, 0, 2]`, fixed cells along the axes, 0 lets the mesh choose; of a sphere, along the radius: `[20, 0, 0]`",
    )
    .reaching(ChangeReach::Mesh),
    Key::new(
        "at",
        TRIPLE,
        "where: smallest corner of a box, centre of the base of a cylinder, centre of a sphere; of a part with blocks, the point \
         their own `at` count from; of a mesh its origin",
    )
    .or(Unstated::Follows("the origin"))
    .reaching(ChangeReach::Mesh)
    .also(&["position", "origin"]),
];

const BLOCK: KeyTable = KeyTable { doc: "a block of a part", keys: &[SHAPES], one_of: &["box", "cylinder", "sphere"] };

pub(in crate::machine) const ALIGN: Key =
    Key::new("align", ValueForm::Word(&["centre", "corner"]), "with `on`: middle on middle, or `\"corner\"` (smallest corners together)")
        .or(Unstated::Text("centre"))
        .reaching(ChangeReach::Mesh);
pub(in crate::machine) const GAP: Key = Key::new("gap", ValueForm::Quantity(MILLIMETRES), "with `on`: a distance to the face")
    .or(Unstated::Si(0.0))
    .reaching(ChangeReach::Mesh);
pub(in crate::machine) const ELEMENT_SCALE: Key = Key::new("element_scale", ValueForm::Number, "cells smaller by this factor")
    .positive()
    .or(Unstated::Si(1.0))
    .reaching(ChangeReach::Mesh);

/// `[part.NAME]`
pub(super) const PART: KeyTable = KeyTable {
    doc: "a body of one material, made of one or several blocks or of an imported mesh",
    keys: &[
        &[Key::new("material", ValueForm::Name("material"), "what it is made of").required()],
        SHAPES,
        &[
            Key::new("blocks", ValueForm::Tables(&BLOCK), "`[{ box = [...], at = [...] }, { cylinder = {...}, at = [...] }]`")
                .reaching(ChangeReach::Mesh),
            Key::new(
                "mesh",
                ValueForm::Text,
                "instead of blocks: a Gmsh file (MSH 4.1), from the folder of the machine file; see `docs/how-to/imported-meshes.md`",
            )
            .reaching(ChangeReach::Mesh)
            .also(&["file"]),
            Key::new("volume", ValueForm::Text, "with `mesh`: name of the physical volume; may be left out where there is only one")
                .reaching(ChangeReach::Mesh),
            Key::new("unit", ValueForm::Text, "with `mesh`: length unit of its coordinates")
                .or(Unstated::Text("m"))
                .reaching(ChangeReach::Mesh),
            Key::new(
                "on",
                ValueForm::Name("face"),
                "instead of `at`: against a plane face of another part, `\"plate.+z\"` or `\"bed[2].+z\"`",
            )
            .reaching(ChangeReach::Mesh),
            ALIGN,
            Key::new(
                "offset",
                ValueForm::List(&ValueForm::Quantity(MILLIMETRES), Some(2)),
                "with `on`: `[.., ..]`, a shift along the face's two axes in the order x, y, z",
            )
            .or(Unstated::Follows("none"))
            .reaching(ChangeReach::Mesh),
            GAP,
            ELEMENT_SCALE,
            Key::new("stated_flux_area", ValueForm::Quantity(AREA), "a flux area stated elsewhere, compared with the true contact area")
                .positive()
                .reaching(ChangeReach::Report),
            Key::new(
                "surface",
                ValueForm::Either(&[ValueForm::Word(&["none"]), ValueForm::Table(&radiation::SURFACE)]),
                "radiation to the chamber; `\"none\"` for a part that does not radiate",
            )
            .or(Unstated::Follows("`[surfaces]`")),
            START,
        ],
    ],
    one_of: &["box", "cylinder", "sphere", "blocks", "mesh"],
};

/// Temperature at the start.
const START: Key = Key::new(
    "start",
    ValueForm::Formula(CELSIUS),
    "formula; its temperature when a schedule or log begins, whatever `--from` says of the rest: `\"45 degC\"`",
)
.reaching(ChangeReach::Report)
.also(&["initial_temperature", "start_temperature"]);

pub(in crate::machine) const CAPACITY: Key =
    Key::new("capacity", ValueForm::Quantity(Unit::of(Dimension::CAPACITY, "J/K")), "heat capacity").or(Unstated::Si(0.0));

/// `[node.NAME]`
pub(super) const NODE: KeyTable = KeyTable {
    doc: "a lumped node",
    keys: &[
        &[CAPACITY, Key::new("temperature", ValueForm::Formula(CELSIUS), "formula; makes it a boundary node").reaching(ChangeReach::Load)],
        radiation::EMISSIVITIES,
        &[Key::new("area", ValueForm::Quantity(AREA), "of its radiation to the chamber, with an emissivity").positive(), START],
    ],
    one_of: &[],
};
