//! Coolant: one-way fluid conductors (GF) along channels, exchanging heat with the wall both ways.
//!
//! A channel is a chain of stations. Water enters station k at the temperature of node k-1 and leaves it at node k. With the wall at
//! the conductance-weighted mean T_s of the cells the station touches, the plug-flow solution T_k = T_s + (T_{k-1} - T_s) exp(-UA/C) is
//! exact for a wall that is uniform over the station; the heat is shared among the cells in proportion to their conductances. The water
//! gains exactly the heat that the cells lose.

use super::split::Split;
use super::{Load, NONE, Network};
use crate::mesh::path::Station;
use coldplate_base::error::{Kind, Result};
use coldplate_base::formula::Formula;
use coldplate_describe::machine::{Circuit, FilmSource, FlowState, Intake, Layout};
use coldplate_physics::channel::{self, StraightChannel};
use coldplate_physics::water::LiquidProperties;

/// A coolant channel in the network.
#[derive(Debug, Clone)]
pub struct Stream {
    /// Name of the channel.
    pub name: String,
    /// Circuit it belongs to.
    pub circuit: usize,
    /// Stations from inlet to outlet.
    pub stations: Vec<Station>,
    /// Weight of the water after each station in the mean along the channel, m; empty: the stations' lengths.
    pub water_weights: Vec<f64>,
    /// Node of the water leaving the first station; the others follow.
    pub first_node: u32,
    /// Streams whose mixed outflow enters, of this circuit or of those that feed it; empty means the circuit's inlet.
    pub upstream: Vec<usize>,
    /// Conductivities of the wall: index of the first of three in the network's properties.
    pub property: u32,
    /// Hydraulic diameter, m.
    pub diameter: f64,
    /// Wetted length, m.
    pub length: f64,
    /// Factor on the film: fouling, or a correlation known to be off.
    pub film_factor: f64,
    /// Resistance of scale on the wall, in series with the film, m² K/W.
    pub fouling_resistance: f64,
    /// Loss coefficients of bends, inlet and outlet.
    pub minor_loss: f64,
    /// Wall roughness, m.
    pub roughness: f64,
    /// How the film is found.
    pub film: FilmSource,
}

/// A circuit: its layout over streams.
#[derive(Debug, Clone)]
pub struct CircuitTree {
    /// The circuit as described.
    pub circuit: Circuit,
    /// Layout with stream indices (equal to the machine's channel indices).
    pub layout: Layout,
}

/// Temperatures (K) through which the state of a stream depends on those of the nodes.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct StreamMeans {
    /// Mean of the wall, weighted by length.
    pub wall: f64,
    /// Mean of the water, weighted by length.
    pub water: f64,
    /// Water that leaves the last station.
    pub leaving: f64,
}

/// The state of a stream at one condition and one estimate of the temperatures.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct StreamState {
    /// Heat capacity rate m c, W/K, with the mean specific heat between the water that enters the channel and the water that leaves it:
    /// times the rise of the temperature it is the rise of the enthalpy.
    pub capacity_rate: f64,
    /// Mass flow, kg/s.
    pub mass_flow: f64,
    /// Volume flow, m³/s.
    pub flow: f64,
    /// Weight of each upstream stream's temperature in the inlet mixture, such that enthalpy is conserved.
    pub mixture: Vec<f64>,
    /// For each station the exchange C (1 - exp(-UA/C)), W/K.
    pub exchange: Vec<f64>,
    /// For each station the conductance between water and cells, UA, W/K.
    pub conductance: Vec<f64>,
    /// Heat capacity of a cubic metre, J/(m³ K): density at the inlet, mean specific heat of the channel.
    pub volumetric_capacity: f64,
    /// Heat of viscous dissipation per metre, W/m.
    pub dissipation: f64,
    /// Reynolds number.
    pub reynolds: f64,
    /// Film coefficient, W/(m² K).
    pub film: f64,
    /// Pressure drop, Pa.
    pub pressure_drop: f64,
    /// A remark where a closure leaves its range.
    pub note: Option<&'static str>,
}

/// Rounds of a mixture's temperature. Chosen: far above the dozen that the specific heats of liquids take to rounding.
const MOST_MIXING_ROUNDS: usize = 50;

/// The liquid that a stream carries.
struct Carried {
    /// Properties at the mean temperature of the water.
    liquid: LiquidProperties,
    /// Mass flow, kg/s.
    mass_flow: f64,
    /// Mean specific heat between inlet and outlet of the channel, J/(kg K).
    specific_heat: f64,
    /// Density at the circuit's inlet, kg/m³.
    inlet_density: f64,
}

/// Largest pressure drop of a channel without a remark, Pa. Chosen: above every pump of a cooling circuit.
const LARGEST_DROP: f64 = 5e6;

impl Stream {
    /// Node of the water leaving the last station.
    pub fn outlet(&self) -> u32 {
        self.first_node + self.stations.len() as u32 - 1
    }

    /// The temperatures (K) through which the state of the stream depends on those of the nodes; the wall is on the side of the cells.
    pub fn means(&self, temperatures: &[f64]) -> StreamMeans {
        let (mut wall, mut water, mut length) = (0.0, 0.0, 0.0);
        for (k, station) in self.stations.iter().enumerate() {
            let cells: f64 = station.cells.iter().map(|(n, w)| w * temperatures[*n]).sum();
            wall += station.length * cells;
            water += self.water_weights.get(k).unwrap_or(&station.length) * temperatures[self.first_node as usize + k];
            length += station.length;
        }
        StreamMeans { wall: wall / length, water: water / length, leaving: temperatures[self.outlet() as usize] }
    }

    /// Share of a station's exchange that each of its cells has: proportional to the wall it holds.
    pub fn shares(station: &Station) -> impl Iterator<Item = (usize, f64)> + '_ {
        station.cells.iter().copied()
    }
}

impl Network {
    /// The state of every stream, from the flows of `load` and the current temperatures (K).
    ///
    /// # Errors
    /// Water outside its property range, or a flow split that does not converge; both name the circuit.
    pub fn stream_states(&self, load: &Load, temperatures: &[f64]) -> Result<Vec<StreamState>> {
        let means: Vec<StreamMeans> = self.streams.iter().map(|s| s.means(temperatures)).collect();
        let mut states = vec![StreamState::default(); self.streams.len()];
        for circuit in 0..self.circuits.len() {
            self.circuit_states(circuit, load, temperatures, &means, &mut states)?;
        }
        Ok(states)
    }

    /// The states of one circuit's streams, with the means of all streams given apart from the temperatures themselves:
    /// films, water properties, flow split and mixing depend on the means alone.
    ///
    /// # Errors
    /// Errors of [`Network::stream_states`].
    pub fn circuit_states(
        &self,
        c: usize,
        load: &Load,
        temperatures: &[f64],
        means: &[StreamMeans],
        states: &mut [StreamState],
    ) -> Result<()> {
        let tree = &self.circuits[c];
        let name = &tree.circuit.name;
        let at = |t: f64| {
            tree.circuit.liquid.at(t).map_err(|e| {
                let key = format!("circuit.{name}");
                if e.kind() == Kind::Input { e.at_key(key) } else { e }
            })
        };
        let density = self.entering_density(c, load, &at)?;
        let (low, high) = tree.circuit.liquid.range();
        let total = load.flows[c];
        // Mass is conserved along the circuit; volume flow is stated at the inlet.
        let mass_flow = total * density;
        let mut flows = vec![0.0; self.streams.len()];
        let mut liquids = vec![None; self.streams.len()];
        for s in members(&tree.layout) {
            // Water at rest carries nothing, at any temperature. On the way to a solution the mean may stray; `Network::check_coolant`
            // refuses a solution outside the range.
            let mean = if total > 0.0 { means[s].water.clamp(low, high) } else { load.inlets[c] };
            liquids[s] = Some(at(mean)?);
        }
        let split = Split { network: self, given: &load.branches[c], density, liquids: &liquids };
        split.distribute(&tree.layout, mass_flow, &mut flows).map_err(|e| e.at_key(format!("circuit.{name}.layout")))?;
        for s in members(&tree.layout) {
            let Some(liquid) = liquids[s] else { continue };
            let (entering, mixture) = self.mixture(s, load, &flows, means, states);
            let carried = Carried {
                liquid,
                mass_flow: flows[s],
                specific_heat: tree.circuit.liquid.mean_specific_heat(entering, means[s].leaving),
                inlet_density: density,
            };
            states[s] = self.stream_state(s, load, &carried, mixture, means[s].wall, temperatures)?;
        }
        Ok(())
    }

    /// Density (kg/m³) at the inlet of a circuit, such that inflow from other circuits keeps its volume and mass.
    fn entering_density(&self, c: usize, load: &Load, at: &impl Fn(f64) -> Result<LiquidProperties>) -> Result<f64> {
        let own = at(load.inlets[c])?.density;
        let (mut volume, mut mass) = (0.0, 0.0);
        for feeder in self.circuits[c].circuit.intake.feeders() {
            volume += load.flows[*feeder];
            mass += load.flows[*feeder] * self.entering_density(*feeder, load, at)?;
        }
        Ok(if volume == 0.0 { own } else { mass / volume })
    }

    /// Temperature (K) of the water that enters a stream, and the weights of the upstream streams' temperatures in it, from the mass
    /// flows (kg/s) of its own circuit: sum m_i (h(T_i) - h(T)) = 0.
    fn mixture(&self, s: usize, load: &Load, flows: &[f64], means: &[StreamMeans], states: &[StreamState]) -> (f64, Vec<f64>) {
        let stream = &self.streams[s];
        let leaving = |u: &usize| means[*u].leaving;
        let brings = |u: &usize| if self.streams[*u].circuit == stream.circuit { flows[*u] } else { states[*u].mass_flow };
        let masses: Vec<f64> = match stream.upstream.iter().map(brings).sum::<f64>() {
            flow if flow > 0.0 => stream.upstream.iter().map(|u| brings(u) / flow).collect(),
            _ => vec![1.0 / stream.upstream.len() as f64; stream.upstream.len()],
        };
        let mixed = |weights: &[f64]| weights.iter().zip(&stream.upstream).map(|(w, u)| w * leaving(u)).sum::<f64>();
        let mut found = match stream.upstream.len() {
            0 => return (load.inlets[stream.circuit], masses),
            1 => return (mixed(&masses), masses),
            _ => (mixed(&masses), masses.clone()),
        };
        let liquid = &self.circuits[stream.circuit].circuit.liquid;
        // Each round gains a factor of the specific heats' relative difference; the first that changes nothing is the last.
        for _ in 0..MOST_MIXING_ROUNDS {
            let heats: Vec<f64> =
                masses.iter().zip(&stream.upstream).map(|(m, u)| m * liquid.mean_specific_heat(leaving(u), found.0)).collect();
            let all: f64 = heats.iter().sum();
            let weights: Vec<f64> = heats.into_iter().map(|heat| heat / all).collect();
            let before = std::mem::replace(&mut found, (mixed(&weights), weights)).0;
            if (found.0 - before).abs() <= f64::EPSILON * before {
                break;
            }
        }
        found
    }

    /// A circuit and all that it feeds, directly or by way of others, in their order.
    pub fn downstream(&self, c: usize) -> Vec<usize> {
        let mut found = vec![c];
        for (other, tree) in self.circuits.iter().enumerate().skip(c + 1) {
            if tree.circuit.intake.feeders().iter().any(|feeder| found.contains(feeder)) {
                found.push(other);
            }
        }
        found
    }

    /// Passes the outflow of circuits on to the circuits that they feed, after flows or inlet temperatures of `load` have been changed.
    pub fn pass_on(&self, load: &mut Load) {
        for (c, tree) in self.circuits.iter().enumerate() {
            let Some(offered) = tree.circuit.intake.offered(&load.flows, &load.inlets) else { continue };
            load.inlets[c] = offered.temperature;
            if matches!(tree.circuit.intake, Intake::Fed { flow: None, .. }) {
                load.flows[c] = offered.flow;
            }
        }
    }

    /// Conductance between the water of a station and its cells, W/K: the film (W/(m² K)), the way through the cells, and the scale on
    /// the wall.
    fn station_conductance(&self, stream: &Stream, station: &Station, film: f64, temperatures: &[f64]) -> f64 {
        let perimeter = std::f64::consts::PI * stream.diameter;
        let film_resistance = 1.0 / (film * perimeter * station.length);
        let cell: f64 = station.cells.iter().map(|(n, w)| w * temperatures[*n]).sum();
        let spread = if stream.property == NONE {
            0.0
        } else {
            let k = [0, 1, 2].map(|axis| self.properties[stream.property as usize + axis].at(cell));
            let across = if k[0] == k[1] && k[1] == k[2] {
                k[0]
            } else {
                k.iter().zip(station.across).map(|(k, weight)| weight * k.ln()).sum::<f64>().exp()
            };
            station.shape / (across * station.length)
        };
        let scale = stream.fouling_resistance / (perimeter * station.length);
        1.0 / ((film_resistance + spread).max(0.2 * film_resistance) + scale)
    }

    fn stream_state(
        &self,
        index: usize,
        load: &Load,
        carried: &Carried,
        mixture: Vec<f64>,
        wall: f64,
        temperatures: &[f64],
    ) -> Result<StreamState> {
        let Carried { liquid, mass_flow, .. } = *carried;
        let stream = &self.streams[index];
        let circuit = &self.circuits[stream.circuit].circuit;
        let flow = mass_flow / liquid.density;
        let velocity = flow / (std::f64::consts::PI / 4.0 * stream.diameter * stream.diameter);
        let reynolds = liquid.density * velocity * stream.diameter / liquid.viscosity;
        // A wall outside the range of the liquid's properties counts as at its end.
        let (low, high) = circuit.liquid.range();
        let at_wall = circuit.liquid.at(wall.clamp(low, high)).unwrap_or(liquid);
        let state = FlowState { reynolds, liquid, at_wall, diameter: stream.diameter, length: stream.length, velocity };
        let (film, note) = stream.film_coefficient(&state, load)?;
        let drop = stream.pressure_drop(mass_flow, liquid);
        let note = note.or((drop > LARGEST_DROP).then_some("its pressure drop is above 50 bar, more than pumps of cooling circuits give"));
        let rate = mass_flow * carried.specific_heat;
        let conductance: Vec<f64> = stream.stations.iter().map(|k| self.station_conductance(stream, k, film, temperatures)).collect();
        let of_station = |ua: f64| if rate > 0.0 { -rate * (-ua / rate).exp_m1() } else { 0.0 };
        // Most stations of a channel are alike.
        let mut last = (f64::NAN, 0.0);
        let alike = |ua: &f64| {
            if *ua != last.0 {
                last = (*ua, of_station(*ua));
            }
            last.1
        };
        let exchange = conductance.iter().map(alike).collect();
        let dissipation = if circuit.dissipation { drop * flow / stream.length } else { 0.0 };
        Ok(StreamState {
            capacity_rate: rate,
            mass_flow,
            flow,
            mixture,
            exchange,
            conductance,
            volumetric_capacity: carried.inlet_density * carried.specific_heat,
            dissipation,
            reynolds,
            film,
            pressure_drop: drop,
            note,
        })
    }
}

impl Stream {
    /// Whether its film follows from a formula of the machine's variables.
    pub fn has_film_formula(&self) -> bool {
        matches!(self.film, FilmSource::Formula(_) | FilmSource::Nusselt(_))
    }

    /// Pressure drop (Pa) at a mass flow (kg/s).
    pub(super) fn pressure_drop(&self, mass_flow: f64, liquid: LiquidProperties) -> f64 {
        channel::pressure_drop(mass_flow / liquid.density, self.diameter, self.length, self.minor_loss, self.roughness, &liquid)
    }

    /// Film coefficient W/(m² K), mean over the channel, and a remark where the closure leaves its range.
    fn film_coefficient(&self, flow: &FlowState, load: &Load) -> Result<(f64, Option<&'static str>)> {
        let scale = flow.liquid.conductivity / self.diameter;
        let evaluate = |formula: &Formula| {
            // Liquid at rest conducts: no formula of a flow holds there.
            if flow.reynolds == 0.0 { Ok(None) } else { FilmSource::evaluate(formula, &load.names, flow).map(Some) }
        };
        let (film, note) = match &self.film {
            FilmSource::Given(h) => (*h, None),
            FilmSource::Correlation { bend_factor, wall } => {
                let (prandtl, prandtl_wall) = (flow.liquid.prandtl(), flow.at_wall.prandtl());
                let straight = StraightChannel { diameter: self.diameter, length: self.length, wall: *wall, velocity_developed: false };
                let nusselt = channel::nusselt(&straight, flow.reynolds, prandtl, prandtl_wall);
                (bend_factor * nusselt * scale, channel::note(&straight, flow.reynolds, prandtl, prandtl_wall))
            }
            FilmSource::Formula(formula) => (evaluate(formula)?.unwrap_or(STANDING_NUSSELT * scale), None),
            FilmSource::Nusselt(formula) => (evaluate(formula)?.unwrap_or(STANDING_NUSSELT) * scale, None),
        };
        Ok((self.film_factor * film, note))
    }
}

/// Nusselt number of liquid at rest between walls, dimensionless: the value of developed laminar flow along a wall of even temperature.
const STANDING_NUSSELT: f64 = 3.66;

/// The streams below a layout, in order.
pub fn members(layout: &Layout) -> Vec<usize> {
    match layout {
        Layout::Channel(s) => vec![*s],
        Layout::Series(items) | Layout::Parallel(items) => items.iter().flat_map(members).collect(),
    }
}
