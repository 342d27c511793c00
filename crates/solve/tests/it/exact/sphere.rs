//! Balls and spherical shells: conduction in r alone.

use crate::bench::{Solved, check, extrapolate, solve};
use std::f64::consts::PI;

/// V07a: a ball with a uniform source and a film: T(R) = T_f + q R/3h, T(0) - T(R) = q R²/6k.
fn ball(cells: usize) -> Solved {
    let power = 1e5 * 4.0 / 3.0 * PI * 0.05f64.powi(3);
    solve(
        &format!(
            r#"
        [material.steel]
        conductivity = "16.3 W/(m K)"
        [part.ball]
        material = "steel"
        sphere = {{ outer = "50 mm" }}
        cells = [{cells}, 0, 0]
        at = ["0.3 m", "-0.2 m", "0.1 m"]
        surface = "none"
        [source.heat]
        in = ["ball"]
        power = "{power} W"
        [boundary.air]
        faces = ["ball.outer"]
        film = "25 W/(m2 K)"
        fluid_temperature = "20 degC"
        [sensor.skin]
        face = "ball.outer"
        [sensor.centre]
        point = ["0 mm", "0 mm", "0 mm"]
        in = "ball"
        [sensor.half]
        point = ["0.315 m", "-0.18 m", "0.1 m"]
        coordinates = "machine"
        in = "ball"
        [sensor.mean]
        part = "ball"
    "#
        ),
        1.0,
    )
}

#[test]
fn v07a_solid_sphere_with_source() {
    let (surface, centre) = (86.6666666667, 89.2229038855);
    let rise = centre - surface;
    for cells in [1, 2, 7, 40] {
        let run = ball(cells);
        check("V07", "ball: heat, W", run.heat_in("air"), -1e5 * 4.0 / 3.0 * PI * 0.05f64.powi(3), 52.36, 1e-9);
        if cells > 1 {
            // The scheme's lengths are those of this field: two cells give it everywhere.
            check("V07", "ball: T on the surface, degC", run.celsius("skin"), surface, rise, 1e-9);
            check("V07", "ball: T in the centre, degC", run.celsius("centre"), centre, rise, 1e-9);
            check("own", "ball: T at half the radius, degC", run.celsius("half"), centre - rise / 4.0, rise, 1e-9);
        }
        // Mean of r² over a ball: 3 R²/5.
        check("own", "ball: mean T, degC", run.celsius("mean"), centre - 0.6 * rise, rise, 1e-9);
    }
}

/// V07b: a shell held inside and with a film outside: Q = (Ti - Tf)/[(1/Ri - 1/R)/4 pi k + 1/(4 pi R² h)].
#[test]
fn v07b_hollow_sphere() {
    for cells in [2, 5, 30] {
        let run = solve(
            &format!(
                r#"
        [material.steel]
        conductivity = "16.3 W/(m K)"
        [part.shell]
        material = "steel"
        sphere = {{ inner_diameter = "40 mm", outer_diameter = "100 mm" }}
        cells = [{cells}, 1, 1]
        surface = "none"
        [boundary.hot]
        faces = ["shell.inner"]
        temperature = "100 degC"
        [boundary.air]
        faces = ["shell.outer"]
        film = "25 W/(m2 K)"
        fluid_temperature = "20 degC"
        [sensor.skin]
        face = "shell.outer"
        [sensor.within]
        point = ["0 mm", "24 mm", "18 mm"]
        in = "shell"
    "#
            ),
            1.0,
        );
        check("V07", "shell: heat, W", run.heat_in("hot"), 56.3498874867, 56.3498874867, 1e-9);
        check("V07", "shell: T on the surface, degC", run.celsius("skin"), 91.7469050894, 80.0, 1e-9);
        // At r = 30 mm: T = Ti - Q (1/Ri - 1/r)/4 pi k.
        let within = 100.0 - 56.3498874867 * (50.0 - 1.0 / 0.03) / (4.0 * PI * 16.3);
        check("own", "shell: T at 30 mm, degC", run.celsius("within"), within, 80.0, 1e-9);
    }
}

/// Three concentric layers, bonded, with a contact and with a film: resistances in series.
#[test]
fn concentric_spheres_in_series() {
    let run = solve(
        r#"
        [material.a]
        conductivity = "16.3 W/(m K)"
        [material.b]
        conductivity = "0.4 W/(m K)"
        [part.layers]
        material = "b"
        blocks = [{ sphere = { inner = "30 mm", outer = "40 mm" } }, { sphere = { inner = "40 mm", outer = "45 mm" } }]
        at = ["1 m", "0 m", "0 m"]
        surface = "none"
        [part.core]
        material = "a"
        sphere = { inner = "20 mm", outer = "30 mm" }
        at = ["1 m", "0 m", "0 m"]
        surface = "none"
        [contact.seat]
        between = ["core.outer", "layers"]
        conductance = "300 W/(m2 K)"
        [node.sink]
        temperature = "20 degC"
        [contact.cooling]
        between = ["sink", "layers[2].outer"]
        total_conductance = "2 W/K"
        [boundary.hot]
        faces = ["core.inner"]
        temperature = "100 degC"
    "#,
        7e-3,
    );
    let shell = |ri: f64, ro: f64, k: f64| (1.0 / ri - 1.0 / ro) / (4.0 * PI * k);
    let seat = 4.0 * PI * 0.03 * 0.03;
    let exact = 80.0 / (shell(0.02, 0.03, 16.3) + 1.0 / (300.0 * seat) + shell(0.03, 0.045, 0.4) + 0.5);
    check("own", "concentric shells: heat, W", run.heat_in("hot"), exact, exact, 1e-9);
    let (heat, area) = run.contact("seat");
    check("own", "concentric shells: heat through the contact, W", heat, exact, exact, 1e-9);
    check("own", "concentric shells: contact area, m2", area, seat, seat, 1e-12);
}

/// k(T) = 40 + 0.4 (T - 273.15) in a shell held on both sides; Kirchhoff: Q (1/ri - 1/ro)/4 pi = mean k times the drop.
#[test]
fn shell_with_conductivity_of_temperature() {
    let runs = [4, 8, 16].map(|cells| {
        solve(
            &format!(
                r#"
        [material.warm]
        conductivity = [["0 degC", "40 W/(m K)"], ["200 degC", "120 W/(m K)"]]
        [part.shell]
        material = "warm"
        sphere = {{ inner = "20 mm", outer = "60 mm" }}
        cells = [{cells}, 0, 0]
        surface = "none"
        [boundary.hot]
        faces = ["shell.inner"]
        temperature = "160 degC"
        [boundary.cold]
        faces = ["shell.outer"]
        temperature = "20 degC"
    "#
            ),
            1.0,
        )
    });
    let exact = 4.0 * PI * (40.0 + 0.4 * 90.0) * 140.0 / (1.0 / 0.02 - 1.0 / 0.06);
    let found = extrapolate(&runs.map(|run| run.heat_in("hot")), 2.0, 2);
    check("own", "shell with k(T): heat, W", found, exact, exact, 1e-5);
}
