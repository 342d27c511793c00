//! J d against (R(T + e d) - R(T - e d))/2e, and the adjoint identity, at states that are no solution.

use coldplate_describe::machine::Machine;
use coldplate_network::Load;
use coldplate_solve::meshed::MeshedMachine;
use coldplate_solve::{System, Tangent};

use crate::sensitivity::common::{ENCLOSED, EVERYTHING, FED, SHIPPED, condition, model};

/// Numbers between -1 and 1 that look like noise (a Weyl sequence).
fn noise(n: usize, seed: f64) -> Vec<f64> {
    (0..n).map(|i| 2.0 * ((i as f64 + 1.0) * 0.754_877_666_246_692_8 + seed).fract() - 1.0).collect()
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Largest deviation of an entry of J d from the difference of residuals, over the size of the entries in its own
/// row, once for a smooth direction (the coolant terms stand out) and once for noise (every entry counts).
fn check(model: &MeshedMachine, at: [f64; 4], label: &str) {
    let network = &model.network;
    let load = Load::at(&model.machine, &condition(&model.machine, at)).unwrap();
    let solver = model.solver(&condition(&model.machine, at)).unwrap();
    let solved = solver.steady(&load).unwrap();
    // Off the solution every term has its full size.
    let mut temperatures = solved.temperatures;
    let shake = noise(network.nodes, 0.3);
    temperatures.iter_mut().zip(&shake).for_each(|(t, s)| *t += 0.5 * s);
    for (node, index) in &network.fixed {
        temperatures[*node as usize] = load.fixed[*index as usize];
    }
    let tangent = Tangent::new(network, &load, &temperatures).unwrap();
    let system = System::new(network);
    let residual = |t: &[f64]| system.residual(network, &load, &network.stream_states(&load, t).unwrap(), t);
    // The size of a row: the largest of its products with a few noises. Rows of weak couplings must agree as well.
    let mut size = vec![0.0f64; network.nodes];
    for k in 0..6 {
        let mut product = vec![0.0; network.nodes];
        // Two nodes of one noise may lie equally far apart in all of them: the product with another noise keeps no such pairs.
        let mut direction = noise(network.nodes, 0.15 * f64::from(k));
        direction.iter_mut().enumerate().for_each(|(i, d)| *d *= 1.0 + (i as f64 * 0.569_840_290_998_053_3).fract());
        tangent.multiply(&direction, &mut product);
        size.iter_mut().zip(&product).for_each(|(s, p)| *s = s.max(p.abs()));
    }
    let smooth: Vec<f64> = (0..network.nodes).map(|i| 1.0 + 0.3 * (i as f64 / network.nodes as f64)).collect();
    for (kind, mut direction) in [("smooth", smooth), ("noise", noise(network.nodes, 0.1))] {
        network.fixed.iter().for_each(|(node, _)| direction[*node as usize] = 0.0);
        let shifted = |e: f64| -> Vec<f64> {
            let t: Vec<f64> = temperatures.iter().zip(&direction).map(|(t, d)| t + e * d).collect();
            residual(&t)
        };
        let e = 0.02;
        let four = [shifted(-2.0 * e), shifted(-e), shifted(e), shifted(2.0 * e)];
        let mut product = vec![0.0; network.nodes];
        tangent.multiply(&direction, &mut product);
        network.fixed.iter().for_each(|(node, _)| product[*node as usize] = 0.0);
        let worst = (0..network.nodes)
            .map(|i| (product[i] - (four[0][i] - 8.0 * four[1][i] + 8.0 * four[2][i] - four[3][i]) / (12.0 * e)).abs() / size[i])
            .fold(0.0, f64::max);
        println!("{label:>34} {kind:>7}: {worst:.1e}");
        assert!(worst < 1e-9, "{label}, {kind}: {worst:e}");
    }
    // Both products and both solves belong to one matrix.
    let (a, b) = (noise(network.nodes, 0.7), noise(network.nodes, 0.9));
    let (mut ja, mut tb) = (vec![0.0; network.nodes], vec![0.0; network.nodes]);
    tangent.multiply(&a, &mut ja);
    tangent.multiply_transposed(&b, &mut tb);
    let scale = dot(&b, &b).sqrt() * dot(&ja, &ja).sqrt();
    assert!((dot(&b, &ja) - dot(&tb, &a)).abs() < 1e-13 * scale, "{label}: {} {}", dot(&b, &ja), dot(&tb, &a));
    for (right, product) in [(&ja, tangent.solve(&ja).unwrap()), (&tb, tangent.solve_transposed(&tb).unwrap())] {
        let mut back = vec![0.0; network.nodes];
        if std::ptr::eq(right, &ja) {
            tangent.multiply(&product, &mut back)
        } else {
            tangent.multiply_transposed(&product, &mut back)
        };
        let off: f64 = back.iter().zip(right).map(|(x, y)| (x - y).powi(2)).sum::<f64>().sqrt() / dot(right, right).sqrt();
        assert!(off < 1e-10, "{label}: {off:e}");
    }
}

#[test]
fn every_shipped_machine_at_several_conditions() {
    for (name, cells, conditions) in SHIPPED {
        let model = model(name, cells);
        for at in conditions {
            check(&model, at, &format!("{name} {at:?}"));
        }
    }
}

#[test]
fn every_law_that_follows_the_temperature() {
    let model = MeshedMachine::new(Machine::from_text(EVERYTHING, "everything.toml", &[]).unwrap(), Some(2000)).unwrap();
    assert!(!model.network.reaches.is_empty(), "cells that do not match are among what is tested");
    // Laminar, between and turbulent; and water at rest.
    for at in [[1.0, 20.0, 1000.0, 40.0], [2.6, 20.0, 1000.0, 10.0], [9.0, 30.0, 3000.0, 25.0], [0.0, 20.0, 100.0, 25.0]] {
        check(&model, at, &format!("everything {at:?}"));
    }
}

#[test]
fn faces_that_see_each_other() {
    let model = MeshedMachine::new(Machine::from_text(ENCLOSED, "enclosed.toml", &[]).unwrap(), Some(2000)).unwrap();
    assert!(model.network.fixed.len() > 2 && !model.network.radiative.is_empty() && !model.network.reaches.is_empty());
    for at in [[1.0, 20.0, 1000.0, 40.0], [1.0, 20.0, 3000.0, 10.0]] {
        check(&model, at, &format!("enclosed {at:?}"));
    }
}

#[test]
fn circuits_that_feed_others() {
    let model = MeshedMachine::new(Machine::from_text(FED, "fed.toml", &[]).unwrap(), Some(1500)).unwrap();
    for at in [[1.0, 30.0, 1000.0, 10.0], [6.0, 30.0, 3000.0, 20.0], [2.9, 40.0, 3000.0, 20.0]] {
        check(&model, at, &format!("fed {at:?}"));
    }
}

#[test]
fn films_by_formulas_of_the_flow() {
    let sets = [
        ("channel.short.nusselt", "0.023 * Re^0.8 * Pr^0.4 * mu_over_mu_wall^0.14"),
        ("channel.long.film", "(3.66 + Re / 100) * (Pr / Pr_wall)^0.11 * conductivity_W_m_K / diameter_m + motor_speed_rpm / 10"),
    ];
    let sets: Vec<(String, String)> = sets.iter().map(|(key, value)| (key.to_string(), format!("\"{value}\""))).collect();
    let model = MeshedMachine::new(Machine::read(crate::sensitivity::common::path("spindle"), &sets).unwrap(), Some(2500)).unwrap();
    for at in [[3.0, 20.0, 2000.0, 22.0], [1.0, 24.0, 3000.0, 20.0]] {
        check(&model, at, &format!("formulas {at:?}"));
    }
}

#[test]
fn free_convection_of_faces_and_nodes() {
    let text = r#"
name = "a bench in a room"
[part.plate]
material = "steel"
box = ["0.2 m", "0.1 m", "20 mm"]
[node.motor]
[contact.foot]
between = ["motor", "plate.+x"]
total_conductance = "3 W/K"
[source.motor]
in = "motor"
power = "0.05 * motor_speed_rpm"
[boundary.up]
faces = ["plate.+z"]
free_convection = "facing_up"
length = "33 mm"
[boundary.sides]
faces = ["plate.-x", "plate.-y", "plate.+y"]
free_convection = "vertical_plate"
length = "20 mm"
fluid_temperature = "coolant_temperature"
[boundary.motor]
node = "motor"
area = "0.03 m2"
free_convection = "horizontal_cylinder"
length = "80 mm"
gas = "helium"
gas_pressure = "2 bar"
[sensor.plate]
part = "plate"
"#;
    let model = MeshedMachine::new(Machine::from_text(text, "bench.toml", &[]).unwrap(), Some(500)).unwrap();
    for at in [[1.0, 22.0, 1000.0, 25.0], [1.0, 15.0, 300.0, 20.0]] {
        check(&model, at, &format!("in a room {at:?}"));
    }
}
