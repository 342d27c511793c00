//! Contact areas against areas computed by hand, for faces whose cells do not match.

use crate::bench::model;
use crate::invariant::close;
use std::f64::consts::PI;

/// Contact area of `a` and `b` on a mesh of an element size, and the sum of the open areas that are left on
/// both, from the machine's text.
fn areas(parts: &str, size: f64) -> (f64, f64) {
    let text = format!(
        "[contacts]\ndefault = {{ conductance = \"500 W/(m2 K)\" }}\n[material.m]\nconductivity = \"10 W/(m K)\"\n{parts}\n[node.ground]\ntemperature = \"20 degC\"\n"
    );
    let model = model(&text, size);
    let area: f64 = model.network.contacts.iter().map(|c| c.area).sum();
    let mut open = 0.0;
    for (g, _) in model.mesh.grids.iter().enumerate() {
        for side in coldplate_describe::machine::Side::ALL {
            open += model.mesh.open_faces(g, side).map(|(_, a)| a).sum::<f64>();
        }
    }
    // The joints carry the area, cell by cell.
    let joints: f64 = model.network.contacts.iter().flat_map(|c| &model.network.joints[c.joints.clone()]).map(|j| j.area).sum();
    close(joints, area, area.max(1e-9), 1e-12);
    (area, open)
}

fn cuboid(name: &str, size: [f64; 3], at: [f64; 3], scale: f64) -> String {
    let list = |v: [f64; 3]| format!("[\"{} mm\", \"{} mm\", \"{} mm\"]", v[0], v[1], v[2]);
    format!("[part.{name}]\nmaterial = \"m\"\nbox = {}\nat = {}\nelement_scale = {scale}\nsurface = \"none\"\n", list(size), list(at))
}

fn tube(name: &str, axis: &str, [inner, outer, length]: [f64; 3], at: [f64; 3], more: &str) -> String {
    format!(
        "[part.{name}]\nmaterial = \"m\"\ncylinder = {{ axis = \"{axis}\", inner = \"{inner} mm\", outer = \"{outer} mm\", length = \"{length} mm\"{more} }}\nat = [\"{} mm\", \"{} mm\", \"{} mm\"]\nsurface = \"none\"\n",
        at[0], at[1], at[2]
    )
}

const SIZES: [f64; 3] = [30e-3, 11e-3, 4e-3];

#[test]
fn box_on_box() {
    // The upper hangs over the lower by 13 mm in x: 57 x 37 mm touch.
    let parts = cuboid("a", [100.0, 80.0, 20.0], [0.0, 0.0, 0.0], 1.0) + &cuboid("b", [70.0, 37.0, 30.0], [-13.0, 21.0, 20.0], 0.63);
    let total = 2.0 * (0.1 * 0.08 + 0.1 * 0.02 + 0.08 * 0.02) + 2.0 * (0.07 * 0.037 + 0.07 * 0.03 + 0.037 * 0.03);
    for size in SIZES {
        let (contact, open) = areas(&parts, size);
        close(contact, 0.057 * 0.037, 0.057 * 0.037, 1e-12);
        close(open, total - 2.0 * contact, total, 1e-12);
    }
    // Side by side and corner to corner: an edge and a corner are no contact.
    let edge = cuboid("a", [50.0, 50.0, 50.0], [0.0, 0.0, 0.0], 1.0) + &cuboid("b", [50.0, 50.0, 50.0], [50.0, 50.0, 0.0], 1.0);
    close(areas(&edge, 10e-3).0, 0.0, 1.0, 0.0);
}

#[test]
fn cylinder_end_on_box() {
    for (axis, at, plate, corner) in [
        ("z", [40.0, 45.0, 20.0], [100.0, 90.0, 20.0], [0.0, 0.0, 0.0]),
        ("x", [20.0, 40.0, 45.0], [20.0, 100.0, 90.0], [0.0, 0.0, 0.0]),
        ("y", [40.0, 20.0, 45.0], [100.0, 20.0, 90.0], [0.0, 0.0, 0.0]),
        ("z", [40.0, 45.0, -50.0], [100.0, 90.0, 20.0], [0.0, 0.0, 0.0]), // its far end touches from below
    ] {
        let parts = cuboid("a", plate, corner, 1.0) + &tube("b", axis, [12.0, 31.0, 50.0], at, "");
        let exact = PI * (0.031f64.powi(2) - 0.012f64.powi(2));
        for size in SIZES {
            close(areas(&parts, size).0, exact, exact, 1e-9);
        }
    }
    // Part of a turn, on the box with its whole end.
    let parts = cuboid("a", [100.0, 90.0, 20.0], [0.0, 0.0, 0.0], 1.0)
        + &tube("b", "z", [12.0, 31.0, 50.0], [40.0, 45.0, 20.0], ", turn = [\"40 deg\", \"130 deg\"]");
    let exact = PI / 4.0 * (0.031f64.powi(2) - 0.012f64.powi(2));
    for size in SIZES {
        close(areas(&parts, size).0, exact, exact, 1e-9);
    }
}

/// A disc that hangs over the edge of a box: the area of the circle beyond a chord at distance d is a
/// segment, r² acos(d/r) - d sqrt(r² - d²).
#[test]
fn cylinder_end_over_an_edge() {
    let (r, d): (f64, f64) = (0.031, 0.009);
    let segment = r * r * (d / r).acos() - d * (r * r - d * d).sqrt();
    let exact = PI * r * r - segment;
    let parts = cuboid("a", [100.0, 90.0, 20.0], [0.0, 0.0, 0.0], 1.0) + &tube("b", "z", [0.0, 31.0, 50.0], [91.0, 45.0, 20.0], "");
    for size in SIZES {
        close(areas(&parts, size).0, exact, exact, 1e-5);
    }
}

#[test]
fn coaxial_tubes() {
    // One inside the other, 35 mm of shared length; the mantle counts, not the ends.
    let parts = tube("a", "x", [10.0, 25.0, 60.0], [0.0, 0.0, 0.0], "") + &tube("b", "x", [25.0, 40.0, 80.0], [25.0, 0.0, 0.0], "");
    let exact = 2.0 * PI * 0.025 * 0.035;
    for size in SIZES {
        close(areas(&parts, size).0, exact, exact, 1e-12);
    }
    // End to end: the rings 18..25 mm touch.
    let parts = tube("a", "y", [10.0, 25.0, 60.0], [0.0, 0.0, 0.0], "") + &tube("b", "y", [18.0, 40.0, 80.0], [0.0, 60.0, 0.0], "");
    let exact = PI * (0.025f64.powi(2) - 0.018f64.powi(2));
    for size in SIZES {
        close(areas(&parts, size).0, exact, exact, 1e-12);
    }
    // Two halves of a turn, cut face to cut face on both sides.
    let parts = tube("a", "z", [10.0, 25.0, 60.0], [0.0, 0.0, 0.0], ", turn = [\"0 deg\", \"180 deg\"]")
        + &tube("b", "z", [10.0, 25.0, 60.0], [0.0, 0.0, 0.0], ", turn = [\"180 deg\", \"360 deg\"]");
    let exact = 2.0 * 0.015 * 0.06;
    for size in SIZES {
        close(areas(&parts, size).0, exact, exact, 1e-12);
    }
    // A quarter shell on a full tube, its turn shifted by an odd angle.
    let parts = tube("a", "z", [10.0, 25.0, 60.0], [0.0, 0.0, 0.0], "")
        + &tube("b", "z", [25.0, 30.0, 60.0], [0.0, 0.0, 0.0], ", turn = [\"300 deg\", \"390 deg\"]");
    let exact = PI / 2.0 * 0.025 * 0.06;
    for size in SIZES {
        close(areas(&parts, size).0, exact, exact, 1e-12);
    }
}

/// Volumes of parts on any mesh.
#[test]
fn volumes() {
    let parts = cuboid("a", [100.0, 80.0, 20.0], [0.0, 0.0, 0.0], 1.0)
        + &tube("b", "z", [12.0, 31.0, 50.0], [40.0, 45.0, 20.0], ", turn = [\"40 deg\", \"130 deg\"]");
    let text = format!(
        "[contacts]\ndefault = {{ bonded = true }}\n[material.m]\nconductivity = \"10 W/(m K)\"\n{parts}\n[node.ground]\ntemperature = \"20 degC\"\n"
    );
    for size in SIZES {
        let model = model(&text, size);
        close(model.mesh.volume(0), 0.1 * 0.08 * 0.02, 1.6e-4, 1e-12);
        let exact = PI / 4.0 * (0.031f64.powi(2) - 0.012f64.powi(2)) * 0.05;
        close(model.mesh.volume(1), exact, exact, 1e-12);
    }
}
