//! Radial conduction in tubes, and conduction along and around them.

use crate::bench::{check, extrapolate, solve};
use std::f64::consts::PI;

/// Radii of V04, m.
const R1: f64 = 0.041_666_666_666_7;
const R2: f64 = 0.083_333_333_333_3;

/// A tube of V04 with one of two materials, held at 100 degC inside and 0 degC outside; sensors at
/// r_i = r1 + i (r2 - r1)/5.
fn tube(material: &str) -> String {
    let mut text = format!(
        r#"
        [material.constant]
        conductivity = "50 W/(m K)"
        [material.variable]
        conductivity = [["0 degC", "50 W/(m K)"], ["100 degC", "100 W/(m K)"]]
        [part.tube]
        material = "{material}"
        cylinder = {{ axis = "z", inner = "{R1} m", outer = "{R2} m", length = "20 mm" }}
        at = ["0 m", "0 m", "0 m"]
        surface = "none"
        [boundary.hot]
        faces = ["tube.inner"]
        temperature = "100 degC"
        [boundary.cold]
        faces = ["tube.outer"]
        temperature = "0 degC"
    "#
    );
    for i in 1..=4 {
        // In different directions: the solution must not depend on the angle.
        let (r, angle) = (R1 + f64::from(i) * (R2 - R1) / 5.0, 0.3 + 1.7 * f64::from(i));
        let (x, y) = (r * angle.cos(), r * angle.sin());
        text += &format!("[sensor.t{i}]\npoint = [\"{x} m\", \"{y} m\", \"10 mm\"]\nin = \"tube\"\n");
    }
    text
}

/// V04: hollow cylinder with k = 50 and with k = 50 + 0.5 T (Ansys VM102; Schneider art. 7-9).
///
/// Kirchhoff: Q/L = 2 pi [k0 (T1 - T2) + k1 (T1² - T2²)/2]/ln(r2/r1). Numbers of the source taken as SI.
#[test]
fn v04_hollow_cylinder() {
    let cases = [
        ("constant", 45323.6014183, [73.6965594166, 51.457317283, 32.1928094887, 15.2003093445]),
        ("variable", 67985.4021274, [79.189753683, 59.4904234896, 40.2064294054, 20.6652095815]),
    ];
    for (material, heat, temperatures) in cases {
        // 10, 20, 40 cells in r, so that the radii read lie on cell borders on every mesh.
        let runs = [10.0, 20.0, 40.0].map(|n: f64| solve(&tube(material), (R2 - R1) / n * 1.000_001));
        let all = |f: &dyn Fn(usize) -> f64| extrapolate(&[f(0), f(1), f(2)], 2.0, 2);
        check("V04", &format!("heat per length, k {material}, W/m"), all(&|i| runs[i].heat_in("hot") / 0.02), heat, heat, 1e-5);
        for (i, exact) in temperatures.into_iter().enumerate() {
            let found = all(&|run| runs[run].celsius(&format!("t{}", i + 1)));
            check("V04", &format!("T at r{}, k {material}, degC", i + 1), found, exact, 100.0, 1e-5);
        }
    }
    // Where the conductivity is constant the scheme is exact in r: two cells give the heat.
    let coarse = solve(&tube("constant"), 0.05);
    check("V04", "heat per length on two cells, W/m", coarse.heat_in("hot") / 0.02, 45323.6014183, 45323.6014183, 1e-9);
}

/// V05: insulated pipe with films inside and outside (Ansys VM161; Kreith ex. 2-7). Numbers of the source taken as SI.
#[test]
fn v05_insulated_pipe() {
    let text = |n: usize| {
        format!(
            r#"
        [material.steel]
        conductivity = "25 W/(m K)"
        [material.insulation]
        conductivity = "0.11 W/(m K)"
        [part.pipe]
        material = "steel"
        cylinder = {{ axis = "x", inner = "0.12791666 m", outer = "0.14583333 m", length = "1 m" }}
        cells = [{n}, 4, 2]
        at = ["0 m", "0 m", "0 m"]
        surface = "none"
        [part.cover]
        material = "insulation"
        cylinder = {{ axis = "x", inner = "0.14583333 m", outer = "0.1875 m", length = "1 m" }}
        cells = [{n}, 4, 2]
        at = ["0 m", "0 m", "0 m"]
        surface = "none"
        [contact.fit]
        between = ["pipe", "cover"]
        bonded = true
        [boundary.steam]
        faces = ["pipe.inner"]
        film = "40 W/(m2 K)"
        fluid_temperature = "300 degC"
        [boundary.air]
        faces = ["cover.outer"]
        film = "4 W/(m2 K)"
        fluid_temperature = "80 degC"
        [sensor.bore]
        face = "pipe.inner"
        [sensor.skin]
        face = "cover.outer"
    "#
        )
    };
    let runs = [4, 8, 16].map(|n| solve(&text(n), 1.0));
    let all = |f: &dyn Fn(usize) -> f64| extrapolate(&[f(0), f(1), f(2)], 2.0, 2);
    check("V05", "heat, W", runs[0].heat_in("steam"), 361.982659648, 361.982659648, 1e-5);
    check("V05", "heat (Ansys prints 362)", runs[0].heat_in("steam"), 362.0, 362.0, 1e-3);
    check("V05", "T at r1, degC", all(&|i| runs[i].celsius("bore")), 288.74045617, 220.0, 1e-5);
    check("V05", "T at r3, degC", all(&|i| runs[i].celsius("skin")), 156.815106129, 220.0, 1e-5);
}

/// Conduction through a part of a turn in each of its three directions with three conductivities:
/// radial k_r theta L/ln(r2/r1), around k_t L ln(r2/r1)/theta, along k_s theta (r2² - r1²)/2/L. Exact on any mesh.
#[test]
fn orthotropic_part_of_a_turn() {
    let (r1, r2, length, angle) = (0.03, 0.05, 0.04, 2.0 * PI / 3.0);
    let log = f64::ln(r2 / r1);
    let exact = [
        ("inner", "outer", 10.0 * angle * length / log),
        ("cut1", "cut2", 30.0 * length * log / angle),
        ("start", "end", 90.0 * angle * (r2 * r2 - r1 * r1) / 2.0 / length),
    ];
    for (from, to, conductance) in exact {
        let text = format!(
            r#"
        [material.wound]
        conductivity = ["10 W/(m K)", "30 W/(m K)", "90 W/(m K)"]
        [part.sector]
        material = "wound"
        cylinder = {{ axis = "y", inner = "{r1} m", outer = "{r2} m", length = "{length} m", turn = ["30 deg", "150 deg"] }}
        at = ["0 m", "0 m", "0 m"]
        surface = "none"
        [boundary.hot]
        faces = ["sector.{from}"]
        temperature = "50 degC"
        [boundary.cold]
        faces = ["sector.{to}"]
        temperature = "20 degC"
    "#
        );
        let run = solve(&text, 9e-3);
        let found = run.heat_in("hot") / 30.0;
        check("own", &format!("conductance {from} to {to}, W/K"), found, conductance, conductance, 1e-9);
    }
}

/// A solid rod with a uniform source and a film on its side: T(0) - T(R) = q R²/4k, T(R) = T_f + q R/2h.
#[test]
fn solid_rod_with_source() {
    let (radius, length, power, k, h): (f64, f64, f64, f64, f64) = (0.02, 0.03, 40.0, 16.3, 200.0);
    let text = format!(
        r#"
        [material.steel]
        conductivity = "{k} W/(m K)"
        [part.rod]
        material = "steel"
        cylinder = {{ axis = "z", outer = "{radius} m", length = "{length} m" }}
        at = ["0 m", "0 m", "0 m"]
        surface = "none"
        [source.heat]
        in = ["rod"]
        power = "{power} W"
        [boundary.air]
        faces = ["rod.outer"]
        film = "{h} W/(m2 K)"
        fluid_temperature = "20 degC"
        [sensor.axis]
        point = ["0 m", "0 m", "15 mm"]
        in = "rod"
        [sensor.skin]
        face = "rod.outer"
        [sensor.mean]
        part = "rod"
    "#
    );
    let q = power / (PI * radius * radius * length);
    let skin = 20.0 + q * radius / (2.0 * h);
    let rise = q * radius * radius / (4.0 * k);
    let runs = [4e-3, 2e-3, 1e-3].map(|size| solve(&text, size));
    let all = |f: &dyn Fn(usize) -> f64| extrapolate(&[f(0), f(1), f(2)], 2.0, 2);
    check("own", "rod: T on the side, degC", all(&|i| runs[i].celsius("skin")), skin, rise, 1e-3);
    check("own", "rod: T on the axis, degC", all(&|i| runs[i].celsius("axis")), skin + rise, rise, 1e-3);
    check("own", "rod: mean T, degC", all(&|i| runs[i].celsius("mean")), skin + rise / 2.0, rise, 1e-3);
}
