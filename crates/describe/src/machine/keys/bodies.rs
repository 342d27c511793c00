//! Parts, their blocks and materials, and lumped nodes.

use super::{AREA, CELSIUS, CONDUCTIVITY, DENSITY, METRES, MILLIMETRES, PROPERTY_OF_CONDUCTION, SPECIFIC_HEAT, TRIPLE, radiation};
use crate::schema::{Form, Key, Reach, Table, Unit, Unstated};
use coldplate_base::units::Dimension;

/// Thermal expansion.
pub(in crate::machine) const EXPANSION: Key = Key::new(
    "expansion",
    Form::Quantity(Unit::of(Dimension::PER_KELVIN, "1/K")),
    "for displacements: coefficient of linear thermal expansion, `\"11.5e-6 1/K\"`",
)
.also(&["thermal_expansion", "cte", "alpha"]);
/// Stiffness.
pub(in crate::machine) const YOUNGS_MODULUS: Key =
    Key::new("youngs_modulus", Form::Quantity(Unit::of(Dimension::PRESSURE, "GPa")), "for displacements: `\"210 GPa\"`")
        .positive()
        .also(&["elastic_modulus", "young", "stiffness"]);
/// Lateral contraction.
pub(in crate::machine) const POISSON_RATIO: Key =
    Key::new("poisson_ratio", Form::Number, "for displacements: from 0 to below 0.5").also(&["poisson", "nu"]);

/// `[material.NAME]`
pub(super) const MATERIAL: Table = Table {
    doc: "a material",
    keys: &[&[
        Key::new(
            "conductivity",
            Form::Either(&[Form::Quantity(CONDUCTIVITY), Form::Curve(CELSIUS, CONDUCTIVITY), Form::List(&PROPERTY_OF_CONDUCTION, Some(3))]),
            "`\"16.3 W/(m K)\"`; a table against temperature `[[\"20 degC\", \"15 W/(m K)\"], ...]`; or three of either, along x, \
             y, z (cylinders: r, theta, z)",
        )
        .also(&["k", "lambda", "thermal_conductivity"]),
        Key::new("density", Form::Quantity(DENSITY), "at room temperature").positive().also(&["rho"]),
        Key::new(
            "specific_heat",
            Form::Either(&[Form::Quantity(SPECIFIC_HEAT), Form::Curve(CELSIUS, SPECIFIC_HEAT)]),
            "a constant, or a table against temperature",
        )
        .also(&["cp", "c", "heat_capacity"]),
        EXPANSION,
        YOUNGS_MODULUS,
        POISSON_RATIO,
        Key::new("source", Form::Text, "where the numbers come from").reaching(Reach::Report),
        Key::new("base", Form::Name("material"), "takes what is not given from a library material, or from one defined above"),
    ]],
    one_of: &[],
};

pub(in crate::machine) const AXIS: Key =
    Key::new("axis", Form::Word(&["x", "y", "z"]), "its axis").or(Unstated::Text("z")).reaching(Reach::Mesh);
pub(in crate::machine) const INNER: Key = Key::new("inner", Form::Quantity(MILLIMETRES), "inner radius; 0 is solid")
    .or(Unstated::Si(0.0))
    .reaching(Reach::Mesh)
    .also(&["inner_radius"]);

/// Radii of cylinders and spheres.
const RADII: &[Key] = &[
    Key::new("outer", Form::Quantity(MILLIMETRES), "outer radius").reaching(Reach::Mesh).also(&["radius", "outer_radius", "r"]),
    Key::new("outer_diameter", Form::Quantity(MILLIMETRES), "or the outer diameter").reaching(Reach::Mesh).also(&["diameter"]),
    INNER,
    Key::new("inner_diameter", Form::Quantity(MILLIMETRES), "or the inner diameter").reaching(Reach::Mesh),
];

const CYLINDER: Table = Table {
    doc: "a cylinder",
    keys: &[
        &[AXIS],
        RADII,
        &[
            Key::new("length", Form::Quantity(METRES), "along the axis").required().reaching(Reach::Mesh).also(&["height"]),
            Key::new(
                "turn",
                Form::List(&Form::Quantity(Unit::of(Dimension::ANGLE, "deg")), Some(2)),
                "first and last angle of a part-turn",
            )
            .or(Unstated::Follows("the full turn"))
            .reaching(Reach::Mesh),
        ],
    ],
    one_of: &["outer", "outer_diameter"],
};

const SPHERE: Table = Table { doc: "a ball or a shell", keys: &[RADII], one_of: &["outer", "outer_diameter"] };

/// Shapes of a block.
const SHAPES: &[Key] = &[
    Key::new("box", TRIPLE, "`[size x, size y, size z]`").reaching(Reach::Mesh).also(&["size", "cuboid", "block"]),
    Key::new(
        "cylinder",
        Form::Table(&CYLINDER),
        "`{ axis = \"z\", outer = \"50 mm\", inner = \"20 mm\", length = \"0.2 m\", turn = [\"0 deg\", \"90 deg\"] }`",
    )
    .reaching(Reach::Mesh),
    Key::new(
        "sphere",
        Form::Table(&SPHERE),
        "`{ outer = \"50 mm\", inner = \"20 mm\" }`, a ball or a shell; its temperature depends on the radius alone",
    )
    .reaching(Reach::Mesh),
    Key::new(
        "cells",
        Form::List(&Form::Whole(0), Some(3)),
        "with one shape: `[4, 0, 2]`, fixed cells along the axes, 0 lets the mesh choose; of a sphere, along the radius: `[20, 0, 0]`",
    )
    .reaching(Reach::Mesh),
    Key::new(
        "at",
        TRIPLE,
        "where: smallest corner of a box, centre of the base of a cylinder, centre of a sphere; of a part with blocks, the point \
         their own `at` count from; of a mesh its origin",
    )
    .or(Unstated::Follows("the origin"))
    .reaching(Reach::Mesh)
    .also(&["position", "origin"]),
];

const BLOCK: Table = Table { doc: "a block of a part", keys: &[SHAPES], one_of: &["box", "cylinder", "sphere"] };

pub(in crate::machine) const ALIGN: Key =
    Key::new("align", Form::Word(&["centre", "corner"]), "with `on`: middle on middle, or `\"corner\"` (smallest corners together)")
        .or(Unstated::Text("centre"))
        .reaching(Reach::Mesh);
pub(in crate::machine) const GAP: Key =
    Key::new("gap", Form::Quantity(MILLIMETRES), "with `on`: a distance to the face").or(Unstated::Si(0.0)).reaching(Reach::Mesh);
pub(in crate::machine) const ELEMENT_SCALE: Key =
    Key::new("element_scale", Form::Number, "cells smaller by this factor").positive().or(Unstated::Si(1.0)).reaching(Reach::Mesh);

/// `[part.NAME]`
pub(super) const PART: Table = Table {
    doc: "a body of one material, made of one or several blocks or of an imported mesh",
    keys: &[
        &[Key::new("material", Form::Name("material"), "what it is made of").required()],
        SHAPES,
        &[
            Key::new("blocks", Form::Tables(&BLOCK), "`[{ box = [...], at = [...] }, { cylinder = {...}, at = [...] }]`")
                .reaching(Reach::Mesh),
            Key::new(
                "mesh",
                Form::Text,
                "instead of blocks: a Gmsh file (MSH 4.1), from the folder of the machine file; see `docs/tetra.md`",
            )
            .reaching(Reach::Mesh)
            .also(&["file"]),
            Key::new("volume", Form::Text, "with `mesh`: name of the physical volume; may be left out where there is only one")
                .reaching(Reach::Mesh),
            Key::new("unit", Form::Text, "with `mesh`: length unit of its coordinates").or(Unstated::Text("m")).reaching(Reach::Mesh),
            Key::new("on", Form::Name("face"), "instead of `at`: against a plane face of another part, `\"plate.+z\"` or `\"bed[2].+z\"`")
                .reaching(Reach::Mesh),
            ALIGN,
            Key::new(
                "offset",
                Form::List(&Form::Quantity(MILLIMETRES), Some(2)),
                "with `on`: `[.., ..]`, a shift along the face's two axes in the order x, y, z",
            )
            .or(Unstated::Follows("none"))
            .reaching(Reach::Mesh),
            GAP,
            ELEMENT_SCALE,
            Key::new("stated_flux_area", Form::Quantity(AREA), "a flux area stated elsewhere, compared with the true contact area")
                .positive()
                .reaching(Reach::Report),
            Key::new(
                "surface",
                Form::Either(&[Form::Word(&["none"]), Form::Table(&radiation::SURFACE)]),
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
    Form::Formula(CELSIUS),
    "formula; its temperature when a schedule or log begins, whatever `--from` says of the rest: `\"45 degC\"`",
)
.reaching(Reach::Report)
.also(&["initial_temperature", "start_temperature"]);

pub(in crate::machine) const CAPACITY: Key =
    Key::new("capacity", Form::Quantity(Unit::of(Dimension::CAPACITY, "J/K")), "heat capacity").or(Unstated::Si(0.0));

/// `[node.NAME]`
pub(super) const NODE: Table = Table {
    doc: "a lumped node",
    keys: &[
        &[CAPACITY, Key::new("temperature", Form::Formula(CELSIUS), "formula; makes it a boundary node").reaching(Reach::Load)],
        radiation::EMISSIVITIES,
        &[Key::new("area", Form::Quantity(AREA), "of its radiation to the chamber, with an emissivity").positive(), START],
    ],
    one_of: &[],
};
