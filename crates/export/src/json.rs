//! Everything in a surrogate file as one JSON object; `docs/reference/export-targets.md` lists its keys.

use coldplate_runtime::{Kernel, LimitKind, Origin, Scale, Surrogate, Transform};

use crate::content::{Content, InTime, Terms};

/// The object; `followed` is the JSON of how the answers follow variables that were held.
pub(crate) fn write(surrogate: &Surrogate<'_>, content: &Content, followed: Option<&str>) -> String {
    let mut members = vec![member("format", text("coldplate surrogate"))];
    members.extend(facts(surrogate).into_iter().map(|(key, value)| member(key, value)));
    members.extend([
        member(
            "scalings",
            list(content.scalings.iter().map(|s| {
                object([
                    member("variable", s.variable.to_string()),
                    member("transform", text(transform(s.transform))),
                    member("low", number(s.low)),
                    member("factor", number(s.factor)),
                    member("offset", number(s.offset)),
                ])
            })),
        ),
        member(
            "polynomials",
            list(content.polynomials.iter().map(|p| {
                object([
                    member("points", indices(&p.points)),
                    member("scalings", indices(&p.scalings)),
                    member("exponents", rows(&p.exponents, content.variables.len(), u8::to_string)),
                    member("coefficients", rows(&p.coefficients, p.points.len(), |c| number(*c))),
                ])
            })),
        ),
        member(
            "bases",
            list(content.bases.iter().map(|b| {
                object([
                    member("points", indices(&b.points)),
                    member("kernel", text(kernel(b.kernel))),
                    member("scalings", indices(&b.scalings)),
                    member("scales", numbers(&b.scales)),
                    member("centres", rows(&b.centres, content.variables.len(), |c| number(*c))),
                    member("weights", rows(&b.weights, b.points.len(), |w| number(*w))),
                ])
            })),
        ),
    ]);
    members.extend(uncertainty(surrogate, content).map(|own| member("uncertainty", own)));
    members.extend(followed.map(|own| member("followed", own.into())));
    members.extend(content.in_time.as_ref().map(|own| member("in_time", in_time(own, content.variables.len()))));
    members.push(member(
        "self_tests",
        list(content.self_tests.iter().map(|test| {
            let mut members = vec![member("condition", numbers(&test.condition)), member("values", numbers(&test.values))];
            if !test.deviations.is_empty() {
                members.push(member("deviations", numbers(&test.deviations)));
            }
            object(members)
        })),
    ));
    members.push(member(
        "provenance",
        list(surrogate.provenance().map(|(key, value)| object([member("key", text(key)), member("value", text(value))]))),
    ));
    let mut written = object(members);
    written.push('\n');
    written
}

/// Facts about variables, points and limits for a reader, by the keys of the object.
pub(crate) fn facts(surrogate: &Surrogate<'_>) -> Vec<(&'static str, String)> {
    vec![
        (
            "variables",
            list(surrogate.variables().map(|v| {
                object([
                    member("name", text(v.name)),
                    member("unit", text(v.unit)),
                    member("low", number(v.low)),
                    member("high", number(v.high)),
                ])
            })),
        ),
        (
            "held",
            list(
                surrogate
                    .held()
                    .map(|h| object([member("name", text(h.name)), member("unit", text(h.unit)), member("value", number(h.value))])),
            ),
        ),
        (
            "points",
            list(surrogate.points().enumerate().map(|(k, p)| {
                let mesh = surrogate.mesh_half_width(k).map(|half| member("mesh", number(half)));
                let whole = [member("name", text(p.name)), member("unit", text(p.unit)), member("half_width", number(p.half_width))];
                object(whole.into_iter().chain(mesh))
            })),
        ),
        (
            "limits",
            list(surrogate.limits().map(|limit| {
                let (kind, points) = match limit.kind {
                    LimitKind::Maximum { .. } => ("maximum", None),
                    LimitKind::Rise { .. } => ("rise", None),
                    LimitKind::Difference { .. } => ("difference", None),
                    LimitKind::Spread(points) => ("spread", Some(points)),
                };
                let looked_at = points.map_or_else(|| limit.kind.points().collect::<Vec<_>>(), |points| points.iter().collect());
                let mut members = vec![member("name", text(limit.name)), member("kind", text(kind)), member("points", indices(&looked_at))];
                members.extend(limit.kind.variable().map(|v| member("variable", v.to_string())));
                members.push(member("maximum", number(limit.maximum)));
                object(members)
            })),
        ),
    ]
}

fn uncertainty(surrogate: &Surrogate<'_>, content: &Content) -> Option<String> {
    let (own, laid_out) = (surrogate.uncertainty()?, content.uncertainty.as_ref()?);
    let parameters = list(own.parameters().map(|p| {
        object([
            member("name", text(p.name)),
            member("unit", text(p.unit)),
            member("nominal", number(p.nominal)),
            member("deviation", number(p.deviation)),
            member("low", number(p.low)),
            member("high", number(p.high)),
            member(
                "scale",
                text(match p.scale {
                    Scale::Linear => "linear",
                    Scale::Log => "log",
                    Scale::Reciprocal => "reciprocal",
                }),
            ),
            member(
                "origin",
                text(match p.origin {
                    Origin::Stated => "stated",
                    Origin::Assumed => "assumed",
                }),
            ),
        ])
    }));
    let per_point = laid_out.terms * laid_out.parameters;
    let slopes = (0..own.point_count()).map(|point| {
        let table = laid_out.slopes.get(point * per_point..(point + 1) * per_point).unwrap_or(&[]);
        rows(table, laid_out.parameters, |slope| number(*slope))
    });
    let mut members = vec![
        member("parameters", parameters),
        member("scalings", indices(&laid_out.scalings)),
        member("exponents", rows(&laid_out.exponents, content.variables.len(), u8::to_string)),
        member("slopes", list(slopes)),
        member(
            "missed",
            list(
                laid_out
                    .own
                    .iter()
                    .zip(&laid_out.common)
                    .map(|(own, common)| object([member("own", number(*own)), member("common", number(*common))])),
            ),
        ),
        member("growth", number(own.growth())),
        member("measured", list(own.measured().map(|row| numbers(&row.iter().collect::<Vec<_>>())))),
    ];
    if let Some(known) = &laid_out.known {
        members.push(member("mean", numbers(&known.mean)));
        members.push(member("covariance", numbers(&known.covariance)));
    }
    Some(object(members))
}

/// The machine over time, by the keys listed in `docs/reference/export-targets.md`.
fn in_time(own: &InTime, variables: usize) -> String {
    let states = own.states;
    let square = |part: &[f64]| rows(part, states, |entry| number(*entry));
    let per_term = |numbers: &[f64], terms: usize| list(numbers.chunks((numbers.len() / terms.max(1)).max(1)).map(square));
    let halves: Vec<&[f64]> = own.uniform.chunks(states.max(1)).collect();
    let uniform = |half: usize| numbers(halves.get(half).copied().unwrap_or_default());
    let points = own.errors.len();
    let terms = |terms: &Terms| {
        vec![member("scalings", indices(&terms.scalings)), member("exponents", rows(&terms.exponents, variables, u8::to_string))]
    };
    let mut steady = terms(&own.steady);
    steady.push(member("coefficients", square(&own.steady_coefficients)));
    let mut moving = terms(&own.moving);
    moving.push(member("rates", per_term(&own.rates, own.moving.count)));
    moving.push(member("outputs", per_term(&own.outputs, points)));
    object([
        member("states", states.to_string()),
        member("errors", numbers(&own.errors)),
        member("reach", numbers(&own.reach)),
        member("uniform", object([member("at_zero", uniform(0)), member("per_unit", uniform(1))])),
        member("covariance", numbers(&own.spread)),
        member("steady", object(steady)),
        member("moving", object(moving)),
        member(
            "self_tests",
            list(own.tests.iter().map(|test| {
                object([
                    member("start", numbers(&test.start)),
                    member("condition", numbers(&test.condition)),
                    member("duration", number(test.duration)),
                    member("values", numbers(&test.values)),
                ])
            })),
        ),
    ])
}

fn transform(transform: Transform) -> &'static str {
    match transform {
        Transform::Identity => "identity",
        Transform::Reciprocal => "reciprocal",
        Transform::Log => "log",
    }
}

fn kernel(kernel: Kernel) -> &'static str {
    match kernel {
        Kernel::ThinPlate => "thin_plate",
        Kernel::Cubic => "cubic",
        Kernel::Multiquadric => "multiquadric",
        Kernel::Gaussian => "gaussian",
    }
}

fn member(key: &str, value: String) -> String {
    format!("{}: {value}", text(key))
}

fn object(members: impl IntoIterator<Item = String>) -> String {
    format!("{{{}}}", members.into_iter().collect::<Vec<_>>().join(", "))
}

fn list(items: impl Iterator<Item = String>) -> String {
    format!("[{}]", items.collect::<Vec<_>>().join(", "))
}

/// Shortest text that reads back as an equal number. Every number of a file is finite.
fn number(value: f64) -> String {
    format!("{value:?}")
}

fn numbers(values: &[f64]) -> String {
    list(values.iter().map(|value| number(*value)))
}

fn indices(values: &[usize]) -> String {
    list(values.iter().map(usize::to_string))
}

fn rows<T>(items: &[T], width: usize, written: impl Fn(&T) -> String) -> String {
    list(items.chunks(width.max(1)).map(|row| list(row.iter().map(&written))))
}

/// A JSON string. `<` is escaped too, so that the object may stand inside a page.
pub(crate) fn text(value: &str) -> String {
    let mut written = String::from("\"");
    for c in value.chars() {
        match c {
            '"' => written.push_str("\\\""),
            '\\' => written.push_str("\\\\"),
            '<' | '\u{2028}' | '\u{2029}' => written.push_str(&format!("\\u{:04x}", u32::from(c))),
            c if c.is_control() => written.push_str(&format!("\\u{:04x}", u32::from(c))),
            c => written.push(c),
        }
    }
    written.push('"');
    written
}
