//! Sentences that a test engineer reads, and the numbers in them.

use super::{Hypothesis, Law, LawForm};
use crate::Cause;

/// How a reader counts an amplitude.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Form {
    /// As it is.
    Plain,
    /// As a factor, of which it is the logarithm.
    Factor,
    /// As a factor, which is one more than it.
    Grown,
}

impl Form {
    fn of(self, amplitude: f64) -> f64 {
        match self {
            Self::Plain => amplitude,
            Self::Factor => amplitude.exp(),
            Self::Grown => 1.0 + amplitude,
        }
    }
}

/// What an amplitude is to a reader.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Quantity {
    /// Its name: `heat`, `factor`, `offset` ...
    pub name: &'static str,
    /// Unit; `1` for factors.
    pub unit: &'static str,
    /// How it is counted.
    pub form: Form,
}

impl Quantity {
    /// A number with a unit.
    pub fn plain(name: &'static str, unit: &'static str) -> Self {
        Self { name, unit, form: Form::Plain }
    }

    /// A factor, from its logarithm.
    pub fn factor(name: &'static str) -> Self {
        Self { name, unit: "1", form: Form::Factor }
    }

    /// A factor, from what it is more than one.
    pub fn grown(name: &'static str) -> Self {
        Self { name, unit: "1", form: Form::Grown }
    }
}

/// A cause that is told.
pub struct Told<'a> {
    /// Where and under which law.
    pub hypothesis: &'a Hypothesis,
    /// Its amplitude.
    pub amplitude: f64,
    /// 90 % interval of it.
    interval: (f64, f64),
    form: Form,
}

impl Told<'_> {
    /// Where it acts.
    pub fn place(&self) -> &str {
        &self.hypothesis.place
    }

    /// Two places of it.
    pub(crate) fn both_places(&self) -> String {
        self.hypothesis.place.replace(" - ", " and ")
    }

    /// Whether it depends on nothing.
    pub fn is_constant(&self) -> bool {
        self.hypothesis.law == Law::Constant
    }

    /// How it depends on the condition, to end a sentence with; nothing for a constant.
    pub fn law(&self) -> String {
        if self.is_constant() { String::new() } else { format!(", {}", self.hypothesis.law_words()) }
    }

    /// How it follows the condition, to end a sentence with; nothing where it is always alike.
    pub fn when(&self) -> String {
        if self.hypothesis.law.is_formula() { self.law() } else { String::new() }
    }

    /// Where a number holds that follows a law; nothing of one that says where itself.
    pub(crate) fn where_stated(&self) -> &'static str {
        match self.hypothesis.law {
            Law::Speed | Law::SpeedSquared => " at full speed",
            Law::InverseFlow => " at the middle flow",
            Law::Of(_, LawForm::Proportional | LawForm::Squared | LawForm::Power(_)) => " where that is most",
            Law::Of(_, LawForm::Inverse) => " where that is in the middle",
            Law::Constant | Law::Temperature | Law::Of(..) | Law::Found(_) => "",
        }
    }

    /// "warmer than stated by 0.21 K (0.10 to 0.32)", or colder.
    pub fn warmer(&self) -> String {
        let Self { amplitude, interval: (low, high), .. } = *self;
        if amplitude >= 0.0 {
            return format!("warmer than stated by {}", self.range(" K"));
        }
        format!("colder than stated by {}", Self { amplitude: -amplitude, interval: (-high, -low), ..*self }.range(" K"))
    }

    /// The number with its unit and 90 % interval.
    pub fn range(&self, unit: &str) -> String {
        let (x, y) = (self.form.of(self.interval.0), self.form.of(self.interval.1));
        format!("{}{unit} ({} to {})", number(self.form.of(self.amplitude)), number(x.min(y)), number(x.max(y)))
    }
}

fn number(v: f64) -> String {
    if v == 0.0 {
        return "0".into();
    }
    if v.abs() < 1e-3 {
        return format!("{v:.2e}");
    }
    let digits = match v.abs() {
        a if a >= 100.0 => 0,
        a if a >= 10.0 => 1,
        a if a >= 0.1 => 2,
        _ => 4,
    };
    format!("{v:.digits$}")
}

/// What a cause of an explanation says.
pub fn sentence(cause: &Cause) -> String {
    let (hypothesis, family) = (&cause.hypothesis, cause.hypothesis.effect.family());
    let form = family.quantity(hypothesis.law).form;
    family.sentence(&Told { hypothesis, amplitude: cause.amplitude, interval: cause.interval(), form })
}

/// The number of a cause as a reader means it: factors instead of their logarithms.
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

impl Cause {
    /// Its number with its interval.
    pub fn shown(&self) -> Shown {
        let Quantity { name, unit, form } = self.hypothesis.effect.family().quantity(self.hypothesis.law);
        let (low, high) = self.interval();
        Shown { name, value: form.of(self.amplitude), low: form.of(low), high: form.of(high), unit }
    }
}
