//! An imported part in two pieces is said by every command that solves it; nodes that only rounding leaves between held ends.

use crate::common::{coldplate, json, scratch, write};

/// Two tetrahedra that share no node, each with a named face.
const MESH: &str = "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$PhysicalNames\n3\n2 1 \"foot\"\n2 3 \"head\"\n3 2 \"body\"\n$EndPhysicalNames\n\
                    $Entities\n0 0 2 1\n1 0 0 0 1 1 1 1 1 0\n2 3 0 0 4 1 1 1 3 0\n1 0 0 0 4 1 1 1 2 0\n$EndEntities\n\
                    $Nodes\n1 8 1 8\n3 1 0 8\n1\n2\n3\n4\n5\n6\n7\n8\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 0\n4 0 0\n3 1 0\n3 0 1\n$EndNodes\n\
                    $Elements\n3 4 1 4\n2 1 2 1\n1 1 2 3\n2 2 2 1\n2 5 6 7\n3 1 4 2\n3 1 2 3 4\n4 5 6 7 8\n$EndElements\n";

#[test]
fn two_pieces_of_a_part_are_said() {
    let folder = scratch("pieces");
    write(&folder, "two.msh", MESH);
    let text = "name = \"two\"\n[material.m]\nconductivity = \"10 W/(m K)\"\ndensity = \"1000 kg/m3\"\nspecific_heat = \"500 J/(kg K)\"\n\
                [part.body]\nmaterial = \"m\"\nmesh = \"two.msh\"\nunit = \"mm\"\nsurface = \"none\"\n\
                [boundary.hot]\nfaces = [\"body.foot\"]\ntemperature = \"100 degC\"\n\
                [boundary.cold]\nfaces = [\"body.head\"]\ntemperature = \"0 degC\"\n[sensor.body]\npart = \"body\"\n";
    let machine = write(&folder, "two.toml", text);
    let at =
        ["--coolant-flow", "1 L/min", "--coolant-temperature", "20 degC", "--motor-speed", "0 rpm", "--ambient-temperature", "20 degC"];
    let said = "2 pieces that share no node";
    let shown = coldplate(&[&["solve", &machine][..], &at].concat());
    assert!(String::from_utf8_lossy(&shown.stdout).contains(said), "{}", String::from_utf8_lossy(&shown.stdout));
    let notes = json(&coldplate(&[&["solve", &machine, "--json"][..], &at].concat()))["notes"].to_string();
    assert!(notes.contains(said), "{notes}");
    assert!(String::from_utf8_lossy(&coldplate(&["check", &machine]).stdout).contains(said));
}

/// Two nodes between two held ones, through conductances from a milliwatt to a terawatt per kelvin: the balance that rounding leaves is
/// the solution, however small or large the heat is that flows.
#[test]
fn held_ends_leave_a_steady_state_to_rounding() {
    let folder = scratch("held-ends");
    for (outer, inner) in [(1e-3, 1e6), (1.0, 1e9), (1e6, 1e-3), (1e9, 1.0), (1e12, 1e-3), (1e12, 1e12)] {
        for (hot, power) in [(20.0, 0.0), (20.0, 1e-6), (20.000001, 0.0), (900.0, 0.0), (900.0, 1000.0)] {
            let text = format!(
                "name = \"held\"\n[node.hot]\ntemperature = \"{hot} degC\"\n[node.cold]\ntemperature = \"20 degC\"\n[node.a]\n[node.b]\n\
                 [contact]\nx = {{ between = [\"hot\", \"a\"], total_conductance = \"{outer:e} W/K\" }}\n\
                 y = {{ between = [\"a\", \"b\"], total_conductance = \"{inner:e} W/K\" }}\n\
                 z = {{ between = [\"b\", \"cold\"], total_conductance = \"{outer:e} W/K\" }}\n\
                 [source.s]\nin = \"a\"\npower = \"{power} W\"\n[sensor.a]\nnode = \"a\"\n"
            );
            let machine = write(&folder, "held.toml", text);
            let found = json(&coldplate(&["solve", &machine, "--json"]));
            let right = 1.0 / (1.0 / inner + 1.0 / outer);
            let exact = 20.0 + (outer * (hot - 20.0) + power) / (outer + right);
            let shown = found["sensors"]["a"].as_f64().unwrap();
            assert!((shown - exact).abs() < 1e-6 * (exact - 20.0).abs().max(1.0), "{outer:e} {inner:e} {hot} {power}: {shown} {exact}");
        }
    }
}
