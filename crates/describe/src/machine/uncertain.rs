//! Uncertainties stated in a machine file apart from the uncertain numbers themselves: factors shared by several
//! numbers, correlations, and the model error.

use super::keys::uncertain::{COMMON, GROWTH, KINDS, SENSORS};
use super::readings::Sensor;
use super::variables::DescribedVariable;
use coldplate_base::document::{Document, Section, Uncertain, Value, suggestion};
use coldplate_base::error::{Error, Result};
use coldplate_base::units::{Dimension, Measurand};

/// A kind of numbers that may share a factor.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub enum NumberKind {
    /// Films of all coolant channels.
    Films,
    /// Heats of all sources.
    Heats,
    /// Emissivities of all radiating surfaces.
    Emissivities,
    /// Conductances of all contacts.
    Contacts,
}

impl NumberKind {
    /// All kinds.
    pub const ALL: [Self; 4] = [Self::Films, Self::Heats, Self::Emissivities, Self::Contacts];

    /// The word for the kind in a machine file.
    pub fn word(self) -> &'static str {
        KINDS[self as usize]
    }
}

/// Numbers that share an uncertain factor.
#[derive(Debug, Clone, PartialEq)]
pub enum SharedNumbers {
    /// All numbers of a kind.
    All(NumberKind),
    /// Numbers under these dotted keys.
    Keys(Vec<String>),
}

/// An uncertain factor shared by several numbers, or an uncertain offset shared by several temperatures.
#[derive(Debug, Clone, PartialEq)]
pub struct SharedFactor {
    /// Name of the factor.
    pub name: String,
    /// The numbers that the factor multiplies.
    pub of: SharedNumbers,
    /// Standard deviation of the factor, or of the offset in kelvin.
    pub deviation: f64,
    /// Whether the factor is an offset.
    pub is_offset: bool,
    /// Source of the standard deviation, in the words of the file.
    pub source: Option<String>,
}

/// Two uncertain numbers that deviate together.
#[derive(Debug, Clone, PartialEq)]
pub struct Correlation {
    /// Keys of numbers, or names of factors.
    pub between: [String; 2],
    /// Correlation coefficient, -1 to 1.
    pub value: f64,
}

/// Model error, as standard deviations in kelvin.
#[derive(Debug, Clone, PartialEq)]
pub struct ModelError {
    /// Standard deviation at each sensor alone, in the order of the machine's sensors, K; um for displacements.
    pub sensors: Vec<f64>,
    /// Standard deviation common to all sensors, K.
    pub common: f64,
    /// Relative growth of the model error per half of a variable's range away from the mean of the measured conditions
    /// (share).
    pub growth: f64,
    /// The conditions at which the model was compared with measurements, SI, one value per variable.
    pub measured: Vec<Vec<f64>>,
    /// Whether the file states any of these numbers.
    pub is_stated: bool,
}

/// Refuses uncertain limits: a verdict takes them as exact.
pub(super) fn check_places(document: &Document) -> Result<()> {
    let is_limit = |key: &str| Document::names_in(key).is_some_and(|names| names.first().is_some_and(|name| name == "limit"));
    match document.uncertain().into_iter().find(|own| is_limit(&own.key)) {
        None => Ok(()),
        Some(Uncertain { key, .. }) => Err(Error::input("the uncertainty of a limit has no effect: a verdict takes it as exact")
            .at_key(&key)
            .help("write the value that must not be exceeded; the uncertainty of the machine under it is counted")),
    }
}

/// Reads `[uncertain.NAME]`.
pub(super) fn shared_factors(root: &Section<'_>) -> Result<Vec<SharedFactor>> {
    let mut found = Vec::new();
    for (name, section) in root.sections("uncertain")? {
        let of = match section.one_of(&["all", "numbers"])? {
            Some("all") => SharedNumbers::All(NumberKind::ALL[section.choice("all", &KINDS)?]),
            Some(_) => SharedNumbers::Keys(section.list("numbers")?.iter().map(Value::text).collect::<Result<_>>()?),
            None => {
                let help = "write all = \"films\", or numbers = [\"contact.foot.conductance\", ...]";
                return Err(section.error("this factor multiplies nothing").help(help));
            }
        };
        if matches!(&of, SharedNumbers::Keys(keys) if keys.is_empty()) {
            return Err(section.error_at("numbers", "there is no number here").help("name the keys that share the factor"));
        }
        let kind = section.one_of(&["deviation", "limits", "offset"])?;
        let is_offset = kind == Some("offset");
        let deviation = match kind {
            Some("offset") => section.quantity("offset", Dimension::DIFFERENCE)?,
            Some("deviation") => section.number("deviation")?,
            Some(_) => {
                let limits = section.number("limits")?;
                if limits >= 1.0 {
                    let error = section.error_at("limits", "these limits reach a factor of zero and below");
                    return Err(error.help("write less than 100 %, for example \"12 %\""));
                }
                limits / 3f64.sqrt()
            }
            None => {
                return Err(section
                    .error("how uncertain this factor is is missing")
                    .help("write deviation = \"7 %\" (a standard deviation), or limits = \"12 %\" (all values within are alike)"));
            }
        };
        if is_offset && matches!(of, SharedNumbers::All(_)) {
            return Err(section.error_at("offset", "an offset is one of temperatures").help("name their keys: numbers = [\"KEY\", ...]"));
        }
        if !(deviation > 0.0 && (deviation < 1.0 || is_offset)) {
            return Err(section
                .error("an uncertain factor deviates by more than nothing and less than all")
                .help("write for example \"7 %\""));
        }
        let source = section.opt_text("source")?;
        section.finish()?;
        found.push(SharedFactor { name, of, deviation, is_offset, source });
    }
    Ok(found)
}

/// Reads `[[correlation]]`.
pub(super) fn correlations(root: &Section<'_>) -> Result<Vec<Correlation>> {
    let mut found = Vec::new();
    for section in root.tables("correlation")? {
        let names: Vec<String> = section.list("between")?.iter().map(Value::text).collect::<Result<_>>()?;
        let [a, b] = <[String; 2]>::try_from(names)
            .map_err(|_| section.error_at("between", "two names are wanted here").help("write between = [\"KEY\", \"KEY\"]"))?;
        let value = section.number("value")?;
        if value.is_nan() || value.abs() > 1.0 || a == b {
            let help = "a correlation of two different numbers lies between -1 and 1";
            return Err(section.error_at("value", "this is no correlation").help(help));
        }
        section.finish()?;
        found.push(Correlation { between: [a, b], value });
    }
    Ok(found)
}

/// Reads `[model_error]`.
pub(super) fn model_error(root: &Section<'_>, sensors: &[Sensor], variables: &[DescribedVariable]) -> Result<ModelError> {
    let section = root.section_or_empty("model_error")?;
    let is_stated = root.has("model_error");
    let negative = |key: &str| section.error_at(key, "a standard deviation is not negative").help("leave the key out for none");
    let all = SENSORS.read(&section)?;
    let (common, growth) = (COMMON.read(&section)?, GROWTH.read(&section)?);
    for (key, value) in [("sensors", all), ("common", common), ("growth", growth)] {
        if value < 0.0 {
            return Err(negative(key));
        }
    }
    let usual = |sensor: &Sensor| if sensor.measurand() == Measurand::Temperature { all } else { 0.0 };
    let mut own: Vec<f64> = sensors.iter().map(usual).collect();
    if let Some(given) = section.opt_section("sensor")? {
        for name in given.keys() {
            let value = given.value(name)?;
            let at = sensors.iter().position(|s| s.name == name);
            let known: Vec<&str> = sensors.iter().map(|s| s.name.as_str()).collect();
            let at = at.ok_or_else(|| value.error(format!("there is no sensor '{name}'")).help(suggestion(name, &known)))?;
            let measurand = sensors[at].measurand();
            let deviation = measurand.of_si(value.quantity(measurand.dimension().of_differences())?);
            if deviation < 0.0 {
                return Err(value.error("a standard deviation is not negative").help("write 0 K for none"));
            }
            own[at] = deviation;
        }
    }
    let mut measured = Vec::new();
    for given in section.tables("measured")? {
        let one = |variable: &DescribedVariable| given.quantity(&variable.name, variable.dimension);
        measured.push(variables.iter().filter(|v| given.has(&v.name) || v.default.is_none()).map(one).collect::<Result<Vec<f64>>>()?);
        given.finish()?;
    }
    if let Some(odd) = measured.iter().find(|row| row.len() != variables.len()) {
        let what = format!("a measured condition has {} of {} variables", odd.len(), variables.len());
        return Err(section.error_at("measured", what).help("state every variable of the machine"));
    }
    section.finish()?;
    Ok(ModelError { sensors: own, common, growth, measured, is_stated })
}
