//! Two-dimensional conduction in boxes.

use crate::bench::{check, observed_order, solve};

/// V08: NAFEMS T4, two-dimensional conduction with convection (Cameron, Casey and Simpson 1986, test 9(i)).
///
/// 0.6 x 1.0 m, k = 52; bottom held at 100, left adiabatic, right and top film 750 to 0. The flux is
/// singular at the corner (0.6, 0), so the order of convergence is observed, not assumed (Aitken).
#[test]
fn v08_nafems_t4() {
    let text = r#"
        [material.steel]
        conductivity = "52 W/(m K)"
        [part.plate]
        material = "steel"
        box = ["0.6 m", "1 m", "4 mm"]
        surface = "none"
        [boundary.base]
        faces = ["plate.-y"]
        temperature = "100 degC"
        [boundary.air]
        faces = ["plate.+x", "plate.+y"]
        film = "750 W/(m2 K)"
        fluid_temperature = "0 degC"
        [sensor.e]
        point = ["0.6 m", "0.2 m", "2 mm"]
        in = "plate"
        [sensor.left]
        point = ["0 m", "0.5 m", "2 mm"]
        in = "plate"
    "#;
    let runs = [20e-3, 10e-3, 5e-3].map(|size| solve(text, size));
    for (sensor, exact) in [("e", 18.2537565371), ("left", 35.4011539898)] {
        let values = [0, 1, 2].map(|i: usize| runs[i].celsius(sensor));
        let order = observed_order(values, 2.0);
        let limit = values[2] + (values[2] - values[1]) / (2f64.powf(order) - 1.0);
        println!("V08 {sensor}: {values:.5?}, observed order {order:.2}");
        check("V08", &format!("T at {sensor}, degC"), limit, exact, 100.0, 1e-4);
    }
    check("V08", "T at E (NAFEMS prints 18.3), degC", runs[2].celsius("e"), 18.3, 100.0, 1e-3);
}

/// Conduction through a box of three conductivities in each direction: k_d A_d/L_d. Exact on any mesh.
#[test]
fn orthotropic_box() {
    let size = [0.03, 0.05, 0.02];
    let k = [5.0, 50.0, 500.0];
    for (d, name) in ["x", "y", "z"].into_iter().enumerate() {
        let text = format!(
            r#"
        [material.laminate]
        conductivity = ["5 W/(m K)", "50 W/(m K)", "500 W/(m K)"]
        [part.block]
        material = "laminate"
        box = ["30 mm", "50 mm", "20 mm"]
        surface = "none"
        [boundary.hot]
        faces = ["block.-{name}"]
        temperature = "50 degC"
        [boundary.cold]
        faces = ["block.+{name}"]
        temperature = "20 degC"
    "#
        );
        let exact = k[d] * size[(d + 1) % 3] * size[(d + 2) % 3] / size[d];
        let run = solve(&text, 9e-3);
        check("own", &format!("conductance along {name}, W/K"), run.heat_in("hot") / 30.0, exact, exact, 1e-9);
    }
}
