//! Radiation to the chamber, from face to face and from lumped nodes.

use crate::bench::{check, extrapolate, solve};
use std::f64::consts::PI;

/// The Stefan-Boltzmann constant the program uses (CODATA 2018), W/(m² K⁴).
const SIGMA: f64 = 5.670374419e-8;

/// V10: NAFEMS T2, conduction with radiation at one end (Abaqus Benchmarks 4.3.2: 927 K).
///
/// The source takes sigma = 5.67e-8: the emissivity is scaled so that their product is the source's.
/// Linear in x, so exact on any mesh. k = 55.6, and 55.563 as in Cameron et al.
#[test]
fn v10_conduction_with_radiation() {
    for (k, exact) in [(55.6, 927.007606246), (55.563, 926.970745368)] {
        let emissivity = 0.98 * 5.67e-8 / SIGMA;
        let text = format!(
            r#"
        [material.bar]
        conductivity = "{k} W/(m K)"
        [part.bar]
        material = "bar"
        box = ["0.1 m", "10 mm", "10 mm"]
        surface = "none"
        [boundary.hot]
        faces = ["bar.-x"]
        temperature = "1000 K"
        [boundary.end]
        faces = ["bar.+x"]
        emissivity = {emissivity}
        surroundings_temperature = "300 K"
        [sensor.b]
        face = "bar.+x"
    "#
        );
        let run = solve(&text, 20e-3);
        check("V10", &format!("T at B, k = {k}, K"), run.kelvin("b"), exact, 1000.0, 1e-5);
        check("V10", "T at B (NAFEMS prints 927), K", run.kelvin("b"), 927.0, 1000.0, 1e-4);
        if k == 55.6 {
            check("V10", "flux, W/m2", run.heat_in("hot") / 1e-4, 40583.7709271, 40583.7709271, 1e-5);
        }
    }
}

/// V12: insulation tube that radiates outside (FrontISTR issue 723; Incropera and DeWitt p. 689 with a film).
/// With the mistake of Celsius in T⁴ the outer temperature would be 270 degC.
#[test]
fn v12_tube_radiating_outside() {
    let tube = |film: &str| {
        format!(
            r#"
        [chamber]
        temperature = "25 degC"
        [material.insulation]
        conductivity = "0.072 W/(m K)"
        [part.tube]
        material = "insulation"
        cylinder = {{ axis = "z", inner = "85 mm", outer = "110 mm", length = "0.1 m" }}
        at = ["0 m", "0 m", "0 m"]
        surface = {{ emissivity = 0.9, excluded = ["start", "end"] }}
        [boundary.hot]
        faces = ["tube.inner"]
        temperature = "377 degC"
        {film}
        [sensor.skin]
        face = "tube.outer"
    "#
        )
    };
    let air = "[boundary.air]\nfaces = [\"tube.outer\"]\nfilm = \"5.43 W/(m2 K)\"\nfluid_temperature = \"25 degC\"";
    let all = |text: &str| [12.5e-3, 6.25e-3, 3.125e-3].map(|size| solve(text, size * 1.000_001));
    let skin = |runs: &[crate::bench::Solved; 3]| extrapolate(&[0, 1, 2].map(|i: usize| runs[i].celsius("skin")), 2.0, 2);
    let vacuum = all(&tube(""));
    check("V12", "T outer, degC", skin(&vacuum), 108.65728939, 352.0, 1e-4);
    let windy = all(&tube(air));
    check("V12", "T outer with a film, degC", skin(&windy), 83.7907956164, 352.0, 1e-4);
    check("V12", "T outer with a film (printed: 84), degC", skin(&windy), 84.0, 352.0, 1e-3);
    check("V12", "heat per length with a film, W/m", windy[2].heat_in("hot") / 0.1, 514.46758449, 514.46758449, 1e-4);
}

/// V17: thermocouple between a hot gas and a cold wall (Ansys VM107; Chapman art. 13.5: 1000 F).
///
/// h (Tg - T) = eps sigma (T⁴ - Tw⁴) in Btu, h, ft, R. To SI: T[K] = (F + 460)/1.8 (the source's own
/// offset), 1 Btu/(h ft² F) = 5.678263341 W/(m² K); the emissivity is scaled by the source's sigma
/// 1.74e-9 Btu/(h ft² R⁴) against the program's. As a block with faces and as a lumped node.
#[test]
fn v17_thermocouple() {
    const FILM: f64 = 5.678_263_341;
    let (gas, wall) = ((1309.0 + 460.0) / 1.8, (300.0 + 460.0) / 1.8);
    let film = 11.85 * FILM;
    let emissivity = 0.5 * 1.74e-9 * 1.8f64.powi(3) * FILM / SIGMA;
    let text = format!(
        r#"
        [chamber]
        temperature = "{wall} K"
        [material.metal]
        conductivity = "20 W/(m K)"
        [part.bead]
        material = "metal"
        box = ["1 mm", "1 mm", "1 mm"]
        surface = {{ effective_emissivity = {emissivity} }}
        [boundary.gas]
        faces = ["bead.-x", "bead.+x", "bead.-y", "bead.+y", "bead.-z", "bead.+z"]
        film = "{film} W/(m2 K)"
        fluid_temperature = "{gas} K"
        [node.gas]
        temperature = "{gas} K"
        [node.lump]
        capacity = "1 J/K"
        effective_emissivity = {emissivity}
        area = "0.01 m2"
        [contact.film]
        between = ["gas", "lump"]
        conductance = "{film} W/(m2 K)"
        area = "0.01 m2"
        [sensor.bead]
        part = "bead"
        [sensor.lump]
        node = "lump"
    "#
    );
    let run = solve(&text, 1e-3);
    for sensor in ["bead", "lump"] {
        let fahrenheit = run.kelvin(sensor) * 1.8 - 460.0;
        check("V17", &format!("T of the {sensor}, F"), fahrenheit, 999.949989764, 1009.0, 1e-5);
        check("V17", &format!("T of the {sensor} (Ansys prints 1000), F"), fahrenheit, 1000.0, 1009.0, 1e-4);
    }
}

/// V18: concentric grey cylinders (Ansys VM125; Kreith p. 260: 37.0 Btu/h per inch of length).
///
/// Q = A1 sigma (T1⁴ - T2⁴)/[1/e1 + (r1/r2)(1/e2 - 1)]. Lengths in inches are taken as metres and
/// temperatures as T[K] = R/1.8, so Q scales with sigma_si/1.8⁴ over sigma_in. The tubes conduct well
/// and are held on their far sides, so that the facing surfaces are isothermal.
#[test]
fn v18_concentric_cylinders() {
    let (t1, t2) = (1000.0 / 1.8, 460.0 / 1.8);
    let text = format!(
        r#"
        [material.ideal]
        conductivity = "1e6 W/(m K)"
        [part.core]
        material = "ideal"
        cylinder = {{ axis = "z", inner = "0.99 m", outer = "1 m", length = "1 m" }}
        at = ["0 m", "0 m", "0 m"]
        surface = "none"
        [part.shell]
        material = "ideal"
        cylinder = {{ axis = "z", inner = "2 m", outer = "2.01 m", length = "1 m" }}
        at = ["0 m", "0 m", "0 m"]
        surface = "none"
        [radiation_link.gap]
        between = ["core.outer", "shell.inner"]
        view_factor = 1.0
        emissivity = [0.7, 0.5]
        [boundary.hot]
        faces = ["core.inner"]
        temperature = "{t1} K"
        [boundary.cold]
        faces = ["shell.outer"]
        temperature = "{t2} K"
    "#
    );
    let run = solve(&text, 0.3);
    let to_source = 1.19e-11 * 1.8f64.powi(4) / SIGMA;
    check("V18", "heat, Btu/(h in)", run.heat_in("hot") * to_source, 37.0336895449, 37.0336895449, 1e-4);
    check("V18", "heat (Ansys prints 37.0), Btu/(h in)", run.heat_in("hot") * to_source, 37.0, 37.0, 1e-3);
    check("V18", "heat lost by one is won by the other, W", run.heat_in("hot"), -run.heat_in("cold"), run.heat_in("hot"), 1e-8);
}

/// V23: two lumped bodies in contact inside a grey chamber; each sees the chamber alone.
#[test]
fn v23_two_bodies_in_a_chamber() {
    let text = r#"
        [chamber]
        temperature = "23.5 degC"
        wall_emissivity = 0.3
        wall_area = "24 m2"
        [node.motor]
        capacity = "1000 J/K"
        emissivity = 0.55
        area = "0.05 m2"
        [node.bed]
        capacity = "10000 J/K"
        emissivity = 0.55
        area = "0.8 m2"
        [contact.foot]
        between = ["motor", "bed"]
        conductance = "500 W/(m2 K)"
        area = "0.01 m2"
        [source.loss]
        in = ["motor"]
        power = "20 W"
        [sensor.motor]
        node = "motor"
        [sensor.bed]
        node = "bed"
    "#;
    let run = solve(text, 0.1);
    let span = 34.1558044867 - 23.5;
    check("V23", "T1, degC", run.celsius("motor"), 34.1558044867, span, 1e-5);
    check("V23", "T2, degC", run.celsius("bed"), 30.5209968918, span, 1e-5);
    check("V23", "heat through the contact, W", run.contact("foot").0, 18.1740379745, 20.0, 1e-5);
}

/// V25: parallel plates face to face, and a small body in a chamber.
#[test]
fn v25_plates_and_body_in_chamber() {
    let text = r#"
        [chamber]
        temperature = "23.5 degC"
        wall_emissivity = 0.3
        wall_area = "96 m2"
        [material.ideal]
        conductivity = "1e6 W/(m K)"
        [part.warm]
        material = "ideal"
        box = ["10 mm", "1 m", "1 m"]
        surface = "none"
        [part.cool]
        material = "ideal"
        box = ["10 mm", "1 m", "1 m"]
        at = ["15 mm", "0 m", "0 m"]
        surface = "none"
        [radiation_link.gap]
        between = ["warm.+x", "cool.-x"]
        view_factor = 1.0
        emissivity = [0.55, 0.3]
        [boundary.warm]
        faces = ["warm.-x"]
        temperature = "42.2 degC"
        [boundary.cool]
        faces = ["cool.+x"]
        temperature = "23.5 degC"
        [node.body]
        temperature = "42.2 degC"
        emissivity = 0.55
        area = "0.1525 m2"
    "#;
    let run = solve(text, 0.2);
    check("V25", "flux between plates, W/m2", run.heat_in("warm"), 29.3005837661, 29.3005837661, 1e-6);
    check("V25", "heat of the body, W", -run.state.solution.balance.radiation, 10.1819502253, 10.1819502253, 1e-6);
}

/// A box that conducts well and radiates from all its faces to a grey chamber (V25's body as a part): its faces' area
/// is that of V25, its heat the formula's at its own temperature.
#[test]
fn box_in_chamber() {
    // 2 (ab + bc + ca) = 0.1525 m2 for 0.1 x 0.15 x c.
    let c = (0.1525 / 2.0 - 0.1 * 0.15) / 0.25;
    let text = format!(
        r#"
        [chamber]
        temperature = "23.5 degC"
        wall_emissivity = 0.3
        wall_area = "96 m2"
        [material.ideal]
        conductivity = "1e7 W/(m K)"
        [part.body]
        material = "ideal"
        box = ["0.1 m", "0.15 m", "{c} m"]
        surface = {{ emissivity = 0.55 }}
        [source.heat]
        in = ["body"]
        power = "10.1819502253 W"
        [sensor.body]
        part = "body"
    "#
    );
    let run = solve(&text, 0.03);
    check("V25", "T of a box with that heat, degC", run.celsius("body"), 42.2, 18.7, 1e-6);
}

/// A tube inside a tube of other radius, both with conduction of their own: the surface temperatures
/// follow from two conductions and one radiative exchange in series (closed form by the fluxes).
#[test]
fn radiation_gap_between_conducting_tubes() {
    let (r, length, k): ([f64; 4], f64, f64) = ([0.01, 0.02, 0.03, 0.04], 0.05, 2.0);
    let (th, tc, e1, e2): (f64, f64, f64, f64) = (700.0, 300.0, 0.8, 0.6);
    // Heat by bisection: T1 = th - Q ln(r1/r0)/(2 pi k L), T2 = tc + Q ln(r3/r2)/(2 pi k L), Q = GR sigma (T1^4 - T2^4).
    let conduction = ((r[1] / r[0]).ln() + (r[3] / r[2]).ln()) / (2.0 * PI * k * length);
    let (mut low, mut high) = (0.0, (th - tc) / conduction);
    let area = [2.0 * PI * r[1] * length, 2.0 * PI * r[2] * length];
    let gr = 1.0 / ((1.0 - e1) / (e1 * area[0]) + 1.0 / area[0] + (1.0 - e2) / (e2 * area[1]));
    for _ in 0..200 {
        let q: f64 = f64::midpoint(low, high);
        let t1 = th - q * (r[1] / r[0]).ln() / (2.0 * PI * k * length);
        let t2 = tc + q * (r[3] / r[2]).ln() / (2.0 * PI * k * length);
        if gr * SIGMA * (t1.powi(4) - t2.powi(4)) > q { low = q } else { high = q }
    }
    let text = format!(
        r#"
        [material.ceramic]
        conductivity = "{k} W/(m K)"
        [part.core]
        material = "ceramic"
        cylinder = {{ axis = "z", inner = "10 mm", outer = "20 mm", length = "50 mm" }}
        at = ["0 m", "0 m", "0 m"]
        surface = "none"
        [part.shell]
        material = "ceramic"
        cylinder = {{ axis = "z", inner = "30 mm", outer = "40 mm", length = "50 mm" }}
        at = ["0 m", "0 m", "0 m"]
        surface = "none"
        [radiation_link.gap]
        between = ["core.outer", "shell.inner"]
        view_factor = 1.0
        emissivity = [{e1}, {e2}]
        [boundary.hot]
        faces = ["core.inner"]
        temperature = "{th} K"
        [boundary.cold]
        faces = ["shell.outer"]
        temperature = "{tc} K"
    "#
    );
    let run = solve(&text, 5e-3);
    check("own", "heat across a radiating gap, W", run.heat_in("hot"), low, low, 1e-9);
}
