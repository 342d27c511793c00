//! Rough surfaces pressed together: solid spots, gap gas and radiation in parallel.

use super::super::geometry::two_emissivities;
use super::{Interface, Law, Slope};
use crate::schema::{ChangeReach, Key, KeyTable, Unit, Unstated, ValueForm};
use coldplate_base::document::Section;
use coldplate_base::error::Result;
use coldplate_base::units::Dimension;
use coldplate_physics::contact::{self, AIR_MEAN_FREE_PATH, Asperities, Conductivity, GapGas, Rough, rarefaction_length};

const MICROMETRES: Unit = Unit::of(Dimension::LENGTH, "um");
const MEGAPASCALS: Unit = Unit::of(Dimension::PRESSURE, "MPa");
const PASCALS: Unit = Unit::of(Dimension::PRESSURE, "Pa");
const CONDUCTIVITY: Unit = Unit::of(Dimension::CONDUCTIVITY, "W/(m K)");

pub(super) const KEYS: &[Key] = &[Key::new(
    "rough",
    ValueForm::Table(&ROUGH),
    "Cooper, Mikic and Yovanovich: `{ roughness, slope, hardness, pressure }`; `modulus` instead of `hardness` for elastic contact \
     (Mikic)",
)
.reaching(ChangeReach::Contact)];

/// Energy accommodation coefficient of the gas between rough surfaces.
const ACCOMMODATION: Key =
    Key::new("accommodation", ValueForm::Number, "energy accommodation coefficient").or(Unstated::Si(0.9)).reaching(ChangeReach::Contact);
/// Conductivity of the gas between rough surfaces.
const GAS_CONDUCTIVITY: Key = Key::new("conductivity", ValueForm::Quantity(CONDUCTIVITY), "of the gas in bulk")
    .positive()
    .or(Unstated::Si(0.026))
    .reaching(ChangeReach::Contact);

const GAS: KeyTable = KeyTable {
    doc: "gas between rough surfaces",
    keys: &[&[
        Key::new("pressure", ValueForm::Quantity(PASCALS), "of the gas").required().positive().reaching(ChangeReach::Contact),
        GAS_CONDUCTIVITY,
        Key::new("gap", ValueForm::Quantity(MICROMETRES), "mean distance between the surfaces")
            .positive()
            .or(Unstated::Follows("from the law"))
            .reaching(ChangeReach::Contact),
        ACCOMMODATION,
        Key::new("rarefaction", ValueForm::Quantity(MICROMETRES), "rarefaction length at 1 atm")
            .positive()
            .or(Unstated::Follows("from the accommodation, for air"))
            .reaching(ChangeReach::Contact),
    ]],
    one_of: &[],
};

const ROUGH: KeyTable = KeyTable {
    doc: "two rough, flat surfaces pressed together",
    keys: &[&[
        Key::new("roughness", ValueForm::Quantity(MICROMETRES), "combined roughness (s1² + s2²)^(1/2)")
            .required()
            .positive()
            .reaching(ChangeReach::Contact),
        Key::new("slope", ValueForm::Number, "combined mean absolute asperity slope").required().positive().reaching(ChangeReach::Contact),
        Key::new("pressure", ValueForm::Quantity(MEGAPASCALS), "contact pressure")
            .required()
            .positive()
            .reaching(ChangeReach::Contact)
            .usual(),
        Key::new("hardness", ValueForm::Quantity(MEGAPASCALS), "microhardness of the softer side")
            .positive()
            .reaching(ChangeReach::Contact),
        Key::new("modulus", ValueForm::Quantity(MEGAPASCALS), "or, for elastic contact, the effective modulus")
            .positive()
            .reaching(ChangeReach::Contact),
        Key::new("emissivity", ValueForm::List(&ValueForm::Number, Some(2)), "of the two, for radiation across the gap")
            .reaching(ChangeReach::Contact),
        Key::new("gas", ValueForm::Table(&GAS), "gas in the gap").or(Unstated::Follows("vacuum")).reaching(ChangeReach::Contact),
    ]],
    one_of: &["hardness", "modulus"],
};

pub(super) fn read(section: &Section<'_>) -> Result<Rough> {
    let section = section.section(KEYS[0].name)?;
    let asperities = match section.one_of(&["hardness", "modulus"])? {
        Some("hardness") => Asperities::Plastic { hardness: section.positive("hardness", Dimension::PRESSURE)? },
        Some(_) => Asperities::Elastic { modulus: section.positive("modulus", Dimension::PRESSURE)? },
        None => {
            let help = "give the microhardness of the softer side, hardness = \"1.3 GPa\", or for elastic contact the effective modulus";
            return Err(section.error_at("hardness", "'hardness' is missing").help(help));
        }
    };
    let gas = match section.opt_section("gas")? {
        None => None,
        Some(gas) => {
            let accommodation = ACCOMMODATION.read(&gas)?;
            if !(accommodation > 0.0 && accommodation <= 1.0) {
                return Err(gas
                    .error_at("accommodation", "an accommodation coefficient lies above 0 and at most at 1")
                    .help("0.9 for machined metal in air"));
            }
            // Air: ratio of heat capacities 1.4, Prandtl number 0.71.
            let of_air = rarefaction_length([accommodation; 2], 1.4, 0.71, AIR_MEAN_FREE_PATH);
            let read = GapGas {
                conductivity: GAS_CONDUCTIVITY.read(&gas)?,
                pressure: gas.positive("pressure", Dimension::PRESSURE)?,
                gap: gas.opt_positive("gap", Dimension::LENGTH)?,
                rarefaction: gas.opt_positive("rarefaction", Dimension::LENGTH)?.unwrap_or(of_air),
            };
            gas.finish()?;
            Some(read)
        }
    };
    let radiating = section.opt("emissivity").map(|value| two_emissivities(&value)).transpose()?;
    let read = Rough {
        roughness: section.positive("roughness", Dimension::LENGTH)?,
        slope: section.positive("slope", Dimension::NUMBER)?,
        asperities,
        pressure: section.positive("pressure", Dimension::PRESSURE)?,
        gas,
        emissivity: radiating,
    };
    section.finish()?;
    Ok(read)
}

impl Law for Rough {
    fn conductance(&self, at: &Interface) -> Slope {
        // A lumped side has no conductivity of its own: the spots take the conductivity of the other side for both.
        let [a, b] = at.conductivities;
        let either = a.or(b).unwrap_or(Slope::constant(f64::INFINITY));
        let sides = [a, b].map(|side| side.unwrap_or(either)).map(|k| Conductivity { value: k.value, slope: k.slope });
        let (value, slope) = contact::conductance_with_slope(self, sides, at.temperature);
        Slope { value, slope }
    }

    // Gap gas and radiation across the gap depend on temperature; the conductivities are checked elsewhere.
    fn follows_temperature(&self) -> bool {
        self.gas.is_some() || self.emissivity.is_some()
    }

    fn refusal_at_node(&self, _: bool) -> Option<&'static str> {
        Some("a lumped node has no conductivity for the law of rough surfaces")
    }

    fn note(&self) -> Option<&'static str> {
        contact::note(self)
    }
}
