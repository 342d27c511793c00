//! Thermal displacement: free expansion, walls, joints, Timoshenko's strip, a gradient across a beam, a tube.

use coldplate_describe::machine::Machine;
use coldplate_network::Network;
use coldplate_network::mesh::Mesh;

use crate::bench::{Solved, check, machine, solve};

/// Material with conductivity, stiffness and expansion; the temperatures come from boundaries.
fn material(name: &str, modulus: f64, poisson: f64, expansion: f64) -> String {
    format!(
        "[material.{name}]\nconductivity = \"40 W/(m K)\"\nyoungs_modulus = \"{modulus} Pa\"\npoisson_ratio = {poisson:?}\n\
         expansion = \"{expansion} 1/K\"\n"
    )
}

/// A displacement along an axis at a point (m) of a part, from the supports or from a point of another.
fn sensor(name: &str, (part, at): (&str, [f64; 3]), from: Option<(&str, [f64; 3])>, direction: &str) -> String {
    let place = |[x, y, z]: [f64; 3]| format!("[\"{x} m\", \"{y} m\", \"{z} m\"]");
    let relative = from.map_or(String::new(), |(part, at)| format!("relative_to = {}\nrelative_in = \"{part}\"\n", place(at)));
    format!(
        "[displacement.{name}]\npoint = {}\nin = \"{part}\"\n{relative}coordinates = \"machine\"\ndirection = \"{direction}\"\n",
        place(at)
    )
}

/// Faces held along axes.
fn support(name: &str, face: &str, directions: &str) -> String {
    format!("[support.{name}]\nfaces = [\"{face}\"]\ndirections = [{directions}]\n")
}

fn micrometres(run: &Solved, name: &str) -> f64 {
    let at = run.model.machine.sensors.iter().position(|s| s.name == name).unwrap();
    run.model.readings(&run.state)[at]
}

/// What moves freely moves by alpha (T - T0) x, whatever the cells: boxes of unlike cells and a column on them.
#[test]
fn free_expansion() {
    let mut text = material("steel", 210e9, 0.3, 12e-6);
    text += r#"
        [part.bed]
        material = "steel"
        box = ["0.4 m", "0.3 m", "0.1 m"]
        surface = "none"
        [part.block]
        material = "steel"
        box = ["0.15 m", "0.11 m", "0.1 m"]
        at = ["0.05 m", "0.13 m", "0.1 m"]
        element_scale = 0.7
        surface = "none"
        [part.column]
        material = "steel"
        cylinder = { axis = "z", outer = "40 mm", length = "0.2 m" }
        at = ["0.3 m", "0.15 m", "0.1 m"]
        surface = "none"
        [boundary.warm]
        faces = ["bed.-z"]
        temperature = "30 degC"
        [contacts]
        default = "bonded"
    "#;
    text += &(support("x", "bed.-x", "\"x\"") + &support("y", "bed.-y", "\"y\"") + &support("z", "bed.-z", "\"z\""));
    let places = [("bed", [0.4, 0.3, 0.1]), ("block", [0.2, 0.24, 0.2]), ("column", [0.32, 0.15, 0.3]), ("column", [0.3, 0.19, 0.25])];
    for (i, place) in places.iter().enumerate() {
        for axis in ["x", "y", "z"] {
            text += &sensor(&format!("{axis}{i}"), *place, None, axis);
        }
    }
    text += &sensor("apart", places[2], Some(places[1]), "-x");
    let run = solve(&text, 0.04);
    for (i, (_, at)) in places.iter().enumerate() {
        for (d, axis) in ["x", "y", "z"].into_iter().enumerate() {
            check(
                "D01",
                &format!("{axis} of point {i}, um"),
                micrometres(&run, &format!("{axis}{i}")),
                12e-6 * 10.0 * at[d] * 1e6,
                48.0,
                1e-5,
            );
        }
    }
    check("D01", "between two points, um", micrometres(&run, "apart"), -12e-6 * 10.0 * 0.12 * 1e6, 48.0, 1e-8);
}

/// Two bars in a row between walls, warmed: E1 and E2 share the thrust. Where the joint gives, u1 = a dT L1 - s L1/E1 with
/// s = a dT (L1 + L2)/(L1/E1 + L2/E2 + 1/k).
#[test]
fn bars_between_walls() {
    let (e1, e2, alpha, l1, l2) = (210e9, 70e9, 15e-6, 0.3, 0.2);
    for (stiffness, compliance) in [("", 0.0), ("normal_stiffness = \"2e11 N/m3\"", 1.0 / 2e11)] {
        let mut text = material("hard", e1, 0.0, alpha) + &material("soft", e2, 0.0, alpha);
        text += &format!(
            r#"
            [part.first]
            material = "hard"
            box = ["{l1} m", "0.05 m", "0.04 m"]
            surface = "none"
            [part.second]
            material = "soft"
            box = ["{l2} m", "0.05 m", "0.04 m"]
            at = ["{l1} m", "0 m", "0 m"]
            surface = "none"
            [contact.between]
            between = ["first", "second"]
            bonded = true
            {stiffness}
            [boundary.warm]
            faces = ["first.-z", "second.-z"]
            temperature = "45 degC"
            "#
        );
        text += &(support("left", "first.-x", "\"x\"") + &support("right", "second.+x", "\"x\""));
        for part in ["first", "second"] {
            text += &(support(&format!("{part}y"), &format!("{part}.-y"), "\"y\"")
                + &support(&format!("{part}z"), &format!("{part}.-z"), "\"z\""));
        }
        text += &sensor("joint", ("first", [l1, 0.02, 0.03]), None, "x");
        let run = solve(&text, 0.02);
        let warmer = alpha * 25.0;
        let thrust = warmer * (l1 + l2) / (l1 / e1 + l2 / e2 + compliance);
        let exact = (warmer * l1 - thrust * l1 / e1) * 1e6;
        check("D02", &format!("joint {stiffness}, um"), micrometres(&run, "joint"), exact, 112.5, 1e-5);
    }
}

/// A block that slides on a warmed bed keeps its length: its far end follows its own temperature alone. Glued, it goes along.
#[test]
fn sliding_and_glued() {
    let text = |joint: &str| {
        let mut text = material("steel", 210e9, 0.0, 12e-6) + &material("soft", 210e3, 0.0, 12e-6);
        text += &format!(
            r#"
            [part.bed]
            material = "steel"
            box = ["0.5 m", "0.1 m", "0.1 m"]
            surface = "none"
            [part.block]
            material = "soft"
            box = ["0.5 m", "0.1 m", "20 mm"]
            at = ["0 m", "0 m", "0.1 m"]
            surface = "none"
            [contact.rail]
            between = ["bed", "block"]
            insulated = true
            joint = "{joint}"
            [boundary.warm]
            faces = ["bed.-z"]
            temperature = "40 degC"
            [boundary.cool]
            faces = ["block.+z"]
            temperature = "25 degC"
            "#
        );
        for part in ["bed", "block"] {
            text += &(support(&format!("{part}x"), &format!("{part}.-x"), "\"x\"")
                + &support(&format!("{part}y"), &format!("{part}.-y"), "\"y\""));
        }
        text + &support("z", "bed.-z", "\"z\"") + &sensor("end", ("block", [0.5, 0.05, 0.11]), None, "x")
    };
    let end = |joint: &str| micrometres(&solve(&text(joint), 0.03), "end");
    check("D03", "sliding, um", end("sliding"), 12e-6 * 5.0 * 0.5 * 1e6, 120.0, 1e-5);
    // A block a million times softer than the bed goes where the bed goes, but for what its outer half lags behind at the end.
    let glued = end("glued");
    assert!(glued > 80.0 && glued < 120.0, "{glued}");
}

/// Timoshenko, J. Opt. Soc. Am. 11 (1925) 233, eq. 4: curvature of a strip of two metals with thicknesses in the ratio m and
/// moduli in the ratio n, 6 (a2 - a1) dT (1 + m)² / (h (3 (1 + m)² + (1 + m n)(m² + 1/(m n)))).
#[test]
fn bimetal_strip() {
    let (e1, e2, a1, a2, t1, t2, warmer) = (140e9_f64, 110e9, 1.2e-6, 18e-6, 1.5e-3_f64, 1e-3, 50.0_f64);
    let (m, n, h) = (t1 / t2, e1 / e2, t1 + t2);
    let exact = 6.0 * (a2 - a1) * warmer * (1.0 + m).powi(2) / (h * (3.0 * (1.0 + m).powi(2) + (1.0 + m * n) * (m * m + 1.0 / (m * n))));
    let mut text = material("invar", e1, 0.0, a1) + &material("brass", e2, 0.0, a2) + &material("foam", 1e3, 0.0, 0.0);
    text += &format!(
        r#"
        [part.lower]
        material = "invar"
        box = ["0.1 m", "2 mm", "{t1} m"]
        surface = "none"
        [part.upper]
        material = "brass"
        box = ["0.1 m", "2 mm", "{t2} m"]
        at = ["0 m", "0 m", "{t1} m"]
        surface = "none"
        [part.foot]
        material = "foam"
        box = ["2 mm", "2 mm", "2 mm"]
        at = ["0 m", "0 m", "-2 mm"]
        surface = "none"
        [contacts]
        default = "bonded"
        [boundary.warm]
        faces = ["lower.-z", "upper.+z", "foot.-z"]
        temperature = "70 degC"
        "#
    );
    for part in ["lower", "upper"] {
        text +=
            &(support(&format!("{part}x"), &format!("{part}.-x"), "\"x\"") + &support(&format!("{part}y"), &format!("{part}.-y"), "\"y\""));
    }
    text += &support("foot", "foot.-z", "\"x\", \"y\", \"z\"");
    let at = |x: f64| ("lower", [x, 0.0, 0.75e-3]);
    text += &(sensor("near", at(0.05), Some(at(0.03)), "z") + &sensor("far", at(0.07), Some(at(0.05)), "z"));
    // Few long cells, four times as long as thick.
    let run = solve(&text, 2e-3);
    let curvature = (micrometres(&run, "near") - micrometres(&run, "far")) * 1e-6 / 0.02_f64.powi(2);
    check("D04", "curvature, 1/m", curvature, exact, exact, 1e-4);
}

/// A temperature linear in space causes no stress: T = g z bends a beam by u = -a g (x² + y²)/2 along z, with two cells across.
#[test]
fn gradient_across_a_beam() {
    let (alpha, gradient) = (11e-6, 20.0 / 0.04);
    let mut text = material("steel", 210e9, 0.3, alpha) + &material("foam", 1e3, 0.0, 0.0);
    text += r#"
        [part.beam]
        material = "steel"
        box = ["0.6 m", "0.04 m", "0.04 m"]
        cells = [15, 2, 2]
        surface = "none"
        [part.foot]
        material = "foam"
        box = ["20 mm", "20 mm", "20 mm"]
        at = ["-20 mm", "0 m", "0 m"]
        surface = "none"
        [contact.foot]
        between = ["beam", "foot"]
        insulated = true
        [boundary.low]
        faces = ["beam.-z", "foot.-z"]
        temperature = "20 degC"
        [boundary.high]
        faces = ["beam.+z"]
        temperature = "40 degC"
    "#;
    text += &(support("x", "beam.-x", "\"x\"") + &support("y", "beam.-y", "\"y\"") + &support("foot", "foot.-z", "\"z\""));
    text += &sensor("tip", ("beam", [0.6, 0.0, 0.0]), Some(("beam", [0.0, 0.0, 0.0])), "z");
    text += &sensor("long", ("beam", [0.6, 0.0, 0.04]), None, "x");
    let run = solve(&text, 0.02);
    let bend = -alpha * gradient * 0.36 / 2.0 * 1e6;
    check("D05", "tip, um", micrometres(&run, "tip"), bend, bend, 1e-6);
    check("D05", "length of the warm side, um", micrometres(&run, "long"), alpha * 20.0 * 0.6 * 1e6, 132.0, 1e-6);
}

/// A tube warm inside and held between plates (Timoshenko and Goodier, Theory of Elasticity, 3rd ed., article 151, with no
/// strain along the axis): u(r) = (1 + nu)/(1 - nu) a/r (S(r) + ((1 - 2 nu) r² + r1²)/(r2² - r1²) S(r2)), where S(r) is the
/// integral of (T - T0) r from r1, and T falls with the logarithm of r.
#[test]
fn tube_with_a_radial_gradient() {
    let (r1, r2, nu, alpha, warmer) = (0.04_f64, 0.08_f64, 0.3, 12e-6, 60.0);
    let mut text = material("steel", 210e9, nu, alpha);
    text += &format!(
        r#"
        [part.tube]
        material = "steel"
        cylinder = {{ axis = "z", inner = "{r1} m", outer = "{r2} m", length = "10 mm", turn = ["0 deg", "90 deg"] }}
        surface = "none"
        [boundary.hot]
        faces = ["tube.inner"]
        temperature = "{} degC"
        [boundary.cold]
        faces = ["tube.outer"]
        temperature = "20 degC"
        "#,
        20.0 + warmer
    );
    text += &(support("one", "tube.cut1", "\"y\"") + &support("two", "tube.cut2", "\"x\""));
    text += &(support("start", "tube.start", "\"z\"") + &support("end", "tube.end", "\"z\""));
    text += &(sensor("inner", ("tube", [r1, 0.0, 5e-3]), None, "x") + &sensor("outer", ("tube", [0.0, r2, 5e-3]), None, "y"));
    let ratio = (r2 / r1).ln();
    // Integral of warmer ln(r2/r)/ln(r2/r1) r.
    let moment = |r: f64| warmer / ratio * (r * r / 2.0 * (r2 / r).ln() + r * r / 4.0 - r1 * r1 / 2.0 * ratio - r1 * r1 / 4.0);
    let exact = |r: f64| {
        let whole = ((1.0 - 2.0 * nu) * r * r + r1 * r1) / (r2 * r2 - r1 * r1) * moment(r2);
        (1.0 + nu) / (1.0 - nu) * alpha / r * (moment(r) + whole) * 1e6
    };
    let runs = [5e-3, 2.5e-3, 1.25e-3].map(|size: f64| solve(&text, size * 1.000_001));
    for (name, r) in [("inner", r1), ("outer", r2)] {
        let found = [0, 1, 2].map(|i| micrometres(&runs[i], name));
        let order = ((found[1] - exact(r)) / (found[2] - exact(r))).log2();
        println!("{name}: {found:?}, exact {}, order {order:.2}", exact(r));
        check("D06", &format!("{name}, um, 32 cells across"), found[2], exact(r), exact(r), 1e-3);
        assert!((1.7..2.5).contains(&order), "{name}: order {order}");
    }
}

/// What cannot be solved says what is missing.
#[test]
fn refusals() {
    let text = |material: &str, more: &str| {
        format!(
            "{material}[part.bed]\nmaterial = \"steel\"\nbox = [\"0.2 m\", \"0.1 m\", \"0.1 m\"]\nsurface = \"none\"\n\
             [part.slide]\nmaterial = \"steel\"\nbox = [\"0.1 m\", \"0.1 m\", \"0.1 m\"]\nat = [\"0 m\", \"0 m\", \"0.1 m\"]\nsurface = \"none\"\n\
             [contact.rail]\nbetween = [\"bed\", \"slide\"]\nconductance = \"500 W/(m2 K)\"\njoint = \"sliding\"\n{}{more}",
            sensor("top", ("slide", [0.05, 0.05, 0.2]), None, "z")
        )
    };
    let refused = |text: &str| {
        let machine: Machine = machine(text);
        let mesh = Mesh::with_size(&machine, 0.05).unwrap();
        Network::build(&machine, &mesh).unwrap_err().to_string()
    };
    let steel = material("steel", 210e9, 0.3, 12e-6);
    let held = "[support.feet]\nfaces = [\"bed.-z\"]\n";
    let loose = refused(&text(&steel, ""));
    assert!(loose.contains("can move freely") && loose.contains("[support."), "{loose}");
    let slides = refused(&text(&steel, held));
    assert!(slides.contains("'slide'") && slides.contains("can move freely along"), "{slides}");
    let stopped = format!("{held}[support.stop]\nfaces = [\"slide.-x\", \"slide.-y\"]\ndirections = [\"x\", \"y\"]\n");
    let unknown = refused(&text("[material.steel]\nconductivity = \"40 W/(m K)\"\n", &stopped));
    assert!(unknown.contains("youngs_modulus") && unknown.contains("210 GPa"), "{unknown}");
    let held = machine(&text(&steel, &stopped));
    let mesh = Mesh::with_size(&held, 0.05).unwrap();
    assert!(Network::build(&held, &mesh).is_ok());
}
