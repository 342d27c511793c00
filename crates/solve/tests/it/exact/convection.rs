//! Free convection at faces and nodes, against balances solved by hand.

use crate::bench::{check, solve};

/// The law itself, written down once more: Churchill and Chu for a vertical plate, air of constant properties at 300 K would not
/// do, so the properties are the program's own at the film temperature; what is tested is the balance.
fn film(shape: &str, length: f64, surface: f64, air: f64) -> f64 {
    use coldplate_physics::convection::{BodyShape, FreeConvection, Gas};
    let shape = BodyShape::ALL[BodyShape::NAMES.iter().position(|name| *name == shape).unwrap()];
    let [k, mu, cp] = Gas::Air.at(0.5 * (surface + air));
    let density = 101_325.0 * 0.028_965_46 / (8.314_462_618 * 0.5 * (surface + air));
    let rayleigh = 9.806_65 * (surface - air).abs() / (0.5 * (surface + air)) * length.powi(3) * density * density * cp / (mu * k);
    let law = FreeConvection { shape, length, gas: Gas::Air, pressure: 101_325.0 };
    assert!((law.rayleigh(surface, air) / rayleigh - 1.0).abs() < 1e-12);
    shape.nusselt(rayleigh, mu * cp / k, surface > air) * k / length
}

/// The surface temperature at which a slab (k, thickness) passes on what it gives to the air: bisection.
fn surface(shape: &str, length: f64, hot: f64, air: f64, inward: f64) -> f64 {
    let (mut low, mut high) = (hot.min(air), hot.max(air));
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        let excess = inward * (hot - middle) - film(shape, length, middle, air) * (middle - air);
        if excess > 0.0 { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

/// A slab of k = 0.2 W/(m K) and 20 mm, held on one face, in air on the other: k/L (Th - Ts) = h(Ts) (Ts - T).
#[test]
fn a_slab_in_a_room() {
    for (shape, length, hot) in
        [("vertical_plate", 0.1, 80.0), ("facing_up", 0.05, 80.0), ("facing_down", 0.05, 80.0), ("facing_up", 0.05, 0.0)]
    {
        let text = format!(
            r#"
        [material.board]
        conductivity = "0.2 W/(m K)"
        [part.slab]
        material = "board"
        box = ["0.1 m", "0.1 m", "20 mm"]
        surface = "none"
        [boundary.held]
        faces = ["slab.-z"]
        temperature = "{hot} degC"
        [boundary.room]
        faces = ["slab.+z"]
        free_convection = "{shape}"
        length = "{length} m"
        fluid_temperature = "20 degC"
        [sensor.face]
        face = "slab.+z"
        "#
        );
        let run = solve(&text, 5e-3);
        let exact = surface(shape, length, hot + 273.15, 293.15, 0.2 / 0.02);
        let heat = 0.2 / 0.02 * 0.01 * (hot + 273.15 - exact);
        check("own", &format!("heat into air, {shape} from {hot} degC, W"), -run.heat_in("room"), heat, heat.abs(), 1e-9);
    }
}

/// A lumped node of 30 W and 0.05 m2, a horizontal cylinder of 60 mm: h(T) A (T - T_air) = P, the air as warm as the surroundings.
#[test]
fn a_lumped_node_in_a_room() {
    let run = solve(
        r#"
        [node.motor]
        capacity = "2 kJ/K"
        [source.loss]
        in = "motor"
        power = "30 W"
        [boundary.room]
        node = "motor"
        area = "0.05 m2"
        free_convection = "horizontal_cylinder"
        length = "60 mm"
        [sensor.motor]
        node = "motor"
    "#,
        5e-3,
    );
    let (mut low, mut high) = (293.15, 600.0);
    for _ in 0..200 {
        let middle: f64 = 0.5 * (low + high);
        if film("horizontal_cylinder", 0.06, middle, 293.15) * 0.05 * (middle - 293.15) < 30.0 { low = middle } else { high = middle }
    }
    check("own", "motor in air, K", run.kelvin("motor"), low, low - 293.15, 1e-9);
    assert!(run.model.notes(&run.state).is_empty());
}
