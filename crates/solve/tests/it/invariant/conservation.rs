//! Conservation and bounds.

use crate::bench::{Solved, solve};
use crate::invariant::{close, everything};
use coldplate_describe::machine::Machine;
use coldplate_network::{Network, Surface};
use coldplate_solve::meshed::MeshedMachine;

fn both_meshes() -> [Solved; 2] {
    [15e-3, 5e-3].map(|size| solve(&everything(&["bed", "plate", "other", "bearing"]), size))
}

/// Temperature of the water that enters a stream, K: the inlet, or what the streams above it mix to.
fn entering(run: &Solved, s: usize) -> f64 {
    let (stream, state) = (&run.model.network.streams[s], &run.state.solution.streams[s]);
    if stream.upstream.is_empty() {
        return run.state.load.inlets[stream.circuit];
    }
    let outlet = |u: &usize| run.state.solution.temperatures[run.model.network.streams[*u].outlet() as usize];
    stream.upstream.iter().zip(&state.mixture).map(|(u, w)| w * outlet(u)).sum()
}

/// In and out agree to 1e-8, and the terms are what the machine file says.
#[test]
fn heat_balance() {
    for run in both_meshes() {
        let balance = &run.state.solution.balance;
        assert!(balance.relative < 1e-8, "{}", balance.relative);
        assert_eq!(balance.sources, [80.0, 25.0, 12.0]);
        let sum = balance.sources.iter().sum::<f64>() + balance.radiation + balance.gas + balance.circuits.iter().sum::<f64>();
        close(sum, 0.0, balance.in_watts, 1e-8);
    }
}

/// Along each channel the water gains exactly what the cells lose to it.
#[test]
fn water_gains_what_the_cells_lose() {
    for run in both_meshes() {
        let (net, solution) = (&run.model.network, &run.state.solution);
        let t = &solution.temperatures;
        for (s, (stream, state)) in net.streams.iter().zip(&solution.streams).enumerate() {
            let entering = entering(&run, s);
            let (mut above, mut lost) = (entering, 0.0);
            for (k, station) in stream.stations.iter().enumerate() {
                lost += station.cells.iter().map(|(cell, share)| state.exchange[k] * share * (t[*cell] - above)).sum::<f64>();
                above = t[stream.first_node as usize + k];
            }
            let gained = state.capacity_rate * (t[stream.outlet() as usize] - entering);
            let dissipated = state.dissipation * stream.length;
            close(gained - dissipated, lost, gained.abs().max(1.0), 1e-9);
        }
    }
}

/// Series streams have one mass flow; parallel ones share it so that their pressure drops agree.
#[test]
fn parallel_channels() {
    for run in both_meshes() {
        let [first, second, third] = &run.state.solution.streams[..] else { panic!("three streams") };
        close(second.pressure_drop, third.pressure_drop, third.pressure_drop, 1e-7);
        close(second.mass_flow + third.mass_flow, first.mass_flow, first.mass_flow, 1e-12);
        assert!(second.flow > third.flow);
    }
}

/// Without sources no temperature leaves the range of the given ones, however coarse the mesh and
/// however contrasting the materials: the scheme has a discrete maximum principle.
#[test]
fn maximum_principle() {
    let text = everything(&["bed", "plate", "other", "bearing"]);
    let text = text
        .replace("80 W\"", "0 W\"")
        .replace("25 W\"", "0 W\"")
        .replace("12 W\"", "0 W\"")
        .replace("dissipation = true", "dissipation = false");
    let text = text.replace("23.5 degC", "95 degC").replace("167 W/(m K)", "3000 W/(m K)").replace("14.6 W/(m K)", "0.05 W/(m K)");
    for size in [40e-3, 10e-3, 5e-3] {
        let run = solve(&text, size);
        let (low, high) = (20.0 + 273.15, 95.0 + 273.15);
        let slack = 1e-7;
        for t in &run.state.solution.temperatures {
            assert!((low - slack..high + slack).contains(t), "{t} K on cells of {size} m");
        }
    }
}

/// The residual at the solution is what the solver says it is: every node balances.
#[test]
fn every_node_balances() {
    for run in both_meshes() {
        let net: &Network = &run.model.network;
        let system = coldplate_solve::System::new(net);
        let streams = net.stream_states(&run.state.load, &run.state.solution.temperatures).unwrap();
        let residual = system.residual(net, &run.state.load, &streams, &run.state.solution.temperatures);
        let sum: f64 = residual.iter().map(|r| r.abs()).sum();
        assert!(sum < 1e-8 * run.state.solution.balance.in_watts, "{sum}");
    }
}

/// Where nothing but the pump warms a machine, microwatts reach the chamber. No temperature can hold 1e-8 of that, which is
/// no open balance; and the heat of the pump is accounted for.
#[test]
fn the_heat_of_the_pump_alone() {
    let machine = Machine::read(coldplate_testing::root().join("machines/slab.toml"), &[]).unwrap();
    for flow in ["0.5 L/min", "2 L/min", "6 L/min"] {
        let model = MeshedMachine::new(machine.clone(), Some(1500)).unwrap();
        let given =
            [("coolant_flow", flow), ("coolant_temperature", "20 degC"), ("motor_speed", "0 rpm"), ("ambient_temperature", "20 degC")];
        let condition = model.machine.condition(&given).unwrap();
        let state = model.solve(&model.solver(&condition).unwrap(), &condition).unwrap();
        let (network, t) = (&model.network, &state.solution.temperatures);
        let (stream, water) = (&network.streams[0], &state.solution.streams[0]);
        let pumped = water.dissipation * stream.stations.iter().map(|s| s.length).sum::<f64>();
        let carried = water.capacity_rate * (t[stream.outlet() as usize] - state.load.inlets[0]);
        let heat = |s: &Surface| s.state(t[s.node as usize], &network.properties, &state.load).heat;
        let radiated: f64 = network.surfaces.iter().map(heat).sum();
        assert!(radiated > 1e-6 * pumped && radiated < 0.01 * pumped, "{radiated:e} {pumped:e}");
        println!("{flow}: {:e} of {pumped:e} W", pumped - carried - radiated);
        // A few units in the last place of the water's temperature.
        let rounding = 8.0 * f64::EPSILON * state.load.inlets[0] * water.capacity_rate;
        assert!((pumped - carried - radiated).abs() < rounding, "{pumped:e} {carried:e} {radiated:e}");
        assert!(state.solution.balance.relative <= 1e-8);
    }
}

/// The Jacobian is the derivative of the residual (streams held as they are): central differences in random directions.
#[test]
fn jacobian_against_differences() {
    let run = solve(&everything(&["bed", "plate", "other", "bearing"]), 20e-3);
    let (net, load, solution) = (&run.model.network, &run.state.load, &run.state.solution);
    let system = coldplate_solve::System::new(net);
    let t = &solution.temperatures;
    let jacobian = system.jacobian(net, load, &solution.streams, t);
    // A reproducible direction without structure.
    let mut seed = 1u64;
    let direction: Vec<f64> = t
        .iter()
        .map(|_| {
            seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (seed >> 11) as f64 / (1u64 << 53) as f64 - 0.5
        })
        .collect();
    let moved = |h: f64| -> Vec<f64> {
        let at: Vec<f64> = t.iter().zip(&direction).map(|(t, d)| t + h * d).collect();
        system.residual(net, load, &solution.streams, &at)
    };
    let (plus, minus) = (moved(1e-2), moved(-1e-2));
    let mut product = vec![0.0; t.len()];
    jacobian.multiply(&direction, &mut product);
    let size = product.iter().fold(0.0f64, |m, p| m.max(p.abs()));
    for (i, p) in product.iter().enumerate() {
        close((plus[i] - minus[i]) / 2e-2, *p, size, 1e-5);
    }
}

/// A lumped node joins a face over a stated area: conduction through the part and the contact in series.
#[test]
fn lumped_node_on_a_face() {
    let (k, h, power) = (16.3, 250.0, 30.0);
    let text = format!(
        r#"
[material.steel]
conductivity = "{k} W/(m K)"
[part.plate]
material = "steel"
box = ["40 mm", "100 mm", "80 mm"]
surface = "none"
[boundary.cold]
faces = ["plate.-x"]
temperature = "20 degC"
[node.motor]
capacity = "1 J/K"
[contact.flange]
between = ["motor", "plate.+x"]
conductance = "{h} W/(m2 K)"
area = "0.008 m2"
[source.loss]
in = ["motor"]
power = "{power} W"
[sensor.motor]
node = "motor"
[sensor.face]
face = "plate.+x"
"#
    );
    let area = 0.1 * 0.08;
    let face = 20.0 + power * 0.04 / (k * area);
    let run = solve(&text, 11e-3);
    close(run.celsius("face"), face, 10.0, 1e-9);
    close(run.celsius("motor"), face + power / (h * area), 10.0, 1e-9);
    close(run.contact("flange").1, area, area, 1e-12);
    // The same with a total conductance, and with the contact written the other way round.
    let total =
        text.replace(&format!("conductance = \"{h} W/(m2 K)\"\narea = \"0.008 m2\""), &format!("total_conductance = \"{} W/K\"", h * area));
    close(solve(&total, 11e-3).celsius("motor"), face + power / (h * area), 10.0, 1e-9);
    let turned = text.replace("[\"motor\", \"plate.+x\"]", "[\"plate.+x\", \"motor\"]");
    let run = solve(&turned, 11e-3);
    close(run.celsius("motor"), face + power / (h * area), 10.0, 1e-9);
    close(run.contact("flange").0, -power, power, 1e-9);
}

/// A held node that radiates and is heated closes the balance with what holds it.
#[test]
fn held_node() {
    let text = r#"
[chamber]
temperature = "20 degC"
[node.held]
temperature = "60 degC"
effective_emissivity = 0.5
area = "0.3 m2"
[node.free]
capacity = "1 J/K"
[contact.strap]
between = ["held", "free"]
total_conductance = "2 W/K"
[source.a]
in = ["held"]
power = "7 W"
[source.b]
in = ["free"]
power = "5 W"
[sensor.free]
node = "free"
"#;
    let run = solve(text, 0.1);
    let radiated = 0.5 * 0.3 * 5.670374419e-8 * (333.15f64.powi(4) - 293.15f64.powi(4));
    close(run.celsius("free"), 62.5, 1.0, 1e-9);
    close(run.state.solution.balance.held[0], radiated - 12.0, radiated, 1e-9);
    assert!(run.state.solution.balance.relative < 1e-8);
}

/// Two bodies joined by a contact with a stated area although they do not touch: one resistance in series.
#[test]
fn contact_over_a_stated_area() {
    let text = r#"
[material.steel]
conductivity = "40 W/(m K)"
[part.left]
material = "steel"
box = ["50 mm", "40 mm", "40 mm"]
surface = "none"
[part.right]
material = "steel"
box = ["50 mm", "40 mm", "40 mm"]
at = ["80 mm", "0 m", "0 m"]
surface = "none"
[contact.strap]
between = ["left.+x", "right.-x"]
conductance = "300 W/(m2 K)"
area = "0.0016 m2"
[boundary.hot]
faces = ["left.-x"]
temperature = "80 degC"
[boundary.cold]
faces = ["right.+x"]
temperature = "20 degC"
"#;
    let area = 0.0016;
    let expected = 60.0 / (2.0 * 0.05 / (40.0 * area) + 1.0 / (300.0 * area));
    for size in [25e-3, 8e-3] {
        let run = solve(text, size);
        close(run.heat_in("hot"), expected, expected, 1e-9);
        close(run.contact("strap").0, expected, expected, 1e-9);
    }
}

/// A face covered by a lumped node or by another surface does not radiate to the chamber any more.
#[test]
fn covered_faces_do_not_see_the_chamber() {
    let text = |more: &str| {
        format!(
            r#"
[chamber]
temperature = "0 degC"
[material.ideal]
conductivity = "1e8 W/(m K)"
[part.block]
material = "ideal"
box = ["0.1 m", "0.1 m", "0.1 m"]
surface = {{ emissivity = 1.0 }}
[source.heat]
in = ["block"]
power = "30 W"
[sensor.block]
part = "block"
{more}
"#
        )
    };
    let sigma = 5.670374419e-8;
    let expected = |area: f64| (30.0 / (sigma * area) + 273.15f64.powi(4)).powf(0.25) - 273.15;
    let insulated = "[node.cap]\ncapacity = \"1 J/K\"\n[contact.cap]\nbetween = [\"cap\", \"block.+x\"]\nconductance = \"100 W/(m2 K)\"\narea = \"0.01 m2\"\n";
    close(solve(&text(""), 0.05).celsius("block"), expected(0.06), 10.0, 1e-6);
    close(solve(&text(insulated), 0.05).celsius("block"), expected(0.05), 10.0, 1e-6);
    // A second block with which the first exchanges by two whole faces: none of the two is left for the chamber.
    let facing = r#"
[part.other]
material = "ideal"
box = ["0.1 m", "0.1 m", "0.1 m"]
at = ["0.11 m", "0 m", "0 m"]
surface = { emissivity = 1.0 }
[radiation_link.gap]
between = ["block.+x", "other.-x"]
view_factor = 1.0
emissivity = [1.0, 1.0]
[sensor.other]
part = "other"
"#;
    let run = solve(&text(facing), 0.05);
    let (t1, t2) = (run.kelvin("block"), run.kelvin("other"));
    let exchange = sigma * 0.01 * (t1.powi(4) - t2.powi(4));
    close(exchange, sigma * 0.05 * (t2.powi(4) - 273.15f64.powi(4)), 30.0, 1e-6);
    close(30.0 - exchange, sigma * 0.05 * (t1.powi(4) - 273.15f64.powi(4)), 30.0, 1e-6);
}
