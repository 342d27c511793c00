//! The page as its readers use it, in Chromium and Firefox: conditions compared, readings laid beside it, by keyboard too.

use std::io::{Read, Write};
use std::net::TcpListener;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use coldplate_export::{Target, export};
use coldplate_runtime::Surrogate;

use crate::{folder, is_there, skipped};

/// Longest wait for a browser that starts on a busy machine.
const PATIENCE: Duration = Duration::from_secs(90);

/// What the browser is made to do, after which it goes to an address that has all that was `told`.
const ACTS: &str = r##"
<script>
(async () => {
  const told = [];
  const tell = (key, value) => told.push(`${key}: ${String(value).replace(/\s+/g, " ").trim()}`);
  const byId = (id) => document.getElementById(id);
  const rest = () => new Promise((done) => setTimeout(done, 100));
  const row = (id, k) => [...byId(id).rows[k].cells].filter((cell) => !cell.hidden).map((cell) => cell.textContent).join(" | ");
  try {
    tell("before", row("points", 1));
    byId("keep").click();
    byId("slider0").focus();
    for (let k = 0; k < 50; k += 1) byId("slider0").dispatchEvent(new KeyboardEvent("keydown", { key: "ArrowRight", bubbles: true, cancelable: true }));
    tell("head", row("compared", 0));
    tell("compared", [...byId("compared").rows].map((own) => [...own.cells].map((cell) => cell.textContent).join(" | ")).find((text) => text.startsWith("motor |")));
    tell("kept", byId("kept").textContent);
    byId("forget").click();
    tell("forgotten", byId("compared-whole").hidden);
    const drop = async (text) => {
      byId("summary").textContent = "";
      byId("wrong").hidden = true;
      const files = new DataTransfer();
      files.items.add(new File([text], "tests <b>.csv"));
      document.dispatchEvent(new DragEvent("drop", { dataTransfer: files, bubbles: true, cancelable: true }));
      for (let k = 0; k < 50 && byId("summary").textContent === "" && byId("wrong").hidden; k += 1) await rest();
    };
    await drop(TABLE);
    for (let k = 0; k < byId("residuals").rows.length; k += 1) tell(`residuals ${k}`, row("residuals", k));
    tell("summary", byId("summary").textContent);
    // Charts are drawn in a later frame than the rest.
    for (let k = 0; k < 100 && !byId("predictions").querySelector("title"); k += 1) await rest();
    const chart = () => byId("predictions").querySelector("title").textContent;
    const drawn = chart();
    byId("residuals").querySelector("button").focus();
    tell("button", document.activeElement.textContent);
    document.activeElement.click();
    tell("condition", [0, 1, 2].map((k) => byId(`slider${k}`).value).join(" "));
    for (let k = 0; k < 100 && chart() === drawn; k += 1) await rest();
    for (let k = 0; k < 5; k += 1) await rest();
    tell("charts", byId("predictions").querySelectorAll("svg").length);
    tell("chart", chart());
    tell("here", byId("predictions").querySelectorAll("circle").length);
    const box = byId("predictions").querySelector("svg").getBoundingClientRect();
    byId("predictions").querySelector("svg").dispatchEvent(new MouseEvent("click", { clientX: box.left + box.width, clientY: box.top + 5, bubbles: true }));
    tell("clicked", byId("slider0").value === byId("slider0").max);
    for (const wrong of WRONG) { await drop(wrong); tell("wrong", byId("wrong").hidden ? "-" : byId("wrong").textContent); }
    tell("tags", document.querySelectorAll("#drop b, #points b").length);
    const nameless = [...document.querySelectorAll("input, select, button, canvas")].filter((own) => !(own.labels && own.labels.length) && !own.ariaLabel && !own.getAttribute("aria-label") && !own.textContent.trim());
    tell("nameless", nameless.length);
    tell("live", ["verdict", "kept", "summary", "wrong"].map((id) => byId(id).getAttribute("role") || byId(id).getAttribute("aria-live")).join(" "));
    tell("failed", byId("failed").hidden);
  } catch (error) { tell("error", `${error} ${error.stack}`); }
  location = `http://ADDRESS/?${encodeURIComponent(told.join("\n"))}`;
})();
</script>
"##;

/// What a browser tells when it opens a page.
pub fn told(program: &str, arguments: &[String], page: &Path, listener: &TcpListener) -> Vec<String> {
    let mut browser = Command::new(program)
        .args(arguments)
        .arg(format!("file://{}", page.display()))
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .expect("the browser starts");
    listener.set_nonblocking(true).expect("it can be asked");
    let begun = Instant::now();
    let mut request = String::new();
    while begun.elapsed() < PATIENCE {
        let Ok((mut stream, _)) = listener.accept() else {
            std::thread::sleep(Duration::from_millis(20));
            continue;
        };
        stream.set_nonblocking(false).expect("it can be asked");
        stream.set_read_timeout(Some(Duration::from_secs(5))).expect("it can be asked");
        let mut head = [0; 1 << 16];
        let length = stream.read(&mut head).unwrap_or(0);
        let line = String::from_utf8_lossy(&head[..length]).lines().next().unwrap_or_default().to_string();
        let _ = stream.write_all(b"HTTP/1.1 200 OK\r\nContent-Length: 2\r\nConnection: close\r\n\r\nok");
        if line.starts_with("GET /?") {
            request = line;
            break;
        }
    }
    let _ = browser.kill();
    let _ = browser.wait();
    let asked = request.split(' ').nth(1).unwrap_or_default().trim_start_matches("/?");
    unescaped(asked).lines().map(String::from).collect()
}

/// Text of an address.
fn unescaped(text: &str) -> String {
    let (mut bytes, mut rest) = (Vec::new(), text.as_bytes());
    while let [first, after @ ..] = rest {
        let code = (*first == b'%').then(|| std::str::from_utf8(after.get(..2)?).ok().and_then(|hex| u8::from_str_radix(hex, 16).ok()));
        match code.flatten() {
            Some(byte) => {
                bytes.push(byte);
                rest = &after[2..];
            }
            None => {
                bytes.push(*first);
                rest = after;
            }
        }
    }
    String::from_utf8_lossy(&bytes).into_owned()
}

pub fn browsers(folder: &Path) -> Vec<(&'static str, Vec<String>)> {
    let profile = |name: &str| folder.join(name).display().to_string();
    let words = |text: &str| text.split_whitespace().map(String::from).collect::<Vec<_>>();
    let mut chromium = words("--headless --no-sandbox --disable-gpu --disable-quic --no-first-run --disable-background-networking");
    chromium.extend(words("--disable-component-update --disable-sync"));
    chromium.push(format!("--user-data-dir={}", profile("chromium")));
    let firefox = vec!["--headless".into(), "--no-remote".into(), "--profile".into(), profile("firefox")];
    let all = [("chromium", chromium), ("firefox-esr", firefox)];
    all.into_iter()
        .filter(|(program, _)| {
            is_there(program) || {
                skipped(&format!("{program} is not on this machine"));
                false
            }
        })
        .collect()
}

#[test]
fn conditions_are_compared_and_readings_laid_beside() {
    let folder = folder("readers");
    let bytes = std::fs::read(Path::new(env!("CARGO_MANIFEST_DIR")).join("../runtime/fixtures/held.cps")).expect("it is there");
    let surrogate = Surrogate::open(&bytes).expect("the fixtures are intact");
    let value = |x: [f64; 3]| {
        let mut values = [0.0; 2];
        surrogate.evaluate(&x, &mut values).expect("the shapes fit");
        values
    };
    let at = [4.0, 20.0, 22.0];
    // The first row in other units and with a comma in its name, the second without one of the readings.
    let table = format!(
        "# made by hand\r\ntest,coolant_flow [m3/s],coolant_temperature [K],ambient_temperature [degC],motor [degC],screw nut [K],motor_speed [rpm],note\r\n\
         \"<script>alert(1)</script>, first\",{:e},293.15,22,{},{},2500,\"a \"\"note\"\"\"\r\nsecond,{:e},293.15,22,,{},,\r\n",
        4.0 / 6e4,
        value(at)[0] + 0.01,
        value(at)[1] + 273.15 - 2.0,
        4.0 / 6e4,
        value(at)[1] + 273.15,
    );
    let header = "coolant_flow [L/min],coolant_temperature [degC],ambient_temperature [degC],motor [degC]";
    let wrong = [
        (
            format!("{}\n4,20,22,25\n", header.replace("motor [degC]", "moter [degC]")),
            "tests <b>.csv: Column 'moter [degC]' is no variable and no point of this surrogate. Those are: 'coolant_flow [L/min]'",
        ),
        (format!("{}\n4,20,22,25\n", header.replace("motor [degC]", "motor")), "Column 'motor' has no unit. Write 'motor [degC]'."),
        (format!("{}\n4,20,22,25\n", header.replace("L/min", "gal/min")), "this page cannot bring 'gal/min' into 'L/min'"),
        (header.replace("ambient_temperature [degC],", "") + "\n4,20,25\n", "There is no column 'ambient_temperature [degC]'"),
        (format!("{header}\n4,20,22,warm\n"), "Line 2, column 'motor [degC]': 'warm' is no number."),
        (format!("{header}\n4,20,,25\n"), "Line 2, column 'ambient_temperature [degC]': the condition is not stated."),
        (format!("{header}\n4,20,22\n"), "Line 2 has 3 cells, the header 4."),
        (format!("{header},motor_speed [rpm]\n4,20,22,25,1000\n"), "this surrogate was made at 2500 rpm, and knows nothing of 1000"),
        (format!("time [s],{header}\n0,4,20,22,25\n"), "readings over time"),
        (format!("{header}\n"), "no row below it"),
        (String::new(), "no header"),
        (format!("{header}\n4,20,22,\"25\n"), "Line 2: a quoted cell does not end."),
    ];
    let script = |text: &str| format!("{text:?}").replace("\\'", "'").replace('<', "\\x3c");
    let list = wrong.iter().map(|(text, _)| script(text)).collect::<Vec<_>>().join(", ");
    let file = export(&surrogate, Target::Html, "held").expect("the name is one").swap_remove(0);
    let page = String::from_utf8(file.content).expect("a page is text");
    let middle = surrogate.variables().map(|v| 0.5 * (v.low + v.high)).collect::<Vec<_>>();
    let here = value([middle[0], middle[1], middle[2]]);
    let there = value([middle[0] + 50.0 * 10.0 / 500.0, middle[1], middle[2]]);
    for (program, arguments) in browsers(&folder) {
        let listener = TcpListener::bind("127.0.0.1:0").expect("a port is free");
        let address = listener.local_addr().expect("it has one").to_string();
        let acts = ACTS.replace("TABLE", &script(&table)).replace("WRONG", &format!("[{list}]")).replace("ADDRESS", &address);
        let path = folder.join(format!("{program}.html"));
        std::fs::write(&path, page.replace("</body>", &format!("{acts}</body>"))).expect("the folder can be written to");
        if program == "firefox-esr" {
            std::fs::create_dir_all(folder.join("firefox")).expect("the folder can be written to");
        }
        let told = told(program, &arguments, &path, &listener);
        let of = |key: &str| told.iter().filter_map(|line| line.strip_prefix(&format!("{key}: "))).map(String::from).collect::<Vec<_>>();
        let one = |key: &str| of(key).first().cloned().unwrap_or_else(|| panic!("{program}: no {key} in {told:#?}"));
        assert_eq!(of("error"), Vec::<String>::new(), "{program}");
        assert!(one("before").starts_with("motor | ") && one("before").split(" | ").count() == 4, "{program}: {}", one("before"));
        assert_eq!(one("head"), "quantity | unit | set now | kept 1 set forget | change", "{program}");
        let change = format!("{:+.3}", there[0] - here[0]).replace('-', "−");
        assert!(one("compared").ends_with(&format!("| {change}")), "{program}: {} but {change}", one("compared"));
        assert!(one("kept").starts_with("Kept 1: coolant flow 7 L/min"), "{program}: {}", one("kept"));
        assert_eq!(one("forgotten"), "true", "{program}");
        assert_eq!(one("residuals 0"), "test | motor [K] | screw nut [K]", "{program}");
        assert_eq!(one("residuals 1"), "<script>alert(1)</script>, first | +0.010 | −2.000 *", "{program}");
        assert!(
            one("residuals 2").starts_with("second | – | ") && one("residuals 2").ends_with("0.000"),
            "{program}: {}",
            one("residuals 2")
        );
        assert_eq!(one("residuals 3"), "root mean square | 0.010 | 1.414", "{program}");
        assert_eq!(one("summary"), "tests <b>.csv: 2 conditions, 3 readings, 2 of them in their band.", "{program}");
        assert_eq!(one("button"), "<script>alert(1)</script>, first", "{program}");
        let set: Vec<f64> = one("condition").split(' ').map(|number| number.parse().expect("a number")).collect();
        assert!(set.iter().zip(at).all(|(a, b)| (a - b).abs() < 1e-9), "{program}: {set:?}");
        let ends = surrogate.variables().next().map(|own| [own.low, own.high]).expect("there is a variable");
        let [low, high] = ends.map(|flow| value([flow, 20.0, 22.0])[0]).map(|v| format!("{v:.4e}").parse::<f64>().expect("a number"));
        assert_eq!(one("chart"), format!("motor over coolant flow, the rest as set: {low} to {high} °C"), "{program}");
        assert_eq!((one("charts"), one("here"), one("clicked")), ("3".into(), "3".into(), "true".into()), "{program}");
        let said = of("wrong");
        assert_eq!(said.len(), wrong.len(), "{program}");
        for (said, (_, expected)) in said.iter().zip(&wrong) {
            assert!(said.contains(expected), "{program}: '{said}' has no '{expected}'");
        }
        assert_eq!((one("tags"), one("nameless"), one("failed")), ("0".into(), "0".into(), "true".into()), "{program}");
        assert_eq!(one("live"), "polite status status alert", "{program}");
    }
    let _ = std::fs::remove_dir_all(&folder);
}
