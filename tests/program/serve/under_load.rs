//! Many clients at once, and a service that is killed between them: no answer is lost, none belongs to another question.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use coldplate_runtime::Surrogate;
use serde_json::{Value, json};

use crate::serve::client::Client;
use crate::serve::{Service, UNCERTAIN, root};

const QUERY: &str = "/surrogates/uncertain/query";

/// A condition that no other question has.
fn condition(k: usize) -> [f64; 3] {
    let share = |n: usize| (k.wrapping_mul(n) % 9973) as f64 / 9973.0;
    [4.0 + 6.0 * share(1), 18.0 + 4.0 * share(577), 19.0 + 4.0 * share(3511)]
}

fn question(k: usize) -> String {
    let [flow, coolant, ambient] = condition(k);
    json!({"condition": {"coolant_flow [L/min]": flow, "coolant_temperature [degC]": coolant, "ambient_temperature [degC]": ambient}})
        .to_string()
}

/// Whether an answer is that to question `k`, to the rounding of units.
fn belongs(surrogate: &Surrogate<'_>, k: usize, answer: &Value) -> bool {
    let mut values = vec![0.0; surrogate.point_count()];
    surrogate.query(&condition(k), &mut values).unwrap();
    surrogate.points().zip(values).all(|(point, value)| {
        let found = answer["temperatures"][point.name]["degC"].as_f64().unwrap_or(f64::NAN);
        (found - value).abs() < 1e-9
    })
}

#[test]
fn a_flood_is_answered_one_by_one() {
    let bytes = std::fs::read(root().join(UNCERTAIN)).unwrap();
    let surrogate = Surrogate::open(&bytes).unwrap();
    let service = Service::start(&[UNCERTAIN]);
    let (clients, each) = (100, 60);
    std::thread::scope(|scope| {
        for own in 0..clients {
            let (surrogate, service) = (&surrogate, &service);
            scope.spawn(move || {
                let mut client = service.client();
                for k in own * each..(own + 1) * each {
                    let answer = client.post(QUERY, &question(k)).unwrap();
                    assert_eq!(answer.status, 200, "{}", answer.text());
                    assert!(belongs(surrogate, k, &answer.json()), "question {k}: {}", answer.text());
                    assert!(!belongs(surrogate, k + 1, &answer.json()), "questions differ");
                }
            });
        }
    });
    // Several in one write are answered in their order.
    let mut client = service.client();
    let request = |k: usize| {
        let body = question(k);
        format!(
            "POST {QUERY} HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\nContent-Length: {}\r\n\r\n{body}",
            body.len()
        )
    };
    client.write((0..20).map(request).collect::<String>().as_bytes()).unwrap();
    for k in 0..20 {
        assert!(belongs(&surrogate, k, &client.answer().unwrap().json()));
    }
    let metrics = service.get("/metrics").text();
    let count = clients * each + 20;
    assert!(metrics.contains(&format!("coldplate_conditions_total{{surrogate=\"uncertain\"}} {count}\n")), "{metrics}");
    let counted = format!("coldplate_requests_total{{route=\"/surrogates/{{name}}/query\",status=\"200\"}} {count}\n");
    assert!(metrics.contains(&counted), "{metrics}");
}

#[test]
fn killed_and_restarted_it_answers_everyone_in_the_end() {
    let bytes = std::fs::read(root().join(UNCERTAIN)).unwrap();
    let surrogate = Surrogate::open(&bytes).unwrap();
    let mut service = Service::start(&[UNCERTAIN]);
    let address = service.address.clone();
    let (clients, each, kills) = (16, 400, 3);
    let (answered, lost) = (AtomicUsize::new(0), AtomicUsize::new(0));
    std::thread::scope(|scope| {
        for own in 0..clients {
            let (surrogate, address, answered, lost) = (&surrogate, &address, &answered, &lost);
            scope.spawn(move || {
                let (mut client, began) = (None, Instant::now());
                let mut k = own * each;
                while k < (own + 1) * each {
                    assert!(began.elapsed() < Duration::from_secs(120), "question {k} was not answered");
                    let tried = match client.take() {
                        Some(client) => Ok(client),
                        None => Client::to(address),
                    };
                    let tried = tried.and_then(|mut own| own.post(QUERY, &question(k)).map(|answer| (own, answer)));
                    match tried {
                        Ok((kept, answer)) => {
                            assert!(answer.status == 200 && belongs(surrogate, k, &answer.json()), "{k}: {}", answer.text());
                            client = Some(kept);
                            k += 1;
                            answered.fetch_add(1, Ordering::Relaxed);
                        }
                        Err(_) => {
                            lost.fetch_add(1, Ordering::Relaxed);
                            std::thread::sleep(Duration::from_millis(5));
                        }
                    }
                }
            });
        }
        for kill in 1..=kills {
            while answered.load(Ordering::Relaxed) < kill * clients * each / (kills + 1) {
                std::thread::sleep(Duration::from_millis(1));
            }
            service.child.kill().unwrap();
            service.child.wait().unwrap();
            service = Service::start_at(&address, &[UNCERTAIN]);
        }
    });
    assert_eq!(answered.load(Ordering::Relaxed), clients * each);
    assert!(lost.load(Ordering::Relaxed) > 0, "the kills came between questions");
}
