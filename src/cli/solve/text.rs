//! A steady state as text.

use super::super::mesh_options::stated_cells;
use super::super::text::{block, table};
use coldplate_base::numbers::significant;
use coldplate_base::units::{Celsius, Kelvin, Measurand};
use coldplate_describe::machine::ControlLaw;
use coldplate_network::{ControlLoop, HeatMeter};
use coldplate_solve::balance::{ContactFlow, contact_flows, enclosure_heats};
use coldplate_solve::meshed::{MeshErrors, MeshedMachine, SteadyState};

/// The solution for a terminal; `seconds` is the time taken.
pub(super) fn text(model: &MeshedMachine, state: &SteadyState, mesh: Option<&MeshErrors>, seconds: f64) -> String {
    let mut text = format!("{}\n\n{}", model.machine.name, readings(model, state, mesh));
    text += &heat_flows(model, state, mesh);
    for stage in [limits, controllers, channels] {
        text += &stage(model, state);
    }
    text += &contacts(model, state, mesh);
    for stage in [boundaries, enclosures, balance] {
        text += &stage(model, state);
    }
    if let Some(chosen) = &model.chosen {
        let (asked, cells) = (significant(chosen.accuracy, 3), model.mesh.cells);
        text += &stated_cells(model, chosen).map(|note| format!("note: {note}\n")).collect::<String>();
        text += &format!("{cells} cells, chosen to leave less than {asked} K open; estimates from {} cells\n", chosen.checked_on);
    }
    let (newton, krylov) = (state.solution.newton_iterations, state.solution.krylov_iterations);
    text + &format!("{} unknowns, {newton} Newton steps, {krylov} Krylov iterations, {seconds:.2} s\n", model.network.nodes)
}

/// Temperatures and displacements, with the error by the mesh where it is known.
fn readings(model: &MeshedMachine, state: &SteadyState, mesh: Option<&MeshErrors>) -> String {
    let shown = model.shown(state);
    let row = |s: usize, name: &String, reading: f64| -> Vec<String> {
        let known = model.chosen.as_ref().map(|chosen| chosen.sensors[s]);
        let open = known.or(mesh.map(|mesh| Some(mesh.errors[s]))).map(|open| open.map_or_else(String::new, |e| format!("{e:.3}")));
        let reads = shown.iter().find(|(n, _)| n == name).map(|(_, shown)| format!("reads {shown:.3}"));
        [Some(name.clone()), Some(format!("{reading:.3}")), open, reads].into_iter().flatten().collect()
    };
    let has_open = mesh.is_some() || model.chosen.is_some();
    let readings = model.readings(state);
    let mut blocks = Vec::new();
    for (measurand, what) in [(Measurand::Temperature, "sensor"), (Measurand::Displacement, "displacement")] {
        let own = model.network.measurands.iter().zip(&model.network.sensor_names).enumerate().filter(|(_, (own, _))| **own == measurand);
        let rows: Vec<Vec<String>> = own.map(|(s, (_, name))| row(s, name, readings[s])).collect();
        let open = format!("mesh {}", measurand.unit_of_differences());
        let header = [Some(what), Some(measurand.unit()), has_open.then_some(open.as_str()), (!shown.is_empty()).then_some("")];
        if !rows.is_empty() || measurand == Measurand::Temperature {
            blocks.push(table(&header.into_iter().flatten().collect::<Vec<_>>(), &rows));
        }
    }
    blocks.join("\n")
}

fn heat_flows(model: &MeshedMachine, state: &SteadyState, mesh: Option<&MeshErrors>) -> String {
    let row = |(k, (meter, heat)): (usize, (&HeatMeter, f64))| -> Vec<String> {
        [meter.name.clone(), format!("{heat:+.3}")].into_iter().chain(mesh.map(|mesh| open_heat(mesh, k))).collect()
    };
    let rows: Vec<Vec<String>> = model.network.meters.iter().zip(model.heat_flows(state)).enumerate().map(row).collect();
    let header: Vec<&str> = ["heat flow", "W"].into_iter().chain(mesh.map(|_| "mesh W")).collect();
    block(&header, &rows)
}

/// Error of the mesh in heat `k` of the estimates, W.
fn open_heat(mesh: &MeshErrors, k: usize) -> String {
    mesh.heats.get(k).map_or_else(String::new, |error| format!("{error:.3}"))
}

fn limits(model: &MeshedMachine, state: &SteadyState) -> String {
    let limits = model.limits(state);
    let has_lengths = limits.iter().any(|l| l.measurand != Measurand::Temperature);
    let rows: Vec<Vec<String>> = (limits.iter())
        .map(|l| {
            let shown = |x: f64| format!("{:.3} {}", l.shown(x), l.unit());
            let verdict = if l.margin() >= 0.0 { "kept" } else { "broken" };
            let unit = if has_lengths { format!(" {}", l.measurand.unit_of_differences()) } else { String::new() };
            let margin = format!("{:+.3}{unit}", l.margin());
            vec![l.name.clone(), shown(l.value), shown(l.maximum), margin, verdict.into()]
        })
        .collect();
    block(&["limit", "value", "at most", if has_lengths { "margin" } else { "margin K" }, ""], &rows)
}

/// Shares of controllers, with the states of their sensors: a thermostat is on for its share of the time.
fn controllers(model: &MeshedMachine, state: &SteadyState) -> String {
    let readings = model.readings(state);
    let row = |(own, share): (&ControlLoop, &f64)| -> Vec<String> {
        let remark = match own.law {
            _ if *share <= 0.0 => "off",
            _ if *share >= 1.0 => "at full power",
            ControlLaw::Thermostat { .. } => "cycles, on for this share of the time",
            ControlLaw::ProportionalIntegral { .. } => "holds its set point",
        };
        let (sensor, reading) = (&model.network.sensor_names[own.sensor], readings[own.sensor]);
        vec![own.name.clone(), format!("{share:.4}"), format!("{sensor} {reading:.3} degC"), remark.into()]
    };
    let rows: Vec<Vec<String>> = model.network.loops.iter().zip(&state.solution.shares).map(row).collect();
    block(&["controller", "share", "sensor", ""], &rows)
}

fn channels(model: &MeshedMachine, state: &SteadyState) -> String {
    let solution = &state.solution;
    let notes = model.network.coolant_notes(&solution.streams, &solution.temperatures);
    let rows: Vec<Vec<String>> = (model.network.streams.iter().zip(&solution.streams).zip(&notes))
        .map(|((stream, at), note)| {
            let outlet: Celsius = Kelvin(solution.temperatures[stream.outlet() as usize]).into();
            vec![
                stream.name.clone(),
                format!("{:.3}", outlet.0),
                format!("{:.3}", at.flow * 6e4),
                format!("{:.0}", at.reynolds),
                format!("{:.0}", at.film),
                format!("{:.0}", at.pressure_drop),
                note.clone().unwrap_or_default(),
            ]
        })
        .collect();
    block(&["channel", "outlet degC", "L/min", "Re", "h W/(m2 K)", "drop Pa", ""], &rows)
}

fn contacts(model: &MeshedMachine, state: &SteadyState, mesh: Option<&MeshErrors>) -> String {
    let meters = model.network.meters.len();
    let row = |(k, c): (usize, ContactFlow)| -> Vec<String> {
        let conductance = if c.conductance.is_finite() { significant(c.conductance, 4) } else { "bonded".into() };
        let own = [c.name, significant(c.area, 4), conductance, format!("{:.3}", c.heat), format!("{:.3}", c.drop)];
        own.into_iter().chain(mesh.map(|mesh| open_heat(mesh, meters + k))).collect()
    };
    let flows = contact_flows(&model.network, &state.load.contacts, &state.solution.temperatures);
    let header = ["contact", "area m2", "hA W/K", "heat W", "drop K"].into_iter().chain(mesh.map(|_| "mesh W"));
    block(&header.collect::<Vec<&str>>(), &flows.into_iter().enumerate().map(row).collect::<Vec<_>>())
}

fn boundaries(model: &MeshedMachine, state: &SteadyState) -> String {
    let rows: Vec<Vec<String>> = (model.machine.boundaries.iter().zip(&model.network.acting).zip(&state.solution.balance.boundaries))
        .map(|((b, area), heat)| vec![b.name.clone(), significant(area.acting, 4), format!("{heat:+.3}")])
        .collect();
    block(&["boundary", "acts on m2", "brings W"], &rows)
}

fn enclosures(model: &MeshedMachine, state: &SteadyState) -> String {
    let mut text = String::new();
    for (e, heats) in model.network.enclosures.iter().zip(enclosure_heats(&model.network, &state.solution.temperatures)) {
        let to_chamber = ("chamber".to_string(), -heats.iter().sum::<f64>());
        let rows = e.surfaces.iter().cloned().zip(heats.iter().copied()).chain([to_chamber]);
        let rows: Vec<Vec<String>> = rows.map(|(name, heat)| vec![name, format!("{heat:+.3}")]).collect();
        text += &block(&[&format!("enclosure {}", e.name), "gives off W"], &rows);
    }
    text
}

/// The heat balance, and notes on boundaries.
fn balance(model: &MeshedMachine, state: &SteadyState) -> String {
    let balance = &state.solution.balance;
    let text = format!(
        "\nheat in {:.4} W, out {:.4} W, open {:.1e}; radiation {:+.3} W, gas {:+.3} W, coolant {:+.3} W (positive is into the machine)\n",
        balance.in_watts,
        balance.out_watts,
        balance.relative,
        balance.radiation,
        balance.gas,
        balance.circuits.iter().sum::<f64>()
    );
    text + &model.notes(state).into_iter().map(|note| format!("note: {note}\n")).collect::<String>()
}
