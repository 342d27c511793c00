//! How the power of a source follows the temperature of what it heats: one file per law.
//!
//! A law's file holds all that is the law's own: its keys in the machine file, how they are read and what is refused,
//! the power and its derivatives, and what is doubtful about it. To add a law, write its file and name it here twice:
//! among the modules and in the list of laws. A key belongs to one law, and a source states one law at most; where it
//! states none, its power is constant.

mod constant;
mod linear;

pub use constant::ConstantPower;
pub use linear::LinearPower;

use super::Slope;
use crate::describe::schema::Key;
use crate::error::Result;
use crate::foundation::document::Section;

/// What every law answers.
trait Law {
    /// Power (W) of a piece with its own temperature (K), where `base` (W) is its share of the stated power.
    fn power(&self, base: f64, temperature: f64) -> Slope;

    /// Whether the power follows the temperature.
    fn follows_temperature(&self) -> bool {
        false
    }

    /// The same law as one of a linear change, where a coefficient of temperature may be stated.
    fn linear(&self) -> Option<LinearPower> {
        None
    }

    /// What is doubtful about the law with these numbers, if anything.
    fn note(&self) -> Option<&'static str> {
        None
    }
}

/// Makes the enum of laws and what goes through all of them from one list.
macro_rules! laws {
    ($($(#[$doc:meta])* $name:ident($law:ty) in $file:ident;)*) => {
        /// How the power of a source follows the temperature of what it heats.
        #[derive(Debug, Clone, PartialEq)]
        pub enum SourceLaw {
            /// The power as stated, at every temperature.
            Constant(ConstantPower),
            $($(#[$doc])* $name($law),)*
        }

        /// Number of laws that have keys.
        pub(super) const COUNT: usize = [$($file::KEYS.len()),*].len();
        /// The keys of each of them.
        pub(super) const KEYS: [&[Key]; COUNT] = [$($file::KEYS),*];

        impl SourceLaw {
            /// Reads the law of a table.
            ///
            /// # Errors
            /// It states two, or its numbers cannot be used.
            pub(super) fn read(section: &Section<'_>) -> Result<Self> {
                let stated = |keys: &&'static [Key]| keys.iter().map(|key| key.name).find(|name| section.has(name));
                section.one_of(&KEYS.iter().filter_map(stated).collect::<Vec<_>>())?;
                $(if let Some(law) = $file::read(section)? {
                    return Ok(Self::$name(law));
                })*
                Ok(Self::Constant(ConstantPower))
            }

            /// Power (W) of a piece at its own temperature (K), where `base` (W) is its share of the stated power.
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
    /// Whether the power follows the temperature.
    pub fn follows_temperature(&self) -> bool {
        self.law().follows_temperature()
    }

    /// The same law as one of a linear change; `None` where no coefficient of temperature can be stated beside it.
    pub fn linear(&self) -> Option<LinearPower> {
        self.law().linear()
    }

    /// What is doubtful about the law with these numbers, if anything.
    pub fn note(&self) -> Option<&'static str> {
        self.law().note()
    }
}
