//! Description for importers: variables with their units, and the capabilities of the unit.

use std::fmt::Write as _;

use crate::content::{Content, Variable};
use crate::name::distinct;

/// Names of the unit's own variables, which no variable of the surrogate may take.
const OWN: [&str; 7] = ["confidence", "probability", "inside", "state", "time", "at_rest", "initial_temperature"];

pub(super) struct Description<'d> {
    pub(super) content: &'d Content,
    pub(super) name: &'d str,
    pub(super) token: &'d str,
}

/// A variable of the unit.
struct Entry {
    name: String,
    description: String,
    kind: Kind,
}

enum Kind {
    Input {
        unit: String,
        start: f64,
    },
    Confidence,
    Output {
        unit: String,
    },
    Inside,
    State,
    AtRest,
    Initial {
        unit: String,
    },
    /// A state of the dynamics.
    Moving,
    /// The derivative of the state with this reference.
    Slope {
        of: usize,
    },
}

/// Whether a list contains a kind of variable.
type Belongs = fn(&Kind) -> bool;

impl Kind {
    fn is_output(&self) -> bool {
        matches!(self, Self::Output { .. } | Self::Inside | Self::State)
    }

    /// Whether the value is unknown when the initialization begins: true for everything that is calculated.
    fn is_unknown(&self) -> bool {
        self.is_output() || matches!(self, Self::Moving | Self::Slope { .. })
    }
}

/// Start temperature (in the points' unit) of a unit with dynamics that is asked to begin at one temperature. Chosen:
/// room temperature in degC.
const INITIAL: f64 = 20.0;

/// Start value of an input, used until someone sets it: the middle of its range.
pub(super) fn start(variable: &Variable) -> f64 {
    0.5 * variable.low + 0.5 * variable.high
}

impl Description<'_> {
    /// The variables, in the order of their references.
    fn entries(&self) -> Vec<Entry> {
        let content = self.content;
        let named = |prefix: &str, names: Vec<&str>| -> Vec<String> {
            distinct(names.into_iter()).into_iter().map(|name| format!("{prefix}{name}")).collect()
        };
        let inputs = distinct(OWN.into_iter().chain(content.variables.iter().map(|v| v.name.as_str()))).split_off(OWN.len());
        let points = || content.points.iter().map(|p| p.name.as_str()).collect::<Vec<_>>();
        let limits = || content.limits.iter().map(|l| l.name.as_str()).collect::<Vec<_>>();
        let mut entries: Vec<Entry> = content
            .variables
            .iter()
            .zip(inputs)
            .map(|(own, name)| Entry {
                name,
                description: format!("{}, fitted from {:?} to {:?} {}", own.name, own.low, own.high, own.unit),
                kind: Kind::Input { unit: own.unit.clone(), start: start(own) },
            })
            .collect();
        let mut add = |name: String, description: String, kind: Kind| entries.push(Entry { name, description, kind });
        add("confidence".into(), "probability with which a verdict is said".into(), Kind::Confidence);
        for (own, name) in content.points.iter().zip(named("values.", points())) {
            add(name, own.name.clone(), Kind::Output { unit: own.unit.clone() });
        }
        for (own, name) in content.points.iter().zip(named("bands.", points())) {
            let description = format!("{}: half width of the interval that holds the value with a probability of 95 %", own.name);
            add(name, description, Kind::Output { unit: difference(&own.unit).into() });
        }
        for (own, name) in content.limits.iter().zip(named("margins.", limits())) {
            let unit = own.kind.points().next().and_then(|point| content.points.get(point)).map_or("", |point| difference(&point.unit));
            let description = format!("{}: what is left to {:?}, the largest value allowed", own.name, own.maximum);
            add(name, description, Kind::Output { unit: unit.into() });
        }
        for (own, name) in content.limits.iter().zip(named("probabilities.", limits())) {
            add(name, format!("{}: probability that it is kept", own.name), Kind::Output { unit: "1".into() });
        }
        let description = "probability that all limits together are kept; 0 without limits";
        add("probability".into(), description.into(), Kind::Output { unit: "1".into() });
        add("inside".into(), "whether every variable lies in its fitted range".into(), Kind::Inside);
        add("state".into(), "verdict at the confidence".into(), Kind::State);
        let Some(own) = &content.in_time else { return entries };
        for (point, name) in content.points.iter().zip(named("now.", points())) {
            add(name, format!("{}: present reading", point.name), Kind::Output { unit: point.unit.clone() });
        }
        add("at_rest".into(), "whether it begins in the steady state of the inputs".into(), Kind::AtRest);
        let unit = content.points.first().map_or_else(String::new, |point| point.unit.clone());
        add("initial_temperature".into(), "what everything has at the beginning otherwise".into(), Kind::Initial { unit });
        (1..=own.states).for_each(|k| add(format!("states[{k}]"), "state of the dynamics".into(), Kind::Moving));
        let first = entries.len() - own.states;
        for k in 0..own.states {
            let (name, description) = (format!("derivatives[{}]", k + 1), "in a second".to_owned());
            entries.push(Entry { name, description, kind: Kind::Slope { of: first + k } });
        }
        entries
    }

    fn about(&self) -> String {
        let mut text = format!("a surrogate of {} points over {} variables", self.content.points.len(), self.content.variables.len());
        for held in &self.content.held {
            let _ = write!(text, "; for {} = {:?} {} alone", held.name, held.value, held.unit);
        }
        text
    }

    fn indicators(&self) -> usize {
        2 * self.content.variables.len() + 2
    }

    fn units(&self) -> String {
        let mut names: Vec<&str> = self.content.variables.iter().map(|v| v.unit.as_str()).chain(["1"]).collect();
        names.extend(self.content.points.iter().flat_map(|p| [p.unit.as_str(), difference(&p.unit)]));
        names.sort_unstable();
        names.dedup();
        let mut text = String::from("  <UnitDefinitions>\n");
        for name in names.into_iter().filter(|name| !name.is_empty()) {
            let _ = match base(name) {
                Some(base) => writeln!(text, "    <Unit name=\"{}\"><BaseUnit {base}/></Unit>", escaped(name)),
                None => writeln!(text, "    <Unit name=\"{}\"/>", escaped(name)),
            };
        }
        text + "  </UnitDefinitions>\n"
    }

    /// `modelDescription.xml` of version 2.0.
    pub(super) fn two(&self, sources: &[&str]) -> String {
        let (name, entries) = (self.name, self.entries());
        let mut text = format!(
            "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<fmiModelDescription fmiVersion=\"2.0\" modelName=\"{name}\" guid=\"{}\" \
             description=\"{}\" generationTool=\"coldplate {}\" variableNamingConvention=\"structured\" numberOfEventIndicators=\"{}\">\n",
            self.token,
            escaped(&self.about()),
            env!("CARGO_PKG_VERSION"),
            self.indicators()
        );
        for (kind, more) in [("ModelExchange", ""), ("CoSimulation", " canHandleVariableCommunicationStepSize=\"true\"")] {
            let _ = writeln!(
                text,
                "  <{kind} modelIdentifier=\"{name}\"{more} canGetAndSetFMUstate=\"true\" canSerializeFMUstate=\"true\" \
                 providesDirectionalDerivative=\"true\">\n    <SourceFiles>"
            );
            for source in sources {
                let _ = writeln!(text, "      <File name=\"{source}\"/>");
            }
            let _ = writeln!(text, "    </SourceFiles>\n  </{kind}>");
        }
        text += &self.units();
        text.push_str("  <TypeDefinitions>\n    <SimpleType name=\"State\">\n      <Enumeration>\n");
        for (value, item) in STATES.iter().enumerate() {
            let _ = writeln!(text, "        <Item name=\"{item}\" value=\"{value}\"/>");
        }
        text.push_str(
            "      </Enumeration>\n    </SimpleType>\n  </TypeDefinitions>\n  <DefaultExperiment startTime=\"0\" stopTime=\"1\"/>\n",
        );
        text.push_str("  <ModelVariables>\n");
        for (reference, own) in entries.iter().enumerate() {
            let (roles, element) = match &own.kind {
                Kind::Input { unit, start } => {
                    ("causality=\"input\" variability=\"continuous\"", format!("<Real{} start=\"{start:?}\"/>", unit_of(unit)))
                }
                Kind::Confidence => {
                    ("causality=\"parameter\" variability=\"tunable\"", "<Real unit=\"1\" min=\"0.5\" max=\"1\" start=\"0.95\"/>".into())
                }
                Kind::Output { unit } => {
                    ("causality=\"output\" variability=\"continuous\" initial=\"calculated\"", format!("<Real{}/>", unit_of(unit)))
                }
                Kind::Inside => ("causality=\"output\" variability=\"discrete\" initial=\"calculated\"", "<Boolean/>".into()),
                Kind::State => {
                    ("causality=\"output\" variability=\"discrete\" initial=\"calculated\"", "<Enumeration declaredType=\"State\"/>".into())
                }
                Kind::AtRest => ("causality=\"parameter\" variability=\"fixed\"", "<Boolean start=\"true\"/>".into()),
                Kind::Initial { unit } => {
                    ("causality=\"parameter\" variability=\"fixed\"", format!("<Real{} start=\"{INITIAL:?}\"/>", unit_of(unit)))
                }
                Kind::Moving => ("causality=\"local\" variability=\"continuous\" initial=\"calculated\"", "<Real/>".into()),
                Kind::Slope { of } => {
                    ("causality=\"local\" variability=\"continuous\" initial=\"calculated\"", format!("<Real derivative=\"{}\"/>", of + 1))
                }
            };
            let (name, description) = (&own.name, escaped(&own.description));
            let _ = writeln!(
                text,
                "    <ScalarVariable name=\"{name}\" valueReference=\"{reference}\" description=\"{description}\" {roles}>{element}</ScalarVariable>"
            );
        }
        text.push_str("  </ModelVariables>\n  <ModelStructure>\n");
        let lists: [(&str, Belongs); 3] = [
            ("Outputs", Kind::is_output),
            ("Derivatives", |kind| matches!(kind, Kind::Slope { .. })),
            ("InitialUnknowns", Kind::is_unknown),
        ];
        for (list, is_in) in lists {
            let unknowns: Vec<usize> = (0..entries.len()).filter(|place| is_in(&entries[*place].kind)).collect();
            if unknowns.is_empty() {
                continue;
            }
            let _ = writeln!(text, "    <{list}>");
            for place in unknowns {
                let _ = writeln!(text, "      <Unknown index=\"{}\"/>", place + 1);
            }
            let _ = writeln!(text, "    </{list}>");
        }
        text + "  </ModelStructure>\n</fmiModelDescription>\n"
    }

    /// `modelDescription.xml` of version 3.0.
    pub(super) fn three(&self) -> String {
        let (name, entries) = (self.name, self.entries());
        let mut text = format!(
            "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<fmiModelDescription fmiVersion=\"3.0\" modelName=\"{name}\" \
             instantiationToken=\"{}\" description=\"{}\" generationTool=\"coldplate {}\" variableNamingConvention=\"structured\">\n",
            self.token,
            escaped(&self.about()),
            env!("CARGO_PKG_VERSION")
        );
        for (kind, more) in [("ModelExchange", ""), ("CoSimulation", " canHandleVariableCommunicationStepSize=\"true\"")] {
            let _ = writeln!(
                text,
                "  <{kind} modelIdentifier=\"{name}\"{more} canGetAndSetFMUState=\"true\" canSerializeFMUState=\"true\" \
                 providesDirectionalDerivatives=\"true\"/>"
            );
        }
        text += &self.units();
        text.push_str("  <TypeDefinitions>\n    <EnumerationType name=\"State\">\n");
        for (value, item) in STATES.iter().enumerate() {
            let _ = writeln!(text, "      <Item name=\"{item}\" value=\"{value}\"/>");
        }
        text.push_str("    </EnumerationType>\n  </TypeDefinitions>\n  <DefaultExperiment startTime=\"0\" stopTime=\"1\"/>\n");
        text.push_str("  <ModelVariables>\n");
        for (reference, own) in entries.iter().enumerate() {
            let (element, rest) = match &own.kind {
                Kind::Input { unit, start } => {
                    ("Float64", format!("causality=\"input\" variability=\"continuous\"{} start=\"{start:?}\"", unit_of(unit)))
                }
                Kind::Confidence => (
                    "Float64",
                    "causality=\"parameter\" variability=\"tunable\" unit=\"1\" min=\"0.5\" max=\"1\" start=\"0.95\"".to_owned(),
                ),
                Kind::Output { unit } => {
                    ("Float64", format!("causality=\"output\" variability=\"continuous\" initial=\"calculated\"{}", unit_of(unit)))
                }
                Kind::Inside => ("Boolean", "causality=\"output\" variability=\"discrete\" initial=\"calculated\"".to_owned()),
                Kind::State => (
                    "Enumeration",
                    "declaredType=\"State\" causality=\"output\" variability=\"discrete\" initial=\"calculated\"".to_owned(),
                ),
                Kind::AtRest => ("Boolean", "causality=\"parameter\" variability=\"fixed\" start=\"true\"".to_owned()),
                Kind::Initial { unit } => {
                    ("Float64", format!("causality=\"parameter\" variability=\"fixed\"{} start=\"{INITIAL:?}\"", unit_of(unit)))
                }
                Kind::Moving => ("Float64", "causality=\"local\" variability=\"continuous\" initial=\"calculated\"".to_owned()),
                Kind::Slope { of } => {
                    ("Float64", format!("causality=\"local\" variability=\"continuous\" initial=\"calculated\" derivative=\"{of}\""))
                }
            };
            let (name, description) = (&own.name, escaped(&own.description));
            let _ = writeln!(text, "    <{element} name=\"{name}\" valueReference=\"{reference}\" description=\"{description}\" {rest}/>");
        }
        let time = entries.len();
        let _ =
            writeln!(text, "    <Float64 name=\"time\" valueReference=\"{time}\" causality=\"independent\" variability=\"continuous\"/>");
        for place in 0..self.indicators() {
            let reference = time + 1 + place;
            let _ = writeln!(
                text,
                "    <Float64 name=\"indicators[{}]\" valueReference=\"{reference}\" causality=\"local\" variability=\"continuous\" initial=\"calculated\"/>",
                place + 1
            );
        }
        text.push_str("  </ModelVariables>\n  <ModelStructure>\n");
        let lists: [(&str, Belongs); 3] = [
            ("Output", Kind::is_output),
            ("ContinuousStateDerivative", |kind| matches!(kind, Kind::Slope { .. })),
            ("InitialUnknown", Kind::is_unknown),
        ];
        for (list, is_in) in lists {
            for reference in (0..entries.len()).filter(|place| is_in(&entries[*place].kind)) {
                let _ = writeln!(text, "    <{list} valueReference=\"{reference}\"/>");
            }
        }
        for place in 0..self.indicators() {
            let _ = writeln!(text, "    <EventIndicator valueReference=\"{}\"/>", time + 1 + place);
        }
        text + "  </ModelStructure>\n</fmiModelDescription>\n"
    }

    /// `sources/buildDescription.xml` of version 3.0.
    pub(super) fn build(&self, sources: &[&str]) -> String {
        let mut text = format!(
            "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<fmiBuildDescription fmiVersion=\"3.0\">\n  <BuildConfiguration \
             modelIdentifier=\"{}\">\n    <SourceFileSet language=\"C99\">\n",
            self.name
        );
        for source in sources {
            let _ = writeln!(text, "      <SourceFile name=\"{source}\"/>");
        }
        text + "    </SourceFileSet>\n    <Library name=\"m\"/>\n  </BuildConfiguration>\n</fmiBuildDescription>\n"
    }
}

/// Names of the verdicts, by number.
const STATES: [&str; 3] = ["acceptable", "uncertain", "not_acceptable"];

fn unit_of(unit: &str) -> String {
    if unit.is_empty() { String::new() } else { format!(" unit=\"{}\"", escaped(unit)) }
}

/// The unit of a difference of two values.
fn difference(unit: &str) -> &str {
    if unit == "degC" { "K" } else { unit }
}

/// A unit in SI base units, if it is one that surrogates of machines use; other units are known by name alone.
fn base(unit: &str) -> Option<&'static str> {
    Some(match unit {
        "1" => "",
        "K" => "K=\"1\"",
        "degC" => "K=\"1\" offset=\"273.15\"",
        "m" => "m=\"1\"",
        "mm" => "m=\"1\" factor=\"0.001\"",
        "s" => "s=\"1\"",
        "W" => "kg=\"1\" m=\"2\" s=\"-3\"",
        "kW" => "kg=\"1\" m=\"2\" s=\"-3\" factor=\"1000\"",
        "Pa" => "kg=\"1\" m=\"-1\" s=\"-2\"",
        "bar" => "kg=\"1\" m=\"-1\" s=\"-2\" factor=\"100000\"",
        "kg/s" => "kg=\"1\" s=\"-1\"",
        "m3/s" => "m=\"3\" s=\"-1\"",
        "L/min" => "m=\"3\" s=\"-1\" factor=\"1.6666666666666667e-05\"",
        "m/s" => "m=\"1\" s=\"-1\"",
        "A" => "A=\"1\"",
        _ => return None,
    })
}

/// Text in the form allowed in an attribute.
fn escaped(text: &str) -> String {
    text.chars().fold(String::new(), |mut made, c| {
        match c {
            '&' => made.push_str("&amp;"),
            '<' => made.push_str("&lt;"),
            '>' => made.push_str("&gt;"),
            '"' => made.push_str("&quot;"),
            c => made.push(c),
        }
        made
    })
}

#[cfg(test)]
mod tests {
    #[test]
    fn a_name_ends_no_attribute() {
        assert_eq!(super::escaped("\"/><a & b"), "&quot;/&gt;&lt;a &amp; b");
    }
}
