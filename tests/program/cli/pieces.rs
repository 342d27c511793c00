//! An imported part in two pieces is said by every command that solves it.

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
