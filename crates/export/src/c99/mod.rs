//! One header and one source file in C99: the numbers as tables, and the runtime's arithmetic in the runtime's order.

mod pair;
mod single;

use std::fmt::Write as _;

use coldplate_runtime::Surrogate;

use crate::content::{Content, Point, SelfTest};
use crate::name::{comment, distinct};
use crate::template::{Filling, wrapped};
use crate::{ExportError, File};
use pair::Pair;
use single::Single;

/// The header file.
const HEADER: &str = include_str!("surrogate.h");
/// The source file.
const SOURCE: &str = include_str!("surrogate.c");
/// Arithmetic of pairs, for single precision.
const PAIRS: &str = include_str!("pairs.c");

pub(crate) fn write(content: &Content, name: &str) -> Vec<File> {
    let [header, source] = filled(content, name, None);
    vec![File::new(format!("{name}.h"), header.into_bytes()), File::new(format!("{name}.c"), source.into_bytes())]
}

/// Header and source for single precision, with the error of single precision.
pub(crate) fn write_single(surrogate: &Surrogate<'_>, content: &Content, name: &str) -> Result<Vec<File>, ExportError> {
    let single = Single::of(surrogate, content)?;
    let [header, source] = filled(content, name, Some(&single)).map(|text| single::narrowed(&text).into_bytes());
    let mut source = File::new(format!("{name}.c"), source);
    source.remark = Some(remark(content, &single));
    Ok(vec![File::new(format!("{name}.h"), header), source])
}

/// Remark on the error of single precision: the largest for each unit.
fn remark(content: &Content, single: &Single) -> String {
    let mut most: Vec<(&Point, f64)> = Vec::new();
    for (point, error) in content.points.iter().zip(&single.errors) {
        match most.iter_mut().find(|(other, _)| other.unit == point.unit) {
            Some(own) if own.1 >= *error => {}
            Some(own) => *own = (point, *error),
            None => most.push((point, *error)),
        }
    }
    let each = |(point, error): &(&Point, f64)| format!("{error:.1e} {} ('{}')", single::unit_of_errors(&point.unit), point.name);
    let all: Vec<String> = most.iter().map(each).collect();
    format!("values within {} of those in double precision", all.join(" and "))
}

/// Header and source, in double precision or for single precision.
fn filled(content: &Content, name: &str, single: Option<&Single>) -> [String; 2] {
    let mut filling = Filling::of(content);
    let is_paired = single.is_some_and(|own| own.is_paired);
    filling.flag("single", single.is_some());
    filling.flag("paired", is_paired);
    if is_paired {
        pair_flags(&mut filling, content);
        let pairs = filling.fill(PAIRS, name);
        filling.block("pairs", pairs);
    }
    let tests: Vec<&SelfTest> = content.self_tests.iter().chain(single.into_iter().flat_map(|own| &own.tests)).collect();
    filling.block("head", head(content, name));
    filling.block("counts", counts(content, tests.len(), &name.to_uppercase()));
    filling.block("names", names(content, &name.to_uppercase()));
    filling.block("include", format!("#include \"{name}.h\"\n"));
    let mut tables = Tables { name, is_paired, text: String::new() };
    if let Some(single) = single {
        tables.text.push_str("/* By how much values may be off in single precision. */\n");
        tables.numbers("value_errors", single.errors.iter().copied());
        tables.text.push('\n');
    }
    filling.block("tables", tables.of(content, &tests));
    [filling.fill(HEADER, name), filling.fill(SOURCE, name)]
}

/// Flags for the functions of pairs that are used, and for the functions of plain numbers that are then unused.
fn pair_flags(filling: &mut Filling, content: &Content) {
    let holds = |flag: &str| filling.flags.get(flag).copied().unwrap_or(false);
    let has_ln = holds("ln");
    let flags = [
        ("pair_ln", has_ln),
        ("pair_exp", has_ln || holds("gaussian")),
        ("pair_root", holds("cubic") || holds("multiquadric")),
        ("pair_quotient", holds("reciprocal") || holds("multiquadric")),
        ("exp", !content.limits.is_empty()),
    ];
    for (flag, value) in flags {
        filling.flag(flag, value);
    }
}

/// Comment at the top of both files.
fn head(content: &Content, name: &str) -> String {
    let mut text = format!(" * {name}: a surrogate of {} points over {} variables.\n", content.points.len(), content.variables.len());
    for held in &content.held {
        let _ = writeln!(text, " * For {} = {:?} {} alone.", comment(&held.name), held.value, comment(&held.unit));
    }
    text
}

fn counts(content: &Content, self_tests: usize, name: &str) -> String {
    let counts = [
        ("VARIABLES", content.variables.len()),
        ("POINTS", content.points.len()),
        ("LIMITS", content.limits.len()),
        ("SELF_TESTS", self_tests),
    ];
    let states = content.in_time.as_ref().map(|own| ("TIME_STATES", own.states));
    counts.into_iter().chain(states).map(|(what, count)| format!("#define {name}_{what} {count}\n")).collect()
}

/// Macros for the places of variables, points and limits.
fn names(content: &Content, name: &str) -> String {
    let mut text = String::from("/* Places of the variables in a condition. */\n");
    let places = distinct(content.variables.iter().map(|v| v.name.as_str()));
    for (index, (own, place)) in content.variables.iter().zip(&places).enumerate() {
        let (said, unit) = (comment(&own.name), comment(&own.unit));
        let place = place.to_uppercase();
        let _ = writeln!(text, "#define {name}_VARIABLE_{place} {index} /* {said}, {:?} to {:?} {unit} */", own.low, own.high);
    }
    text.push_str("\n/* Places of the points in the values. */\n");
    let places = distinct(content.points.iter().map(|p| p.name.as_str()));
    for (index, (own, place)) in content.points.iter().zip(&places).enumerate() {
        let _ =
            writeln!(text, "#define {name}_POINT_{} {index} /* {}, {} */", place.to_uppercase(), comment(&own.name), comment(&own.unit));
    }
    if !content.limits.is_empty() {
        text.push_str("\n/* Numbers of the limits. */\n");
    }
    let places = distinct(content.limits.iter().map(|l| l.name.as_str()));
    for (index, (own, place)) in content.limits.iter().zip(&places).enumerate() {
        let _ =
            writeln!(text, "#define {name}_LIMIT_{} {index} /* {}, at most {:?} */", place.to_uppercase(), comment(&own.name), own.maximum);
    }
    text
}

/// The constants of the source file.
struct Tables<'n> {
    name: &'n str,
    /// Whether the numbers of the bases are stored as pairs.
    is_paired: bool,
    text: String,
}

impl Tables<'_> {
    fn of(mut self, content: &Content, self_tests: &[&SelfTest]) -> String {
        let upper = self.name.to_uppercase();
        let name = self.name;
        let limits = !content.limits.is_empty();
        let models = [("POLYNOMIALS", content.polynomials.len()), ("BASES", content.bases.len())];
        for (what, count) in models.into_iter().filter(|(what, count)| *count > 0 || *what == "POLYNOMIALS") {
            let _ = writeln!(self.text, "#define {upper}_{what} {count}");
        }
        self.text.push_str("\n/* Fitted ranges. */\n");
        self.numbers("low", content.variables.iter().map(|v| v.low));
        self.numbers("high", content.variables.iter().map(|v| v.high));
        self.text.push_str("\n/* Half widths of the points' bands of 95 %, by the fit. */\n");
        self.numbers("half_widths", content.points.iter().map(|p| p.half_width));
        if content.points.iter().any(Point::is_displacement) {
            self.text.push_str("\n/* Which points are displacements. */\n");
            self.bytes("displaced", &content.points.iter().map(|p| u8::from(p.is_displacement())).collect::<Vec<_>>());
        }

        self.text.push_str("\n/* u = (g - low) * factor + offset, with g = x (0), 1/x (1) or ln x (2). */\n");
        let _ = writeln!(
            self.text,
            "typedef struct {{\n    double low;\n    double factor;\n    double offset;\n    int transform;\n}} {name}_scaling_entry;\n"
        );
        let entries = content.scalings.iter().map(|s| format!("{{{:?}, {:?}, {:?}, {}}}", s.low, s.factor, s.offset, s.transform as u8));
        self.table(&format!("{name}_scaling_entry"), "scalings", entries);

        for (index, own) in content.polynomials.iter().enumerate() {
            let _ =
                writeln!(self.text, "\n/* Polynomial {index}: term by term, exponents of the variables and coefficients of its points. */");
            self.small(&format!("polynomial_{index}_scalings"), &own.scalings);
            self.bytes(&format!("polynomial_{index}_exponents"), &own.exponents);
            self.indices(&format!("polynomial_{index}_points"), &own.points);
            self.numbers(&format!("polynomial_{index}_coefficients"), own.coefficients.iter().copied());
        }
        let _ = writeln!(
            self.text,
            "\ntypedef struct {{\n    const unsigned char *scalings;\n    const unsigned char *exponents;\n    const double *coefficients;\n    const unsigned short *points;\n    int terms;\n    int columns;\n}} {name}_polynomial_entry;\n"
        );
        let entries = content.polynomials.iter().enumerate().map(|(i, own)| {
            let of = |what: &str| format!("{name}_polynomial_{i}_{what}");
            let (terms, columns) = (own.terms, own.points.len());
            format!("{{{}, {}, {}, {}, {terms}, {columns}}}", of("scalings"), of("exponents"), of("coefficients"), of("points"))
        });
        self.table(&format!("{name}_polynomial_entry"), "polynomials", entries);
        self.bases(content);
        if limits {
            self.limits(content);
        }
        self.uncertainty(content);
        self.in_time(content);
        self.text.push_str("\n/* Self-test vectors. */\n");
        self.numbers("test_conditions", self_tests.iter().flat_map(|t| t.condition.iter().copied()));
        self.numbers("test_values", self_tests.iter().flat_map(|t| t.values.iter().copied()));
        if content.uncertainty.is_some() {
            self.numbers("test_deviations", self_tests.iter().flat_map(|t| t.deviations.iter().copied()));
        }
        self.text
    }

    fn bases(&mut self, content: &Content) {
        let name = self.name;
        if content.bases.is_empty() {
            return;
        }
        if self.is_paired {
            self.pair_scalings(content);
        }
        let kind = self.kind_of_bases();
        for (index, own) in content.bases.iter().enumerate() {
            let _ = writeln!(self.text, "\n/* Basis {index}: centre by centre, coordinates and weights of its points. */");
            self.small(&format!("basis_{index}_scalings"), &own.scalings);
            self.basis_numbers(&format!("basis_{index}_scales"), &own.scales);
            self.basis_numbers(&format!("basis_{index}_centres"), &own.centres);
            self.indices(&format!("basis_{index}_points"), &own.points);
            self.basis_numbers(&format!("basis_{index}_weights"), &own.weights);
        }
        let _ = writeln!(
            self.text,
            "\n/* Kernels of r: r^2 ln r (0), r^3 (1), sqrt(1 + r^2) (2), exp(-r^2) (3). */\ntypedef struct {{\n    const unsigned char *scalings;\n    const {kind} *scales;\n    const {kind} *centres;\n    const {kind} *weights;\n    const unsigned short *points;\n    int count;\n    int columns;\n    int kernel;\n}} {name}_basis_entry;\n"
        );
        let entries = content.bases.iter().enumerate().map(|(i, own)| {
            let of = |what: &str| format!("{name}_basis_{i}_{what}");
            let tables = [of("scalings"), of("scales"), of("centres"), of("weights"), of("points")].join(", ");
            format!("{{{tables}, {}, {}, {}}}", own.count, own.points.len(), own.kernel as u8)
        });
        self.table(&format!("{name}_basis_entry"), "bases", entries);
    }

    /// The scalings, with their numbers as pairs.
    fn pair_scalings(&mut self, content: &Content) {
        let name = self.name;
        let _ = writeln!(
            self.text,
            "\n/* The scalings once more, for the bases. */\ntypedef struct {{\n    {name}_pair low;\n    {name}_pair factor;\n    {name}_pair offset;\n    int transform;\n}} {name}_pair_scaling;\n"
        );
        let entries = content.scalings.iter().map(|own| {
            let [low, factor, offset] = [own.low, own.factor, own.offset].map(paired);
            format!("{{{low}, {factor}, {offset}, {}}}", own.transform as u8)
        });
        self.table(&format!("{name}_pair_scaling"), "pair_scalings", entries);
    }

    fn kind_of_bases(&self) -> String {
        if self.is_paired { format!("{}_pair", self.name) } else { "double".into() }
    }

    fn basis_numbers(&mut self, what: &str, values: &[f64]) {
        if self.is_paired {
            self.table(&self.kind_of_bases(), what, values.iter().map(|value| paired(*value)));
        } else {
            self.numbers(what, values.iter().copied());
        }
    }

    fn limits(&mut self, content: &Content) {
        let name = self.name;
        self.text.push_str("\n/* Limits. */\n");
        for (index, own) in content.limits.iter().enumerate() {
            let points: Vec<usize> = own.kind.points().collect();
            self.indices(&format!("limit_{index}_points"), &points);
        }
        let _ = writeln!(
            self.text,
            "\n/* A point's value (0), its rise over a variable (1), the difference of two (2), the spread of several (3). */\ntypedef struct {{\n    double maximum;\n    const unsigned short *points;\n    int count;\n    int variable;\n    int kind;\n}} {name}_limit_entry;\n"
        );
        let entries = content.limits.iter().enumerate().map(|(i, own)| {
            let kind = own.code();
            let (count, variable) = (own.kind.points().count(), own.kind.variable().unwrap_or(0));
            format!("{{{:?}, {name}_limit_{i}_points, {count}, {variable}, {kind}}}", own.maximum)
        });
        self.table(&format!("{name}_limit_entry"), "limits", entries);
    }

    fn uncertainty(&mut self, content: &Content) {
        let Some(own) = &content.uncertainty else { return };
        let upper = self.name.to_uppercase();
        let states = own.parameters + content.points.len() + 1;
        self.text
            .push_str("\n/* What the answers leave open: parameters, one state per parameter, per point, and one for all points. */\n");
        for (what, value) in [
            ("PARAMETERS", own.parameters),
            ("SLOPES", own.parameters.max(1)),
            ("STATES", states),
            ("SLOPE_TERM_COUNT", own.terms),
            ("SLOPE_TERMS", own.terms.max(1)),
        ] {
            let _ = writeln!(self.text, "#define {upper}_{what} {value}");
        }
        let _ = writeln!(self.text, "#define {upper}_GROWTH {:?}\n", own.growth);
        self.small("slope_scalings", &own.scalings);
        self.bytes("slope_exponents", &own.exponents);
        self.numbers("slope_table", own.slopes.iter().copied());
        self.numbers("missed_own", own.own.iter().copied());
        self.numbers("missed_common", own.common.iter().copied());
        self.numbers("measured_centre", own.centre.iter().copied());
        self.numbers("measured_halves", own.halves.iter().copied());
        let Some(known) = &own.known else { return };
        self.text
            .push_str("\n/* Mean of the states, packed lower triangle of their covariance, and what the mean adds to each point. */\n");
        self.numbers("mean", known.mean.iter().copied());
        self.numbers("covariance", known.covariance.iter().copied());
        let starts = (0..states).map(|row| format!("{}", row * (row + 1) / 2));
        self.table("int", "rows", starts);
        self.numbers("shift_table", own.shifts(known).into_iter());
    }

    fn in_time(&mut self, content: &Content) {
        let Some(own) = &content.in_time else { return };
        let upper = self.name.to_uppercase();
        self.text.push_str("\n/* The machine over time. */\n");
        for (what, value) in [("STEADY_TERMS", own.steady.count), ("MOVING_TERMS", own.moving.count)] {
            let _ = writeln!(self.text, "#define {upper}_{what} {value}");
        }
        for (what, terms) in [("steady", &own.steady), ("moving", &own.moving)] {
            self.small(&format!("{what}_scalings"), &terms.scalings);
            self.bytes(&format!("{what}_exponents"), &terms.exponents);
        }
        for (what, values) in [
            ("time_errors", &own.errors),
            ("reach", &own.reach),
            ("uniform", &own.uniform),
            ("spread", &own.spread),
            ("steady_coefficients", &own.steady_coefficients),
            ("rates", &own.rates),
            ("outputs", &own.outputs),
        ] {
            self.numbers(what, values.iter().copied());
        }
    }

    fn numbers(&mut self, what: &str, values: impl Iterator<Item = f64>) {
        self.table("double", what, values.map(|value| format!("{value:?}")));
    }

    fn indices(&mut self, what: &str, values: &[usize]) {
        self.table("unsigned short", what, values.iter().map(|value| format!("{value}U")));
    }

    fn small(&mut self, what: &str, values: &[usize]) {
        self.table("unsigned char", what, values.iter().map(|value| format!("{value}U")));
    }

    fn bytes(&mut self, what: &str, values: &[u8]) {
        self.table("unsigned char", what, values.iter().map(|value| format!("{value}U")));
    }

    /// A constant array. C has no empty arrays: an empty table gets one zero that is not read.
    fn table(&mut self, kind: &str, what: &str, entries: impl Iterator<Item = String>) {
        let mut entries: Vec<String> = entries.collect();
        if entries.is_empty() {
            entries.push("0".into());
        }
        let _ = writeln!(self.text, "static const {kind} {}_{what}[{}] = {{", self.name, entries.len());
        self.text.push_str(&wrapped(&entries, "   "));
        self.text.push_str("};\n");
    }
}

/// A number as a pair.
fn paired(value: f64) -> String {
    let Pair { high, low } = Pair::of(value);
    format!("{{{high:?}, {low:?}}}")
}
