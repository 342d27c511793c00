//! Laws of the heat flow through a contact: one file per law.
//!
//! A law's file holds everything special to the law: its keys in the machine file and their reading, the conductance
//! and its derivative, and the contacts for which the law cannot be used. To add a law, write its file and name it here
//! twice: among the modules and in the list of laws.

mod bonded;
mod conductance;
mod insulated;
mod of_pressure;
mod of_temperature;
mod rough;
mod total;

pub use bonded::Bonded;
pub use conductance::Conductance;
pub use insulated::Insulated;
pub use of_pressure::OfPressure;
pub use of_temperature::OfTemperature;
pub use total::Total;

use super::slope::Slope;
use crate::schema::Key;
use coldplate_base::document::Section;
use coldplate_base::error::Result;

/// Properties of the interface at which a law acts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Interface {
    /// True area of the whole contact, m².
    pub area: f64,
    /// Mean temperature of the interface, K.
    pub temperature: f64,
    /// Conductivities of the two bodies; `None` for a lumped node.
    pub conductivities: [Option<Slope>; 2],
}

/// Interface of a contact law.
pub(super) trait Law {
    /// Conductance, W/(m² K), infinite for a perfect joint, with its derivative with respect to the mean temperature.
    fn conductance(&self, at: &Interface) -> Slope;

    /// Whether the conductance depends on the temperature.
    fn follows_temperature(&self) -> bool {
        false
    }

    /// Whether imported meshes may also be joined along the interface, which makes them second-order accurate there.
    fn joins_along(&self) -> bool {
        true
    }

    /// Whether the law states the conductance of the whole contact: no area may be stated beside it.
    fn is_total(&self) -> bool {
        false
    }

    /// Reason why the law cannot hold for a contact with a lumped node, if it cannot; `has_area` says whether an area
    /// is stated.
    fn refusal_at_node(&self, has_area: bool) -> Option<&'static str> {
        (!has_area).then_some("a contact with a lumped node needs its area")
    }

    /// Doubt about the law with these numbers, if there is one.
    fn note(&self) -> Option<&'static str> {
        None
    }
}

/// Makes the enum of laws, and the functions that distinguish all of them, from one list.
macro_rules! laws {
    ($($(#[$doc:meta])* $name:ident($law:ty) in $file:ident;)*) => {
        /// Law of the heat flow through a contact.
        #[derive(Debug, Clone, PartialEq)]
        pub enum ContactLaw {$(
            $(#[$doc])*
            $name($law),
        )*}

        /// Number of laws.
        pub(super) const COUNT: usize = [$($file::KEYS.len()),*].len();
        /// The keys of each law; the first one states the law.
        pub(super) const KEYS: [&[Key]; COUNT] = [$($file::KEYS),*];
        /// The keys that each state a law.
        pub(super) const NAMES: &[&str] = &[$($file::KEYS[0].name),*];

        impl ContactLaw {
            /// Reads the law of a table, if it states one.
            ///
            /// # Errors
            /// The table states two laws, or its numbers cannot be used.
            pub(super) fn read(section: &Section<'_>) -> Result<Option<Self>> {
                let stated = section.one_of(NAMES)?;
                $(if stated == Some($file::KEYS[0].name) {
                    return $file::read(section).map(|law| Some(Self::$name(law)));
                })*
                Ok(None)
            }

            fn law(&self) -> &dyn Law {
                match self {$(Self::$name(law) => law,)*}
            }
        }
    };
}

laws! {
    /// Constant conductance per area.
    Conductance(Conductance) in conductance;
    /// Constant conductance of the whole contact.
    Total(Total) in total;
    /// Conductance against the mean temperature of the interface.
    OfTemperature(OfTemperature) in of_temperature;
    /// Conductance against contact pressure.
    OfPressure(OfPressure) in of_pressure;
    /// Solid spots of rough surfaces with gap gas and radiation in parallel.
    Rough(coldplate_physics::contact::Rough) in rough;
    /// Perfect joint.
    Bonded(Bonded) in bonded;
    /// No heat crosses.
    Insulated(Insulated) in insulated;
}

impl ContactLaw {
    /// The keys that each state a law, in the order of the laws.
    pub fn names() -> &'static [&'static str] {
        NAMES
    }

    /// Conductance, W/(m² K), with its derivative with respect to the mean temperature; infinite where bonded.
    pub fn conductance(&self, at: &Interface) -> Slope {
        self.law().conductance(at)
    }

    /// Whether the conductance depends on the temperature.
    pub fn follows_temperature(&self) -> bool {
        self.law().follows_temperature()
    }

    /// Whether imported meshes may also be joined along the interface.
    pub fn joins_along(&self) -> bool {
        self.law().joins_along()
    }

    /// Whether the law states the conductance of the whole contact, W/K.
    pub fn is_total(&self) -> bool {
        self.law().is_total()
    }

    /// Whether the joint has no resistance.
    pub fn is_bonded(&self) -> bool {
        matches!(self, Self::Bonded(_))
    }

    /// Reason why the law cannot hold for a contact with a lumped node, if it cannot.
    pub(super) fn refusal_at_node(&self, has_area: bool) -> Option<&'static str> {
        self.law().refusal_at_node(has_area)
    }

    /// Doubt about the law with these numbers, if there is one.
    pub fn note(&self) -> Option<&'static str> {
        self.law().note()
    }
}

/// Refuses `false` under a key that can only be true.
fn must_be_true(section: &Section<'_>, key: &str) -> Result<()> {
    if section.flag(key)? {
        return Ok(());
    }
    Err(section.error_at(key, format!("'{key}' can only be true")).help("remove it and give another law"))
}
