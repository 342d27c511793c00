//! Files that cannot be used: each is named with its trouble, none makes the program fall over.

use std::path::Path;

use crate::tetra::bench::{fixture, machine};
use coldplate_base::error::Result;
use coldplate_describe::gmsh::{Body, MeshFile};

fn body_of(bytes: &[u8]) -> Result<Body> {
    MeshFile::from_bytes(bytes, Path::new("part.msh"))?.body(None, 1.0)
}

/// One tetrahedron and its foot, with places to break it.
fn one(format: &str, names: &str, nodes: &str, elements: &str) -> Vec<u8> {
    format!(
        "$MeshFormat\n{format}\n$EndMeshFormat\n{names}$Entities\n0 0 1 1\n1 0 0 0 1 1 1 1 1 0\n1 0 0 0 1 1 1 1 2 0\n$EndEntities\n$Nodes\n{nodes}\n$EndNodes\n$Elements\n{elements}\n$EndElements\n"
    )
    .into_bytes()
}

const NAMES: &str = "$PhysicalNames\n2\n2 1 \"foot\"\n3 2 \"body\"\n$EndPhysicalNames\n";
const NODES: &str = "1 4 1 4\n3 1 0 4\n1\n2\n3\n4\n0 0 0\n1 0 0\n0 1 0\n0 0 1";
const ELEMENTS: &str = "2 2 1 2\n2 1 2 1\n1 1 2 3\n3 1 4 1\n2 1 2 3 4";

#[test]
fn the_smallest_mesh_is_read() {
    let body = body_of(&one("4.1 0 8", NAMES, NODES, ELEMENTS)).unwrap();
    assert_eq!((body.name.as_str(), body.points.len(), body.tetrahedra.len(), body.faces.len()), ("body", 4, 1, 4));
    assert_eq!((body.surfaces[0].name.as_str(), body.surfaces[0].faces.len()), ("foot", 1));
    // Turned round as a whole it is the same.
    let turned = body_of(&one("4.1 0 8", NAMES, NODES, &ELEMENTS.replace("2 1 2 3 4", "2 1 3 2 4"))).unwrap();
    assert!((turned.volume(0) - 1.0 / 6.0).abs() < 1e-15);
    // Sparse tags.
    let far = |text: &str| text.replace("\n4\n", "\n4000000000000\n").replace(" 3 4", " 3 4000000000000");
    assert_eq!(body_of(&one("4.1 0 8", NAMES, &far(NODES), &far(ELEMENTS))).unwrap().points, body.points);
    // Parametric nodes.
    let parametric =
        NODES.replace("3 1 0 4", "2 1 1 4").replace("0 0 0", "0 0 0 5 5").replace("1 0 0", "1 0 0 5 5").replace("0 1 0", "0 1 0 5 5");
    let parametric = parametric.replace("0 0 1", "0 0 1 5 5");
    assert_eq!(body_of(&one("4.1 0 8", NAMES, &parametric, ELEMENTS)).unwrap().points, body.points);
}

#[test]
fn bad_meshes_are_named() {
    let whole = one("4.1 0 8", NAMES, NODES, ELEMENTS);
    let cut = &whole[..whole.len() - 30];
    let many = NODES.replacen("1 4 1 4", "1 18446744073709551615 1 4", 1);
    let bomb = NODES.replacen("3 1 0 4", "3 1 0 4000000000", 1);
    let cases: Vec<(&str, Vec<u8>, &str)> = vec![
        ("not a mesh", b"solid cube\nfacet normal 0 0 1\n".to_vec(), "$MeshFormat"),
        ("empty", Vec::new(), "$MeshFormat"),
        ("version 2.2", one("2.2 0 8", NAMES, NODES, ELEMENTS), "4.1"),
        ("other data size", one("4.1 0 4", NAMES, NODES, ELEMENTS), "8 bytes"),
        ("binary in name only", one("4.1 1 8", NAMES, NODES, ELEMENTS), "binary"),
        ("big endian", [b"$MeshFormat\n4.1 1 8\n".as_slice(), &[0, 0, 0, 1], b"\n$EndMeshFormat\n"].concat(), "big endian"),
        ("cut off", cut.to_vec(), "ends in the middle"),
        ("header alone", b"$MeshFormat\n4.1 0 8\n$EndMeshFormat\n".to_vec(), "$Nodes"),
        ("too many nodes", one("4.1 0 8", NAMES, &many, ELEMENTS), "nodes follow"),
        ("a block too large", one("4.1 0 8", NAMES, &bomb, ELEMENTS), "nodes follow"),
        ("not finite", one("4.1 0 8", NAMES, &NODES.replace("1 0 0", "nan 0 0"), ELEMENTS), "finite"),
        ("no number", one("4.1 0 8", NAMES, &NODES.replace("1 0 0", "x 0 0"), ELEMENTS), "number"),
        ("node twice", one("4.1 0 8", NAMES, &NODES.replace("\n2\n", "\n3\n"), ELEMENTS), "twice"),
        ("unknown node", one("4.1 0 8", NAMES, NODES, &ELEMENTS.replace("2 1 2 3 4", "2 1 2 3 9")), "node 9"),
        ("flat", one("4.1 0 8", NAMES, &NODES.replace("0 0 1", "1 1 0"), ELEMENTS), "flat"),
        ("corner twice", one("4.1 0 8", NAMES, NODES, &ELEMENTS.replace("2 1 2 3 4", "2 1 2 3 3")), "flat"),
        ("no tetrahedra", one("4.1 0 8", NAMES, NODES, "1 1 1 1\n2 1 2 1\n1 1 2 3"), "surface elements only"),
        ("points only", one("4.1 0 8", NAMES, NODES, "1 1 1 1\n0 1 15 1\n1 1"), "no tetrahedra"),
        ("a pyramid", one("4.1 0 8", NAMES, NODES, "1 1 1 1\n3 1 7 1\n1 1 2 3 4 4"), "pyramid"),
        ("unknown type", one("4.1 0 8", NAMES, NODES, "1 1 1 1\n3 1 77 1\n1 1 2 3 4"), "type 77"),
        ("wrong count", one("4.1 0 8", NAMES, NODES, &ELEMENTS.replacen("2 2 1 2", "2 3 1 2", 1)), "announced"),
        (
            "no volume has a name",
            String::from_utf8(whole.clone()).unwrap().replace("1 0 0 0 1 1 1 1 2 0", "1 0 0 0 1 1 1 0 0").into_bytes(),
            "name",
        ),
        (
            "turned inside out",
            one(
                "4.1 0 8",
                NAMES,
                "1 5 1 5\n3 1 0 5\n1\n2\n3\n4\n5\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 1 1",
                "1 2 1 2\n3 1 4 2\n1 1 2 3 4\n2 2 3 4 5",
            ),
            "inside out",
        ),
    ];
    for (what, bytes, wanted) in cases {
        match body_of(&bytes) {
            Ok(_) if what == "turned inside out" => {
                // The second is positive too in this numbering; the other order is not.
                let nodes = "1 5 1 5\n3 1 0 5\n1\n2\n3\n4\n5\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 1 1";
                let error = body_of(&one("4.1 0 8", NAMES, nodes, "1 2 1 2\n3 1 4 2\n1 1 2 3 4\n2 3 2 4 5")).unwrap_err();
                assert!(error.to_string().contains(wanted), "{error}");
            }
            Ok(_) => panic!("{what}: was accepted"),
            Err(error) => {
                let shown = error.to_string();
                println!("{what}: {shown}\n");
                assert!(shown.contains(wanted), "{what}: '{wanted}' is not in\n{shown}");
                assert!(shown.contains("part.msh"), "{what}: no file in\n{shown}");
            }
        }
    }
}

/// Names that the machine file gets wrong.
#[test]
fn names_are_checked_with_the_machine_file() {
    let with = |part: &str, rest: &str| {
        let text = format!("[material.m]\nconductivity = \"10 W/(m K)\"\n[part.box]\nmaterial = \"m\"\n{part}\n{rest}");
        machine(&text).unwrap_err().to_string()
    };
    let cases = [
        (with("mesh = \"none.msh\"", ""), "none.msh"),
        (with("mesh = \"pair.msh\"\nunit = \"mm\"", ""), "several volumes"),
        (with("mesh = \"pair.msh\"\nvolume = \"lefd\"", ""), "did you mean 'left'"),
        (with("mesh = \"box.msh\"\nunit = \"kg\"", ""), "kg"),
        (with("mesh = \"box.msh\"\ncells = [1, 1, 1]", ""), "keeps its own elements"),
        (with("mesh = \"box.msh\"\nbox = [\"1 m\", \"1 m\", \"1 m\"]", ""), "exclude"),
        (with("mesh = \"pair.msh\"\nvolume = \"left\"\nunit = \"km\"", ""), "unit"),
        (with("mesh = \"box.msh\"", "[boundary.b]\nfaces = [\"box.low xx\"]\nheat_flux = \"1 W/m2\""), "did you mean 'low x'"),
        (with("mesh = \"box.msh\"", "[boundary.b]\nfaces = [\"box\"]\nheat_flux = \"1 W/m2\""), "low x, high x"),
        (
            with("mesh = \"pair.msh\"\nunit = \"mm\"\nvolume = \"left\"", "[boundary.b]\nfaces = [\"box.hot\"]\nheat_flux = \"1 W/m2\""),
            "does not lie on",
        ),
        (with("mesh = \"box.msh\"", "[channel.c]\nin = \"box\"\ndiameter = \"1 mm\"\npath = []"), "blocks only"),
        (with("mesh = \"box.msh\"", "[part.in]\nmaterial = \"m\"\nbox = [\"50 mm\", \"40 mm\", \"30 mm\"]"), "overlap"),
        (with("mesh = \"box.msh\"", "[part.twin]\nmaterial = \"m\"\nmesh = \"box.msh\""), "same volume"),
        (with("mesh = \"box.msh\"", "[sensor.s]\nin = \"box\"\npoint = [\"1 m\", \"0 m\", \"0 m\"]"), "outside"),
    ];
    for (shown, wanted) in cases {
        println!("{shown}\n");
        assert!(shown.contains(wanted), "'{wanted}' is not in\n{shown}");
    }
}

/// Bytes changed, cut out and doubled at random: an error or a mesh, never a panic or an endless allocation.
#[test]
fn damaged_files_never_panic() {
    let mut seed = 1u64;
    let mut random = |below: usize| {
        // Marsaglia's xorshift.
        seed ^= seed << 13;
        seed ^= seed >> 7;
        seed ^= seed << 17;
        (seed >> 11) as usize % below
    };
    let mut refused = 0;
    for (name, times) in [("pair.msh", 12_000), ("sphere.msh", 12_000), ("box_curved.msh", 6_000)] {
        let whole = std::fs::read(fixture(name)).unwrap();
        for _ in 0..times {
            let mut bytes = whole.clone();
            for _ in 0..=random(3) {
                let at = random(bytes.len());
                match random(5) {
                    0 => bytes[at] = random(256) as u8,
                    1 => bytes[at] ^= 1 << random(8),
                    2 => bytes.truncate(at + 1),
                    3 => drop(bytes.drain(at..(at + random(40)).min(whole.len()).min(at + 1).max(at))),
                    _ => bytes[at] = b"0123456789 -.\n"[random(14)],
                }
            }
            if let Ok(mesh) = MeshFile::from_bytes(&bytes, Path::new("damaged.msh")) {
                for volume in mesh.volume_names() {
                    refused += usize::from(mesh.body(Some(volume), 1e-3).is_err());
                }
            } else {
                refused += 1;
            }
        }
    }
    println!("{refused} refused");
    assert!(refused > 1000);
}
