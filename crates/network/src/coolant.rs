//! Limits of the coolant's laws: temperatures outside its properties, boiling, standing still.

use super::{Load, Network, StreamState};
use coldplate_base::error::{Error, Result};
use coldplate_base::units::ZERO_CELSIUS;

impl Network {
    /// Refuses temperatures (K) at which the liquid of a circuit boils, or flows where its properties are not known. Liquid at rest
    /// takes the temperature of its wall, and only its boiling matters.
    ///
    /// # Errors
    /// The liquid boils, or flows outside the range of its properties; channel, temperature and limit are named.
    pub fn check_coolant(&self, load: &Load, temperatures: &[f64]) -> Result<()> {
        for stream in &self.streams {
            let circuit = &self.circuits[stream.circuit].circuit;
            let along = &temperatures[stream.first_node as usize..=stream.outlet() as usize];
            let (coldest, hottest) = along.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), t| (low.min(*t), high.max(*t)));
            if let Some(boils) = circuit.liquid.boils_at(circuit.pressure).filter(|boils| hottest > *boils) {
                let how = if load.flows[stream.circuit] > 0.0 { "boils" } else { "stands still and boils" };
                return Err(Error::input(format!("the water in channel '{}' {how}", stream.name))
                    .at_key(format!("circuit.{}.pressure", circuit.name))
                    .read(format!(
                        "{:.2} degC; under {:.4} bar it boils at {:.2} degC",
                        hottest - ZERO_CELSIUS,
                        circuit.pressure / 1e5,
                        boils - ZERO_CELSIUS
                    ))
                    .help("raise the flow, lower the heat, or state the circuit's true absolute pressure"));
            }
            let (low, high) = circuit.liquid.range();
            if load.flows[stream.circuit] > 0.0 && (coldest < low || hottest > high) {
                let outside = if coldest < low { coldest } else { hottest };
                return Err(Error::input(format!("the liquid in channel '{}' leaves the range of its properties", stream.name))
                    .at_key(format!("circuit.{}.liquid", circuit.name))
                    .read(format!("{:.2} degC", outside - ZERO_CELSIUS))
                    .help(format!("its properties are known from {:.1} to {:.1} degC", low - ZERO_CELSIUS, high - ZERO_CELSIUS)));
            }
        }
        Ok(())
    }

    /// Remarks on each stream in a state (temperatures in K), if there are any.
    pub fn coolant_notes(&self, states: &[StreamState], temperatures: &[f64]) -> Vec<Option<String>> {
        let note = |(s, state): (usize, &StreamState)| {
            let mut notes: Vec<String> = state.note.map(str::to_string).into_iter().collect();
            if state.capacity_rate <= 0.0 {
                notes.push("no flow: the liquid stands still at the temperature of its wall and carries nothing".into());
            }
            notes.extend(self.boiling_wall(s, state, temperatures).map(|wall| self.boiling_note(s, wall)));
            (!notes.is_empty()).then(|| notes.join("; "))
        };
        states.iter().enumerate().map(note).collect()
    }

    /// Highest temperature (K) of the wall of a stream that flows, where it lies above the temperature at which the liquid boils.
    pub fn boiling_wall(&self, s: usize, state: &StreamState, temperatures: &[f64]) -> Option<f64> {
        let circuit = &self.circuits[self.streams[s].circuit].circuit;
        let boils = circuit.liquid.boils_at(circuit.pressure).filter(|_| state.capacity_rate > 0.0)?;
        Some(self.hottest_wall(s, state, temperatures)).filter(|hottest| *hottest > boils)
    }

    /// Remark on a stream's wall that reaches a temperature (K) at which the liquid boils.
    pub fn boiling_note(&self, s: usize, wall: f64) -> String {
        let circuit = &self.circuits[self.streams[s].circuit].circuit;
        let boils = circuit.liquid.boils_at(circuit.pressure).unwrap_or(f64::INFINITY);
        format!(
            "the wall reaches {:.2} degC and water boils at {:.2} degC under {:.4} bar: the film is one without bubbles",
            wall - ZERO_CELSIUS,
            boils - ZERO_CELSIUS,
            circuit.pressure / 1e5
        )
    }

    /// Highest temperature (K) of a stream's wall: between cell and liquid as their resistances share the drop.
    fn hottest_wall(&self, s: usize, state: &StreamState, temperatures: &[f64]) -> f64 {
        let stream = &self.streams[s];
        let of_station = |(k, station): (usize, &crate::mesh::path::Station)| {
            let water = temperatures[stream.first_node as usize + k];
            let cell: f64 = station.cells.iter().map(|(n, w)| w * temperatures[*n]).sum();
            let film = state.film * std::f64::consts::PI * stream.diameter * station.length;
            water + (cell - water) * (state.conductance[k] / film).min(1.0)
        };
        stream.stations.iter().enumerate().map(of_station).fold(f64::NEG_INFINITY, f64::max)
    }
}
