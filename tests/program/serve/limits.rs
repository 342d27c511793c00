//! Size, time and number of requests; slow clients; the end.

use std::time::{Duration, Instant};

use crate::serve::client::Client;
use crate::serve::{LARGE, Service, UNCERTAIN};

const QUERY: &str = "/surrogates/uncertain/query";
const GOOD: &str = r#"{"condition": {"coolant_flow": "8 L/min", "coolant_temperature": "20 degC", "ambient_temperature": "21 degC"}}"#;
/// A question that takes a good part of a second, or seconds.
const LONG: (&str, &str) = ("/surrogates/bench-uncertain/query", r#"{"indices": true}"#);

#[test]
fn a_body_has_a_length() {
    let service = Service::start(&[UNCERTAIN, "--most-bytes", "1000"]);
    let padded = |length: usize| format!("{GOOD}{}", " ".repeat(length - GOOD.len()));
    assert_eq!(service.post(QUERY, &padded(1000)).status, 200);
    assert_eq!(service.post(QUERY, &padded(1001)).status, 413);
    // In pieces, no length is said before.
    let mut client = service.client();
    client
        .write(
            format!("POST {QUERY} HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\nTransfer-Encoding: chunked\r\n\r\n")
                .as_bytes(),
        )
        .unwrap();
    for _ in 0..3 {
        client.write(format!("200\r\n{}\r\n", " ".repeat(0x200)).as_bytes()).unwrap();
    }
    assert_eq!(client.answer().unwrap().status, 413);
    assert_eq!(service.post(QUERY, GOOD).status, 200);
}

#[test]
fn an_answer_has_a_time() {
    let service = Service::start(&[UNCERTAIN, LARGE, "--most-seconds", "0.02"]);
    let answer = service.post(LONG.0, LONG.1);
    assert_eq!(answer.status, 504, "{}", answer.text());
    assert!(answer.json()["error"]["message"].as_str().unwrap().contains("0.02 s"));
    assert_eq!(service.post(QUERY, GOOD).status, 200);
}

#[test]
fn more_than_it_takes_on_is_sent_away() {
    let service = Service::start(&[UNCERTAIN, LARGE, "--most-requests", "1", "--most-seconds", "60"]);
    std::thread::scope(|scope| {
        // The long one may come while a short one has the only place.
        let long = scope.spawn(|| {
            loop {
                let status = service.post(LONG.0, LONG.1).status;
                if status != 503 {
                    return status;
                }
            }
        });
        let began = Instant::now();
        let mut refused = false;
        while !refused && !long.is_finished() && began.elapsed() < Duration::from_secs(60) {
            let answer = service.post(QUERY, GOOD);
            refused = answer.status == 503 && answer.has("retry-after", "1");
            assert!(refused || answer.status == 200);
        }
        assert!(refused);
        assert_eq!(long.join().unwrap(), 200);
    });
    assert_eq!(service.post(QUERY, GOOD).status, 200);
}

#[test]
fn slow_clients_are_not_waited_for() {
    let service = Service::start(&[UNCERTAIN, "--patience", "1", "--most-seconds", "3", "--most-connections", "40"]);
    let head = format!("POST {QUERY} HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\nContent-Length: 2000\r\n\r\n");
    // They hold half of all places: one drips its head, the other its body.
    let ended: Vec<(Duration, Option<u16>)> = std::thread::scope(|scope| {
        let drip = |mut client: Client, begin: String| {
            let began = Instant::now();
            client.stream.get_ref().set_read_timeout(Some(Duration::from_millis(100))).unwrap();
            let mut sent = client.write(begin.as_bytes());
            loop {
                match client.answer() {
                    Ok(answer) => return (began.elapsed(), Some(answer.status)),
                    Err(e) if matches!(e.kind(), std::io::ErrorKind::WouldBlock | std::io::ErrorKind::TimedOut) => {}
                    Err(_) => return (began.elapsed(), None),
                }
                if sent.is_err() || began.elapsed() > Duration::from_secs(30) {
                    return (began.elapsed(), None);
                }
                sent = client.write(b" ");
            }
        };
        let slow: Vec<_> = (0..20)
            .map(|k| {
                let begin = if k % 2 == 0 { head[..40].to_owned() } else { head.clone() };
                let client = service.client();
                scope.spawn(move || drip(client, begin))
            })
            .collect();
        for _ in 0..20 {
            assert_eq!(service.post(QUERY, GOOD).status, 200);
        }
        slow.into_iter().map(|thread| thread.join().unwrap()).collect()
    });
    for (place, (took, status)) in ended.iter().enumerate() {
        assert!(*took < Duration::from_secs(20), "{took:?}");
        assert!(place % 2 == 0 || matches!(status, Some(408) | None), "{status:?}");
    }
    assert!(ended.iter().any(|(_, status)| *status == Some(408)), "{ended:?}");
}

#[test]
fn one_who_takes_no_answer_is_left() {
    let mut service = Service::start(&[UNCERTAIN, "--patience", "1", "--most-seconds", "2"]);
    let mut client = service.client();
    // Requests in a row whose answers nobody reads fill the buffers of both sides.
    let request = "GET / HTTP/1.1\r\nHost: localhost\r\n\r\n";
    client.stream.get_ref().set_write_timeout(Some(Duration::from_millis(500))).unwrap();
    let began = Instant::now();
    while began.elapsed() < Duration::from_secs(20) && client.write(request.repeat(100).as_bytes()).is_ok() {}
    assert_eq!(service.post(QUERY, GOOD).status, 200);
    service.signal("-TERM");
    assert_eq!(service.ends_within(20), Some(0), "who does not read keeps nobody from the end");
}

#[test]
fn at_the_end_what_is_under_way_is_answered() {
    for signal in ["-TERM", "-INT"] {
        let mut service = Service::start(&[UNCERTAIN, LARGE, "--most-seconds", "60"]);
        let mut idle = service.client();
        assert_eq!(idle.post(QUERY, GOOD).unwrap().status, 200);
        let mut asking = service.client();
        let answer = std::thread::spawn(move || asking.post(LONG.0, LONG.1).unwrap());
        // It is under way once the service counts it.
        let began = Instant::now();
        while !idle.send("GET", "/metrics", &[], b"").unwrap().text().contains("coldplate_requests_in_flight 2") {
            assert!(began.elapsed() < Duration::from_secs(30) && !answer.is_finished());
        }
        service.signal(signal);
        let answer = answer.join().unwrap();
        assert_eq!(answer.status, 200);
        assert!(answer.json()["quantities"].as_array().is_some_and(|q| !q.is_empty()));
        assert_eq!(service.ends_within(20), Some(0), "{signal}");
        assert!(Client::to(&service.address).is_err(), "nobody listens any more");
    }
}
