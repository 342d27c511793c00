//! Surrogate files that are replaced while the service runs: SIGHUP has them read anew, and no question goes without an answer.

use std::io::Read;
use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use serde_json::{Value, json};

use crate::serve::client::Client;
use crate::serve::{HELD, Service, UNCERTAIN, root, scratch};

const QUERY: &str = "/surrogates/served/query";

fn question() -> String {
    json!({"condition": {"coolant_flow": "4 L/min", "coolant_temperature": "20 degC", "ambient_temperature": "22 degC"}}).to_string()
}

/// What tells the two files apart: half the band of the first point.
fn band(answer: &Value) -> f64 {
    let point = &answer["temperatures"]["motor"];
    point["high"].as_f64().unwrap() - point["degC"].as_f64().unwrap()
}

fn put(fixture: &str, at: &Path) {
    let new = at.with_extension("new");
    std::fs::copy(root().join(fixture), &new).unwrap();
    std::fs::rename(new, at).unwrap();
}

/// Waits until the service answers as `expected`.
fn until(service: &Service, expected: impl Fn(f64) -> bool) {
    let begun = Instant::now();
    while !expected(band(&service.post(QUERY, &question()).json())) {
        assert!(begun.elapsed() < Duration::from_secs(20), "the file was not read anew");
        std::thread::sleep(Duration::from_millis(10));
    }
}

#[test]
fn files_are_read_anew_and_no_answer_is_dropped() {
    let folder = scratch("reread");
    let file = folder.join("served.cps");
    put(UNCERTAIN, &file);
    let log = folder.join("log");
    let heard = std::fs::File::create(&log).unwrap();
    let service = Service::start_heard("127.0.0.1:0", &[file.to_str().unwrap()], Stdio::from(heard));
    let said = || {
        let mut text = String::new();
        std::fs::File::open(&log).unwrap().read_to_string(&mut text).unwrap();
        text
    };
    let first = band(&service.post(QUERY, &question()).json());
    let (stop, answered) = (AtomicBool::new(false), AtomicUsize::new(0));
    std::thread::scope(|scope| {
        for _ in 0..4 {
            scope.spawn(|| {
                let mut client: Client = service.client();
                while !stop.load(Ordering::Relaxed) {
                    let answer = client.post(QUERY, &question()).unwrap();
                    assert_eq!(answer.status, 200, "{}", answer.text());
                    assert!(band(&answer.json()) > 0.0);
                    answered.fetch_add(1, Ordering::Relaxed);
                }
            });
        }
        for turn in 0..6 {
            put([HELD, UNCERTAIN][turn % 2], &file);
            service.signal("-HUP");
            until(&service, |found| (found == first) == (turn % 2 == 1));
        }
        // A file that is cut off changes nothing, and it is said which and why.
        let whole = std::fs::read(root().join(HELD)).unwrap();
        std::fs::write(&file, &whole[..whole.len() / 2]).unwrap();
        service.signal("-HUP");
        let begun = Instant::now();
        while !said().contains("'served' is answered as before") {
            assert!(begun.elapsed() < Duration::from_secs(20), "{}", said());
            std::thread::sleep(Duration::from_millis(10));
        }
        assert_eq!(band(&service.post(QUERY, &question()).json()), first);
        std::fs::remove_file(&file).unwrap();
        service.signal("-HUP");
        // And from there it goes on.
        put(HELD, &file);
        service.signal("-HUP");
        until(&service, |found| found != first);
        stop.store(true, Ordering::Relaxed);
    });
    assert!(answered.load(Ordering::Relaxed) > 100, "{answered:?}");
    assert!(said().contains("served.cps") && said().contains("read anew: "), "{}", said());
    let bytes = Command::new(env!("CARGO_BIN_EXE_coldplate")).args(["info", "--json"]).arg(&file).output().unwrap().stdout;
    let own: Value = serde_json::from_slice(&bytes).unwrap();
    assert_eq!(service.get("/surrogates/served").json(), own, "what is said of a file is that of the new one");
    std::fs::remove_dir_all(&folder).unwrap();
}
