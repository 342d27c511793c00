//! Orders of convergence: the slope of the error over the mesh, from manufactured solutions.
//!
//! A temperature field is chosen, the source and the surface laws that make it a solution are put into
//! the network cell by cell (a machine file knows no such sources), and the error is measured in the
//! L2 and in the maximum norm.

mod manufactured;

use crate::bench::{model, solve};
use coldplate_describe::machine::Side;
use coldplate_network::mesh::grid::Grid;
use manufactured::{Field, errors};
use std::f64::consts::PI;

/// Asserts that errors fall with at least the given slopes between each mesh and the next one, twice as fine.
#[track_caller]
fn slopes(name: &str, errors: &[[f64; 2]], least: [f64; 2]) {
    println!("{name}: cells 1/1: L2 {:.3e} K, maximum {:.3e} K", errors[0][0], errors[0][1]);
    for (i, pair) in errors.windows(2).enumerate() {
        let slope = [0, 1].map(|i| (pair[0][i] / pair[1][i]).log2());
        let cells = 2 << i;
        println!("{name}: cells 1/{cells}: L2 {:.3e} K, maximum {:.3e} K, orders {:.2}, {:.2}", pair[1][0], pair[1][1], slope[0], slope[1]);
        assert!(slope[0] > least[0] && slope[1] > least[1], "{name}: orders {slope:?}, at least {least:?} expected");
    }
}

/// V43: k = k0 + k1 T and radiation on all six faces of a box:
/// T = T0 + A cos(pi x/lx) cos(pi y/(2 ly)) exp(z/lz), s = -div(k grad T), -k dT/dn = eps sigma (T⁴ - Tw⁴) + g.
struct V43;

impl V43 {
    const L: [f64; 3] = [0.3, 0.2, 0.1];
    const K: [f64; 2] = [14.6, 0.0127];

    fn k(t: f64) -> f64 {
        Self::K[0] + Self::K[1] * t
    }
}

impl Field for V43 {
    fn temperature(&self, [x, y, z]: [f64; 3]) -> f64 {
        320.0 + 40.0 * (PI * x / Self::L[0]).cos() * (PI * y / (2.0 * Self::L[1])).cos() * (z / Self::L[2]).exp()
    }

    fn gradient(&self, [x, y, z]: [f64; 3]) -> [f64; 3] {
        let (p, q) = (PI / Self::L[0], PI / (2.0 * Self::L[1]));
        let e = 40.0 * (z / Self::L[2]).exp();
        [-p * e * (p * x).sin() * (q * y).cos(), -q * e * (p * x).cos() * (q * y).sin(), e * (p * x).cos() * (q * y).cos() / Self::L[2]]
    }

    fn source(&self, at: [f64; 3]) -> f64 {
        let (t, g) = (self.temperature(at), self.gradient(at));
        let (p, q) = (PI / Self::L[0], PI / (2.0 * Self::L[1]));
        let laplacian = (t - 320.0) * (1.0 / (Self::L[2] * Self::L[2]) - p * p - q * q);
        -(Self::k(t) * laplacian + Self::K[1] * g.iter().map(|v| v * v).sum::<f64>())
    }

    fn conductivity(&self, t: f64) -> [f64; 3] {
        [Self::k(t); 3]
    }
}

/// The field's source at the reference's own points (0.15, 0.1, 0.05) and (0.05, 0.03, 0.08).
#[test]
fn v43_field_is_the_references() {
    for (at, t, s) in [([0.15, 0.1, 0.05], 320.0, -3028.62446204), ([0.05, 0.03, 0.08], 394.964858283, 94917.5568497)] {
        assert!((V43.temperature(at) - t).abs() < 1e-9 * t && (V43.source(at) - s).abs() < 1e-9 * s.abs());
    }
}

#[test]
fn v43_box_with_radiation_and_conductivity_of_temperature() {
    // k at 200 and 700 K; the field runs from 211 to 429 K.
    let text = r#"
        [chamber]
        temperature = "296.65 K"
        [material.steel]
        conductivity = [["200 K", "17.14 W/(m K)"], ["700 K", "23.49 W/(m K)"]]
        [part.block]
        material = "steel"
        box = ["0.3 m", "0.2 m", "0.1 m"]
        surface = { effective_emissivity = 0.55 }
    "#;
    let found: Vec<[f64; 2]> = [25e-3, 12.5e-3, 6.25e-3].map(|size| errors(model(text, size * 1.000_001), &V43)).to_vec();
    slopes("V43", &found, [1.9, 1.9]);
}

/// A solid cylinder: T = T0 + A (r/R)² cos(2 theta) cos(pi s/L), whose Laplacian is -(pi/L)² of its own.
struct Saddle {
    radius: f64,
    length: f64,
}

impl Field for Saddle {
    // (u, v, s): u and v are the machine axes normal to the cylinder's, here x and y.
    fn temperature(&self, [x, y, s]: [f64; 3]) -> f64 {
        300.0 + 20.0 * (x * x - y * y) / (self.radius * self.radius) * (PI * s / self.length).cos()
    }

    fn gradient(&self, [x, y, s]: [f64; 3]) -> [f64; 3] {
        let (a, p) = (20.0 / (self.radius * self.radius), PI / self.length);
        [2.0 * a * x * (p * s).cos(), -2.0 * a * y * (p * s).cos(), -a * p * (x * x - y * y) * (p * s).sin()]
    }

    fn source(&self, at: [f64; 3]) -> f64 {
        16.3 * (PI / self.length).powi(2) * (self.temperature(at) - 300.0)
    }

    fn conductivity(&self, _: f64) -> [f64; 3] {
        [16.3; 3]
    }
}

/// A rod that radiates.
const ROD: &str = r#"
        [chamber]
        temperature = "290 K"
        [material.steel]
        conductivity = "16.3 W/(m K)"
        [part.rod]
        material = "steel"
        cylinder = { axis = "z", outer = "40 mm", length = "60 mm" }
        at = ["0 m", "0 m", "0 m"]
        surface = { effective_emissivity = 0.8 }
    "#;

#[test]
fn solid_cylinder() {
    let field = Saddle { radius: 0.04, length: 0.06 };
    let found: Vec<[f64; 2]> = [10e-3, 5e-3, 2.5e-3, 1.25e-3].map(|size| errors(model(ROD, size * 1.000_001), &field)).to_vec();
    slopes("solid cylinder", &found, [1.85, 1.85]);
}

/// Heat that crosses the axis of a solid cylinder: T = T0 + g x.
struct Slope;

impl Field for Slope {
    fn temperature(&self, [x, _, _]: [f64; 3]) -> f64 {
        300.0 + 500.0 * x
    }

    fn gradient(&self, _: [f64; 3]) -> [f64; 3] {
        [500.0, 0.0, 0.0]
    }

    fn source(&self, _: [f64; 3]) -> f64 {
        0.0
    }

    fn conductivity(&self, _: f64) -> [f64; 3] {
        [16.3; 3]
    }
}

/// Second order across the axis too, where wedges meet in a point.
#[test]
fn heat_across_the_axis_of_a_solid_cylinder() {
    let found: Vec<[f64; 2]> = [5e-3, 2.5e-3, 1.25e-3].map(|size| errors(model(ROD, size * 1.000_001), &Slope)).to_vec();
    assert!(found[2][1] < 0.0025 * 20.0, "{found:?}"); // of the 20 K between axis and skin
    slopes("across the axis", &found, [1.8, 1.8]);
}

/// Part of a turn of a tube around x: T = T0 + A exp(u/a) cos(v/a) cos(pi s/L), u and v normal to the axis.
struct Wave;

impl Field for Wave {
    fn temperature(&self, [s, u, v]: [f64; 3]) -> f64 {
        310.0 + 15.0 * (u / 0.05).exp() * (v / 0.05).cos() * (PI * s / 0.06).cos()
    }

    fn gradient(&self, [s, u, v]: [f64; 3]) -> [f64; 3] {
        let (e, p) = (15.0 * (u / 0.05).exp(), PI / 0.06);
        [
            -p * e * (v / 0.05).cos() * (p * s).sin(),
            e / 0.05 * (v / 0.05).cos() * (p * s).cos(),
            -e / 0.05 * (v / 0.05).sin() * (p * s).cos(),
        ]
    }

    fn source(&self, at: [f64; 3]) -> f64 {
        40.0 * (PI / 0.06f64).powi(2) * (self.temperature(at) - 310.0)
    }

    fn conductivity(&self, _: f64) -> [f64; 3] {
        [40.0; 3]
    }
}

#[test]
fn part_of_a_turn_of_a_tube() {
    let text = r#"
        [chamber]
        temperature = "300 K"
        [material.iron]
        conductivity = "40 W/(m K)"
        [part.arc]
        material = "iron"
        cylinder = { axis = "x", inner = "30 mm", outer = "60 mm", length = "60 mm", turn = ["20 deg", "200 deg"] }
        at = ["0 m", "0 m", "0 m"]
        surface = { effective_emissivity = 0.8 }
    "#;
    let found: Vec<[f64; 2]> = [10e-3, 5e-3, 2.5e-3, 1.25e-3].map(|size| errors(model(text, size * 1.000_001), &Wave)).to_vec();
    slopes("part of a turn", &found, [1.8, 1.8]);
}

/// The same smooth field over two blocks whose cells do not match: each overlap conducts between the temperatures
/// at its own centre.
#[test]
fn blocks_that_do_not_match() {
    let text = r#"
        [chamber]
        temperature = "296.65 K"
        [material.steel]
        conductivity = [["200 K", "17.14 W/(m K)"], ["700 K", "23.49 W/(m K)"]]
        [part.lower]
        material = "steel"
        box = ["0.3 m", "0.2 m", "0.04 m"]
        surface = { effective_emissivity = 0.55 }
        [part.upper]
        material = "steel"
        box = ["0.3 m", "0.2 m", "0.06 m"]
        at = ["0 m", "0 m", "0.04 m"]
        element_scale = 0.7
        surface = { effective_emissivity = 0.55 }
        [contact.bond]
        between = ["lower", "upper"]
        bonded = true
    "#;
    let found: Vec<[f64; 2]> = [20e-3, 10e-3, 5e-3].map(|size| errors(model(text, size * 1.000_001), &V43)).to_vec();
    slopes("blocks that do not match", &found, [1.8, 1.8]);
}

/// A contact that resists between cells that do not match: T = T0 + A cos(p x) cos(q y) (z + J), where J is 0 below the
/// interface and k/h above it, so that the flux k A cos cos crosses both halves and the contact alike.
struct Jump {
    interface: f64,
    k: f64,
    h: f64,
}

impl Jump {
    const P: [f64; 2] = [PI / 0.12, PI / 0.1];

    fn across(&self, [x, y, _]: [f64; 3]) -> f64 {
        400.0 * (Self::P[0] * x).cos() * (Self::P[1] * y).cos()
    }

    fn along(&self, z: f64) -> f64 {
        z + if z > self.interface { self.k / self.h } else { 0.0 }
    }
}

impl Field for Jump {
    fn temperature(&self, at: [f64; 3]) -> f64 {
        310.0 + self.across(at) * self.along(at[2])
    }

    fn gradient(&self, [x, y, z]: [f64; 3]) -> [f64; 3] {
        let ([p, q], a) = (Self::P, 400.0 * self.along(z));
        [-p * a * (p * x).sin() * (q * y).cos(), -q * a * (p * x).cos() * (q * y).sin(), self.across([x, y, z])]
    }

    fn source(&self, at: [f64; 3]) -> f64 {
        self.k * (Self::P[0].powi(2) + Self::P[1].powi(2)) * (self.temperature(at) - 310.0)
    }

    fn conductivity(&self, _: f64) -> [f64; 3] {
        [self.k; 3]
    }
}

#[test]
fn contacts_between_cells_that_do_not_match() {
    let field = Jump { interface: 0.04, k: 16.3, h: 800.0 };
    let boxes = r#"
        [chamber]
        temperature = "300 K"
        [material.steel]
        conductivity = "16.3 W/(m K)"
        [part.lower]
        material = "steel"
        box = ["0.12 m", "0.1 m", "0.04 m"]
        surface = { effective_emissivity = 0.55 }
        [part.upper]
        material = "steel"
        box = ["0.12 m", "0.1 m", "0.03 m"]
        at = ["0 m", "0 m", "0.04 m"]
        element_scale = 0.7
        surface = { effective_emissivity = 0.55 }
        [contact.joint]
        between = ["lower", "upper"]
        conductance = "800 W/(m2 K)"
    "#;
    let found: Vec<[f64; 2]> = [10e-3, 5e-3, 2.5e-3].map(|size| errors(model(boxes, size * 1.000_001), &field)).to_vec();
    slopes("boxes in contact", &found, [1.8, 1.8]);
    // The end of a rod on a plate: annular tiles on squares.
    let rod = r#"
        [chamber]
        temperature = "300 K"
        [material.steel]
        conductivity = "16.3 W/(m K)"
        [part.lower]
        material = "steel"
        box = ["0.12 m", "0.1 m", "0.04 m"]
        surface = { effective_emissivity = 0.55 }
        [part.upper]
        material = "steel"
        cylinder = { axis = "z", inner = "15 mm", outer = "40 mm", length = "0.03 m" }
        at = ["0.06 m", "0.05 m", "0.04 m"]
        surface = { effective_emissivity = 0.55 }
        [contact.joint]
        between = ["lower", "upper"]
        conductance = "800 W/(m2 K)"
    "#;
    let found: Vec<[f64; 2]> = [10e-3, 5e-3, 2.5e-3, 1.25e-3].map(|size| errors(model(rod, size * 1.000_001), &field)).to_vec();
    slopes("a rod's end on a plate", &found, [1.8, 1.7]);
}

/// A face mean and a point on a face of V01's slab read the temperature that the solver balances there, which here is exact on
/// any mesh.
#[test]
fn sensors_on_faces() {
    let text = r#"
        [material.steel]
        conductivity = "16.3 W/(m K)"
        [part.slab]
        material = "steel"
        box = ["50 mm", "1 mm", "1 mm"]
        surface = "none"
        [boundary.left]
        faces = ["slab.-x"]
        film = "500 W/(m2 K)"
        fluid_temperature = "20 degC"
        [boundary.right]
        faces = ["slab.+x"]
        film = "50 W/(m2 K)"
        fluid_temperature = "26 degC"
        [source.heat]
        in = ["slab"]
        power = "0.01 W"
        [sensor.face]
        face = "slab.+x"
        [sensor.point]
        point = ["50 mm", "0.2 mm", "0.9 mm"]
        in = "slab"
    "#;
    for size in [25e-3, 5e-3, 2.5e-3, 1.25e-3] {
        let run = solve(text, size);
        for sensor in ["face", "point"] {
            let error = (run.celsius(sensor) - 49.4067547724).abs();
            assert!(error < 1e-9, "{sensor} at {size} m: {error:.1e} K");
        }
    }
}

/// Outward normal in machine coordinates of a cell's face at its centre.
fn normal(grid: &Grid, c: [usize; 3], side: Side) -> ([f64; 3], [f64; 3]) {
    manufactured::face(grid, c, side)
}

/// What everything above rests on: faces lie where they should and look outwards.
#[test]
fn faces_of_the_helper() {
    let text = r#"
        [material.steel]
        conductivity = "16.3 W/(m K)"
        [part.rod]
        material = "steel"
        cylinder = { axis = "y", outer = "40 mm", length = "60 mm" }
        at = ["0 m", "0 m", "0 m"]
        surface = { effective_emissivity = 0.8 }
    "#;
    let model = model(text, 10e-3);
    let grid = &model.mesh.grids[0];
    for c in grid.side_cells(Side::High0) {
        let (at, n) = normal(grid, c, Side::High0);
        assert!((at[0].hypot(at[2]) - 0.04).abs() < 1e-15);
        assert!(((n[0] * at[0] + n[2] * at[2]) / 0.04 - 1.0).abs() < 1e-12 && n[1] == 0.0);
    }
    for c in grid.side_cells(Side::High2) {
        let (at, n) = normal(grid, c, Side::High2);
        assert!(at[1] == 0.06 && (n[1] - 1.0).abs() < 1e-15);
    }
}

/// A shell with a uniform source, held inside, a film outside: T = a + b/r - q r²/6k. The scheme is exact in 1/r
/// alone, so the source shows its order: mean and a point a third of a cell from its border (on borders the error is nil). The
/// heat through the skin is all that the source gives less what goes to the inside, so its temperature is right on any mesh.
#[test]
fn shell_with_source_is_second_order() {
    let (ri, ro, k, q, h): (f64, f64, f64, f64, f64) = (0.02, 0.05, 16.3, 4e5, 60.0);
    let text = |cells: usize| {
        let power = q * 4.0 / 3.0 * PI * (ro.powi(3) - ri.powi(3));
        format!(
            r#"
        [material.steel]
        conductivity = "{k} W/(m K)"
        [part.shell]
        material = "steel"
        sphere = {{ inner = "{ri} m", outer = "{ro} m" }}
        cells = [{cells}, 0, 0]
        surface = "none"
        [source.heat]
        in = ["shell"]
        power = "{power} W"
        [boundary.hot]
        faces = ["shell.inner"]
        temperature = "100 degC"
        [boundary.air]
        faces = ["shell.outer"]
        film = "{h} W/(m2 K)"
        fluid_temperature = "20 degC"
        [sensor.skin]
        face = "shell.outer"
        [sensor.point]
        point = ["0 mm", "0 mm", "30 mm"]
        in = "shell"
        [sensor.mean]
        part = "shell"
    "#
        )
    };
    // -k T'(R) = h (T(R) - Tf) and T(ri) = 100 fix a and b.
    let f = |r: f64| -q * r * r / (6.0 * k);
    let b = (q * ro / 3.0 - h * (100.0 - f(ri) + f(ro) - 20.0)) / (h * (1.0 / ro - 1.0 / ri) - k / (ro * ro));
    let a = 100.0 - f(ri) - b / ri;
    let exact = |r: f64| a + b / r + f(r);
    let cubes = ro.powi(3) - ri.powi(3);
    let mean = a + b * 1.5 * (ro * ro - ri * ri) / cubes - q / (6.0 * k) * 0.6 * (ro.powi(5) - ri.powi(5)) / cubes;
    let runs = [8, 16, 32, 64].map(|cells| solve(&text(cells), 1.0));
    for run in &runs {
        assert!((run.celsius("skin") - exact(ro)).abs() < 1e-9, "{} {}", run.celsius("skin"), exact(ro));
    }
    for (sensor, value) in [("point", exact(0.03)), ("mean", mean)] {
        let errors: Vec<[f64; 2]> = runs.iter().map(|run| [(run.celsius(sensor) - value).abs(); 2]).collect();
        slopes(&format!("shell with source, {sensor}"), &errors, [1.8, 1.8]);
    }
}
