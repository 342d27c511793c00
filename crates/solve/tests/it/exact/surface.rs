//! Temperatures of faces and joints, several boundaries on one face, and boundaries on parts of faces.

use crate::bench::{check, extrapolate, machine, solve};
use coldplate_base::units::ZERO_CELSIUS;
use std::f64::consts::PI;

const TUBE: &str = r#"
    [material.metal]
    conductivity = "2 W/(m K)"
    [part.tube]
    material = "metal"
    cylinder = { axis = "z", inner = "10 mm", outer = "40 mm", length = "20 mm" }
    at = ["0 m", "0 m", "0 m"]
    surface = "none"
    [boundary.inside]
    faces = ["tube.inner"]
    heat_flux = "5000 W/m2"
    [sensor.inner]
    face = "tube.inner"
    [sensor.outer]
    face = "tube.outer"
    [sensor.mark]
    point = ["0 mm", "40 mm", "7 mm"]
    in = "tube"
"#;

/// Heat into [`TUBE`] per length, W/m.
const HEAT: f64 = 5000.0 * 2.0 * PI * 0.01;

/// A hollow cylinder heated inside, a film outside: T(ro) = Tf + Q/(2 pi ro h), T(ri) = T(ro) + Q ln(ro/ri)/(2 pi k), on
/// cells as coarse as they come.
#[test]
fn faces_of_a_hollow_cylinder() {
    let text = format!("{TUBE}[boundary.air]\nfaces = [\"tube.outer\"]\nfilm = \"50 W/(m2 K)\"\nfluid_temperature = \"20 degC\"\n");
    let outer = 20.0 + HEAT / (2.0 * PI * 0.04 * 50.0);
    let inner = outer + HEAT * 4f64.ln() / (2.0 * PI * 2.0);
    for size in [1.0, 8e-3, 3e-3] {
        let run = solve(&text, size);
        check("tube", "inner face, degC", run.celsius("inner"), inner, inner - 20.0, 1e-9);
        check("tube", "outer face, degC", run.celsius("outer"), outer, inner - 20.0, 1e-9);
        check("tube", "point on it, degC", run.celsius("mark"), outer, inner - 20.0, 1e-9);
    }
}

/// The same, radiating to 20 degC: sigma eps (T⁴ - T0⁴) = q at the face, whatever the cells.
#[test]
fn face_of_a_hollow_cylinder_that_radiates() {
    let text = format!("{TUBE}[boundary.walls]\nfaces = [\"tube.outer\"]\nemissivity = 0.7\nsurroundings_temperature = \"20 degC\"\n");
    let q = HEAT / (2.0 * PI * 0.04);
    let outer = (q / (0.7 * 5.670374419e-8) + (20.0 + ZERO_CELSIUS).powi(4)).powf(0.25) - ZERO_CELSIUS;
    for size in [1.0, 8e-3] {
        let run = solve(&text, size);
        check("tube", "face that radiates, degC", run.celsius("outer"), outer, outer - 20.0, 1e-9);
        check("tube", "point on it, degC", run.celsius("mark"), outer, outer - 20.0, 1e-9);
    }
}

/// Conductivity 2 (1 + (T - 20)/200) W/(m K): Kirchhoff's transformation gives the inner face.
#[test]
fn faces_of_a_hollow_cylinder_with_conductivity_of_temperature() {
    let text = TUBE.replace("\"2 W/(m K)\"", "[[\"20 degC\", \"2 W/(m K)\"], [\"420 degC\", \"6 W/(m K)\"]]")
        + "[boundary.air]\nfaces = [\"tube.outer\"]\nfilm = \"50 W/(m2 K)\"\nfluid_temperature = \"20 degC\"\n";
    let rise = HEAT / (2.0 * PI * 0.04 * 50.0);
    let psi = |rise: f64| 2.0 * (rise + rise * rise / 400.0);
    let target = psi(rise) + HEAT * 4f64.ln() / (2.0 * PI);
    // 2 x + x²/200 = target
    let inner = 20.0 + 100.0 * (-2.0 + (4.0 + 4.0 * target / 200.0).sqrt());
    let runs = [30e-3 / 8.0, 30e-3 / 16.0, 30e-3 / 32.0].map(|size| solve(&text, size * 1.000_001));
    let found = |sensor: &str| extrapolate(&[0, 1, 2].map(|i| runs[i].celsius(sensor)), 2.0, 2);
    check("tube", "inner face, k(T), degC", found("inner"), inner, inner - 20.0, 1e-5);
    check("tube", "outer face, k(T), degC", found("outer"), 20.0 + rise, inner - 20.0, 1e-9);
}

/// Two tubes with a contact between: each side of the joint is read where the sensor names its part.
#[test]
fn both_sides_of_a_joint() {
    let text = format!(
        "{TUBE}
        [part.sleeve]
        material = \"metal\"
        cylinder = {{ axis = \"z\", inner = \"40 mm\", outer = \"50 mm\", length = \"20 mm\" }}
        at = [\"0 m\", \"0 m\", \"0 m\"]
        surface = \"none\"
        [contact.fit]
        between = [\"tube\", \"sleeve\"]
        conductance = \"400 W/(m2 K)\"
        [boundary.air]
        faces = [\"sleeve.outer\"]
        temperature = \"20 degC\"
        [sensor.far]
        face = \"sleeve.inner\"
        [sensor.spot]
        point = [\"0 mm\", \"40 mm\", \"7 mm\"]
        in = \"sleeve\"
        [sensor.skin]
        face = \"sleeve.outer\"
        "
    );
    let far = 20.0 + HEAT * 1.25f64.ln() / (2.0 * PI * 2.0);
    let near = far + HEAT / (2.0 * PI * 0.04 * 400.0);
    for size in [1.0, 5e-3] {
        let run = solve(&text, size);
        for (sensor, exact) in [("outer", near), ("mark", near), ("far", far), ("spot", far), ("skin", 20.0)] {
            check("joint", &format!("{sensor}, degC"), run.celsius(sensor), exact, near - 20.0, 1e-9);
        }
    }
    // A bond has one temperature.
    let text = text.replace("conductance = \"400 W/(m2 K)\"", "bonded = true");
    let run = solve(&text, 5e-3);
    for sensor in ["outer", "mark", "far", "spot"] {
        check("bond", &format!("{sensor}, degC"), run.celsius(sensor), far, near - 20.0, 1e-9);
    }
}

const SLAB: &str = r#"
    [material.metal]
    conductivity = "10 W/(m K)"
    [part.slab]
    material = "metal"
    box = ["40 mm", "10 mm", "30 mm"]
    surface = "none"
    [boundary.cold]
    faces = ["slab.-z"]
    temperature = "20 degC"
"#;

/// A film, a flux and radiation on one face: k (T0 - Ts)/L + q = h (Ts - Tf) + eps sigma (Ts⁴ - Ta⁴).
#[test]
fn film_beside_flux_and_radiation() {
    let beside = "[boundary.air]\nfaces = [\"slab.+z\"]\nfilm = \"60 W/(m2 K)\"\nfluid_temperature = \"50 degC\"\n\
                  [boundary.lamp]\nfaces = [\"slab[1].+z\"]\nheat_flux = \"9000 W/m2\"\n[sensor.top]\nface = \"slab.+z\"\n";
    let exact = (20.0 * 10.0 / 0.03 + 9000.0 + 60.0 * 50.0) / (10.0 / 0.03 + 60.0);
    let run = solve(&format!("{SLAB}{beside}"), 1.0);
    check("slab", "film beside flux, degC", run.celsius("top"), exact, exact - 20.0, 1e-9);
    let area = 0.04 * 0.01;
    check("slab", "heat of the flux, W", run.heat_in("lamp"), 9000.0 * area, 9000.0 * area, 1e-12);
    check("slab", "heat of the film, W", run.heat_in("air"), 60.0 * area * (50.0 - exact), 9000.0 * area, 1e-9);
    let walls = "[boundary.walls]\nfaces = [\"slab.+z\"]\nemissivity = 0.8\nsurroundings_temperature = \"0 degC\"\n";
    let run = solve(&format!("{SLAB}{beside}{walls}"), 1.0);
    let ts = run.celsius("top");
    let radiated = 0.8 * 5.670374419e-8 * ((ts + ZERO_CELSIUS).powi(4) - ZERO_CELSIUS.powi(4));
    let open = 10.0 * (20.0 - ts) / 0.03 + 9000.0 + 60.0 * (50.0 - ts) - radiated;
    check("slab", "with radiation: open, W/m2", open, 0.0, 9000.0, 1e-9);
    check("slab", "heat of the radiation, W", run.heat_in("walls"), -radiated * area, 9000.0 * area, 1e-9);
}

/// A strip of a slab is heated, 0 < x < a of b = 40 mm, the far side held: with l = n pi/b
/// T(x, L) = T0 + q a L/(k b) + sum of 2 q sin(l a) tanh(l L) cos(l x)/(k b l²).
#[test]
fn a_flux_on_part_of_a_face() {
    let (a, b, l, k, q) = (0.013, 0.04, 0.03, 10.0, 2e4);
    let text = format!(
        "{SLAB}[boundary.strip]\nfaces = [\"slab.+z\"]\nwithin = {{ x = [\"0 mm\", \"13 mm\"] }}\nheat_flux = \"2e4 W/m2\"\n\
         [sensor.corner]\npoint = [\"0 mm\", \"5 mm\", \"30 mm\"]\nin = \"slab\"\n\
         [sensor.far]\npoint = [\"40 mm\", \"5 mm\", \"30 mm\"]\nin = \"slab\"\n[sensor.mean]\nface = \"slab.+z\"\n"
    );
    let exact = |x: f64| {
        let term = |n: i32| {
            let w = f64::from(n) * PI / b;
            2.0 * q * (w * a).sin() * (w * l).tanh() * (w * x).cos() / (k * b * w * w)
        };
        20.0 + q * a * l / (k * b) + (1..200_000).map(term).sum::<f64>()
    };
    let (corner, far) = (exact(0.0), exact(b));
    let run = solve(&text, 0.4e-3);
    check("strip", "heat, W", run.heat_in("strip"), q * a * 0.01, 1.0, 1e-12);
    check("strip", "mean of the face, degC", run.celsius("mean"), 20.0 + q * a * l / (k * b), corner - 20.0, 1e-9);
    check("strip", "in the corner, degC", run.celsius("corner"), corner, corner - 20.0, 1e-3);
    check("strip", "at the far end, degC", run.celsius("far"), far, corner - 20.0, 1e-3);
}

/// A disc on a plate and on the end of a rod, a range along a tube: the heat is that of the true area.
#[test]
fn areas_of_parts_of_faces() {
    let heat = |text: &str, size: f64| solve(text, size).heat_in("spot");
    let disc = format!(
        "{SLAB}[boundary.spot]\nfaces = [\"slab.+z\"]\nwithin = {{ centre = [\"20 mm\", \"5 mm\", \"30 mm\"], radius = \"4 mm\" }}\nheat_flux = \"1e4 W/m2\"\n"
    );
    let exact = 1e4 * PI * 0.004f64.powi(2);
    for size in [1.0, 2e-3, 0.7e-3] {
        check("disc", "heat, W", heat(&disc, size), exact, exact, if size > 0.1 { 1e-2 } else { 1e-3 });
    }
    let rod = "[material.metal]\nconductivity = \"10 W/(m K)\"\n[part.rod]\nmaterial = \"metal\"\n\
               cylinder = { axis = \"z\", outer = \"20 mm\", length = \"50 mm\" }\nat = [\"0 m\", \"0 m\", \"0 m\"]\nsurface = \"none\"\n\
               [boundary.cold]\nfaces = [\"rod.start\"]\ntemperature = \"20 degC\"\n";
    let end = format!(
        "{rod}[boundary.spot]\nfaces = [\"rod.end\"]\nwithin = {{ centre = [\"0 mm\", \"0 mm\", \"50 mm\"], radius = \"10 mm\" }}\nheat_flux = \"1e4 W/m2\"\n"
    );
    check("disc on a rod", "heat, W", heat(&end, 4e-3), 1e4 * PI * 1e-4, PI, 1e-3);
    let band =
        format!("{rod}[boundary.spot]\nfaces = [\"rod.outer\"]\nwithin = {{ z = [\"10 mm\", \"30 mm\"] }}\nheat_flux = \"1e4 W/m2\"\n");
    let exact = 1e4 * 2.0 * PI * 0.02 * 0.02;
    check("band on a rod", "heat, W", heat(&band, 4e-3), exact, exact, 1e-2);
}

/// What contradicts is refused at its line; what is apart, or adds up, is not.
#[test]
fn contradictions_are_refused() {
    let with = |tables: &str| {
        format!("name = \"slab\"\n{}{tables}", SLAB.replace("metal]", "metal]\ndensity = \"1 kg/m3\"\nspecific_heat = \"1 J/(kg K)\""))
            .parse::<coldplate_describe::machine::Machine>()
    };
    let film = |name: &str, face: &str, within: &str| {
        format!("[boundary.{name}]\nfaces = [\"{face}\"]\n{within}\nfilm = \"10 W/(m2 K)\"\nfluid_temperature = \"20 degC\"\n")
    };
    for (tables, what) in [
        (film("b", "slab.-z", ""), "'cold' and 'b' act on the same face"),
        (film("b", "slab[1].-z", ""), "'cold' and 'b' act on the same face"),
        (film("b", "slab.+z", "") + &film("c", "slab.+z", ""), "two films"),
        (
            film("b", "slab.+z", "within = { x = ['0 mm', '20 mm'] }") + &film("c", "slab.+z", "within = { x = ['19 mm', '30 mm'] }"),
            "two films",
        ),
    ] {
        let error = with(&tables).unwrap_err();
        assert!(format!("{error}").contains(what), "{error}");
        assert!(error.location().line.is_some() && error.remedy().is_some(), "{error}");
    }
    let apart = film("b", "slab.+z", "within = { x = ['0 mm', '20 mm'] }") + &film("c", "slab.+z", "within = { x = ['20 mm', '30 mm'] }");
    with(&apart).unwrap();
    // A face that is covered, and a part of a face beside it.
    let cover = "[part.cover]\nmaterial = \"metal\"\nbox = [\"40 mm\", \"10 mm\", \"5 mm\"]\non = \"slab.+z\"\nsurface = \"none\"\n";
    for (tables, what) in [
        (cover.to_string() + &film("b", "slab.+z", ""), "covered altogether"),
        (film("b", "slab.+z", "within = { x = ['50 mm', '60 mm'] }"), "lies outside its faces"),
    ] {
        let machine = machine(&format!("{SLAB}{tables}"));
        let error = coldplate_solve::meshed::MeshedMachine::new(machine, Some(500)).unwrap_err();
        assert!(format!("{error}").contains(what), "{error}");
        let place = error.location();
        assert!(place.file.is_some() && place.line.is_some() && place.key.is_some() && error.remedy().is_some(), "{error}");
    }
}

/// What a part of a face has left: half of a boundary's face is covered, the other half takes its film.
#[test]
fn the_area_that_remains_is_said() {
    let half = "[part.cover]\nmaterial = \"metal\"\nbox = [\"20 mm\", \"10 mm\", \"5 mm\"]\non = \"slab.+z\"\nalign = \"corner\"\nsurface = \"none\"\n\
                [boundary.air]\nfaces = [\"slab.+z\"]\nfilm = \"60 W/(m2 K)\"\nfluid_temperature = \"50 degC\"\n";
    let run = solve(&format!("{SLAB}{half}"), 3e-3);
    let found = coldplate_solve::meshed::inventory(&run.model, None).unwrap().boundaries;
    let air = found.iter().find(|b| b.name == "air").unwrap();
    check("slab", "area left, m2", air.area, 2e-4, 2e-4, 1e-9);
    check("slab", "covered share", air.covered, 0.5, 1.0, 1e-9);
    assert_eq!((air.faces.join(","), air.prescribes.contains("film")), ("slab.+z".to_string(), true));
}
