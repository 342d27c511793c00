//! How the answers of a surrogate follow variables that it held, for its page.

use serde_json::{Value, json};

use coldplate_base::error::Result;
use coldplate_runtime::Transform;
use coldplate_surrogate::fit::file;

/// JSON of the held variables that the surrogate file `bytes` follows, and how; `None` if there are none.
///
/// # Errors
/// Bytes that are no surrogate file.
pub fn followed(bytes: &[u8]) -> Result<Option<String>> {
    let surrogate = file::decode(bytes)?;
    let Some(own) = surrogate.followed.as_ref().filter(|own| !own.variables.is_empty()) else {
        return Ok(None);
    };
    // Scaled as in the file: u = (g(x) - low) factor + offset, from -1 to 1 over the range.
    let scaling = |(v, transform): (usize, &Transform)| {
        let variable = &surrogate.variables[v];
        let (name, g): (&str, fn(f64) -> f64) = match transform {
            Transform::Identity => ("identity", |x| x),
            Transform::Reciprocal => ("reciprocal", f64::recip),
            Transform::Log => ("log", f64::ln),
        };
        let (low, high) = (g(variable.low), g(variable.high));
        let (factor, offset) = if high == low { (0.0, 0.0) } else { (2.0 / (high - low), -1.0) };
        json!({ "variable": v, "transform": name, "low": low, "factor": factor, "offset": offset })
    };
    let variables = own
        .variables
        .iter()
        .map(|v| json!({ "held": v.held, "low": v.low, "high": v.high, "coefficients": v.coefficients, "errors": v.errors }));
    let interactions = own.interactions.iter().map(|i| json!({ "point": i.point, "of": i.of, "by": i.by, "factor": i.factor }));
    let whole = json!({
        "scalings": own.transforms.iter().enumerate().map(scaling).collect::<Vec<Value>>(),
        "terms": own.terms,
        "variables": variables.collect::<Vec<Value>>(),
        "interactions": interactions.collect::<Vec<Value>>(),
        "errors": own.errors,
        "limits": own.limits,
    });
    Ok(Some(whole.to_string()))
}
