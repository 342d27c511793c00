//! Derivatives against four-point differences of full solutions, forward against adjoint, on every kind of parameter.

use coldplate_describe::machine::Condition;
use coldplate_solve::study::Study;
use coldplate_solve::study::{MachineParameter, ParameterKind};

use crate::sensitivity::common::{ENCLOSED, EVERYTHING, condition, readings, study, study_of};

/// Readings with a parameter at another value.
fn readings_at(study: &Study, at: &Condition, parameter: &MachineParameter, value: f64) -> Vec<f64> {
    match parameter.variable() {
        Some(variable) => {
            let mut si = at.si().to_vec();
            si[variable] = value;
            readings(study, &Condition::from_si(si))
        }
        None => readings(&study.with(&[(parameter, value)]).unwrap(), at),
    }
}

/// Every sensor's derivative with respect to the named parameters, three ways.
fn check(study: &Study, at: [f64; 4], names: &[&str]) {
    let at = condition(&study.model.machine, at);
    let derivatives = study.at(&at).unwrap();
    let parameters: Vec<MachineParameter> = names.iter().map(|n| study.parameter(n).unwrap_or_else(|e| panic!("{n}: {e}"))).collect();
    let sensors = study.sensors();
    let table = derivatives.jacobian(&sensors, &parameters).unwrap();
    let adjoints: Vec<_> = sensors.iter().map(|s| derivatives.adjoint(*s).unwrap()).collect();
    for (p, parameter) in parameters.iter().enumerate() {
        let value = derivatives.value_of(parameter);
        // One percent, or a quarter of a kelvin: the response is nearly linear, and far above rounding.
        let step = if parameter.kind == ParameterKind::Offset || parameter.dimension.is_absolute() { 0.25 } else { 0.005 * value };
        let f = [-2.0, -1.0, 1.0, 2.0].map(|k| readings_at(study, &at, parameter, value + k * step));
        let partial = derivatives.partial(parameter).unwrap();
        let field = derivatives.field(&partial).unwrap();
        let per_step: Vec<f64> = (0..sensors.len()).map(|s| (f[0][s] - 8.0 * f[1][s] + 8.0 * f[2][s] - f[3][s]) / 12.0).collect();
        let largest = per_step.iter().fold(0.0, |m: f64, d| m.max(d.abs()));
        let (mut worst, mut apart) = (0.0f64, 0.0f64);
        for s in 0..sensors.len() {
            let (forward, adjoint) = (derivatives.along(sensors[s], &partial, &field), derivatives.against(&adjoints[s], &partial));
            assert!(table.slopes[s][p] == adjoint || table.slopes[s][p] == forward);
            // A change of the reading by the step: rounding leaves some 1e-10 K in every solution.
            apart = apart.max((forward - adjoint).abs() / forward.abs().max(1e-3 * largest / step));
            worst = worst.max((forward * step - per_step[s]).abs() / (per_step[s].abs() + 1e-3 * largest).max(1e-4));
        }
        println!("{:>45}: {worst:.1e} of the difference, forward - adjoint {apart:.1e}, largest {:.2e} K", parameter.name, largest);
        assert!(largest > 1e-8, "{}: nothing moves", parameter.name);
        assert!(!table.idle[p] && table.uneven[p] < 1e-2, "{}: uneven {:e}", parameter.name, table.uneven[p]);
        assert!(apart < 1e-9, "{}: forward and adjoint differ by {apart:e}", parameter.name);
        assert!(worst < 1e-6, "{}: {worst:e}", parameter.name);
    }
}

const CONDITIONS: [&str; 4] = ["coolant_flow", "coolant_temperature", "motor_speed", "ambient_temperature"];

#[test]
fn slab() {
    let names = [
        "contact.joint.conductance",
        "part.plate.surface.emissivity",
        "part.block.surface.emissivity",
        "source.friction.power",
        "channel.hole.bend_factor",
        "channel.hole.diameter",
        "circuit.water.flow",
        "circuit.water.inlet_temperature",
        "chamber.temperature",
        "part.block.box[2]",
        "sensor.block.point[1]",
    ];
    check(&study("slab", 1500), [2.0, 20.0, 1000.0, 23.0], &[&CONDITIONS[..], &names].concat());
}

#[test]
fn spindle() {
    let names = [
        "grease",
        "chamber.pressure",
        "chamber.gap",
        "chamber.wall_emissivity",
        "material.spindle steel.conductivity",
        "material.spindle steel.conductivity[2][2]",
        "contact.foot.rough.pressure",
        "contact.foot.rough.roughness",
        "contact.foot.rough.gas.pressure",
        "contact.balls.total_conductance",
        "contact.clamp.conductance",
        "contact.clamp.area",
        "node.motor.emissivity",
        "node.motor.area",
        "radiation_link.gap.view_factor",
        "radiation_link.gap.emissivity[1]",
        "source.bearing.power",
        "channel.long.minor_loss",
        "channel.short.bend_factor",
    ];
    check(&study("spindle", 1500), [3.0, 20.0, 2000.0, 22.0], &[&CONDITIONS[..], &names].concat());
}

#[test]
fn rig() {
    let names = [
        "contact.motor.conductance",
        "contact.reducer.conductance",
        "surfaces.effective_emissivity",
        "part.motor.surface.area",
        "part.motor_plate.surface.effective_emissivity",
        "source.motor.power",
        "material.motor.conductivity",
        "channel.motor_plate.bend_factor",
        "channel.motor_plate.minor_loss",
        "circuit.water.inlet_temperature",
        "drive.y.moving_mass",
        "drive.y.motor_efficiency",
    ];
    check(&study("rig", 2000), [1.998, 26.0, 2500.0, 28.5], &[&CONDITIONS[..], &names].concat());
}

#[test]
fn five_axis() {
    let names = ["bearing_preload", "surfaces.effective_emissivity", "source.y_motor.power", "material.stainless.conductivity"];
    check(&study("five_axis", 3000), [6.834, 20.5, 1500.0, 23.5], &[&CONDITIONS[..], &names].concat());
}

#[test]
fn every_law() {
    let names = [
        "material.steep.conductivity",
        "contact.foot.rough.slope",
        "contact.foot.rough.emissivity[2]",
        "contact.foot.rough.gas.pressure",
        "contact.lid.temperature_table",
        "contact.side.pressure_table",
        "contact.side.pressure",
        "contact.motor.area",
        "contact.held.total_conductance",
        "contact.far.conductance",
        "node.held.temperature",
        "boundary.bottom.film",
        "boundary.bottom.fluid_temperature",
        "boundary.end.temperature",
        "boundary.lamp.heat_flux",
        "boundary.wall.emissivity",
        "boundary.wall.surroundings_temperature",
        "channel.a.roughness",
        "channel.b.bend_factor",
        "channel.b.minor_loss",
        "circuit.water.flow",
        "source.motor.power",
        "source.block.power",
        "surfaces.emissivity",
    ];
    // Laminar, and turbulent with rough walls.
    for at in [[0.8, 20.0, 1000.0, 40.0], [9.0, 30.0, 3000.0, 25.0]] {
        let quiet = |n: &&str| at[0] > 1.0 || !matches!(*n, "channel.a.roughness");
        let names: Vec<&str> = CONDITIONS.into_iter().chain(names).filter(quiet).collect();
        check(&study_of(EVERYTHING, 1500), at, &names);
    }
}

/// Sensors on faces under boundaries, under contacts that follow the temperature, and on a face that radiates.
#[test]
fn faces_and_joints_that_are_read() {
    let faces = ["plate.-z", "plate.+z", "block.-z", "block.+z", "lid.-z", "side.-z", "side.+z", "screen.+z"];
    let sensor = |(i, face): (usize, &&str)| format!("[sensor.face{i}]\nface = \"{face}\"\n");
    let text = format!("{EVERYTHING}\n{}", faces.iter().enumerate().map(sensor).collect::<String>());
    let names = [
        "material.steep.conductivity",
        "contact.foot.rough.slope",
        "contact.lid.temperature_table",
        "contact.side.pressure",
        "contact.far.conductance",
        "boundary.bottom.film",
        "boundary.bottom.fluid_temperature",
        "boundary.lamp.heat_flux",
        "boundary.wall.emissivity",
        "boundary.wall.surroundings_temperature",
        "surfaces.emissivity",
        "source.block.power",
    ];
    check(&study_of(&text, 1500), [9.0, 30.0, 3000.0, 25.0], &[&CONDITIONS[..], &names].concat());
}

#[test]
fn faces_that_see_each_other() {
    let names = [
        "motor_speed",
        "ambient_temperature",
        "enclosure.gap.surfaces[1].emissivity",
        "enclosure.gap.surfaces[2].emissivity",
        "enclosure.gap.surfaces[3].emissivity",
        "enclosure.gap.view_factors[1][2]",
        "boundary.held.temperature",
        "boundary.film.film",
        "boundary.film.fluid_temperature",
        "chamber.temperature",
        "chamber.pressure",
        "chamber.wall_emissivity",
        "contact.foot.conductance",
        "material.steep.conductivity",
        "material.plain.conductivity",
        "surfaces.emissivity",
    ];
    check(&study_of(ENCLOSED, 1500), [1.0, 20.0, 1000.0, 40.0], &names);
}

/// The same with view factors found by rays.
#[test]
fn enclosure() {
    let names = ["enclosure.hood.surfaces[1].emissivity", "contact.feet.total_conductance", "source.motor.power"];
    check(&study("enclosure", 2000), [4.0, 20.0, 2000.0, 22.0], &[&CONDITIONS[..], &names].concat());
}
