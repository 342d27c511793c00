//! Radiation: the chamber's temperature, emissivities, surfaces that see each other; and the residual gas around them.

use super::file::{LEAST, temperature_table, text};
use super::ground::PathLaw;
use super::words::Quantity;
use super::{CommonFactor, Family, Group, Hypothesis, Law, Linearised, Lines, MachineEdit, Prepared, Site, Told, UserKind, along};
use coldplate_describe::machine::Chamber;
use coldplate_network::Load;
use coldplate_base::error::Result;
use coldplate_base::document::quoted;
use coldplate_physics::{gas, radiation::SIGMA};
use coldplate_solve::sensitivity::Disturbance;
use coldplate_solve::study::Study;

/// Pressure over which the film of residual gas is followed, Pa: it saturates where molecules meet before they cross to the wall.
const GAS: f64 = 1.0;
/// Temperature of a wall whose own cannot be evaluated, K.
const WALL: f64 = 293.15;
/// Emissivity of a black surface.
const BLACK: f64 = 1.0;
const PRESSURE: &str = "chamber.pressure";
const CHAMBER: &str = "chamber.temperature";

/// Radiation and residual gas.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Radiation {
    /// Temperature of the chamber, K.
    Chamber,
    /// Pressure of the residual gas, Pa more than the model has.
    Gas,
    /// Emissivity of a group, logarithm.
    Emissivity(u32),
    /// Exchange area between two groups, m².
    Exchange(u32, u32),
}

impl Radiation {
    /// Emissivities of all that radiates and has a number for it, and is free to move.
    pub(super) fn emissivities(study: &Study) -> Vec<Self> {
        let network = &study.model.network;
        let is_held = |node: u32| network.fixed.iter().any(|(held, _)| *held == node);
        let radiates = |g: u32| {
            let own = network.surfaces.iter().filter(|s| s.emissive > 0.0 && network.group[s.node as usize] == g);
            own.filter(|s| !is_held(s.node)).count() > 0
        };
        let groups = network.groups.iter().enumerate().map(|(g, name)| (g as u32, name));
        groups.filter(|(g, name)| radiates(*g) && emissivity_key(study, name).is_some()).map(|(g, _)| Self::Emissivity(g)).collect()
    }
}

impl Family for Radiation {
    fn candidates(site: &Site<'_>) -> Vec<Hypothesis> {
        if !site.is_in_vacuum {
            return Vec::new();
        }
        let prior = &site.machine.priors;
        let chamber = Hypothesis::signed(Self::Chamber, "chamber", Vec::new(), prior.surroundings, "K");
        let gas = Hypothesis::positive(Self::Gas, "chamber", Vec::new(), prior.gas, "Pa");
        let gas = Hypothesis { most: saturation(site, gas.largest()), ..gas };
        let radiates =
            |g: &&Group| site.network.surfaces.iter().any(|s| s.emissive > 0.0 && site.network.group[s.node as usize] == g.index);
        let radiating: Vec<Group> = site.groups.iter().filter(radiates).cloned().collect();
        let emissivity = |own: Self| {
            let Self::Emissivity(g) = own else { return None };
            let name = &site.network.groups[g as usize];
            let of_file = site.study.parameter(&emissivity_key(site.study, name)?).ok()?;
            // Black is the most: so many times more than the file has.
            let most = (BLACK / of_file.value - 1.0).max(0.0);
            Some(Hypothesis { most, ..Hypothesis::signed(own, name, vec![name.clone()], prior.emissivity, "ln") })
        };
        let exchange = |(a, b): (&Group, &Group)| {
            let parts = vec![a.name.clone(), b.name.clone()];
            Hypothesis::positive(Self::Exchange(a.index, b.index), parts.join(" - "), parts, prior.exchange_area, "m2")
        };
        let of_parts = Self::emissivities(site.study).into_iter().filter_map(emissivity);
        let of_pairs = site.apart(&radiating).into_iter().map(exchange);
        [chamber, gas].into_iter().chain(of_parts).chain(of_pairs).collect()
    }

    fn kind(&self) -> &'static str {
        match self {
            Self::Chamber => "chamber temperature",
            Self::Gas => "residual gas",
            Self::Emissivity(_) => "emissivity",
            Self::Exchange(..) => "radiative link",
        }
    }

    fn lines(&self, edit: &MachineEdit<'_>) -> Result<Lines> {
        match *self {
            Self::Chamber => edit.shifted(CHAMBER, edit.amplitude),
            // Beside what the file has.
            Self::Gas => {
                let pressure = edit.machine().chamber.pressure + edit.amplitude.max(0.0);
                Ok(Some(vec![(PRESSURE.into(), text(format!("{pressure:?} Pa")))]))
            }
            Self::Emissivity(g) => {
                let Some(key) = emissivity_key(edit.study, edit.group(g)) else { return Ok(None) };
                let parameter = edit.study.parameter(&key)?;
                let value = (parameter.value * edit.amplitude.exp()).clamp(1e-4, BLACK);
                Ok(parameter.to_set(value, edit.machine())?.map(|set| vec![set]))
            }
            // A radiation link of the file takes the faces it joins away from the chamber, which this does not. Between
            // temperatures T1 and T2 radiation is a conductance with the cube of their mean, but for a share of
            // ((T1 - T2) / (T1 + T2))²: a hundredth at 60 K.
            Self::Exchange(a, b) => {
                let ends = [a, b].map(|g| text(edit.group(g)));
                let (table, area) = (temperature_table(conductance), edit.positive());
                let value = format!("{{ between = [{}], {table}, area = \"{area:?} m2\" }}", ends.join(", "));
                Ok(Some(vec![(edit.added("contact"), value)]))
            }
        }
    }

    fn prepared(&self, study: &Study, _user: &[UserKind]) -> Option<Prepared> {
        match self {
            Self::Chamber => along(study, CHAMBER),
            // In a chamber without gas, faces that do not radiate are no surfaces yet.
            Self::Gas => {
                let pressure = study.model.machine.chamber.pressure.max(LEAST);
                let edited = study.edited(&[(PRESSURE.to_string(), text(format!("{pressure:?} Pa")))]).ok()?;
                Some(Prepared::Surfaces(edited.model.network.surfaces))
            }
            _ => None,
        }
    }

    fn disturbance(&self, at: &Linearised<'_, '_>) -> Option<Disturbance> {
        let chamber = &at.machine().chamber;
        match *self {
            Self::Chamber => Some(Disturbance { surroundings: 1.0, ..at.along()? }),
            Self::Gas => {
                let Some(Prepared::Surfaces(surfaces)) = at.prepared else { return None };
                let wall = at.load().chamber;
                let per_pascal = film_of_more(chamber, wall, GAS) / GAS;
                Some(at.screen.opened(surfaces, |s, t| per_pascal * s.gas_area * (t - wall)))
            }
            Self::Emissivity(g) => {
                // Of the emissivity that the file states: between walls that reflect, the effective one changes by less.
                let key = emissivity_key(at.at.study, &at.network().groups[g as usize])?;
                let stated = at.at.study.known_parameter(&key)?.value;
                let surfaces = at.screen.surfaces_of(g);
                let effective = surfaces.iter().find_map(|i| {
                    let surface = &at.network().surfaces[*i];
                    (surface.emissive > 0.0 && surface.gas_area > 0.0).then(|| surface.emissive / surface.gas_area)
                })?;
                Some(at.screen.emissivity(surfaces).times(effective / stated))
            }
            Self::Exchange(..) => None,
        }
    }

    fn quantity(&self, _law: Law) -> Quantity {
        match self {
            Self::Chamber => Quantity::plain("offset", "K"),
            Self::Gas => Quantity::plain("pressure", "Pa"),
            Self::Emissivity(_) => Quantity::factor("factor"),
            Self::Exchange(..) => Quantity::plain("exchange_area", "m2"),
        }
    }

    fn sentence(&self, told: &Told<'_>) -> String {
        match self {
            Self::Chamber => format!("the chamber wall is {}", told.warmer()),
            Self::Gas => format!("the chamber holds more residual gas than the model has: {}", told.range(" Pa")),
            Self::Emissivity(_) => format!("the emissivity of {} is {} times the model's", told.place(), told.range("")),
            Self::Exchange(..) => {
                let (places, area) = (told.both_places(), told.range(" m2 of exchange area"));
                format!("{places} see each other, which the model lacks: {area}")
            }
        }
    }

    fn path(&self) -> Option<([u32; 2], PathLaw)> {
        if let Self::Exchange(a, b) = *self { Some(([a, b], PathLaw::Radiation)) } else { None }
    }

    fn common_factor(&self) -> Option<CommonFactor> {
        matches!(self, Self::Emissivity(_)).then_some(CommonFactor::Emissivities)
    }
}

/// How much more film a further pressure (Pa) of residual gas makes, W/(m² K).
fn film_of_more(chamber: &Chamber, wall: f64, pressure: f64) -> f64 {
    let film = |pressure: f64| gas::film(pressure, wall, chamber.accommodation, chamber.gap);
    film(chamber.pressure + pressure) - film(chamber.pressure)
}

/// The pressure (Pa) at which the film, were it to go on as over its first pascal, is that of the largest pressure.
fn saturation(site: &Site<'_>, largest: f64) -> f64 {
    let wall = Load::at(site.machine, &site.data.rows[0].condition).map_or(WALL, |load| load.chamber);
    let chamber = &site.machine.chamber;
    GAS * film_of_more(chamber, wall, largest) / film_of_more(chamber, wall, GAS)
}

/// Radiation between black surfaces as a conductance at a mean temperature (K), W/(m² K).
fn conductance(mean: f64) -> f64 {
    4.0 * SIGMA * mean.powi(3)
}

fn emissivity_key(study: &Study, part: &str) -> Option<String> {
    let keys = ["effective_emissivity", "emissivity"];
    let own = keys.iter().map(|k| format!("part.{}.surface.{k}", quoted(part)));
    let node = keys.iter().map(|k| format!("node.{}.{k}", quoted(part)));
    own.chain(node).find(|key| study.known_parameter(key).is_some())
}
