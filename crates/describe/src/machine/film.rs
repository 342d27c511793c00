//! The film coefficient of a channel.

use super::symbols::Symbols;
use super::variables::formula;
use coldplate_base::document::Section;
use coldplate_base::error::{Error, Result};
use coldplate_base::formula::{Formula, FormulaValues};
use coldplate_base::units::Dimension;
use coldplate_physics::channel::Wall;
use coldplate_physics::water::LiquidProperties;

/// Source of the film coefficient of a channel.
#[derive(Debug, Clone, PartialEq)]
pub enum FilmSource {
    /// From the correlations of [`coldplate_physics::channel`], times `bend_factor`.
    Correlation {
        /// Heat-transfer augmentation by bends (1 = straight).
        bend_factor: f64,
        /// Thermal boundary condition of the laminar branch.
        wall: Wall,
    },
    /// Given film coefficient, W/(m² K).
    Given(f64),
    /// A formula of the condition and of the flow (`FLOW_NAMES`) for the film, W/(m² K).
    Formula(Formula),
    /// A formula for the Nusselt number, with the names of [`FilmSource::Formula`].
    Nusselt(Formula),
}

/// Names that formulas of a film may use beside the condition, in the order of [`FlowState::values`].
const FLOW_NAMES: [&str; 8] = ["Re", "Pr", "Pr_wall", "D_over_L", "mu_over_mu_wall", "diameter_m", "conductivity_W_m_K", "velocity_m_s"];

/// The state of the flow in a channel, for formulas of a film.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FlowState {
    /// Reynolds number.
    pub reynolds: f64,
    /// The liquid at its mean temperature.
    pub liquid: LiquidProperties,
    /// The liquid at the mean temperature of the wall.
    pub at_wall: LiquidProperties,
    /// Hydraulic diameter, m.
    pub diameter: f64,
    /// Wetted length, m.
    pub length: f64,
    /// Mean velocity, m/s.
    pub velocity: f64,
}

impl FlowState {
    /// Values of [`FLOW_NAMES`].
    fn values(&self) -> [f64; FLOW_NAMES.len()] {
        let Self { reynolds, liquid, at_wall, diameter, length, velocity } = *self;
        let viscosities = liquid.viscosity / at_wall.viscosity;
        [reynolds, liquid.prandtl(), at_wall.prandtl(), diameter / length, viscosities, diameter, liquid.conductivity, velocity]
    }
}

impl FilmSource {
    /// The film stated in a section; `None` if it follows the correlations.
    pub(super) fn read(section: &Section<'_>, symbols: &Symbols) -> Result<Option<Self>> {
        let Some(key) = section.one_of(&["film", "nusselt"])? else { return Ok(None) };
        let value = section.value(key)?;
        if key == "film" && value.is_text() && value.text()? == "correlation" {
            return Ok(None);
        }
        if let Some(key) = section.one_of(&["bend_factor", "wall"])? {
            return Err(section.error_at(key, format!("a given film has no '{key}'")).help("remove it, or write film = \"correlation\""));
        }
        if value.quantity(Dimension::FILM).is_ok() && key == "film" {
            return Ok(Some(Self::Given(value.positive(Dimension::FILM)?)));
        }
        let mut extended = symbols.clone();
        for name in FLOW_NAMES {
            extended.names.add(name).map_err(|_| {
                value
                    .error(format!("formulas of a film need the name '{name}', which this machine gives to something else"))
                    .help("rename that variable, definition or drive")
            })?;
        }
        let help = format!(
            "write \"correlation\", a value such as \"2251 W/(m2 K)\", or a formula of the condition and {}",
            FLOW_NAMES.join(", ")
        );
        let is_word = |text: &str| text.chars().all(char::is_alphabetic) && extended.names.slot(text).is_none();
        if value.is_text() && is_word(&value.text()?) {
            return Err(value.error("this is no film").help(help));
        }
        let read = |dimension: Dimension| formula(&value, dimension, &extended);
        Ok(Some(if key == "nusselt" { Self::Nusselt(read(Dimension::NUMBER)?) } else { Self::Formula(read(Dimension::FILM)?) }))
    }

    /// The value of a film's formula at a flow, where `names` are the values of the machine's names.
    ///
    /// # Errors
    /// The value is not finite, or not larger than zero.
    pub fn evaluate(formula: &Formula, names: &FormulaValues, flow: &FlowState) -> Result<f64> {
        let value = formula.evaluate(&FormulaValues(names.0.iter().copied().chain(flow.values()).collect()))?;
        if value > 0.0 {
            return Ok(value);
        }
        let error = Error::input("the film that this formula gives is not larger than zero")
            .read(format!("{value} from {} at Re = {:.1}, Pr = {:.3}", formula.text(), flow.reynolds, flow.liquid.prandtl()))
            .help("write a formula that is positive at every flow, or keep the flow in its range");
        Err(formula.place(error))
    }
}
