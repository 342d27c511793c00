//! Targets of `coldplate export`, and what each is made of.

use clap::ValueEnum;
use coldplate_base::error::Result;
use coldplate_export::Target;
use coldplate_interchange::foreign;
use coldplate_tables::Table;

/// Target of an export.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum To {
    /// A source file and a header in C99
    C99,
    /// A functional mock-up unit of version 2
    Fmu2,
    /// A functional mock-up unit of version 3
    Fmu3,
    /// A page with sliders
    Html,
    /// Everything in the file
    Json,
    /// A package for Modelica
    Modelica,
    /// A function for Octave and MATLAB
    Octave,
    /// A model for ONNX
    Onnx,
    /// A function block in structured text, for controllers
    St,
    /// A tabular file for Dakota, from a table
    Dakota,
    /// A sample for OpenTURNS, from a table
    Openturns,
    /// An input deck for CalculiX, from a machine at one condition
    Calculix,
    /// The machine in three dimensions, coloured by temperature, as binary glTF, from a machine at one condition
    Glb,
}

/// Source of an export.
pub enum Made {
    /// A surrogate, in a form of its own crate.
    Surrogate(Target),
    /// A table, in the form of another program, with the ending of its name.
    Table(fn(&Table) -> Result<String>, &'static str),
    /// A machine at one condition.
    Machine,
}

impl To {
    /// Source of the target.
    pub fn made(self) -> Made {
        match self {
            Self::C99 => Made::Surrogate(Target::C99),
            Self::Fmu2 => Made::Surrogate(Target::Fmu2),
            Self::Fmu3 => Made::Surrogate(Target::Fmu3),
            Self::Html => Made::Surrogate(Target::Html),
            Self::Json => Made::Surrogate(Target::Json),
            Self::Modelica => Made::Surrogate(Target::Modelica),
            Self::Octave => Made::Surrogate(Target::Octave),
            Self::Onnx => Made::Surrogate(Target::Onnx),
            Self::St => Made::Surrogate(Target::St),
            Self::Dakota => Made::Table(foreign::dakota, ".dat"),
            Self::Openturns => Made::Table(foreign::openturns, "_openturns.csv"),
            Self::Calculix | Self::Glb => Made::Machine,
        }
    }
}

impl std::fmt::Display for To {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.to_possible_value().as_ref().map_or("", |value| value.get_name()))
    }
}
