//! The examples of docs/how-to/serve.md: what stands there is what comes back.

use serde_json::Value;

use crate::serve::{Service, UNCERTAIN, root};

/// Whether what is shown is part of what came: objects by their keys, numbers to the digits shown.
fn shows(shown: &Value, came: &Value) -> bool {
    match (shown, came) {
        (Value::Object(shown), Value::Object(came)) => shown.iter().all(|(key, value)| came.get(key).is_some_and(|own| shows(value, own))),
        (Value::Array(shown), Value::Array(came)) => {
            shown.len() <= came.len() && shown.iter().zip(came).all(|(shown, came)| shows(shown, came))
        }
        (Value::Number(shown), Value::Number(came)) => {
            let decimals = shown.to_string().split_once('.').map_or(0, |(_, after)| after.len() as i32);
            let (Some(a), Some(b)) = (shown.as_f64(), came.as_f64()) else { return false };
            (a - b).abs() <= 0.51 * 10.0_f64.powi(-decimals)
        }
        _ => shown == came,
    }
}

#[test]
fn examples_show_what_comes_back() {
    let service = Service::start(&[UNCERTAIN]);
    let text = std::fs::read_to_string(root().join("docs/how-to/serve.md")).unwrap();
    let mut count = 0;
    for (before, after) in text.split("```sh\ncurl ").skip(1).filter_map(|example| example.split_once("\n```\n")) {
        let Some(shown) = after.trim_start().strip_prefix("```json\n").and_then(|rest| rest.split("\n```").next()) else { continue };
        let command = before.replace("\\\n", " ");
        let path = command.split("http://127.0.0.1:8080").nth(1).unwrap().split_whitespace().next().unwrap();
        let answer = match command.split("-d '").nth(1) {
            Some(body) => service.post(path, body.split('\'').next().unwrap()),
            None => service.get(path),
        };
        let shown: Value = serde_json::from_str(shown).unwrap_or_else(|e| panic!("{e}: {shown}"));
        assert!(shows(&shown, &answer.json()), "{command}\n{}", answer.text());
        count += 1;
    }
    assert!(count >= 4, "{count} examples were found");
}
