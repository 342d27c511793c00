//! The description of the service for programs: OpenAPI 3.1.

use serde_json::{Map, Value, json};

/// Paths and their common parts; the schemas of questions and answers come from their types.
const PATHS: &str = include_str!("openapi.json");

/// The description; `secured` if a token is asked for.
pub(crate) fn describe(schemas: Map<String, Value>, secured: bool) -> Value {
    // A unit test makes sure that the text can be read.
    let mut described: Value = serde_json::from_str(PATHS).unwrap_or_default();
    described["info"]["version"] = env!("CARGO_PKG_VERSION").into();
    if let Some(own) = described["components"]["schemas"].as_object_mut() {
        own.extend(schemas);
    }
    if secured {
        described["components"]["securitySchemes"] = json!({"token": {"type": "http", "scheme": "bearer"}});
        described["security"] = json!([{"token": []}]);
        described["paths"]["/health"]["get"]["security"] = json!([]);
    }
    described
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_paths_are_read() {
        let described = describe(Map::new(), true);
        assert_eq!(described["openapi"], "3.1.0");
        assert_eq!(described["paths"]["/health"]["get"]["security"], json!([]));
        assert!(described["components"]["schemas"]["Refusal"].is_object());
    }
}
