//! The answers are those of the command line.

use serde_json::json;

use crate::serve::{HELD, LARGE, Service, UNCERTAIN, coldplate, printed, root, scratch};

const COMMON: [&str; 6] = ["--coolant-flow", "8 L/min", "--coolant-temperature", "20 degC", "--ambient-temperature", "21 degC"];
const CONDITION: &str = r#""coolant_flow": "8 L/min", "coolant_temperature [degC]": 20, "ambient-temperature": "294.15 K""#;

#[test]
fn a_question_is_answered_as_at_the_terminal() {
    let service = Service::start(&[UNCERTAIN, HELD, LARGE]);
    let parameters = printed(&["info", UNCERTAIN, "--json"])["uncertain"].clone();
    let (name, value) = (parameters[0]["name"].as_str().unwrap(), parameters[0]["value"].as_f64().unwrap());
    let known = match parameters[0]["unit"].as_str().unwrap() {
        "1" => value.to_string(),
        unit => format!("{value} {unit}"),
    };
    let at = format!("{name}={known}");
    let stated = [&COMMON[..], &["--at", &at]].concat();
    let cases = [
        (COMMON.to_vec(), format!("{{\"condition\": {{{CONDITION}}}}}")),
        ([&COMMON[..], &["--confidence", "0.6"]].concat(), format!("{{\"condition\": {{{CONDITION}}}, \"confidence\": 0.6}}")),
        (stated, format!("{{\"condition\": {{{CONDITION}, \"{name}\": \"{known}\"}}}}")),
        ([&COMMON[2..], &["--free", "coolant_flow"]].concat(), free(&["coolant_flow"])),
        ([&COMMON[2..], &["--free", "coolant_flow=3..5 L/min"]].concat(), free(&["coolant_flow=3..5 L/min"])),
        (
            vec!["--free", "coolant_flow,coolant_temperature", "--ambient-temperature", "21 degC"],
            json!({"condition": {"ambient_temperature": "21 degC"}, "free": ["coolant_flow", "coolant_temperature"]}).to_string(),
        ),
        (
            vec!["--minimise", "coolant_flow_L_min", "--ambient-temperature", "21 degC"],
            json!({"condition": {"ambient_temperature": "21 degC"}, "minimise": "coolant_flow_L_min"}).to_string(),
        ),
        (
            vec!["--maximise", "smallest_margin", "--ambient-temperature", "21 degC"],
            json!({"condition": {"ambient_temperature": "21 degC"}, "maximise": "smallest_margin"}).to_string(),
        ),
        (vec!["--indices"], r#"{"indices": true}"#.to_owned()),
    ];
    let mut client = service.client();
    for (args, question) in cases {
        let answer = client.post("/surrogates/uncertain/query", &question).unwrap();
        assert_eq!(answer.status, 200, "{question}: {}", answer.text());
        assert!(answer.has("content-type", "application/json"));
        assert_eq!(answer.json(), printed(&[&["query", UNCERTAIN, "--json"], &args[..]].concat()), "{question}");
    }
}

fn free(names: &[&str]) -> String {
    let condition = json!({"coolant_temperature": "20 degC", "ambient_temperature": "21 degC"});
    json!({"condition": condition, "free": names}).to_string()
}

#[test]
fn held_variables_are_named_and_held_to() {
    let service = Service::start(&[HELD]);
    let info = printed(&["info", HELD, "--json"]);
    assert_eq!(service.get("/surrogates/held").json(), info);
    let middle = |v: &serde_json::Value| {
        let value = f64::midpoint(v["low"].as_f64().unwrap(), v["high"].as_f64().unwrap());
        (format!("{} [{}]", v["name"].as_str().unwrap(), v["unit"].as_str().unwrap()), json!(value))
    };
    let condition: serde_json::Map<_, _> = info["variables"].as_array().unwrap().iter().map(middle).collect();
    let answer = service.post("/surrogates/held/query", &json!({"condition": condition}).to_string()).json();
    let held = &info["held"][0];
    assert_eq!(answer["held"][held["name"].as_str().unwrap()]["value"], held["value"]);
    assert_eq!(answer["in_domain"], true);
    let mut elsewhere = condition.clone();
    elsewhere.insert(
        format!("{} [{}]", held["name"].as_str().unwrap(), held["unit"].as_str().unwrap()),
        json!(held["value"].as_f64().unwrap() * 1.5 + 1.0),
    );
    let answer = service.post("/surrogates/held/query", &json!({"condition": elsewhere}).to_string()).json();
    assert_eq!((answer["in_domain"].clone(), answer["verdict"].clone()), (json!(false), json!("uncertain")));
}

#[test]
fn many_conditions_come_back_in_their_order() {
    let service = Service::start(&[UNCERTAIN]);
    let flows: Vec<f64> = (0..300).map(|i| 4.0 + 0.02 * f64::from(i)).collect();
    let condition = |flow: &f64| json!({"coolant_flow [L/min]": flow, "coolant_temperature": "20 degC", "ambient_temperature": "21 degC"});
    let batch = json!({"conditions": flows.iter().map(condition).collect::<Vec<_>>(), "confidence": 0.9}).to_string();
    let found = service.post("/surrogates/uncertain/batch", &batch).json();
    let mut client = service.client();
    for (flow, own) in flows.iter().zip(found["conditions"].as_array().unwrap()) {
        let question = json!({"condition": condition(flow), "confidence": 0.9}).to_string();
        assert_eq!(own, &client.post("/surrogates/uncertain/query", &question).unwrap().json());
    }
    assert_eq!(found["conditions"].as_array().unwrap().len(), flows.len());
    let chosen = json!({"conditions": flows.iter().map(condition).collect::<Vec<_>>(), "columns": ["temperatures", "verdict"]}).to_string();
    let chosen = client.post("/surrogates/uncertain/batch", &chosen).unwrap().json();
    for (row, whole) in chosen["conditions"].as_array().unwrap().iter().zip(found["conditions"].as_array().unwrap()) {
        let points = whole["temperatures"].as_object().unwrap();
        assert!(points.iter().all(|(name, point)| row[name] == point["degC"]) && row.as_object().unwrap().len() == points.len() + 1);
    }
    assert_eq!(chosen["conditions"].as_array().unwrap().len(), flows.len());

    let rows: String = flows.iter().map(|flow| format!("{flow},20,21\n")).collect();
    let rows = format!("coolant_flow [L/min],coolant_temperature [degC],ambient_temperature [degC]\n{rows}");
    let file = scratch("table").join("rows.csv");
    std::fs::write(&file, &rows).unwrap();
    let expected = |options: &[&str]| coldplate(&[&["query", UNCERTAIN, "--csv", file.to_str().unwrap()], options].concat()).stdout;
    let mut asked = |options: &str| {
        let path = format!("/surrogates/uncertain/table{options}");
        client.send("POST", &path, &["Content-Type: text/csv; charset=utf-8"], rows.as_bytes()).unwrap()
    };
    let answer = asked("");
    assert!(answer.has("content-type", "text/csv"));
    assert_eq!(answer.text(), String::from_utf8(expected(&[])).unwrap());
    let answer = asked("?columns=coolant_flow,margins&columns=verdict&digits=4&confidence=0.9");
    let options = ["--columns", "coolant_flow,margins,verdict", "--digits", "4", "--confidence", "0.9"];
    assert_eq!(answer.text(), String::from_utf8(expected(&options)).unwrap());
}

#[test]
fn pages_are_those_of_the_export() {
    let folder = scratch("page");
    let written = coldplate(&["export", UNCERTAIN, "--to", "html", "--out", folder.to_str().unwrap()]);
    assert!(written.status.success());
    let page = std::fs::read(folder.join("uncertain.html")).unwrap();
    let alone = Service::start(&[UNCERTAIN]);
    let front = alone.get("/");
    assert!(front.body == page && front.has("content-type", "text/html") && front.has("content-security-policy", "default-src 'none'"));

    // A name that no address can carry is made one that can.
    let strange = folder.join("my <plate> ü.cps");
    std::fs::copy(root().join(HELD), &strange).unwrap();
    let several = Service::start(&[UNCERTAIN, strange.to_str().unwrap()]);
    let front = several.get("/").text();
    let links: Vec<&str> = front.split("href=\"").skip(1).filter_map(|rest| rest.split('"').next()).collect();
    assert_eq!(links, ["/surrogates/uncertain/page", "/surrogates/my__plate___/page"]);
    assert_eq!(several.get(links[0]).body, page);
    assert!(links.iter().all(|link| several.get(link).status == 200));
    assert_eq!(several.get("/surrogates").json(), json!({"surrogates": ["uncertain", "my__plate___"]}));
}
