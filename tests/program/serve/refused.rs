//! What is refused, in the words of the terminal, while the service lives on.

use std::time::Duration;

use crate::serve::client::Client;
use crate::serve::{HELD, Service, UNCERTAIN, coldplate, scratch};

const QUERY: &str = "/surrogates/uncertain/query";
const GOOD: &str = r#"{"condition": {"coolant_flow": "8 L/min", "coolant_temperature": "20 degC", "ambient_temperature": "21 degC"}}"#;

#[test]
fn mistakes_are_named_with_their_remedy() {
    let service = Service::start(&[UNCERTAIN]);
    let mut client = service.client();
    let condition = |text: &str| format!("{{\"condition\": {{{text}}}}}");
    let rest = r#""coolant_temperature": "20 degC", "ambient_temperature": "21 degC""#;
    let deep = "[".repeat(100_000);
    let cases = [
        ("", "JSON"),
        ("{", "EOF"),
        ("null", "JSON"),
        ("[]", "not an array"),
        ("{\"condition\": {}} x", "trailing"),
        ("\u{0}", "JSON"),
        (deep.as_str(), "JSON"),
        (r#"{"conditions": {}}"#, "unknown field"),
        (r#"{"condition": {"coolant_flow": [8]}}"#, "Stated"),
        (&condition(rest), "'coolant_flow' is missing"),
        (&condition(&format!("\"coolant_flwo\": \"8 L/min\", {rest}")), "did you mean 'coolant_flow'"),
        (&condition(&format!("\"coolant_flow\": \"8 L/min\", \"coolant_flow\": \"9 L/min\", {rest}")), "given twice"),
        (&condition(&format!("\"coolant_flow\": 8, {rest}")), "L/min"),
        (&condition(&format!("\"coolant_flow [degC]\": 8, {rest}")), "L/min"),
        (&condition(&format!("\"coolant_flow [L/min]\": 1e999, {rest}")), "number"),
        (r#"{"confidence": 0.2}"#, "above 0.5"),
        (r#"{"free": ["nothing"]}"#, "no variable 'nothing'"),
        (r#"{"free": ["coolant_flow"], "indices": true}"#, "indices"),
        (r#"{"minimise": "coolant_flow_L_min", "maximise": "coolant_flow_L_min"}"#, "smallest, or largest"),
        (r#"{"minimise": "system()"}"#, "system"),
    ];
    for (body, word) in cases {
        let answer = client.post(QUERY, body).unwrap();
        let shown = &body[..body.len().min(80)];
        assert_eq!(answer.status, 400, "{shown}: {}", answer.text());
        let message = answer.json()["error"]["message"].as_str().unwrap().to_owned();
        assert!(message.contains(word), "{shown}: {message}");
    }
    let answer =
        client.post("/surrogates/uncertain/batch", &format!("{{\"conditions\": [{{{rest}, \"coolant_flow\": \"8 L/min\"}}, {{{rest}}}]}}"));
    assert_eq!(answer.unwrap().json()["error"]["key"], "conditions[1].coolant_flow");
    let terminal = coldplate(&["query", UNCERTAIN, "--coolant-flow", "8", "--coolant-temperature", "20 degC"]);
    let message = client.post(QUERY, &condition("\"coolant_flow\": \"8\", \"coolant_temperature\": \"20 degC\"")).unwrap().json();
    let message = format!("error: {}\n", message["error"]["message"].as_str().unwrap());
    assert_eq!(message, String::from_utf8_lossy(&terminal.stderr));
    assert_eq!(client.post(QUERY, GOOD).unwrap().status, 200);
}

#[test]
fn paths_methods_kinds_and_hosts() {
    let service = Service::start(&[UNCERTAIN, HELD]);
    let mut client = service.client();
    let kind = "Content-Type: application/json";
    let mut status = |method: &str, path: &str, headers: &[&str]| {
        let answer = client.send(method, path, headers, GOOD.as_bytes()).unwrap();
        assert!(answer.status == 200 || answer.json()["error"]["message"].is_string(), "{}", answer.text());
        answer.status
    };
    assert_eq!(status("POST", QUERY, &[kind]), 200);
    assert_eq!(status("POST", QUERY, &["Content-Type: APPLICATION/JSON; charset=utf-8"]), 200);
    assert_eq!(status("POST", QUERY, &[]), 415);
    assert_eq!(status("POST", QUERY, &["Content-Type: text/plain"]), 415);
    assert_eq!(status("GET", QUERY, &[kind]), 405);
    assert_eq!(status("POST", "/surrogates/unknown/query", &[kind]), 404);
    assert_eq!(status("POST", "/surrogates/..%2f..%2fetc%2fpasswd/query", &[kind]), 404);
    assert_eq!(status("GET", "/nothing", &[]), 404);
    assert_eq!(status("POST", QUERY, &[kind, "Host: example.org"]), 403);
    assert_eq!(status("POST", QUERY, &[kind, "Host: 127.0.0.1:8080"]), 200);
    // Every name that a request gives counts, also that of its address.
    assert_eq!(status("POST", QUERY, &[kind, "Host: localhost", "Host: example.org"]), 403);
    assert_eq!(status("POST", &format!("http://example.org{QUERY}"), &[kind]), 403);
    assert_eq!(status("POST", &format!("http://127.0.0.1{QUERY}"), &[kind]), 200);
}

#[test]
fn a_token_is_asked_for() {
    let file = scratch("token").join("token");
    std::fs::write(&file, "correct-horse-battery\n").unwrap();
    let service = Service::start(&[UNCERTAIN, "--token-file", file.to_str().unwrap()]);
    let mut client = service.client();
    let mut status = |path: &str, headers: &[&str]| {
        let method = if path == QUERY { "POST" } else { "GET" };
        let answer = client.send(method, path, headers, if method == "POST" { GOOD.as_bytes() } else { b"" }).unwrap();
        assert!(answer.status != 401 || answer.has("www-authenticate", "Bearer"));
        answer.status
    };
    let kind = "Content-Type: application/json";
    for wrong in ["Authorization: Bearer correct-horse-batterx", "Authorization: correct-horse-battery", "X-Token: correct-horse-battery"] {
        assert_eq!(status(QUERY, &[kind, wrong]), 401, "{wrong}");
    }
    for path in ["/", "/metrics", "/openapi.json", "/surrogates/uncertain/page", "/nothing"] {
        assert_eq!(status(path, &[]), 401, "{path}");
    }
    assert_eq!(status("/health", &[]), 200);
    // With a token, the service may be known under any name.
    assert_eq!(status(QUERY, &[kind, "Authorization: Bearer correct-horse-battery", "Host: example.org"]), 200);
}

#[test]
fn what_cannot_be_served_is_said_before_it_listens() {
    let folder = scratch("start");
    let same = folder.join("uncertain.cps");
    std::fs::copy(crate::serve::root().join(HELD), &same).unwrap();
    let short = folder.join("short");
    std::fs::write(&short, "secret").unwrap();
    let (same, short) = (same.to_str().unwrap(), short.to_str().unwrap());
    let cases: [(&[&str], &[&str]); 7] = [
        (&[UNCERTAIN, "--listen", "0.0.0.0:0"], &["--listen", "--token-file"]),
        (&[UNCERTAIN, "--listen", "[::]:0"], &["--listen", "--token-file"]),
        (&[UNCERTAIN, "--listen", "0.0.0.0:0", "--token-file", short], &["short", "16"]),
        (&[UNCERTAIN, "--listen", "localhost"], &["invalid"]),
        (&[UNCERTAIN, same], &["two surrogates would be called 'uncertain'"]),
        (&["README.md"], &["README.md"]),
        (&["nowhere.cps"], &["nowhere.cps"]),
    ];
    for (args, words) in cases {
        let output = coldplate(&[&["serve"], args].concat());
        let message = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{args:?}: {message}");
        assert!(words.iter().all(|word| message.contains(word)), "{args:?}: {message}");
    }
    let service = Service::start(&[UNCERTAIN]);
    let output = coldplate(&["serve", UNCERTAIN, "--listen", &service.address]);
    assert_eq!(output.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&output.stderr).contains("another port"));
}

#[test]
fn what_is_no_request_harms_nobody() {
    let service = Service::start(&[UNCERTAIN, "--patience", "2"]);
    let length =
        |n: &str| format!("POST {QUERY} HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\nContent-Length: {n}\r\n\r\n{{}}");
    let rude: Vec<Vec<u8>> = vec![
        b"\r\n\r\n\r\n".to_vec(),
        vec![0xff; 4096],
        b"GET / HTTP/9.9\r\n\r\n".to_vec(),
        b"\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03".to_vec(),
        [b"GET /".as_slice(), &vec![b'a'; 2 << 20], b" HTTP/1.1\r\n\r\n"].concat(),
        [b"GET / HTTP/1.1\r\n".as_slice(), b"A: b\r\n".repeat(100_000).as_slice(), b"\r\n"].concat(),
        length("-1").into_bytes(),
        length("99999999999999999999999").into_bytes(),
        length("5").into_bytes(),
    ];
    for bytes in rude {
        let mut client = service.client();
        client.stream.get_ref().set_read_timeout(Some(Duration::from_secs(20))).unwrap();
        // The service may have closed before everything was sent.
        let _ = client.write(&bytes);
        let _ = client.stream.get_ref().shutdown(std::net::Shutdown::Write);
        if let Ok(answer) = client.answer() {
            assert!((400..500).contains(&answer.status), "{}", answer.head);
        }
        let mut next = Client::to(&service.address).unwrap();
        assert_eq!(next.post(QUERY, GOOD).unwrap().status, 200);
    }
}
