//! `coldplate serve` as its clients meet it: the same answers as the command line, refusals, floods, kills, slow clients, its end.

mod answers;
mod client;
mod described;
mod limits;
mod page;
mod refused;
mod reread;
mod under_load;

use std::io::{BufRead, BufReader};
use std::path::PathBuf;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use client::{Answer, Client};
use serde_json::Value;

use crate::common::{coldplate, root};

const UNCERTAIN: &str = "crates/runtime/fixtures/uncertain.cps";
const HELD: &str = "crates/runtime/fixtures/held.cps";
const LARGE: &str = "crates/runtime/fixtures/bench-uncertain.cps";

fn printed(args: &[&str]) -> Value {
    let output = coldplate(args);
    let text = String::from_utf8_lossy(&output.stdout);
    serde_json::from_str(&text).unwrap_or_else(|e| panic!("{e}\n{text}\n{}", String::from_utf8_lossy(&output.stderr)))
}

fn scratch(name: &str) -> PathBuf {
    crate::common::scratch(&format!("serve/{name}"))
}

/// A service of its own, which ends with the test.
struct Service {
    child: Child,
    address: String,
}

impl Service {
    /// On a port that the system chooses.
    fn start(args: &[&str]) -> Self {
        Self::start_at("127.0.0.1:0", args)
    }

    fn start_at(address: &str, args: &[&str]) -> Self {
        Self::start_heard(address, args, Stdio::inherit())
    }

    /// What it says of itself goes to `log`.
    fn start_heard(address: &str, args: &[&str], log: Stdio) -> Self {
        let mut child = Command::new(env!("CARGO_BIN_EXE_coldplate"))
            .args(["serve", "--listen", address, "--json"])
            .args(args)
            .current_dir(root())
            .stdout(Stdio::piped())
            .stderr(log)
            .spawn()
            .expect("the program starts");
        let (mut lines, mut text) = (BufReader::new(child.stdout.take().unwrap()), String::new());
        while !text.ends_with("}\n") {
            assert!(lines.read_line(&mut text).unwrap() > 0, "it ended before it could be asked: {text}");
        }
        let record: Value = serde_json::from_str(&text).unwrap();
        let address = record["address"].as_str().unwrap().strip_prefix("http://").unwrap().to_owned();
        Self { child, address }
    }

    fn client(&self) -> Client {
        Client::to(&self.address).expect("the service listens")
    }

    fn get(&self, path: &str) -> Answer {
        self.client().send("GET", path, &[], b"").expect("an answer")
    }

    fn post(&self, path: &str, body: &str) -> Answer {
        self.client().post(path, body).expect("an answer")
    }

    fn signal(&self, name: &str) {
        let sent = Command::new("kill").args([name, &self.child.id().to_string()]).status().unwrap();
        assert!(sent.success());
    }

    /// Its exit status, if it ends within some seconds.
    fn ends_within(&mut self, seconds: u64) -> Option<i32> {
        let began = Instant::now();
        while began.elapsed() < Duration::from_secs(seconds) {
            if let Some(status) = self.child.try_wait().unwrap() {
                return status.code();
            }
            std::thread::sleep(Duration::from_millis(20));
        }
        None
    }
}

impl Drop for Service {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
