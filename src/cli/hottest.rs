//! The hottest places of the parts of a machine.

use serde::Serialize;

use super::text::table;
use coldplate_base::units::celsius;
use coldplate_describe::machine::Machine;
use coldplate_network::mesh::Mesh;
use coldplate_network::mesh::hottest::Hottest;

/// The hottest place of a part.
#[derive(Debug, Serialize)]
#[allow(non_snake_case)]
pub struct HottestPlace {
    part: String,
    temperature_degC: f64,
    at_m: [f64; 3],
}

/// The hottest place of every part with cells.
pub fn hottest(machine: &Machine, mesh: &Mesh, temperatures: &[f64]) -> Vec<HottestPlace> {
    let place = |own: Hottest| HottestPlace {
        part: machine.parts[own.part].name.clone(),
        temperature_degC: celsius(own.temperature),
        at_m: own.at,
    };
    mesh.hottest(temperatures).into_iter().map(place).collect()
}

/// Table of the hottest places.
pub fn hottest_text(places: &[HottestPlace]) -> String {
    let row = |own: &HottestPlace| {
        let at = own.at_m.map(|x| format!("{:.1}", x * 1e3));
        [vec![own.part.clone(), format!("{:.3}", own.temperature_degC)], at.to_vec()].concat()
    };
    format!("\n{}", table(&["part, hottest", "degC", "x mm", "y mm", "z mm"], &places.iter().map(row).collect::<Vec<_>>()))
}
