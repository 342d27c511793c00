//! Limits in words that can stand alone on a page: allowed value, point, and reference.

use coldplate_figures::chart::style::{Quantity, readable};
use coldplate_surrogate::verdict::{LimitKind, Surrogate, condition};

/// Names one after the other, the last with "and".
pub(super) fn listed(names: impl Iterator<Item = String>) -> String {
    let mut names: Vec<String> = names.collect();
    match names.pop() {
        Some(last) if names.is_empty() => last,
        Some(last) => format!("{} and {last}", names.join(", ")),
        None => String::new(),
    }
}

/// Every limit: its name, and the allowed value with its points, in words.
pub(crate) fn worded(surrogate: &Surrogate<'_>) -> Vec<(String, String)> {
    let variables = condition::variables(surrogate);
    let point = |p: usize| surrogate.point(p).map_or(String::new(), |p| p.name.to_string());
    let unit = |p: usize| surrogate.point(p).map_or("", |p| p.unit);
    // Differences of Celsius temperatures are kelvins.
    let apart = |p: usize| if matches!(unit(p), "degC" | "°C") { "K" } else { unit(p) };
    let one = |limit: coldplate_runtime::Limit<'_>| {
        let most = |unit: &str| format!("at most {}", Quantity::new("", unit).with_value(limit.maximum));
        // A limit often has the name of its only point, which is not to be said twice.
        let of = |p: usize, words: String| if point(p) == limit.name { words } else { format!("{} {words}", point(p)) };
        let words = match limit.kind {
            LimitKind::Maximum { point } => of(point, most(unit(point))),
            LimitKind::Rise { point, variable } => {
                let above = variables.get(variable).map_or(String::new(), |v| readable(v.name));
                of(point, format!("{} above {above}", most(apart(point))))
            }
            LimitKind::Difference { first, second } => of(first, format!("{} above {}", most(apart(first)), point(second))),
            LimitKind::Spread(points) => {
                let names: Vec<String> = points.iter().map(point).collect();
                let ends = if names.len() == 2 { "" } else { "the highest and the lowest of " };
                let first = points.iter().next().map_or("", apart);
                format!("{} between {ends}{}", most(first), listed(names.into_iter()))
            }
        };
        (limit.name.to_string(), words)
    };
    surrogate.limits().map(one).collect()
}
