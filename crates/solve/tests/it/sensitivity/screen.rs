//! Candidates straight from the network: against the parameters of the file that mean the same, and against networks that
//! hold the candidate.

use coldplate_describe::machine::{Conductance, ContactLaw};
use coldplate_network::{ContactGroup, Joint, NONE, Network};
use coldplate_solve::sensitivity::{Derivatives, Disturbance};
use coldplate_solve::study::Study;
use coldplate_solve::{Solver, Tangent};

use crate::sensitivity::common::{ENCLOSED, EVERYTHING, FED, condition, study, study_of};

/// A candidate against `scale` times the derivative with respect to a parameter, on every sensor.
fn same(at: &Derivatives<'_>, effect: &Disturbance, name: &str, scale: f64) {
    let parameter = at.study.parameter(name).unwrap();
    let targets = at.study.sensors();
    let table = at.jacobian(&targets, &[parameter]).unwrap();
    let largest = table.slopes.iter().fold(0.0, |m: f64, row| m.max((row[0] * scale).abs()));
    assert!(largest > 1e-9, "{name}: nothing moves");
    for (target, (sensor, row)) in targets.iter().zip(at.study.model.network.sensors.iter().zip(&table.slopes)) {
        let found = effect.on(&at.adjoint(*target).unwrap().field, sensor.inlet);
        let off = (found - row[0] * scale).abs() / largest;
        assert!(off < 1e-8, "{name}: {found:e} and {:e}", row[0] * scale);
    }
}

fn value(study: &Study, name: &str) -> f64 {
    study.parameter(name).unwrap().value
}

#[test]
fn candidates_that_are_parameters_too() {
    let study = study("rig", 1500);
    let net = &study.model.network;
    let at = study.at(&condition(&study.model.machine, [1.998, 26.0, 2500.0, 28.5])).unwrap();
    let screen = at.screen();
    same(&at, &screen.contact("motor"), "contact.motor.conductance", value(&study, "contact.motor.conductance"));
    same(&at, &screen.emissivity(0..net.surfaces.len()), "surfaces.effective_emissivity", 0.55);
    let source = screen.source(&net.sources[1].shares);
    same(&at, &source, "source.reducer.power", 1.0 / at.state.load.powers[1]);
    same(&at, &screen.power(1), "source.reducer.power", 1.0);
    same(&at, &screen.temperature_coefficient(0).unwrap(), "source.motor.temperature_coefficient", 1.0);
    same(&at, &screen.stream_film(1), "channel.reducer_plate.bend_factor", 1.0);
    same(&at, &screen.flow(0).unwrap(), "coolant_flow", at.state.load.flows[0]);
    same(&at, &screen.inlet(0).unwrap(), "coolant_temperature", 1.0);
    let motor = net.groups.iter().position(|g| g == "motor").unwrap() as u32;
    same(&at, &screen.conductivity(motor), "material.motor.conductivity", 2000.0);
    assert!(!screen.surfaces_of(motor).is_empty());

    let study = study_of(EVERYTHING, 1500);
    let net = &study.model.network;
    let at = study.at(&condition(&study.model.machine, [9.0, 30.0, 3000.0, 25.0])).unwrap();
    let screen = at.screen();
    same(&at, &screen.contact("far"), "contact.far.conductance", 800.0);
    same(&at, &screen.contact("lid"), "contact.lid.temperature_table", 1.0);
    same(&at, &screen.boundary(0), "boundary.bottom.film", 12.0);
    same(&at, &screen.boundary(2), "boundary.lamp.heat_flux", 300.0);
    same(&at, &screen.boundary(3), "boundary.wall.emissivity", 0.5);
    same(&at, &screen.boundary_temperature(0), "boundary.bottom.fluid_temperature", 1.0);
    same(&at, &screen.boundary_temperature(1), "boundary.end.temperature", 1.0);
    same(&at, &screen.boundary_temperature(3), "boundary.wall.surroundings_temperature", 1.0);
    same(&at, &screen.stream_film(1), "channel.b.bend_factor", 1.2);
    // Two parts are made of the steel whose conductivity is a table, and the plate holds the channels.
    let group = |name: &str| net.groups.iter().position(|g| g == name).unwrap() as u32;
    let mut both = screen.conductivity(group("plate"));
    both.rows.extend(screen.conductivity(group("block")).rows);
    // The spots of the rough contact follow the conductivity as well: leave them out by comparing without that contact.
    let text = EVERYTHING.replace(
        "rough = { roughness = \"2.3 um\", slope = 0.15, hardness = \"1.3 GPa\", pressure = \"1 MPa\", gas = { pressure = \"2000 Pa\" }, emissivity = [0.3, 0.4] }",
        "conductance = \"700 W/(m2 K)\"",
    );
    assert_ne!(text, EVERYTHING);
    let plain = study_of(&text, 1500);
    let at = plain.at(&condition(&plain.model.machine, [9.0, 30.0, 3000.0, 25.0])).unwrap();
    let screen = at.screen();
    let mut both = screen.conductivity(group("plate"));
    both.rows.extend(screen.conductivity(group("block")).rows);
    same(&at, &both, "material.steep.conductivity", 1.0);
}

/// In an enclosure a prescribed temperature holds nodes, and a film acts on nodes of the faces.
#[test]
fn candidates_among_faces_that_see_each_other() {
    let study = study_of(ENCLOSED, 1500);
    let at = study.at(&condition(&study.model.machine, [1.0, 20.0, 1000.0, 40.0])).unwrap();
    let screen = at.screen();
    let group = |name: &str| study.model.network.groups.iter().position(|g| g == name).unwrap() as u32;
    same(&at, &screen.boundary_temperature(0), "boundary.held.temperature", 1.0);
    same(&at, &screen.boundary_temperature(1), "boundary.film.fluid_temperature", 1.0);
    same(&at, &screen.boundary(1), "boundary.film.film", 5.0);
    same(&at, &screen.contact("foot"), "contact.foot.conductance", 500.0);
    same(&at, &screen.conductivity(group("roof")), "material.plain.conductivity", 20.0);
    let mut both = screen.conductivity(group("floor"));
    both.rows.extend(screen.conductivity(group("block")).rows);
    same(&at, &both, "material.steep.conductivity", 1.0);
}

/// What flows into a circuit flows into those it feeds.
#[test]
fn candidates_upstream_of_other_circuits() {
    let study = study_of(FED, 1000);
    let at = study.at(&condition(&study.model.machine, [3.0, 30.0, 3000.0, 15.0])).unwrap();
    let screen = at.screen();
    let circuit = |name: &str| study.model.network.circuits.iter().position(|c| c.circuit.name == name).unwrap();
    same(&at, &screen.flow(circuit("cold")).unwrap(), "circuit.cold.flow", at.state.load.flows[circuit("cold")]);
    same(&at, &screen.inlet(circuit("cold")).unwrap(), "ambient_temperature", 1.0);
    same(&at, &screen.inlet(circuit("hot")).unwrap(), "coolant_temperature", 1.0);
    same(&at, &screen.flow(circuit("last")).unwrap(), "circuit.last.flow", 1.0);
    for unstated in ["circuit.mixed.flow", "circuit.mixed.inlet_temperature"] {
        assert!(study.parameter(unstated).is_err(), "{unstated} is what the feeders make of it");
    }
    // Against differences of whole solutions, so near that the film of 'c' stays on its side of Re = 4000.
    let parameter = study.parameter("circuit.hot.branches.c").unwrap();
    let table = at.jacobian(&study.sensors(), std::slice::from_ref(&parameter)).unwrap();
    let solved = |share: f64| {
        let text = FED.replace("branches = { c = 0.4 }", &format!("branches = {{ c = {share:?} }}"));
        let other = study_of(&text, 1000);
        crate::sensitivity::common::readings(&other, &condition(&other.model.machine, [3.0, 30.0, 3000.0, 15.0]))
    };
    let [f0, f1, f2, f3] = [-1e-3, -5e-4, 5e-4, 1e-3].map(|by| solved(0.4 + by));
    for (s, row) in table.slopes.iter().enumerate() {
        let difference = (8.0 * (f2[s] - f1[s]) - (f3[s] - f0[s])) / 6e-3;
        assert!((row[0] - difference).abs() < 1e-4 * difference.abs().max(1.0), "{s}: {} {difference}", row[0]);
    }
}

/// Readings of a changed network, to rounding.
fn readings(network: &Network, at: &Derivatives<'_>) -> Vec<f64> {
    let solution = Solver::new(network, &at.state.load).unwrap().steady(&at.state.load).unwrap();
    let mut temperatures = solution.temperatures;
    let tangent = Tangent::new(network, &at.state.load, &temperatures).unwrap();
    tangent.correct(&at.state.load, &mut temperatures).unwrap();
    network.sensors.iter().map(|s| s.read(&temperatures, &at.state.load)).collect()
}

/// A bridge of a small conductance between two nodes that do not touch, and a film on one part's surfaces.
#[test]
fn candidates_the_file_does_not_know() {
    let study = study("spindle", 1500);
    let net = &study.model.network;
    let at = study.at(&condition(&study.model.machine, [3.0, 20.0, 2000.0, 22.0])).unwrap();
    let screen = at.screen();
    let adjoints: Vec<_> = study.sensors().iter().map(|s| at.adjoint(*s).unwrap()).collect();
    let check = |effect: &Disturbance, changed: &dyn Fn(f64) -> Network, size: f64, what: &str| {
        // Second differences from one side, since a conductance has no negative.
        let f = [0.0, 1.0, 2.0, 3.0].map(|k| readings(&changed(k * size), &at));
        for (s, adjoint) in adjoints.iter().enumerate() {
            let difference = (-11.0 * f[0][s] + 18.0 * f[1][s] - 9.0 * f[2][s] + 2.0 * f[3][s]) / (6.0 * size);
            let found = effect.on(&adjoint.field, net.sensors[s].inlet);
            println!("{what}, sensor {s}: {found:.6e} {difference:.6e}");
            assert!((found - difference).abs() < 2e-5 * difference.abs().max(1e-3), "{what}, sensor {s}: {found:e} {difference:e}");
        }
    };
    let (bearing, screen_part) = (
        net.group.iter().position(|g| net.groups[*g as usize] == "bearing").unwrap() as u32,
        net.groups.iter().position(|g| g == "screen").unwrap(),
    );
    let far = net.group.iter().position(|g| *g as usize == screen_part).unwrap() as u32;
    let bridge = |g: f64| {
        let mut network = net.clone();
        let (joints, contact) = (network.joints.len(), network.contacts.len() as u32);
        let joint = Joint {
            a: bearing,
            b: far,
            area: 1.0,
            length_a: 0.0,
            length_b: 0.0,
            property_a: NONE,
            property_b: NONE,
            contact,
            reach: [NONE; 2],
        };
        network.joints.push(joint);
        let group = ContactGroup {
            of: None,
            name: "bridge".into(),
            law: ContactLaw::Conductance(Conductance(g)),
            between: ["bearing".into(), "screen".into()],
            area: 1.0,
            scale: 1.0,
            is_half: false,
            joints: joints..joints + 1,
        };
        network.contacts.push(group);
        network
    };
    check(&screen.conductor(bearing, far), &bridge, 1e-4, "bridge");
    // A relative change of every radiative conductor, and of a few surfaces' emissivities.
    let radiative = |by: f64| {
        let mut network = net.clone();
        network.radiative.iter_mut().for_each(|r| r.2 *= 1.0 + by);
        network
    };
    check(&screen.radiative(0..net.radiative.len()), &radiative, 0.01, "radiation link");
    let some = screen.surfaces_of(net.groups.iter().position(|g| g == "shaft").unwrap() as u32);
    let painted = |by: f64| {
        let mut network = net.clone();
        some.iter().for_each(|i| network.surfaces[*i].emissive *= 1.0 + by);
        network
    };
    check(&screen.emissivity(some.iter().copied()), &painted, 0.01, "emissivity of the shaft");
    // A film to the chamber is what gas on those surfaces does.
    let gassed = |h: f64| {
        let mut network = net.clone();
        some.iter().for_each(|i| network.surfaces[*i].gas_area += h * network.surfaces[*i].area / at.state.load.gas);
        network
    };
    check(&screen.film(some.iter().copied(), at.state.load.chamber), &gassed, 1e-2, "film on the shaft");
}
