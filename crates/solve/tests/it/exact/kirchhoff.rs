//! Conductivity that follows the temperature, by Kirchhoff's transformation: q L is the integral of k from face to face (Carslaw and
//! Jaeger 1959, 2.16), on any mesh.

use crate::bench::{check, solve};

/// A bar from 60 to 20 degC whose k falls by a factor over these 40 K.
fn bar(factor: f64, cells: usize) -> String {
    format!(
        r#"
        [material.falling]
        conductivity = [["20 degC", "100 W/(m K)"], ["60 degC", "{} W/(m K)"]]
        [part.bar]
        material = "falling"
        box = ["0.1 m", "20 mm", "20 mm"]
        surface = "none"
        cells = [{cells}, 1, 1]
        [boundary.hot]
        faces = ["bar.+x"]
        temperature = "60 degC"
        [boundary.cold]
        faces = ["bar.-x"]
        temperature = "20 degC"
        [sensor.middle]
        point = ["50 mm", "10 mm", "10 mm"]
        in = "bar"
    "#,
        100.0 / factor
    )
}

/// Heat through bars whose conductivity falls tenfold, hundredfold and a thousandfold: exact for one cell and for many.
#[test]
fn a_bar_of_falling_conductivity_is_exact_on_any_mesh() {
    for factor in [1.0, 10.0, 100.0, 1000.0] {
        let heat = 4e-4 / 0.1 * 40.0 * 0.5 * (100.0 + 100.0 / factor);
        for cells in [1, 3, 20] {
            let run = solve(&bar(factor, cells), 1.0);
            check("own", &format!("bar of k falling {factor}-fold, {cells} cells, W"), run.heat_in("hot"), heat, heat, 1e-9);
        }
        // In the middle half of the integral is left: with k = 100 (1 - s x), x from 0 at 20 degC to 1 at 60 degC.
        let s = 1.0 - 1.0 / factor;
        let half = 0.5 * (1.0 - s / 2.0);
        let x = if s == 0.0 { 0.5 } else { (1.0 - (1.0 - 2.0 * s * half).sqrt()) / s };
        let run = solve(&bar(factor, 21), 1.0);
        check("own", &format!("its middle, {factor}-fold, degC"), run.celsius("middle"), 20.0 + 40.0 * x, 40.0, 1e-9);
    }
}

/// Two bars of different tables and an interface whose conductance follows the mean of its two faces: against a bisection of the flux
/// with sums over very many pieces.
#[test]
fn an_interface_has_the_temperatures_of_its_faces() {
    let text = r#"
        [material.falling]
        conductivity = [["0 degC", "30 W/(m K)"], ["50 degC", "10 W/(m K)"], ["100 degC", "2 W/(m K)"]]
        [material.rising]
        conductivity = [["0 degC", "5 W/(m K)"], ["100 degC", "45 W/(m K)"]]
        [part.left]
        material = "falling"
        box = ["0.1 m", "20 mm", "20 mm"]
        surface = "none"
        cells = [CELLS, 1, 1]
        [part.right]
        material = "rising"
        box = ["0.06 m", "20 mm", "20 mm"]
        on = "left.+x"
        surface = "none"
        cells = [CELLS, 1, 1]
        [contact.joint]
        between = ["left", "right"]
        temperature_table = [["0 degC", "100 W/(m2 K)"], ["100 degC", "1100 W/(m2 K)"]]
        [boundary.hot]
        faces = ["left.-x"]
        temperature = "100 degC"
        [boundary.cold]
        faces = ["right.+x"]
        temperature = "0 degC"
        [sensor.before]
        face = "left.+x"
    "#;
    // Temperatures at the far end of a bar of many slices, each with the conductivity of its middle.
    let through = |from: f64, flux: f64, length: f64, k: &dyn Fn(f64) -> f64| {
        let slices = 20_000;
        let width = length / f64::from(slices);
        (0..slices).fold(from, |t, _| t - flux * width / k(t - 0.5 * flux * width / k(t)))
    };
    let falling = |t: f64| if t < 50.0 { 30.0 - 0.4 * t.max(0.0) } else { 10.0 - 0.16 * (t.min(100.0) - 50.0) };
    let rising = |t: f64| 5.0 + 0.4 * t.clamp(0.0, 100.0);
    let faces = |flux: f64| [through(100.0, flux, 0.1, &falling), through(0.0, -flux, 0.06, &rising)];
    let (mut low, mut high) = (0.0, 1e5);
    for _ in 0..60 {
        let flux = 0.5 * (low + high);
        let [a, b] = faces(flux);
        let h = 100.0 + 10.0 * (0.5 * (a + b)).clamp(0.0, 100.0);
        if flux < h * (a - b) { low = flux } else { high = flux }
    }
    for cells in ["1", "4", "15"] {
        let run = solve(&text.replace("CELLS", cells), 1.0);
        check("own", &format!("two tables and an interface, {cells} cells, W"), run.contact("joint").0, 4e-4 * low, 4e-4 * low, 1e-7);
        check("own", &format!("its hot face, {cells} cells, degC"), run.celsius("before"), faces(low)[0], 100.0, 1e-6);
    }
}
