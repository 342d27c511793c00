//! Machine text with a mesh -> solution; refinement of meshes; the comparison.

use std::collections::HashMap;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use coldplate_base::units::ZERO_CELSIUS;
use coldplate_describe::gmsh::{Body, MeshFile};
use coldplate_describe::machine::Machine;
use coldplate_solve::meshed::{MeshedMachine, SteadyState};

/// A file under meshes/.
pub fn fixture(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/it/tetra/meshes").join(name)
}

/// A machine solved.
pub struct Solved {
    pub model: MeshedMachine,
    pub state: SteadyState,
}

/// Reads a machine; its meshes count from meshes/, its materials are completed with what no steady state
/// depends on.
pub fn machine(text: &str) -> coldplate_base::error::Result<Machine> {
    let mut whole = String::from("name = \"case\"\n");
    for line in text.lines() {
        whole += line;
        whole += "\n";
        if line.trim_start().starts_with("[material.") {
            whole += "density = \"7900 kg/m3\"\nspecific_heat = \"500 J/(kg K)\"\n";
        }
    }
    Machine::from_text(&whole, fixture("case.toml"), &[])
}

#[track_caller]
pub fn solve(text: &str, cells: usize) -> Solved {
    let machine = machine(text).unwrap_or_else(|e| panic!("{e}\n{text}"));
    let model = MeshedMachine::new(machine, Some(cells)).unwrap_or_else(|e| panic!("{e}"));
    let given =
        [("coolant_flow", "1 L/min"), ("coolant_temperature", "20 degC"), ("motor_speed", "0 rpm"), ("ambient_temperature", "20 degC")];
    let condition = model.machine.condition(&given).unwrap_or_else(|e| panic!("{e}"));
    let solver = model.solver(&condition).unwrap_or_else(|e| panic!("{e}"));
    let state = model.solve(&solver, &condition).unwrap_or_else(|e| panic!("{e}"));
    assert!(state.solution.balance.relative < 1e-8, "balance open by {:.1e}", state.solution.balance.relative);
    drop(solver);
    Solved { model, state }
}

impl Solved {
    /// Reading of a sensor, degC.
    #[track_caller]
    pub fn celsius(&self, sensor: &str) -> f64 {
        let at = self.model.network.sensor_names.iter().position(|n| n == sensor).unwrap();
        self.model.network.sensors[at].read(&self.state.solution.temperatures, &self.state.load) - ZERO_CELSIUS
    }

    /// Heat that a boundary puts into the machine, W.
    #[track_caller]
    pub fn heat_in(&self, boundary: &str) -> f64 {
        let at = self.model.machine.boundaries.iter().position(|b| b.name == boundary).unwrap();
        self.state.solution.balance.boundaries[at]
    }

    /// Area, conductance and heat of a contact.
    #[track_caller]
    pub fn contact(&self, name: &str) -> (f64, f64, f64) {
        let flows =
            coldplate_solve::balance::contact_flows(&self.model.network, &self.state.load.contacts, &self.state.solution.temperatures);
        let flow = flows.iter().find(|c| c.name == name).unwrap();
        (flow.area, flow.conductance, flow.heat)
    }
}

#[track_caller]
pub fn check(what: &str, found: f64, wanted: f64, scale: f64, tolerance: f64) {
    let error = (found - wanted).abs() / scale.abs();
    println!("{what:40} {found:18.10} {wanted:18.10} {error:9.1e} of {tolerance:.0e}");
    assert!(error <= tolerance, "{what}: {found} instead of {wanted}, off by {error:.2e} of the scale, {tolerance:.0e} allowed");
}

/// Order of convergence from the errors on two meshes of which the second has half the edges.
pub fn order(coarse: f64, fine: f64) -> f64 {
    (coarse / fine).abs().log2()
}

/// Richardson's extrapolation over meshes that halve the edges: h², then h⁴.
pub fn extrapolate(values: [f64; 3]) -> f64 {
    let once = [(4.0 * values[1] - values[0]) / 3.0, (4.0 * values[2] - values[1]) / 3.0];
    (16.0 * once[1] - once[0]) / 15.0
}

/// A mesh that can be refined and written.
#[derive(Clone)]
pub struct Tets {
    pub points: Vec<[f64; 3]>,
    pub tetrahedra: Vec<[u32; 4]>,
    /// Named triangles.
    pub surfaces: Vec<(String, Vec<[u32; 3]>)>,
}

impl Tets {
    pub fn read(name: &str) -> Self {
        let body: Body = MeshFile::read(&fixture(name)).unwrap().body(None, 1.0).unwrap();
        let named =
            |s: &coldplate_describe::gmsh::NamedSurface| (s.name.clone(), s.faces.iter().map(|f| body.faces[*f as usize]).collect());
        Self { points: body.points.clone(), tetrahedra: body.tetrahedra.clone(), surfaces: body.surfaces.iter().map(named).collect() }
    }

    /// Cuts every tetrahedron into eight (Bey 1995: four corners, and the octahedron along its shortest diagonal).
    /// `place` moves the new points in the middle of the edges of a named surface onto its true shape.
    pub fn refined(&self, place: impl Fn(&str, [f64; 3]) -> [f64; 3]) -> Self {
        let mut points = self.points.clone();
        let mut middles: HashMap<(u32, u32), u32> = HashMap::new();
        let mut middle = |a: u32, b: u32, points: &mut Vec<[f64; 3]>| {
            *middles.entry((a.min(b), a.max(b))).or_insert_with(|| {
                let (p, q) = (points[a as usize], points[b as usize]);
                points.push([0, 1, 2].map(|d| (p[d] + q[d]) / 2.0));
                points.len() as u32 - 1
            })
        };
        let mut tetrahedra = Vec::with_capacity(8 * self.tetrahedra.len());
        for t in &self.tetrahedra {
            let mut m = |i: usize, j: usize| middle(t[i], t[j], &mut points);
            let (m01, m02, m03, m12, m13, m23) = (m(0, 1), m(0, 2), m(0, 3), m(1, 2), m(1, 3), m(2, 3));
            tetrahedra.extend([[t[0], m01, m02, m03], [m01, t[1], m12, m13], [m02, m12, t[2], m23], [m03, m13, m23, t[3]]]);
            let length = |a: u32, b: u32| (0..3).map(|d| (points[a as usize][d] - points[b as usize][d]).powi(2)).sum::<f64>();
            // The equator runs around each of the three diagonals.
            let choices = [(m01, m23, [m02, m03, m13, m12]), (m02, m13, [m01, m03, m23, m12]), (m03, m12, [m01, m02, m23, m13])];
            let (top, bottom, ring) = choices.into_iter().min_by(|a, b| length(a.0, a.1).total_cmp(&length(b.0, b.1))).unwrap();
            tetrahedra.extend((0..4).map(|i| [top, bottom, ring[i], ring[(i + 1) % 4]]));
        }
        let mut surfaces = Vec::new();
        for (name, triangles) in &self.surfaces {
            let mut finer = Vec::with_capacity(4 * triangles.len());
            for [a, b, c] in triangles {
                let (ab, bc, ca) = (middle(*a, *b, &mut points), middle(*b, *c, &mut points), middle(*c, *a, &mut points));
                finer.extend([[*a, ab, ca], [ab, *b, bc], [ca, bc, *c], [ab, bc, ca]]);
                for new in [ab, bc, ca] {
                    points[new as usize] = place(name, points[new as usize]);
                }
            }
            surfaces.push((name.clone(), finer));
        }
        let mut found = Self { points, tetrahedra, surfaces };
        // One orientation throughout.
        for t in &mut found.tetrahedra {
            let p = t.map(|i| found.points[i as usize]);
            let e = |i: usize| [0, 1, 2].map(|d| p[i][d] - p[0][d]);
            let (a, b, c) = (e(1), e(2), e(3));
            let volume = a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) + a[2] * (b[0] * c[1] - b[1] * c[0]);
            if volume < 0.0 {
                t.swap(2, 3);
            }
        }
        found
    }

    /// Writes MSH 4.1 text under the build's folder for temporary files; the volume is called "body".
    pub fn write(&self, name: &str) -> PathBuf {
        let mut text = String::from("$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$PhysicalNames\n");
        let _ = writeln!(text, "{}", self.surfaces.len() + 1);
        for (i, (name, _)) in self.surfaces.iter().enumerate() {
            let _ = writeln!(text, "2 {} \"{name}\"", i + 1);
        }
        let _ = writeln!(text, "3 100 \"body\"\n$EndPhysicalNames\n$Entities\n0 0 {} 1", self.surfaces.len());
        for i in 1..=self.surfaces.len() {
            let _ = writeln!(text, "{i} 0 0 0 1 1 1 1 {i} 0");
        }
        let n = self.points.len();
        let _ = writeln!(text, "1 0 0 0 1 1 1 1 100 0\n$EndEntities\n$Nodes\n1 {n} 1 {n}\n3 1 0 {n}");
        (1..=n).for_each(|i| {
            let _ = writeln!(text, "{i}");
        });
        for p in &self.points {
            let _ = writeln!(text, "{:?} {:?} {:?}", p[0], p[1], p[2]);
        }
        let triangles: usize = self.surfaces.iter().map(|s| s.1.len()).sum();
        let total = triangles + self.tetrahedra.len();
        let _ = writeln!(text, "$EndNodes\n$Elements\n{} {total} 1 {total}", self.surfaces.len() + 1);
        let mut tag = 0;
        let mut line = |text: &mut String, corners: &[u32]| {
            tag += 1;
            let _ = write!(text, "{tag}");
            corners.iter().for_each(|c| {
                let _ = write!(text, " {}", c + 1);
            });
            text.push('\n');
        };
        for (i, (_, triangles)) in self.surfaces.iter().enumerate() {
            let _ = writeln!(text, "2 {} 2 {}", i + 1, triangles.len());
            triangles.iter().for_each(|t| line(&mut text, t));
        }
        let _ = writeln!(text, "3 1 4 {}", self.tetrahedra.len());
        self.tetrahedra.iter().for_each(|t| line(&mut text, t));
        text += "$EndElements\n";
        let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
        std::fs::write(&path, text).unwrap();
        path
    }
}
