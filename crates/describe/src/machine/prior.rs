//! How large causes of an error usually are, by kind: one record, each number with its unit, its reason and its source. `coldplate diagnose`
//! takes them as standard deviations before anything is measured; `[prior]` in a machine file states others.

use super::keys::{AREA, AREA_RESISTANCE, CONDUCTANCE, FILM, KELVIN, PASCALS, SECONDS, WATTS};
use crate::schema::{ChangeReach, Key, KeyTable, Unit, Unstated, ValueForm};
use coldplate_base::document::Section;
use coldplate_base::error::Result;

/// Declares the record, the keys of `[prior]` with its defaults, and the reader.
macro_rules! priors {
    ($($(#[doc = $doc:literal])+ $field:ident: $form:expr, $usual:literal;)+) => {
        /// Standard deviations of causes before anything is measured, SI, by kind. A logarithm of 0.7 is a factor of two.
        #[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
        pub struct Priors {
            $($(#[doc = $doc])+ pub $field: f64,)+
        }

        impl Default for Priors {
            fn default() -> Self {
                Self { $($field: $usual,)+ }
            }
        }

        /// `[prior]`
        pub(super) const PRIOR: KeyTable = KeyTable {
            doc: "how large causes of an error usually are: standard deviations for `diagnose`",
            keys: &[&[$(
                Key::new(stringify!($field), $form, concat!($($doc),+).trim_ascii_start()).positive().or(Unstated::Si($usual)).reaching(ChangeReach::Report),
            )+]],
            one_of: &[],
        };

        /// Reads `[prior]`.
        pub(super) fn priors(root: &Section<'_>) -> Result<Priors> {
            let section = root.section_or_empty("prior")?;
            let read = |name: &str| PRIOR.key(name).map_or(Ok(0.0), |key| key.read(&section));
            let found = Priors { $($field: read(stringify!($field))?,)+ };
            section.finish()?;
            Ok(found)
        }
    };
}

const fn of(unit: Unit) -> ValueForm {
    ValueForm::Quantity(unit)
}

const SHARE: ValueForm = ValueForm::Number;

priors! {
    /// contact, logarithm: joints of one drawing differ by a factor of two; correlations for flat ones hold to 20 to 50 % (Yovanovich 1981)
    contact: SHARE, 0.7;
    /// the same per 10 K, where a contact follows its temperature: bolts and housing expand differently, a third of the pressure in 10 K
    contact_drift: SHARE, 0.3;
    /// film of a channel or a boundary, logarithm: correlations hold to 10 % turbulent and to 30 % at Reynolds numbers of 2300 to 6000
    /// (Gnielinski 2013); entrances, bends and dirt are as much again
    film: SHARE, 0.4;
    /// scale on the wall of a channel: cooling water leaves 1e-4 to 4e-4 m2 K/W (fouling resistances of TEMA)
    scale: of(AREA_RESISTANCE), 2e-4;
    /// loss of a narrowed channel among parallel ones, in its own loss coefficients: four times the loss is half the flow
    split: SHARE, 3.0;
    /// flow of a circuit, logarithm: a valve that is a quarter shut, a pump that ages, a meter of other units
    flow: SHARE, 0.3;
    /// inlet temperature of a circuit, and heat that its line takes up: chillers hold theirs to some tenths of a kelvin, metres away
    inlet: of(KELVIN), 0.3;
    /// heat that the model lacks, as a share of all heat of the machine: bearings, seals, cables and pumps that nobody counted
    added_heat: SHARE, 0.05;
    /// the same at least: what a fan, a brake or an encoder gives
    least_added_heat: of(WATTS), 1.0;
    /// heat of a source, as a share: friction is half to three times what catalogues say (SKF 2018: load, grease and preload)
    source: SHARE, 0.8;
    /// the same per 10 K, where a source follows its temperature: copper loses 4 % more, grease up to a third less
    source_drift: SHARE, 0.15;
    /// conductivity of a material, logarithm: alloys of one name differ by a third (handbooks of steels and aluminium)
    conductivity: SHARE, 0.3;
    /// emissivity, logarithm: metals of one name differ by half with roughness and oxide (Siegel and Howell)
    emissivity: SHARE, 0.4;
    /// temperature of the chamber or of another column about the machine: its sensor sees one place of a wall that has many
    surroundings: of(KELVIN), 0.7;
    /// residual gas: a pump that does not reach its pressure; a pascal conducts a third of what radiates
    gas: of(PASCALS), 1.0;
    /// path to the surroundings that the model lacks: a hose, a bundle of cables and a bracket; a cable alone is 2 to 10 mW/K
    leak: of(CONDUCTANCE), 0.1;
    /// path between two parts that do not touch in the model: a cover, a screw, a belt
    link: of(CONDUCTANCE), 0.3;
    /// film in a room of faces that the model has adiabatic: free convection and radiation are 5 to 10 W/(m2 K)
    room_film: of(FILM), 5.0;
    /// area with which a lumped node faces the room: a plate of 140 mm
    room_area: of(AREA), 0.02;
    /// area of exchange by radiation between two parts that do not see each other in the model: likewise
    exchange_area: of(AREA), 0.02;
    /// heat capacity, as a share of the model's: what is bolted on or hollow; a part of no mass in the model has that of a solid at least
    capacity: SHARE, 0.5;
    /// offset of a sensor: class B is within 0.3 K at room temperature (IEC 60751), a thermocouple and its cold end within half a kelvin
    sensor_offset: of(KELVIN), 0.3;
    /// gain of a sensor, as a share: far from where it was calibrated it is off by one per cent
    sensor_gain: SHARE, 0.01;
    /// share of the surroundings in what a badly attached sensor shows: glued ones show a hundredth, loose ones a third
    sensor_surroundings: SHARE, 0.1;
    /// time constant of a sensor: glued ones take 5 s, those in a pocket or behind tape minutes
    sensor_lag: of(SECONDS), 60.0;
    /// a factor on all films, emissivities, contacts or flows, logarithm: one correlation, one paint, one torque, one pump
    all_factors: SHARE, 0.3;
    /// a factor on all heats, as a share: one supply, one efficiency
    all_heats: SHARE, 0.2;
    /// an offset of all inlets: one chiller
    all_inlets: of(KELVIN), 0.5;
}
