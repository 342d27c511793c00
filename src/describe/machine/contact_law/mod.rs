//! How heat crosses a contact: one file per law.
//!
//! A law's file holds all that is the law's own: its keys in the machine file, how they are read, the conductance and
//! its derivative, and where the law cannot be used. To add a law, write its file and name it here twice: among the
//! modules and in the list of laws.

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

use super::Slope;
use crate::describe::schema::Key;
use crate::error::Result;
use crate::foundation::document::Section;

/// What a law may know of the place where it acts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Interface {
    /// True area of the whole contact, m².
    pub area: f64,
    /// Mean temperature of the interface, K.
    pub temperature: f64,
    /// Conductivities of the two bodies; `None` for a lumped node.
    pub conductivities: [Option<Slope>; 2],
}

/// What every law answers.
pub(super) trait Law {
    /// Conductance, W/(m² K), infinite for a perfect joint, with its derivative with respect to the mean temperature.
    fn conductance(&self, at: &Interface) -> Slope;

    /// Whether the conductance follows the temperature.
    fn follows_temperature(&self) -> bool {
        false
    }

    /// Whether imported meshes may also be joined along the interface, which makes them second-order accurate there.
    fn joins_along(&self) -> bool {
        true
    }

    /// Whether it is stated for the contact as a whole, so that no area may be stated beside it.
    fn is_total(&self) -> bool {
        false
    }

    /// Why it cannot hold for a contact with a lumped node, if it cannot; `has_area` says whether an area is stated.
    fn refusal_at_node(&self, has_area: bool) -> Option<&'static str> {
        (!has_area).then_some("a contact with a lumped node needs its area")
    }

    /// What is doubtful about the law with these numbers, if anything.
    fn note(&self) -> Option<&'static str> {
        None
    }
}

/// Makes the enum of laws and what goes through all of them from one list.
macro_rules! laws {
    ($($(#[$doc:meta])* $name:ident($law:ty) in $file:ident;)*) => {
        /// How heat crosses a contact.
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
            /// It states two, or its numbers cannot be used.
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
    Rough(crate::physics::contact::Rough) in rough;
    /// Perfect.
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

    /// Whether the conductance follows the temperature.
    pub fn follows_temperature(&self) -> bool {
        self.law().follows_temperature()
    }

    /// Whether imported meshes may also be joined along the interface.
    pub fn joins_along(&self) -> bool {
        self.law().joins_along()
    }

    /// Whether it is stated for the contact as a whole, W/K.
    pub fn is_total(&self) -> bool {
        self.law().is_total()
    }

    /// Whether nothing resists.
    pub fn is_bonded(&self) -> bool {
        matches!(self, Self::Bonded(_))
    }

    /// Why it cannot hold for a contact with a lumped node, if it cannot.
    pub(super) fn refusal_at_node(&self, has_area: bool) -> Option<&'static str> {
        self.law().refusal_at_node(has_area)
    }

    /// What is doubtful about the law with these numbers, if anything.
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
