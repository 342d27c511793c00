//! Sentences that a test engineer reads.

use super::{Act, Law, Part};

/// What a part of an explanation says.
pub fn sentence(part: &Part) -> String {
    let h = &part.hypothesis;
    let (low, high) = part.interval();
    let a = part.amplitude;
    let number = |v: f64| {
        let digits = if v.abs() >= 100.0 {
            0
        } else if v.abs() >= 10.0 {
            1
        } else if v.abs() >= 0.1 {
            2
        } else {
            4
        };
        format!("{v:.digits$}")
    };
    let range = |f: &dyn Fn(f64) -> f64, unit: &str| {
        let (x, y) = (f(low), f(high));
        format!("{}{unit} ({} to {})", number(f(a)), number(x.min(y)), number(x.max(y)))
    };
    let factor = |v: f64| v.exp();
    let same = |v: f64| v;
    let grown = |v: f64| 1.0 + v;
    let law = match h.law {
        Law::Constant => String::new(),
        other => format!(", {}", other.words()),
    };
    match h.act {
        Act::Heat(_) if a >= 0.0 => format!("heat enters at {} that the model lacks: {}{law}", h.place, range(&same, " W")),
        Act::Heat(_) => format!("less heat enters at {} than the model has: {}{law}", h.place, range(&same, " W")),
        Act::UserHeat(_) => format!("'{}' acts, with the amplitude {}", h.place, range(&same, "")),
        Act::Source(_) if h.law == Law::Constant => format!("the heat of {} is {} times what the model has", h.place, range(&grown, "")),
        Act::Source(_) if h.law == Law::Temperature => {
            format!(
                "the heat of {} grows with its temperature otherwise than the model's: {} times as much per 10 K",
                h.place,
                range(&grown, "")
            )
        }
        Act::Source(_) => {
            format!("the heat of {} follows another law: at full speed {} times the model's{law}", h.place, range(&grown, ""))
        }
        Act::Contact(_) if h.law == Law::Constant => {
            format!("the contact {} conducts {} times what the model has", h.place, range(&factor, ""))
        }
        Act::Contact(_) => format!("the contact {} changes with its temperature: {} times per 10 K", h.place, range(&factor, "")),
        Act::Film(_) => format!("the film of channel {} is {} times the model's (below 1: fouling)", h.place, range(&factor, "")),
        Act::Flow(_) => format!("the flow through {} is {} times what is stated", h.place, range(&factor, "")),
        Act::Branch(_) => {
            format!("channel {} is narrowed and gets less of the flow: a loss coefficient of {} more", h.place, range(&same, ""))
        }
        Act::Inlet(_) if h.law == Law::Constant => format!("the water enters {} warmer than stated by {}", h.place, range(&same, " K")),
        Act::Inlet(_) => format!("the line to {} warms the water by {} at the middle flow, less at more flow", h.place, range(&same, " K")),
        Act::Chamber => format!("the chamber wall is warmer than stated by {}", range(&same, " K")),
        Act::Emissivity(_) => format!("the emissivity of {} is {} times the model's", h.place, range(&factor, "")),
        Act::Gas => format!("the chamber holds more residual gas than the model has: {}", range(&same, " Pa")),
        Act::Leak(_) => format!("a cable, hose or foot conducts heat from {} to the surroundings: {}", h.place, range(&same, " W/K")),
        Act::Link(..) => format!("something conducts heat between {}: {}", h.place.replace(" - ", " and "), range(&same, " W/K")),
        Act::Radiate(..) => {
            format!("{} see each other, which the model lacks: {}", h.place.replace(" - ", " and "), range(&same, " m2 of exchange area"))
        }
        Act::Capacity(_) if a >= 0.0 => format!("{} stores more heat than the model has: {}", h.place, range(&same, " J/K")),
        Act::Capacity(_) => format!("{} stores less heat than the model has: {}", h.place, range(&same, " J/K")),
        Act::Loss(_) => {
            format!("{} loses heat to the surroundings, which the model lacks: {} over its outer faces", h.place, range(&same, " W/(m2 K)"))
        }
        Act::Boundary(_) => format!("the film of the boundary {} is {} times the model's", h.place, range(&factor, "")),
        Act::Bias(_) => format!("the sensor {} reads too high by {}", h.place, range(&same, " K")),
        Act::Gain(_) => format!("the sensor {} has a gain of {}", h.place, range(&grown, "")),
        Act::Lag(_) => format!("the sensor {} lags by {}", h.place, range(&same, " s")),
        Act::Swap(..) => format!("the sensors {} are exchanged", h.place.replace(" - ", " and ")),
    }
}

/// The number of a part of an explanation as a reader means it: factors instead of their logarithms.
#[derive(Debug, Clone, PartialEq)]
pub struct Shown {
    /// What it is: `heat`, `factor`, `offset` ...
    pub name: &'static str,
    /// Best value.
    pub value: f64,
    /// Low end of its 90 % interval.
    pub low: f64,
    /// High end.
    pub high: f64,
    /// Unit; `1` for factors.
    pub unit: &'static str,
}

impl Part {
    /// Its number with its interval.
    pub fn shown(&self) -> Shown {
        let (low, high) = self.interval();
        let as_is = |name, unit| Shown { name, value: self.amplitude, low, high, unit };
        let factor = |name| Shown { name, value: self.amplitude.exp(), low: low.exp(), high: high.exp(), unit: "1" };
        let grown = |name| Shown { name, value: 1.0 + self.amplitude, low: 1.0 + low, high: 1.0 + high, unit: "1" };
        match self.hypothesis.act {
            Act::Heat(_) => as_is("heat", "W"),
            Act::UserHeat(_) => as_is("amplitude", "1"),
            Act::Source(_) if self.hypothesis.law == Law::Temperature => grown("factor_per_10_K"),
            Act::Source(_) | Act::Gain(_) => grown("factor"),
            Act::Contact(_) if self.hypothesis.law != Law::Constant => factor("factor_per_10_K"),
            Act::Contact(_) | Act::Film(_) | Act::Flow(_) | Act::Emissivity(_) | Act::Boundary(_) => factor("factor"),
            Act::Capacity(_) => as_is("heat_capacity", "J/K"),
            Act::Inlet(_) | Act::Chamber | Act::Bias(_) => as_is("offset", "K"),
            Act::Gas => as_is("pressure", "Pa"),
            Act::Loss(_) => as_is("film", "W/(m2 K)"),
            Act::Leak(_) | Act::Link(..) => as_is("conductance", "W/K"),
            Act::Radiate(..) => as_is("exchange_area", "m2"),
            Act::Branch(_) => as_is("loss_coefficient", "1"),
            Act::Lag(_) => as_is("time_constant", "s"),
            Act::Swap(..) => as_is("share", "1"),
        }
    }
}
