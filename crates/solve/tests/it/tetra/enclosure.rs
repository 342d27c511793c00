//! Imported volumes beside enclosures and spheres: what they shade and cover, and what is refused.

use coldplate_describe::machine::Machine;
use coldplate_network::EnclosureViews;
use coldplate_network::mesh::Mesh;
use coldplate_solve::meshed::MeshedMachine;

use crate::tetra::bench::{check, fixture, machine, solve};

const IMPORTED: &str = "mesh = \"box.msh\"";
/// The imported box as a block.
const BLOCK: &str = "box = [\"100 mm\", \"40 mm\", \"30 mm\"]";

/// Two plates of 100 mm by 40 mm, 90 mm apart, and a box of 100 mm by 40 mm by 30 mm at a place.
fn plates(shape: &str, at: &str, views: &str) -> String {
    format!(
        "[contacts]
        default = \"insulated\"
        [part.low]
        material = \"steel\"
        box = [\"100 mm\", \"40 mm\", \"10 mm\"]
        at = [\"0 mm\", \"0 mm\", \"-40 mm\"]
        [part.high]
        material = \"steel\"
        box = [\"100 mm\", \"40 mm\", \"10 mm\"]
        at = [\"0 mm\", \"0 mm\", \"60 mm\"]
        [part.box]
        material = \"steel\"
        {shape}
        at = [{at}]
        [enclosure.gap]
        surfaces = [{{ face = \"low.+z\", emissivity = 0.5 }}, {{ face = \"high.-z\", emissivity = 0.5 }}]
        view_factors = \"{views}\"
        rays = 40000
        "
    )
}

#[track_caller]
fn views(text: &str) -> EnclosureViews {
    let model = MeshedMachine::new(machine(text).unwrap_or_else(|e| panic!("{e}")), Some(500)).unwrap_or_else(|e| panic!("{e}"));
    model.network.enclosures[0].clone()
}

/// A block of the same shape is the reference: its shadow is tested against closed forms in the family `exact`.
#[test]
fn an_imported_box_shades_and_covers_as_a_block_does() {
    let free = views(&plates(IMPORTED, "\"0 mm\", \"500 mm\", \"0 mm\"", "computed"));
    assert_eq!(free.by_rays, 0, "nothing between the plates");
    for at in ["\"50 mm\", \"0 mm\", \"0 mm\"", "\"50 mm\", \"10 mm\", \"-30 mm\"", "\"60 mm\", \"10 mm\", \"10 mm\""] {
        let (imported, block) = (views(&plates(IMPORTED, at, "computed")), views(&plates(BLOCK, at, "computed")));
        assert!(imported.by_rays > 0 && imported.notes.len() == 2, "{imported:?}");
        for i in 0..2 {
            check(&format!("{at}: area {i}"), imported.areas[i], block.areas[i], block.areas[i], 1e-9);
            check(&format!("{at}: chamber from {i}"), imported.chamber[i], block.chamber[i], 1.0, 1e-4);
        }
        check(&format!("{at}: F12"), imported.view_factors[0][1], block.view_factors[0][1], 1.0, 1e-4);
        assert!(imported.view_factors[0][1] < free.view_factors[0][1] - 0.005, "{at} shades");
    }
}

#[test]
fn an_imported_face_is_no_surface_of_an_enclosure() {
    let text = plates(IMPORTED, "\"50 mm\", \"0 mm\", \"0 mm\"", "computed");
    for (from, to) in [("face = \"low.+z\"", "face = \"box.low x\""), ("face = \"low.+z\"", "part = \"box\"")] {
        let error = machine(&text.replace(from, to)).err().unwrap_or_else(|| panic!("{to} is not refused")).to_string();
        assert!(error.contains("'box' is an imported mesh") && error.contains("radiation_link"), "{error}");
    }
}

/// Of a sphere only a point can touch a plane; triangles are not laid on its one cell.
#[test]
fn an_imported_box_and_a_sphere_need_an_area() {
    let text = |area: &str| {
        format!(
            "[part.box]
            material = \"steel\"
            mesh = \"box.msh\"
            [part.ball]
            material = \"steel\"
            sphere = {{ outer = \"100 mm\" }}
            at = [\"200 mm\", \"20 mm\", \"15 mm\"]
            [contact.spot]
            between = [\"box.high x\", \"ball.outer\"]
            conductance = \"100 W/(m2 K)\"
            {area}
            "
        )
    };
    let error = MeshedMachine::new(machine(&text("")).unwrap(), Some(100)).err().unwrap().to_string();
    assert!(error.contains("do not touch") && error.contains("area"), "{error}");
    let joined = machine(&text("area = \"1 cm2\"")).unwrap();
    assert!(Mesh::with_cells(&joined, 100).unwrap().touches.is_empty());
    MeshedMachine::new(joined, Some(100)).unwrap();
}

/// Held lumped nodes, the chamber of an enclosure and the vertices of an imported face at once: each at its own
/// temperature, each with its own heat.
#[test]
fn what_holds_nodes_chamber_and_vertices_is_kept_apart() {
    let run = solve(
        "[material.a]
        conductivity = \"16.3 W/(m K)\"
        [part.box]
        material = \"a\"
        mesh = \"box.msh\"
        surface = \"none\"
        [boundary.cold]
        faces = [\"box.low x\"]
        temperature = \"30 degC\"
        [boundary.hot]
        faces = [\"box.high x\"]
        temperature = \"90 degC\"
        [node.free]
        capacity = \"10 J/K\"
        [node.lamp]
        temperature = \"50 degC\"
        [contact.lead]
        between = [\"free\", \"lamp\"]
        total_conductance = \"1 W/K\"
        [enclosure.room]
        surfaces = [{ node = \"lamp\", area = \"100 cm2\", emissivity = 0.8 }, { chamber = true, emissivity = 1, area = \"1 m2\" }]
        view_factors = [[0, 1], [\"?\", \"?\"]]
        [sensor.free]
        node = \"free\"
        ",
        100,
    );
    let conducted = 16.3 * 0.04 * 0.03 * 60.0 / 0.1;
    check("heat from the hot face", run.heat_in("hot"), conducted, conducted, 1e-9);
    check("heat from the cold face", run.heat_in("cold"), -conducted, conducted, 1e-9);
    // Stefan and Boltzmann's constant of CODATA 2018.
    let radiated = 5.670374419e-8 * 0.8 * 0.01 * (323.15f64.powi(4) - 293.15f64.powi(4));
    let balance = &run.state.solution.balance;
    check("what the chamber takes", balance.radiation, -radiated, radiated, 1e-9);
    assert_eq!(balance.held.len(), 1);
    check("what holds the lamp", balance.held[0], radiated, radiated, 1e-9);
    check("the free node", run.celsius("free"), 50.0, 50.0, 1e-9);
}

/// Vertices take part in c(T): all of them together hold rho V c(T).
#[test]
fn the_capacity_of_vertices_follows_the_temperature() {
    let text = "name = \"case\"
        [material.a]
        conductivity = \"16.3 W/(m K)\"
        density = \"7900 kg/m3\"
        specific_heat = [[\"250 K\", \"400 J/(kg K)\"], [\"350 K\", \"600 J/(kg K)\"]]
        [part.first]
        material = \"a\"
        box = [\"10 mm\", \"10 mm\", \"10 mm\"]
        at = [\"500 mm\", \"0 mm\", \"0 mm\"]
        [part.box]
        material = \"a\"
        mesh = \"box.msh\"
        [node.lump]
        capacity = \"10 J/K\"
        ";
    let machine = Machine::from_text(text, fixture("case.toml"), &[]).unwrap_or_else(|e| panic!("{e}"));
    let model = MeshedMachine::new(machine, Some(8)).unwrap();
    let tetra = &model.mesh.tetra[0];
    let of = |f: &dyn Fn(usize) -> f64| (tetra.first..tetra.first + tetra.points.len()).map(f).sum::<f64>();
    let mass = 7900.0 * 0.1 * 0.04 * 0.03;
    check("capacity at 300 K", of(&|n| model.network.capacity_at(n, 300.0)), mass * 500.0, mass * 500.0, 1e-12);
    check("capacity at 340 K", of(&|n| model.network.capacity_at(n, 340.0)), mass * 580.0, mass * 580.0, 1e-12);
    // From 300 K to 340 K at 500 to 580 J/(kg K).
    check("enthalpy at 340 K", of(&|n| model.network.enthalpy(n, 340.0)), mass * 21_600.0, mass * 21_600.0, 1e-12);
}
