//! Dependence of a source's power on the temperature of the heated place: one file per law.
//!
//! A law's file holds everything special to the law: its keys in the machine file, their reading and refusals, the
//! power and its derivatives, and doubts about its numbers. To add a law, write its file and name it here twice: among
//! the modules and in the list of laws. A key belongs to one law, and a source states one law at most; without a law
//! its power is constant.

mod constant;
mod linear;

pub use constant::ConstantPower;
pub use linear::LinearPower;

use super::slope::Slope;
use crate::schema::Key;
use coldplate_base::document::Section;
use coldplate_base::error::Result;

/// Interface of a source law.
trait Law {
    /// Power (W) of a piece at its own temperature (K), for its share `base` (W) of the stated power.
    fn power(&self, base: f64, temperature: f64) -> Slope;

    /// Whether the power depends on the temperature.
    fn follows_temperature(&self) -> bool {
        false
    }

    /// The equivalent linear law, if a temperature coefficient may be stated.
    fn linear(&self) -> Option<LinearPower> {
        None
    }

    /// Doubt about the law with these numbers, if there is one.
    fn note(&self) -> Option<&'static str> {
        None
    }
}

/// Makes the enum of laws, and the functions that distinguish all of them, from one list.
macro_rules! laws {
    ($($(#[$doc:meta])* $name:ident($law:ty) in $file:ident;)*) => {
        /// Dependence of a source's power on the temperature of the heated place.
        #[derive(Debug, Clone, PartialEq)]
        pub enum SourceLaw {
            /// The stated power, at every temperature.
            Constant(ConstantPower),
            $($(#[$doc])* $name($law),)*
        }

        /// Number of laws that have keys.
        pub(super) const COUNT: usize = [$($file::KEYS.len()),*].len();
        /// The keys of each law that has keys.
        pub(super) const KEYS: [&[Key]; COUNT] = [$($file::KEYS),*];

        impl SourceLaw {
            /// Reads the law of a table.
            ///
            /// # Errors
            /// The table states two laws, or its numbers cannot be used.
            pub(super) fn read(section: &Section<'_>) -> Result<Self> {
                let stated = |keys: &&'static [Key]| keys.iter().map(|key| key.name).find(|name| section.has(name));
                section.one_of(&KEYS.iter().filter_map(stated).collect::<Vec<_>>())?;
                $(if let Some(law) = $file::read(section)? {
                    return Ok(Self::$name(law));
                })*
                Ok(Self::Constant(ConstantPower))
            }

            /// Power (W) of a piece at its own temperature (K), for its share `base` (W) of the stated power.
            pub fn power(&self, base: f64, temperature: f64) -> Slope {
                match self {
                    Self::Constant(law) => law.power(base, temperature),
                    $(Self::$name(law) => law.power(base, temperature),)*
                }
            }

            fn law(&self) -> &dyn Law {
                match self {
                    Self::Constant(law) => law,
                    $(Self::$name(law) => law,)*
                }
            }
        }
    };
}

laws! {
    /// The power changes linearly with the temperature.
    Linear(LinearPower) in linear;
}

impl SourceLaw {
    /// Whether the power depends on the temperature.
    pub fn follows_temperature(&self) -> bool {
        self.law().follows_temperature()
    }

    /// The equivalent linear law; `None` if no temperature coefficient can be stated beside the law.
    pub fn linear(&self) -> Option<LinearPower> {
        self.law().linear()
    }

    /// Doubt about the law with these numbers, if there is one.
    pub fn note(&self) -> Option<&'static str> {
        self.law().note()
    }
}
