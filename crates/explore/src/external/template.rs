//! Texts with places for the condition: `{{coolant_flow:L/min}}`.

use std::path::Path;

use coldplate_base::document::suggestion;
use coldplate_base::error::{Error, Result};
use coldplate_base::units;
use coldplate_describe::machine::DescribedVariable;

/// Text that opens a place for a value.
const OPEN: &str = "{{";
/// Text that closes a place for a value.
const CLOSE: &str = "}}";

/// A condition in SI and as it stands in the table, one value per variable in its own unit.
#[derive(Debug, Clone, Copy)]
pub struct TemplateValues<'a> {
    /// Values in SI.
    pub si: &'a [f64],
    /// Values in the variables' own units.
    pub shown: &'a [f64],
}

/// A text with places.
#[derive(Debug, Clone)]
pub(super) struct Template {
    pieces: Vec<Piece>,
}

#[derive(Debug, Clone)]
enum Piece {
    Text(String),
    Value { variable: usize, unit: String },
}

impl Template {
    /// Reads a text; `file` is the name used in errors if the text is that of a file.
    ///
    /// # Errors
    /// A place that is not closed, has no unit, names no variable, or a unit that is not one of the variable.
    pub(super) fn parse(text: &str, file: Option<&Path>, variables: &[DescribedVariable]) -> Result<Self> {
        let (mut pieces, mut rest) = (Vec::new(), text);
        while let Some((before, after)) = rest.split_once(OPEN) {
            let line = 1 + text[..text.len() - after.len()].matches('\n').count();
            let placed = |error: Error| file.map_or(error.clone(), |file| error.in_file(file).at_line(line));
            let closed = after.split_once(CLOSE).filter(|(place, _)| !place.contains('\n'));
            let (place, behind) =
                closed.ok_or_else(|| placed(Error::input("a place for a value is not closed").help("write {{NAME:UNIT}} on one line")))?;
            pieces.push(Piece::Text(before.into()));
            pieces.push(value(place, variables).map_err(|e| placed(e.read(format!("{OPEN}{place}{CLOSE}"))))?);
            rest = behind;
        }
        pieces.push(Piece::Text(rest.into()));
        Ok(Self { pieces })
    }

    /// The text at a condition.
    ///
    /// # Errors
    /// A unit that cannot be expressed, which [`Template::parse`] has ruled out.
    pub(super) fn render(&self, values: TemplateValues<'_>, variables: &[DescribedVariable]) -> Result<String> {
        let piece = |piece: &Piece| match piece {
            Piece::Text(text) => Ok(text.clone()),
            Piece::Value { variable, unit } if *unit == variables[*variable].unit => Ok(number(values.shown[*variable])),
            Piece::Value { variable, unit } => {
                Ok(number(units::express(values.si[*variable], unit, variables[*variable].dimension).map(twelve_digits)?))
            }
        };
        self.pieces.iter().map(piece).collect()
    }

    /// Indices of the variables that have places in the text.
    pub(super) fn variables(&self) -> impl Iterator<Item = usize> {
        self.pieces.iter().filter_map(|piece| if let Piece::Value { variable, .. } = piece { Some(*variable) } else { None })
    }
}

fn value(place: &str, variables: &[DescribedVariable]) -> Result<Piece> {
    let (name, unit) = place.split_once(':').map_or((place.trim(), ""), |(name, unit)| (name.trim(), unit.trim()));
    let known: Vec<&str> = variables.iter().map(|v| v.name.as_str()).collect();
    let variable = known
        .iter()
        .position(|own| *own == name)
        .ok_or_else(|| Error::input(format!("'{name}' is not a variable of this sweep")).help(suggestion(name, &known)))?;
    let own = &variables[variable];
    if unit.is_empty() {
        return Err(
            Error::input("the value needs the unit that the program expects").help(format!("write {OPEN}{name}:{}{CLOSE}", own.unit))
        );
    }
    units::express(units::ZERO_CELSIUS, unit, own.dimension).map_err(|e| Error::input(e.what()).help(e.remedy().unwrap_or_default()))?;
    Ok(Piece::Value { variable, unit: unit.into() })
}

/// Value rounded to twelve digits, as conditions are: the rounding of a conversion of units is no digit of the value.
fn twelve_digits(value: f64) -> f64 {
    format!("{value:.11e}").parse().unwrap_or(value)
}

/// Number as C, Fortran and Python read it: `9.42`, `1.5e-7`.
fn number(value: f64) -> String {
    let size = value.abs();
    if value == 0.0 || (1e-5..1e15).contains(&size) { format!("{value}") } else { format!("{value:e}") }
}

#[cfg(test)]
mod tests {
    use super::*;
    use coldplate_base::units::Dimension;

    fn variables() -> Vec<DescribedVariable> {
        let variable = |name: &str, unit: &str, dimension| DescribedVariable {
            name: name.into(),
            unit: unit.into(),
            dimension,
            default: None,
            range: None,
        };
        vec![variable("coolant_flow", "L/min", Dimension::VOLUME_FLOW), variable("inlet", "degC", Dimension::TEMPERATURE)]
    }

    #[test]
    fn values_stand_in_the_unit_of_their_place() {
        let text = "q = {{coolant_flow:L/min}}\nQ = {{ coolant_flow : m3/s }}, T = {{inlet:K}}\n";
        let template = Template::parse(text, Some(Path::new("deck.inp")), &variables()).unwrap();
        let values = TemplateValues { si: &[9.42 / 6e4, 293.65], shown: &[9.42, 20.5] };
        assert_eq!(template.render(values, &variables()).unwrap(), "q = 9.42\nQ = 0.000157, T = 293.65\n");
        assert_eq!(number(1.5e-7), "1.5e-7");
    }

    #[test]
    fn places_that_cannot_be_filled_are_told_with_their_line() {
        for (text, line, needle) in [
            ("\n\n{{coolant_flaw:L/min}}", 3, "did you mean 'coolant_flow'"),
            ("{{inlet}}", 1, "write {{inlet:degC}}"),
            ("\n{{inlet:bar}}", 2, "not the unit of this quantity"),
            ("{{inlet:degC\n}}", 1, "not closed"),
        ] {
            let error = Template::parse(text, Some(Path::new("deck.inp")), &variables()).unwrap_err();
            assert_eq!(error.location().line, Some(line), "{error}");
            assert!(error.to_string().contains(needle), "{error}");
        }
    }
}
