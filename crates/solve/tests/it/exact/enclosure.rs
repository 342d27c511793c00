//! Enclosures of grey diffuse surfaces.

use crate::bench::{Solved, check, solve};
use std::f64::consts::PI;

/// The Stefan-Boltzmann constant the program uses (CODATA 2018), W/(m² K⁴).
const SIGMA: f64 = 5.670374419e-8;

/// V19: frustum of a cone, base heated, top held, side adiabatic (Ansys VM147; Siegel and Howell print 904 K).
///
/// The source takes sigma = 5.6696e-8; heat over sigma is what counts, so the heat is scaled. Three of the nine
/// view factors are given; the others follow.
#[test]
fn v19_frustum() {
    let f13 = coldplate_physics::view_factors::coaxial_discs(0.075, 0.05, 0.075);
    check("V19", "F13", f13, 0.197828393634, 1.0, 1e-10);
    let (base, top) = (PI * 0.075 * 0.075, PI * 0.05 * 0.05);
    let side = PI * 0.125 * 0.075f64.hypot(0.025);
    let heat = 6000.0 * base * SIGMA / 5.6696e-8;
    // The surfaces in two orders: nothing may depend on it.
    let tables = [
        (["base", "side", "top"], format!("[[0, '?', {f13}], ['?', '?', '?'], ['?', '?', 0]]")),
        (["top", "base", "side"], format!("[[0, '?', '?'], [{f13}, 0, '?'], ['?', '?', '?']]")),
    ];
    for (order, table) in tables {
        let entry = |name: &str| {
            let (area, e) = match name {
                "base" => (base, 0.6),
                "side" => (side, 0.8),
                _ => (top, 0.5),
            };
            format!("{{ node = '{name}', area = '{area} m2', emissivity = {e} }}")
        };
        let surfaces: Vec<String> = order.iter().map(|n| entry(n)).collect();
        let run = solve(
            &format!(
                r#"
        [node.base]
        [node.side]
        [node.top]
        temperature = "550 K"
        [source.heat]
        in = "base"
        power = "{heat} W"
        [enclosure.cone]
        surfaces = [{}]
        view_factors = {table}
        closed = true
        [sensor.base]
        node = "base"
        [sensor.side]
        node = "side"
    "#,
                surfaces.join(", ")
            ),
            1.0,
        );
        check("V19", "T of the base, K", run.kelvin("base"), 906.08091976, 906.08091976, 1e-9);
        check("V19", "T of the side, K", run.kelvin("side"), 856.86215729, 856.86215729, 1e-9);
        check("V19", "T of the base (printed: 904), K", run.kelvin("base"), 904.0, 904.0, 3e-3);
    }
}

/// V18: concentric grey cylinders (see `radiation.rs`) as an enclosure, with the table of endless cylinders.
#[test]
fn v18_concentric_cylinders() {
    let (t1, t2) = (1000.0 / 1.8, 460.0 / 1.8);
    let run = solve(
        &format!(
            r#"
        [material.ideal]
        conductivity = "1e6 W/(m K)"
        [part.core]
        material = "ideal"
        cylinder = {{ axis = "z", inner = "0.99 m", outer = "1 m", length = "1 m" }}
        surface = "none"
        [part.shell]
        material = "ideal"
        cylinder = {{ axis = "z", inner = "2 m", outer = "2.01 m", length = "1 m" }}
        surface = "none"
        [enclosure.gap]
        surfaces = [{{ face = "core.outer", emissivity = 0.7 }}, {{ face = "shell.inner", emissivity = 0.5 }}]
        view_factors = [[0, 1], ["?", "?"]]
        closed = true
        [boundary.hot]
        faces = ["core.inner"]
        temperature = "{t1} K"
        [boundary.cold]
        faces = ["shell.outer"]
        temperature = "{t2} K"
    "#
        ),
        0.3,
    );
    let to_source = 1.19e-11 * 1.8f64.powi(4) / SIGMA;
    check("V18", "enclosure: heat, Btu/(h in)", run.heat_in("hot") * to_source, 37.0336895449, 37.0336895449, 1e-4);
    check("V18", "enclosure: heat lost and won, W", run.heat_in("hot"), -run.heat_in("cold"), run.heat_in("hot"), 1e-8);
}

/// V25: plates face to face and a body in a grey chamber, both as enclosures; surfaces held where they radiate.
#[test]
fn v25_plates_and_body_in_chamber() {
    let run = solve(
        r#"
        [chamber]
        temperature = "23.5 degC"
        wall_emissivity = 0.3
        wall_area = "96 m2"
        [material.metal]
        conductivity = "20 W/(m K)"
        [part.warm]
        material = "metal"
        box = ["10 mm", "1 m", "1 m"]
        [part.cool]
        material = "metal"
        box = ["10 mm", "1 m", "1 m"]
        at = ["15 mm", "0 m", "0 m"]
        [enclosure.gap]
        surfaces = [{ face = "warm.+x", emissivity = 0.55 }, { face = "cool.-x", emissivity = 0.3 }]
        view_factors = [[0, 1], [1, 0]]
        [boundary.warm]
        faces = ["warm.+x"]
        temperature = "42.2 degC"
        [boundary.cool]
        faces = ["cool.-x"]
        temperature = "23.5 degC"
        [node.body]
        temperature = "42.2 degC"
        [enclosure.room]
        surfaces = [{ node = "body", area = "0.1525 m2", emissivity = 0.55 }, { chamber = true }]
        view_factors = [[0, 1], ["?", "?"]]
        [node.other]
        temperature = "42.2 degC"
        [enclosure.open]
        surfaces = [{ node = "other", area = "0.1525 m2", emissivity = 0.55 }]
        view_factors = [[0]]
    "#,
        0.2,
    );
    check("V25", "enclosure: flux between plates, W/m2", run.heat_in("warm"), 29.3005837661, 29.3005837661, 1e-6);
    let radiated = -run.state.solution.balance.radiation;
    check("V25", "enclosure: heat of two bodies, W", radiated, 2.0 * 10.1819502253, 2.0 * 10.1819502253, 1e-9);
}

/// Temperatures and emissivities of a box of six plates inside, the matrix solved by hand in the test.
const FACES: [(&str, &str, f64, f64); 6] = [
    ("left", "+x", 400.0, 0.9),
    ("right", "-x", 300.0, 0.3),
    ("front", "+y", 350.0, 1.0),
    ("back", "-y", 500.0, 0.55),
    ("floor", "+z", 320.0, 0.2),
    ("roof", "-z", 290.0, 0.75),
];

/// A closed box of 1 x 1 x 1 m inside, made of six plates that are held where they radiate.
fn closed_box(order: [usize; 6], extra: &str) -> Solved {
    solve(&closed_box_text(order, extra), 0.1)
}

fn closed_box_text(order: [usize; 6], extra: &str) -> String {
    let mut text = String::from("[material.metal]\nconductivity = '50 W/(m K)'\n[contacts]\ndefault = 'insulated'\n");
    // Their inner faces meet at the edges.
    let plate = |i: usize| {
        let (axis, high) = (i / 2, i % 2 == 1);
        let (mut size, mut at) = (["1 m"; 3], ["0 m"; 3]);
        (size[axis], at[axis]) = ("0.1 m", if high { "1 m" } else { "-0.1 m" });
        (size, at)
    };
    for (i, (name, side, t, _)) in FACES.iter().enumerate() {
        let (size, at) = plate(i);
        text += &format!("[part.{name}]\nmaterial = 'metal'\nbox = {size:?}\nat = {at:?}\nsurface = 'none'\n");
        text += &format!("[boundary.{name}]\nfaces = ['{name}.{side}']\ntemperature = '{t} K'\n");
    }
    let surfaces: Vec<String> =
        order.iter().map(|i| format!("{{ face = '{}.{}', emissivity = {} }}", FACES[*i].0, FACES[*i].1, FACES[*i].3)).collect();
    text += &format!("[enclosure.box]\nsurfaces = [{}]\n{extra}\n", surfaces.join(", "));
    text
}

/// Heat each face of the box gives, W, from J = e sigma T⁴ + (1 - e) F J, solved densely.
fn box_by_hand() -> [f64; 6] {
    let view = |i: usize, j: usize| match (i, j) {
        (i, j) if i == j => 0.0,
        (i, j) if i / 2 == j / 2 => 0.199824895698,
        _ => 0.200043776075,
    };
    let matrix = nalgebra::DMatrix::from_fn(6, 6, |i, j| f64::from(u8::from(i == j)) - (1.0 - FACES[i].3) * view(i, j));
    let emitted = nalgebra::DVector::from_fn(6, |i, _| FACES[i].3 * SIGMA * FACES[i].2.powi(4));
    let radiosity = matrix.lu().solve(&emitted).expect("singular");
    std::array::from_fn(|i| radiosity[i] - (0..6).map(|j| view(i, j) * radiosity[j]).sum::<f64>())
}

#[test]
fn closed_box_against_a_dense_solution() {
    let exact = box_by_hand();
    let scale = exact.iter().fold(0.0, |m: f64, q| m.max(q.abs()));
    for order in [[0, 1, 2, 3, 4, 5], [5, 3, 1, 0, 2, 4]] {
        let run = closed_box(order, "view_factors = 'computed'\nclosed = true");
        for (face, exact) in FACES.iter().zip(&exact) {
            check("own", &format!("closed box: heat of the {}, W", face.0), run.heat_in(face.0), *exact, scale, 1e-9);
        }
        let heats = &coldplate_solve::balance::enclosure_heats(&run.model.network, &run.state.solution.temperatures)[0];
        for (place, i) in order.iter().enumerate() {
            check("own", &format!("closed box: heat given off by the {}, W", FACES[*i].0), heats[place], exact[*i], scale, 1e-9);
        }
        let views = &run.model.network.enclosures[0];
        assert!(views.by_rays == 0 && views.chamber.iter().all(|c| *c == 0.0), "{views:?}");
    }
    // By rays, and independent of the order in which the surfaces stand.
    let rays = "view_factors = 'rays'\nrays = 200000\nclosed = true";
    let (run, other) = (closed_box([0, 1, 2, 3, 4, 5], rays), closed_box([5, 3, 1, 0, 2, 4], rays));
    for (face, exact) in FACES.iter().zip(exact) {
        check("own", &format!("closed box by rays: heat of the {}, W", face.0), run.heat_in(face.0), exact, scale, 1e-3);
        check(
            "own",
            &format!("closed box by rays, in another order: {}, W", face.0),
            other.heat_in(face.0),
            run.heat_in(face.0),
            scale,
            1e-11,
        );
    }
    let views = &run.model.network.enclosures[0];
    assert!(views.by_rays == 21 && views.error > 0.0 && views.error < 1e-3 && views.corrected < 1e-3, "{views:?}");
}

/// Two square plates cut into patches: finer ones resolve a radiosity that is lower at the edges, where less comes
/// back. Errors fall by a factor of three or more from patches to patches half as wide; one patch is as good as
/// 2 x 2, whose four are the same by symmetry.
#[test]
fn patches_resolve_a_radiosity_that_varies() {
    let heat = |n: usize| {
        let mut machine = String::from("[material.metal]\nconductivity = '50 W/(m K)'\n");
        for (name, side, at, t) in [("floor", "+z", "0 m", 500.0), ("roof", "-z", "0.35 m", 300.0)] {
            machine += &format!("[part.{name}]\nmaterial = 'metal'\nbox = ['0.4 m', '0.4 m', '0.1 m']\nat = ['0 m', '0 m', '{at}']\n");
            machine += &format!("cells = [16, 16, 2]\n[boundary.{name}]\nfaces = ['{name}.{side}']\ntemperature = '{t} K'\n");
        }
        let surface = |face: &str| format!("{{ face = '{face}', emissivity = 0.4, patches = [{n}, {n}] }}");
        machine += &format!("[enclosure.gap]\nsurfaces = [{}, {}]\nview_factors = 'computed'\n", surface("floor.+z"), surface("roof.-z"));
        solve(&machine, 0.05).heat_in("floor")
    };
    let heats = [1, 2, 4, 8, 16].map(heat);
    println!("plates 0.4 m wide, 0.25 m apart, patches 1, 2, 4, 8, 16: {heats:?} W");
    check("own", "plates in one patch and in 2 x 2, W", heats[0], heats[1], heats[1], 1e-9);
    let steps: Vec<f64> = heats[1..].windows(2).map(|h| (h[1] - h[0]).abs()).collect();
    assert!(steps[0] > 3e-4 * heats[4] && steps[1] < steps[0] / 3.0 && steps[2] < steps[1] / 3.0, "{steps:?}");
}

/// Everything at one temperature stays there, whatever its digits; no heat flows.
#[test]
fn one_temperature_everywhere() {
    let text = closed_box_text([0, 1, 2, 3, 4, 5], "view_factors = 'computed'");
    let mut text =
        text.lines().map(|l| if l.starts_with("temperature") { "temperature = '301.37 K'" } else { l }).collect::<Vec<_>>().join("\n");
    text += "\n[chamber]\ntemperature = '301.37 K'\n";
    let run = solve(&text, 0.25);
    for t in &run.state.solution.temperatures[..run.model.network.solids] {
        assert!((t - 301.37).abs() < 1e-9, "{t}");
    }
}

/// T⁴ over eight decades of conductors and from 4 K to thousands: Newton's method arrives, the balance closes.
#[test]
fn extreme_conductors_and_temperatures() {
    for (hot, area, power) in [(4.0, 1e-6, 0.0), (4.0, 100.0, 1e6), (3000.0, 1e-4, 1e-9), (300.0, 1.0, 1e7)] {
        for emissivity in [1e-3, 0.5, 0.500_001, 0.999_999_999, 1.0] {
            let run = solve(
                &format!(
                    r#"
        [node.held]
        temperature = "{hot} K"
        [node.heated]
        [node.shield]
        [source.heat]
        in = "heated"
        power = "{power} W"
        [enclosure.e]
        surfaces = [{{ node = "held", area = "1 m2", emissivity = {emissivity} }},
                    {{ node = "heated", area = "{area} m2", emissivity = {emissivity} }},
                    {{ node = "shield", area = "2 m2", emissivity = 0.3 }}]
        view_factors = [["?", "?", 0.5], [{f}, "?", {f}], ["?", "?", "?"]]
        closed = true
        tolerance = 1e-9
        [sensor.t]
        node = "heated"
    "#,
                    f = if area < 1.0 { 0.5 } else { 0.5 / area },
                ),
                1.0,
            );
            let t = run.kelvin("t");
            // By hand: the shield passes on what it gets, so the exchange areas 0.5 and s in series stand beside s.
            let s = 0.5 * f64::min(area, 1.0);
            let between = s + 1.0 / (1.0 / 0.5 + 1.0 / s);
            let resistance = (1.0 - emissivity) / emissivity * (1.0 + 1.0 / area) + 1.0 / between;
            let exact = (power * resistance / SIGMA + f64::powi(hot, 4)).powf(0.25);
            check("own", &format!("{hot} K, {area} m2, emissivity {emissivity}: T, K"), t, exact, exact, 1e-8);
        }
    }
}
