//! The VTU file as a viewer reads it: no polyhedron inside out, every part with its volume.

use crate::bench::solve;
use coldplate_network::mesh::vtu;

/// The bytes of an array of the file.
fn array(text: &str, name: &str) -> Vec<u8> {
    let start = text.find(&format!("Name=\"{name}\"")).unwrap_or_else(|| panic!("no {name}"));
    let body = text[start..].split_once('>').unwrap().1.split_once('<').unwrap().0.trim();
    let digit = |c: u8| match c {
        b'A'..=b'Z' => u32::from(c - b'A'),
        b'a'..=b'z' => u32::from(c - b'a') + 26,
        b'0'..=b'9' => u32::from(c - b'0') + 52,
        b'+' => 62,
        b'/' => 63,
        _ => 0,
    };
    let mut bytes = Vec::new();
    for four in body.as_bytes().chunks(4) {
        let word = four.iter().fold(0, |w, c| w << 6 | digit(*c));
        let padding = four.iter().filter(|c| **c == b'=').count();
        bytes.extend(&word.to_be_bytes()[1..4 - padding]);
    }
    bytes.split_off(8)
}

/// Six times the volume of a polyhedron, by the divergence theorem over its outward faces.
fn volume(points: &[[f64; 3]], faces: &[&[usize]]) -> f64 {
    let mut sum = 0.0;
    for face in faces {
        for k in 1..face.len() - 1 {
            let [a, b, c] = [face[0], face[k], face[k + 1]].map(|i| points[i]);
            sum += a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) + a[2] * (b[0] * c[1] - b[1] * c[0]);
        }
    }
    sum / 6.0
}

#[test]
fn polyhedra_fill_their_parts() {
    let run = solve(
        r#"
        [material.steel]
        conductivity = "16.3 W/(m K)"
        [part.ball]
        material = "steel"
        sphere = { outer = "20 mm" }
        [part.shell]
        material = "steel"
        sphere = { inner = "30 mm", outer = "40 mm" }
        [part.rod]
        material = "steel"
        cylinder = { axis = "y", inner = "4 mm", outer = "10 mm", length = "30 mm" }
        at = ["0.1 m", "0 m", "0 m"]
        [part.box]
        material = "steel"
        box = ["30 mm", "20 mm", "10 mm"]
        at = ["0.2 m", "0 m", "0 m"]
        [surfaces]
        emissivity = 0.5
        [source.heat]
        in = ["ball"]
        power = "1 W"
    "#,
        3e-3,
    );
    let path = std::env::temp_dir().join(format!("coldplate-picture-{}.vtu", std::process::id()));
    vtu::write(&path, &run.model.machine, &run.model.mesh, &run.state.solution.temperatures).unwrap();
    let text = std::fs::read_to_string(&path).unwrap();
    std::fs::remove_file(&path).unwrap();
    let words = |name: &str| array(&text, name).chunks(4).map(|b| u32::from_le_bytes(b.try_into().unwrap())).collect::<Vec<u32>>();
    let floats =
        |name: &str| array(&text, name).chunks(4).map(|b| f64::from(f32::from_le_bytes(b.try_into().unwrap()))).collect::<Vec<f64>>();
    let (points, connectivity, offsets, part) = (floats("Points"), words("connectivity"), words("offsets"), words("part"));
    let (types, celsius, flux) = (array(&text, "types"), floats("temperature_degC"), floats("heat_flux_W_m2"));
    assert!(offsets.len() == types.len() && part.len() == types.len() && celsius.len() == types.len() && flux.len() == 3 * types.len());
    let mut found = [0.0; 4];
    let mut start = 0;
    for (i, end) in offsets.iter().enumerate() {
        let corners: Vec<[f64; 3]> =
            connectivity[start..*end as usize].iter().map(|p| [0, 1, 2].map(|d| points[3 * *p as usize + d])).collect();
        start = *end as usize;
        let own = match types[i] {
            12 => volume(&corners, &[&[0, 3, 2, 1], &[4, 5, 6, 7], &[0, 1, 5, 4], &[1, 2, 6, 5], &[2, 3, 7, 6], &[3, 0, 4, 7]]),
            14 => volume(&corners, &[&[0, 3, 2, 1], &[0, 1, 4], &[1, 2, 4], &[2, 3, 4], &[3, 0, 4]]),
            other => panic!("type {other}"),
        };
        assert!(own > 0.0, "polyhedron {i} of type {} is inside out: {own}", types[i]);
        found[part[i] as usize] += own;
        if part[i] == 1 {
            // In a shell the heat flows along the radius, wherever it flows.
            let middle = corners.iter().fold([0.0; 3], |s, p| [0, 1, 2].map(|d| s[d] + p[d]));
            let along = (0..3).map(|d| middle[d] * flux[3 * i + d]).sum::<f64>();
            let norm = |v: &[f64]| v.iter().map(|x| x * x).sum::<f64>().sqrt();
            assert!((along.abs() - norm(&middle) * norm(&flux[3 * i..3 * i + 3])).abs() <= 1e-4 * along.abs() + 1e-12);
        }
    }
    for (p, (drawn, share)) in found.iter().zip([0.04, 0.04, 0.1, 1e-6]).enumerate() {
        let exact = run.model.mesh.volume(p);
        assert!((drawn / exact - 1.0).abs() < share, "part {p}: {drawn} drawn, {exact} m3");
    }
}
