//! Many conditions as a stream: in order, in little memory, in the columns that were asked for.

use std::fmt::Write as _;
use std::io::{BufRead, BufReader, Read};
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

const HEADER: &str = "test,coolant_flow [L/min],coolant_temperature [degC],ambient_temperature [degC],motor_speed [rpm]\n";

struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("coldplate-stream-{name}-{}", std::process::id()));
        std::fs::create_dir_all(&path).unwrap();
        std::fs::copy(super::fixture("bench-polynomial.cps"), path.join("ten.cps")).unwrap();
        Self(path)
    }

    fn table(&self, rows: usize) {
        let mut text = String::from(HEADER);
        for i in 0..rows {
            let share = i as f64 / rows as f64;
            writeln!(text, "row {i},{},{},{},{}", 2.0 + 10.0 * share, 15.0 + 10.0 * share, 18.0 + 8.0 * share, 100.0 + 2900.0 * share)
                .unwrap();
        }
        std::fs::write(self.0.join("many.csv"), text).unwrap();
    }

    fn command(&self, words: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_coldplate"));
        command.args(["query", "ten.cps"]).args(words).current_dir(&self.0).stdin(Stdio::null());
        command
    }

    fn query(&self, words: &[&str]) -> Output {
        self.command(words).output().unwrap()
    }

    fn text(&self, words: &[&str]) -> String {
        String::from_utf8(self.query(words).stdout).unwrap()
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

#[test]
fn rows_come_in_order_whatever_the_number_of_threads() {
    let folder = Folder::new("order");
    folder.table(5000);
    let one = folder.text(&["--csv", "many.csv", "--threads", "1"]);
    assert_eq!(one, folder.text(&["--csv", "many.csv", "--threads", "5"]));
    assert_eq!(one.lines().count(), 5001);
    assert!(one.lines().skip(1).enumerate().all(|(i, line)| line.starts_with(&format!("row {i},"))));
    // A row says what a single query says.
    let single = folder.query(&[
        "--json",
        "--coolant-flow",
        "7 L/min",
        "--coolant-temperature",
        "20 degC",
        "--motor-speed",
        "1550 rpm",
        "--ambient-temperature",
        "22 degC",
    ]);
    let single: serde_json::Value = serde_json::from_slice(&single.stdout).unwrap();
    let many: serde_json::Value = serde_json::from_str(&folder.text(&["--csv", "many.csv", "--json"])).unwrap();
    let row = &many["conditions"][2500];
    assert_eq!((&row["test"], &row["line"]), (&serde_json::json!("row 2500"), &serde_json::json!(2502)));
    for key in ["temperatures", "verdict", "limits", "binding", "in_domain"] {
        assert_eq!(row[key], single[key], "{key}");
    }
    let cells: Vec<&str> = one.lines().nth(2501).unwrap().split(',').collect();
    assert_eq!(cells[5].parse::<f64>().unwrap(), single["temperatures"]["point 0"]["degC"].as_f64().unwrap());
}

#[test]
fn columns_and_digits_are_chosen() {
    let folder = Folder::new("columns");
    folder.table(3);
    let text = folder.text(&["--csv", "many.csv", "--columns", "verdict, margins,test", "--digits", "3"]);
    let mut lines = text.lines();
    let header: Vec<&str> = lines.next().unwrap().split(',').collect();
    assert_eq!(
        (header[0], header[1], header[12], header[13], header.len()),
        ("verdict", "margin of maximum 0", "margin of spread", "test", 14)
    );
    for line in lines {
        let cells: Vec<&str> = line.split(',').collect();
        assert!(
            cells[1..13].iter().all(|c| c.parse::<f64>().is_ok() && c.trim_start_matches(['-', '0', '.']).replace('.', "").len() <= 3),
            "{line}"
        );
    }
    assert!(
        folder.text(&["--csv", "many.csv", "--columns", "point 3 [degC],conditions"]).starts_with("point 3 [degC],coolant_flow [L/min],")
    );
    let json = folder.text(&["--csv", "many.csv", "--json", "--columns", "point 3,verdict,binding", "--digits", "4"]);
    let json: serde_json::Value = serde_json::from_str(&json).unwrap();
    let row = json["conditions"][1].as_object().unwrap();
    assert_eq!(row.len(), 3);
    assert!(row["point 3"].to_string().len() <= 5, "{row:?}");
    let wrong = folder.query(&["--csv", "many.csv", "--columns", "verdct"]);
    let message = String::from_utf8_lossy(&wrong.stderr).into_owned();
    assert_eq!(wrong.status.code(), Some(2));
    assert!(message.contains("--columns") && message.contains("did you mean 'verdict'"), "{message}");
    assert_eq!(folder.query(&["--csv", "many.csv", "--digits", "0"]).status.code(), Some(2));
}

#[test]
fn a_mistake_in_the_last_row_shows_before_the_first_answer() {
    let folder = Folder::new("mistake");
    folder.table(4000);
    let path = folder.0.join("many.csv");
    let text = std::fs::read_to_string(&path).unwrap() + "last,8,x,21,300\n";
    std::fs::write(&path, text).unwrap();
    for json in [&[][..], &["--json"]] {
        let output = folder.query(&[&["--csv", "many.csv"], json].concat());
        let message = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!((output.status.code(), output.stdout.len()), (Some(2), 0), "{message}");
        assert!(message.contains("many.csv:4002") && message.contains("coolant_temperature"), "{message}");
    }
    std::fs::write(&path, HEADER).unwrap();
    assert_eq!(folder.query(&["--csv", "many.csv"]).status.code(), Some(2));
}

#[cfg(target_os = "linux")]
#[test]
fn a_stream_without_end_or_lines_is_refused() {
    let folder = Folder::new("endless");
    let output = folder.query(&["--csv", "/dev/zero"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&output.stderr).contains("longer than 1 MiB"));
}

#[cfg(target_os = "linux")]
#[test]
fn memory_does_not_grow_with_the_file() {
    let folder = Folder::new("memory");
    folder.table(200_000);
    for json in [&[][..], &["--json"]] {
        let mut child = folder.command(&[&["--csv", "many.csv"], json].concat()).stdout(Stdio::piped()).spawn().unwrap();
        let status = PathBuf::from(format!("/proc/{}/status", child.id()));
        let mut stdout = child.stdout.take().unwrap();
        let (mut piece, mut bytes, mut peak) = (vec![0; 1 << 20], 0, 0);
        loop {
            let read = stdout.read(&mut piece).unwrap();
            if read == 0 {
                break;
            }
            bytes += read;
            peak = peak.max(resident(&status));
        }
        child.wait().unwrap();
        assert!(bytes > 50_000_000, "{bytes}");
        assert!(peak > 0 && peak < 50_000, "{peak} kB resident for {bytes} bytes");
    }
}

/// The largest resident memory so far, kB.
fn resident(status: &Path) -> usize {
    let text = std::fs::read_to_string(status).unwrap_or_default();
    let line = text.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    line.and_then(|line| line.trim().trim_end_matches("kB").trim().parse().ok()).unwrap_or(0)
}

#[cfg(target_os = "linux")]
#[test]
fn a_closed_pipe_is_forgiven_and_a_full_disk_is_not() {
    let folder = Folder::new("pipe");
    folder.table(20_000);
    let whole = folder.query(&["--csv", "many.csv"]).status.code();
    let mut child = folder.command(&["--csv", "many.csv"]).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    let mut first = String::new();
    BufReader::new(child.stdout.take().unwrap()).read_line(&mut first).unwrap();
    let mut message = String::new();
    child.stderr.take().unwrap().read_to_string(&mut message).unwrap();
    assert_eq!((child.wait().unwrap().code(), message.as_str()), (whole, ""));
    let full = std::fs::File::options().write(true).open("/dev/full").unwrap();
    assert_eq!(folder.command(&["--csv", "many.csv"]).stdout(full).status().unwrap().code(), Some(2));
}
