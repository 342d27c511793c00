//! One-dimensional conduction in boxes: sources, films, contacts, conductivity that depends on temperature.

use crate::bench::{check, extrapolate, solve};

/// V01: slab of thickness L with a uniform source q and films on both faces.
///
/// -k T'' = q; k T'(0) = h_l (T(0) - T_l); -k T'(L) = h_r (T(L) - T_r). Reference: direct integration.
#[test]
fn v01_slab_with_source_and_two_films() {
    // 2e5 W/m3 in 0.05 m x 1 mm x 1 mm. The section is small so that the cells are many along x and two across.
    let text = |n: usize| {
        format!(
            r#"
        [material.steel]
        conductivity = "16.3 W/(m K)"
        [part.slab]
        material = "steel"
        box = ["50 mm", "1 mm", "1 mm"]
        surface = "none"
        cells = [{n}, 2, 2]
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
        [sensor.left]
        face = "slab.-x"
        [sensor.right]
        face = "slab.+x"
        [sensor.mean]
        part = "slab"
        [sensor.hottest]
        point = ["44.1483113069 mm", "0.5 mm", "0.5 mm"]
        in = "slab"
    "#
        )
    };
    let area = 1e-6;
    let runs = [50, 100].map(|n| solve(&text(n), 1.0));
    let both = |f: &dyn Fn(usize) -> f64| extrapolate(&[f(0), f(1)], 2.0, 2);
    let span = 49.6168299906 - 20.0;
    check("V01", "T at x = 0, degC", both(&|i| runs[i].celsius("left")), 37.6593245228, span, 1e-6);
    check("V01", "T at x = L, degC", both(&|i| runs[i].celsius("right")), 49.4067547724, span, 1e-6);
    check("V01", "mean T, degC", both(&|i| runs[i].celsius("mean")), 46.0892768664, span, 1e-6);
    check("V01", "flux out at x = 0, W/m2", both(&|i| -runs[i].heat_in("left") / area), 8829.66226138, 1e4, 1e-6);
    check("V01", "flux out at x = L, W/m2", both(&|i| -runs[i].heat_in("right") / area), 1170.33773862, 1e4, 1e-6);
    // The largest temperature lies at an arbitrary place in its cell, so that nothing can be extrapolated: one fine mesh.
    let fine = solve(&text(1000), 1.0);
    check("V01", "largest T, degC", fine.celsius("hottest"), 49.6168299906, span, 1e-6);
}

/// V02: two slabs in series between films (Ansys VM92; Kreith ex. 2-5). Piecewise linear, so exact on any mesh.
///
/// Numbers of the source (Btu, h, ft, F) taken as SI: the problem is linear and has no units of its own.
#[test]
fn v02_composite_wall() {
    let text = r#"
        [material.fire_brick]
        conductivity = "0.8 W/(m K)"
        [material.insulation]
        conductivity = "0.1 W/(m K)"
        [part.inner]
        material = "fire_brick"
        box = ["0.75 m", "1 m", "1 m"]
        surface = "none"
        [part.outer]
        material = "insulation"
        box = ["0.41666666666666669 m", "1 m", "1 m"]
        on = "inner.+x"
        surface = "none"
        [contact.bond]
        between = ["inner", "outer"]
        bonded = true
        [boundary.gas]
        faces = ["inner.-x"]
        film = "12 W/(m2 K)"
        fluid_temperature = "3000 degC"
        [boundary.air]
        faces = ["outer.+x"]
        film = "2 W/(m2 K)"
        fluid_temperature = "80 degC"
        [sensor.hot]
        face = "inner.-x"
        [sensor.interface]
        face = "inner.+x"
        [sensor.cold]
        face = "outer.+x"
    "#;
    let run = solve(text, 0.3);
    check("V02", "heat, W", run.heat_in("gas"), 513.406593407, 513.406593407, 1e-6);
    check("V02", "heat (Ansys prints 513)", run.heat_in("gas"), 513.0, 513.0, 1e-3);
    check("V02", "T inner, degC", run.celsius("hot"), 2957.21611722, 2920.0, 1e-6);
    check("V02", "T interface, degC", run.celsius("interface"), 2475.8974359, 2920.0, 1e-6);
    check("V02", "T outer, degC", run.celsius("cold"), 336.703296703, 2920.0, 1e-6);
}

/// V03: slab with k = k0 + k1 T (Ansys VM93; Kreith ex. 2-2). Numbers of the source taken as SI, F as degC.
///
/// Kirchhoff: q L = k0 (T1 - T2) + k1 (T1² - T2²)/2.
#[test]
fn v03_slab_with_conductivity_of_temperature() {
    // k0 + k1 T at 100 and 300: linear between, as the law is.
    let text = r#"
        [material.brick]
        conductivity = [["100 degC", "0.0341 W/(m K)"], ["300 degC", "0.0403 W/(m K)"]]
        [part.wall]
        material = "brick"
        box = ["0.25 m", "10 mm", "10 mm"]
        surface = "none"
        [boundary.hot]
        faces = ["wall.-x"]
        temperature = "300 degC"
        [boundary.cold]
        faces = ["wall.+x"]
        temperature = "100 degC"
        [sensor.middle]
        point = ["125 mm", "5 mm", "5 mm"]
        in = "wall"
    "#;
    let runs = [5e-3, 2.5e-3, 1.25e-3].map(|size| solve(text, size));
    let flux = extrapolate(&[0, 1, 2].map(|i: usize| runs[i].heat_in("hot") / 1e-4), 2.0, 2);
    let middle = extrapolate(&[0, 1, 2].map(|i: usize| runs[i].celsius("middle")), 2.0, 2);
    check("V03", "flux, W/m2", flux, 29.76, 29.76, 1e-6);
    check("V03", "T in the middle, degC", middle, 204.159457879, 200.0, 1e-6);
}

/// V14: straight fin with a convecting tip (Incropera table 3.4, case A).
///
/// The reference is one-dimensional: theta/theta_b = [cosh m(L-x) + (h/mk) sinh m(L-x)]/[cosh mL + (h/mk) sinh mL].
/// So the conductivity across the fin is made large, which makes each section isothermal, as the theory
/// assumes; with the same conductivity in all directions the two-dimensional fin differs by Bi/3 = 0.2 % in h.
#[test]
fn v14_fin_with_convecting_tip() {
    let fin = |across: &str| {
        format!(
            r#"
        [material.steel]
        conductivity = ["16.3 W/(m K)", "16.3 W/(m K)", "{across} W/(m K)"]
        [part.fin]
        material = "steel"
        box = ["100 mm", "50 mm", "5 mm"]
        surface = "none"
        [boundary.base]
        faces = ["fin.-x"]
        temperature = "60 degC"
        [boundary.air]
        faces = ["fin.+x", "fin.-z", "fin.+z"]
        film = "40 W/(m2 K)"
        fluid_temperature = "20 degC"
        [sensor.tip]
        face = "fin.+x"
        [sensor.middle]
        point = ["50 mm", "25 mm", "2.5 mm"]
        in = "fin"
    "#
        )
    };
    let runs = [5e-3, 2.5e-3, 1.25e-3].map(|size| solve(&fin("1e7"), size));
    let all = |f: &dyn Fn(usize) -> f64| extrapolate(&[f(0), f(1), f(2)], 2.0, 2);
    check("V14", "T tip, degC", all(&|i| runs[i].celsius("tip")), 23.2282900037, 40.0, 2e-4);
    check("V14", "T at L/2, degC", all(&|i| runs[i].celsius("middle")), 28.6478637364, 40.0, 2e-4);
    let base = all(&|i| runs[i].heat_in("base") / (0.05 * 0.005));
    check("V14", "flux at the base, W/m2", base, 20361.2046509, 20361.2046509, 2e-4);
    let plain = solve(&fin("16.3"), 1.25e-3);
    check("V14", "T tip, isotropic 2-D fin, degC", plain.celsius("tip"), 23.2282900037, 40.0, 2e-3);
}

/// V15: two slabs and a contact of 80 W/(m² K) between (Code_Aster V4.23.100, TTLP100). Exact on any mesh.
#[test]
fn v15_contact_jump() {
    let text = r#"
        [material.steel]
        conductivity = "40 W/(m K)"
        [part.left]
        material = "steel"
        box = ["0.495 m", "0.1 m", "0.1 m"]
        surface = "none"
        [part.right]
        material = "steel"
        box = ["0.495 m", "0.1 m", "0.1 m"]
        on = "left.+x"
        surface = "none"
        [contact.gap]
        between = ["left", "right"]
        conductance = "80 W/(m2 K)"
        [boundary.cold]
        faces = ["left.-x"]
        temperature = "100 degC"
        [boundary.hot]
        faces = ["right.+x"]
        temperature = "300 degC"
        [sensor.a]
        point = ["0.25 m", "0.05 m", "0.05 m"]
        in = "left"
        [sensor.b]
        face = "left.+x"
        [sensor.c]
        face = "right.-x"
        [sensor.d]
        point = ["0.245 m", "0.05 m", "0.05 m"]
        in = "right"
    "#;
    // The right slab stands 0.01 m nearer than in the source, whose gap has a width: x = 0.75 there is 0.74 here.
    for size in [0.2, 0.06] {
        let run = solve(text, size);
        check("V15", "flux, W/m2", run.contact("gap").0 / -0.01, 5369.12751678, 5369.12751678, 1e-8);
        for (sensor, exact) in [("a", 133.55704698), ("b", 166.44295302), ("c", 233.55704698), ("d", 266.44295302)] {
            check("V15", &format!("T at {sensor}, degC"), run.celsius(sensor), exact, 200.0, 1e-8);
        }
    }
}
